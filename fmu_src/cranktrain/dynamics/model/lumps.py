"""Constants from which the arrays of a model are remade when lumped data of the engine change.

The constants belong to the model with the engine file's values; :mod:`cranktrain.dynamics.model.trimming` makes the
arrays of other values from them. Only the scratch arrays are ever written to.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array, ReducedBody, rigid_coordinates
from cranktrain.dynamics.model import lump_slots as at
from cranktrain.dynamics.model import numbers
from cranktrain.dynamics.model.block import DIRECTIONS, BlockArrays
from cranktrain.dynamics.model.lumped_data import lumped_numbers
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.levels import CRANKS
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import bearing_law
from cranktrain.loads.rod_masses import mean_rod_masses


class Lumps(NamedTuple):
    """Constants of a model with t rotating modes (the first r are the crank's), n modes in all, and j mounts."""

    values: Array  # (numbers,) lumped values that the bodies were made for, by slot
    traits: Array  # (TRAITS,) see dynamics.model.lump_slots
    fixed: Array  # (2, 6, r) shapes of flywheel and pulley
    places: Array  # (2, 3) positions of flywheel and pulley
    rigid: Array  # (6, 6) rigid motions about the origin in the crank's rigid modes
    mains: Array  # (b,) positions of the main journals along the axis
    plain: Array  # (b,) 1 if the main bearing has a film
    omega2: Array  # (t,) squared frequencies of the rotating modes
    damping: Array  # (t,) damping of the rotating modes, 1/s
    rod_masses: Array  # (c,) mean mass of each rod on its pin
    gyroscopic: Array  # (t, t) G transposed, as in the model
    centrifugal: Array  # (r, r) centrifugal matrix C of the crank's modes
    stress: Array  # (r, r) stress stiffness K_σ of the crank's modes
    spin: Array  # (t, t) (K_σ − C) transposed, as in the model
    loads: Array  # (2, t) centrifugal and Euler load
    gravity: Array  # (3, n) modal projection of a unit acceleration field
    ports: Array  # (m, t) shapes of the rotating ports
    tilts: Array  # (2b, t) rotation about x and y of each main journal
    ends: Array  # (4, t) motion of flywheel and pulley, see dynamics.model.slots
    shafts: Array  # (s, t) twist of each shaft of the drive line
    lag: Array  # (t,) lag of the drive line's rotors behind a crank that turns slowly by 1 rad
    rotor: Array  # (t,) rotation of a free dynamometer in each mode
    axis_weights: Array  # (b,) weights of main journals in the displacement of the crank's centre of mass
    grown: Array  # (t,) slot of the mass or inertia if a mode moves just one lumped part, else NOT_LUMPED
    block_stiffness: Array  # (n_b, n_b) stiffness of the mounts in the block's modes
    block_damping: Array  # (n_b, n_b) damping of the mounts in the block's modes
    weight: Array  # (n_s,) preload of the mounts per m/s² of gravity
    mount_weight: Array  # (6j,) preload of each mount component per m/s² of gravity
    mount_motion: Array  # (6j, 6) motion of each mount in the block's rigid motions about the origin
    piston_shape: Array  # (2, 2) shape P of a guided piston's ports in its modes
    piston_inverse: Array  # (2, 2) inverse mass P Pᵀ of a guided piston at its ports
    room: Array  # (ROOMS, r, r) scratch
    vectors: Array  # (VECTOR_ROWS, t) scratch
    scratch: Array  # (64,)


def lumps(
    engine: Engine, settings: Settings, body: ReducedBody, turning: ReducedBody, block: ReducedBody | None,
    guided: Sequence[int], arrays: dict[str, Array], stationary: BlockArrays,
) -> Lumps:  # fmt: skip
    """Gather the constants of a model.

    Parameters
    ----------
    settings : resolved
    body : the crank
    turning : all rotating bodies as one
    guided : cylinders (from 0) with guided pistons
    arrays : arrays of the model, by name
    stationary : arrays of block and pistons
    """
    r, t, z = body.n_modes, turning.n_modes, np.zeros
    values = lumped_numbers(engine)
    rows = [body.index("flywheel"), body.index("pulley")]
    mains = [turning.index(f"main[{i + 1}]") for i in range(len(arrays["axis_weights"]))]
    plain = z(len(mains))
    plain[[i for i in engine.plain_numbers if i < len(mains)]] = 1.0
    mounts = stationary.mounts.shape[0]
    motion = z((mounts, DIRECTIONS))
    if block is not None:
        motion = np.ascontiguousarray(stationary.mounts[:, :DIRECTIONS] @ np.linalg.inv(rigid_coordinates(block)))
    grown = np.full(t, at.NOT_LUMPED)
    for mode in range(r, t):
        grown[mode] = _slot(turning, mode)
    keep = {name: np.ascontiguousarray(arrays[name]).copy() for name in (
        "ports", "tilts", "ends", "shafts", "lag", "rotor", "axis_weights", "spin", "gravity",
    )}  # fmt: skip
    return Lumps(
        values=values,
        traits=_traits(engine, settings, body, block, guided, arrays),
        fixed=np.ascontiguousarray(body.shapes[rows]),
        places=np.ascontiguousarray(body.positions[rows]),
        rigid=rigid_coordinates(body),
        mains=np.ascontiguousarray(turning.positions[mains, 2]),
        plain=plain,
        omega2=turning.omega**2,
        damping=arrays["damping"][:t].copy(),
        rod_masses=np.array(mean_rod_masses(engine)),
        gyroscopic=arrays["gyroscopic"].copy(),
        centrifugal=np.ascontiguousarray(turning.centrifugal[:r, :r]),
        stress=np.ascontiguousarray(turning.stress_stiffness[:r, :r]),
        loads=np.stack((turning.centrifugal_load, turning.euler_load)),
        grown=grown,
        block_stiffness=stationary.stiffness.copy(),
        block_damping=stationary.damping.copy(),
        weight=stationary.weight.copy(),
        mount_weight=np.ascontiguousarray(stationary.mount_laws[:, 3]),
        mount_motion=motion,
        piston_shape=stationary.piston_shape.copy(),
        piston_inverse=stationary.piston_inverse.copy(),
        room=z((at.ROOMS, r, r)),
        vectors=z((at.VECTOR_ROWS, t)),
        scratch=z(64),
        **keep,
    )


def _slot(turning: ReducedBody, mode: int) -> float:
    """Slot of the lumped mass or inertia that a mode after the crank's modes belongs to."""
    name = turning.interfaces[int(np.argmax(np.abs(turning.shapes[:, :, mode]).max(axis=1)))]
    slots = {"ring": numbers.SET_RING, "rotor": numbers.SET_DYNAMOMETER, "shaft": numbers.SET_PATH_MASS}
    return float(numbers.SET_BIG_END if name.startswith("rod[") else slots.get(name, at.NOT_LUMPED))


def _traits(
    engine: Engine, settings: Settings, body: ReducedBody, block: ReducedBody | None, guided: Sequence[int],
    arrays: dict[str, Array],
) -> Array:  # fmt: skip
    mains, ends = bearing_law(settings.bearings), bearing_law(settings.big_ends)
    row, damping = CRANKS[settings.crank], engine.damping
    traits = np.zeros(at.TRAITS)
    traits[at.CRANK_MASS] = body.mass
    traits[at.CRANK_CENTRE : at.CRANK_CENTRE + 3] = body.centre
    traits[at.TWISTS] = row.elastic and not row.bends
    traits[at.LOCKED] = not mains.carries
    traits[at.FITTED] = settings.damper == "fitted"
    stated = at.MODAL if damping.kind == "modal" else at.RAYLEIGH
    traits[at.DAMPING_KIND] = at.OWN_DAMPING if body.brings_damping else stated
    traits[at.DAMPING_A] = damping.ratio if damping.kind == "modal" else damping.alpha
    traits[at.DAMPING_B] = damping.beta
    traits[at.FREE_ENDS], traits[at.ROD_ALIKE] = ends.carries, not any(engine.articulations)
    traits[at.PATH_ROW], traits[at.END_SPEED] = arrays["path_row"][0], arrays["end_speed"][0]
    traits[at.ONE_SHAFT] = engine.drive_line_chain is None
    traits[at.LINE_INERTIA] = arrays["line_inertia"][0]
    traits[at.STATED_DAMPER] = engine.damper is not None and not engine.damper.frequencies
    traits[at.MAINS_FREE] = mains.any_clearance
    traits[at.ENDS_FREE] = ends.any_clearance
    if engine.piston_guidance is not None:
        guidance = engine.piston_guidance
        traits[at.GUIDED], traits[at.PISTONS] = 1.0, len(guided)
        traits[at.TILT_INERTIA], traits[at.PISTON_ARM] = guidance.tilt_inertia, guidance.mass_height
    traits[at.FIRST_PISTON] = arrays["gyroscopic"].shape[0] + (block.n_modes if block is not None else 0)
    if block is not None:
        traits[at.FLEXIBLE], traits[at.BLOCK_MASS] = 1.0, block.mass
        traits[at.BLOCK_CENTRE : at.BLOCK_CENTRE + 3] = block.centre
    return traits
