"""What elastic films on all mains cost and what limits it: ``python -m benchmarks.elastic_cost``.

The six at 2000 rev/min, every case from the static equilibrium, its third cycle. Cost: processor time over the
cycle's length, median of the cycles behind the first; steps, stages, and per cycle of all films together solutions,
those with tangents, and Newton iterations. Error: least gap of each main over the cycle, at equal places of the crank,
its largest pressure over all steps, and RMS of the pulley's torsion over that of its alternating part, against esdirk47
at half a degree on the same grid, in doubles; for grids against 96 x 24 at the usual step. Cases: how steps follow
closing films, half the step, films solved one by one in doubles, other grids. The parts of one film are timed one by
one at its last state, least of several repeats. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from statistics import median
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cranktrain.core.kernel import RECORDS
from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.file import load_engine
from cranktrain.film.elastic.balance import oil_balance
from cranktrain.film.elastic.band import factor_lanes, solve_lanes
from cranktrain.film.elastic.begin import begin_solution, prepare_step
from cranktrain.film.elastic.border import border_equations, present_loads, shape_sources, solution_loads
from cranktrain.film.elastic.gaps import open_gaps
from cranktrain.film.elastic.grid import ROUGHNESS, ElasticGrid
from cranktrain.film.elastic.newton import arrange, film_tangents
from cranktrain.film.elastic.result import film_figures, film_forces
from cranktrain.film.elastic.workspace import FAILED
from cranktrain.film.laws.ehd import FINE as GRID
from cranktrain.film.laws.ehd import ElasticBore
from cranktrain.film.laws.film_solution import EVALUATIONS, PASSES, TANGENTS
from cranktrain.film.laws.pressure_peak import PEAK, pressure_peaks
from cranktrain.structure.assembly import assemble

Array = NDArray[np.float64]
compiled: Any = njit(error_model="numpy")

SPEED = 2000.0 * math.pi / 30.0
CYCLES = 3
COMMON = math.radians(2.0)
"""Places of the crank at which cases are compared: ends of steps of all of them."""
FINE: dict[str, Any] = {"integrator": "esdirk47", "step": math.radians(0.5), "newton_tolerance": 3.0e-7}
FINE_GRID = ElasticGrid(96, 24, 0.3)
GRIDS = (
    (96, 16, 0.3),
    (48, 16, 0.3),
    (48, 12, 0.3),
    (64, 8, 0.5),
    (48, 8, 0.5),
    (48, 8, 0.3),
    (36, 8, 0.5),
    (48, 6, 0.5),
)
"""Nodes around and across, and their gathering at the ends."""
REPEATS, CALLS = 7, 200


@dataclass(frozen=True)
class Found:
    """One case: its figures, its last cycle, and the films it ended with."""

    figures: dict[str, Any]
    gaps: Array
    """(samples, mains) m"""
    torsion: Array
    """(samples,) rad"""
    pressures: Array
    """(mains,) the largest in each film over the steps of the cycle, as a run keeps it, Pa"""
    bore: ElasticBore
    run: Simulation


def measured(grid: ElasticGrid = GRID, **choices: Any) -> Found:
    """Run a case."""
    print(f"elastic_cost: {grid.n_phi} x {grid.n_z}, {choices}", file=sys.stderr, flush=True)
    made = assemble(load_engine("diesel_i6"), Settings(bearings="ehd", **choices))
    chosen = made.parts._replace(bore=replace(made.parts.bore, grid=grid))
    run = Simulation(made.engine, made.body, made.settings, None, chosen)
    run.inputs[0] = SPEED
    run.initialize()
    bore: ElasticBore = RECORDS[int(run.model.films.entry[0, 1])]
    length = 4.0 * math.pi / SPEED
    step = communication_step(SPEED, min(COMMON, made.settings.step))
    count = round(length / step)
    rows = np.zeros((count, run.outputs.size))
    done, costs = 0, []
    for _ in range(CYCLES):
        counters, calls = run.work.counters.copy(), bore.memory.calls.copy()
        begin = time.process_time()
        done += run.series(step, done + 1, rows)
        costs.append((time.process_time() - begin) / length)
    counters, calls = run.work.counters - counters, (bore.memory.calls - calls).sum(axis=0)
    every = round(count * COMMON / (4.0 * math.pi))
    names = list(run.output_names)
    mains = [names.index(f"bearing[{i + 1}].film_thickness_min") for i in range(len(bore.viscosities))]
    peaks = pressure_peaks(run.model.films.entry)
    assert peaks is not None
    kept = rows[every - 1 :: every]
    figures = {
        "of_real_time": round(median(costs[1:]), 2),
        "steps": int(counters[at.N_STEPS]),
        "stages": int(counters[at.N_STAGES]),
        "solutions": int(calls[EVALUATIONS]),
        "with_tangents": int(calls[TANGENTS]),
        "iterations": int(calls[PASSES]),
        "us_per_solution": round(1e6 * length * costs[-1] / calls[EVALUATIONS], 1),
        "us_per_iteration": round(1e6 * length * costs[-1] / calls[PASSES], 1),
    }
    return Found(figures, kept[:, mains], kept[:, names.index("pulley.torsion")], peaks[:, PEAK], bore, run)


def against(case: Found, exact: Found) -> dict[str, Any]:
    """Figures of a case with its errors."""
    least, best = case.gaps.min(axis=0), exact.gaps.min(axis=0)
    worst = int(best.argmin())
    pressures = np.abs(case.pressures / exact.pressures - 1.0)
    torsion = float(np.sqrt(np.mean((case.torsion - exact.torsion) ** 2)) / np.std(exact.torsion))
    return {
        **case.figures,
        "least_gap_um": [round(1e6 * float(h), 3) for h in least],
        "error_of_least_gaps": [round(float(e), 5) for e in least / best - 1.0],
        "main_of_least_gap": worst + 1,
        "error_of_least_gap": round(float(least[worst] / best[worst] - 1.0), 5),
        "largest_error_of_least_gaps": round(float(np.abs(least / best - 1.0).max()), 5),
        "largest_error_of_pressures": round(float(pressures.max()), 5),
        "error_of_torsion": float(f"{torsion:.2g}"),
    }


def _microseconds(call: Callable[..., Any], *arguments: Any) -> float:
    """Of one call among many, the least of several repeats."""
    call(1, *arguments)
    best = math.inf
    for _ in range(REPEATS):
        begin = time.process_time()
        call(CALLS, *arguments)
        best = min(best, time.process_time() - begin)
    return 1e6 * best / CALLS


@compiled
def _start(calls: int, film: Any, work: Any, own: Any, rates: Any) -> None:
    for _ in range(calls):
        prepare_step(film, work, 0, own.start)
        begin_solution(film, work, 0, rates[0], rates[1])


@compiled
def _gaps(calls: int, film: Any, work: Any, own: Any, rates: Any) -> None:
    for _ in range(calls):
        open_gaps(film, work, 0, film.constants[ROUGHNESS])


@compiled
def _balance(calls: int, film: Any, work: Any, own: Any, rates: Any) -> None:
    for _ in range(calls):
        width = arrange(film, work, 0, rates[0])
        oil_balance(film, work, 0, width, rates[0])


@compiled
def _sources(calls: int, film: Any, work: Any, own: Any, rates: Any) -> None:
    for _ in range(calls):
        shape_sources(film, work, 0, rates[1])


@compiled
def _factors(calls: int, film: Any, work: Any, own: Any, rates: Any) -> None:
    width = arrange(film, work, 0, rates[0])
    for _ in range(calls):
        oil_balance(film, work, 0, width, rates[0])
        factor_lanes(work.band, work.columns.shape[0], width, work.lane, FAILED)


@compiled
def _solves(calls: int, film: Any, work: Any, own: Any, rates: Any) -> None:
    width = arrange(film, work, 0, rates[0])
    for _ in range(calls):
        solve_lanes(work.band, work.columns.shape[0], width, work.columns, 0)


@compiled
def _loads(calls: int, film: Any, work: Any, own: Any, rates: Any) -> None:
    for _ in range(calls):
        solution_loads(film, work, 0, 0, 0)


@compiled
def _present(calls: int, film: Any, work: Any, own: Any, rates: Any) -> None:
    for _ in range(calls):
        present_loads(film, work, 0, True)


@compiled
def _border(calls: int, film: Any, work: Any, own: Any, rates: Any) -> None:
    for _ in range(calls):
        border_equations(film, work, 1, 0)


@compiled
def _tangents(calls: int, film: Any, work: Any, own: Any, rates: Any) -> None:
    width = arrange(film, work, 0, rates[0])
    for _ in range(calls):
        film_tangents(film, work, 0, width, own.out)


@compiled
def _result(calls: int, film: Any, work: Any, own: Any, rates: Any) -> None:
    for _ in range(calls):
        film_forces(film, work, 0, own.out)
        film_figures(film, work, 0, own.out)


PARTS = {
    "start of a solution": _start,
    "gaps": _gaps,
    "balance of oil with its matrix": _balance,
    "sources of the shapes": _sources,
    "factors": _factors,
    "solution of eight right-hand sides": _solves,
    "loads of eight solutions": _loads,
    "loads of the present pressure": _present,
    "border": _border,
    "tangents": _tangents,
    "result of a solution": _result,
}


def parts(bore: ElasticBore, run: Simulation) -> dict[str, float]:
    """Microseconds of a film's parts at the last state of its run, whose films were solved one by one.

    Once a solution, once an iteration, and tangents. Factors overwrite the matrix, which is made anew for each.
    """
    per_step = SPEED / run.settings.step
    given = (bore.film, bore.scratch, bore.memory, (per_step, per_step / 0.2929))
    found = {name: _microseconds(part, *given) for name, part in PARTS.items()}
    found["factors"] -= found["balance of oil with its matrix"]
    return {name: round(value, 2) for name, value in found.items()}


def main() -> int:
    """Measure and print."""
    exact, alone = measured(**FINE), measured(newton_tolerance=1.0e-9)
    cases = {
        "usual": measured(),
        "tolerance 1e-9, each film by itself in doubles": alone,
        "steps that do not follow closing films": measured(film_change=1.0e9),
        "half the step": measured(step=math.radians(1.0), film_change=1.0e9),
        "the reference with half its step": measured(**FINE | {"step": 0.5 * FINE["step"]}),
    }
    fine = measured(FINE_GRID)
    grids = {
        f"{n_phi} x {n_z}, gathered by {edge:g}": measured(ElasticGrid(n_phi, n_z, edge)) for n_phi, n_z, edge in GRIDS
    }
    said = {
        "cases": {name: against(case, exact) for name, case in cases.items()},
        "reference": exact.figures,
        "grids": {name: against(case, fine) for name, case in grids.items()},
        "finest grid": fine.figures,
        "parts": parts(alone.bore, alone.run),
    }
    print(json.dumps(said, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
