"""Topology of an engine file, and names of the outputs of all added bodies and connections."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import ReducedBody, rigid_body
from cranktrain.core.rigid_slices import inertia_tensor
from cranktrain.dynamics.topology.laws import connection_law, data_of, pieces_of
from cranktrain.dynamics.topology.values import (
    AT_REST,
    BLOCK,
    CRANK,
    GROUND,
    Body,
    Connection,
    End,
    Frame,
    Slider,
    Topology,
)
from cranktrain.engine.additions import BodyTable, FrameTable, check_cylinder, split_end
from cranktrain.engine.model import Engine

BODY_OUTPUTS = ("speed", "rotation", "position.x", "position.y", "position.z")
"""Outputs of an added body: speed, rotation relative to its frame, and displacement of the centre of mass."""


def whole_topology(
    engine: Engine,
    crank: ReducedBody,
    block: ReducedBody | None,
    bodies: Mapping[str, ReducedBody] | None = None,
    more: Topology | None = None,
) -> Topology:
    """Bodies and connections of an engine file, with ``more`` bodies and connections of a user's script.

    ``bodies`` are those that the engine file takes from separate files. ``InputError`` if parts do not fit together.
    """
    frames = file_frames(engine)
    empty, given = Topology(frames), bodies or {}
    own = tuple(
        Body(table.name, given.get(table.name) or _rigid(table, empty.frame(table.frame)), table.frame)
        for table in engine.additions.body
    )
    bare = Topology(frames, own)
    places = {CRANK: crank, BLOCK: block, **{body.name: body.reduced for body in own}}
    connections = []
    for table, connection in zip(engine.connections, _connections(engine), strict=True):
        ends = []
        for end in connection.ends:
            body = places.get(end.body)
            if table.place and body is not None and end.interface in body.interfaces:
                local = bare.end_frame(end).local(np.array(table.place))
                x, y, z = (local - body.positions[body.index(end.interface)]).tolist()
                end = replace(end, offset=(x, y, z))
            ends.append(end)
        connections.append(replace(connection, ends=tuple(ends)))
    topology = Topology(frames, own, tuple(connections)).plus(more or Topology())
    return replace(topology, connections=tuple(_with_rod(engine, one) for one in topology.connections))


def _with_rod(engine: Engine, connection: Connection) -> Connection:
    """Connection with the rod and piston of the engine's cylinder that it names, where it states none of its own."""
    if connection.law != "slider_crank":
        return connection
    data = data_of(connection)
    check_cylinder(f"connection '{connection.name}'", data.cylinder, engine.n_cylinders)
    if data.cylinder:
        rod, cylinders = engine.rods[data.cylinder - 1], engine.cylinders
        own = {"length": rod.length, "big_end_mass": rod.big_end_mass, "small_end_mass": rod.small_end_mass,
               "inertia": rod.inertia, "piston_mass": cylinders.piston_mass, "bore": cylinders.bore}  # fmt: skip
        data = replace(data, **{key: value for key, value in own.items() if getattr(data, key) == 0.0})
    return replace(connection, data=data)


def file_frames(engine: Engine) -> tuple[Frame, ...]:
    """Frames (moving axes of bodies) that an engine file defines."""
    return tuple(_frame(engine, table) for table in engine.additions.frame)


def _frame(engine: Engine, table: FrameTable) -> Frame:
    axis = table.axis[0], table.axis[1]
    if table.motion == "turning":
        return Frame(table.name, table.ratio, table.angle, axis)
    pin, length, bank, offset = (*table.pin,), table.length, table.bank, table.offset
    if table.cylinder:
        k, throw = table.cylinder - 1, engine.throws[table.cylinder - 1]
        angle = engine.crankshaft.throw_angles[engine.cylinders.pins[k] - 1]
        pin = -throw * math.sin(angle), throw * math.cos(angle)
        length, offset, bank = engine.rods[k].length, engine.offsets[k], engine.cylinders.bank_angles[k]
    slider = Slider((pin[0], pin[1]), length, bank, offset, table.motion == "piston", table.cylinder)
    return Frame(table.name, table.ratio, 0.0, axis, slider)


def _rigid(table: BodyTable, frame: Frame) -> ReducedBody:
    """Rigid body that a TOML table describes, in axes of its frame."""
    if table.made_of_files_or_elements:
        raise InputError(f"body '{table.name}' is made of finite elements or a file, not here; use assemble")
    places = np.array([table.x, table.y, table.z]).T
    turn = np.column_stack([frame.turned(axis) for axis in np.eye(3)])
    return rigid_body(
        table.name, table.mass, turn @ inertia_tensor(table.inertia) @ turn.T, frame.local(np.array(table.centre)),
        {name: frame.local(place) for name, place in zip(table.interfaces, places, strict=True)},
    )  # fmt: skip


def held_on_crank(engine: Engine, more: Topology | None = None) -> list[str]:
    """Interfaces of the crank that connections of engine file and script hold, in the order of their ports.

    ``InputError`` for a rigid gear, because its force on the crank is not known.
    """
    held = [(end.interface, one) for one in _connections(engine, more) for end in one.ends if end.body == CRANK]
    for _, one in held:
        if connection_law(one.law, one.name).relations is not None:
            raise InputError(
                f"connection '{one.name}': law '{one.law}' has no force, so that the loads on the crank are not known; "
                "take a gear_mesh or a coupling for cut loads, stress and fatigue"
            )
    return list(dict.fromkeys(interface for interface, _ in held))


def topology_outputs(engine: Engine, more: Topology | None = None) -> tuple[str, ...]:
    """Names of the outputs of added bodies, then of added connections, of engine file and script, in order."""
    topology = more or Topology()
    bodies = {table.name: table.frame for table in engine.additions.body}
    bodies |= {body.name: body.frame for body in topology.bodies}
    found = [f"{name}.{output}" for name in bodies for output in BODY_OUTPUTS]
    whole = replace(topology, frames=(*file_frames(engine), *topology.frames), bodies=(), connections=())
    of_body = {CRANK: CRANK, BLOCK: AT_REST, GROUND: AT_REST} | bodies
    for one in _connections(engine, more):
        pieces = pieces_of(one, *(whole.frame(of_body[end.body]) for end in one.ends))
        found += [f"connection[{one.name}].{name}" for piece in pieces for name, _, _ in piece.outputs]
    return tuple(found)


def _connections(engine: Engine, more: Topology | None = None) -> list[Connection]:
    """Connections of an engine file, with their ends at interfaces, then those of a script."""
    own = [
        Connection(table.name, table.law, tuple(End(*split_end(text)) for text in table.ends), table.data)
        for table in engine.connections
    ]
    return [*own, *(more.connections if more is not None else ())]
