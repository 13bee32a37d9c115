"""Mean mass of the rods on a crankshaft, for natural frequencies.

Each pin carries the cycle mean of its rods' masses across the axis, m_b + ½ m_o at each rod's position on the pin: the
oscillating mass takes part in the pin's motion by cos² θ, half on average.
"""

from collections.abc import Collection

import numpy as np

from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.engine.model import Engine


def rod_masses(engine: Engine, crankshaft: ReducedBody, without: Collection[int] = ()) -> Array:
    """Return the mean mass matrix of the rods (n, n) in a crankshaft's modes, each rod at its position on the pin."""
    mass = np.zeros((crankshaft.n_modes, crankshaft.n_modes))

    def row(name: str, component: int) -> Array:
        return np.asarray(crankshaft.shapes[crankshaft.index(name), component])

    own = zip(engine.cylinders.pins, engine.rod_offsets, mean_rod_masses(engine), strict=True)
    for cylinder, (pin, offset, rod_mass) in enumerate(own, 1):
        if cylinder in without:
            continue
        # The rod acts at (0, 0, offset) from the middle of the pin.
        for component, tilt in ((0, offset * row(f"pin[{pin}]", 4)), (1, -offset * row(f"pin[{pin}]", 3))):
            at_rod = row(f"pin[{pin}]", component) + tilt
            mass += rod_mass * np.outer(at_rod, at_rod)
    return mass


def mean_rod_masses(engine: Engine) -> list[float]:
    """Return the cycle-mean mass of each cylinder's rod on its pin across the axis, m_b + ½ m_o, kg.

    Articulated rods are treated as if their knuckle pins moved like the crank pin.
    """
    piston = engine.cylinders.piston_mass
    return [rod.big_end_mass + 0.5 * (rod.small_end_mass + piston) for rod in engine.rods]
