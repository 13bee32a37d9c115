"""The film table: error, tangents, continuity and passivity, also at tilt rates off the family that it samples."""

import math
from dataclasses import replace

import numpy as np
import pytest
from film_tables import (
    MEMORY,
    RATIO,
    SETTINGS,
    apart,
    coarse_table,
    crosses,
    differences,
    family,
    law,
    path_across,
    place,
    solved,
    tangents,
)
from some import some

from cranktrain.film.journal.film import OUT_SIZE, film_observables, journal_film
from cranktrain.film.journal.grid import NODE_GRADING, Motion, cold_start, journal_grid, journal_work
from cranktrain.film.laws.parameters import CLEARANCE, RADIUS, VISCOSITY, WIDTH
from cranktrain.film.table import database
from cranktrain.film.table.aligned import ALIGNED_MARGIN, aligned_force, aligned_observables
from cranktrain.film.table.database import aligned_norms, sample_slab, slab_names, solved_film, table_grid
from cranktrain.film.table.family import LEVER, ONE_POINT, SPREAD, turning
from cranktrain.film.table.interpolation import (
    ALIGNED_MAX,
    ALIGNED_RATIO2,
    FUNCTIONS,
    LN_FORCE,
    TILTED_MAX,
    centres,
    eccentricity_nodes,
    stretched,
)
from cranktrain.film.table.law import BLENDED, SHARE_MARGIN, SOLVED, TABLED, Tabled, tilted_pressure
from cranktrain.film.table.sampling import sample_tilted
from cranktrain.store.film_tables import film_table

BEARING = np.zeros(13)
"""Parameters whose pressure unit and flow unit are one."""
BEARING[[CLEARANCE, VISCOSITY, RADIUS, WIDTH]] = 1.0, 1 / 12, 1.0, 2.0


@pytest.fixture(scope="module")
def table():
    return coarse_table()


def random_errors(table, count, grids, seed):
    """Force error over |F| and moment error over |F| L/2 at random states up to eccentricity 0.95."""
    rng = np.random.default_rng(seed)
    limit = 0.96 * table.settings.tilt_range  # within the margin the film is solved already
    errors = np.empty((count, 2))
    for i in range(count):
        state = any_state(rng, 0.0, tilt=limit)
        out, status = law(table, state)
        assert status == TABLED
        true = solved(state, grids)
        error = out[:4] - true
        errors[i] = np.hypot(*error[:2]), np.hypot(*error[2:])
        errors[i] /= np.hypot(*true[:2])
    return errors


def test_the_stated_error_holds_at_random_states(table):
    grids = [table_grid(SETTINGS, *size) for size in database.TILT_GRIDS]
    errors = random_errors(table, 400, grids, seed=1).max(axis=1)
    stated = table.worst(0.95)
    assert np.quantile(errors, 0.95) < 1.2 * stated["tilted_p95"]
    assert errors.max() < stated["tilted_max"]
    assert table.tilted_error.shape == tuple(n - k for n, k in zip((20, 28, 4, 4), (1, 0, 1, 1), strict=True))


@pytest.mark.slow
def test_the_default_table_at_random_states_against_a_finer_film(tmp_path):
    settings = replace(SETTINGS, resolution="default")
    table, path, _ = film_table(settings, tmp_path / "default.h5")
    errors = random_errors(table, 500, [table_grid(settings, 128, n) for n in (16, 32)], seed=2)
    worst = errors.max(axis=1)
    assert np.quantile(worst, 0.95) < 0.005 and worst.max() < 0.02
    assert table.worst(0.95, 1.0 - SHARE_MARGIN)["tilted_max"] < 0.02
    assert table.worst(0.95)["tilted_p95"] < 0.005 and path.stat().st_size < 20e6


@pytest.mark.parametrize(("reach", "limit"), [((0.0, 0.95), 0.005), ((0.95, 0.99), 0.02)])
def test_aligned_table_against_a_finer_film(table, reach, limit):
    rng = np.random.default_rng(4)
    grid = SETTINGS.on_shell(journal_grid(240, 32, half=True))
    work, active = journal_work(grid), cold_start(grid)
    for _ in range(40):
        eps, angle, gamma = rng.uniform(*reach), rng.uniform(-3, 3), rng.uniform(-math.pi, math.pi)
        v = np.array([math.cos(gamma), math.sin(gamma)])
        true = np.zeros(OUT_SIZE)
        journal_film(grid, RATIO**-2, Motion(eps, 0.0, 0.0, 0.0, *v, 0.0, 0.0), work, active, true)
        highest, flow = film_observables(grid, work)
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        out, status = aligned(table.arrays, [*(turn @ [eps, 0.0]), *(turn @ v)])
        assert status == TABLED
        assert np.linalg.norm(out[:2] - turn @ true[:2]) < limit * np.linalg.norm(true[:2])
        shown = aligned_observables(turn @ [eps, 0.0], turn @ v, 0.0, BEARING, table.arrays, np.zeros(16))
        assert shown[0] == pytest.approx(highest, rel=0.02)
        assert shown[1] == pytest.approx(flow, rel=0.02)


HALF = SETTINGS.on_shell(journal_grid(96, 16, half=True))
HALF_FILM = journal_work(HALF)


def aligned(arrays, state, half_speed=0.0):
    """Output and status of the aligned law at (x, y, vx, vy), in clearances."""
    out, tabled = np.zeros(12), Tabled(arrays, HALF, HALF_FILM, cold_start(HALF), MEMORY)
    return out, aligned_force(*np.asarray(state, dtype=float).reshape(2, 2), half_speed, 1.0, 1.0, tabled, out)


def aligned_apart(arrays, state, steps, half_speed=0.0):
    """Largest difference of the aligned law's tangents to slopes by differences, over the largest of them."""
    tangents = np.hstack(aligned(arrays, state, half_speed)[0][2:10].reshape(2, 2, 2))
    return np.max(apart(tangents, differences(lambda s: aligned(arrays, s, half_speed)[0][:2], state, steps)))


def any_state(rng, lowest=0.05, highest=0.95, tilt=0.8):
    return family(
        rng.uniform(lowest, highest), rng.uniform(-3, 3), *rng.uniform(-tilt, tilt, 2), rng.uniform(-math.pi, math.pi)
    )


def off_family(rng, tilt=0.8, highest=0.9, spread=1.0):
    """Random state with a tilt rate about as large as the velocity, and that rate over the velocity."""
    gamma = rng.uniform(-math.pi, math.pi)
    state = family(rng.uniform(0.05, highest), rng.uniform(-3, 3), *rng.uniform(-tilt, tilt, 2), gamma)
    rate, angle = math.exp(rng.normal(0.0, spread)), rng.uniform(-math.pi, math.pi)
    state[6:] += rate * np.array([math.cos(angle), math.sin(angle)])
    return state, rate


@pytest.mark.parametrize(
    ("near", "half_speed", "count"),
    [(True, 0.0, 60), (True, 0.7, 60), (False, 0.0, 20), pytest.param(False, 0.0, 80, marks=pytest.mark.slow)],
)
def test_tangents_are_derivatives_of_the_interpolation(table, near, half_speed, count):
    """Near the sampled family, at any rate of tilt, and seen from axes that turn with the surfaces."""
    rng, tried, close = np.random.default_rng(5 if near else 4), 0, 1e-7 if near else 1e-6
    while tried < count:
        if near:
            state = any_state(rng)
            state[6:] += rng.normal(size=2) * 0.2
        else:
            state, _ = off_family(rng, spread=1.5)
        state[4:] += half_speed * np.array([-state[1], state[0], -state[3], state[2]])
        out, status = law(table, state, half_speed)
        if status != TABLED:
            continue
        tried += 1
        steps = (1e-4 if near else 2e-5) * np.array([1 - np.hypot(*state[:2])] * 4 + [1.0] * 4)
        slopes = differences(lambda s: law(table, s, half_speed)[0][:4], state, steps)
        # A step may reach into the next cell, where the second derivative along a tilt differs.
        for part in apart(tangents(out), slopes):
            assert np.median(part) < close
            assert part.max() < (10.0 * close if not crosses(state, steps) else 1e-3)


def test_tangents_of_the_aligned_law(table):
    rng = np.random.default_rng(6)
    for _ in range(40):
        eps, angle = rng.uniform(0.05, 0.98), rng.uniform(-3, 3)
        state = np.array([eps * math.cos(angle), eps * math.sin(angle), *rng.normal(size=2)])
        assert aligned(table.arrays, state, 0.3)[1] == TABLED
        squeeze = state[2:] - 0.3 * np.array([-state[1], state[0]])
        steps = 1e-4 * np.array([1 - eps] * 2 + [1.0] * 2) * min(1.0, np.linalg.norm(squeeze))
        assert aligned_apart(table.arrays, state, steps, 0.3) < 1e-6


def test_tangents_where_the_aligned_table_hands_over(table):
    # A film of twice the length stands for a table that is far off: what joins them is the weight and its slope.
    axes = table.arrays.axes.copy()
    axes[ALIGNED_RATIO2] /= 4.0
    state = np.array([ALIGNED_MAX - 0.5 * ALIGNED_MARGIN, 0.0, 0.4, -0.7])
    arrays = table.arrays._replace(axes=axes)
    assert aligned(arrays, state)[1] == BLENDED
    assert aligned_apart(arrays, state, np.array([1e-5, 1e-5, 1e-3, 1e-3])) < 0.03


def test_sampled_films_are_extrapolated_to_narrow_grids():
    coarse, fine, narrow = (table_grid(SETTINGS, 96, n) for n in (12, 24, 96))
    gamma, share, eps = np.array([0.2, 1.5, -1.0, 2.5]), np.array([0.3, 0.6]), 0.6
    values, out = np.zeros((4, 2, 2, FUNCTIONS + 1)), np.zeros(2 * OUT_SIZE)
    films = [solved_film(grid) for grid in (coarse, fine)]
    assert sample_tilted((eps, SETTINGS.ends()), gamma, share, RATIO**-2, *films, out, values) == 0
    errors = np.zeros((4, 2, 2))
    for j, k in np.ndindex(4, 2):
        state = family(eps, 0.0, share[k], share[k], gamma[j])
        one, true = (np.log(np.hypot(*solved(state, [grid, grid])[:2])) for grid in (fine, narrow))
        errors[j, k] = values[j, k, k, LN_FORCE] - true, one - true
    extrapolated, plain = np.sqrt((errors**2).mean(axis=(0, 1)))
    assert extrapolated < 0.3 * plain


def test_homogeneous_in_all_speeds_and_round(table):
    rng = np.random.default_rng(8)
    for _ in range(20):
        state = any_state(rng)
        force = law(table, state)[0][:4]
        faster = state * np.array([1.0] * 4 + [7.0] * 4)
        assert law(table, faster)[0][:4] == pytest.approx(7 * force, rel=1e-9, abs=1e-9 * np.abs(force).max())
        turn = np.array([[0.6, -0.8], [0.8, 0.6]])
        turned = np.concatenate([turn @ state[k : k + 2] for k in range(0, 8, 2)])
        expected = np.concatenate([turn @ force[:2], turn @ force[2:]])
        assert law(table, turned)[0][:4] == pytest.approx(expected, abs=1e-9 * np.abs(force).max())
        # In units of a bearing: 20 µm, 3 N s.
        scaled = law(table, state, clearance=2e-5, factor=3.0)[0]
        assert scaled[:4] == pytest.approx(3 * force, rel=1e-9, abs=1e-9 * np.abs(force).max())
        assert scaled[4:36] == pytest.approx(law(table, state)[0][4:36] * 3 / 2e-5, rel=1e-7, abs=1e-3)


def sides(*state, moved):
    """Two states of the family whose values of some of its coordinates are 1e-9 less and more."""
    return [family(*(value + s * 1e-9 * (k in moved) for k, value in enumerate(state))) for s in (-1, 1)]


def test_force_and_tangents_are_continuous_across_the_hand_over(table):
    """On the two sides of each of its borders."""
    seen, end = set(), SETTINGS.tilt_range
    borders = [sides(eps, 0.3, 0.3, -0.4, 1.9, moved=[0]) for eps in (TILTED_MAX - 0.01, TILTED_MAX)]
    for share in ((1.0 - SHARE_MARGIN) * end, end):
        borders += [sides(0.6, 0.3, share, 0.2, 1.9, moved=[2]), sides(0.6, 0.3, -0.2, -share, 1.9, moved=[3])]
    for pair in borders:
        seen |= {law(table, state)[1] for state in pair}
        assert max(path_across(table, pair)) < 1e-5
    assert seen == {TABLED, BLENDED, SOLVED}


def test_force_and_tangents_are_continuous_across_cells(table):
    eps = eccentricity_nodes(SETTINGS.shape[0], TILTED_MAX)[9]
    assert stretched(eps)[0] == pytest.approx(9 / 19 * stretched(TILTED_MAX)[0], rel=1e-12)
    gamma = database.directions(SETTINGS.shape[1])[18]
    q, n = database.TILT_STRETCH, SETTINGS.shape[2] - 1
    border = SETTINGS.tilt_range * math.tanh(0.5 / n * math.atanh(q)) / q
    apart_at = np.array([0.0] * 6 + [0.6, 0.8])  # a direction of tilt rates
    for pair in (
        sides(eps, 0.3, 0.3, 0.2, 0.8, moved=[0]),
        *(sides(0.5, 0.3, 0.3, 0.2, angle, moved=[4]) for angle in (gamma, math.pi)),
        *(sides(0.5, 0.3, share, 0.2, 0.8, moved=[2]) for share in (border, 0.0)),
        *(sides(0.5, 0.3, 0.2, share, 0.8, moved=[3]) for share in (border, 0.0)),
        # where the two points part
        *([family(0.6, 0.3, 0.4, -0.3, 1.9) + (rate + s) * apart_at for s in (-1e-9, 1e-9)] for rate in ONE_POINT),
    ):
        assert {law(table, state)[1] for state in pair} == {TABLED}
        assert max(path_across(table, pair)) < 1e-6


def test_blended_tangents_carry_the_slope_of_the_weight(table):
    # The film's own tangents are those of fixed nodes and a fixed active set: nodes at rest here, and within a per cent
    # or two of differences.
    eps = TILTED_MAX - 0.005
    grid = table_grid(SETTINGS, 192, 12)
    grid.settings[NODE_GRADING] = 0.0
    for state in (
        family(eps, 0.3, 0.3, -0.4, 1.2),
        family(0.6, 0.3, 0.985 * SETTINGS.tilt_range, 0.2, 1.2),
        family(0.6, 0.3, 0.2, 0.985 * SETTINGS.tilt_range, 1.2),
    ):
        out, status = law(table, state, grid=grid)
        assert status == BLENDED and 0 < out[37] < 1
        slopes = differences(lambda s: law(table, s, grid=grid)[0][:4], state, np.array([1e-4] * 4 + [1e-3] * 4))
        assert np.max(apart(tangents(out), slopes)) < 0.03


def test_a_tilted_journal_at_rest_between_turning_surfaces(table):
    grids = [table_grid(SETTINGS, *size) for size in database.TILT_GRIDS]
    rng = np.random.default_rng(9)
    stated = table.worst(0.95)["tilted_max"]
    for eps in (0.3, 0.5, 0.7, 0.9, 0.94):
        for _ in range(4):
            e, t, *_ = place(eps, rng.uniform(-3, 3), *rng.uniform(-0.8, 0.8, 2))
            at_rest = np.concatenate([e, t, np.zeros(4)])
            out, status = law(table, at_rest, half_speed=1.0)
            assert status == TABLED
            squeeze = np.concatenate([e, t, [e[1], -e[0]], [t[1], -t[0]]])
            true = solved(squeeze, grids)
            assert np.abs(out[:4] - true).max() < stated * np.hypot(*true[:2])


def test_nothing_breaks_outside_at_the_centre_or_at_rest(table):
    beyond = [0.99, 0, 0, 0, 1, 0, 0, 0], [0.5, 0, 0.8, 0, 1, 0, 0, 0]
    inside = [0.0, 0, 0.1, 0.2, 0, 0, 0, 0], [0.5, 0, 0.1, 0.2, 0, 0, 0.3, 0]
    for state in (*beyond, *inside, [1.2, 0, 0.5, 0, 1, 0, 0, 0], [0.3, 0.2, 0, 3.0, 1, 0, 0, 0]):
        out, status = law(table, state)
        assert np.isfinite(out).all() and status in (TABLED, SOLVED) and (status == SOLVED or state not in beyond)
    assert (law(table, [0.0] * 8)[0][:4] == 0).all()
    for eps in (0.994, 0.9999, 1.1):
        out, status = aligned(table.arrays, [eps, 0.0, 1.0, 0.5], 1.0)
        assert status != TABLED and np.isfinite(out).all()


def test_a_groove_all_round_makes_two_films_of_half_the_width():
    straight = replace(SETTINGS, relief_depth=0.0)
    grooved = replace(straight, length_ratio=2 * RATIO, groove="circumferential")
    assert aligned_norms(grooved)[0] == pytest.approx(aligned_norms(SETTINGS)[0])
    name = f"aligned {len(centres(eccentricity_nodes(49, ALIGNED_MAX))) // 2}"
    assert (sample_slab(grooved, name) == sample_slab(straight, name)).all()
    # Of a relieved shell, too, the aligned film is then that of a straight one: its halves have one such edge only.
    assert (sample_slab(replace(grooved, relief_depth=0.15), name) == sample_slab(straight, name)).all()
    # Without tilt the film with pressure held at z = 0 is that pair.
    slab = sample_slab(grooved, "tilted 10")[:, 0, 0]
    eps = eccentricity_nodes(20, TILTED_MAX)[10]
    grid = straight.on_shell(journal_grid(144, 24, half=True))
    work, out = journal_work(grid), np.zeros(OUT_SIZE)
    for value, gamma in zip(slab, database.directions(28), strict=True):
        at = Motion(eps, 0.0, 0.0, 0.0, math.cos(gamma), math.sin(gamma), 0.0, 0.0)
        journal_film(grid, RATIO**-2, at, work, cold_start(grid), out)
        # The groove's film spans the whole width: norms are the same.
        assert math.exp(value[0]) == pytest.approx(np.hypot(*out[:2]), rel=0.005)


def test_largest_pressure_of_a_tilted_film(table):
    grid = table_grid(SETTINGS, 96, 24)
    work = journal_work(grid)
    for eps, gamma in ((0.4, 0.3), (0.8, -1.7)):
        state = family(eps, 0.5, 0.4, -0.3, gamma)
        journal_film(grid, RATIO**-2, Motion(*state), work, cold_start(grid), np.zeros(OUT_SIZE))
        shown = tilted_pressure(state[:4], state[4:], 0.0, BEARING, table.arrays, MEMORY)
        assert shown == pytest.approx(film_observables(grid, work)[0], rel=0.05)
    outside = np.array([0.99, 0.0, 0.0, 0.0])
    assert tilted_pressure(outside, np.array([1.0, 0.0, 0.0, 0.0]), 0.0, BEARING, table.arrays, MEMORY) < 0


def test_slabs_do_not_depend_on_each_other():
    names = slab_names(SETTINGS)
    assert len(set(names)) == len(names) == 49 + 48 + 20 + 19
    first = sample_slab(SETTINGS, "tilted 7")
    sample_slab(SETTINGS, "tilted 15")
    assert (sample_slab(SETTINGS, "tilted 7") == first).all()


GRIDS = [table_grid(SETTINGS, *size) for size in database.TILT_GRIDS]


def test_rates_of_tilt_against_the_film(table):
    """Where the oil carries: approach, rates up to twice the velocity. The linear term alone misses by a third."""
    rng = np.random.default_rng(2)
    differs, linear = [], []
    while len(differs) < 150:
        state, rate = off_family(rng)
        e, v = state[:2], state[4:6]
        if rate > 2.0 or e @ v < 0.0:
            continue
        out, status = law(table, state)
        assert status == TABLED
        true = solved(state, GRIDS)
        on = state.copy()
        rho = turning(math.hypot(*e))[0]
        on[6:] = rho * (e[0] * v[1] - e[1] * v[0]) / math.hypot(*e) * np.array([-state[3], state[2]])
        at, _ = law(table, on)
        first = at[:4] + at[20:36].reshape(4, 4)[:, 2:] @ (state[6:] - on[6:])
        size = np.hypot(*true[:2])
        differs.append(np.abs(out[:4] - true).max() / size)
        linear.append(np.abs(first - true).max() / size)
    assert np.median(differs) < 0.01 and np.quantile(differs, 0.9) < 0.05
    assert np.quantile(linear, 0.9) > 2 * np.quantile(differs, 0.9)


def test_an_aligned_journal_carries_more_whichever_way_it_tilts(table):
    for gamma in (0.0, 0.8, -1.5):
        forces = []
        for rate in (-8.0, -1.0, 0.0, 1.0, 8.0):
            state = family(0.8, 0.0, 0.0, 0.0, gamma)
            state[6] = rate
            out, _ = law(table, state)
            forces.append(np.hypot(*out[:2]))
            true = solved(state, GRIDS)
            assert np.abs(out[:2] - true[:2]).max() < 0.15 * np.hypot(*true[:2])
        assert forces[0] == pytest.approx(forces[4], rel=1e-12)
        # Below the rate at which an end would part, the film is linear and d adds nothing.
        assert forces[0] > 1.01 * forces[2] and forces[1] > (1 - 1e-9) * forces[2]


@pytest.mark.parametrize("states", [400, pytest.param(4000, marks=pytest.mark.slow)])
def test_no_power_is_made(table, states):
    rng = np.random.default_rng(3)
    for _ in some(range(states)):
        state, _ = off_family(rng, tilt=0.9, highest=0.95, spread=1.5)
        force = law(table, state)[0][:4]
        assert force @ state[4:] < 0.0


def test_a_point_without_a_direction_leaves_no_jump(table):
    """v + λ d passes through zero for one of the two points: the force is continuous there."""
    eps, d = 0.6, np.array([0.3, 1.0])
    d /= np.hypot(*d)
    rate, _ = turning(eps)
    lever = LEVER * rate * eps * 0.4
    low, high = 0.0, 1.0
    for _ in range(60):  # |v| where λ_- d reaches back to zero
        size = 0.5 * (low + high)
        q = 1.0 / size**2
        sigma = SPREAD[0] * (1 - SPREAD[1] * q / (1 + q))
        low, high = (size, high) if sigma - lever > size else (low, size)

    def at(angle, distance):
        state = family(eps, 0.0, 0.4, 0.0, 0.0)
        v = size * d + distance * np.array([math.cos(angle), math.sin(angle)])
        a = state[2]
        state[4:6] = v
        state[6:8] = d + v[1] * rate * np.array([0.0, a])
        return law(table, state)[0]

    middle = at(0.0, 0.0)
    assert np.isfinite(middle).all()
    for distance in (1e-3, 1e-6, 1e-9):
        around = [at(angle, distance)[:4] for angle in np.linspace(0, 2 * math.pi, 13)]
        assert np.abs(np.array(around) - middle[:4]).max() < 10 * distance * np.abs(middle[20:36]).max()
