"""Springs that replace the block at level ``ground``: the block's stiffness at main bores and thrust faces.

Each is the inverse of the compliance of the free block with its heads under a unit load at that interface,

    C(ω) = Σ φ² / (ω_k² − ω²)

For the bores the static elastic stiffness is used (ω = 0, without rigid motions, because inertia balances the load),
with the mean compliance of all mains, so that the engine file has one value for all. The thrust faces carry the whole
axial motion. Their stiffness includes the rigid motions and is taken at the frequency of the axial mode, where the
block moves against the crank and raises the frequency above that on ground.
"""

from __future__ import annotations

import numpy as np

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.engine.model import Engine
from cranktrain.structure.block.reduction import complete_block

RIGID = 6


def stand_ins(engine: Engine, block: ReducedBody, axial_hz: float) -> dict[str, float]:
    """Return ``bore_stiffness_x``, ``bore_stiffness_y``, ``thrust_face_stiffness``, N/m, of a bare block.

    The last is the elastic stiffness alone if ``axial_hz`` is 0, or above the frequency of zero dynamic stiffness.
    """
    complete = complete_block(engine, block)

    def compliance(interface: str, component: int, hz: float = 0.0) -> float:
        squares, omega2 = complete.shapes[complete.index(interface), component] ** 2, complete.omega**2
        first = 0 if hz > 0.0 else RIGID
        return float(np.sum(squares[first:] / (omega2[first:] - (2.0 * np.pi * hz) ** 2)))

    bores = [name for name in complete.interfaces if name.startswith("bore")]
    x, y = (float(1.0 / np.mean([compliance(name, k) for name in bores])) for k in (0, 1))
    thrust = compliance("thrust", 2, axial_hz)
    thrust = thrust if thrust > 0.0 else compliance("thrust", 2)
    return {"bore_stiffness_x": x, "bore_stiffness_y": y, "thrust_face_stiffness": 1.0 / thrust}
