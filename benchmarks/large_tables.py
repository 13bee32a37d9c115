"""Text tables of 100 MB and of 1 GB through each reader that such a file can reach: time and largest memory.

    python -m benchmarks.large_tables [--megabytes 100 1000] [--folder DIR]

The table holds crank angle and pressure of a cylinder over as many cycles as fill it, with a decimal comma: the fired
trace of ``diesel_i6`` at 0.1 degree, of 16 strengths in turn. It is made in a temporary folder and removed. Each
command runs in a process of its own, whose largest resident memory the operating system tells. ``peak_bar`` is the
peak of the mean cycle that was found, ``true_peak_bar`` that of the trace.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.engine.file import load_engine
from cranktrain.loads.gas_pressure import GasTrace

STEP, CYCLES = 0.1, 16
TRACE = """
import json, resource, sys
from cranktrain.engine.file import load_engine
from cranktrain.loads.pressure_file import read_pressure
rows, source = read_pressure(sys.argv[1], None, None, 720, load_engine("diesel_i6"))
print(json.dumps({"peak_bar": 1e-5 * rows[0].max()}))
"""
SHOWN = """
import resource, sys
from cranktrain.cli.main import main
status = main(sys.argv[2:])
"""
MEMORY = "\nprint(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, file=sys.stderr)\n"
COMMANDS = {
    "pressure of a run": (TRACE, []),
    "measured, channels": (SHOWN, ["measured", "FILE", "--json"]),
    "measured, cycles": (
        SHOWN,
        ["measured", "FILE", "--pressure", "PCYL1", "--samples-per-cycle", "7200", "--speed", "1500", "--engine",
         "diesel_i6", "--json"],
    ),
}  # fmt: skip


def cycles() -> tuple[list[str], float]:
    """Texts of cycles of several strengths, and the peak of their mean, bar."""
    engine = load_engine("diesel_i6")
    gas = GasTrace.from_engine(engine)
    angle = np.arange(round(720.0 / STEP)) * STEP - 360.0
    pressure = 1e-5 * np.interp(np.radians(angle), gas.angles, gas.fired, period=4.0 * np.pi)
    strengths = 1.0 + 0.002 * (np.arange(CYCLES) * 7 % CYCLES - 0.5 * (CYCLES - 1))
    texts = [
        "".join(f"{a:.1f};{s * p:.6f}\n".replace(".", ",") for a, p in zip(angle, pressure, strict=True))
        for s in strengths
    ]
    return texts, float(pressure.max())


def make(path: Path, megabytes: int, texts: list[str]) -> int:
    """Write the table; returns its number of cycles."""
    count, size = 0, 0
    with path.open("w", encoding="cp1252", newline="\n") as file:
        file.write("Kurbelwinkel;PCYL1\n°KW;bar\n")
        while size < megabytes * 1_000_000:
            size += file.write(texts[count % CYCLES])
            count += 1
    return count


def main() -> None:
    """Make each table, run the commands on it, print time and memory as JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--megabytes", type=int, nargs="+", default=[100, 1000])
    parser.add_argument("--folder", default=None, help="folder of the temporary folder")
    asked = parser.parse_args()
    (texts, peak), figures = cycles(), list[dict[str, Any]]()
    with tempfile.TemporaryDirectory(dir=asked.folder) as folder:
        for megabytes in asked.megabytes:
            path = Path(folder) / "trace.csv"
            count = make(path, megabytes, texts)
            for name, (code, words) in COMMANDS.items():
                command = [sys.executable, "-c", code + MEMORY, str(path)]
                begin = time.perf_counter()
                done = subprocess.run(
                    command + [str(path) if word == "FILE" else word for word in words],
                    capture_output=True, text=True, check=False,
                )  # fmt: skip
                seconds = time.perf_counter() - begin
                if done.returncode:
                    print(done.stderr, file=sys.stderr)
                    sys.exit(1)
                told = json.loads(done.stdout)
                pressures = told.get("pressure", [told])
                figures.append(
                    {
                        "megabytes": megabytes, "cycles": count, "command": name, "seconds": round(seconds, 1),
                        "peak_memory_mb": round(float(done.stderr.split()[-1]) / 1024.0),
                        "peak_bar": pressures[0].get("peak_bar"),
                    }
                )  # fmt: skip
    print(json.dumps({"true_peak_bar": peak, "runs": figures}, indent=2))


if __name__ == "__main__":
    main()
