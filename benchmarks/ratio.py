"""Speed of these sources against those of another checkout, in one run on one machine.

    python -m benchmarks.ratio ../other            # the six, default settings
    python -m benchmarks.ratio ../other --bearings table --laps 41

One process a checkout; they take turns, a cycle of 720 degrees at 2000 rev/min each time, and only the one whose turn
it is runs. Printed are the medians of the processor time of a cycle, and the median of other over own: above 1 these
sources are faster. Given its own folder it tells what the noise is.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
from pathlib import Path

OWN = Path(__file__).resolve().parents[1]
CHILD = """
import math, sys, time
import numpy as np
from cranktrain.assembly import assemble
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.file import load_engine

made = assemble(load_engine("diesel_i6"), Settings(bearings=sys.argv[1]))
run = Simulation(made.engine, made.body, made.settings, None, made.parts)
speed = run.inputs[0] = 2000.0 * math.pi / 30.0
run.initialize()
step = communication_step(speed, made.settings.step)
rows = np.zeros((round(4.0 * math.pi / speed / step), run.outputs.size))
done = run.series(step, 1, rows)
print("ready", flush=True)
for _ in sys.stdin:
    start = time.process_time()
    done += run.series(step, done + 1, rows)
    print(time.process_time() - start, flush=True)
"""


def started(root: Path, bearings: str) -> subprocess.Popen[str]:
    """Process that runs a cycle of the sources of ``root`` for each line it is given."""
    environment = {**os.environ, "PYTHONPATH": str(root.resolve() / "fmu_src"), "OMP_NUM_THREADS": "1"}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    return subprocess.Popen([sys.executable, "-c", CHILD, bearings], env=environment, **pipes)


def main() -> int:
    """Print medians and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path, help="folder of the other checkout")
    parser.add_argument("--bearings", default="auto", metavar="LEVEL", help="fidelity level of the main bearings")
    parser.add_argument("--laps", type=int, default=61, metavar="N", help="cycles of each (default 61)")
    chosen = parser.parse_args()
    processes = [started(root, chosen.bearings) for root in (chosen.other, OWN)]
    for process in processes:
        if process.stdout.readline().strip() != "ready":
            return 1  # it has said why
    laps: list[list[float]] = [[], []]
    for _ in range(chosen.laps):
        for process, seconds in zip(processes, laps, strict=True):
            process.stdin.write("\n")
            process.stdin.flush()
            seconds.append(float(process.stdout.readline()))
    other, own = laps
    print(f"other {1e3 * statistics.median(other):.2f} ms a cycle, own {1e3 * statistics.median(own):.2f} ms")
    print(f"other over own {statistics.median(a / b for a, b in zip(other, own, strict=True)):.3f}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
