"""Resonance of a torsional crank, with and without the damping that it inherits, beside that of the level above.

    python benchmarks/inherited_damping.py [ENGINE …]

Each level runs ten cycles at speeds round the one at which the damping was taken; its resonance is the largest
amplitude (zero to peak) of the firing order that meets the first torsional mode. Prints JSON.
"""

from __future__ import annotations

import json
import math
import sys
from typing import Any

import numpy as np

import cranktrain as ct
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.simulation import simulate
from cranktrain.results.orders.harmonics import last_cycle, order_spectrum

ORDERS = {"diesel_i6": 6.0, "diesel_v8": 12.0}
SPEEDS = np.linspace(0.95, 1.05, 11)
"""Times the speed at which the damping was taken."""


def amplitudes(made: ct.Assembly, order: float, speeds: Array) -> Array:
    """Torsion of the pulley in one order at each speed (rad/s), rad."""
    found = []
    for speed in speeds:
        run = simulate(made.engine, made.body, made.settings, speed, 10, parts=made.parts)
        orders, spectrum = order_spectrum(last_cycle(run.angle, run.outputs["pulley.torsion"]))
        found.append(spectrum[int(np.argmin(np.abs(orders - order)))])
    return np.array(found)


def resonances(name: str) -> dict[str, Any]:
    """Speed (rev/min) and amplitude (degrees) of each level's resonance, and the inherited damping ratios."""
    engine = ct.load_engine(name)
    torsional = ct.assemble(engine, ct.Settings(crank="torsional"))
    taken_at = float(torsional.body.records["inherited_at"][0])
    found: dict[str, Any] = {
        "order": ORDERS[name],
        "taken_at_rpm": taken_at * 30.0 / math.pi,
        "damping": torsional.body.records["inherited_damping"][:, 1].tolist(),
    }
    cases = {
        "beam": ct.assemble(engine, ct.Settings(crank="beam", block="ground")),
        "torsional": torsional,
        "without": ct.assemble(engine, ct.Settings(crank="torsional"), inherit=False),
    }
    for case, made in cases.items():
        values = amplitudes(made, ORDERS[name], taken_at * SPEEDS)
        place = int(values.argmax())
        found[case] = {
            "rpm": taken_at * SPEEDS[place] * 30.0 / math.pi,
            "deg": math.degrees(values[place]),
            "within": bool(0 < place < SPEEDS.size - 1),
        }
    return found


if __name__ == "__main__":
    print(json.dumps({name: resonances(name) for name in sys.argv[1:] or ORDERS}, indent=2))
