"""An engine, a reduced body and the chosen fidelity levels, as the plain values of which the running model is packed.

:mod:`cranktrain.dynamics.model.ports` lists the points and components of motion at which force laws act,
:func:`cranktrain.dynamics.model.pack.pack` makes the arrays.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.model import lump_slots as of
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.bodies import (
    block_arrays,
    locked_on_axis,
    stationary_body,
    with_axial_mass,
    with_big_ends,
    with_modes_of,
    with_rotor,
)
from cranktrain.dynamics.model.choices import run_numbers
from cranktrain.dynamics.model.hysteresis import hysteresis_rows, viscous_rows
from cranktrain.dynamics.model.lumps import lumps
from cranktrain.dynamics.model.mains import main_bearings
from cranktrain.dynamics.model.pack import Cranktrain, pack
from cranktrain.dynamics.model.ports import big_end_films, laws_of, lay_ports
from cranktrain.dynamics.model.preparation import prepare_model
from cranktrain.dynamics.model.records import Basis, ModelArrays
from cranktrain.dynamics.model.settings import BOUNDARIES, Settings, check_levels, keeps_peaks, resolved
from cranktrain.dynamics.model.wound_line import wind_train
from cranktrain.dynamics.time.integrators import INTEGRATORS, method_arrays
from cranktrain.dynamics.time.status import OK, REFUSALS
from cranktrain.dynamics.topology.arrays import on_ground
from cranktrain.dynamics.topology.pieces import REFERENCE_VISCOSITY, FilmParts
from cranktrain.dynamics.topology.relations import Group, JoinedCrank, drive_train, joined_crank
from cranktrain.dynamics.topology.slider_crank import own_rods
from cranktrain.dynamics.topology.tables import whole_topology
from cranktrain.dynamics.topology.values import CRANK, Topology
from cranktrain.engine.additions import split_end
from cranktrain.engine.articulated_rod import dead_centre_heights
from cranktrain.engine.lubricant import oil_constants, oil_temperature, pressure_constants, viscosity
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import AxialPath
from cranktrain.film.laws.bearings import thrust_bearing
from cranktrain.film.laws.register import bearing_law
from cranktrain.loads.articulated_rod import JOINT, joint_values
from cranktrain.loads.built_in_trace import KINKS, SAMPLES, TRACE_ROWS, fill_kinks
from cranktrain.loads.damper import (
    DAMPER_CONSTANTS,
    PARAMETERS,
    check_temperature,
    damper_constants,
    damper_temperature,
    required_damper,
)
from cranktrain.loads.gas_pressure import GasTrace, gas_tables, trace_constants
from cranktrain.loads.rod_masses import rod_masses
from cranktrain.loads.slider_crank import remainder_inertia
from cranktrain.loads.torsional_line import LEADING, TorsionalLine, torsional_line, windup_shares, windup_stiffness

if TYPE_CHECKING:
    from cranktrain.film.elastic.bore_compliance import BoreCompliance
    from cranktrain.film.table.database import FilmTable


def basis(engine: Engine, settings: Settings, gas: GasTrace) -> Basis:
    """Gather the constants of an engine; ``settings`` are resolved."""
    fitted = settings.damper == "fitted"
    damper = required_damper(engine) if fitted else None
    mains = bearing_law(settings.bearings).carries and not engine.rollers_only
    cylinders = engine.cylinders
    methods, tables = method_arrays(settings.integrator)
    lost = [not keeps_peaks(name, settings, engine) for name in INTEGRATORS]
    return Basis(
        oil_constants(engine.oil),
        np.array(engine.oil.temperature_speeds, dtype=float),
        np.array(engine.oil.temperatures, dtype=float),
        np.array([mains, engine.big_end_bearing is not None], dtype=float),
        np.zeros(DAMPER_CONSTANTS) if damper is None else damper_constants(damper),
        np.zeros(1) if damper is None else np.array(damper.temperature_speeds, dtype=float),
        np.zeros(1) if damper is None else np.array(damper.temperatures, dtype=float),
        np.array([cylinders.bore, cylinders.compression_ratio, settings.block == "flexible"], dtype=float),
        trace_constants(engine, gas.built_in),
        np.zeros((TRACE_ROWS, SAMPLES)),
        np.column_stack([methods, lost]),
        tables,
    )


def structural_damping(engine: Engine, body: ReducedBody) -> Array:
    """Damping of each mode, (n,) 1/s: the body's own damping, or else the engine file's for elastic modes.

    Damping in the engine file is meant for the crank with its rods. The mean mass of the rods on the pins raises the
    mass of a mode with stiffness ω² from 1 to m. Its damping is c = 2ζ √(ω² m), where ζ is the damping ratio at the
    frequency with rods, or c = α m + β ω². Shafts of a table have rows of their own for damping (:mod:`.hysteresis`).
    """
    if body.brings_damping:
        return body.damping if body.damping.size else np.zeros(body.n_modes)
    d, squares = engine.damping, body.omega**2
    mass = 1.0 + np.diag(rod_masses(engine, body))
    if d.kind == "modal":
        return np.asarray(2.0 * d.ratio * np.sqrt(squares * mass))
    return np.asarray(np.where(squares > 0.0, d.alpha * mass + d.beta * squares, 0.0))


class Parts(NamedTuple):
    """Input of a model other than engine, crankshaft and settings; each part is needed by one fidelity level."""

    table: FilmTable | None = None  # films of the main bearings, level ``table``
    bore: BoreCompliance | None = None  # elastic main bores, level ``ehd``
    big_end_table: FilmTable | None = None  # films of the big ends, level ``table``
    block: ReducedBody | None = None  # the block, level ``flexible``
    topology: Topology | None = None  # bodies and connections added to those of the engine file
    bodies: Mapping[str, ReducedBody] | None = None  # bodies that the engine file takes from separate files
    film_tables: tuple[FilmTable, ...] = ()  # films of added bearings, level ``table``
    big_end_bore: BoreCompliance | None = None  # elastic eyes of the rods, level ``ehd`` of the big ends
    data: Mapping[str, float] | None = None  # lumped values that replace the engine's, see .lumped_data


def build_model(
    engine: Engine,
    body: ReducedBody,
    settings: Settings,
    speed: float,
    gas: GasTrace,
    parts: Parts | None = None,
    temperatures: Array | None = None,
) -> ModelArrays:
    """Arrays of the running model at the oil temperature of ``speed`` (rad/s).

    ``body`` is the crankshaft with flywheel and pulley attached, and with the damper's housing where there is one.
    ``temperatures`` (b,), K, are those of the main bearings' films. The default, which also holds for thrust bearing
    and big ends, is the temperature of the engine's oil.
    ``InputError`` for a level that does not exist, or whose part is missing.
    """
    settings, parts = resolved(settings, engine), parts or Parts()
    model = structure(engine, body, settings, gas, parts)
    count = len(engine.crankshaft.main_widths)
    if temperatures is not None and np.shape(temperatures) != (count,):
        raise InputError(f"film temperatures of the form {np.shape(temperatures)}; give one for each of {count} mains")
    given = np.zeros(count) if temperatures is None else np.array(temperatures, dtype=float)
    _check_temperatures(engine, settings, speed, () if temperatures is None else given.tolist())
    status = prepare_model(model, run_numbers(settings, engine, parts.data), given, speed)
    if status != OK:
        raise InputError(REFUSALS[status])
    return model


def _check_temperatures(engine: Engine, settings: Settings, speed: float, films: Sequence[float]) -> None:
    """Raise ``InputError`` for temperatures (K) at which the laws of oil or damper are not valid."""
    supplied = viscosity(engine.oil, supply_temperature(engine, settings, speed))
    if bearing_law(settings.bearings).carries and not engine.rollers_only:
        etas = [viscosity(engine.oil, own) for own in films] or [supplied]
        if bearing_law(settings.bearings).oil:
            for eta in etas:
                pressure_constants(engine.oil, eta)
    if bearing_law(settings.big_ends).oil:
        pressure_constants(engine.oil, supplied)
    if settings.damper == "fitted":
        damper = required_damper(engine)
        check_temperature(damper, settings.damper_temperature or damper_temperature(damper, speed))


def structure(
    engine: Engine, body: ReducedBody, settings: Settings, gas: GasTrace, parts: Parts,
    films_made: dict[Any, Any] | None = None,
) -> ModelArrays:  # fmt: skip
    """Arrays of the running model that follow from fidelity levels, bodies and the engine's constants.

    ``settings`` are resolved; only their levels count. The arrays do not depend on parameters, temperatures or speed:
    :func:`cranktrain.dynamics.model.preparation.prepare_model` writes all such values before any use.
    ``films_made`` holds bearings made earlier for the same engine and parts. Models that share it share these bearings
    and the memory of their films, so they may be inspected, but not run.
    ``InputError`` for a level that does not exist, or whose part is missing.
    """
    model = pack(*read_engine(engine, body, settings, gas, parts, {} if films_made is None else films_made))
    if not engine.line_on_crank:
        wind_train(model)
    return model


def read_engine(
    engine: Engine, body: ReducedBody, settings: Settings, gas: GasTrace, parts: Parts, made: dict[Any, Any]
) -> tuple[Topology, Cranktrain]:
    """Bodies and connections added to an engine, and all of the engine itself, as plain values for :func:`.pack`.

    Parameters and errors as of :func:`structure`.
    """
    check_levels(settings, engine)
    law, big_end_law = bearing_law(settings.bearings), bearing_law(settings.big_ends)
    block = parts.block if settings.block == "flexible" else None
    if settings.block == "flexible" and block is None:
        raise InputError("block level 'flexible' needs the reduced block; make it by structure.block")
    if block is not None:
        # Bearings without the block's compliance, which the block has itself.
        rigid = engine.main_bearing.in_rigid_bores if engine.main_bearing is not None else None
        engine = replace(engine, main_bearing=rigid, thrust=replace(engine.thrust, block_stiffness=math.inf))
    key = "mains", settings.bearings, settings.block
    if key not in made:
        made[key] = main_bearings(engine, settings.bearings, parts.table, parts.bore)
    journals, mains, main_films = made[key]
    key = "big ends", settings.big_ends, ""
    if key not in made:
        made[key] = big_end_films(engine, big_end_law, parts.big_end_table, parts.big_end_bore)
    big_ends, floating = made[key]
    line = torsional_line(engine)
    turning = _turning_body(engine, body, settings, line)
    topology = whole_topology(engine, turning, block, parts.bodies, parts.topology)
    there = topology if block is not None else on_ground(topology)
    geared, joined = _geared_crank(engine, body, settings, there), dict[str, Array]()
    if geared is not None:
        body, turning = geared.body, _turning_body(engine, geared.body, settings, line)
        joined = geared.parts
    train = drive_train(there, joined, split_end(engine.drive_line.start)[0])
    turning, joined, train_damping = _with_train(turning, joined, train)
    path = engine.axial_path if "shaft" in turning.interfaces else None
    drive_line, windup = _line_arrays(engine, turning, line, path, _line_start(engine, turning, topology, joined))
    # A piston that is an added body is not one of the engine's own pistons.
    own = [k for k in range(engine.n_cylinders) if k + 1 not in topology.cylinders]
    guided = own if settings.pistons == "guided" else []
    stationary = stationary_body(engine, block, guided)
    ports = lay_ports(engine, turning, body.n_modes, journals, windup, block, guided)
    shapes, contiguous = turning.shapes, np.ascontiguousarray
    flywheel, pulley = shapes[turning.index("flywheel")], shapes[turning.index("pulley")]
    tilted = [turning.index(f"main[{i + 1}]") for i in range(len(mains))]
    thrust = thrust_bearing(engine.thrust, REFERENCE_VISCOSITY, law.clearance, journals.collar)
    damper, damping = np.zeros(PARAMETERS), structural_damping(engine, turning)
    standing_ratio = engine.block.damping_ratio if engine.block is not None else 0.0
    damping[turning.n_modes - train_damping.size :] = train_damping
    trace = gas_tables(gas)
    least_smooth = np.zeros(KINKS)
    # If cylinders differ, the kinks of their mean trace count.
    fill_kinks(trace if len(trace) == 2 else trace.reshape(-1, 2, *trace.shape[1:]).mean(axis=0), least_smooth)
    scalars = _scalars(engine, settings, gas, line, float(pulley[5, 5]))
    standing = block_arrays(engine, stationary, block)
    pins = np.ascontiguousarray(turning.positions[[turning.index(f"pin[{pin}]") for pin in engine.cylinders.pins], :2])
    parameters = cylinder_parameters(engine, big_end_law.carries, topology.cylinders)
    cylinders = np.hstack((parameters, ports.cylinders))
    rods = own_rods(cylinders, pins, standing.liners, standing.guidance)
    known = {
        of.PATH_ROW: -1.0 if path is None else len(line.laws), of.END_SPEED: line.end_speed,
        of.LINE_INERTIA: scalars[at.LINE_INERTIA], of.PISTONS: len(guided), of.GEARED: geared is not None,
    }  # fmt: skip
    return topology, Cranktrain(
        turning=turning,
        joined=joined,
        block=block,
        stationary=stationary,
        damping=np.concatenate((damping, 2.0 * standing_ratio * stationary.omega)),
        ports=(ports.turning, ports.block),
        laws=laws_of(ports, main_films, floating, rods, thrust, path, damper),
        film_parts=FilmParts(
            (*parts.film_tables, *(() if parts.table is None else (parts.table,))),
            engine.main_bearing,
            parts.bore,
            engine.big_end_bearing,
            parts.big_end_bore,
            engine.oil,
        ),
        arrays={
            "bearings": mains,
            "big_ends": big_ends,
            "pins": pins,
            "tilts": contiguous(shapes[tilted, 3:5].reshape(-1, turning.n_modes)),
            "ends": contiguous(np.array([flywheel[5], pulley[5], pulley[2], flywheel[2]])),
            "axis_weights": np.zeros(len(tilted)),
            "cylinders": cylinders,
            "gas": trace,
            "kinks": least_smooth,
            "damper": damper,
            "scalars": scalars,
            "basis": basis(engine, settings, gas),
            "lumps": lumps(engine, settings, body, turning, block, standing, damping, known),
            "block": standing,
            **ports.arrays,
            **drive_line,
        },
    )


def _geared_crank(engine: Engine, body: ReducedBody, settings: Settings, topology: Topology) -> JoinedCrank | None:
    """Crankshaft in the modes that it has in common with bodies on rigid gears; None without such bodies."""
    if not bearing_law(settings.bearings).carries:
        body = locked_on_axis(body)
    return joined_crank(topology, body, structural_damping(engine, body))


def common_crank(engine: Engine, body: ReducedBody, settings: Settings, parts: Parts) -> ReducedBody:
    """Crankshaft in the modes of the running model: those in common with bodies on rigid gears, or its own."""
    block = parts.block if settings.block == "flexible" else None
    topology = whole_topology(engine, body, block, parts.bodies, parts.topology)
    geared = _geared_crank(engine, body, settings, topology if block is not None else on_ground(topology))
    return body if geared is None else geared.body


def _turning_body(engine: Engine, body: ReducedBody, settings: Settings, line: TorsionalLine) -> ReducedBody:
    """Crankshaft ``body`` with all other rotating bodies: big ends, damper's ring, drive line, dynamometer's rotor."""
    if not bearing_law(settings.bearings).carries:
        body = locked_on_axis(body)
    if bearing_law(settings.big_ends).carries:
        body = with_big_ends(body, engine)
    if settings.damper == "fitted":
        body = with_rotor(body, "ring", "pulley", required_damper(engine).ring_inertia)
    for name, inertia, speed in zip(line.interfaces, line.inertia.tolist(), line.speeds.tolist(), strict=True):
        body = with_rotor(body, name, "flywheel", inertia, speed)
    if engine.axial_path is not None and body.shapes[body.index("flywheel"), 2].any():
        body = with_axial_mass(body, "shaft", "flywheel", engine.axial_path.mass)
    if not BOUNDARIES[settings.boundary]:
        body = with_rotor(body, "rotor", "flywheel", engine.drive_line.dynamometer_inertia, line.end_speed)
    return body


def _with_train(
    turning: ReducedBody, joined: Mapping[str, Array], train: Sequence[Group]
) -> tuple[ReducedBody, dict[str, Array], Array]:
    """Rotating bodies with the modes of the bodies of the drive ``train`` after their own.

    Also the modal coordinates (n, n_t) of all bodies with modes in common with the crank, by name, and the damping of
    the train's modes, 1/s.
    """
    first = turning.n_modes
    for group in train:
        turning = with_modes_of(turning, group.omega)
    widths = {name: (0, part) for name, part in joined.items()}
    for group in train:
        for body, part in zip(group.bodies, group.parts or [np.eye(group.omega.size)], strict=True):
            widths[body.name] = first, part
        first += group.omega.size
    found = {
        name: np.pad(part, ((0, 0), (at_mode, turning.n_modes - at_mode - part.shape[1])))
        for name, (at_mode, part) in widths.items()
    }
    return turning, found, np.concatenate([np.zeros(0), *(group.damping for group in train)])


def _line_start(engine: Engine, turning: ReducedBody, topology: Topology, joined: Mapping[str, Array]) -> Array:
    """Rotation (n_t,) about the crank's axis of the interface where the drive line begins, relative to its frame."""
    name, interface = split_end(engine.drive_line.start)
    body = turning if name == CRANK else topology.body(name).reduced
    if interface not in body.interfaces:
        raise InputError(
            f"drive_line.start: body '{name}' has no interface '{interface}'; {nearest(interface, body.interfaces)}"
        )
    shape = body.shapes[body.index(interface), 5]
    return np.asarray(shape if name == CRANK else shape @ joined[name])


def _line_arrays(
    engine: Engine, turning: ReducedBody, line: TorsionalLine, path: AxialPath | None, start: Array
) -> tuple[dict[str, Array], Array]:
    """Arrays ``shafts``, ``shaft_laws``, ``lag``, ``rotor`` of the drive line in the rotating modes, and its wind-up.

    ``shafts`` has one more row for the axial support of the connecting shaft. The rows after it are dampers: viscous
    shafts of the crank, and those that replace loss factors. The wind-up (n,) at the flywheel, rad, is that of one
    shaft with the stiffness of all shafts that the flywheel drives. ``start`` (n,) is the rotation where it begins.
    """

    def turned(name: str) -> Array:
        return turning.shapes[turning.index(name), 5] if name in turning.interfaces else np.zeros(turning.n_modes)

    rows = np.stack([start, *(turned(name) for name in (*line.interfaces, "rotor"))])
    # A rotor has a mode to itself, so its modal amplitude is its rotation over its shape.
    still = dict(zip((*line.interfaces, "rotor"), (*(line.speeds - line.follow), line.end_speed), strict=True))
    lag = np.zeros(turning.n_modes)
    for name, fallen in still.items():
        shape = turned(name)
        lag[shape != 0.0] = fallen / shape[shape != 0.0]
    shafts, laws = line.twists @ rows, line.laws
    windup = windup_shares(line) @ shafts
    if path is not None:
        shafts = np.vstack((shafts, turning.shapes[turning.index("shaft"), 2]))
        laws = np.vstack((laws, [path.stiffness, path.damping, 0.0, 0.0]))
    damping = viscous_rows(turning), hysteresis_rows(engine, turning, line, shafts[: len(line.laws)])
    shafts = np.vstack((shafts, *(own for own, _ in damping)))
    laws = np.vstack((laws, *(own for _, own in damping)))
    arrays = {
        "shafts": np.ascontiguousarray(shafts),
        "shaft_laws": laws,
        "lag": lag,
        "rotor": np.ascontiguousarray(rows[-1]),
    }
    return arrays, windup


def _scalars(engine: Engine, settings: Settings, gas: GasTrace, line: TorsionalLine, rotation: float) -> Array:
    """Constant scalars of the model; ``rotation`` is that of the crank per unit amplitude of its rigid mode."""
    filtered = engine.drive_line.speed_filter_time
    scalars = np.zeros(at.SCALARS)
    scalars[at.BEST_SPEED] = gas.best_speed
    scalars[at.FALLOFF] = gas.falloff
    scalars[at.SHAFT_K] = line.stiffness
    scalars[at.SHAFT_C] = line.damping
    scalars[at.FILTER] = 1.0 / filtered if filtered > 0.0 else 0.0
    scalars[at.RIGID_ROTATION] = rotation
    scalars[at.DRIVEN] = BOUNDARIES[settings.boundary]
    scalars[at.WINDUP_K] = windup_stiffness(line)
    scalars[at.WINDUP_LEAD] = scalars[at.DRIVEN] * float(windup_shares(line) @ line.laws[:, LEADING])
    scalars[at.LINE_INERTIA] = line.inertia_at_crank + engine.drive_line.dynamometer_inertia * line.end_speed**2
    return scalars


def supply_temperature(engine: Engine, settings: Settings, speed: float) -> float:
    """Temperature (K) of the engine's oil at ``speed`` (rad/s): of all films, or of the oil supply if films heat up."""
    return settings.oil_temperature or oil_temperature(engine.oil, speed)


def pin_positions(engine: Engine, cylinder: int) -> tuple[float, float]:
    """Highest and lowest position of a piston's pin above the crank axis, m, where rod and throw are in line.

    For an articulated rod both follow from the exact path of its pin. ``cylinder`` counts from 0.
    """
    if engine.articulations[cylinder] is not None:
        highest, lowest = dead_centre_heights(engine, cylinder).tolist()
        return highest, lowest
    rod, throw, e = engine.rod.length, engine.throws[cylinder], engine.offsets[cylinder]
    return math.sqrt((rod + throw) ** 2 - e * e), math.sqrt((rod - throw) ** 2 - e * e)


def cylinder_parameters(engine: Engine, free_big_ends: bool, added: Collection[int] = ()) -> Array:
    """Parameters of rods, pistons and phases, (c, PARAMETERS), without piston area and clearance volume.

    The mass of a free big end is 0 here because it is a body of its own. Rod and piston of ``added`` cylinders are
    added bodies; ``InputError`` for such a cylinder that the engine lacks, or if big ends have films.
    """
    for number in added:
        where = f"rod of cylinder {number} is an added body"
        if free_big_ends:
            raise InputError(f"{where}, whose big end has a film of its own; leave the level of big ends 'rigid'")
        if not 1 <= number <= engine.n_cylinders:
            raise InputError(f"{where}: the engine has {engine.n_cylinders} cylinders; take one of these")
    cylinders, rods = engine.cylinders, engine.rods
    joint_of = [joint and (joint.master, *joint_values(joint).tolist()) for joint in engine.articulations]
    offsets, ends = engine.offsets, [pin_positions(engine, k) for k in range(engine.n_cylinders)]
    rows = [
        [
            rods[k].small_end_mass,
            cylinders.bank_angles[k],
            engine.firing_angles[k],
            0.0,
            rods[k].length,
            0.0 if free_big_ends else rods[k].big_end_mass,
            rods[k].small_end_mass + cylinders.piston_mass,
            remainder_inertia(rods[k]),
            offsets[k],
            0.0,
            ends[k][0],
            math.cos(cylinders.bank_angles[k]),
            math.sin(cylinders.bank_angles[k]),
            1.0,
            ends[k][0] - ends[k][1],
            *(joint_of[k] or (at.NO_PORT, *JOINT * (0.0,))),
        ]
        for k in range(engine.n_cylinders)
    ]
    result = np.array(rows, dtype=np.float64)
    for number in added:
        result[number - 1, [at.M_SMALL, at.M_BIG, at.M_OSC, at.DELTA_J, at.OWN_ROD]] = 0.0
    return result
