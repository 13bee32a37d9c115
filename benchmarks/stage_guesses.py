"""Weights of the stages' first guesses, and what they leave: ``python -m benchmarks.stage_guesses [INTEGRATOR ...]``.

Prints one JSON object: for each method the rows of :mod:`cranktrain.dynamics.time.stage_guesses`, by least squares over
the runs below, and for each run how far a guess is off at each stage, in units of the ports' scales: the median over
steps of the largest over the Newton ports, without weights, with weights of the run's own, and with those of all runs.
Last, unless methods are named: iterations a stage with weights and without, and the cost with them over that without.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.model.slots import MORE_MISSED, N_ITERATIONS, N_STAGES, N_STEPS
from cranktrain.dynamics.simulation import Simulation
from cranktrain.dynamics.time.table import FIRST_STAGE, GUESSED, HEAD, STAGES
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import assemble

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from benchmarks.level_cost import LEVELS, ROUNDS, Case, torsion

RUNS = (
    ("impedance", 2000.0, 1.25), ("impedance", 2000.0, 2.5), ("impedance", 2000.0, 5.0), ("impedance", 1000.0, 2.5),
    ("impedance", 2600.0, 2.5), ("table", 2000.0, 2.5), ("table", 2000.0, 5.0), ("table", 1000.0, 2.5),
    ("beam", 2000.0, 5.0), ("beam", 2000.0, 10.0),
)  # fmt: skip
"""Level, rev/min, degrees."""
METHODS = ("sdirk3", "sdirk4", "esdirk3", "esdirk4", "esdirk5", "esdirk47", "esdirk57")
COSTS = (
    ("impedance", 2.5, "auto"), ("impedance", 5.0, "auto"), ("beam", 5.0, "auto"), ("table", 2.5, "auto"),
    ("table", 5.0, "esdirk47"), ("whole", 5.0, "auto"), ("whole", 2.5, "auto"),
)  # fmt: skip
"""Level, degrees, integrator."""
RIDGE = 1.0e-3
"""Of the mean square of what a weight multiplies: changes of two stages that go together share the weight."""
WARM_UP = 3
"""Steps after a start, and after a step in parts, that are left out."""


def changes(level: str, speed: float, degrees: float, method: str) -> Array:
    """How much more the series missed than a step before, (steps, stages, Newton ports) over the ports' scales."""
    settings = replace(LEVELS[level][0], step=math.radians(degrees), integrator=method)
    made = assemble(load_engine("diesel_i6"), settings)
    run = Simulation(made.engine, made.body, made.settings, None, made.parts)
    run.inputs[0] = speed * math.pi / 30.0
    run.initialize()
    step = communication_step(run.inputs[0], math.radians(degrees))
    count = round(4.0 * math.pi / run.inputs[0] / step)
    done = run.series(step, 1, np.zeros((count, run.outputs.size)))
    stages, ports = int(run.model.stages[HEAD, STAGES]), run.model.scales.size
    rows, kept = np.zeros((1, run.outputs.size)), []
    whole, parts = 0, run.work.counters[N_STEPS]
    for _ in range(count):
        done += run.series(step, done + 1, rows)
        whole = whole + 1 if run.work.counters[N_STEPS] == parts + 1 else 0
        parts = run.work.counters[N_STEPS]
        if whole >= WARM_UP:
            kept.append(run.work.known[:stages, MORE_MISSED, :ports] / run.model.scales)
    return np.array(kept)


def fitted(runs: Sequence[Array]) -> Array:
    """Weights (stages, stages) that leave least over ``runs``; each step counts alike."""
    stages = runs[0].shape[1]
    found = np.zeros((stages, stages))
    for s in range(1, stages):
        left, right = [], []
        for run in runs:
            size = np.abs(run).max(axis=(1, 2), keepdims=True) * math.sqrt(len(run)) + 1e-12
            left.append(np.moveaxis((run / size)[:, :s], 1, 2).reshape(-1, s))
            right.append((run / size)[:, s].ravel())
        a, b = np.concatenate(left), np.concatenate(right)
        squares = a.T @ a
        known = np.diag(squares) > 0.0  # an explicit first stage misses nothing
        squares += RIDGE * np.trace(squares) / max(1, known.sum()) * np.eye(s)
        if known.any():
            found[s, :s][known] = np.linalg.solve(squares[np.ix_(known, known)], (a.T @ b)[known])
    return found


def missed(run: Array, weights: Array) -> list[float]:
    """Median over steps of the largest guess error, for each stage."""
    left = run - np.einsum("sp,tpk->tsk", weights, run)
    return [float(f"{np.median(np.abs(left[:, s]).max(axis=1)):.1e}") for s in range(run.shape[1])]


def cost(level: str, degrees: float, method: str) -> dict[str, float]:
    """Iterations a stage with and without weights, and the cost with them over that without."""
    cases = [Case(LEVELS[level][0], degrees, method) for _ in range(2)]
    cases[1].run.model.stages[FIRST_STAGE:, GUESSED:] = 0.0
    for case in cases:
        torsion(case)
        case.run.work.counters[:] = 0.0
    pairs = [[case.cycle()[0] for case in cases] for _ in range(ROUNDS)]
    taken, before = (case.run.work.counters[N_ITERATIONS] / case.run.work.counters[N_STAGES] for case in cases)
    ratio = median(own / other for own, other in pairs)
    return {"iterations": round(taken, 3), "without": round(before, 3), "cost_over_without": round(ratio, 3)}


def of_method(name: str) -> dict[str, Any]:
    """Weights of a method, and what guesses miss."""
    runs = {row: changes(*row, name) for row in RUNS}
    weights = fitted(list(runs.values()))
    left = {
        f"{level} at {speed:g} rev/min, {degrees:g} deg": {
            "none": missed(run, 0.0 * weights), "own": missed(run, fitted([run])), "all": missed(run, weights),
        }
        for (level, speed, degrees), run in runs.items()
    }  # fmt: skip
    return {"weights": [np.round(row[:s], 2).tolist() for s, row in enumerate(weights)], "missed": left}


def main(names: Sequence[str]) -> int:
    """Fit, measure and print."""
    found: dict[str, Any] = {}
    for name in names or METHODS:
        print(name, file=sys.stderr, flush=True)
        found[name] = of_method(name)
    if not names:
        found["cost"] = {
            f"{level}, {degrees:g} deg, {method}": cost(level, degrees, method) for level, degrees, method in COSTS
        }
    print(json.dumps(found, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
