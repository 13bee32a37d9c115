"""What a film costs from the impedance map and solved in place, and how far they differ: ``python benchmarks/film.py``.

Random states of the engine's main bearings: eccentricities to 0.95, any direction of squeeze. The map's cost includes
its tangents; the film in place is solved on its 96 nodes with tangents, once starting from the zone of a neighbouring
state as in an orbit, once from nothing. Prints one JSON object: microseconds per film (medians over interleaved
repeats, processor's clock), errors of the force relative to its own size, and the time that making the map takes.
"""

from __future__ import annotations

import json
import math
import sys
import time
from statistics import median
from typing import Any

import numpy as np
from numba import njit

from cranktrain.engine.file import load_engine
from cranktrain.engine.lubricant import oil_temperature, viscosity
from cranktrain.film.laws.bearings import bearing_parameters
from cranktrain.film.laws.impedance import MapFilm, impedance_map, journal_force
from cranktrain.film.laws.parabolic import WORK_SIZE, film_force, node_table
from cranktrain.film.laws.parameters import CLEARANCE, CONTACT_LOAD, FACTOR, KAPPA2

SPEED = 2000.0 * math.pi / 30.0
COUNT, REPEATS = 4000, 15
LARGEST = 0.95
kernel: Any = njit(error_model="numpy")


@kernel
def from_map(states, law, table, out, forces):
    """Force from the map at every state (ε, γ, |v|) with the line of centres along x."""
    for i in range(states.shape[0]):
        eps, gamma, size = states[i]
        film = MapFilm(law[CLEARANCE], law[FACTOR], 0.0, law[CONTACT_LOAD], table)
        journal_force(eps * law[CLEARANCE], 0.0, size * math.cos(gamma), size * math.sin(gamma), 0.0, film, out)
        forces[i, 0] = out[0]
        forces[i, 1] = out[1]


@kernel
def in_place(states, law, nodes, work, out, warm, forces):
    """The same from the film itself, its zone kept from state to state or found anew."""
    zone = out[10:12]
    for i in range(states.shape[0]):
        eps, gamma, size = states[i]
        if not warm:
            zone[0] = 0.0
            zone[1] = 0.0
        film_force(eps, math.cos(gamma), math.sin(gamma), law[KAPPA2], nodes, work, zone, out)
        scale = -law[FACTOR] * size / law[CLEARANCE]
        forces[i, 0] = scale * out[0]
        forces[i, 1] = scale * out[1]


def orbit(count: int) -> np.ndarray:
    """States along a loaded orbit, half a degree apart: eccentricity 0.05 to 0.95, squeeze turning with it."""
    turn = np.radians(0.5) * np.arange(count)
    eps = 0.5 * (0.05 + LARGEST) + 0.5 * (LARGEST - 0.05) * np.sin(turn)
    return np.column_stack([eps, math.pi / 2 + 2.0 * np.sin(1.5 * turn), np.full(count, 0.01)])


def main() -> int:
    """Measure and print."""
    engine = load_engine("diesel_i6")
    eta = viscosity(engine.oil, oil_temperature(engine.oil, SPEED))
    law = bearing_parameters(engine.plain_mains, eta)
    nodes, work, out = node_table(), np.zeros(WORK_SIZE), np.zeros(16)
    rng = np.random.default_rng(1)
    scattered = np.column_stack(
        [rng.uniform(0.0, LARGEST, COUNT), rng.uniform(-math.pi, math.pi, COUNT), np.full(COUNT, 0.01)]
    )
    table = impedance_map(float(law[KAPPA2]))
    begin = time.perf_counter()
    impedance_map(float(law[KAPPA2]))
    making = time.perf_counter() - begin
    smooth = orbit(COUNT)
    mapped, solved, spare = np.empty((COUNT, 2)), np.empty((COUNT, 2)), np.empty((COUNT, 2))

    def timed(function: Any, *arguments: Any) -> float:
        start = time.process_time()
        function(*arguments)
        return 1e6 * (time.process_time() - start) / COUNT

    rounds = [
        (
            timed(from_map, smooth, law, table, out, spare),
            timed(in_place, smooth, law, nodes, work, out, True, spare),
            timed(in_place, smooth, law, nodes, work, out, False, spare),
        )
        for _ in range(REPEATS + 1)
    ][1:]  # the first compiles
    errors = {}
    for name, states in (("scattered", scattered), ("orbit", smooth)):
        from_map(states, law, table, out, mapped)
        in_place(states, law, nodes, work, out, False, solved)
        relative = np.linalg.norm(mapped - solved, axis=1) / np.linalg.norm(solved, axis=1)
        spread = np.quantile(relative, (0.5, 0.95, 1.0))
        errors[name] = dict(zip(("median", "p95", "worst"), spread.tolist(), strict=True))
    map_us, warm_us, cold_us = (median(column) for column in zip(*rounds, strict=True))
    result = {
        "map_us": map_us,
        "in_place_warm_us": warm_us,
        "in_place_cold_us": cold_us,
        "ratio_warm": median(r[1] / r[0] for r in rounds),
        "ratio_cold": median(r[2] / r[0] for r in rounds),
        "force_error": errors,
        "making_the_map_s": making,
    }
    print(json.dumps(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
