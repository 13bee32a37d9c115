"""The rod's law on prescribed motion against the exact series of the slider-crank, and the balance of the in-line six.

Values: tests/data/slider_crank.json, FFT of the exact kinematics (tolerance stated there: 1e-10) and closed forms.
"""

import numpy as np
import pytest
from expected import cases

from cranktrain.engine.file import load_engine
from cranktrain.loads.slider_crank import rod_force
from cranktrain.structure.crank.shape import pin_centre

CASES = cases("slider_crank")
SERIES = CASES["slider_crank_series"]["expected"]["fft"]
N = 256


def circle(throw, speed, angle):
    """Motion (6,) of a pin on its circle, ``angle`` after top dead centre, in cylinder axes."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([-s, c, -speed * c, -speed * s, speed**2 * s, -(speed**2) * c]) * throw


def over_a_turn(throw, length, m_b, m_o, speed=1.0, phase=0.0):
    """Force on the pin in cylinder axes (N, 2), its moment about the crank's axis (N,), the piston's acceleration."""
    force, piston = np.empty((N, 2)), np.empty(N)
    angles = 2 * np.pi * np.arange(N) / N
    out, moment = np.zeros(16), np.empty(N)
    for i, angle in enumerate(angles):
        motion = circle(throw, speed, angle + phase)
        rod_force(*motion, 0.0, length, m_b, m_o, 0.0, 0.0, 0.0, 0.0, out)
        force[i], piston[i] = out[:2], out[12]
        moment[i] = motion[0] * out[1] - motion[1] * out[0]
    return force, moment, piston


@pytest.mark.parametrize("case", SERIES, ids=lambda case: f"lambda {case['lam']}")
def test_piston_acceleration_and_inertia_torque_equal_the_exact_series(case):
    throw, speed, mass = 0.06, 210.0, 2.6
    _, torque, piston = over_a_turn(throw, throw / case["lam"], 1.5, mass, speed)
    acceleration = np.fft.rfft(piston / (throw * speed**2)) * 2 / N
    orders = len(case["piston_accel_cos_coef_over_rw2"])
    expected = np.array(case["piston_accel_cos_coef_over_rw2"])
    assert acceleration.real[1:orders] == pytest.approx(expected[1:], abs=1e-10)
    assert acceleration.real[0] / 2 == pytest.approx(expected[0], abs=1e-10)
    assert acceleration.imag[:orders] == pytest.approx(np.zeros(orders), abs=1e-10)
    sines = -np.fft.rfft(torque / (mass * throw**2 * speed**2)).imag * 2 / N
    expected = case["inertia_torque_sin_coef_over_m_r2_w2"]
    assert sines[: len(expected)] == pytest.approx(expected, abs=1e-10)


def test_pin_force_is_that_of_the_pistons_inertia_along_the_rod():
    # Force along the rod: f_x / f_y is the rod's slope, and its part along the cylinder is the piston's inertia force.
    throw, length, mass = 0.06, 0.215, 2.6
    force, _, piston = over_a_turn(throw, length, 0.0, mass)
    x = -throw * np.sin(2 * np.pi * np.arange(N) / N)
    assert force[:, 1] == pytest.approx(-mass * piston, abs=1e-12)
    assert force[:, 0] == pytest.approx(-force[:, 1] * x / np.sqrt(length**2 - x**2), abs=1e-12)


def test_first_and_second_order_free_forces_and_moments_of_the_six_vanish():
    engine = load_engine("diesel_i6")
    c, rod = engine.crankshaft, engine.rod
    m_o = rod.small_end_mass + engine.cylinders.piston_mass
    total, tilting, single = np.zeros((N, 2)), np.zeros((N, 2)), None
    centre = np.mean([pin_centre(c, i)[2] for i in range(1, 7)])
    for pin, angle in enumerate(c.throw_angles, 1):
        force, _, _ = over_a_turn(c.throw, rod.length, rod.big_end_mass, m_o, 200.0, angle)
        total += force
        tilting += (pin_centre(c, pin)[2] - centre) * force
        single = force
    size = np.abs(np.fft.rfft(single, axis=0)[1]).max()
    for order in (1, 2):
        assert np.abs(np.fft.rfft(total, axis=0)[order]).max() < 1e-12 * 6 * size
        assert np.abs(np.fft.rfft(tilting, axis=0)[order]).max() < 1e-12 * 6 * size
    # What remains of a six is of order six: the test would see an order that does not cancel.
    assert np.abs(np.fft.rfft(total, axis=0)[6]).max() > 1e-6 * size
