"""What a native FMU costs beside its kernels, how fast it starts, how even its steps are.

``python benchmarks/native_fmu.py [FILE.fmu …]``: a C host (``_native_host.c``) runs the FMU of the six at 2000 rev/min,
solid crank, impedance films, and the combustion's, or native ones that are there already. In one process and in turn:
the kernel of a step alone, and doStep between a set of 20 and a get of 40 values, each by itself; then a get of all
outputs; medians. In processes of their own: load, instantiate, initialize and first step; two instances in two threads
over one, which needs two idle cores; wall time of steps over their length. Without files the Python FMU of the same
engine is timed beside it. Prints one JSON object; nothing but ratios within it means much on a shared machine.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

from fmpy import extract, read_model_description

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.fmu_overhead import STEPPED, measure, seconds_to_first_step

from cranktrain.fmu.build import build_fmu
from cranktrain.fmu.native.link import SOURCES

DEGREE = math.radians(1.0) / (2000.0 * math.pi / 30.0)
"""s, a degree at 2000 rev/min: below the model's own step, so that one communication step is one internal step."""
STEPS, STARTS = 10_000, 7
TEXTS = {"angle.source": "speed", "solver.dense_output": "off"}
"""A module without a cranktrain turns by itself; every communication step is an internal step."""


def compiled(folder: Path) -> Path:
    """The host."""
    compiler = next(found for name in ("gcc", "clang", "cc") if (found := shutil.which(name)))
    host = folder / "host"
    source = Path(__file__).with_name("_native_host.c")
    flags = "-std=gnu11", "-O2", "-I", str(SOURCES)
    subprocess.run([compiler, *flags, str(source), "-o", str(host), "-ldl", "-lpthread", "-lm"], check=True)
    return host


class Timed:
    """A native FMU, unpacked, and the host that times it."""

    def __init__(self, host: Path, path: Path) -> None:
        about = read_model_description(str(path))
        folder = Path(extract(str(path)))
        binary = folder / "binaries" / "linux64" / f"{about.coSimulation.modelIdentifier}.so"
        spans = []
        for causality in ("input", "output"):
            references = [
                v.valueReference for v in about.modelVariables if v.causality == causality and v.type == "Real"
            ]
            spans += [min(references), max(references)]
        self._command = [str(host), str(binary), about.guid, (folder / "resources").as_uri(), *map(str, spans)]
        self.megabytes = 1e-6 * path.stat().st_size
        self.places = {v.name: v.valueReference for v in about.modelVariables}

    def __call__(
        self, mode: str, step: float = DEGREE, count: int = STEPS, settings: Sequence[str] | None = None
    ) -> dict[str, Any]:
        """What the host prints; ``settings`` as at the head of its source, default those of TEXTS."""
        if settings is None:
            settings = [f"text:{self.places[name]}={text}" for name, text in TEXTS.items() if name in self.places]
        run = [*self._command, mode, repr(step), str(count), *settings]
        found: dict[str, Any] = json.loads(subprocess.run(run, check=True, stdout=subprocess.PIPE).stdout)
        return found


def figures(timed: Timed) -> dict[str, Any]:
    """All that is measured of one FMU."""
    calls, threads = timed("calls"), timed("threads")
    cold = [timed("cold", count=1)["seconds"] for _ in range(STARTS)]
    return {
        "kernel_us": round(1e6 * calls["kernel"], 2),
        "step_over_kernel": round(calls["step"] / calls["kernel"], 4),
        "set_get_us": round(1e6 * calls["set_get"], 3),
        "get_all_us": round(1e6 * calls["get_all"], 3),
        "outputs": calls["outputs"],
        "megabytes": round(timed.megabytes, 2),
        "first_step_ms": round(1e3 * median(cold), 1),
        "two_threads_over_one": round(2.0 * threads["one"] / threads["two"], 2),
        "step_time_over_length": {
            f"{degrees} deg": timed("steps", degrees * DEGREE, round(2 * STEPS / degrees)) for degrees in (1.0, 2.5)
        },
    }


def main(*files: str) -> int:
    """Measure and print."""
    result: dict[str, Any] = {"processors": os.cpu_count()}
    with tempfile.TemporaryDirectory() as folder:
        host = compiled(Path(folder))
        if files:
            result |= {Path(file).stem: figures(Timed(host, Path(file))) for file in files}
            print(json.dumps(result, indent=1))
            return 0
        for name, parts in (("diesel_i6", {"film_table": False, "block": False}), ("combustion_i6", {})):
            print(f"native FMU: {name}", file=sys.stderr, flush=True)
            path = build_fmu(name, Path(folder, "native"), platforms=("linux64",), **parts)
            result[path.stem] = figures(Timed(host, path))
        python = build_fmu("diesel_i6", Path(folder, "python"), film_table=False, block=False, platforms=())
        result["python_fmu"] = {**measure(python, STEPPED), "first_step_s": round(seconds_to_first_step(python), 2)}
    print(json.dumps(result, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
