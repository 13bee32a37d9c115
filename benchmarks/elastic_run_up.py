"""Run-up with elastic films: processor time of each speed from its neighbours, over that of settling there from rest.

    python benchmarks/elastic_run_up.py                              # the six at 2000, 2020, 2040 and 2060 rev/min
    python benchmarks/elastic_run_up.py --speeds 1000 1020 1040

Two ways, each to 1e-4: settled from the static equilibrium, and from neighbours. Machine code is loaded before.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import time
from typing import Any

from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import Assembly, assemble
from cranktrain.studies.run_up.steady import CycleStart, Job, SteadyRuns

SETTLE = 1.0e-4
RPM = math.pi / 30.0


def measured(made: Assembly, speeds: list[float], neighbours: bool) -> list[dict[str, Any]]:
    """Processor seconds and cycles of each speed, rev/min, one after the other."""
    runs = SteadyRuns(Job(made, None, SETTLE, 24.0, ("pulley.torsion",)))
    starts: list[CycleStart] = []
    rows = []
    for rpm in speeds:
        begin = time.process_time()
        found = runs.at(rpm * RPM, starts[:2] if neighbours else ())
        starts.insert(0, found.start)
        seconds = time.process_time() - begin
        rows.append({"rpm": rpm, "seconds": seconds, "cycles": found.cycles, "repeats": found.repeats})
    return rows


def main() -> None:
    """Print one JSON object; medians leave out the first speed, which has no neighbour."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--engine", default="diesel_i6")
    parser.add_argument("--speeds", nargs="+", type=float, default=[2000.0, 2020.0, 2040.0, 2060.0], metavar="RPM")
    chosen = parser.parse_args()
    made = assemble(load_engine(chosen.engine), Settings(bearings="ehd"))
    ways = {"settled from rest": False, "from neighbours": True}
    said: dict[str, Any] = {name: measured(made, chosen.speeds, way) for name, way in ways.items()}
    medians = {name: statistics.median(row["seconds"] for row in rows[1:]) for name, rows in said.items()}
    rest = medians["settled from rest"]
    print(json.dumps({**said, "median": medians, "times_faster": {n: rest / s for n, s in medians.items()}}, indent=1))


if __name__ == "__main__":
    main()
