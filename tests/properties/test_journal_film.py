"""The journal film: exact tangents, symmetries, dissipation, one solution from any start, order, edges that touch."""

import math
from itertools import pairwise

import numpy as np
import pytest
from journal_films import film, journal_grid
from some import some

from cranktrain.core.errors import InputError
from cranktrain.film.contact.gap import STRAIGHT, open_gap
from cranktrain.film.journal.film import OUT_SIZE, film_observables, film_shear, journal_film, shell_shear
from cranktrain.film.journal.grid import Motion, cold_start, journal_work, shell_grid

GRID = journal_grid(64, 12)
GRIDS = ((48, 8), (64, 12))
RUN_IN, ROUGH = (0.15, 0.5, 2.0), 0.01
"""Relief of the six's shells and their roughness, over the clearance."""


def states(count, seed=0, largest=0.98):
    """Eccentricities, tilts and velocities at random; no edge touches."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        eps, angle = rng.uniform(0.0, largest), rng.uniform(0.0, 2.0 * np.pi)
        e = eps * np.array([math.cos(angle), math.sin(angle)])
        t = rng.normal(size=2)
        t *= rng.uniform(0.0, 1.0) * (largest - eps) / np.hypot(*t)
        yield e, rng.normal(size=2), t, 0.5 * rng.normal(size=2)


def differences(grid, width_ratio, x, step=1e-6, ruptures=True):
    """Film at x = (e, t, v, w), and slopes (4, 8) of its force; none where a node ruptures within a difference."""
    here, *both = (
        film(grid, width_ratio, y[:2], y[4:6], y[2:4], y[6:8])
        for y in (x, *(x + s * step * unit for unit in np.eye(8) for s in (1.0, -1.0)))
    )
    if ruptures and any((b.active != here.active).any() for b in both):
        return here, None
    return here, np.array([a.force - b.force for a, b in zip(both[::2], both[1::2], strict=True)]).T / (2.0 * step)


@pytest.mark.parametrize("rupture", ["reynolds", "full", "guembel"])
def test_tangents_are_those_of_differences(rupture):
    # The half film's zero line moves between nodes, which its derivative follows to second order only.
    tolerance = {"reynolds": 1e-6, "full": 1e-6, "guembel": 2e-2}[rupture]
    grid = journal_grid(48, 12, grading=0.0, rupture=rupture)
    compared = 0
    for e, v, t, w in states(6, seed=3, largest=0.9):
        here, slopes = differences(grid, 0.5, np.concatenate([e, t, v, w]), ruptures=rupture == "reynolds")
        if slopes is not None:
            ours = np.hstack([here.by_place, here.by_velocity])
            np.testing.assert_allclose(ours, slopes, atol=tolerance * np.abs(ours).max())
            compared += 1
    assert compared > 0


def test_tangents_with_nodes_that_follow_the_journal_converge():
    def error(grid):
        worst = 0.0
        for e, v, t, w in states(5, seed=5, largest=0.9):
            here, slopes = differences(grid, 0.5, np.concatenate([e, t, v, w]), 1e-5, ruptures=False)
            worst = max(worst, np.abs(slopes[:, :4] - here.by_place).max() / np.abs(here.by_place).max())
        return worst

    assert error(journal_grid(64, 12)) < 0.06 and error(journal_grid(256, 24)) < 0.01


def test_damping_is_symmetric_dissipates_and_gives_the_whole_force_and_pressure_is_complementary():
    """Velocities of squeeze make all of the force, and where nothing moves nothing carries."""
    n = GRID.axial.shape[1] - 1
    for e, v, t, w in some(states(40, seed=1)):
        f = film(GRID, 0.4, e, v, t, w)
        p = f.work.pressure[:, :n]
        assert p.min() >= 0.0 and ((p > 0.0) == (f.active[:, :n] == 1.0)).all()
        np.testing.assert_allclose(f.by_velocity @ np.concatenate([v, w]), f.force, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(f.by_velocity, f.by_velocity.T, rtol=1e-9, atol=1e-12 * np.abs(f.by_velocity).max())
        assert np.linalg.eigvalsh(-f.by_velocity).min() > 0.0
        assert f.force @ np.concatenate([v, w]) < 0.0


def test_result_does_not_depend_on_the_start():
    rng = np.random.default_rng(7)
    for e, v, t, w in some(states(60, seed=4)):
        cold = film(GRID, 0.4, e, v, t, w)
        assert cold.passes > 0
        for active in (rng.integers(0, 2, cold.active.shape).astype(float), np.ones_like(cold.active)):
            warm = film(GRID, 0.4, e, v, t, w, active=active)
            assert warm.passes > 0 and (warm.force == cold.force).all()
            assert (warm.by_place == cold.by_place).all()
        again = film(GRID, 0.4, e, v, t, w, active=cold.active.copy())
        assert again.passes == 1


def test_random_jumps_of_state_always_settle():
    # Among them edges that touch or lie beyond, centred journals, velocities of one component only, and standstill.
    rng = np.random.default_rng(11)
    work, active, out = journal_work(GRID), cold_start(GRID), np.zeros(OUT_SIZE)
    for _ in range(3000):
        size = rng.choice([0.0, 0.3, 0.9, 0.999, 1.1])
        x = rng.normal(size=8) * rng.integers(0, 2, size=8)
        x[:2] *= size / max(np.hypot(*x[:2]), 1e-9)
        x[2:4] *= 0.3
        assert journal_film(GRID, rng.choice([0.5, 4.0, 16.0]), Motion(*x), work, active, out) > 0, x
        assert np.isfinite(out).all() and (out[20::5] <= 0.0).all()


def test_symmetries():
    mirror = np.array([1.0, -1.0])
    turn = np.array([[math.cos(0.7), -math.sin(0.7)], [math.sin(0.7), math.cos(0.7)]])
    for e, v, t, w in some(states(15, seed=8)):
        f = film(GRID, 0.4, e, v, t, w).force
        close = {"rtol": 1e-7, "atol": 1e-9 * np.abs(f).max()}
        other_end = film(GRID, 0.4, e, v, -t, -w).force
        np.testing.assert_allclose(other_end, f * [1, 1, -1, -1], **close)
        turned = film(GRID, 0.4, turn @ e, turn @ v, turn @ t, turn @ w).force
        np.testing.assert_allclose(turned, np.concatenate([turn @ f[:2], turn @ f[2:]]), **close)
        reflected = film(GRID, 0.4, mirror * e, mirror * v, mirror * t, mirror * w).force
        np.testing.assert_allclose(reflected, np.tile(mirror, 2) * f, **close)


def test_half_the_width_is_the_whole_without_tilt():
    half = journal_grid(64, 12, half=True)
    for e, v, _, _ in some(states(10, seed=9)):
        one, two = film(half, 0.4, e, v), film(GRID, 0.4, e, v)
        np.testing.assert_allclose(one.force, two.force, rtol=1e-9, atol=1e-11)
        np.testing.assert_allclose(one.by_place[:2, :2], two.by_place[:2, :2], rtol=1e-8, atol=1e-10)
        np.testing.assert_allclose(film_observables(half, one.work), film_observables(GRID, two.work), rtol=1e-9)


@pytest.mark.parametrize(("eps", "velocity"), [(0.5, (0.0, -0.5)), (0.9, (0.5, -0.5)), (0.95, (-0.3, 0.4))])
def test_convergence_of_second_order(eps, velocity):
    forces = [film(journal_grid(n, n // 4, half=True), 0.5, (eps, 0.0), velocity).force[:2] for n in (32, 64, 128, 512)]
    errors = [np.linalg.norm(f - forces[-1]) / np.linalg.norm(forces[-1]) for f in forces[:-1]]
    assert errors[2] < 3e-3
    assert math.log2(errors[0] / errors[2]) / 2.0 > 1.5  # rupture between nodes makes single steps irregular


def test_side_flow_balances_what_the_film_displaces():
    # Full film round a centred journal: Π = (1 − cosh κζ/cosh κ) cos φ, κ = L/D; what leaves on the closing half is
    # 4 tanh(κ)/κ of the ∫∫ cos φ = 4 that it displaces; the rest goes round to the opening half.
    for ratio in (0.1, 0.5, 2.0):
        grid = journal_grid(256, 32, half=True, rupture="full")
        f = film(grid, ratio, (0.0, 0.0), (1.0, 0.0))
        flow = ratio**-2 * film_observables(grid, f.work)[1]
        assert flow == pytest.approx(4.0 * math.tanh(ratio) / ratio, rel=1e-3)
    for velocity in ((1.0, 0.0), (0.0, -0.3)):
        ruptured = journal_grid(256, 32, half=True)
        f = film(ruptured, 0.5, (0.6, 0.0), velocity)
        n = ruptured.axial.shape[1] - 1
        share = ruptured.axial[2, :n].copy()
        share[-1] += 1.0 - share.sum()
        c, s = f.work.angle[:2] * f.work.width[0]
        # What the pressurised zone displaces leaves over its ends: the pressure has no slope at its inner border, which
        # lies within half a cell of its last nodes.
        displaced = 2.0 * (velocity[0] * c + velocity[1] * s) @ (share * (f.active[:, :n] > 0.0)).sum(axis=1)
        assert 4.0 * film_observables(ruptured, f.work)[1] == pytest.approx(displaced, rel=0.01)


WIDE = [(eps, ratio, 1, 0.008) for eps in (0.1, 0.6, 0.95) for ratio in (0.5, 2.0, 4.0)]
WIDE += [(eps, ratio, 0, 0.01) for ratio, eps in ((1.0, 0.95), (4.0, 0.99), (10.0, 0.99))]


@pytest.mark.parametrize(("eps", "width_ratio", "shown", "close"), WIDE)
def test_flow_and_largest_pressure_of_wide_bearings_do_not_hang_on_the_grid(eps, width_ratio, shown, close):
    """At the ends of a wide bearing the film's own length is far below the axial step."""
    found = []
    for n_phi, n_z in ((96, 16), (384, 96)):
        grid = journal_grid(n_phi, n_z, half=True, fed_at_widest=True)
        found.append(film_observables(grid, film(grid, width_ratio, (eps, 0.0), (0.0, -0.5 * eps)).work)[shown])
    assert found[0] == pytest.approx(found[1], rel=close)


@pytest.mark.parametrize("e_end", [0.999, 1.0, 1.05, 1.4])
def test_a_film_whose_edge_touches_stays_finite_and_pushes_back(e_end):
    e, t = (0.7, 0.1), (e_end - 0.7, -0.1)
    f = film(GRID, 0.4, e, (0.3, -0.3), t, (0.1, 0.0))
    assert f.passes > 0 and np.isfinite(f.force).all()
    assert np.isfinite(f.by_place).all() and f.force[0] < 0.0
    assert np.linalg.eigvalsh(-f.by_velocity).min() > 0.0 and math.isfinite(film_shear(*e, *t))


def strained(grid):
    """A journal whose edge lies 1.6 µm inside a bore of 40 µm clearance, squeezed there."""
    return film(grid, 30 / 85, (0.55, 0.0), (1.0, -0.5), (0.49, 0.0), (0.2, 0.1))


def test_an_edge_inside_the_shell_does_not_hang_on_the_grid():
    finest = strained(shell_grid(journal_grid(192, 32), RUN_IN, ROUGH)).force
    for size, allowed in (((48, 8), 0.022), ((64, 12), 0.006), ((96, 16), 0.002)):
        force = strained(shell_grid(journal_grid(*size), RUN_IN, ROUGH)).force
        assert np.hypot(*(force - finest)[:2]) < allowed * np.hypot(*finest[:2])
        assert np.hypot(*(force - finest)[2:]) < 2.5 * allowed * np.hypot(*finest[2:])
    # A straight shell closes: rough surfaces keep its film finite, but no such grid sees the edge.
    straight = [np.hypot(*strained(shell_grid(journal_grid(*size), STRAIGHT, ROUGH)).force[:2]) for size in GRIDS]
    assert straight[1] > 1.1 * straight[0]


@pytest.mark.parametrize("profile", [RUN_IN, STRAIGHT])
def test_a_journal_that_goes_through_its_shell_is_met_by_less_and_less_film(profile):
    """A closed gap takes no squeeze and gives no pressure: the force rises to the closing and falls beyond."""
    grid = shell_grid(journal_grid(768, 8, half=True, grading=0.0), profile, ROUGH)
    films = [film(grid, 0.4, (eps, 0.0), (1.0, -0.4)) for eps in np.linspace(0.96, 1.08, 25)]
    force = np.array([-f.force[0] for f in films])
    assert np.isfinite(force).all() and (force > 0.0).all()
    top = int(force.argmax())
    assert 0.985 < 0.96 + 0.005 * top < 1.015
    assert (np.diff(force[: top + 1]) > 0.0).all() and (np.diff(force[top:]) < 0.0).all()
    for f in films:
        assert np.linalg.eigvalsh(-f.by_velocity[:2, :2]).min() > 0.0


@pytest.mark.parametrize("profile", [RUN_IN, STRAIGHT])
@pytest.mark.parametrize("rupture", ["reynolds", "full"])
def test_tangents_at_touching_edges_are_those_of_differences(profile, rupture):
    grid = shell_grid(journal_grid(48, 12, grading=0.0, rupture=rupture), profile, ROUGH)
    rng, compared = np.random.default_rng(2), 0
    for reach in np.linspace(0.97, 1.0 + 1.5 * profile[0] + 0.03, 8):
        turn = rng.uniform(0.0, 2.0 * np.pi)
        along = np.array([math.cos(turn), math.sin(turn)])
        x = np.concatenate([0.8 * along, (reach - 0.8) * along, rng.normal(size=4)])
        here, slopes = differences(grid, 0.4, x)
        if slopes is not None:
            for part, ours in ((slice(0, 4), here.by_place), (slice(4, 8), here.by_velocity)):
                np.testing.assert_allclose(ours, slopes[:, part], atol=1e-6 * np.abs(ours).max())
            compared += 1
    assert compared >= 4


def test_squeeze_at_touching_edges_dissipates_what_the_journal_gives():
    """Power of the force on the journal against what the pressure's flow loses in the gaps: equal, node by node."""
    for profile in (RUN_IN, STRAIGHT):
        grid = shell_grid(GRID, profile, ROUGH)
        for e, v, t, w in some(states(20, seed=9, largest=1.05)):
            f = film(grid, 0.4, e, v, t, w)
            n, p = grid.axial.shape[1] - 1, f.work.pressure
            around, along = f.work.conduct
            inside = np.pad(p[:, :n], ((0, 0), (1, 1)))
            lost = (around[:, :n] * (np.roll(p, -1, axis=0) - p)[:, :n] ** 2).sum()
            lost += (along[:, : n + 1] * np.diff(inside, axis=1) ** 2).sum()
            assert f.force @ np.concatenate([v, w]) == pytest.approx(-lost, rel=1e-9)


def test_tangents_jump_by_no_more_than_a_tenth_as_nodes_rupture():
    """On the loop's grid: what a Newton iteration of a run meets."""
    grid, jumps = shell_grid(journal_grid(48, 8), RUN_IN, ROUGH), []
    for e, v, t, w in states(8, seed=12, largest=0.95):
        films = [film(grid, 0.35, e, v + s * np.array([-v[1], v[0]]), t, w) for s in np.linspace(0.0, 0.3, 300)]
        sizes = np.array([np.abs(f.by_velocity).max() for f in films])
        steps = np.array([np.abs(b.by_velocity - a.by_velocity).max() for a, b in pairwise(films)]) / sizes[1:]
        jumps.append(steps.max())
    assert 0.005 < max(jumps) < 0.1


@pytest.mark.parametrize("eps", [0.5, 0.95, 0.99, 1.0, 1.02])
def test_shear_of_a_tilted_gap_and_of_rough_surfaces_which_counts_what_does_not_touch(eps):
    zeta = np.linspace(-1.0, 1.0, 4001)
    e, t = (0.5, 0.1), (0.2, -0.3)
    left = 1.0 - (e[0] + zeta * t[0]) ** 2 - (e[1] + zeta * t[1]) ** 2
    assert film_shear(*e, *t) == pytest.approx(np.trapezoid(np.pi / np.sqrt(left), zeta), rel=1e-5)
    assert film_shear(0.6, 0.0, 0.0, 0.0) == pytest.approx(2.0 * np.pi / 0.8)
    phi = np.linspace(0.0, np.pi, 5001)
    h, slope = np.array([open_gap(gap, ROUGH)[:2] for gap in 1.0 - eps * np.cos(phi)]).T
    exact = 2.0 * np.trapezoid(slope / h, phi)
    shear = shell_grid(GRID, STRAIGHT, ROUGH).shear
    assert shell_shear(Motion(eps, *7 * [0.0]), shear, ROUGH) == pytest.approx(exact, rel=0.1 if eps > 0.9 else 1e-6)


def test_grooves_hold_no_pressure_and_lie_where_they_are_said_to_and_impossible_grids_are_refused():
    for options, words in (
        ({"n_phi": 4}, "12 to 4096"), ({"n_z": 1000}, "6 to 512"), ({"rupture": "gumbel"}, "did you mean 'guembel'"),
        ({"grooves": ((0.0, 1.0), (0.5, 1.0))}, "reaches the next one"), ({"grooves": ((0.0, -1.0),)}, "groove"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=words):
            journal_grid(**{"n_phi": 48, "n_z": 12, **options})
    grid = journal_grid(90, 12, grooves=((0.5 * np.pi, 0.4), (4.5, 0.3)))
    angle = np.arctan2(grid.circle[1], grid.circle[0]) % (2.0 * np.pi)
    blocked = grid.blocked[:, 0] > 0.0
    np.testing.assert_allclose(np.sort(angle[blocked]), [0.5 * np.pi - 0.2, 0.5 * np.pi + 0.2, 4.35, 4.65])
    f = film(grid, 0.5, (0.5, -0.4), (0.2, 0.4))
    assert not f.work.pressure[blocked].any() and f.work.pressure.max() > 0.0
