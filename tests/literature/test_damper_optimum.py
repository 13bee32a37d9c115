"""Optimum dampers: Houdaille's closed form, its published rows, and the search that also serves the crank."""

import math

import numpy as np
import pytest
from expected import cases

from cranktrain.core.errors import InputError
from cranktrain.studies.torsion.damper_optimum import (
    HubModes,
    amplification,
    houdaille_optimum,
    optimal_damping,
    peak,
    two_mass_modes,
)

CASES = cases("torsion")
HOUDAILLE = CASES["houdaille_optimum"]["expected"]
ROWS = [dict(zip(HOUDAILLE["columns"], row, strict=True)) for row in HOUDAILLE["rows"]]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"ratio {row['mu']:g}")
def test_houdaille_rows(row):
    closed = houdaille_optimum(row["mu"])
    assert closed.damping_ratio == pytest.approx(row["zeta_formula"], rel=1e-12)
    assert closed.amplification == pytest.approx(row["amp_formula"], rel=1e-12)
    assert closed.frequency_ratio == pytest.approx(row["g_formula"], rel=1e-12)
    searched, damping = optimal_damping(two_mass_modes(), 0, row["mu"])
    # The rows' own search ran on a grid of frequencies and damping: 1e-3.
    assert searched.damping_ratio == pytest.approx(row["zeta_numeric"], abs=1e-3)
    assert searched.amplification == pytest.approx(row["amp_numeric"], rel=1e-3)
    assert searched.frequency_ratio == pytest.approx(row["g_numeric"], abs=1e-3)
    assert searched == pytest.approx(closed, rel=1e-6)
    assert damping == pytest.approx(2.0 * closed.damping_ratio, rel=1e-6)


@pytest.mark.parametrize("ratio", [0.01, 0.3, 7.0, 100.0])
def test_search_meets_the_closed_form_far_from_the_rows(ratio):
    assert optimal_damping(two_mass_modes(), 0, ratio)[0] == pytest.approx(houdaille_optimum(ratio), rel=1e-6)


@pytest.mark.parametrize("ratio", [0.2, 1.0, 3.0])
def test_every_damping_passes_the_fixed_point(ratio):
    closed = houdaille_optimum(ratio)
    at = np.array([closed.frequency_ratio])
    for damping in np.geomspace(1e-3, 1e3, 7):
        assert amplification(two_mass_modes(), 0, ratio, damping, at)[0] == pytest.approx(closed.amplification)
        assert peak(two_mass_modes(), 0, ratio, damping)[0] >= closed.amplification * (1.0 - 1e-12)


def test_units_do_not_matter():
    hub, omega = 0.21, 1900.0
    modes = HubModes(np.array([omega]), np.array([1.0 / math.sqrt(hub)]), np.zeros(1))
    found, damping = optimal_damping(modes, 0, 0.5 * hub)
    closed = houdaille_optimum(0.5)
    assert found == pytest.approx(closed, rel=1e-6)
    assert damping == pytest.approx(2.0 * closed.damping_ratio * hub * omega, rel=1e-6)


def test_a_mode_far_above_changes_the_optimum_by_its_static_flexibility_alone():
    """A hub on a stiff shaft end: with mode 2 at 30 times the frequency the optimum nears the two masses'."""
    shifts = []
    for factor in (10.0, 30.0):
        modes = HubModes(np.array([1.0, factor]), np.array([1.0, 1.0]), np.zeros(2))
        found, _ = optimal_damping(modes, 0, 0.5)
        shifts.append(abs(found.damping_ratio / houdaille_optimum(0.5).damping_ratio - 1.0))
    assert shifts[0] < 0.02
    assert shifts[1] == pytest.approx(shifts[0] / 9.0, rel=0.1)


@pytest.mark.parametrize("ratio", [0.0, -1.0, math.nan, math.inf])
def test_a_ratio_that_no_damper_has_is_refused(ratio):
    with pytest.raises(InputError, match="inertia ratio"):
        houdaille_optimum(ratio)


def test_a_mode_that_does_not_turn_the_hub_is_refused():
    with pytest.raises(InputError, match="hardly turns the hub"):
        optimal_damping(HubModes(np.array([100.0]), np.array([0.01]), np.zeros(1)), 0, 0.1)


def test_a_structure_that_damps_itself_swings_less():
    """Without ring the peak of one mode is 1/(2ζ√(1 − ζ²)); with the optimum ring it lies below Houdaille's."""
    modes = HubModes(np.ones(1), np.ones(1), np.array([0.02]))
    assert peak(modes, 0, 1.0, 1e-9)[0] == pytest.approx(1.0 / (0.04 * math.sqrt(1.0 - 0.02**2)), rel=1e-6)
    assert optimal_damping(modes, 0, 1.0)[0].amplification < 3.0
