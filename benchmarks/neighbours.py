"""Whether Python FMUs slow each other down in one process: ``python benchmarks/neighbours.py``.

The six's FMU beside the V8's (other data, the same code), beside one built of changed sources, and beside the
combustion's: processor time of a step before its neighbour is there, and after, stepping in turn. Prints one JSON
object: by neighbour the ratio after to before, of the six and of the neighbour (each was the first once). Crank
``rigid``, bearings ``linear``: where a step costs least, what is added to it shows most.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import cranktrain as ct
from cranktrain.fmu import running_code

BEFORE_AND_AFTER = """
import statistics, sys, time
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

def started(path):
    description = read_model_description(path)
    fmu = FMU2Slave(guid=description.guid, unzipDirectory=extract(path), instanceName="unit",
                    modelIdentifier=description.coSimulation.modelIdentifier)
    fmu.instantiate()
    references = {v.name: v.valueReference for v in description.modelVariables}
    for name, value in (("crank.level", "rigid"), ("bearing.level", "linear")):
        if name in references:
            fmu.setString([references[name]], [value])
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    return fmu

def block(fmu, k):
    begin = time.process_time()
    for i in range(200 * k, 200 * (k + 1)):
        fmu.doStep(i * 1e-4, 1e-4)
    return time.process_time() - begin

first = started(sys.argv[1])
before = statistics.median(block(first, k) for k in range(40))
second = started(sys.argv[2])
after = []
for k in range(40):
    after.append(block(first, 40 + k))
    block(second, k)
print(statistics.median(after) / before)
"""


def ratio(first: Path, second: Path) -> float:
    """Time of a step of ``first`` with ``second`` beside it over that without."""
    words = [sys.executable, "-c", BEFORE_AND_AFTER, str(first), str(second)]
    return float(subprocess.run(words, capture_output=True, text=True, check=True).stdout)


def changed_sources(folder: Path) -> Path:
    """A copy of the sources with one comment more."""
    sources = folder / "fmu_src"
    shutil.copytree(running_code.SOURCES, sources, ignore=shutil.ignore_patterns("__pycache__"))
    errors = sources / "cranktrain" / "core" / "errors.py"
    errors.write_text(errors.read_text("utf-8") + "\n# another build\n", "utf-8")
    return sources


def main() -> int:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plain = {"film_table": False, "block": False, "platforms": ()}
        six = ct.build_fmu("diesel_i6", folder / "six", **plain)
        beside = {
            "V8": ct.build_fmu("diesel_v8", folder / "v8", **plain),
            "combustion": ct.build_fmu("combustion_i6", folder / "combustion", platforms=()),
        }
        running_code.SOURCES = changed_sources(folder)
        beside["other build"] = ct.build_fmu("diesel_i6", folder / "other", **plain)
        figures = {}
        for label, other in beside.items():
            print(f"neighbours: {label}", file=sys.stderr, flush=True)
            ratio(six, other)  # kernels compile
            figures[label] = {"six": ratio(six, other), "neighbour": ratio(other, six)}
    print(json.dumps(figures, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
