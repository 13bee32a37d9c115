"""The library's code for faster processors beside that for all: ``python -m benchmarks.code_variants [BEARINGS ...]``.

The six at 2000 rev/min, steps of 2.5 degrees; both runs take turns, step by step. Prints the ratio of their times,
median over the steps of a cycle, and whether the outputs are equal to the bit, as one JSON object.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from benchmarks._engine_run import SPEED, engine_and_body

from cranktrain.core import machine_code, run_entries
from cranktrain.core.machine_code import LIBRARIES, Library, library_name, this_platform
from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation

STEP = math.radians(2.5)
CYCLES = 3


@contextmanager
def code(portable: bool) -> Iterator[None]:
    """Let what is made meanwhile run one of the two codes."""
    suffix = ".dll" if this_platform() == "win64" else ".so"
    taken = Library(LIBRARIES / this_platform() / library_name("cranktrain", suffix), portable)
    usual = machine_code.library
    try:
        machine_code.library = run_entries.library = lambda kind: taken  # type: ignore[assignment]
        yield
    finally:
        machine_code.library = run_entries.library = usual


def main(levels: list[str]) -> int:
    """Run, print."""
    engine, body = engine_and_body()
    h = communication_step(SPEED, STEP)
    count = round(4.0 * math.pi / SPEED / h)
    figures = {}
    for level in levels or ["linear", "impedance"]:
        runs = []
        for portable in (True, False):
            with code(portable):
                runs.append(Simulation(engine, body, Settings(bearings=level)))
                runs[-1].inputs[0] = SPEED
                runs[-1].initialize()
        times, equal = np.empty((CYCLES * count, 2)), True
        for k in range(CYCLES * count):
            for place, run in enumerate(runs):
                begin = time.perf_counter()
                run.step((k + 1) * h)
                times[k, place] = time.perf_counter() - begin
            equal &= bool(np.array_equal(*(run.outputs for run in runs)))
        portable, fast = np.median(times[count:], axis=0)
        figures[level] = {
            "fast_over_portable": float(np.median(times[count:, 1] / times[count:, 0])),
            "us": [1e6 * float(portable), 1e6 * float(fast)],
            "of_real_time": [float(portable / h), float(fast / h)],
            "equal_to_the_bit": equal,
        }
    print(json.dumps(figures, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
