"""The block on its mounts, and the pistons in it, as arrays of the running model.

Mounts are linear and stationary, so their stiffness and damping are part of the stationary bodies' linear system.
Displacements count from the engine's position at rest under its own weight, so each mount is preloaded with its part.
"""

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array, ReducedBody, rigid_coordinates
from cranktrain.dynamics.model.ports import cylinder_axes
from cranktrain.dynamics.model.records import DIRECTIONS, BlockArrays, no_block
from cranktrain.engine.model import Engine
from cranktrain.loads.piston_guidance import guidance_parameters, piston_mass_matrix, piston_modes


def block_arrays(
    engine: Engine, stationary: ReducedBody, block: ReducedBody | None, crank_mass: float, crank_centre: Array
) -> BlockArrays:
    """Arrays of the block with zero preload; ``stationary`` has the block's modes, then the modes of guided pistons.

    Raises
    ------
    InputError
        a flexible block without mounts
    """
    n = stationary.n_modes
    count = engine.n_cylinders
    z = np.zeros
    still = no_block(n, count)
    if engine.piston_guidance is not None:
        mass = piston_mass_matrix(engine.piston_guidance, engine.cylinders.piston_mass, engine.rod.small_end_mass)
        shape = np.ascontiguousarray(piston_modes(mass))
        still = still._replace(
            guidance=guidance_parameters(engine.piston_guidance, engine.cylinders.piston_mass),
            piston_shape=shape, piston_inverse=shape @ shape.T,
        )  # fmt: skip
    if block is None:
        return still
    if engine.mounts is None:
        raise InputError(f"engine '{engine.name}' has no [mounts]; add them, or leave the block ground")
    heads, liners = still.heads, still.liners
    for k in range(count):
        _, along = cylinder_axes(engine.cylinders.bank_angles[k])
        heads[k] = along @ stationary.shapes[stationary.index(f"head[{k + 1}]"), :3]
        for column, end in enumerate(("upper", "lower")):
            liners[k, column] = along @ stationary.positions[stationary.index(f"liner[{k + 1}].{end}")]
    rows = [stationary.index(f"mount[{k + 1}]") for k in range(len(engine.mounts.x))]
    mounts = stationary.shapes[rows].reshape(-1, n)
    stiffness, damping = np.ravel(engine.mounts.stiffness), np.ravel(engine.mounts.damping)
    origin = z((DIRECTIONS, n))
    origin[:, :DIRECTIONS] = rigid_coordinates(block)
    motion = origin.copy()
    motion[:3] += np.cross(origin[3:].T, block.centre).T
    of_block = mounts[:, : block.n_modes]
    weight = _weight(engine, block, mounts, stiffness, origin, (crank_mass, crank_centre))
    return still._replace(
        stiffness=np.ascontiguousarray(of_block.T @ (stiffness[:, None] * of_block)),
        damping=np.ascontiguousarray(of_block.T @ (damping[:, None] * of_block)),
        weight=np.ascontiguousarray(mounts.T @ weight),
        mounts=np.ascontiguousarray(mounts),
        mount_laws=np.ascontiguousarray(np.stack((stiffness, damping, z(weight.size), weight), axis=1)),
        cover=np.ascontiguousarray(stationary.shapes[stationary.index("cover"), 1]),
        motion=motion,
    )


def _weight(
    engine: Engine, block: ReducedBody, mounts: Array, stiffness: Array, origin: Array, crank: tuple[float, Array]
) -> Array:
    """Forces (6 j,) of all mount components that carry the engine at rest, per m/s² of gravity."""
    rods = (engine.rod.big_end_mass + engine.rod.small_end_mass + engine.cylinders.piston_mass) * engine.n_cylinders
    mass = block.mass + crank[0] + rods
    moment = block.mass * block.centre + (crank[0] + rods) * crank[1]
    weight = np.array([0.0, -mass, 0.0, moment[2], 0.0, -moment[0]])
    # Motion of each mount for unit motions of the block as a rigid body about its origin.
    rigid = mounts[:, :DIRECTIONS] @ np.linalg.inv(origin[:, :DIRECTIONS])
    supports = rigid.T @ (stiffness[:, None] * rigid)
    # Rows in metres and radians are scaled by their own stiffness before the rank is checked.
    size = np.sqrt(np.diag(supports))
    if not (size > 0.0).all() or np.linalg.cond(supports / np.outer(size, size)) > 1e12:
        raise InputError("mounts: the engine is free to move on them; give stiffness in every direction")
    return np.asarray(-stiffness * (rigid @ np.linalg.solve(supports, weight)))
