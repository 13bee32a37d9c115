"""The rod's law on prescribed motion against the exact series of the slider-crank, and a flat-plane V8.

Values: tests/data/slider_crank.json, FFT of the exact kinematics (tolerance stated there: 1e-10) and closed forms.
"""

import numpy as np
import pytest
from expected import cases

from cranktrain.engine.file import load_engine
from cranktrain.loads.slider_crank import remainder_inertia, rod_force

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


def test_a_flat_plane_v8_shakes_sideways_with_second_order():
    """Unit masses on the V8's cylinders over throws in one plane; layouts as shipped are run in test_free_forces.py."""
    expected = CASES["balance"]["expected"]["V8_flat"]
    assert "4 sqrt2" in expected and "horizontal" in expected
    engine, ratio = load_engine("diesel_v8"), 0.3
    first, force = engine.crankshaft.throw_angles[0], np.zeros((N, 2))
    throws = (first, first + np.pi, first + np.pi, first)
    for pin, bank in zip(engine.cylinders.pins, engine.cylinders.bank_angles, strict=True):
        piston = over_a_turn(1.0, 1.0 / ratio, 0.0, 1.0, phase=throws[pin - 1] - bank)[2]
        force -= piston[:, None] * np.array([-np.sin(bank), np.cos(bank)])
    sideways, upwards = np.abs(np.fft.rfft(force, axis=0)[2]) * 2 / N
    # The closed form takes λ for the coefficient of second order; exactly it is λ + λ³/4 + 15 λ⁵/128 + …
    second = np.abs(np.fft.rfft(over_a_turn(1.0, 1.0 / ratio, 0.0, 1.0)[2])[2]) * 2 / N
    assert second == pytest.approx(ratio + ratio**3 / 4 + 15 * ratio**5 / 128, rel=1e-3)
    assert sideways == pytest.approx(4.0 * np.sqrt(2.0) * second, abs=1e-12) and upwards < 1e-12


@pytest.mark.parametrize("name", ["diesel_i6", "four_petrol"])
def test_eye_masses_and_remainder_have_the_rods_moment_of_inertia(name):
    """Masses of the eyes have the rod's centre of mass; about it they and the remainder have its moment of inertia."""
    rod = load_engine(name).rods[0]
    big, small = rod.big_end_mass, rod.small_end_mass
    to_big, to_small = rod.length * small / (big + small), rod.length * big / (big + small)
    eyes = big * to_big**2 + small * to_small**2
    assert eyes + remainder_inertia(rod) == pytest.approx(rod.inertia, rel=1e-12)
    assert abs(to_big / to_small - 1.0) > 0.1  # the eyes cannot be mistaken for one another
