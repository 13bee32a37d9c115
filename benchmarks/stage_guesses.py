"""Weights of the stages' first guesses, and what they leave: ``python -m benchmarks.stage_guesses [INTEGRATOR ...]``.

With ``cost`` in place of integrators: iterations a stage and processor time of a cycle with weights and without. Else
it prints for each method the rows of :mod:`cranktrain.dynamics.time.stage_guesses`, by least squares over the runs
below; then for each run how far a guess is off at each stage, in units of the ports' scales: the median over steps of
the largest over the Newton ports, without weights, with weights of the run's own, and with those of all runs.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import replace
from statistics import median

import numpy as np
from benchmarks.level_cost import LEVELS, ROUNDS, Case, torsion

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.model.slots import MORE_MISSED, N_ITERATIONS, N_STAGES, N_STEPS
from cranktrain.dynamics.simulation import Simulation
from cranktrain.dynamics.time.table import FIRST_STAGE, GUESSED, HEAD, STAGES
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import assemble

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
    return [float(np.median(np.abs(left[:, s]).max(axis=1))) for s in range(run.shape[1])]


def cost() -> None:
    """Print iterations a stage with and without weights, and the cost with them over that without."""
    for level, degrees, method in COSTS:
        cases = [Case(LEVELS[level][0], degrees, method) for _ in range(2)]
        cases[1].run.model.stages[FIRST_STAGE:, GUESSED:] = 0.0
        for case in cases:
            torsion(case)
            case.run.work.counters[:] = 0.0
        pairs = [[case.cycle()[0] for case in cases] for _ in range(ROUNDS)]
        ratio = median(own / other for own, other in pairs)
        taken, before = (case.run.work.counters[N_ITERATIONS] / case.run.work.counters[N_STAGES] for case in cases)
        print(f"{level:>9} {degrees:4.1f} deg {method:>8}: {taken:.2f} for {before:.2f}, cost {ratio:.3f}", flush=True)


def main(names: Sequence[str]) -> int:
    """Fit and print, or measure the cost."""
    if list(names) == ["cost"]:
        cost()
        return 0
    for name in names or METHODS:
        runs = {row: changes(*row, name) for row in RUNS}
        weights = fitted(list(runs.values()))
        print(f'    "{name}": (')
        for s, row in enumerate(weights):
            print(f"        ({', '.join(f'{value:.2f}' for value in row[:s])}{',' if s == 1 else ''}),")
        print("    ),")
        for (level, speed, degrees), run in runs.items():
            for title, used in (("none", 0.0 * weights), ("own", fitted([run])), ("all", weights)):
                text = " ".join(f"{value:.0e}" for value in missed(run, used))
                print(f"# {level:>9} {speed:4.0f} rev/min {degrees:5.2f} deg, weights {title:>4}: {text}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
