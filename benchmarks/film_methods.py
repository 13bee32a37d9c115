"""Integrators and steps with elastic films: ``python -m benchmarks.film_methods [--only METHOD] [--steps DEG]``.

An engine on level ``ehd``, the six at 2000 rev/min unless others are named, third cycle from the start, by every
integrator, also those that a run refuses, against esdirk47 at 0.5 degrees with each film solved in doubles: least film
and largest pressure of each main; RMS errors over the cycle, relative to the alternating part, of torsion, forces (both
axes together) and least films, the worst main's; processor seconds per simulated second and the linear solutions of
groups of films per stage. A method suits elastic films if the error of the largest pressure does not grow, over all
mains, as the step is halved. Prints one JSON object.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import SolverError
from cranktrain.core.kernel import RECORDS
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.dynamics.time import integrators
from cranktrain.engine.file import load_engine
from cranktrain.film.laws.film_solution import GROUP_PASSES
from cranktrain.film.laws.pressure_peak import PEAK, pressure_peaks
from cranktrain.structure.assembly import assemble

Array = NDArray[np.float64]
REFERENCE: dict[str, Any] = {"integrator": "esdirk47", "step": 0.5, "newton_tolerance": 3.0e-7}
STEPS_DEG = (2.0, 1.0, 0.5)
CYCLES, PER_CYCLE = 3, 360


class Cycle(NamedTuple):
    """Last cycle of a run of b mains."""

    torsion: Array  # (samples, 1) rad
    forces: Array  # (samples, 2 b) N
    films: Array  # (samples, b) m
    peaks: Array  # (b,) Pa, within steps too
    cost: dict[str, float]


def last_cycle(engine: str, rpm: float, choices: dict[str, Any]) -> Cycle:
    """Run an engine; ``step`` of ``choices`` is in degrees."""
    settings = Settings(bearings="ehd", **choices | {"step": math.radians(choices["step"])})
    made = assemble(load_engine(engine), settings)
    run = Simulation(made.engine, made.body, made.settings, None, made.parts)
    run.inputs[0] = rpm * math.pi / 30.0
    run.initialize()
    names = list(run.output_names)
    mains = range(1, len(run.model.bearings) + 1)
    length = 4.0 * math.pi / run.inputs[0]
    rows = np.zeros((PER_CYCLE, len(names)))
    calls = RECORDS[int(run.model.films.entry[0, 1])].memory.calls[0]
    for k in range(CYCLES):
        begin, solved, stages = time.process_time(), calls[GROUP_PASSES], run.work.counters[at.N_STAGES]
        run.series(length / PER_CYCLE, k * PER_CYCLE + 1, rows)
        used = time.process_time() - begin
    peaks = pressure_peaks(run.model.films.entry)
    assert peaks is not None
    solutions = (calls[GROUP_PASSES] - solved) / (run.work.counters[at.N_STAGES] - stages)

    def of(*kinds: str) -> Array:
        return rows[:, [names.index(f"bearing[{i}].{kind}") for i in mains for kind in kinds]]

    torsion = rows[:, [names.index("pulley.torsion")]]
    cost = {"s_per_s": round(used / length, 3), "solutions_per_stage": round(float(solutions), 2)}
    return Cycle(torsion, of("force.x", "force.y"), of("film_thickness_min"), peaks[:, PEAK].copy(), cost)


def error(found: Array, known: Array, together: int = 1) -> float:
    """Largest RMS of a difference over that of the known alternating part, ``together`` columns at a time."""
    missed, size = (
        np.square(part).mean(axis=0).reshape(-1, together).sum(axis=1)
        for part in (found - known, known - known.mean(axis=0))
    )
    return round(float(np.sqrt(missed / size).max()), 5)


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.film_methods", description=__doc__)
    parser.add_argument("--engine", default="diesel_i6", help="name or file")
    parser.add_argument("--speed", type=float, default=2000.0, metavar="RPM")
    parser.add_argument("--block", default="ground", choices=("ground", "flexible"))
    parser.add_argument("--only", nargs="+", default=list(integrators.INTEGRATORS), metavar="METHOD")
    parser.add_argument("--steps", nargs="+", type=float, default=STEPS_DEG, metavar="DEG")
    chosen = parser.parse_args()
    integrators.LARGEST_FOR_FILMS = math.inf  # methods that runs refuse are measured too
    where = {"block": chosen.block}
    known = last_cycle(chosen.engine, chosen.speed, REFERENCE | where)
    found: dict[str, Any] = {}
    for name in chosen.only:
        rows = found.setdefault(name, {"largest coefficient": round(integrators.amplification(name), 3)})
        for step in chosen.steps:
            print(f"film_methods: {name}, {step:g} deg", file=sys.stderr, flush=True)
            try:
                run = last_cycle(chosen.engine, chosen.speed, {"integrator": name, "step": step} | where)
            except SolverError as failed:
                rows[f"{step:g} deg"] = {"failed": str(failed)}
                continue
            rows[f"{step:g} deg"] = {
                "error_of_least_films": (run.films.min(axis=0) / known.films.min(axis=0) - 1.0).round(3).tolist(),
                "error_of_largest_pressures": (run.peaks / known.peaks - 1.0).round(3).tolist(),
                "torsion": error(run.torsion, known.torsion),
                "forces": error(run.forces, known.forces, 2),
                "films": error(run.films, known.films),
                **run.cost,
            }
    print(json.dumps(found, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
