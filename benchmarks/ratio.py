"""Speed of these sources against those of another checkout or commit, in one run on one machine.

    python -m benchmarks.ratio 5a47ea3             # the six, default settings
    python -m benchmarks.ratio ../other --bearings table --laps 41

One process a checkout; they take turns, a cycle of 720 degrees at 2000 rev/min each time, and only the one whose turn
it is runs. Prints one JSON object: the medians of the processor time of a cycle, and the median of other over own:
above 1 these sources are faster. Without another it runs its own sources twice, which tells what the noise is.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import statistics
import subprocess
import sys
import tarfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

OWN = Path(__file__).resolve().parents[1]
CHILD = """
import math, sys, time
import numpy as np
import cranktrain
from cranktrain.structure.assembly import assemble
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.file import load_engine

assert cranktrain.__file__.startswith(sys.argv[2]), cranktrain.__file__
made = assemble(load_engine("diesel_i6"), Settings(bearings=sys.argv[1]))
run = Simulation(made.engine, made.body, made.settings, None, made.parts)
speed = run.inputs[0] = 2000.0 * math.pi / 30.0
run.initialize()
samples = math.ceil(4.0 * math.pi / made.settings.step - 1e-9)
step = 4.0 * math.pi / speed / samples
rows = np.zeros((samples, run.outputs.size))
done = run.series(step, 1, rows)
print("ready", flush=True)
for _ in sys.stdin:
    start = time.process_time()
    done += run.series(step, done + 1, rows)
    print(time.process_time() - start, flush=True)
"""


def started(root: Path, bearings: str) -> subprocess.Popen[str]:
    """Process that runs a cycle of the sources of ``root`` for each line it is given."""
    sources = str(root.resolve() / "fmu_src")
    environment = {**os.environ, "PYTHONPATH": sources, "OMP_NUM_THREADS": "1"}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    return subprocess.Popen([sys.executable, "-c", CHILD, bearings, sources], env=environment, **pipes)


@contextmanager
def checkout(other: str) -> Iterator[Path]:
    """Folder of a checkout: the one of this name, else a new one with the sources of a commit."""
    if (Path(other) / "fmu_src" / "cranktrain").is_dir():
        yield Path(other)
        return
    command = ["git", "archive", "--format=tar", other, "fmu_src"]
    done = subprocess.run(command, cwd=OWN, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=False)
    if done.returncode:
        raise SystemExit(f"ratio: {other}: neither a folder with fmu_src/cranktrain nor a commit that has it; name one")
    with TemporaryDirectory(prefix="cranktrain-ratio-") as folder:
        with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
            archive.extractall(folder, filter="data")
        yield Path(folder)


def main() -> int:
    """Print medians and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", nargs="?", default=str(OWN), help="folder or commit (default: these sources)")
    parser.add_argument("--bearings", default="auto", metavar="LEVEL", help="fidelity level of the main bearings")
    parser.add_argument("--laps", type=int, default=61, metavar="N", help="cycles of each (default 61)")
    chosen = parser.parse_args()
    with checkout(chosen.other) as folder:
        laps = timed((folder, OWN), chosen.bearings, chosen.laps)
    other, own = (1e3 * statistics.median(each) for each in laps)
    ratio = statistics.median(a / b for a, b in zip(*laps, strict=True))
    print(json.dumps({"other_ms_a_cycle": round(other, 2), "own_ms_a_cycle": round(own, 2), "ratio": round(ratio, 3)}))
    return 0


def timed(roots: tuple[Path, Path], bearings: str, count: int) -> list[list[float]]:
    """Processor time (s) of cycles of each checkout."""
    processes = [started(root, bearings) for root in roots]
    for process in processes:
        if process.stdout.readline().strip() != "ready":
            raise SystemExit(1)  # it has said why
    laps: list[list[float]] = [[], []]
    for _ in range(count):
        for process, seconds in zip(processes, laps, strict=True):
            process.stdin.write("\n")
            process.stdin.flush()
            seconds.append(float(process.stdout.readline()))
    return laps


if __name__ == "__main__":
    raise SystemExit(main())
