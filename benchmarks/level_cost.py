"""What each level costs, and its numerical error: ``python -m benchmarks.level_cost [LEVEL ...]``.

The six at 2000 rev/min. Cost: processor time of a cycle over its length, and over that of the impedance level as it
usually runs, medians over rounds in which every case takes its turn. Error: RMS of the difference of the pulley's
torsion over the last of three cycles to the same level at a third of a degree by esdirk47, over the RMS of its
alternating part.
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
USUAL = ((5.0, "auto"), (2.5, "esdirk4"), (5.0, "esdirk4"), (10.0, "auto"))
LEVELS: dict[str, tuple[Settings, tuple[tuple[float, str], ...]]] = {
    "torsional": (Settings(crank="torsional"), ((6.0, "auto"), *USUAL[1:], (40.0 / 3.0, "auto"))),
    "beam": (Settings(crank="beam", bearings="impedance"), (*USUAL, (5.0, "esdirk57"))),
    "beam, linear": (Settings(crank="beam", bearings="linear"), USUAL),
    "impedance": (Settings(bearings="impedance"), (*USUAL, (5.0, "esdirk57"))),
    "table": (Settings(bearings="table"), USUAL),
    "whole": (Settings(bearings="table", **WHOLE), ((1.25, "auto"), *USUAL)),
    "ehd": (Settings(bearings="ehd"), ((2.0, "auto"),)),
}
"""Settings; steps in degrees, each with its integrator."""
FINE = 1.0 / 3.0
"""Step of the reference: every other step that divides ten degrees, or ten degrees, is a multiple."""
SAMPLES = 72
"""A cycle, of 10 degrees; of a step that does not divide them each is one."""


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

    @property
    def samples(self) -> int:
        """How many of a cycle it has in common with the reference."""
        return self._count if self._count % SAMPLES else SAMPLES

    def cycle(self, samples: int = 0) -> tuple[float, np.ndarray]:
        """Processor seconds of the next one, and so many samples of its torsion (its own ones)."""
        rows = np.zeros((self._count, self.run.outputs.size))
        begin = time.process_time()
        self._done += self.run.series(self._step, self._done + 1, rows)
        seconds = time.process_time() - begin
        every = self._count // (samples or self.samples)
        return seconds, rows[every - 1 :: every, self._place]


def torsion(case: Case, samples: int = 0) -> np.ndarray:
    """Of the last cycle, rad."""
    for _ in range(CYCLES - 1):
        case.cycle()
    return case.cycle(samples)[1]


def main(names: Sequence[str]) -> int:
    """Measure and print."""
    chosen = list(names) or [name for name in LEVELS if name != "ehd"]
    cases: dict[str, Case] = {}
    figures: dict[str, dict[str, float]] = {}
    for name in dict.fromkeys(("impedance", *chosen)):
        settings, steps = LEVELS[name]
        print(f"reference of level {name}", file=sys.stderr, flush=True)
        fine = round(720.0 / FINE)
        exact = torsion(Case(settings, FINE, "esdirk47"), fine)
        for degrees, integrator in steps:
            key = f"{name}, {degrees:g} deg" + (f", {integrator}" if integrator != "auto" else "")
            case = cases[key] = Case(settings, degrees, integrator)
            every = fine // case.samples
            difference = torsion(case) - exact[every - 1 :: every]
            error = float(np.sqrt(np.mean(difference**2)) / np.std(exact))
            figures[key] = {"error_of_torsion": float(f"{error:.2g}")}
    length = 4.0 * math.pi / SPEED
    costs: dict[str, list[float]] = {key: [] for key in cases}
    for _ in range(ROUNDS):
        for key, case in cases.items():
            costs[key].append(case.cycle()[0] / length)
    simple = costs["impedance, 5 deg"]
    for key, own in costs.items():
        figures[key]["of_real_time"] = round(statistics.median(own), 4)
        figures[key]["over_impedance"] = round(statistics.median(np.divide(own, simple)), 3)
    print(json.dumps(figures, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
