"""What the film table is worth and what it costs: ``python benchmarks/film_table.py [REV_PER_MIN]``.

Five parts: error at random states without tilt, and with tilt on the family of velocities that the table samples, each
against the films that the table was made of and against finer ones; with random tilts and random rates of tilt off the
family, by the size of that rate; time of one evaluation with tangents; and, on
places and velocities of the running six's main bearings solved in the loop (flexible crank, one cycle after one of
run-in), the error at the tilt rates that occur and the share of films that lie outside the table. Errors there are
taken over the largest force of the bearing in the cycle, among films inside the tilt range. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import sys
import time
from itertools import pairwise
from statistics import median
from typing import Any

import numpy as np
from _engine_run import engine_and_body
from numba import njit
from numpy.typing import NDArray

from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.file import load_engine
from cranktrain.film.journal.film import OUT_SIZE, journal_film
from cranktrain.film.journal.grid import JournalGrid, Motion, cold_start, journal_grid, journal_work
from cranktrain.film.laws.parameters import CLEARANCE
from cranktrain.film.table.aligned import aligned_force
from cranktrain.film.table.database import ALIGNED_GRID, TILT_GRIDS, FilmTable, bearing_settings, table_grid
from cranktrain.film.table.family import turning
from cranktrain.film.table.law import SHARE_MARGIN, TABLED, Tabled, table_force
from cranktrain.film.table.tilted import table_work
from cranktrain.store.film_tables import film_table

Array = NDArray[np.float64]
kernel: Any = njit(error_model="numpy")

SETTINGS = bearing_settings(load_engine("diesel_i6").plain_mains)
RATIO, reach_of = SETTINGS.length_ratio, np.polynomial.Polynomial(SETTINGS.ends())
ALIGNED_STATES, FINER_STATES, TILTED_STATES, ENGINE_STATES, COST_STATES = 2000, 100, 600, 3000, 500
REPEATS, PER_CYCLE = 201, 720
RATE_BINS = (0.0, 0.1, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
RATE_STATES = 200
QUANTILES = {"median": 0.5, "p90": 0.9, "p95": 0.95, "p99": 0.99, "worst": 1.0}


def spread_of(values: Array) -> dict[str, float]:
    """Quantiles of errors."""
    return {name: float(f"{np.quantile(values, q):.3g}") for name, q in QUANTILES.items()} if values.size else {}


def films(states: Array, grids: list[JournalGrid]) -> Array:
    """Forces (n, 4) of films at (ε, a, b, v_r, v_t, w_r, w_t) (n, 7); those of two grids are extrapolated."""
    solved = np.empty((len(grids), len(states), OUT_SIZE))
    for grid, results in zip(grids, solved, strict=True):
        work = journal_work(grid)
        for (eps, a, b, *velocity), out in zip(states, results, strict=True):
            journal_film(grid, RATIO**-2, Motion(eps, 0.0, a, b, *velocity), work, cold_start(grid), out)
    fine = solved[-1, :, :4]
    return np.asarray(fine + (fine - solved[0, :, :4]) / 3.0)


@kernel
def read(states, tabled, outs, status):
    """Law with tilt at all states, on the line of centres, surfaces at rest."""
    for i in range(states.shape[0]):
        status[i] = table_force(states[i, :4], states[i, 4:], 0.0, 1.0, 1.0, tabled, outs[i], True)


@kernel
def read_aligned(states, tabled, outs):
    """Law without tilt at all states."""
    for i in range(states.shape[0]):
        aligned_force(states[i, :4], states[i, 4:], 0.0, 1.0, 1.0, tabled, outs[i])


def tabled_film(table: FilmTable, grid: JournalGrid) -> Tabled:
    """A film read from the table, with fresh memory."""
    return Tabled(table.arrays, grid, journal_work(grid), cold_start(grid), table_work())


def with_place(states: Array) -> Array:
    """Places and velocities (n, 8) of states (n, 7) on the line of centres."""
    return np.insert(states, 1, 0.0, axis=1)


def law(table: FilmTable, states: Array) -> tuple[Array, Array]:
    """Output (n, 40) and status (n,) of the law with tilt."""
    grid = table_grid(table.settings)
    outs, status = np.zeros((len(states), 40)), np.zeros(len(states))
    read(with_place(states), tabled_film(table, grid), outs, status)
    return outs, status


def errors(found: Array, true: Array) -> Array:
    """The larger of force error over |F| and moment error over |F| L/2."""
    force, moment = (np.hypot(*(found - true)[:, k : k + 2].T) for k in (0, 2))
    return np.asarray(np.maximum(force, moment) / np.hypot(true[:, 0], true[:, 1]))


def possible(states: Array) -> tuple[Array, Array]:
    """Tilt as shares A, B of the possible one."""
    eps, a, b = states[:, :3].T
    reach2 = reach_of(eps) ** 2
    return a / (np.sqrt(reach2 - b * b) - eps), b / np.sqrt(reach2 - eps * eps)


def rates(states: Array) -> Array:
    """Tilt rate off the table's family over the velocity, |w − w_ref| / |v|."""
    result = []
    for eps, a, b, v_r, v_t, w_r, w_t in states:
        rate = turning(eps)[0]
        result.append(math.hypot(w_r + v_t * rate * b, w_t - v_t * rate * a) / math.hypot(v_r, v_t))
    return np.array(result)


def family(count: int, limit: float, seed: int) -> Array:
    """Random states of the table's family: ε to 0.95, any direction, tilt to ``limit``, the rate that belongs to it."""
    rng = np.random.default_rng(seed)
    states = np.empty((count, 7))
    for state in states:
        eps, share_a, share_b = rng.uniform(0.0, 0.95), *rng.uniform(-limit, limit, 2)
        gamma = rng.uniform(-math.pi, math.pi)
        b = share_b * math.sqrt(reach_of(eps) ** 2 - eps * eps)
        a = share_a * (math.sqrt(reach_of(eps) ** 2 - b * b) - eps)
        turn = math.sin(gamma) * turning(eps)[0]
        state[:] = eps, a, b, math.cos(gamma), math.sin(gamma), -turn * b, turn * a
    return states


def aligned_part(table: FilmTable) -> dict[str, Any]:
    """Error without tilt."""
    rng = np.random.default_rng(1)
    result = {}
    for name, low, top in (("to_0.95", 0.0, 0.95), ("0.95_to_0.99", 0.95, 0.99)):
        states = np.zeros((ALIGNED_STATES, 7))
        gamma = rng.uniform(-math.pi, math.pi, ALIGNED_STATES)
        states[:, 0], states[:, 3], states[:, 4] = rng.uniform(low, top, ALIGNED_STATES), np.cos(gamma), np.sin(gamma)
        grid = SETTINGS.on_shell(journal_grid(*ALIGNED_GRID, half=True))
        outs = np.zeros((ALIGNED_STATES, 12))
        read_aligned(with_place(states), tabled_film(table, grid), outs)
        found = np.column_stack([outs[:, :2], np.zeros((ALIGNED_STATES, 2))])
        finer = SETTINGS.on_shell(journal_grid(2 * ALIGNED_GRID[0], 2 * ALIGNED_GRID[1], half=True))
        some = slice(0, FINER_STATES)
        result[name] = {
            "same_film": spread_of(errors(found, films(states, [grid]))),
            "film_twice_finer": spread_of(errors(found[some], films(states[some], [finer]))),
        }
    return result


def tilted_part(table: FilmTable) -> dict[str, Any]:
    """Error with tilt on the family."""
    settings = table.settings
    states = family(TILTED_STATES, settings.tilt_range * (1.0 - SHARE_MARGIN), 2)
    found = law(table, states)[0]
    same, finer = TILT_GRIDS, ((2 * TILT_GRIDS[0][0], n) for n in (16, 32))
    return {
        "same_film": spread_of(errors(found[:, :4], films(states, [table_grid(settings, *n) for n in same]))),
        "finer_film": spread_of(errors(found[:, :4], films(states, [table_grid(settings, *n) for n in finer]))),
    }


def rates_part(table: FilmTable) -> dict[str, Any]:
    """Error with tilt at random rates off the family, |w − w_ref|/|v| in ``RATE_BINS``, all possible tilts and half.

    Over the larger force of two films, the second at the opposite rate: where a rate takes off what the velocity adds,
    the film's own is next to nothing.
    """
    settings, result = table.settings, {}
    rng = np.random.default_rng(6)
    grids = [table_grid(settings, *n) for n in TILT_GRIDS]
    for name, limit in (("all_tilts", settings.tilt_range * (1.0 - SHARE_MARGIN)), ("half_the_tilt", 0.5)):
        for low, high in pairwise(RATE_BINS[:-1]):
            states = family(RATE_STATES, limit, 7)
            size, way = rng.uniform(low, high, RATE_STATES), rng.uniform(-math.pi, math.pi, RATE_STATES)
            rate = (size * np.array([np.cos(way), np.sin(way)])).T
            there, back = states.copy(), states.copy()
            there[:, 5:] += rate
            back[:, 5:] -= rate
            true, other = films(there, grids), films(back, grids)
            found, status = law(table, there)
            error = np.hypot(*(found[:, :4] - true)[:, :2].T)
            error /= np.maximum(np.hypot(*true[:, :2].T), np.hypot(*other[:, :2].T))
            result[f"{name}_rate_{low:g}_to_{high:g}"] = spread_of(error[status == TABLED])
    return result


def cost_part(table: FilmTable) -> dict[str, float]:
    """Microseconds of one evaluation with tangents at random states: medians of repeats short enough to run through."""
    on = with_place(family(COST_STATES, 0.8, 3))
    off = on.copy()
    off[:, 6:] += 0.7 * np.random.default_rng(4).normal(size=(COST_STATES, 2))
    grid, half = table_grid(table.settings), SETTINGS.on_shell(journal_grid(*ALIGNED_GRID, half=True))
    tilted, plane = tabled_film(table, grid), tabled_film(table, half)
    outs, status = np.zeros((COST_STATES, 40)), np.zeros(COST_STATES)
    cases: dict[str, Any] = {
        "aligned_us": lambda: read_aligned(on, plane, outs),
        "tilted_one_point_us": lambda: read(on, tilted, outs, status),
        "tilted_two_points_us": lambda: read(off, tilted, outs, status),
    }
    taken = {}
    for name, run in cases.items():
        run()
        seconds = []
        for _ in range(REPEATS):
            start = time.perf_counter()
            run()
            seconds.append(time.perf_counter() - start)
        taken[name] = round(1e6 * median(seconds) / COST_STATES, 3)
    return taken


def engine_states(speed: float) -> tuple[Array, Array]:
    """States (n, 7) of all main bearings over one cycle after run-in, over the clearance, and their bearing."""
    engine, body = engine_and_body()
    simulation = Simulation(engine, body, Settings(bearings="reynolds"))
    simulation.inputs[0] = speed
    simulation.initialize()
    step = 4.0 * math.pi / speed / PER_CYCLE
    rows = []
    for k in range(1, 2 * PER_CYCLE + 1):
        simulation.step(k * step)
        if k > PER_CYCLE:
            rows.append(np.hstack([simulation.model.films.place, simulation.model.films.velocity]))
    count = len(simulation.model.bearings)
    seen = np.concatenate(rows) / simulation.model.bearings[0, CLEARANCE]
    # Pure squeeze, in axes along and across the line of centres.
    half = 0.5 * speed
    seen[:, 4:] += half * np.column_stack([seen[:, 1], -seen[:, 0], seen[:, 3], -seen[:, 2]])
    eps = np.hypot(seen[:, 0], seen[:, 1])
    along = seen[:, :2] / eps[:, None]
    states = np.empty((len(seen), 7))
    states[:, 0] = eps
    for k in (1, 2, 3):
        pair = seen[:, 2 * k : 2 * k + 2]
        states[:, 2 * k - 1] = (pair * along).sum(axis=1)
        states[:, 2 * k] = pair[:, 1] * along[:, 0] - pair[:, 0] * along[:, 1]
    return states, np.tile(np.arange(count), len(rows))


def engine_part(table: FilmTable, speed: float) -> dict[str, Any]:
    """Error at the tilt rates of the running engine, and what lies outside the table."""
    states, bearing = engine_states(speed)
    chosen = np.random.default_rng(5).permutation(len(states))[:ENGINE_STATES]
    states, bearing = states[chosen], bearing[chosen]
    settings = table.settings
    share = np.abs(np.array(possible(states))).max(axis=0)
    ratio = rates(states)
    status = law(table, states)[1]
    within = share < settings.tilt_range * (1.0 - SHARE_MARGIN)
    shares = {"not_from_table": float(np.mean(status != TABLED)), "largest_tilt": float(share.max())}
    states, bearing, ratio = states[within], bearing[within], ratio[within]
    true = films(states, [table_grid(settings, *size) for size in TILT_GRIDS])
    size = np.hypot(true[:, 0], true[:, 1])
    largest = np.array([size[bearing == k].max() for k in range(bearing.max() + 1)])[bearing]
    found = law(table, states)[0]
    force, moment = (np.hypot(*(found[:, :4] - true)[:, k : k + 2].T) for k in (0, 2))
    figures: dict[str, Any] = {
        "shares": shares,
        "force_over_largest": spread_of(force / largest),
        "moment_over_largest": spread_of(moment / largest),
        "force_over_own": spread_of(force / size),
    }
    for low, high in zip(RATE_BINS, (*RATE_BINS[1:], math.inf), strict=True):
        part = (ratio >= low) & (ratio < high)
        figures[f"rate_{low:g}_to_{high:g}"] = {
            "share": round(float(part.mean()), 4),
            **spread_of((force / largest)[part]),
        }
    return figures


def main() -> int:
    """Measure and print."""
    speed = float(sys.argv[1]) if len(sys.argv) > 1 else 2000.0
    start = time.perf_counter()
    table, _, solved = film_table(SETTINGS)
    result = {
        "making_or_reading_s": round(time.perf_counter() - start, 2),
        "slabs_solved": solved,
        "cells": table.cells,
        "aligned": aligned_part(table),
        "tilted": tilted_part(table),
        "off_family": rates_part(table),
        "cost": cost_part(table),
        "engine_rev_per_min": speed,
        "engine": engine_part(table, speed * math.pi / 30.0),
    }
    print(json.dumps(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
