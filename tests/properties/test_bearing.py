"""Steady bearings: equilibrium, coefficients from differences, and a rotor that loses stability where they say."""

import math
from dataclasses import replace

import numpy as np
import pytest
from one_line import one_line

from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.kernel import kernel
from cranktrain.film.journal.film import OUT_SIZE, journal_film
from cranktrain.film.journal.grid import Motion, cold_start, journal_work
from cranktrain.film.steady.bearing import Journal, SteadyBearing, bearing_grid

JOURNAL = Journal(diameter=0.08, width=0.04, clearance=4e-5, viscosity=0.01, speed=200.0)


@kernel
def whirl(grid, ratio2, load, mass, path, steps, dt, work, active, out):
    """Rigid rotor on its film from ``path[0]`` = (x, y, x', y') on, by Runge and Kutta; time in 1/ω, lengths in c.

    mass e'' = F̂/load + x̂, with mass = ω² c m/W; ``steps`` of ``dt`` from one row of ``path`` to the next.
    """
    state = path[0]
    for row in range(1, path.shape[0]):
        for k in range(4):
            path[row, k] = state[k]
        state = path[row]
        for _ in range(steps):
            x, y, u, v = state[0], state[1], state[2], state[3]
            ax = ay = bx = by = 0.0
            px = py = pu = pv = 0.0
            for stage in range(4):
                share = 0.0 if stage == 0 else (dt if stage == 3 else 0.5 * dt)
                sx, sy, su, sv = x + share * px, y + share * py, u + share * pu, v + share * pv
                at = Motion(sx, sy, 0.0, 0.0, su + 0.5 * sy, sv - 0.5 * sx, 0.0, 0.0)
                if journal_film(grid, ratio2, at, work, active, out) < 0:
                    return -1
                px, py = su, sv
                pu, pv = (out[0] / load + 1.0) / mass, out[1] / load / mass
                weight = 1.0 if stage == 0 or stage == 3 else 2.0
                ax += weight * px
                ay += weight * py
                bx += weight * pu
                by += weight * pv
            state[0] = x + dt / 6.0 * ax
            state[1] = y + dt / 6.0 * ay
            state[2] = u + dt / 6.0 * bx
            state[3] = v + dt / 6.0 * by
    return 0


def growth(steady, state, load, threshold, turns=60, samples=24):
    """Logarithmic growth per turn of a small whirl about ``state`` at the speed ``threshold`` = ω √(c m/W)."""
    grid = steady.grid
    path = np.zeros((turns * samples + 1, 4))
    path[0, :2] = state.eccentricity * (1.0 + 2e-3)
    work, active, out = journal_work(grid), cold_start(grid), np.zeros(OUT_SIZE)
    ratio = JOURNAL.width / JOURNAL.diameter
    dt = 2.0 * math.pi / samples / 4
    assert whirl(grid, ratio**-2, load / JOURNAL.force_unit, threshold**2, path, 4, dt, work, active, out) == 0
    away = np.hypot(*(path[:, :2] - state.eccentricity).T)
    # The other, strongly damped motions have died after the first third; a whirl beats once in two turns.
    envelope = np.array([part.max() for part in np.array_split(away[len(away) // 3 :], 10)])
    return np.polyfit(np.arange(10) * turns * 2.0 / 30.0, np.log(envelope), 1)[0]


@pytest.mark.parametrize(("supply", "eps"), [("none", 0.2), ("none", 0.5), ("two-axial", 0.35)])
def test_a_rotor_in_time_loses_stability_at_the_threshold_of_the_coefficients(supply, eps):
    # Coefficients of a fine grid; in time a grid as the engine takes it, its nodes following the journal.
    fine = SteadyBearing(bearing_grid(supply, n_phi=384, n_z=24))
    load = load_for(fine, eps)
    threshold = fine.state(JOURNAL, load).whirl_threshold
    steady = SteadyBearing(bearing_grid(supply, n_phi=96, n_z=12))
    state = steady.state(JOURNAL, load)
    assert state.whirl_threshold == pytest.approx(threshold, rel=0.005)
    assert growth(steady, state, load, 0.995 * threshold) < 0.0 < growth(steady, state, load, 1.005 * threshold)


def test_with_nodes_at_rest_time_and_coefficients_agree_to_the_last_per_mille():
    steady = SteadyBearing(bearing_grid("two-axial", n_phi=96, n_z=12))
    state = steady.state(JOURNAL, 800.0)
    below, at, above = (growth(steady, state, 800.0, f * state.whirl_threshold) for f in (0.999, 1.0, 1.001))
    assert below < 0.0 < above
    assert abs(at) < 0.05 * (above - below)


def load_for(steady, eps):
    """Load (N) at which the journal runs at ``eps``, by bisection."""
    low, high = 1.0, 1e5
    for _ in range(40):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if np.hypot(*steady.state(JOURNAL, middle).eccentricity) < eps else (low, middle)
    return low


def test_film_carries_the_load_at_the_equilibrium():
    for supply in ("widest-gap", "none", "two-axial"):
        steady = SteadyBearing(bearing_grid(supply))
        for load in (1.0, 300.0, 5e3, 2e5):
            state = steady.state(JOURNAL, load)
            np.testing.assert_allclose(JOURNAL.force_unit * steady.out[:2], [-load, 0.0], atol=1e-6 * load)
            assert 0.0 < state.attitude < 0.5 * math.pi
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


def test_damping_is_symmetric_and_positive():
    for load in (10.0, 1e3, 1e5):
        damping = SteadyBearing(bearing_grid()).state(JOURNAL, load).damping
        assert damping[0, 1] == pytest.approx(damping[1, 0])
        assert np.linalg.eigvalsh(damping).min() > 0.0


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


def test_friction_is_petroffs_where_the_load_vanishes():
    state = SteadyBearing(bearing_grid()).state(JOURNAL, 1e-3)
    petroff = 2.0 * math.pi * 0.01 * 200.0 * 0.04**3 * 0.04 / 4e-5
    assert state.friction_torque == pytest.approx(petroff, rel=1e-6)
    assert state.flow > 0.0


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
