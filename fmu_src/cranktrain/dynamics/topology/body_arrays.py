"""Arrays of added bodies: matrices and shapes one after the other, with bodies of a group in common modes."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from cranktrain.core.memory import zeros
from cranktrain.core.reduced_body import Array, ReducedBody, rigid_coordinates, turning_stiffness
from cranktrain.core.rigid_slices import skew
from cranktrain.dynamics.topology import slots as at
from cranktrain.dynamics.topology.laws import connection_law
from cranktrain.dynamics.topology.records import Base, Bodies, FrameNumbers
from cranktrain.dynamics.topology.relations import Group
from cranktrain.dynamics.topology.terms import PORTS
from cranktrain.dynamics.topology.values import CRANK, GROUND, Body, Frame, Topology

AROUND = np.linspace(0.0, 4.0 * np.pi, 97)[:-1]
"""Crank angles (rad) of a cycle at which the motion of frames is sampled."""
RIGID = 6
"""Number of rigid modes of a body."""
CRANKS_GROUP = -1
"""Mark of the crank's group, until the tables of all bodies are joined."""


class _Body(NamedTuple):
    """Matrices, loads and shapes of a body in the modes of its group."""

    gyroscopic: Array
    spin: Array
    centrifugal_load: Array
    euler_load: Array
    translation: Array
    turn: Array
    carried: Array
    shapes: Array  # (6 p, n) of the held interfaces, and the rotation of an elastic body as a whole


def turns_whole(body: ReducedBody, held: int) -> bool:
    """True if a body's rotation as a whole is a port, as for elastic bodies, which a moment at one port would bend."""
    return held > 0 and body.n_modes > PORTS


def _ports(body: Body, held: Mapping[str, Mapping[str, None]]) -> int:
    """Number of ports of an added body."""
    names = held.get(body.name, {})
    return PORTS * len(names) + turns_whole(body.reduced, len(names))


def _in_modes(
    body: Body, frame: Frame, held: Sequence[str], block: ReducedBody | None, part: Array | None, tied: bool
) -> _Body:
    """A body in the modes of its group; ``part`` (n, z) are the body's modal coordinates in the group's, or None."""
    reduced, n = body.reduced, body.reduced.n_modes
    turn = np.zeros(n)
    turn[:PORTS] = rigid_coordinates(reduced)[5]
    shapes = [reduced.shapes[reduced.index(name)] for name in held]
    own = _Body(
        reduced.gyroscopic, turning_stiffness(reduced, about_centre=True), reduced.centrifugal_load,
        reduced.euler_load, reduced.translation, turn,
        np.zeros((n, PORTS)) if block is None else _carried(reduced, frame, block, tied),
        np.concatenate([np.zeros((0, n)), *shapes, *([turn[None]] if turns_whole(reduced, len(held)) else [])]),
    )  # fmt: skip
    if part is None:
        return own
    return _Body(
        part.T @ own.gyroscopic @ part, part.T @ own.spin @ part, part.T @ own.centrifugal_load,
        part.T @ own.euler_load, own.translation @ part, own.turn @ part, part.T @ own.carried, own.shapes @ part,
    )  # fmt: skip


def body_arrays(
    topology: Topology,
    on_crank: Sequence[Body],
    joined: Sequence[Group],
    held: Mapping[str, Mapping[str, None]],
    base: Base,
    crank_ports: int,
    block_ports: int,
    frames: FrameNumbers,
) -> tuple[Bodies, Array, dict[tuple[str, str], int]]:
    """Arrays of the added bodies, shapes of further ports of the crank, and the first port of each held interface.

    Parameters
    ----------
    on_crank, joined : bodies that have their modes in common with the crank, and groups of all others, in this order
    crank_ports, block_ports : numbers of interfaces of crank and block that connections hold
    """
    turning = 0 if base.crank is None else base.crank.n_modes
    common = np.zeros(turning if on_crank else 0)
    lead = Group(list(on_crank), common, common, list(base.joined.values()))
    sizes = [group.omega.size for group in (lead, *joined)]
    counts = [[_ports(body, held) for body in group.bodies] for group in (lead, *joined)]
    n, w = sum(size * len(own) for size, own in zip(sizes, counts, strict=True)), max([1, *sizes])
    v, tied, z = max([1, *map(sum, counts)]), _tied(topology), zeros
    count = sum(map(len, counts))
    arrays = Bodies(
        np.zeros((count, at.BODY), dtype=np.int64), z((count, at.CONSTANTS)), z((n, w)), z((n, w)), z(n), z(n),
        z((3, n)), z((3, n)), z(n),
        z((sum(map(sum, counts)), w)), z((n, v)), z((n, PORTS)), _fastest(topology),
    )  # fmt: skip
    port_of, more = dict[tuple[str, str], int](), np.zeros((0, turning))
    mode, row_at, port, number = 0, 0, 0, 0
    # Ports of bodies in the crank's group come after the crank's, those of all others after the block's.
    first = base.turning_ports + PORTS * crank_ports
    for group, size, own_counts in zip((lead, *joined), sizes, counts, strict=True):
        start, group_port = row_at, port
        columns = np.zeros((0, size))
        for k, (body, ports) in enumerate(zip(group.bodies, own_counts, strict=True)):
            reduced, frame, row = body.reduced, topology.frame(body.frame), arrays.rows[number]
            names = held.get(body.name, {})
            part = None if group.parts is None else group.parts[k]
            own = _in_modes(body, frame, list(names), base.block, part, body.name in tied)
            span = slice(row_at, row_at + size)
            row[[at.MODE, at.MODES, at.PORT, at.PORTS]] = base.modes + mode, size, first + port, ports
            row[[at.OWN_MODE, at.OWN_PORT, at.FRAME_OF, at.SENSE]] = row_at, port, frames[frame], frame.sense
            row[[at.CARRIED, at.TIED, at.SWINGS, at.WHIRLS]] = (
                not _grounded(topology, body), body.name in tied, frame.swings, True,
            )  # fmt: skip
            row[[at.GROUP, at.ENDS_GROUP]] = start, k == len(group.bodies) - 1
            row[[at.GROUP_PORT, at.GROUP_PORTS]] = first + group_port, sum(own_counts)
            if group is lead:
                row[[at.MODE, at.GROUP, at.PORTS, at.GROUP_PORT]] = 0, CRANKS_GROUP, 0, 0
                row[at.GROUP_PORTS] = first + sum(own_counts)
                row[at.TIED] &= not base.joined[body.name][:, :RIGID].any()
            arrays.constants[number] = (
                frame.rate, reduced.mass, *(reduced.mass * reduced.centre[:2]),
                float(reduced.euler_load @ reduced.euler_load), row[at.TIED] * _reflected(reduced, frame),
            )  # fmt: skip
            arrays.gyroscopic[span, :size] = own.gyroscopic.T
            arrays.spin[span, :size] = own.spin.T
            arrays.centrifugal_load[span], arrays.euler_load[span] = own.centrifugal_load, own.euler_load
            arrays.translation[:, span], arrays.centre[:, span] = own.translation, own.translation / reduced.mass
            arrays.turn[span], arrays.carried[span] = own.turn, own.carried
            arrays.shapes[port : port + ports, :size] = own.shapes
            port_of |= {(body.name, name): first + port + PORTS * i for i, name in enumerate(names)}
            columns = np.concatenate((columns, own.shapes))
            row_at, port, number = row_at + size, port + ports, number + 1
        for k in range(len(group.bodies)):
            arrays.transposed[start + size * k : start + size * (k + 1), : len(columns)] = columns.T
        if group is not lead:
            mode += size
            continue
        # Ports after these are numbered from the end of the block's.
        more, arrays = arrays.shapes[:port, :size].reshape(port, turning), arrays._replace(shapes=arrays.shapes[port:])
        first, port = first + port + base.block_ports + PORTS * block_ports, 0
    return arrays, more, port_of


def _tied(topology: Topology) -> set[str]:
    """Bodies that laws rotate with the crank, directly or through other bodies, and bodies in rod or piston frames."""
    found = {CRANK} | {body.name for body in topology.bodies if topology.frame(body.frame).slider is not None}
    pairs = [
        {end.body for end in connection.ends}
        for connection in topology.connections
        if connection_law(connection.law, connection.name).turns
    ]
    for _ in pairs:
        found |= {name for pair in pairs if pair & found for name in pair}
    return found


def _fastest(topology: Topology) -> Array:
    frames = [topology.frame(body.frame) for body in topology.bodies]
    turns = np.array([frame.moved(angle)[[at.TURN, at.TURN2]] for frame in frames if frame.swings for angle in AROUND])
    most = np.abs(turns.reshape(-1, 2)).max(axis=0, initial=0.0)
    return np.array([max([1.0, *(frame.rate for frame in frames)]), *most])


def _reflected(body: ReducedBody, frame: Frame) -> float:
    """Inertia (kg m²) of a body that moves with its frame, reduced to the crank, mean over the crank angle."""
    if frame.slider is None:
        return frame.rate**2 * float(body.euler_load @ body.euler_load)
    motions = [frame.moved(angle) for angle in AROUND]
    swept = [follows(body, moved, frame.sense) for moved in motions]
    return float(np.mean([row @ row for row in swept]))


def _grounded(topology: Topology, body: Body) -> bool:
    """True if a connection joins a body directly to the ground."""
    return any(
        body.name in names and GROUND in names
        for names in ([end.body for end in connection.ends] for connection in topology.connections)
    )


def _carried(body: ReducedBody, frame: Frame, block: ReducedBody, tied: bool) -> Array:
    """Modal motion (n, 6) of a body that moves with the rigid modes of the block, at crank angle 0.

    The crank does not rotate with the block, so bodies ``tied`` to the crank rotate back relative to the block.
    """
    motion = rigid_coordinates(block)
    moved = motion[:3] - skew(frame.origin) @ motion[3:]
    across = np.column_stack([frame.turned(axis) for axis in np.eye(3)])
    seen = np.concatenate((across @ moved, across @ motion[3:]))
    result = np.zeros((body.n_modes, PORTS))
    result[:PORTS] = np.linalg.solve(rigid_coordinates(body), seen)
    if tied:
        result -= np.outer(follows(body, frame.moved(0.0), frame.sense), motion[5])
    return result


def follows(body: ReducedBody, moved: Array, sense: float) -> Array:
    """Modal motion (n,) of a body per crank angle if it follows its frame, whose motion is ``moved`` (MOVED,)."""
    return np.asarray(body.translation[:2].T @ moved[[at.OWN_X1, at.OWN_Y1]] + sense * moved[at.TURN] * body.euler_load)


def with_engine(crank: Bodies, block: Bodies, others: Bodies) -> Bodies:
    """Arrays of the crank, the block and all other bodies in one table, in this order."""
    parts = crank, block, others
    n, w = (sum(part.gyroscopic.shape[0] for part in parts), max(part.gyroscopic.shape[1] for part in parts))
    m, v = (sum(part.shapes.shape[0] for part in parts), max(part.transposed.shape[1] for part in parts))
    joined = Bodies(
        np.concatenate([part.rows for part in parts]), np.concatenate([part.constants for part in parts]),
        zeros((n, w)), zeros((n, w)), zeros(n), zeros(n), zeros((3, n)), zeros((3, n)), zeros(n), zeros((m, w)),
        zeros((n, v)), zeros((n, PORTS)), others.fastest,
    )  # fmt: skip
    mode, port, number = 0, 0, 0
    for part in parts:
        modes, ports = slice(mode, mode + part.gyroscopic.shape[0]), slice(port, port + part.shapes.shape[0])
        own_rows = joined.rows[number : number + len(part.rows)]
        own_rows[:, at.OWN_MODE] += mode
        own_rows[:, at.GROUP] = np.where(own_rows[:, at.GROUP] == CRANKS_GROUP, 0, own_rows[:, at.GROUP] + mode)
        own_rows[:, at.OWN_PORT] += port
        for name in ("gyroscopic", "spin", "transposed"):
            own = getattr(part, name)
            getattr(joined, name)[modes, : own.shape[1]] = own
        for name in ("centrifugal_load", "euler_load", "turn", "carried"):
            getattr(joined, name)[modes] = getattr(part, name)
        joined.translation[:, modes], joined.centre[:, modes] = part.translation, part.centre
        joined.shapes[ports, : part.shapes.shape[1]] = part.shapes
        mode, port, number = modes.stop, ports.stop, number + len(part.rows)
    return joined


def whole_body(shapes: Array, mode: int, port: int, frame: int, rate: float) -> Bodies:
    """Arrays of one body with n modes and ``shapes`` (m, n) of its ports, which does not turn unless they are filled.

    ``mode`` and ``port`` are its first ones in the model, ``frame`` is the number of its frame that turns at ``rate``.
    """
    m, n = shapes.shape
    row, constants = np.zeros((1, at.BODY), dtype=np.int64), np.zeros((1, at.CONSTANTS))
    row[0, [at.MODE, at.MODES, at.PORT, at.PORTS, at.FRAME_OF, at.SENSE]] = mode, n, port, m, frame, 1
    row[0, [at.ENDS_GROUP, at.GROUP_PORT, at.GROUP_PORTS]] = 1, port, m
    constants[0, at.RATE] = rate
    z = zeros
    return Bodies(
        row, constants, z((n, n)), z((n, n)), z(n), z(n), z((3, n)), z((3, n)), z(n), shapes,
        np.ascontiguousarray(shapes.T), z((n, PORTS)), z(at.FASTEST_SIZE),
    )  # fmt: skip
