"""Integrators and steps with elastic films: ``python -m benchmarks.film_methods``.

The six at 2000 rev/min on level ``ehd``, third cycle from the start: least film and largest pressure of each main by
every integrator, also those that a run refuses, at 2, 1 and 0.5 degrees, against esdirk47 at 0.5 degrees with each film
solved in doubles. A method suits elastic films if the error of the largest pressure does not grow, over all mains, as
the step is halved. Prints one JSON object.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import SolverError
from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.dynamics.time import integrators
from cranktrain.engine.file import load_engine
from cranktrain.film.laws.pressure_peak import PEAK, pressure_peaks
from cranktrain.structure.assembly import assemble

Array = NDArray[np.float64]
REFERENCE: dict[str, Any] = {"integrator": "esdirk47", "step": 0.5, "newton_tolerance": 3.0e-7}
STEPS_DEG = (2.0, 1.0, 0.5)
CYCLES, PER_CYCLE = 3, 360


def extremes(name: str, rpm: float, choices: dict[str, Any]) -> tuple[Array, Array]:
    """Least film, m, and largest pressure, Pa, of each main in the last cycle, (b,); ``step`` of ``choices`` in deg."""
    made = assemble(load_engine(name), Settings(bearings="ehd", **choices | {"step": math.radians(choices["step"])}))
    run = Simulation(made.engine, made.body, made.settings, None, made.parts)
    run.inputs[0] = rpm * math.pi / 30.0
    run.initialize()
    names = list(run.output_names)
    at = [names.index(f"bearing[{i + 1}].film_thickness_min") for i in range(len(run.model.bearings))]
    least = np.full((CYCLES * PER_CYCLE, len(at)), math.inf)
    for k in range(CYCLES * PER_CYCLE):
        run.step((k + 1) * 4.0 * math.pi / run.inputs[0] / PER_CYCLE)
        least[k] = run.outputs[at]
    peaks = pressure_peaks(run.model.films.entry)
    assert peaks is not None
    return least[-PER_CYCLE:].min(axis=0), peaks[:, PEAK]


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.film_methods", description=__doc__)
    parser.add_argument("--engine", default="diesel_i6", help="name or file")
    parser.add_argument("--speed", type=float, default=2000.0, metavar="RPM")
    chosen = parser.parse_args()
    integrators.LARGEST_FOR_FILMS = math.inf  # methods that runs refuse are measured too
    film, pressure = extremes(chosen.engine, chosen.speed, REFERENCE)
    found: dict[str, Any] = {}
    for name in integrators.INTEGRATORS:
        rows = found.setdefault(name, {"largest coefficient": round(integrators.amplification(name), 3)})
        for step in STEPS_DEG:
            print(f"film_methods: {name}, {step:g} deg", file=sys.stderr, flush=True)
            try:
                films, pressures = extremes(chosen.engine, chosen.speed, {"integrator": name, "step": step})
            except SolverError as error:
                rows[f"{step:g} deg"] = {"failed": str(error)}
                continue
            rows[f"{step:g} deg"] = {
                "error_of_least_films": (films / film - 1.0).round(3).tolist(),
                "error_of_largest_pressures": (pressures / pressure - 1.0).round(3).tolist(),
            }
    print(json.dumps(found, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
