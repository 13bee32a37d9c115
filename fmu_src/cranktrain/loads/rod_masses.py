"""Mean mass of the rods on a crankshaft, for its natural frequencies.

Each pin carries the cycle mean of its rods' masses across the axis, m_b + ½ m_o at each rod's position on the pin: the
oscillating mass takes part in the pin's motion by cos² θ, half on average.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.engine.model import Engine


def rod_masses(engine: Engine, crankshaft: ReducedBody, without: Collection[int] = ()) -> Array:
    """Mean mass of the rods (n, n) in a crankshaft's modes, each at its position on the pin."""
    mass = np.zeros((crankshaft.n_modes, crankshaft.n_modes))

    def row(name: str, component: int) -> Array:
        return np.asarray(crankshaft.shapes[crankshaft.index(name), component])

    own = zip(engine.cylinders.pins, engine.rod_offsets, mean_rod_masses(engine), strict=True)
    for cylinder, (pin, offset, rod_mass) in enumerate(own, 1):
        if cylinder in without:
            continue
        # The rod sits on the pin beside its middle, at (0, 0, offset) from it.
        for component, tilt in ((0, offset * row(f"pin[{pin}]", 4)), (1, -offset * row(f"pin[{pin}]", 3))):
            at_rod = row(f"pin[{pin}]", component) + tilt
            mass += rod_mass * np.outer(at_rod, at_rod)
    return mass


def mean_rod_masses(engine: Engine) -> list[float]:
    """Cycle-mean mass that each cylinder's rod puts on its pin across the axis, m_b + ½ m_o, kg.

    Articulated rods count as if their knuckle pins moved like the crank pin.
    """
    piston = engine.cylinders.piston_mass
    return [rod.big_end_mass + 0.5 * (rod.small_end_mass + piston) for rod in engine.rods]
