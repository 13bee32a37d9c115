"""What the time of a communication step goes with, and how long steps take: ``python -m benchmarks.step_work``.

The six at 2000 rev/min, steps of 2.5 degrees, some cycles behind the start. Of each bearing level: the correlation of a
step's time with its Newton iterations, solved stages and factorisations, which says what a limit of work should count;
the median, the 99.9 % and the largest of the time over the step's length; and the same with the work limited to the
iterations that 99 % of the steps keep to. Times are the least of a number of equal runs, so that what else the machine
does is left out. Prints one JSON object.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from dataclasses import replace
from typing import Any

import numpy as np
from benchmarks._engine_run import SPEED, engine_and_body

from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.arrays import Parts
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.model import Engine

STEP = math.radians(2.5)
CYCLES = 4
KINDS = ("iterations", "stages", "factorisations")


def steps(engine: Engine, body: ReducedBody, settings: Settings) -> tuple[Array, Array, float]:
    """Time of each step over its length (n,), its work of each kind (n, kinds), and the steps that were cut short."""
    simulation = Simulation(engine, body, settings, parts=Parts())
    simulation.inputs[0] = SPEED
    simulation.initialize()
    h = communication_step(SPEED, STEP)
    count = round(4.0 * math.pi / SPEED / h) * CYCLES
    times, work = np.empty(count), np.empty((count, len(KINDS)))
    counters = simulation.work.counters
    for k in range(count):
        before = counters[[at.N_STAGES, at.N_FACTORS]].copy()
        begin = time.perf_counter()
        simulation.step((k + 1) * h)
        times[k] = time.perf_counter() - begin
        work[k] = counters[at.N_WORK], *(counters[[at.N_STAGES, at.N_FACTORS]] - before)
    return times / h, work, float(counters[at.N_LIMITED])


def measured(engine: Engine, body: ReducedBody, settings: Settings, runs: int) -> dict[str, Any]:
    """Figures of one level."""
    found = [steps(engine, body, settings) for _ in range(runs)]
    share, work, cut = np.min([one[0] for one in found], axis=0), found[0][1], found[0][2]
    varying = work.std(axis=0) > 0.0
    return {
        "correlation": {
            kind: float(np.corrcoef(share, work[:, i])[0, 1]) if varying[i] else None for i, kind in enumerate(KINDS)
        },
        "iterations": {"median": float(np.median(work[:, 0])), "largest": float(work[:, 0].max())},
        "time_over_step": {
            "median": float(np.median(share)),
            "99.9 %": float(np.quantile(share, 0.999)),
            "largest": float(share.max()),
        },
        "cut_short": cut,
        "limit": float(np.quantile(work[:, 0], 0.99)),
    }


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.step_work", description=__doc__)
    parser.add_argument("--levels", nargs="+", default=["impedance", "reynolds"], metavar="LEVEL")
    parser.add_argument("--runs", type=int, default=5, metavar="N", help="equal runs of which the least time counts")
    chosen = parser.parse_args()
    engine, body = engine_and_body()
    found = {}
    for level in chosen.levels:
        settings = Settings(bearings=level, step=STEP)
        own = measured(engine, body, settings, chosen.runs)
        limited = measured(engine, body, replace(settings, work_limit=own["limit"]), chosen.runs)
        found[level] = {"free": own, "limited": limited}
    print(json.dumps(found, indent=2))
    return 0


if __name__ == "__main__":
    sys.exit(main())
