"""What each level costs, and its numerical error: ``python -m benchmarks.level_cost [LEVEL ...]``.

The six at 2000 rev/min. Cost: processor time of a cycle over its length, and over that of the impedance level, medians
over rounds in which every case takes its turn. Error: RMS of the difference of the pulley's torsion over the last of
three cycles to the same level at an eighth of the default's step by sdirk4, over the RMS of its alternating part.
Prints one JSON object; ``ehd`` is run only where it is named.
"""

from __future__ import annotations

import json
import math
import statistics
import sys
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import assemble

SPEED = 2000.0 * math.pi / 30.0
ROUNDS, CYCLES = 9, 3
WHOLE = {"block": "flexible", "pistons": "guided", "damper": "fitted"}
LEVELS = {
    "torsional": (Settings(crank="torsional"), (2.5, 5.0, 10.0)),
    "beam": (Settings(crank="beam", bearings="impedance"), (2.5, 5.0, 10.0)),
    "beam, linear": (Settings(crank="beam", bearings="linear"), (2.5, 5.0, 10.0)),
    "impedance": (Settings(bearings="impedance"), (2.5, 5.0, 10.0)),
    "table": (Settings(bearings="table"), (2.5,)),
    "whole": (Settings(bearings="table", **WHOLE), (2.5, 1.25, 0.625)),
    "ehd": (Settings(bearings="ehd"), (2.5,)),
}
"""Settings, and steps in degrees."""
FINE = 0.3125
SAMPLES = 72
"""A cycle, of 10 degrees, which every step divides."""


class Case:
    """A running level, cycle by cycle."""

    def __init__(self, settings: Settings, degrees: float, integrator: str = "auto") -> None:
        chosen = replace(settings, step=math.radians(degrees), integrator=integrator)
        made = assemble(load_engine("diesel_i6"), chosen)
        self.run = Simulation(made.engine, made.body, made.settings, None, made.parts)
        self.run.inputs[0] = SPEED
        self.run.initialize()
        self._step = communication_step(SPEED, math.radians(degrees))
        self._count = round(4.0 * math.pi / SPEED / self._step)
        self._place = self.run.output_names.index("pulley.torsion")
        self._done = 0

    def cycle(self) -> tuple[float, np.ndarray]:
        """Processor seconds of the next one, and its torsion every ten degrees."""
        rows = np.zeros((self._count, self.run.outputs.size))
        begin = time.process_time()
        self._done += self.run.series(self._step, self._done + 1, rows)
        seconds = time.process_time() - begin
        every = self._count // SAMPLES
        return seconds, rows[every - 1 :: every, self._place]


def torsion(case: Case) -> np.ndarray:
    """Of the last cycle, rad."""
    for _ in range(CYCLES - 1):
        case.cycle()
    return case.cycle()[1]


def main(names: Sequence[str]) -> int:
    """Measure and print."""
    chosen = list(names) or [name for name in LEVELS if name != "ehd"]
    cases: dict[tuple[str, float], Case] = {}
    figures: dict[tuple[str, float], dict[str, float]] = {}
    for name in dict.fromkeys(("impedance", *chosen)):
        settings, steps = LEVELS[name]
        print(f"reference of level {name}", file=sys.stderr, flush=True)
        exact = torsion(Case(settings, FINE, "sdirk4"))
        for degrees in steps:
            case = cases[name, degrees] = Case(settings, degrees)
            difference = torsion(case) - exact
            error = float(np.sqrt(np.mean(difference**2)) / np.std(exact))
            figures[name, degrees] = {"error_of_torsion": float(f"{error:.2g}")}
    length = 4.0 * math.pi / SPEED
    costs: dict[tuple[str, float], list[float]] = {key: [] for key in cases}
    for _ in range(ROUNDS):
        for key, case in cases.items():
            costs[key].append(case.cycle()[0] / length)
    simple = costs["impedance", LEVELS["impedance"][1][0]]
    for key, own in costs.items():
        figures[key]["of_real_time"] = round(statistics.median(own), 4)
        figures[key]["over_impedance"] = round(statistics.median(np.divide(own, simple)), 3)
    print(json.dumps({f"{name}, {degrees:g} deg": found for (name, degrees), found in figures.items()}, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
