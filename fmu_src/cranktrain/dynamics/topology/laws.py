"""Register of the force laws of connections: one row for each law, with its components of motion and its kernel.

A law is a kernel with the signature of :mod:`cranktrain.film.laws.films`, for up to four components of motion. A law
with more components, such as a spring of six axes, has several pieces. To add a law, write one file with kernel and
record, a class of data in :mod:`cranktrain.engine.connections`, and one row. Bearing laws of the register of films can
be used too.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from cranktrain.core.argument_checks import given_kind, given_number, given_numbers
from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots
from cranktrain.dynamics.topology.axial_joint import sliding_law
from cranktrain.dynamics.topology.bearings import (
    damper_pieces,
    film_pieces,
    joint_pieces,
    need_alike,
    roller_pieces,
    thrust_pieces,
)
from cranktrain.dynamics.topology.belt import BeltRecord, belt_law, strands
from cranktrain.dynamics.topology.coupling import coupling_law, coupling_record
from cranktrain.dynamics.topology.damper import damper_law
from cranktrain.dynamics.topology.gas import gas_law, gas_record
from cranktrain.dynamics.topology.gear_mesh import mesh_law, mesh_record
from cranktrain.dynamics.topology.liner import LinerRecord, liner_law
from cranktrain.dynamics.topology.own_law import own_pieces
from cranktrain.dynamics.topology.pieces import ANGLE, LENGTH, SAME, FilmParts, Piece, between, component, piece_along
from cranktrain.dynamics.topology.slider_crank import HEIGHT, SIDE, SPEED, slider_crank_law, slider_crank_record
from cranktrain.dynamics.topology.spring import LoadRecord, SpringRecord, load_law, spring_law
from cranktrain.dynamics.topology.terms import Direction, unit
from cranktrain.dynamics.topology.values import REST, Connection, Frame
from cranktrain.engine.connections import (
    Belt,
    Coupling,
    Film,
    Gas,
    GearMesh,
    Liner,
    Load,
    Own,
    Planetary,
    RigidGear,
    RingDamper,
    Roller,
    SliderCrank,
    SlidingJoint,
    Spring,
    Thrust,
    check_ends,
)
from cranktrain.engine.model import optional_fields
from cranktrain.engine.quantities import check_values, mm, need
from cranktrain.loads.piston_guidance import skirt_parameters


@dataclass(frozen=True)
class ConnectionLaw:
    """Force law of connections, one row of the register.

    Attributes
    ----------
    name, title : for users
    data : class of the data in a file
    pieces : ``pieces(data, first, second) -> list[Piece]`` between ends in two frames
    kernel : kernel of the law, None if the register of films has it
    turns : whether the law transmits rotation from one end to the other
    relations : instead of pieces, function that gives rows of coefficients of its ends' rotations (see
       :mod:`relations`), from data and frames of the ends
    """

    name: str
    title: str
    data: type
    pieces: Callable[[Any, Frame, Frame], list[Piece]] | None = field(default=None, repr=False)
    kernel: Any = None
    turns: bool = False
    relations: Callable[[Any, Sequence[Frame]], list[list[float]]] | None = field(default=None, repr=False)


CONNECTION_LAWS: dict[str, ConnectionLaw] = {}
LOAD_INPUTS = {"valvetrain.torque": slots.VALVE_GIVEN, "flywheel.axial_force": slots.AXIAL_GIVEN}
"""Slots of a stage's frame with the inputs that a load may take, by name."""


def register_connection(law: ConnectionLaw) -> None:
    """Add a force law of connections to the register."""
    CONNECTION_LAWS[law.name] = law


def connection_law(name: str, where: str) -> ConnectionLaw:
    """Row of a force law in the register, by name; ``InputError`` for an unknown law."""
    if name not in CONNECTION_LAWS:
        raise InputError(f"{where}: no law '{name}'; {nearest(name, list(CONNECTION_LAWS))}")
    return CONNECTION_LAWS[name]


def pieces_of(connection: Connection, *frames: Frame) -> list[Piece]:
    """Pieces of a connection between ends in two frames, none for a relation; ``InputError`` names the connection."""
    law, data, where = _read(connection)
    try:
        return [] if law.pieces is None else law.pieces(data, frames[0], frames[1])
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def relations_of(connection: Connection, frames: Sequence[Frame]) -> list[Array]:
    """Coefficients (e,), one for each end, of relations between rotations of a connection's ends; ``InputError``."""
    law, data, where = _read(connection)
    if law.relations is None:
        return []
    speeds = [frame.sense * frame.rate for frame in frames]
    try:
        found = [np.array(row) for row in law.relations(data, frames)]
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    for row in found:
        if abs(row @ speeds) > SAME * (np.abs(row) @ np.abs(speeds)):
            last = int(np.flatnonzero(row)[-1])
            ratio = -(row @ speeds - row[last] * speeds[last]) / row[last]
            raise InputError(
                f"{where}: its ends' frames have the ratios {', '.join(f'{speed:.6g}' for speed in speeds)}, which its "
                f"teeth do not allow; give the frame of end {last + 1} the ratio {ratio:.10g}"
            )
    return found


def data_of(connection: Connection) -> Any:
    """Data of a connection as an object of its law's class; ``InputError`` if data and law do not fit."""
    return _read(connection)[1]


def _read(connection: Connection) -> tuple[ConnectionLaw, Any, str]:
    """Law of a connection, its data, and its name for messages; ``InputError`` if law and data do not fit together."""
    where = f"connection '{connection.name}'"
    law, data = connection_law(connection.law, where), connection.data
    check_ends(law.name, len(connection.ends), where)
    return law, data if isinstance(data, law.data) else _stated(law, dict(data), where), where


def _stated(law: ConnectionLaw, given: dict[str, Any], where: str) -> Any:
    """Data of a law from keys and values (SI) of a script, checked like values of a file; ``InputError``."""
    known = [entry.name for entry in fields(law.data)]
    for key in given:
        if key not in known:
            raise InputError(f"{where}: law '{law.name}' has no '{key}'; {nearest(key, known)}")
    for key in known:
        if key not in given and key not in optional_fields(law.data):
            raise InputError(f"{where}: law '{law.name}' needs '{key}'; add it to the connection's data")
    kinds = get_type_hints(law.data)
    data = law.data(**{key: _as_field(kinds[key], value, f"{where}: {key}") for key, value in given.items()})
    check_values(data, where)
    return data


def _as_field(kind: Any, value: Any, where: str) -> Any:
    """Value of a script converted to the kind of a field; ``InputError`` for a value of another kind."""
    if kind is float:
        return given_number(value, where)
    if kind is int:
        number = given_number(value, where)
        if number != int(number):
            raise InputError(f"{where} is {number:g}; give a whole number")
        return int(number)
    if kind is str:
        given_kind(value, str, where, "give a name")
    if get_origin(kind) is tuple and get_args(kind)[0] is float:
        return given_numbers(value, -1, where)
    return value


def _centres(what: str, first: Frame, second: Frame) -> tuple[Array, float, tuple[float, float]]:
    """Direction (3,) from the first axis to the second, distance (m) and speeds over the crank's; ``InputError``."""
    apart = np.array([*second.axis, 0.0]) - np.array([*first.axis, 0.0])
    distance = float(np.linalg.norm(apart))
    speeds = first.sense * first.rate, second.sense * second.rate
    if distance < SAME or 0.0 in speeds:
        raise InputError(f"{what} two frames that turn, with axes apart; give the frames ratio and axis")
    return apart / distance, distance, speeds


def _mesh(mesh: GearMesh, first: Frame, second: Frame) -> list[Piece]:
    """Tangential, radial and axial motion of the first gear's pitch point relative to the second gear's pitch point."""
    towards, distance, speeds = _centres("gears need", first, second)
    if speeds[0] * speeds[1] > 0.0 and abs(speeds[0] - speeds[1]) < SAME:
        raise InputError("gears of frames that turn alike do not mesh; give one of them another ratio")
    # At the pitch point P the velocities of both frames are equal, ω₁ × (P − C₁) = ω₂ × (P − C₂).
    arm = -distance * speeds[1] / (speeds[0] - speeds[1])
    along = np.cross(unit(2), towards)
    arms = arm * towards, (arm - distance) * towards
    components = [
        (Direction(REST, way, np.cross(arms[0], way)), Direction(REST, way, np.cross(arms[1], way), -1.0))
        for way in (along, towards, unit(2))[: 3 if mesh.helix_angle else 2]
    ]
    names = ("force.tangential", "force.radial", "force.axial")[: len(components)]
    outputs = (*((name, "force", at) for at, name in enumerate(names)), ("deflection", "place", 0))
    record = mesh_record(mesh, speeds[0] * speeds[1] > 0.0)
    return [Piece(components, [LENGTH] * len(components), mesh_law, record, first, outputs=outputs)]


def _coupling(coupling: Coupling, first: Frame, second: Frame) -> list[Piece]:
    need_alike("a coupling joins bodies that turn alike", first, second)
    outputs = (("torque", "force", 0), ("twist", "place", 0), ("twist_rate", "velocity", 0))
    return [Piece([component(first, "rz")], [ANGLE], coupling_law, coupling_record(coupling), first, outputs=outputs)]


def _axes(values: Any, what: str) -> Array:
    found = np.array(values, dtype=float)
    if found.shape != (3,):
        raise InputError(f"{what} has {found.size} values; give three, along x, y and z")
    return found


def _spring(spring: Spring, first: Frame, second: Frame) -> list[Piece]:
    """Pieces of a spring along the engine's axes; for a piston along the axes of its cylinder."""
    pieces, frame = [], first if first.slider is not None and not first.swings else REST
    for turning, before in (("", ""), ("r", "turning_")):
        k, c = (_axes(getattr(spring, before + part), before + part) for part in ("stiffness", "damping"))
        held = np.flatnonzero((k != 0.0) | (c != 0.0)).tolist()
        if held:
            axes = [turning + "xyz"[way] for way in held]
            pieces.append(piece_along(frame, axes, spring_law, SpringRecord(k[held], c[held])))
    if not pieces:
        raise InputError("a spring needs stiffness or damping; give stiffness = [kx, ky, kz]")
    return pieces


def _load(load: Load, first: Frame, second: Frame) -> list[Piece]:
    pieces, slot = [], LOAD_INPUTS.get(load.input, -1)
    turning = np.array([load.order, load.phase, slot >= 0])
    for about, name, scale in (("", "force", LENGTH), ("r", "torque", ANGLE)):
        force = _axes(getattr(load, name), name)
        if force.any():
            outputs = tuple((f"{name}.{way}", "force", at) for at, way in enumerate("xyz"))
            axes, components = Frame("crank angle", 1.0), [component(REST, about + way) for way in "xyz"]
            record = LoadRecord(force, turning)
            pieces.append(Piece(components, [scale] * 3, load_law, record, axes, outputs=outputs, input=slot, holds=0))
    if not pieces:
        raise InputError("a load needs a force or a torque; give force = [Fx, Fy, Fz]")
    return pieces


def _need_piston(frame: Frame) -> None:
    if frame.slider is None or frame.swings:
        raise InputError(
            'the first end is a piston; give its body a frame with motion = "piston", or exchange the ends'
        )


def _gas(gas: Gas, piston: Frame, head: Frame) -> list[Piece]:
    _need_piston(piston)
    axes, outputs = Frame("crank angle", 1.0), (("force", "force", 0),)
    along = [component(piston, "y")]
    return [Piece(along, [LENGTH], gas_law, gas_record(gas), axes, outputs=outputs, cylinder=gas.cylinder, holds=0)]


def _liner(liner: Liner, piston: Frame, wall: Frame) -> list[Piece]:
    _need_piston(piston)
    heights = liner.upper_height, liner.lower_height
    components = [between(piston, unit(0), -height * unit(2)) for height in heights]
    components.append(component(piston, "y"))
    outputs = (
        ("force.upper", "force", 0), ("force.lower", "force", 1), ("friction", "force", 2), ("gap.upper", "place", 0),
        ("gap.lower", "place", 1), ("speed", "velocity", 2),
    )  # fmt: skip
    return [Piece(components, [LENGTH] * 3, liner_law, LinerRecord(skirt_parameters(liner)), outputs=outputs, holds=2)]


def _belt(belt: Belt, first: Frame, second: Frame) -> list[Piece]:
    """Piece of a belt: first the strand that runs onto the rotating first pulley, then the strand that leaves it."""
    towards, distance, speeds = _centres("a belt needs", first, second)
    radii, crossed = (belt.radius, belt.radius * abs(speeds[0] / speeds[1])), speeds[0] * speeds[1] < 0.0
    if sum(radii) >= distance:
        raise InputError(
            f"pulleys of {1e3 * radii[0]:.4g} and {1e3 * radii[1]:.4g} mm radius have no room on axes "
            f"{1e3 * distance:.4g} mm apart; give a smaller radius"
        )
    axes = np.column_stack((towards, np.cross(unit(2), towards), unit(2)))
    found = strands(distance, radii, crossed)
    components = [
        (Direction(REST, axes @ way, axes @ np.cross(on_first, way)),
         Direction(REST, axes @ way, axes @ np.cross(on_second, way), -1.0))
        for way, on_first, on_second in (found if speeds[0] > 0.0 else found[::-1])
    ]  # fmt: skip
    outputs = (("tension.running_on", "force", 0), ("tension.running_off", "force", 1))
    return [
        Piece(
            components,
            [LENGTH, LENGTH],
            belt_law,
            BeltRecord(np.array([belt.tension, belt.stiffness, belt.damping])),
            outputs=outputs,
        )
    ]


def _slider_crank(given: SliderCrank, pin: Frame, cylinder: Frame) -> list[Piece]:
    """Displacement of the pin in the frame of its crank."""
    if pin.rate == 0.0 or pin.swings or cylinder != REST:
        raise InputError("the first end is the pin of a crank, which turns, the second the cylinder, at rest")

    def record(_: Array, parts: FilmParts) -> Any:
        for key in ("length", "big_end_mass", "small_end_mass", "piston_mass", "bore")[: 5 if given.cylinder else 4]:
            need(
                "",
                key,
                getattr(given, key) > 0.0,
                "is missing; give it, or the cylinder whose rod and piston these are",
            )
        x, y = parts.first[:2]
        text = "the first one lies on the axis of its crank, where no piston would move; give an interface at a pin"
        need("", "ends", math.hypot(x, y) > SAME, text)
        reach = math.hypot(x, y) + abs(given.offset)
        text = f"{mm(given.length)} is no longer than throw and offset together, {mm(reach)}; give a longer rod"
        need("", "length", given.length > reach, text)
        return slider_crank_record(given, pin.sense, parts.first[:2])

    components = [component(pin, axis) for axis in "xy"]
    outputs = (
        ("force.x", "force", 0), ("force.y", "force", 1), ("piston.position", "out", HEIGHT),
        ("piston.velocity", "out", SPEED), ("force.side", "out", SIDE),
    )  # fmt: skip
    return [
        Piece(
            components, [LENGTH] * 2, slider_crank_law, record, pin, 0, True, outputs=outputs, cylinder=given.cylinder,
            has_mass=True, holds=0,
        )
    ]  # fmt: skip


def _rigid_gear(_: RigidGear, frames: Sequence[Frame]) -> list[list[float]]:
    speeds = [frame.sense * frame.rate for frame in frames]
    if 0.0 in speeds:
        raise InputError("gears need two frames that turn; give both a ratio")
    return [[speeds[1], -speeds[0]]]


def _planetary(gear: Planetary, frames: Sequence[Frame]) -> list[list[float]]:
    """Willis' equation of sun, ring and carrier, and with a fourth end the rolling of the planets."""
    turning = [frame for frame in frames if frame.rate > 0.0]
    for frame in turning:
        if math.dist(frame.axis, turning[0].axis) > SAME:
            x, y = (f"{1e3 * at:.6g}" for at in turning[0].axis)
            raise InputError(
                f"frame '{frame.name}' has another axis than frame '{turning[0].name}', but a planetary gear has one; "
                f"give it the axis {x}, {y} mm"
            )
    sun, ring = gear.teeth_sun, gear.teeth_ring
    planet = 0.5 * (ring - sun)
    if planet <= 0.0:
        raise InputError(f"a ring of {ring} teeth has no room for planets round a sun of {sun}; give it more")
    rows = [[sun, ring, -(sun + ring), 0.0][: len(frames)]]
    return rows if len(frames) < 4 else [*rows, [sun, 0.0, -(sun + planet), planet]]


for _row in (
    ConnectionLaw("gear_mesh", "teeth of two gears, with backlash", GearMesh, _mesh, mesh_law, turns=True),
    ConnectionLaw(
        "coupling", "spring, damper and friction about the axis", Coupling, _coupling, coupling_law, turns=True
    ),
    ConnectionLaw("spring", "springs and dampers along and about three axes", Spring, _spring, spring_law),
    ConnectionLaw("load", "force and torque, steady or harmonic", Load, _load, load_law),
    ConnectionLaw("film", "plain bearing, whose journal is the first end", Film, film_pieces),
    ConnectionLaw("roller", "cylindrical roller bearing, whose journal is the first end", Roller, roller_pieces),
    ConnectionLaw("thrust", "axial bearing, whose collar is the first end", Thrust, thrust_pieces),
    ConnectionLaw(
        "damper", "torsional damper's housing and its ring", RingDamper, damper_pieces, damper_law, turns=True
    ),
    ConnectionLaw(
        "axial_joint",
        "joint that carries torque, bolted or a spline that slides",
        SlidingJoint,
        joint_pieces,
        sliding_law,
        turns=True,
    ),
    ConnectionLaw("belt", "two strands on two pulleys, which pull only", Belt, _belt, belt_law, turns=True),
    ConnectionLaw("gas", "gas on a piston and its head", Gas, _gas, gas_law),
    ConnectionLaw("liner", "a piston's skirt in its liner, with friction", Liner, _liner, liner_law),
    ConnectionLaw("slider_crank", "rod and piston on a pin, with gas", SliderCrank, _slider_crank, slider_crank_law),
    ConnectionLaw("own", "a function of Python", Own, own_pieces),
    ConnectionLaw("rigid_gear", "two gears without give", RigidGear, turns=True, relations=_rigid_gear),
    ConnectionLaw(
        "planetary", "sun, ring, carrier and planets without give", Planetary, turns=True, relations=_planetary
    ),
):
    register_connection(_row)
