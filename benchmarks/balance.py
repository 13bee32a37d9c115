"""Unbalance of the V8's throws, and the rotating couple that its balance weights cancel.

    python -m benchmarks balance

Throws at 0/90/270/180° leave √10 times a throw's unbalance at a pitch's distance. The crankshaft's own part comes
from its finite elements, read from the cache.
"""

from __future__ import annotations

import json

import numpy as np

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.structure.crank.reduction import complete_crankshaft, reduced_crankshaft

SPEED = 1800.0 * np.pi / 30.0


def couple_along_throw_1(engine: Engine, body: ReducedBody) -> float:
    """∫ρ z r in the direction of throw 1, kg m²."""
    angle = engine.crankshaft.throw_angles[0]
    return float(body.inertia[0, 2] * np.sin(angle) - body.inertia[1, 2] * np.cos(angle))


def main() -> None:
    """Print unbalances, and couples at 1800 rev/min, as one JSON object."""
    engine = load_engine("diesel_v8")
    body = reduced_crankshaft(engine)
    rod, throw, pins = engine.rod, engine.crankshaft.throw, engine.crankshaft.pin_positions
    lever = 3.0 * (pins[1] - pins[0])
    # Two oscillating masses at right angles are, in first order, one that turns.
    rods, pistons = 2.0 * rod.big_end_mass * throw, (rod.small_end_mass + engine.cylinders.piston_mass) * throw
    # Σ z U along throw 1 is −3 pitches of U.
    own = -couple_along_throw_1(engine, body) / lever
    left = couple_along_throw_1(engine, complete_crankshaft(engine, body)) - lever * (rods + pistons)
    # The couple leans from throw 1 as 3 to 1.
    size = np.sqrt(10.0) / 3.0 * SPEED**2
    result = {
        "unbalance_of_a_throw_kgm": {"crankshaft": own, "two_big_ends": rods, "pistons_first_order": pistons},
        "couple_without_balance_weights_nm": abs(lever * (own + rods + pistons)) * size,
        "couple_with_them_nm": abs(left) * size,
    }
    print(json.dumps(result, indent=2))


if __name__ == "__main__":
    main()
