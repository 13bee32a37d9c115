"""Arrays of added bodies: matrices and shapes one after the other, with bodies of a group in common modes."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

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
CRANKS_GROUP = 1
"""Mark of the crank's group, until the bodies are joined; before, GROUP of others counts from their own first mode."""


def turns_whole(body: ReducedBody, held: int) -> bool:
    """True if a body's rotation as a whole is a port, as for elastic bodies, which a moment at one port would bend."""
    return held > 0 and body.n_modes > PORTS


def body_arrays(
    topology: Topology,
    on_crank: Sequence[Body],
    joined: Sequence[Group],
    held: Mapping[str, Mapping[str, None]],
    base: Base,
    crank_ports: int,
    block_ports: int,
    frames: FrameNumbers,
) -> tuple[list[Bodies], Array, dict[tuple[str, str], int]]:
    """Arrays of each added body, shapes of further ports of the crank, and the first port of each held interface.

    Parameters
    ----------
    on_crank, joined : bodies that have their modes in common with the crank, and groups of all others, in this order
    crank_ports, block_ports : numbers of interfaces of crank and block that connections hold
    """
    turning = 0 if base.crank is None else base.crank.n_modes
    common = np.zeros(turning if on_crank else 0)
    lead = Group(list(on_crank), common, common, list(base.joined.values()))
    tied, found, more = _tied(topology), list[Bodies](), np.zeros((0, turning))
    grounded = {end.body for one in topology.connections if GROUND in [e.body for e in one.ends] for end in one.ends}
    port_of, mode = dict[tuple[str, str], int](), base.modes
    # Ports of bodies in the crank's group come after the crank's, those of all others after the block's.
    port = base.turning_ports + PORTS * crank_ports
    for group in (lead, *joined):
        size, leads, first = group.omega.size, group is lead, port
        parts: Sequence[Array | None] = group.parts or [None] * len(group.bodies)
        own = [
            _in_modes(body, topology.frame(body.frame), list(held.get(body.name, {})), base.block, part, tied)
            for body, part in zip(group.bodies, parts, strict=True)
        ]
        columns = np.concatenate([np.zeros((0, size)), *(made.shapes for made in own)])
        for k, (body, made) in enumerate(zip(group.bodies, own, strict=True)):
            reduced, frame, row = body.reduced, topology.frame(body.frame), made.rows[0]
            row[[at.MODE, at.MODES, at.PORT, at.PORTS]] = mode, size, port, len(made.shapes)
            row[[at.FRAME_OF, at.SENSE]] = frames[frame], frame.sense
            row[[at.CARRIED, at.TIED, at.SWINGS, at.WHIRLS]] = (
                body.name not in grounded, body.name in tied, frame.swings, True,
            )  # fmt: skip
            row[[at.GROUP, at.ENDS_GROUP]] = -size * k, k == len(own) - 1
            row[[at.GROUP_PORT, at.GROUP_PORTS]] = first, len(columns)
            if leads:
                row[[at.MODE, at.GROUP, at.PORTS, at.GROUP_PORT]] = 0, CRANKS_GROUP, 0, 0
                row[at.GROUP_PORTS] = first + len(columns)
                row[at.TIED] &= not base.joined[body.name][:, :RIGID].any()
            made.constants[0] = (
                frame.rate, reduced.mass, *(reduced.mass * reduced.centre[:2]),
                float(reduced.euler_load @ reduced.euler_load), row[at.TIED] * _reflected(reduced, frame),
            )  # fmt: skip
            found.append(made._replace(transposed=columns.T, shapes=made.shapes[:0] if leads else made.shapes))
            names = held.get(body.name, {})
            port_of |= {(body.name, name): port + PORTS * i for i, name in enumerate(names)}
            port += len(made.shapes)
        if leads:
            # Ports after these are numbered from the end of the block's.
            more, port = columns.reshape(len(columns), turning), port + base.block_ports + PORTS * block_ports
        else:
            mode += size
    return found, more, port_of


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


def fastest(topology: Topology) -> Array:
    """Slots (FASTEST_SIZE,) of the highest speeds of the frames of all bodies."""
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


def _in_modes(
    body: Body, frame: Frame, held: Sequence[str], block: ReducedBody | None, part: Array | None, tied: Collection[str]
) -> Bodies:
    """A body in the modes of its group; ``part`` (n, z) are the body's modal coordinates in the group's, or None."""
    reduced, n = body.reduced, body.reduced.n_modes
    turn = np.zeros(n)
    turn[:PORTS] = rigid_coordinates(reduced)[5]
    shapes = [reduced.shapes[reduced.index(name)] for name in held]
    t = np.eye(n) if part is None else part
    return Bodies(
        np.zeros((1, at.BODY), dtype=np.int64), np.zeros((1, at.CONSTANTS)), (t.T @ reduced.gyroscopic @ t).T,
        (t.T @ turning_stiffness(reduced, about_centre=True) @ t).T, t.T @ reduced.centrifugal_load,
        t.T @ reduced.euler_load, reduced.translation @ t, reduced.translation @ t / reduced.mass, turn @ t,
        np.concatenate([np.zeros((0, n)), *shapes, *([turn[None]] if turns_whole(reduced, len(held)) else [])]) @ t,
        np.zeros((0, 0)),
        t.T @ (np.zeros((n, PORTS)) if block is None else _carried(reduced, frame, block, body.name in tied)),
        np.zeros(at.FASTEST_SIZE),
    )  # fmt: skip


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


def join_bodies(parts: Sequence[Bodies], fastest: Array) -> Bodies:
    """Arrays of all bodies in one table, from those of each body by itself."""
    modes, ports = (max(getattr(part, name).shape[1] for part in parts) for name in ("gyroscopic", "transposed"))
    widths = {"gyroscopic": modes, "spin": modes, "shapes": modes, "transposed": ports}
    joined: dict[str, Any] = {"fastest": fastest}
    for name in Bodies._fields[:-1]:
        each = [getattr(part, name) for part in parts]
        if name in widths:
            each = [np.pad(one, ((0, 0), (0, widths[name] - one.shape[1]))) for one in each]
        whole = np.concatenate(each, axis=1 if name in ("translation", "centre") else 0)
        joined[name] = zeros(whole.shape) if whole.dtype == np.float64 else whole
        joined[name][:] = whole
    rows = joined["rows"]
    rows[:, at.OWN_MODE] = np.cumsum([0, *(len(part.turn) for part in parts)])[:-1]
    rows[:, at.GROUP] = np.where(rows[:, at.GROUP] == CRANKS_GROUP, 0, rows[:, at.GROUP] + rows[:, at.OWN_MODE])
    return Bodies(**joined)


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
