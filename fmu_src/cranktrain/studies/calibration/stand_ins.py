"""What the block gives way by, as springs for the level ``ground``: static stiffness of its bores and thrust faces.

Each is the inverse of the compliance of the free block with its heads under a unit load at that interface, balanced by
inertia; the bores' is the mean compliance of all mains, so that one value stands for them in the engine file.
"""

from __future__ import annotations

import numpy as np

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.engine.model import Engine
from cranktrain.structure.block.reduction import complete_block


def stand_ins(engine: Engine, block: ReducedBody) -> dict[str, float]:
    """``bore_stiffness_x``, ``bore_stiffness_y``, ``thrust_face_stiffness``, N/m, of a bare block."""
    complete = complete_block(engine, block)

    def compliance(interface: str, component: int) -> float:
        row = complete.shapes[complete.index(interface), component, 6:] / complete.omega[6:]
        return float(row @ row)

    bores = [name for name in complete.interfaces if name.startswith("bore")]
    x, y = (float(1.0 / np.mean([compliance(name, k) for name in bores])) for k in (0, 1))
    return {"bore_stiffness_x": x, "bore_stiffness_y": y, "thrust_face_stiffness": 1.0 / compliance("thrust", 2)}
