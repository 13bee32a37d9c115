"""Constants from which the arrays of a model are remade when lumped data of the engine change.

The constants belong to the model with the engine file's values; :mod:`cranktrain.dynamics.model.trimming` makes the
arrays of other values from them. Only the scratch arrays are ever written to.
"""

from collections.abc import Mapping

import numpy as np

from cranktrain.core.reduced_body import Array, ReducedBody, rigid_coordinates, turning_stiffness, with_rigid_rows
from cranktrain.core.rigid_slices import Slices, fields, rigid_motion
from cranktrain.dynamics.model import lump_slots as at
from cranktrain.dynamics.model import numbers
from cranktrain.dynamics.model.lumped_data import lumped_numbers
from cranktrain.dynamics.model.records import DIRECTIONS, BlockArrays, Lumps, no_lumps
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.levels import CRANKS
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import bearing_law
from cranktrain.loads.rod_masses import mean_rod_masses


def lumps(
    engine: Engine, settings: Settings, body: ReducedBody, turning: ReducedBody, block: ReducedBody | None,
    stationary: BlockArrays, damping: Array, known: Mapping[int, float],
) -> Lumps:  # fmt: skip
    """Gather the constants of a model, apart from the arrays that :func:`~cranktrain.dynamics.model.pack.pack` copies.

    Parameters
    ----------
    settings : resolved
    body : the crank
    turning : all rotating bodies as one
    stationary : arrays of block and pistons
    damping : (t,) of the rotating modes, 1/s
    known : traits of drive line and pistons, by slot
    """
    r, t, z = body.n_modes, turning.n_modes, np.zeros
    values = lumped_numbers(engine)
    rows = [body.index("flywheel"), body.index("pulley")]
    count = len(engine.crankshaft.main_widths) if bearing_law(settings.bearings).carries else 0
    mains = [turning.index(f"main[{i + 1}]") for i in range(count)]
    plain = z(count)
    plain[[i for i in engine.plain_numbers if i < count]] = 1.0
    mounts = stationary.mounts.shape[0]
    motion = z((mounts, DIRECTIONS))
    if block is not None:
        motion = np.ascontiguousarray(stationary.mounts[:, :DIRECTIONS] @ np.linalg.inv(rigid_coordinates(block)))
    grown = np.full(t, at.NOT_LUMPED)
    for mode in range(r, t):
        grown[mode] = _slot(turning, mode)
    fixed = np.zeros((2, at.COORDINATES, r))
    rigid, matrices = rigid_coordinates(body), np.zeros((at.CHANGING, r, r))
    fixed[:, :6, :6], fixed[:, 6:, 6:] = rigid, body.shapes[rows, :, 6:]
    own = turning.gyroscopic, turning.centrifugal, turning.stress_stiffness
    matrices[: at.MOVING] = np.eye(r), *(matrix[:r, :r] for matrix in own)
    corrected = turning_stiffness(turning) + turning.centrifugal - turning.stress_stiffness
    if not known[at.GEARED]:  # the masses of a crank in common modes do not change
        about_origin = np.linalg.solve(rigid.T, corrected[:6, :r])
        matrices[at.MOVING, :6] = rigid[:3].T @ about_origin[:3]
        matrices[at.TILTING, :6, :6] = rigid[3:5].T @ about_origin[3:5, :6]
    units, unit_loads = unit_parts(body.positions[rows])
    return no_lumps()._replace(
        values=values,
        traits=_traits(engine, settings, body, turning, block, known),
        fixed=fixed,
        units=units,
        unit_loads=unit_loads,
        places=np.ascontiguousarray(body.positions[rows]),
        mains=np.ascontiguousarray(turning.positions[mains, 2]),
        plain=plain,
        omega2=turning.omega**2,
        damping=damping.copy(),
        rod_masses=np.array(mean_rod_masses(engine)),
        matrices=matrices,
        loads=np.vstack((turning.centrifugal_load, turning.euler_load, turning.translation)),
        grown=grown,
        mount_motion=motion,
        room=z((at.ROOMS, r, r)),
        vectors=z((at.VECTOR_ROWS, t)),
    )


def unit_parts(places: Array) -> tuple[Array, Array]:
    """Terms of parts with unit moments at two ``places`` (2, 3), in the coordinates of modes there.

    Matrices (2 MOMENTS, CHANGING, COORDINATES, COORDINATES) and loads (2 MOMENTS, LOADS, COORDINATES).
    """
    moments = np.zeros((at.MOMENTS, 4, 4))
    moments[at.OF_MASS, 0, 0] = moments[at.OF_FIRST, 0, 3] = moments[at.OF_FIRST, 3, 0] = 1.0
    moments[at.OF_ACROSS, 1, 1] = moments[at.OF_ACROSS, 2, 2] = moments[at.OF_ALONG, 3, 3] = 1.0
    matrices, loads = [], []
    for place in places[:, None]:
        motion = np.concatenate((rigid_motion(place), np.eye(6)[None]), axis=2)
        for unit in moments[:, None]:
            part = Slices(place, unit)
            own, field = part.terms(motion), fields(motion)
            stress = with_rigid_rows(own.stress_stiffness, own.centrifugal, np.eye(6), own.turned_load)
            moving, tilting = np.zeros((2, *stress.shape))
            moving[:3], tilting[3:5, 5] = -stress[:3], -stress[3:5, 5]
            matrices.append((part.paired(field, field), own.gyroscopic, own.centrifugal, stress, moving, tilting))
            loads.append(np.vstack((own.centrifugal_load, own.euler_load, own.translation)))
    return np.array(matrices), np.array(loads)


def _slot(turning: ReducedBody, mode: int) -> float:
    """Slot of the lumped mass or inertia that a mode after the crank's modes belongs to."""
    name = turning.interfaces[int(np.argmax(np.abs(turning.shapes[:, :, mode]).max(axis=1)))]
    slots = {"ring": numbers.SET_RING, "rotor": numbers.SET_DYNAMOMETER, "shaft": numbers.SET_PATH_MASS}
    return float(numbers.SET_BIG_END if name.startswith("rod[") else slots.get(name, at.NOT_LUMPED))


def _traits(
    engine: Engine, settings: Settings, body: ReducedBody, turning: ReducedBody, block: ReducedBody | None,
    known: Mapping[int, float],
) -> Array:  # fmt: skip
    mains, ends = bearing_law(settings.bearings), bearing_law(settings.big_ends)
    row, damping = CRANKS[settings.crank], engine.damping
    traits = np.zeros(at.TRAITS)
    traits[list(known)] = list(known.values())
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
    traits[at.ONE_SHAFT] = engine.drive_line_chain is None
    traits[at.STATED_DAMPER] = engine.damper is not None and not engine.damper.frequencies
    traits[at.MAINS_FREE] = mains.any_clearance
    traits[at.ENDS_FREE] = ends.any_clearance
    if engine.piston_guidance is not None:
        guidance = engine.piston_guidance
        traits[at.GUIDED] = 1.0
        traits[at.TILT_INERTIA], traits[at.PISTON_ARM] = guidance.tilt_inertia, guidance.mass_height
    traits[at.FIRST_PISTON] = turning.n_modes + (block.n_modes if block is not None else 0)
    if block is not None:
        traits[at.FLEXIBLE], traits[at.BLOCK_MASS] = 1.0, block.mass
        traits[at.BLOCK_CENTRE : at.BLOCK_CENTRE + 3] = block.centre
    return traits
