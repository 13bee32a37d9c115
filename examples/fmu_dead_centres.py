"""Dead centres told by an FMU with clocks: ``python examples/fmu_dead_centres.py [FILE.fmu] [--cycles 1]``.

FMPy runs an FMU of FMI 3.0 in event mode. Each step that meets the firing dead centre of a cylinder ends there, and the
cylinder's clock ticks in the event mode that follows. Without a file the six's FMU is built into ``dist/clocks``.
"""

from __future__ import annotations

import argparse
import math
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi3 import FMU3Slave

from cranktrain.fmu.build import build_fmu

STEP_DEG = 1.0


class Listener(FMU3Slave):
    """FMPy's unit, which keeps the time, the crank's angle and the clocks that tick in each event mode.

    Attributes
    ----------
    ticks : of each event the time, s, the crank's angle, rad, and the names of the clocks
    """

    def __init__(self, path: Path) -> None:
        self.about = read_model_description(str(path))
        self.folder = extract(str(path))
        model = self.about.coSimulation.modelIdentifier
        super().__init__(guid=self.about.instantiationToken, unzipDirectory=self.folder, modelIdentifier=model)
        variables = self.about.modelVariables
        self.clocks = {v.name: v.valueReference for v in variables if v.type == "Clock"}
        self.read = [v.valueReference for name in ("time", "crank.angle") for v in variables if v.name == name]
        self.ticks: list[tuple[float, float, list[str]]] = []

    def enterEventMode(self) -> None:
        """Also called by FMPy after a step that an event has ended."""
        super().enterEventMode()
        active = self.getClock(self.clocks.values())
        time, angle = self.getFloat64(self.read)
        self.ticks.append((time, angle, [name for name, tick in zip(self.clocks, active, strict=True) if tick]))

    def simulate(self, stop: float, step: float, **options: Any) -> Any:
        """Results of a run by FMPy, which frees the unit; times in s."""
        try:
            self.instantiate(eventModeUsed=True, earlyReturnAllowed=True)
            return simulate_fmu(
                self.folder, model_description=self.about, fmu_instance=self, fmi_type="CoSimulation",
                use_event_mode=True, early_return_allowed=True, stop_time=stop, output_interval=step, **options,
            )  # fmt: skip
        finally:
            shutil.rmtree(self.folder, ignore_errors=True)

    @property
    def start_speed(self) -> float:
        """Speed at which the FMU starts, rad/s."""
        return next(float(v.start) for v in self.about.modelVariables if v.name == "speed")


def main(arguments: Sequence[str] | None = None) -> list[tuple[float, float, list[str]]]:
    """Print the dead centres of a run at the FMU's start speed; returns them."""
    parser = argparse.ArgumentParser(description="Dead centres told by an FMU with clocks.")
    parser.add_argument("fmu", nargs="?", help="FMU built with --fmi 3.0 --clocks; built where not given")
    parser.add_argument("--cycles", type=float, default=1.0, help="of 720 degrees (default: 1)")
    chosen = parser.parse_args(arguments)
    path = Path(chosen.fmu) if chosen.fmu else build_fmu("diesel_i6", "dist/clocks", fmi="3.0", clocks=True)
    if not path.is_file():
        sys.exit(f"fmu_dead_centres: no file '{path}'; python build_fmu.py diesel_i6 --fmi 3.0 --clocks makes one")
    unit = Listener(path)
    if not unit.clocks:
        sys.exit(f"fmu_dead_centres: {path} has no clocks; build it with --fmi 3.0 --clocks")
    step = math.radians(STEP_DEG) / unit.start_speed
    unit.simulate(round(720.0 * chosen.cycles / STEP_DEG) * step, step)
    for time, angle, names in unit.ticks:
        print(f"{1e3 * time:9.4f} ms {math.degrees(angle):10.4f} deg  {', '.join(names)}")
    return unit.ticks


if __name__ == "__main__":
    main()
