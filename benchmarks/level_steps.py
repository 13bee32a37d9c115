"""Step error and cost of integrators and steps at each level: ``python -m benchmarks.level_steps [ENGINE...]``.

Engines from one to twelve cylinders with beam cranks, on rigid ground. Each choice runs from the static equilibrium
with rows of one degree, by dense output. Its sixth cycle is compared with the same of ``esdirk4`` at 0.5 degrees: RMS
of the difference over the RMS of the reference's alternating part, of torsion and axial motion of the pulley, of the
worst force and the worst least film of the mains. Cost is the processor time of that cycle with a row a step, over that
of ``esdirk4`` at 2.5 degrees; ``rejected`` counts the steps of that cycle that were halved. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import statistics
import sys
import time
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import Assembly, assemble

SPEEDS = {
    "single_petrol": [2000.0, 6000.0], "four_petrol": [2500.0, 6000.0], "diesel_i6": [1000.0, 2000.0, 2380.0],
    "diesel_v8": [1800.0], "v12_petrol": [2500.0, 6000.0],
}  # fmt: skip
LEVELS = {"torsional": "held", "beam": "linear", "films": "impedance", "tilted films": "table", "rollers": "roller"}
CHOICES = [("esdirk4", 2.5), ("esdirk4", 4.0), ("esdirk4", 5.0), ("esdirk4", 6.0), ("esdirk47", 4.0), ("esdirk47", 5.0),
           ("esdirk47", 6.0)]  # fmt: skip
CYCLES, ROWS, REPEATS = 6, 720, 3
FAMILIES = {"torsion": "pulley.torsion", "axial": "pulley.axial", "forces": "].force", "film": "film_thickness_min"}


class Cycle(NamedTuple):
    """Outputs (rows, n) of a cycle, their names, its processor seconds, and its steps that were halved."""

    series: NDArray[np.float64]
    names: tuple[str, ...]
    seconds: float
    rejected: int


def cycle(made: Assembly, speed: float, choice: tuple[str, float], rows: int) -> Cycle:
    """The last cycle of a run."""
    settings = replace(made.settings, integrator=choice[0], step=math.radians(choice[1]), newton_tolerance=None)
    run = Simulation(made.engine, made.body, settings, None, made.parts)
    run.inputs[0] = speed
    run.initialize()
    h = 4.0 * math.pi / speed / rows
    series = np.empty((rows, run.outputs.size))
    for c in range(CYCLES):
        run.work.counters[at.N_REJECTED] = 0.0
        start = time.process_time()
        run.series(h, c * rows + 1, series)
        used = time.process_time() - start
    return Cycle(series, run.output_names, used, int(run.work.counters[at.N_REJECTED]))


def errors(series: NDArray[np.float64], best: NDArray[np.float64], names: Any) -> dict[str, float]:
    """Error of each family of outputs, the worst of its outputs."""
    away = np.sqrt(np.mean((series - best) ** 2, axis=0))
    swing = np.std(best, axis=0)
    found: dict[str, float] = {}
    for k, name in enumerate(names):
        family = next((f for f, part in FAMILIES.items() if part in name), None)
        if family is not None and swing[k] > 1.0e-9 * max(1.0, float(np.abs(best[:, k]).max())):
            found[family] = max(found.get(family, 0.0), float(away[k] / swing[k]))
    return found


def level(engine: str, crank: str, bearings: str, speed: float) -> list[dict[str, Any]]:
    """Errors and costs of all choices."""
    made = assemble(load_engine(engine), Settings(crank=crank, bearings=bearings, block="ground"))
    best = cycle(made, speed, ("esdirk4", 0.5), ROWS)
    rows = []
    for choice in CHOICES:
        series = cycle(made, speed, choice, ROWS).series
        own = round(4.0 * math.pi / speed / communication_step(speed, math.radians(choice[1])))
        alone = [cycle(made, speed, choice, own) for _ in range(REPEATS)]
        used, off = statistics.median(one.seconds for one in alone), errors(series, best.series, best.names)
        rows.append({
            "choice": f"{choice[0]} {choice[1]:g}", "seconds": used, "rejected": alone[0].rejected, **off
        })  # fmt: skip
    for row in rows:
        row["cost"] = row["seconds"] / rows[0]["seconds"]
    return rows


def main(names: list[str]) -> int:
    """Measure and print."""
    found: dict[str, Any] = {}
    for engine in names or list(SPEEDS):
        rollers = load_engine(engine).rollers_only
        for title, bearings in LEVELS.items():
            if (bearings == "roller") != rollers and bearings not in ("held", "linear"):
                continue
            for rpm in SPEEDS[engine]:
                crank = "torsional" if bearings == "held" else "beam"
                print(f"level_steps: {engine} {title} {rpm:g}", file=sys.stderr, flush=True)
                found[f"{engine} {title} {rpm:g}"] = level(engine, crank, bearings, rpm * math.pi / 30.0)
    print(json.dumps(found, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
