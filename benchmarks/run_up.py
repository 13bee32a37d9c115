"""Run-ups of 81 speeds, converged to 1e-4: wall and processor time, cycles by speed, parallel efficiency.

    python benchmarks/run_up.py                                 # the six, 1000 to 2600 rev/min, impedance films
    python benchmarks/run_up.py --bearings table --from 600 --to 2200
    python benchmarks/run_up.py --workers 1 2                   # efficiency: wall time of one over that of both

Bodies and tables are made before the clock starts, and each run loads its machine code. On a machine that does other
work as well processor time tells what an idle one would take: it is divided by the workers.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import statistics
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import assemble
from cranktrain.studies.run_up.plan import run_up_speeds
from cranktrain.studies.run_up.run_up import Means, run_up
from cranktrain.studies.run_up.steady import Job

SPEEDS = 81


def spent() -> float:
    """Processor seconds of this process and of its children that have ended."""
    kinds = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    return sum(use.ru_utime + use.ru_stime for use in map(resource.getrusage, kinds))


def measured(job: Job, speeds: list[float], workers: int, repeats: int) -> dict[str, Any]:
    """Figures of a run-up with so many workers, medians of some repeats."""
    walls, processors = [], []
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as folder:
            before = spent()
            outcome = run_up(job, speeds, Path(folder) / "run-up.h5", Means(workers=workers), {})
            walls.append(outcome.seconds)
            processors.append(spent() - before)
    found = outcome.run_up
    assert found is not None
    periodic = found.repeats == 1
    return {
        "workers": workers,
        "seconds": statistics.median(walls),
        "processor_seconds": statistics.median(processors),
        "processor_seconds_by_worker": statistics.median(processors) / workers,
        "cycles": float(found.cycles.mean()),
        "periodic_speeds": int(periodic.sum()),
        "cycles_where_periodic": float(found.cycles[periodic].mean()),
        "no_period_at_rpm": np.round(found.speeds_rpm[~periodic]).tolist(),
    }


def main() -> None:
    """Print one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--engine", default="diesel_i6")
    parser.add_argument("--bearings", default="auto")
    parser.add_argument("--from", dest="first", type=float, default=1000.0, metavar="RPM")
    parser.add_argument("--to", dest="last", type=float, default=2600.0, metavar="RPM")
    parser.add_argument("--workers", nargs="+", type=int, default=[2])
    parser.add_argument("--repeats", type=int, default=3)
    chosen = parser.parse_args()
    made = assemble(load_engine(chosen.engine), Settings(bearings=chosen.bearings))
    job = Job(made, None, 1e-4, 24.0, ("pulley.torsion", "pulley.axial"))
    speeds = run_up_speeds(chosen.first, chosen.last, (chosen.last - chosen.first) / (SPEEDS - 1))
    rows = [measured(job, speeds, workers, chosen.repeats) for workers in chosen.workers]
    said: dict[str, Any] = {"engine": chosen.engine, "bearings": made.settings.bearings, "rows": rows}
    if len(rows) > 1:
        one, other = rows[0], rows[-1]
        said["efficiency"] = one["seconds"] * one["workers"] / (other["seconds"] * other["workers"])
    print(json.dumps(said | {"step_deg": math.degrees(made.settings.step)}, indent=1))


if __name__ == "__main__":
    main()
