"""Stiffness, damping and the whirl threshold against Lund and Thomsen, Nicholas and the closed forms of short films."""

import math

import numpy as np
import pytest
from expected import cases

from cranktrain.film.steady.bearing import Journal, SteadyBearing, bearing_grid, whirl_threshold

DYNAMIC = cases("bearing_dynamic")
STATIC = cases("bearing_static")
SPEED = 200.0


def journal(ratio):
    return Journal(diameter=0.08, width=0.08 * ratio, clearance=4e-5, viscosity=0.01, speed=SPEED)


def load_of(ratio, stribeck):
    """W (N) of S = η N D L (R/c)²/W, N in rev/s."""
    j = journal(ratio)
    rate = SPEED / (2.0 * math.pi)
    return j.viscosity * rate * j.diameter * j.width * (j.radius / j.clearance) ** 2 / stribeck


@pytest.fixture(scope="module")
def grooved():
    return SteadyBearing(bearing_grid("two-axial"))


@pytest.mark.parametrize("row", DYNAMIC["lund_thomsen_1978"]["expected"], ids=lambda row: f"S {row['published'][0]}")
def test_lund_and_thomsens_coefficients(grooved, row):
    _, eps, attitude, *coefficients = row["published"]
    exact = row["recomputed"]
    load = load_of(row["LD"], exact[0])
    state = grooved.state(journal(row["LD"]), load)
    c = journal(row["LD"]).clearance
    k, b = state.stiffness * c / load, state.damping * c * SPEED / load
    assert math.hypot(*state.eccentricity) == pytest.approx(eps, rel=0.01)
    assert math.degrees(state.attitude) == pytest.approx(attitude, abs=0.2)
    for ours, table in zip([*k.ravel(), b[0, 0], b[0, 1], b[1, 1]], coefficients, strict=True):
        assert ours == pytest.approx(table, rel=0.03, abs=0.06)
    # Its own digits, not only those of the print.
    for ours, table in zip([*k.ravel(), b[0, 0], b[0, 1], b[1, 1]], exact[3:], strict=True):
        assert ours == pytest.approx(table, rel=0.005, abs=0.005)
    assert state.whirl_threshold == pytest.approx(row["derived_keq_WFR_omegas"][2], rel=0.005)
    # The whirl's frequency feels the rounding of the print: what was derived belongs to the printed coefficients.
    for digits, derived in ((coefficients, row["derived_keq_WFR_omegas"][1:]), (exact[3:], None)):
        damping = np.array([[digits[4], digits[5]], [digits[5], digits[6]]])
        threshold, ratio = whirl_threshold(np.reshape(digits[:4], (2, 2)), damping, 1.0, 1.0, 1.0)
        if derived:
            assert (ratio, threshold) == pytest.approx(derived, rel=1e-6)
    assert state.whirl_threshold == pytest.approx(threshold, rel=0.003)
    assert state.whirl_ratio == pytest.approx(ratio, rel=0.003)


def test_threshold_of_nicholas_and_others(grooved):
    for stribeck in (4.40, 5.14, 7.71):
        state = grooved.state(journal(1.0), load_of(1.0, stribeck))
        assert state.whirl_threshold == pytest.approx(2.1, rel=0.02)
        assert state.whirl_ratio == pytest.approx(0.5, abs=0.002)


def short_state(eps, n_phi=192):
    """A short half film (Gümbel) under the load that Ocvirk's formula has at ``eps``."""
    j = journal(2e-3)
    load = eps / (4.0 * (1.0 - eps**2) ** 2) * math.sqrt(16.0 * eps**2 + math.pi**2 * (1.0 - eps**2))
    load *= j.viscosity * SPEED * j.radius * j.width**3 / j.clearance**2
    return SteadyBearing(bearing_grid("none", n_phi=n_phi, rupture="guembel")).state(j, load), load, j


@pytest.mark.parametrize("eps", list(DYNAMIC["short_bearing_KC"]["expected"]))
def test_short_bearing_coefficients(eps):
    state, load, j = short_state(float(eps))
    # The table's u, v: v against the load, u 90° on in the sense of rotation from x = −v; so x = −v, y = u.
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    for ours, key in ((state.stiffness, "K"), (state.damping * SPEED, "C")):
        table = turn @ np.array(DYNAMIC["short_bearing_KC"]["expected"][eps][key]) @ turn.T
        np.testing.assert_allclose(ours * j.clearance / load, table, rtol=1e-3, atol=1e-3)


def test_whirl_threshold_of_short_bearings():
    for eps, _, ratio, threshold in DYNAMIC["short_bearing_whirl_threshold"]["expected"]["rows"]:
        state, *_ = short_state(eps, n_phi=384)
        assert state.whirl_threshold == pytest.approx(threshold, rel=0.005), eps
        assert state.whirl_ratio == pytest.approx(ratio, rel=0.005), eps
    assert math.isinf(short_state(0.77)[0].whirl_threshold)


def test_threshold_formula_is_where_an_eigenvalue_crosses():
    case = DYNAMIC["lund_thomsen_1978"]["expected"][2]["published"]
    k, b = np.reshape(case[3:7], (2, 2)), np.array([[case[7], case[8]], [case[8], case[9]]])
    threshold, ratio = whirl_threshold(k, b, 1.0, 1.0, 1.0)
    # Dimensionless: (ω_s² c m/W) e'' + B e' + K e = 0.
    mass = threshold**2 * np.eye(2)
    growth = []
    for factor in (0.99, 1.0, 1.01):
        inverse = np.linalg.inv(mass * factor)
        matrix = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ k, -inverse @ b]])
        values = np.linalg.eigvals(matrix)
        growth.append(values[np.argmax(values.real)])
    assert growth[0].real < 0.0 < growth[2].real
    assert abs(growth[1].real) < 1e-12
    assert abs(growth[1].imag) == pytest.approx(ratio)
