"""What the Python FMU costs beside the native step, how it starts: ``python benchmarks/fmu_overhead.py [FILE.fmu]``.

Without a file the default engine's FMU is built. It runs on ground, as it starts, and with flexible block, guided
pistons and damper. The same engine, bodies, inputs and steps, alternately native and through FMPy's low-level calls
(set all inputs, doStep, get all outputs, with argument arrays made once as a co-simulation master does). Native means
the FMU's own copy of the code, called without FMI: the kernels of a second copy of the package in one process run
slower, whichever comes second, and that is not what is asked here. Prints one JSON object: medians over the blocks,
microseconds of processor time per step (a shared machine's wall clock counts the others' work), and wall seconds from
instantiation to the end of the first step in a new process, whose compiled kernels are in the cache.
"""

from __future__ import annotations

import ctypes
import importlib
import json
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path
from statistics import median

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

ROOT = Path(__file__).resolve().parents[1]
BLOCKS, STEPS = 20, 50
STEP = 8.0e-5  # s; about one degree at the default speed, so that one communication step is one internal step

STEPPED = {"solver.dense_output": ("dense_output", "off")}
WHOLE = STEPPED | {"block.level": ("block", "flexible"), "damper.level": ("damper", "fitted")}
"""Parameters of the whole engine, with the settings that they stand for."""

FIRST_STEP = """
import sys, time
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
description, folder = read_model_description(sys.argv[1]), extract(sys.argv[1])
fmu = FMU2Slave(guid=description.guid, unzipDirectory=folder, instanceName="cold",
                modelIdentifier=description.coSimulation.modelIdentifier)
begin = time.perf_counter()
fmu.instantiate()
fmu.setupExperiment(startTime=0.0)
fmu.enterInitializationMode()
fmu.exitInitializationMode()
fmu.doStep(0.0, 1e-4)
print(time.perf_counter() - begin)
"""


def seconds_to_first_step(path: Path) -> float:
    """From instantiation to the end of the first step, in a process of its own."""
    done = subprocess.run([sys.executable, "-c", FIRST_STEP, str(path)], capture_output=True, text=True, check=True)
    return float(done.stdout)


def measure(path: Path, levels: dict[str, tuple[str, str]]) -> dict[str, object]:
    """Alternating blocks of native and FMU steps at levels other than the start's; medians of time per step."""
    with zipfile.ZipFile(path) as archive:
        package = json.loads(archive.read("resources/variables.json"))["package"]
        data = archive.read("resources/model.bin")
    description = read_model_description(str(path))
    inputs = [v for v in description.modelVariables if v.causality == "input"]
    outputs = [v for v in description.modelVariables if v.causality == "output" and v.type == "Real"]
    starts = [float(v.start) for v in inputs]
    fmu = FMU2Slave(
        guid=description.guid,
        unzipDirectory=extract(str(path)),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="benchmark",
    )
    fmu.instantiate()
    references = {v.name: v.valueReference for v in description.modelVariables}
    for name, (_, level) in levels.items():
        fmu.setString([references[name]], [level])
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    running = importlib.import_module(f"{package}.fmu.running")
    model = importlib.import_module(f"{package}.fmu.flat").from_bytes(data, path.name)
    simulation = running.simulation(model, dict(levels.values()), {})
    simulation.inputs[:] = starts
    simulation.initialize(0.0)
    reals = [simulation.output_names.index(v.name) for v in outputs]
    simulation.read(reals)  # what is read is observed from now on, as in the FMU
    set_references = (ctypes.c_uint * len(inputs))(*(v.valueReference for v in inputs))
    set_values = (ctypes.c_double * len(inputs))(*starts)
    get_references = (ctypes.c_uint * len(outputs))(*(v.valueReference for v in outputs))
    get_values = (ctypes.c_double * len(outputs))()
    component = fmu.component
    native, wrapped = [], []
    for block in range(BLOCKS):
        first = block * STEPS
        begin = time.process_time()
        for i in range(first, first + STEPS):
            simulation.inputs[:] = starts
            simulation.step(i * STEP + STEP)
        middle = time.process_time()
        for i in range(first, first + STEPS):
            fmu.fmi2SetReal(component, set_references, len(inputs), set_values)
            fmu.fmi2DoStep(component, i * STEP, STEP, 1)
            fmu.fmi2GetReal(component, get_references, len(outputs), get_values)
        end = time.process_time()
        native.append(1e6 * (middle - begin) / STEPS)
        wrapped.append(1e6 * (end - middle) / STEPS)
    return {
        "native_us": median(native),
        "fmu_us": median(wrapped),
        "difference_us": median(b - a for a, b in zip(native, wrapped, strict=True)),
        "ratio": median(b / a for a, b in zip(native, wrapped, strict=True)),
        "equal_to_the_bit": list(get_values) == simulation.outputs[reals].tolist(),
        "inputs": len(inputs),
        "outputs": len(outputs),
    }


def main() -> int:
    """Measure the FMU given on the command line, or the default engine's."""
    with tempfile.TemporaryDirectory() as folder:
        path = sys.argv[1] if len(sys.argv) > 1 else ""
        if not path:
            build = [sys.executable, str(ROOT / "build_fmu.py"), "diesel_i6", "--python", "-o", folder]
            path = subprocess.run(build, stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()[-1]
        if not Path(path).is_file():
            print(f"fmu_overhead: no file '{path}'; python build_fmu.py diesel_i6 --python makes one", file=sys.stderr)
            return 2
        fmu = Path(path).resolve()
        figures: dict[str, object] = {"ground": measure(fmu, STEPPED), "whole": measure(fmu, WHOLE)}
        seconds_to_first_step(fmu)
        figures["warm_start_to_first_step_s"] = median(seconds_to_first_step(fmu) for _ in range(5))
        print(json.dumps(figures))
    return 0


if __name__ == "__main__":
    sys.exit(main())
