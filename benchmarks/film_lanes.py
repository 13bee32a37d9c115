"""What elastic films cost side by side and one by one, beside impedance films: ``python -m benchmarks.film_lanes``.

The six in its flexible block at 2000 rev/min from the static equilibrium, its third cycle: processor seconds per
simulated second, and of all mains in the cycle: steps, solutions, Newton iterations, and those of whole groups. Prints
one JSON object; ratios hold where the machine's speed drifts.
"""

from __future__ import annotations

import json
import math
import time
from typing import Any

import numpy as np

from cranktrain.core.kernel import RECORDS, keep_record
from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.file import load_engine
from cranktrain.film.elastic.workspace import lane_work
from cranktrain.film.laws.film_solution import EVALUATIONS, GROUP_PASSES, GROUPS, PASSES
from cranktrain.structure.assembly import assemble

SPEED = 2000.0 * math.pi / 30.0
CYCLES = 3


def cost(bearings: str, alone: bool = False) -> dict[str, Any]:
    """Figures of the last cycle of a run."""
    made = assemble(load_engine("diesel_i6"), Settings(bearings=bearings, block="flexible"))
    run = Simulation(made.engine, made.body, made.settings, None, made.parts)
    run.inputs[0] = SPEED
    run.initialize()
    record = None if made.parts.bore is None else RECORDS[int(run.model.films.entry[0, 1])]
    if alone:
        record = record._replace(lanes=lane_work(record.film, 0, singles=True))
        run.model.films.entry[:, 1] = keep_record(record, run.model.laws.entry)
    length = 4.0 * math.pi / SPEED
    step = communication_step(SPEED, made.settings.step)
    count = round(length / step)
    rows, done = np.zeros((count, run.outputs.size)), 0
    for _ in range(CYCLES):
        steps = run.work.counters[at.N_STEPS]
        calls = None if record is None else record.memory.calls.sum(axis=0)
        begin = time.process_time()
        done += run.series(step, done + 1, rows)
        used = (time.process_time() - begin) / length
    found: dict[str, Any] = {"s_per_s": round(used, 3), "steps": int(run.work.counters[at.N_STEPS] - steps)}
    if record is not None:
        calls = record.memory.calls.sum(axis=0) - calls
        columns = {"solutions": EVALUATIONS, "passes": PASSES, "groups": GROUPS, "group_passes": GROUP_PASSES}
        found |= {name: int(calls[column]) for name, column in columns.items()}
    return found


def main() -> None:
    """Print the figures."""
    cases = {
        "impedance": cost("impedance"),
        "ehd": cost("ehd"),
        "ehd, films one by one": cost("ehd", alone=True),
        "ehd:fine": cost("ehd:fine"),
        "ehd:fine, films one by one": cost("ehd:fine", alone=True),
    }
    print(json.dumps(cases, indent=1))


if __name__ == "__main__":
    main()
