"""Greenwood and Tripp's contact against the exact integrals (tests/data/cavitation.json) and their fitted power law."""

import math

import numpy as np
import pytest
from expected import cases

from cranktrain.film.contact.asperity import (
    AREA,
    PRESSURE,
    contact_constants,
    contact_integrals,
    contact_pressure,
    contact_table,
    greenwood_tripp_integral,
)

CASE = cases("cavitation")["greenwood_tripp"]
ROWS = CASE["expected"]["rows"]
TABLE = contact_table()
SIGMA, MODULUS = 0.4e-6, 60e9


@pytest.mark.parametrize(("gap_ratio", "exact", "area"), [(row[0], row[1], row[3]) for row in ROWS])
def test_tabulated_integrals_are_the_exact_ones(gap_ratio, exact, area):
    f, slope, f2 = contact_integrals(float(gap_ratio), TABLE, True)
    assert f == pytest.approx(exact, rel=1e-8)
    assert f2 == pytest.approx(area, rel=1e-8)
    assert slope == pytest.approx(-2.5 * greenwood_tripp_integral(1.5, gap_ratio), rel=1e-6)


def test_pressure_and_area_carry_the_published_factors():
    constants = contact_constants(SIGMA, 0.05, 0.01, MODULUS)
    assert constants[PRESSURE] == pytest.approx(CASE["inputs"]["prefactor"] * 0.05**2 * 0.1 * MODULUS, rel=1e-12)
    assert constants[AREA] == pytest.approx(math.pi**2 * 0.05**2 * 0.1, rel=1e-14)
    p, slope, share = contact_pressure(1.5 * SIGMA, constants, TABLE)
    exact, area = ROWS[3][1], ROWS[3][3]
    assert p == pytest.approx(constants[PRESSURE] * exact, rel=1e-8)
    assert share == pytest.approx(constants[AREA] * area, rel=1e-8)
    assert slope < 0.0


@pytest.mark.parametrize("gap_ratio", [-40.0, -20.0001, -19.999, -7.3, -1.0, 0.77, 2.21, 4.9])
def test_integrals_continue_below_zero_gap(gap_ratio):
    f, slope, f2 = contact_integrals(gap_ratio, TABLE, True)
    assert f == pytest.approx(greenwood_tripp_integral(2.5, gap_ratio), rel=1e-8)
    assert slope == pytest.approx(-2.5 * greenwood_tripp_integral(1.5, gap_ratio), rel=1e-6)
    # F_2 in closed form: (1 + H²) Q(H) − H φ(H).
    h = gap_ratio
    tail, density = 0.5 * math.erfc(h / math.sqrt(2.0)), math.exp(-0.5 * h * h) / math.sqrt(2.0 * math.pi)
    assert f2 == pytest.approx((1.0 + h * h) * tail - h * density, rel=1e-8)


def test_half_of_a_gaussian_at_zero_gap():
    # F_n(0) = 2^{n/2 − 1} Γ((n + 1)/2) / √π
    for power in (1.0, 1.5, 2.0, 2.5):
        exact = 2.0 ** (0.5 * power - 1.0) * math.gamma(0.5 * (power + 1.0)) / math.sqrt(math.pi)
        assert greenwood_tripp_integral(power, 0.0) == pytest.approx(exact, rel=1e-9)
    assert np.all(np.diff(greenwood_tripp_integral(2.5, np.linspace(-5.0, 8.0, 50))) < 0.0)
