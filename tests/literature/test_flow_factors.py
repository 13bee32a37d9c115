"""Patir and Cheng's flow factors: the smooth limits, the isotropic law, and how the published forms meet."""

import math

import numpy as np
import pytest

from cranktrain.core.errors import InputError
from cranktrain.film.reynolds.flow_factors import (
    PATTERNS,
    flow_factor_constants,
    mean_gap,
    pressure_flow_factor,
    shear_flow_factor,
)

ALL = [1 / 9, 0.15, 1 / 6, 1 / 3, 0.6, 1.0, 2.0, 3.0, 6.0, 7.7, 9.0]


@pytest.mark.parametrize("pattern", ALL)
def test_smooth_limit(pattern):
    constants = flow_factor_constants(pattern)
    assert pressure_flow_factor(1e4, constants) == pytest.approx((1.0, 0.0), abs=1e-5)
    assert shear_flow_factor(200.0, constants) == pytest.approx((0.0, 0.0), abs=1e-20)


@pytest.mark.parametrize("gap_ratio", [0.6, 1.0, 3.0, 6.0])
def test_isotropic_pressure_factor(gap_ratio):
    factor, slope = pressure_flow_factor(gap_ratio, flow_factor_constants())
    assert factor == pytest.approx(1.0 - 0.9 * math.exp(-0.56 * gap_ratio), rel=1e-14)
    assert slope == pytest.approx(0.9 * 0.56 * math.exp(-0.56 * gap_ratio), rel=1e-14)


def test_roughness_along_the_flow_helps_it_and_across_hinders_it():
    for gap_ratio in (1.0, 2.0, 4.0, 8.0):
        factors = [pressure_flow_factor(gap_ratio, flow_factor_constants(g))[0] for g in ALL]
        assert (np.diff(factors) > 0.0).all()
        assert factors[0] < 1.0 < factors[-1]


@pytest.mark.parametrize("row", PATTERNS)
def test_both_published_forms_of_the_shear_factor_meet(row):
    constants = flow_factor_constants(row[0])
    below, above = shear_flow_factor(5.0, constants)[0], shear_flow_factor(5.0 + 1e-9, constants)[0]
    # The tables are rounded to three digits.
    assert below == pytest.approx(above, rel=0.02)


@pytest.mark.parametrize("pattern", [1 / 9, 0.5, 1.0, 2.0, 9.0])
@pytest.mark.parametrize("gap_ratio", [0.3, 1.7, 4.2, 7.0])
def test_slopes_and_weights_between_patterns(pattern, gap_ratio):
    constants = flow_factor_constants(pattern)
    for law in (pressure_flow_factor, shear_flow_factor):
        step = 1e-6
        by = (law(gap_ratio + step, constants)[0] - law(gap_ratio - step, constants)[0]) / (2.0 * step)
        assert law(gap_ratio, constants)[1] == pytest.approx(by, rel=1e-6, abs=1e-8)
        patterns = [pattern * s for s in (1.0001, 0.9999) if 1 / 9 <= pattern * s <= 9]
        near = [law(gap_ratio, flow_factor_constants(p))[0] for p in patterns]
        assert near == pytest.approx([law(gap_ratio, constants)[0]] * len(near), rel=1e-3)


def test_patterns_beyond_the_tables_are_refused():
    with pytest.raises(InputError, match="pattern 12 lies outside the published 1/9 to 9"):
        flow_factor_constants(12.0)


def test_mean_gap_of_gaussian_surfaces():
    assert mean_gap(0.0) == pytest.approx((1.0 / math.sqrt(2.0 * math.pi), 0.5), rel=1e-14)
    assert mean_gap(6.0)[0] == pytest.approx(6.0, rel=1e-9)
    # Mean of max(H + s, 0) over the heights.
    heights = np.linspace(-8.0, 8.0, 20001)
    density = np.exp(-0.5 * heights**2) / math.sqrt(2.0 * math.pi)
    for gap_ratio in (-1.0, 0.4, 2.0):
        exact = np.sum(np.maximum(gap_ratio + heights, 0.0) * density) * (heights[1] - heights[0])
        assert mean_gap(gap_ratio)[0] == pytest.approx(exact, rel=1e-6)
