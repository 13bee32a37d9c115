"""What the valve train's FMU costs beside the combustion's: ``python benchmarks/valve_train.py``.

Both FMUs of the six run through FMPy's low-level calls as a co-simulation master has them: set angle and speed, doStep,
get what a partner takes (lifts and torque; pressures), at 1 degree and 2000 rev/min, in alternating blocks. Prints one
JSON object: medians of processor time per step, microseconds, as shares of real time, their ratio, and the kernel's own
share without FMI.
"""

from __future__ import annotations

import ctypes
import json
import math
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

import cranktrain as ct
from cranktrain.modules.register import module_files
from cranktrain.modules.valve_train.file import load
from cranktrain.modules.valve_train.simulation import ValveTrainSimulation

SPEED = 2000.0 * math.pi / 30.0
STEP = math.radians(1.0) / SPEED
BLOCKS, STEPS = 24, 360
TAKEN = {"valvetrain_i6": ("_lift", "valvetrain.torque"), "combustion_i6": ("].pressure", "pressure.angle")}


class Unit:
    """One FMU with argument arrays made once."""

    def __init__(self, path: Path, ends: tuple[str, ...]) -> None:
        description = read_model_description(str(path))
        self.fmu = FMU2Slave(
            guid=description.guid, unzipDirectory=extract(str(path)), instanceName=path.stem,
            modelIdentifier=description.coSimulation.modelIdentifier,
        )  # fmt: skip
        self.fmu.instantiate()
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        listed = {v.name: v for v in description.modelVariables}
        shown = [v.valueReference for n, v in listed.items() if v.causality == "output" and n.endswith(ends)]
        given = [listed["crank.speed"].valueReference, listed["crank.angle"].valueReference]
        self._given, self._shown = (ctypes.c_uint * 2)(*given), (ctypes.c_uint * len(shown))(*shown)
        self._in, self._out, self._time = (ctypes.c_double * 2)(), (ctypes.c_double * len(shown))(), 0.0

    def block(self) -> float:
        """Processor seconds of each of so many steps."""
        begin = time.process_time()
        for _ in range(STEPS):
            self._in[0], self._in[1] = SPEED, SPEED * self._time
            self.fmu.fmi2SetReal(self.fmu.component, self._given, 2, self._in)
            self.fmu.fmi2DoStep(self.fmu.component, self._time, STEP, 0)
            self.fmu.fmi2GetReal(self.fmu.component, self._shown, len(self._out), self._out)
            self._time += STEP
        return (time.process_time() - begin) / STEPS


def native() -> float:
    """Processor seconds of a step of the simulation that the FMU holds, called from Python."""
    simulation, found = ValveTrainSimulation(load(module_files()["valvetrain_i6"])), []
    simulation.inputs[0] = SPEED
    simulation.initialize()
    for block in range(BLOCKS):
        begin = time.process_time()
        for k in range(STEPS):
            simulation.step((block * STEPS + k + 1) * STEP)
        found.append((time.process_time() - begin) / STEPS)
    return median(found)


def main() -> int:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        units = {name: Unit(ct.build_fmu(name, folder), ends) for name, ends in TAKEN.items()}
        blocks = [{name: unit.block() for name, unit in units.items()} for _ in range(BLOCKS)]
        cost = {name: median(block[name] for block in blocks) for name in units}
    found = {name: {"us": 1e6 * value, "share_of_real_time": value / STEP} for name, value in cost.items()}
    ratio = cost["valvetrain_i6"] / cost["combustion_i6"]
    print(json.dumps({**found, "ratio": ratio, "native_share_of_real_time": native() / STEP}, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
