"""What the valve train's FMU costs beside the combustion's: ``python benchmarks/valve_train.py``.

Both FMUs of the six run through FMPy's low-level calls as a co-simulation master has them: set angle and speed, doStep,
get what a partner takes (lifts and torque; pressures), at 1 degree and 2000 rev/min, in alternating blocks. Then the
six on a torsional crank is coupled, with valve train and without (Gauss-Seidel, processor time over simulated time at 1
degree) and with it by scheme and communication step: RMS error of the pulley's torsion over the RMS of its alternating
part and error of the mean shaft torque, against ``FINE_DEG``. Prints one JSON object: medians of processor time per
step, microseconds, as shares of real time, their ratio, the kernel's own share without FMI, and the coupled runs.
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

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

import cranktrain as ct
from cranktrain.modules.register import module_files
from cranktrain.modules.valve_train.file import load
from cranktrain.modules.valve_train.simulation import ValveTrainSimulation
from cranktrain_lab.coupling.run import Coupled, Steps, run
from cranktrain_lab.coupling.virtual_engine import Partners, virtual_engine

SPEED = 2000.0 * math.pi / 30.0
STEP = math.radians(1.0) / SPEED
BLOCKS, STEPS = 24, 360
CYCLES, FINE_DEG, STEPS_DEG = 8, 0.125, (0.25, 0.5, 1.0, 2.0)
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


def coupled(partners: Partners, scheme: str, step_deg: float) -> tuple[Coupled, float]:
    """A run, and its processor time over simulated time."""
    engine = virtual_engine(partners, SPEED, scheme, "own")
    master = engine.master()
    try:
        master.initialize()
        begin = time.process_time()
        found = run(master, CYCLES * 4.0 * math.pi / SPEED, Steps(math.radians(step_deg) / SPEED), engine.bonds)
        return found, (time.process_time() - begin) / float(found.times[-1])
    finally:
        master.close()


def last_cycle(found: Coupled, name: str) -> np.ndarray:
    """An output at the points of the last cycle that all steps meet."""
    every = (len(found.times) - 1) // round(CYCLES * 720 / STEPS_DEG[-1])
    return found.of(name)[::every][-round(720 / STEPS_DEG[-1]) :]


def coupled_figures(fmus: dict[str, Path], folder: str) -> dict[str, object]:
    """Cost of the valve train in the coupled six, and errors by scheme and step."""
    crank = ct.build_fmu("diesel_i6", folder, film_table=False, block=False)
    values = {"cranktrain": {"crank.level": "torsional"}}
    three = Partners(crank, fmus["combustion_i6"], values, fmus["valvetrain_i6"])
    two = Partners(crank, fmus["combustion_i6"], values)
    pairs = [[coupled(partners, "gauss-seidel", 1.0)[1] for partners in (three, two)] for _ in range(3)]
    names = "cranktrain.pulley.torsion", "cranktrain.shaft.torque"
    finest = [last_cycle(coupled(three, "gauss-seidel", FINE_DEG)[0], name) for name in names]
    errors: dict[str, dict[str, dict[str, float]]] = {}
    for scheme in ("gauss-seidel", "jacobi"):
        for step in STEPS_DEG:
            torsion, torque = (last_cycle(coupled(three, scheme, step)[0], name) for name in names)
            errors.setdefault(scheme, {})[f"{step:g}"] = {
                "torsion": float(np.sqrt(np.mean((torsion - finest[0]) ** 2)) / finest[0].std()),
                "mean_torque": float(torque.mean() / finest[1].mean() - 1.0),
            }
    with_it, without = np.median(pairs, axis=0)
    return {"real_time_factor": float(with_it), "without": float(without), "errors": errors}


def main() -> int:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        fmus = {name: ct.build_fmu(name, folder) for name in TAKEN}
        engine = coupled_figures(fmus, folder)
        units = {name: Unit(fmus[name], ends) for name, ends in TAKEN.items()}
        blocks = [{name: unit.block() for name, unit in units.items()} for _ in range(BLOCKS)]
        cost = {name: median(block[name] for block in blocks) for name in units}
    found = {name: {"us": 1e6 * value, "share_of_real_time": value / STEP} for name, value in cost.items()}
    ratio = cost["valvetrain_i6"] / cost["combustion_i6"]
    own = {"ratio": ratio, "native_share_of_real_time": native() / STEP, "coupled": engine}
    print(json.dumps({**found, **own}, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
