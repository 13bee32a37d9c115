"""The film table at tilt rates off the family that it samples: damping, limits, passivity, tangents, continuity."""

import math

import numpy as np
import pytest
from film_tables import (
    SETTINGS,
    coarse_table,
    crosses,
    differences,
    family,
    law,
    path_across,
    solved,
)
from some import some

from cranktrain.film.journal.film import DAMPING, OUT_SIZE, journal_film
from cranktrain.film.journal.grid import Motion, cold_start, journal_work
from cranktrain.film.table import database
from cranktrain.film.table.database import table_grid
from cranktrain.film.table.family import LEVER, ONE_POINT, SPREAD, turning
from cranktrain.film.table.law import TABLED

GRIDS = [table_grid(SETTINGS, *size) for size in database.TILT_GRIDS]


@pytest.fixture(scope="module")
def table():
    return coarse_table()


def off_family(rng, tilt=0.8, highest=0.9, spread=1.0):
    """Random state with a tilt rate about as large as the velocity, and that rate over the velocity."""
    gamma = rng.uniform(-math.pi, math.pi)
    state = family(rng.uniform(0.05, highest), rng.uniform(-3, 3), *rng.uniform(-tilt, tilt, 2), gamma)
    rate, angle = math.exp(rng.normal(0.0, spread)), rng.uniform(-math.pi, math.pi)
    state[6:] += rate * np.array([math.cos(angle), math.sin(angle)])
    return state, rate


def test_damping_on_the_family_is_that_of_the_film(table):
    rng = np.random.default_rng(1)
    grid = GRIDS[1]
    differs = []
    for _ in range(100):
        state = family(rng.uniform(0.1, 0.9), 0.0, *rng.uniform(-0.8, 0.8, 2), rng.uniform(-math.pi, math.pi))
        out = np.zeros(OUT_SIZE)
        journal_film(grid, SETTINGS.length_ratio**-2, Motion(*state), journal_work(grid), cold_start(grid), out)
        true = out[DAMPING:].reshape(4, 4)
        read = law(table, state)[0][20:36].reshape(4, 4)
        differs.append(np.abs(read - true).max() / np.abs(true).max())
    # Slopes of the interpolation; the film's own tangents jump by a per cent or two as nodes rupture.
    assert np.median(differs) < table.worst(0.95)["tilted_p95"]
    assert np.quantile(differs, 0.95) < 2 * table.worst(0.95)["tilted_max"]


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
    assert np.median(differs) < 0.01
    assert np.quantile(differs, 0.9) < 0.05
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
        assert forces[0] > 1.01 * forces[2]
        assert forces[1] > (1 - 1e-9) * forces[2]


@pytest.mark.parametrize("states", [400, pytest.param(4000, marks=pytest.mark.slow)])
def test_no_power_is_made(table, states):
    rng = np.random.default_rng(3)
    for _ in some(range(states)):
        state, _ = off_family(rng, tilt=0.9, highest=0.95, spread=1.5)
        force = law(table, state)[0][:4]
        assert force @ state[4:] < 0.0


@pytest.mark.parametrize("states", [20, pytest.param(80, marks=pytest.mark.slow)])
def test_tangents_are_derivatives_at_any_rate(table, states):
    rng = np.random.default_rng(4)
    for _ in some(range(states)):
        state, _ = off_family(rng, spread=1.5)
        eps = np.hypot(*state[:2])
        out, _ = law(table, state)
        steps = 2e-5 * np.array([1 - eps] * 4 + [1.0] * 4)
        slopes = differences(lambda s: law(table, s)[0][:4], state, steps)
        tangent = np.concatenate([out[4:20].reshape(4, 4), out[20:36].reshape(4, 4)], axis=1)
        for block in (slice(0, 4), slice(4, 8)):
            scale = np.abs(tangent[:, block]).max()
            assert np.median(np.abs(tangent - slopes)[:, block]) < 1e-6 * scale
            assert np.abs(tangent - slopes)[:, block].max() < (1e-5 if not crosses(state, steps) else 1e-3) * scale


def test_force_and_tangents_are_continuous_where_the_two_points_part(table):
    tiny = 1e-9
    for rate in ONE_POINT:
        pair = [family(0.6, 0.3, 0.4, -0.3, 1.9) for _ in range(2)]
        for state, s in zip(pair, (-1, 1), strict=True):
            state[6:] += (rate + s * tiny) * np.array([0.6, 0.8])
        assert max(path_across(table, pair)) < 1e-6


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
