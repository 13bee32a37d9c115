"""Steady bearings: equilibrium, coefficients from differences and on finer grids, tilt, and what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from one_line import one_line

from cranktrain.core.errors import InputError, SolverError
from cranktrain.film.steady.bearing import Journal, SteadyBearing, bearing_grid

JOURNAL = Journal(diameter=0.08, width=0.04, clearance=4e-5, viscosity=0.01, speed=200.0)


def test_film_carries_the_load_at_the_equilibrium():
    for supply in ("widest-gap", "none", "two-axial"):
        steady = SteadyBearing(bearing_grid(supply))
        for load in (1.0, 300.0, 5e3, 2e5):
            state = steady.state(JOURNAL, load)
            np.testing.assert_allclose(JOURNAL.force_unit * steady.out[:2], [-load, 0.0], atol=1e-6 * load)
            assert 0.0 < state.attitude < 0.5 * math.pi
            assert state.damping[0, 1] == pytest.approx(state.damping[1, 0])
            assert np.linalg.eigvalsh(state.damping).min() > 0.0
            assert state.least_film == pytest.approx(JOURNAL.clearance * (1.0 - np.hypot(*state.eccentricity)))


def test_stiffness_is_the_change_of_load_with_place():
    # Grooves at rest: all of the motion is in the coefficients. Two loads beside each other give k along the path.
    steady = SteadyBearing(bearing_grid("two-axial", n_phi=384, n_z=16))
    for load in (500.0, 5000.0):
        low, here, high = (steady.state(JOURNAL, load * s) for s in (0.99, 1.0, 1.01))
        moved = (high.eccentricity - low.eccentricity) * JOURNAL.clearance
        np.testing.assert_allclose(here.stiffness @ moved, [0.02 * load, 0.0], atol=0.02 * 0.02 * load)


@pytest.mark.parametrize("ratio", [0.25, 0.5, 1.0, 2.0])
def test_default_grid_has_coefficients_within_half_a_per_cent(ratio):
    journal = replace(JOURNAL, width=ratio * JOURNAL.diameter)
    fine, usual = SteadyBearing(bearing_grid(n_phi=768, n_z=48)), SteadyBearing(bearing_grid())
    for sommerfeld in (0.02, 0.1, 0.5, 2.0, 8.0, 25.0):
        load = sommerfeld * journal.force_unit / 3.0
        exact, ours = fine.state(journal, load), usual.state(journal, load)
        np.testing.assert_allclose(ours.eccentricity, exact.eccentricity, atol=5e-4)
        for a, b in ((ours.stiffness, exact.stiffness), (ours.damping, exact.damping)):
            np.testing.assert_allclose(a, b, atol=4e-3 * np.abs(b).max())
        assert ours.flow == pytest.approx(exact.flow, rel=5e-3)
        assert ours.largest_pressure == pytest.approx(exact.largest_pressure, rel=5e-3)


def test_coefficients_do_not_jump_as_nodes_rupture():
    # Many nodes rupture on this way; tangents on the set of nodes alone would scatter by 2e-3.
    steady = SteadyBearing(bearing_grid(n_phi=96, n_z=12))
    loads = np.geomspace(2e3, 4e3, 61)
    stiffness = np.array([steady.state(JOURNAL, load).stiffness.ravel() for load in loads])
    smooth = np.polynomial.Polynomial.fit
    for entry in stiffness.T:
        x = np.log(loads)
        rest = entry - smooth(x, entry, 5)(x)
        assert np.abs(rest).max() < 1e-3 * np.abs(stiffness).max()


def test_moment_tilts_the_journal_and_its_matrices_hold_the_aligned_ones():
    grid = bearing_grid("none", n_phi=96, n_z=16, tilted=True)
    steady = SteadyBearing(grid)
    aligned = SteadyBearing(bearing_grid("none", n_phi=96, n_z=16)).state(JOURNAL, 5e3)
    straight = steady.state(JOURNAL, 5e3, (0.0, 0.0))
    np.testing.assert_allclose(straight.tilt, 0.0, atol=1e-9)
    np.testing.assert_allclose(straight.stiffness[:2, :2], aligned.stiffness, rtol=1e-4)
    np.testing.assert_allclose(straight.stiffness[:2, 2:], 0.0, atol=1e-9 * straight.stiffness[0, 0])
    assert np.linalg.eigvalsh(straight.damping).min() > 0.0
    tilted = steady.state(JOURNAL, 5e3, (10.0, -5.0))
    np.testing.assert_allclose(JOURNAL.force_unit * steady.out[2:4] * 0.5 * JOURNAL.width, [-10.0, 5.0], rtol=1e-5)
    assert tilted.least_film < straight.least_film
    small = steady.state(JOURNAL, 5e3, (0.1, 0.0))
    slope = small.tilt * JOURNAL.clearance / (0.5 * JOURNAL.width)
    np.testing.assert_allclose(straight.stiffness[2:, 2:] @ slope, [0.1, 0.0], atol=2e-3)


@pytest.mark.parametrize("name", ["diameter", "width", "clearance", "viscosity", "speed"])
@pytest.mark.parametrize("value", [-1.0, 0.0, math.nan])
def test_journals_that_cannot_be_are_refused(name, value):
    with one_line(name):
        replace(JOURNAL, **{name: value})


def test_what_no_film_carries_is_refused():
    steady = SteadyBearing(bearing_grid())
    for call, kind, said in (
        (lambda: steady.state(JOURNAL, 0.0), InputError, "above zero"),
        (lambda: steady.state(JOURNAL, 1e14), SolverError, "no film carries"),
        (lambda: steady.state(JOURNAL, 1e3, (1.0, 0.0)), InputError, "full width"),
        (lambda: bearing_grid("two-axial", groove=math.pi), InputError, "overlap"),
        (lambda: bearing_grid("two-axiel"), InputError, "did you mean 'two-axial'"),
    ):
        with one_line(said, kind=kind):
            call()
