"""The block on its mounts, and the pistons in it, as arrays of the running model.

Mounts are linear and stationary, so their stiffness and damping are part of the stationary bodies' linear system.
Displacements count from the engine's position at rest under its own weight, so each mount is preloaded with its part.
"""

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import ReducedBody, rigid_coordinates
from cranktrain.dynamics.model.ports import cylinder_axes
from cranktrain.dynamics.model.records import DIRECTIONS, BlockArrays, no_block
from cranktrain.dynamics.model.slots import MOUNT_LAW
from cranktrain.engine.model import Engine
from cranktrain.loads.piston_guidance import guidance_parameters


def block_arrays(engine: Engine, stationary: ReducedBody, block: ReducedBody | None) -> BlockArrays:
    """Arrays of the block; ``stationary`` has the block's modes, then the modes of guided pistons.

    The preparation of a run writes stiffness, damping and preload of the mounts and the modes of pistons.

    Raises
    ------
    InputError
        a flexible block without mounts, or one that is free to move on them
    """
    n = stationary.n_modes
    count = engine.n_cylinders
    z = np.zeros
    still = no_block(n, count)
    if engine.piston_guidance is not None:
        still = still._replace(guidance=guidance_parameters(engine.piston_guidance, engine.cylinders.piston_mass))
    if block is None:
        return still
    if engine.mounts is None:
        raise InputError(f"engine '{engine.name}' has no [mounts]; add them, or leave the block ground")
    liners = still.liners
    for k in range(count):
        _, along = cylinder_axes(engine.cylinders.bank_angles[k])
        for column, end in enumerate(("upper", "lower")):
            liners[k, column] = along @ stationary.positions[stationary.index(f"liner[{k + 1}].{end}")]
    rows = [stationary.index(f"mount[{k + 1}]") for k in range(len(engine.mounts.x))]
    mounts = stationary.shapes[rows].reshape(-1, n)
    origin = z((DIRECTIONS, n))
    origin[:, :DIRECTIONS] = rigid_coordinates(block)
    motion = origin.copy()
    motion[:3] += np.cross(origin[3:].T, block.centre).T
    # Motion of each mount for unit motions of the block as a rigid body about its origin.
    rigid = mounts[:, :DIRECTIONS] @ np.linalg.inv(origin[:, :DIRECTIONS])
    supports = rigid.T @ (np.ravel(engine.mounts.stiffness)[:, None] * rigid)
    # Rows in metres and radians are scaled by their own stiffness before the rank is checked.
    size = np.sqrt(np.diag(supports))
    if not (size > 0.0).all() or np.linalg.cond(supports / np.outer(size, size)) > 1e12:
        raise InputError("mounts: the engine is free to move on them; give stiffness in every direction")
    return still._replace(
        stiffness=z((block.n_modes, block.n_modes)),
        damping=z((block.n_modes, block.n_modes)),
        mounts=np.ascontiguousarray(mounts),
        mount_laws=z((len(mounts), MOUNT_LAW)),
        cover=np.ascontiguousarray(stationary.shapes[stationary.index("cover"), 1]),
        motion=motion,
    )
