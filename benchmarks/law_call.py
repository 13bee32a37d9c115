"""Price of calling a force law at its address: ``python -m benchmarks.law_call [--calls N]``.

The same law, three springs, called at its address as the equations of motion do, and compiled into its caller; then the
default run of the six at 2000 rev/min: calls of laws in a cycle, and which share of its processor time their price is.
That share is the most that one call for all connections of a law could save. Medians; prints one JSON object.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
import time
from typing import Any

import numpy as np
from benchmarks._engine_run import SPEED

import cranktrain as ct
from cranktrain.core.kernel import inlined_kernel, keep_record, kernel, kernel_address
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.simulation import Simulation
from cranktrain.dynamics.topology.spring import SpringRecord, spring_law
from cranktrain.film.laws.films import FORCE, Films, film_call, no_films

TIMES, CYCLES = 15, 5
_inlined = inlined_kernel(spring_law.py_func)


@kernel
def at_address(films, count):
    """So many calls at the address, each with the force of the one before; the sum of the statuses."""
    status = 0
    for k in range(count):
        films.place[0, 0] = k
        status += film_call(films, FORCE, 0, films.out, films.out)
        films.place[0, 1] = films.out[0]
    return status


@kernel
def in_caller(films, count):
    """The same with the law in its caller."""
    status = 0
    for k in range(count):
        films.place[0, 0] = k
        row = films.entry[0]
        place, velocity = films.place[0], films.velocity[0]
        status += _inlined(row[1], FORCE, row[2], place, velocity, films.numbers, films.out, films.out)
        films.place[0, 1] = films.out[0]
    return status


def springs() -> Films:
    """One connection by three springs."""
    films, z = no_films(1), np.zeros
    arguments = 0, 0, 0, z(4), z(4), films.numbers, z(1), films.out
    record = keep_record(SpringRecord(np.full(3, 1e3), np.full(3, 1.0)), films.entry)
    films.entry[0] = kernel_address(spring_law, *arguments), record, 0
    return films


def nanoseconds(calling: Any, films: Films, count: int) -> float:
    """Processor time of a call."""
    calling(films, 10)
    taken = []
    for _ in range(TIMES):
        begin = time.process_time()
        calling(films, count)
        taken.append((time.process_time() - begin) / count)
    return 1e9 * statistics.median(taken)


def cycle() -> tuple[float, int]:
    """Processor time (s) of a cycle of the six, and calls of laws in it."""
    made = ct.assemble(ct.load_engine("diesel_i6"), ct.Settings())
    run = Simulation(made.engine, made.body, made.settings, None, made.parts)
    run.inputs[0] = SPEED
    run.initialize()
    steps = round(4.0 * math.pi / made.settings.step)
    rows, done = np.zeros((steps, run.outputs.size)), 0
    seconds, calls = [], []
    laws = int(np.count_nonzero(run.model.laws.entry[:, 0]))
    for _ in range(CYCLES):
        evaluations, begin = run.work.counters[at.N_ITERATIONS], time.process_time()
        done += run.series(4.0 * math.pi / SPEED / steps, done + 1, rows)
        seconds.append(time.process_time() - begin)
        calls.append(laws * int(run.work.counters[at.N_ITERATIONS] - evaluations))
    return statistics.median(seconds), int(statistics.median(calls))


def main() -> int:
    """Print prices and share."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calls", type=int, default=1_000_000, metavar="N", help="calls at a time (default 1e6)")
    count, films = parser.parse_args().calls, springs()
    address, inside = (nanoseconds(calling, films, count) for calling in (at_address, in_caller))
    seconds, calls = cycle()
    price = address - inside
    found = {
        "at_address_ns": round(address, 1), "in_caller_ns": round(inside, 1), "price_ns": round(price, 1),
        "calls_a_cycle": calls, "cycle_ms": round(1e3 * seconds, 2),
        "share_of_cycle": round(1e-9 * price * calls / seconds, 4),
    }  # fmt: skip
    print(json.dumps(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
