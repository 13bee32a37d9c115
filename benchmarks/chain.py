"""The whole chain from engine file to FMU with nothing cached, timed stage by stage: ``python benchmarks/chain.py``.

Runs ``build_fmu.py diesel_i6`` in a process of its own with an empty cache folder and dates the lines by which it tells
its stages, with all levels and with the usual ones. Prints one JSON object: wall seconds per stage and in all; then the
same with all in the cache, and the seconds that the new FMU takes from instantiation to the end of its first step, the
first time and the second.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from fmu_overhead import seconds_to_first_step

ROOT = Path(__file__).resolve().parents[1]


def build(folder: str, levels: str) -> tuple[Path, dict[str, float], float]:
    """Path of the FMU, wall seconds of each stage by its announcement, and of the whole."""
    command = [sys.executable, "-u", str(ROOT / "build_fmu.py"), "diesel_i6", "-o", folder, "--levels", levels]
    begin = last = time.perf_counter()
    stage, seconds = "start and engine file", {}
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        line = ""
        assert process.stdout is not None
        for line in process.stdout:
            now = time.perf_counter()
            seconds[stage] = seconds.get(stage, 0.0) + now - last
            last, stage = now, re.sub(r": \d+ %$", "", line.strip().removeprefix("diesel_i6: "))
    if process.returncode:
        raise RuntimeError(f"build_fmu.py ended with {process.returncode}: {line.strip()}")
    whole = time.perf_counter() - begin
    named: dict[str, float] = {}
    for stage, spent in seconds.items():
        name = "archive" if "Cranktrain" in stage else stage
        named[name] = named.get(name, 0.0) + spent
    return Path(line.strip()), named, whole


def main() -> int:
    """Build twice, start twice, print."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["CRANKTRAIN_CACHE"] = str(Path(folder) / "usual")
        _, _, usual = build(folder, "usual")
        os.environ["CRANKTRAIN_CACHE"] = str(Path(folder) / "cache")
        path, stages, whole = build(folder, "all")
        _, _, again = build(folder, "all")
        first, second = (seconds_to_first_step(path.resolve()) for _ in range(2))
    result = {
        "whole_s": whole,
        "usual_levels_s": usual,
        "stages_s": {name: round(s, 3) for name, s in stages.items()},
        "with_crankshaft_in_the_cache_s": again,
        "first_start_s": first,
        "second_start_s": second,
    }
    print(json.dumps(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
