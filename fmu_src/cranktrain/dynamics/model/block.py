"""The block on its mounts, and the pistons in it, as arrays of the running model.

Mounts are linear and stationary, so their stiffness and damping are part of the stationary bodies' linear system.
Displacements count from the engine's position at rest under its own weight, so each mount is preloaded with its part.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array, ReducedBody, rigid_coordinates
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.ports import cylinder_axes
from cranktrain.engine.model import Engine
from cranktrain.loads.piston_guidance import guidance_parameters, piston_mass_matrix, piston_modes

DIRECTIONS = 6


class BlockArrays(NamedTuple):
    """Arrays of block and guided pistons: j mounts and n_s stationary modes, of which the first n_b are the block's."""

    stiffness: Array  # (n_b, n_b) stiffness of the mounts in the block's modes
    damping: Array  # (n_b, n_b) damping of the mounts in the block's modes
    preload: Array  # (n_s,) modal force of the mounts that carries the engine's weight
    weight: Array  # (n_s,) preload of the mounts per m/s² of gravity
    heads: Array  # (c, n_s) displacement of each head along its cylinder
    liners: Array  # (c, 2) height of each liner's upper and lower ring along its cylinder from the crank axis, m
    mounts: Array  # (6 j, n_s) displacement and rotation of each mount
    mount_laws: Array  # (6 j, MOUNT_LAW) stiffness, damping and preload of each component of ``mounts``
    cover: Array  # (n_s,) upward displacement of the bottom cover's middle
    motion: Array  # (6, n_s) displacement and rotation of the whole block, at its centre of mass
    guidance: Array  # (10,) see loads.piston_guidance
    piston_shape: Array  # (2, 2) shape P of a guided piston's ports in its modes
    piston_inverse: Array  # (2, 2) inverse mass P Pᵀ of a guided piston at its ports


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
    guidance: Array = z(10)
    shape: Array = np.eye(2)
    if engine.piston_guidance is not None:
        guidance = guidance_parameters(engine.piston_guidance, engine.cylinders.piston_mass)
        mass = piston_mass_matrix(engine.piston_guidance, engine.cylinders.piston_mass, engine.rod.small_end_mass)
        shape[:] = piston_modes(mass)
    liners = np.tile([1.0, -1.0], (count, 1))
    if block is None:
        # On rigid ground liners have no displacement, so their heights do not matter.
        return BlockArrays(
            z((0, 0)), z((0, 0)), z(n), z(n), z((count, n)), liners, z((0, n)), z((0, at.MOUNT_LAW)), z(n),
            z((DIRECTIONS, n)), guidance, shape, shape @ shape.T,
        )  # fmt: skip
    if engine.mounts is None:
        raise InputError(f"engine '{engine.name}' has no [mounts]; add them, or leave the block ground")
    heads = z((count, n))
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
    return BlockArrays(
        stiffness=np.ascontiguousarray(of_block.T @ (stiffness[:, None] * of_block)),
        damping=np.ascontiguousarray(of_block.T @ (damping[:, None] * of_block)),
        preload=z(n),
        weight=np.ascontiguousarray(mounts.T @ weight),
        heads=heads,
        liners=liners,
        mounts=np.ascontiguousarray(mounts),
        mount_laws=np.ascontiguousarray(np.stack((stiffness, damping, z(weight.size), weight), axis=1)),
        cover=np.ascontiguousarray(stationary.shapes[stationary.index("cover"), 1]),
        motion=motion,
        guidance=guidance,
        piston_shape=shape,
        piston_inverse=shape @ shape.T,
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
