"""Bodies of a run, gathered into one that rotates with the crank's frame and one that is stationary.

Both are :class:`~cranktrain.core.reduced_body.ReducedBody`. The crankshaft is extended by free big ends (point masses
in the plane, whose displacement from the undeformed pin is exact at any angle), the damper's ring and the dynamometer's
rotor (one rotation each). The block is extended by guided pistons, each with a motion across its cylinder and a tilt.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array, ReducedBody, rigid_coordinates
from cranktrain.dynamics.model.pack import no_body
from cranktrain.dynamics.model.ports import cylinder_axes
from cranktrain.dynamics.model.records import DIRECTIONS, BlockArrays, no_block
from cranktrain.dynamics.model.slots import MOUNT_LAW
from cranktrain.engine.model import Engine
from cranktrain.loads.piston_guidance import guidance_parameters

BENDING = 1.0e-9
"""Lateral motion of a main journal per rotation of the crank, m/rad, above which elastic modes count as bending."""


def with_big_ends(body: ReducedBody, engine: Engine) -> ReducedBody:
    """Append one free point mass per cylinder to the crankshaft, with interfaces ``rod[i]`` at the undeformed pins."""
    root = math.sqrt(engine.rod.big_end_mass)
    count = engine.n_cylinders
    places = np.array([body.positions[body.index(f"pin[{pin}]")] for pin in engine.cylinders.pins])
    places[:, 2] += engine.rod_offsets
    shapes = np.zeros((count, 6, 2 * count))
    for i in range(count):
        for axis in range(2):
            shapes[i, axis, 2 * i + axis] = 1.0 / root
    translation = np.zeros((3, 2 * count))
    for axis in range(2):
        translation[axis, axis::2] = root
    turned = np.stack([-places[:, 1], places[:, 0]], axis=1)
    return _appended(
        body,
        tuple(f"rod[{i + 1}]" for i in range(count)),
        places,
        shapes,
        # ∫ρ φ_i·(e_z×φ_j) of the modes e_x and e_y: e_z turns e_x into e_y.
        gyroscopic=np.kron(np.eye(count), np.array([[0.0, -1.0], [1.0, 0.0]])),
        centrifugal=np.eye(2 * count),
        centrifugal_load=root * places[:, :2].ravel(),
        euler_load=root * turned.ravel(),
        translation=translation,
    )


def bends(body: ReducedBody) -> bool:
    """True if elastic modes of a crankshaft move its main journals across."""
    mains = [k for k, name in enumerate(body.interfaces) if name.startswith("main[")]
    bending = np.abs(body.shapes[mains][:, :2, 6:]).max(initial=0.0)
    return bool(bending > BENDING * np.abs(body.shapes[:, 5]).max())


def locked_on_axis(body: ReducedBody) -> ReducedBody:
    """Crankshaft with its journals locked on their axis, whose only rigid motion is rotation about the axis.

    ``InputError`` for a body that bends, because no bearing would carry its bending.
    """
    n = body.n_modes
    if bends(body):
        raise InputError(
            f"body '{body.name}' bends, but bearing level 'held' carries none that does; make it by "
            "cranktrain.assemble at crank level torsional, or use bearings linear or impedance"
        )
    free = np.ones(n)
    free[:5] = 0.0
    both = np.outer(free, free)
    return replace(
        body,
        shapes=body.shapes * free,
        gyroscopic=body.gyroscopic * both,
        centrifugal=body.centrifugal * both,
        stress_stiffness=body.stress_stiffness * both,
        centrifugal_load=body.centrifugal_load * free,
        euler_load=body.euler_load * free,
        translation=body.translation * free,
        twists=body.twists * free if body.shafts else body.twists,
    )


def with_rotor(body: ReducedBody, name: str, at: str, inertia: float, speed: float = 1.0) -> ReducedBody:
    """Append a rotor that rotates freely about the crank's axis, with an interface ``name`` at the position of ``at``.

    The rotor turns ``speed`` times as fast as the crank.
    """
    shapes = np.zeros((1, 6, 1))
    shapes[0, 5, 0] = 1.0 / math.sqrt(inertia)
    place = body.positions[body.index(at)][None]
    return _appended(body, (name,), place, shapes, euler_load=np.array([speed * math.sqrt(inertia)]))


def with_axial_mass(body: ReducedBody, name: str, at: str, mass: float) -> ReducedBody:
    """Append a mass that moves freely along the crank's axis, with an interface ``name`` at the position of ``at``."""
    shapes = np.zeros((1, 6, 1))
    shapes[0, 2, 0] = 1.0 / math.sqrt(mass)
    translation = np.zeros((3, 1))
    translation[2] = math.sqrt(mass)
    return _appended(body, (name,), body.positions[body.index(at)][None], shapes, translation=translation)


def with_modes_of(body: ReducedBody, omega: Array) -> ReducedBody:
    """Append the modes of other bodies, with natural frequencies ``omega`` (rad/s), in which ``body`` does not move."""
    n = omega.size
    longer = _appended(body, (), np.zeros((0, 3)), np.zeros((0, 6, n)))
    return replace(longer, omega=np.concatenate((body.omega, omega)))


def stationary_body(engine: Engine, block: ReducedBody | None, guided: Sequence[int]) -> ReducedBody:
    """Stationary bodies gathered into one: the block, if there is one, and the pistons of the ``guided`` cylinders.

    Cylinders count from 0. Without block and pistons the body has no modes. The first of a piston's two modes moves it
    across with the rod's small end; the preparation of a run writes the shapes of both.
    """
    if not guided:
        return block or no_body()
    mass, translation = engine.cylinders.piston_mass + engine.rod.small_end_mass, np.zeros((3, 2 * len(guided)))
    for k, cylinder in enumerate(guided):
        across, _ = cylinder_axes(engine.cylinders.bank_angles[cylinder])
        translation[:, 2 * k] = across * (mass * (1.0 / math.sqrt(mass)))
    nowhere = np.zeros((0, 3)), np.zeros((0, 6, 2 * len(guided)))
    return _appended(block or no_body(), (), *nowhere, translation=translation)


def block_arrays(engine: Engine, stationary: ReducedBody, block: ReducedBody | None) -> BlockArrays:
    """Arrays of the block; ``stationary`` has the block's modes, then the modes of guided pistons.

    Mounts are linear and stationary, so their stiffness and damping are part of the stationary bodies' linear system.
    Displacements count from the engine's position at rest under its own weight, so each mount is preloaded with its
    part. The preparation of a run writes stiffness, damping and preload of the mounts and the modes of pistons.

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


def _appended(
    body: ReducedBody, names: tuple[str, ...], places: Array, shapes: Array, **invariants: Array
) -> ReducedBody:
    """Body with free modes of unit mass appended; mass integrals of the new modes that are not given are zero."""
    n, added = body.n_modes, shapes.shape[2]
    m = len(body.interfaces)
    both = np.zeros((m + len(names), 6, n + added))
    both[:m, :, :n] = body.shapes
    both[m:, :, n:] = shapes

    def square(name: str) -> Array:
        out = np.zeros((n + added, n + added))
        out[:n, :n] = getattr(body, name)
        out[n:, n:] = invariants.get(name, 0.0)
        return out

    def behind(name: str) -> Array:
        own = getattr(body, name)
        return np.concatenate((own, invariants.get(name, np.zeros((*own.shape[:-1], added)))), axis=-1)

    return replace(
        body,
        omega=np.append(body.omega, np.zeros(added)),
        interfaces=body.interfaces + names,
        positions=np.concatenate([body.positions, places]),
        shapes=both,
        gyroscopic=square("gyroscopic"),
        centrifugal=square("centrifugal"),
        stress_stiffness=square("stress_stiffness"),
        centrifugal_load=behind("centrifugal_load"),
        euler_load=behind("euler_load"),
        translation=behind("translation"),
        damping=behind("damping") if body.damping.size else body.damping,
        twists=behind("twists") if body.shafts else body.twists,
        basis=None,
    )
