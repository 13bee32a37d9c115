"""Free forces and couples of the rods and pistons of both engines against the closed forms of their layouts.

Values: tests/data/slider_crank.json, id ``balance``. Throws, banks, pins and the rods' places are the engine files';
the piston's acceleration is that of the package's rod, and masses, throw and speed are 1. On the engine a piston leaves
the force of its inertia along its cylinder: the rest of what its pin feels is carried by its liner in the same plane.
"""

from dataclasses import replace

import numpy as np
import pytest
from expected import cases
from numpy import pi, sqrt

from cranktrain.engine.file import load_engine
from cranktrain.loads.slider_crank import rod_force
from cranktrain.structure.crank.shape import pin_centre

EXPECTED = cases("slider_crank")["balance"]["expected"]
N = 256
THETA = 2 * pi * np.arange(N) / N
LAMBDA = 0.3


def piston_acceleration(angle):
    """Acceleration (N,) along the cylinder, ``angle`` (N,) after dead centre, for throw and speed 1."""
    out, result = np.zeros(16), np.empty(N)
    for i, (c, s) in enumerate(zip(np.cos(angle), np.sin(angle), strict=True)):
        rod_force(-s, c, -c, -s, s, -c, 0.0, 1.0 / LAMBDA, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, out)
        result[i] = out[12]
    return result


def places(engine):
    """z of each rod in pin spacings from the middle of the crankshaft, (cylinders,)."""
    pins = np.array([pin_centre(engine.crankshaft, i + 1)[2] for i in range(len(engine.crankshaft.throw_angles))])
    z = pins[np.array(engine.cylinders.pins) - 1] + np.array(engine.rod_offsets)
    return (z - pins.mean()) / np.diff(pins).mean()


def reciprocating(engine):
    """Free force and couple of unit pistons, each (N, 2) in x, y; the couple is Σ z f."""
    force, couple = np.zeros((N, 2)), np.zeros((N, 2))
    cylinders = engine.cylinders
    for pin, bank, z in zip(cylinders.pins, cylinders.bank_angles, places(engine), strict=True):
        own = -piston_acceleration(THETA + engine.crankshaft.throw_angles[pin - 1] - bank)
        along = own[:, None] * np.array([-np.sin(bank), np.cos(bank)])
        force += along
        couple += z * along
    return force, couple


def rotating(engine):
    """Force and couple (2,) at θ = 0 of a unit mass on each pin."""
    angles = np.array(engine.crankshaft.throw_angles)
    pins = np.arange(len(angles)) - 0.5 * (len(angles) - 1)
    out = np.stack([-np.sin(angles), np.cos(angles)])
    return out.sum(axis=1), out @ pins


def order(signal, k):
    """Complex amplitude (2,) of order k of a signal (N, 2)."""
    return np.fft.rfft(signal, axis=0)[k] * 2 / N


SECOND = np.abs(np.fft.rfft(piston_acceleration(THETA))[2]) * 2 / N


def test_the_six_is_free_of_forces_and_couples_of_first_and_second_order():
    assert EXPECTED["I6"] == "1st,2nd force and moment = 0"
    engine = load_engine("diesel_i6")
    force, couple = reciprocating(engine)
    for k in (1, 2):
        assert np.abs(order(force, k)).max() < 1e-12
        assert np.abs(order(couple, k)).max() < 1e-12
    assert np.abs(np.concatenate(rotating(engine))).max() < 1e-12
    # The test would see an order that does not cancel: six pistons of order six.
    assert np.abs(order(force, 6)).max() > 1e-4


def test_the_cross_plane_v8_leaves_a_rotating_couple_of_first_order_only():
    assert "sqrt(10)" in EXPECTED["V8_crossplane"] and "1st/2nd force 0, 2nd moment 0" in EXPECTED["V8_crossplane"]
    engine = load_engine("diesel_v8")
    force, couple = reciprocating(engine)
    for k in (1, 2):
        assert np.abs(order(force, k)).max() < 1e-12
    assert np.abs(order(couple, 2)).max() < 1e-12
    first = order(couple, 1)
    turning = np.real(first[None] * np.exp(1j * THETA)[:, None])
    assert np.hypot(*turning.T) == pytest.approx(np.full(N, sqrt(10.0)), abs=1e-12)
    # It turns with the crankshaft, so that counterweights can cancel it.
    direction = np.unwrap(np.arctan2(turning[:, 1], turning[:, 0]))
    assert direction - direction[0] == pytest.approx(THETA, abs=1e-11)


def test_masses_on_the_pins_of_the_cross_plane_v8_leave_the_same_couple():
    force, couple = rotating(load_engine("diesel_v8"))
    assert np.abs(force).max() < 1e-12
    assert np.hypot(*couple) == pytest.approx(sqrt(10.0), abs=1e-12)


def test_a_flat_plane_v8_shakes_sideways_with_second_order():
    assert "4 sqrt2" in EXPECTED["V8_flat"] and "horizontal" in EXPECTED["V8_flat"]
    engine = load_engine("diesel_v8")
    first = engine.crankshaft.throw_angles[0]
    flat = replace(engine, crankshaft=replace(engine.crankshaft, throw_angles=(first, first + pi, first + pi, first)))
    sideways, upwards = np.abs(order(reciprocating(flat)[0], 2))
    # The closed form takes λ for the coefficient of second order; exactly it is λ + λ³/4 + 15 λ⁵/128 + …
    assert sideways == pytest.approx(4.0 * sqrt(2.0) * SECOND, abs=1e-12)
    assert pytest.approx(LAMBDA + LAMBDA**3 / 4 + 15 * LAMBDA**5 / 128, rel=1e-3) == SECOND
    assert upwards < 1e-12
