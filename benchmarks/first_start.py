"""How soon the first step is done on a machine that has run nothing yet: ``python benchmarks/first_start.py [FMU]``.

Of a Python FMU (the six's without block and film tables, where no file is given) from instantiation, and of
``cranktrain simulate diesel_i6`` from the start of the process, with a rigid crank and a torsional one, whose first
start reduces the crankshaft: each with an empty cache, then again with what is kept by then. ``--compiling`` adds the
first start without machine code, which takes minutes. Prints one JSON object, wall seconds.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from fmu_overhead import seconds_to_first_step

from cranktrain.core.machine_code import OFF
from cranktrain.fmu.build import build_fmu

CRANKS = "rigid", "torsional"
SIMULATE = """
import os, sys, time
from cranktrain.cli.main import main
from cranktrain.dynamics.simulation import Simulation
series = Simulation.series
def stepped(self, *arguments):
    done = series(self, *arguments)
    print(time.time() - float(sys.argv[1]))
    sys.stdout.flush()
    os._exit(0)
Simulation.series = stepped
main(sys.argv[2:])
"""


def first_step_of_a_simulation(crank: str, folder: Path) -> float:
    """From the start of the process to the end of the first communication steps, four at most."""
    words = f"simulate diesel_i6 --speed 2000 --crank {crank} --output {folder / 'run.h5'}".split()
    words += ["--no-inherit"] if crank == "torsional" else []
    command = [sys.executable, "-c", SIMULATE, str(time.time()), *words]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return float(done.stdout.split()[-1])


def main(arguments: list[str]) -> int:
    """Start each twice, print."""
    files = [Path(word) for word in arguments if not word.startswith("--")]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = files[0] if files else build_fmu("diesel_i6", folder, block=False, film_table=False, platforms=())
        figures: dict[str, list[float]] = {}
        os.environ["CRANKTRAIN_CACHE"] = str(folder / "cache")
        figures["fmu"] = [seconds_to_first_step(path.resolve()) for _ in range(2)]
        for crank in CRANKS:
            figures[f"simulate_{crank}"] = [first_step_of_a_simulation(crank, folder) for _ in range(2)]
        if "--compiling" in arguments:
            os.environ |= {OFF: "1", "CRANKTRAIN_CACHE": str(folder / "compiled")}
            figures["fmu_compiling"] = [seconds_to_first_step(path.resolve()) for _ in range(2)]
    print(json.dumps({f"{key}_first_and_second_s": values for key, values in figures.items()}))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
