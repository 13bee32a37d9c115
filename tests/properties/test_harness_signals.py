"""What a harness makes of the time: curves that jump, noise of its size, drop-outs that hold."""

import math

import numpy as np
import pytest

from cranktrain_lab.harness.signals import Curve, DroppedOut, Noisy, in_turn


def test_a_curve_is_straight_and_jumps_behind_its_time():
    curve = Curve(1.0)
    curve.go(0.2, 0.4, 3.0)
    curve.go(0.7, 0.7, -1.0)
    assert [curve.at(t) for t in (0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.7, 0.70001, 9.0)] == pytest.approx(
        [1.0, 1.0, 1.0, 2.0, 3.0, 3.0, 3.0, -1.0, -1.0]
    )
    # A sum of steps that ends a rounding behind the jump's time belongs to the step before.
    assert curve.at(0.7 * (1.0 + 1e-15)) == pytest.approx(3.0)
    curve = Curve(1.0)
    curve.go(0.0, 0.0, 5.0)
    assert curve.at(0.0) == curve.at(1e-9) == 5.0  # at the start as well


def test_noise_has_its_size_and_is_the_same_for_a_step_taken_again():
    noise = Noisy(0.1, 0.9, 2.0, (3, 4))
    times = np.linspace(0.1, 0.8999, 4000)
    values = np.array([noise(t, 10.0) for t in times])
    assert values.mean() == pytest.approx(10.0, abs=4 * 2.0 / math.sqrt(4000))
    assert values.std() == pytest.approx(2.0, rel=0.05) and noise(times[7], 10.0) == values[7]
    assert noise(0.05, 10.0) == noise(0.95, 10.0) == 10.0
    assert Noisy(0.1, 0.9, 2.0, (3, 5))(times[7], 10.0) != values[7]


@pytest.mark.parametrize(("gives", "held"), [("last", 2.0), ("zero", 0.0), ("nan", math.nan)])
def test_a_connection_that_drops_out_and_modifiers_in_turn(gives, held):
    broken = DroppedOut(0.15, 0.35, gives)
    found = [broken(t, v) for t, v in ((0.0, 1.0), (0.1, 2.0), (0.2, 3.0), (0.3, 4.0), (0.4, 5.0))]
    np.testing.assert_equal(found, [1.0, 2.0, held, held, 5.0])
    assert in_turn([lambda t, v: v + 1.0, lambda t, v: 2.0 * v])(0.0, 3.0) == 8.0
