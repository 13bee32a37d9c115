"""The rod's law on any motion of the pin: exact tangents, Lagrange's energy, the split of the rod's inertia."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cranktrain.engine.parts import Rod
from cranktrain.loads.slider_crank import remainder_inertia, rod_force

LENGTH, M_B, M_O, DELTA_J, OFFSET = 0.215, 1.5, 2.6, -1.6e-3, 0.004
UPWARD = (2.0, 9.6)


def law(motion, gas=2.0e4, gravity=UPWARD):
    out = np.zeros(16)
    rod_force(*motion, gas, LENGTH, M_B, M_O, DELTA_J, OFFSET, *gravity, out)
    return out


def unit():
    return st.floats(-1.0, 1.0)


@settings(max_examples=60, deadline=None)
@given(st.tuples(*[unit()] * 6), st.floats(-1e4, 1e5))
def test_tangents_are_derivatives_of_the_force(units, gas):
    scale = np.array([0.06, 0.06, 15.0, 15.0, 3000.0, 3000.0])
    motion = np.array(units) * scale
    out = law(motion, gas)

    def slope(i):
        step = np.zeros(6)
        step[i] = 1e-5 * scale[i]
        # Fourth-order differences: errors of 1e-20 of the scale, then rounding.
        near = law(motion + step, gas)[:2] - law(motion - step, gas)[:2]
        far = law(motion + 2 * step, gas)[:2] - law(motion - 2 * step, gas)[:2]
        return (8 * near - far) / (12 * step[i]) * scale[i]

    # Against the size of the force that its parts amount to, 1e5 N, rounded at 1e-16 and divided by 1e-5.
    size = 1e5 + abs(gas)
    for i, tangent in ((0, out[2:4]), (2, out[4:6]), (4, out[[6, 8]]), (5, out[[7, 9]])):
        assert tangent * scale[i] == pytest.approx(slope(i), abs=1e-8 * size)
    # Nothing depends on where along the cylinder, nor how fast, the pin moves.
    assert np.abs(slope(1)).max() < 1e-8 * size
    assert np.abs(slope(3)).max() < 1e-8 * size


def path(t, coefficients):
    """Position, velocity, acceleration (6,) of a pin on a smooth path."""
    (ax, ay), (bx, by) = coefficients
    w = 200.0
    position = np.array([ax * np.sin(w * t + 0.3), ay * np.cos(1.3 * w * t)]) + np.array([bx, by])
    velocity = np.array([ax * w * np.cos(w * t + 0.3), -1.3 * ay * w * np.sin(1.3 * w * t)])
    acceleration = np.array([-ax * w * w * np.sin(w * t + 0.3), -ay * 1.69 * w * w * np.cos(1.3 * w * t)])
    return np.concatenate([position, velocity, acceleration])


def energy(motion):
    x, vx = motion[0] - OFFSET, motion[2]
    s = np.sqrt(LENGTH**2 - x**2)
    piston = motion[3] - x / s * vx
    kinetic = 0.5 * M_B * (vx**2 + motion[3] ** 2) + 0.5 * M_O * piston**2 + 0.5 * DELTA_J * (vx / s) ** 2
    return kinetic + M_B * (UPWARD[0] * motion[0] + UPWARD[1] * motion[1]) + M_O * UPWARD[1] * (motion[1] + s)


@pytest.mark.parametrize("gas", [0.0, 5.0e4])
@pytest.mark.parametrize("t", np.linspace(0.0, 0.03, 7))
def test_power_at_the_pin_is_that_of_gas_and_stored_energy(t, gas):
    shape = ((0.058, 0.05), (0.003, -0.01))
    motion = path(t, shape)
    out = law(motion, gas)
    h = 1e-6
    stored = (8 * (energy(path(t + h, shape)) - energy(path(t - h, shape)))) / (12 * h)
    stored -= (energy(path(t + 2 * h, shape)) - energy(path(t - 2 * h, shape))) / (12 * h)
    power = out[:2] @ motion[2:4] + stored + gas * out[11]
    # 1e3 J differenced over 1e-6 s is rounded at 1e-7 W; the power itself is of the order 1e5 W.
    assert abs(power) < 1e-9 * (1e5 + abs(gas * 10))


def test_piston_moves_as_its_outputs_say():
    shape = ((0.058, 0.05), (0.003, -0.01))
    t, h = 0.011, 1e-6
    before, now, after = (law(path(t + k * h, shape))[10:13] for k in (-1, 0, 1))
    assert (after[0] - before[0]) / (2 * h) == pytest.approx(now[1], rel=1e-7)
    assert (after[1] - before[1]) / (2 * h) == pytest.approx(now[2], rel=1e-7)
    x, y = path(t, shape)[:2]
    assert np.hypot(x - OFFSET, now[0] - y) == pytest.approx(LENGTH, rel=1e-14)


def test_two_masses_and_the_remainder_move_like_the_rod():
    rod = Rod(length=0.215, big_end_mass=1.5, small_end_mass=0.7, inertia=0.0205)
    mass = rod.big_end_mass + rod.small_end_mass
    share = rod.small_end_mass / mass
    big, small = np.array([12.0, -3.0]), np.array([0.0, 7.0])
    # Kinetic energy of the true rod, with the velocity of its centre of mass and the rod's angular velocity.
    along = np.array([np.sin(0.2), np.cos(0.2)])
    across = np.array([along[1], -along[0]])
    small = big + (small - big) @ across * across
    turning = (small - big) @ across / rod.length
    true = 0.5 * mass * np.sum(((1 - share) * big + share * small) ** 2) + 0.5 * rod.inertia * turning**2
    split = 0.5 * rod.big_end_mass * big @ big + 0.5 * rod.small_end_mass * small @ small
    assert split + 0.5 * remainder_inertia(rod) * turning**2 == pytest.approx(true, rel=1e-14)


def test_a_rod_of_two_point_masses_has_no_remainder():
    two_points = 1.5 * 0.7 / (1.5 + 0.7) * 0.215**2
    assert abs(remainder_inertia(Rod(0.215, 1.5, 0.7, two_points))) < 1e-14 * two_points
