"""The stage solver against SciPy's stiff solvers on the same equations: ``python benchmarks/against_scipy.py``.

The real engine at 2000 rev/min with impedance bearings, six cycles from the same start. SciPy integrates the compiled
right-hand side of ``_first_order``; its absolute tolerance is per unknown, rtol times the unknown's own alternating
amplitude (RMS), or that with a floor; its Jacobian is dense, by compiled forward differences with increments scaled
alike, which is faster than the differences that SciPy forms itself (measured beside it, once). Ours is the default
integrator over its step, at two Newton tolerances. The cost at an error is interpolated on each curve, log-log;
the error is the larger one of pulley torsion and axial motion. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import os
import sys
import time
from functools import partial
from statistics import median
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from _engine_run import (
    COMMUNICATION_DEG,
    CYCLES,
    SIMULATED,
    SPEED,
    Array,
    cost_at,
    engine_and_body,
    errors,
    reference,
    run,
    started,
)
from _first_order import FirstOrder
from scipy.integrate import solve_ivp

from cranktrain.dynamics.model import Settings, resolved
from cranktrain.dynamics.state import ACCELERATION, TIME, offset
from cranktrain.engine import Engine
from cranktrain.reduced_body import ReducedBody

# Method, scaling, rtol. Floored: no unknown's tolerance is less than a tenth of its kind's largest, for high modes need
# not be followed. BDF floored misses the error at a higher cost; Radau floored did not finish at rtol 1e-2.
LADDER = (
    ("BDF", "each", (1e-2, 1e-3)),
    ("Radau", "each", (1e-2, 1e-3, 1e-4)),
    ("LSODA", "each", (1e-3, 1e-4, 1e-5)),
    ("LSODA", "floored", (1e-3, 3e-4, 1e-4, 1e-6)),
)
FLOOR = 0.1
STEPS_DEG = (6.0, 4.0, 3.0, 2.0, 1.5, 1.0, 0.75, 0.5, 0.25)
TIGHT = 1.0e-9
TARGETS = (1.0e-3, 1.0e-5)
PER_CYCLE = round(720.0 / COMMUNICATION_DEG)
PERIOD = 4.0 * math.pi / SPEED


def agreement(engine: Engine, body: ReducedBody) -> tuple[float, Array]:
    """Largest relative difference of the accelerations from the stage solver's, and the unknowns' amplitudes (k,)."""
    settings = Settings(step=math.radians(0.25), newton_tolerance=1e-12)
    simulation = started(engine, body, settings)
    equations = FirstOrder(simulation)
    n = body.n_modes
    samples, worst = [], 0.0
    for k in range(1, 2 * PER_CYCLE + 1):
        simulation.step(k * PERIOD / PER_CYCLE)
        state = simulation.state
        y = equations.start(state)
        samples.append(y)
        a = state[offset(ACCELERATION, n) : offset(ACCELERATION, n) + n]
        worst = max(worst, np.abs(equations(state[TIME], y)[n : 2 * n] - a).max() / np.abs(a).max())
    return worst, np.std(samples[PER_CYCLE:], axis=0)


def scipy_run(
    engine: Engine, body: ReducedBody, size: Array, method: str, rtol: float, own: bool = False
) -> dict[str, Any]:
    """One run of a SciPy solver: wall seconds per simulated second, values over the last cycle, counts."""
    simulation = started(engine, body, Settings())
    equations = FirstOrder(simulation)
    equations.increments[:] = 1e-7 * size
    y0 = equations.start(simulation.state)
    equations(0.0, y0)
    equations.jacobian(0.0, y0)  # compiled before the clock starts
    equations.evaluations = 0
    kept = PERIOD * (CYCLES - 1 + np.arange(1, PER_CYCLE + 1) / PER_CYCLE)
    wall, process = time.perf_counter(), time.process_time()
    solution = solve_ivp(
        equations, (0.0, kept[-1]), y0, method=method, t_eval=kept, rtol=rtol, atol=rtol * size,
        jac=None if own else equations.jacobian,
    )  # fmt: skip
    wall, process = time.perf_counter() - wall, time.process_time() - process
    if not solution.success:
        raise RuntimeError(f"{method} at rtol {rtol:g}: {solution.message}")
    return {
        "wall": wall / SIMULATED,
        "process": process / SIMULATED,
        "values": equations.quantities(solution.y),
        "evaluations": equations.evaluations,
        "jacobians": int(solution.njev),
        "factorisations": int(solution.nlu),
    }


def floored(size: Array) -> Array:
    """Amplitudes (2n + 2,) of which none is below ``FLOOR`` of the largest among positions, or among velocities."""
    n = size.size // 2 - 1
    result = size.copy()
    for block in (slice(0, n), slice(n, 2 * n)):
        result[block] = np.maximum(size[block], FLOOR * size[block].max())
    return result


def main() -> int:
    """Measure and print."""
    engine, body = engine_and_body()
    difference, amplitudes = agreement(engine, body)
    sizes = {"each": amplitudes, "floored": floored(amplitudes)}
    exact, doubt = reference(engine, body, "impedance")
    default = Settings()
    ladder = [(deg, tolerance) for tolerance in (resolved(default).newton_tolerance, TIGHT) for deg in STEPS_DEG]
    cases = [
        partial(run, engine, body, Settings(step=math.radians(deg), newton_tolerance=tolerance))
        for deg, tolerance in ladder
    ]
    rounds, theirs = [], []
    for method, scaling, tolerances in LADDER:
        # One round of ours before each of theirs: both see the machine in the same mood.
        rounds.append([case() for case in cases])
        for rtol in tolerances:
            print(f"against_scipy: {method}, rtol {rtol:g}, {scaling}", file=sys.stderr, flush=True)
            row = scipy_run(engine, body, sizes[scaling], method, rtol)
            found = errors(row.pop("values"), COMMUNICATION_DEG, exact)
            theirs.append({"method": method, "scaling": scaling, "rtol": rtol, "error": float(found.max()), **row})
    own = scipy_run(engine, body, sizes["each"], "LSODA", 1e-3, own=True)
    ours = []
    for (deg, tolerance), runs in zip(ladder, zip(*rounds, strict=True), strict=True):
        row = {"step_deg": deg, "newton_tolerance": tolerance}
        row["error"] = float(errors(runs[0].values, runs[0].interval_deg, exact).max())
        ours.append({**row, "wall": median(r.wall for r in runs), "process": median(r.process for r in runs)})
    print(
        json.dumps(
            {
                "simulated_s": SIMULATED,
                "unknowns": amplitudes.size,
                "accelerations_differ_by": difference,
                "reference_doubt": doubt.tolist(),
                "reference_against_the_closest_scipy_run": min(row["error"] for row in theirs),
                "integrator": resolved(default).integrator,
                "at_error": {f"{target:g}": compared(target, ours, theirs) for target in TARGETS},
                "ours": ours,
                "scipy": theirs,
                "scipy_with_its_own_differences": {
                    "method": "LSODA", "rtol": 1e-3, **{k: own[k] for k in ("process", "evaluations")}
                },
            }
        )
    )  # fmt: skip
    return 0


def compared(target: float, ours: list[dict[str, Any]], theirs: list[dict[str, Any]]) -> dict[str, Any]:
    """Cost of both sides at one error, seconds per simulated second, and the ratio by either clock."""
    result: dict[str, Any] = {}
    for clock in ("process", "wall"):
        own = cost_at(target, [row["error"] for row in ours], [row[clock] for row in ours])
        costs: dict[str, float | None] = {}
        for method, scaling, _ in LADDER:
            rows = [row for row in theirs if (row["method"], row["scaling"]) == (method, scaling)]
            costs[f"{method}, {scaling}"] = cost_at(target, [r["error"] for r in rows], [r[clock] for r in rows])
        reached = {name: cost for name, cost in costs.items() if cost is not None}
        best = min(reached, key=reached.__getitem__) if reached else None
        ratio = reached[best] / own if best is not None and own is not None else None
        result[clock] = {"ours": own, "scipy": costs, "scipy_best": best, "ratio": ratio}
    return result


if __name__ == "__main__":
    sys.exit(main())
