"""Added bodies and connections as flat arrays of the running model, packed one after the other with offsets.

The modes of added bodies come behind all others, their ports behind those of the block. Each interface that a
connection holds brings all its six components as ports, on crank and block too. Matrices of bodies are rows of one
table each, as wide as the largest body is; a body's own start at its offset.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.kernel import keep_record, kernel_address, record
from cranktrain.core.memory import zeros
from cranktrain.core.reduced_body import Array, ReducedBody, rigid_coordinates, skew
from cranktrain.dynamics.topology import slots as at
from cranktrain.dynamics.topology.gas import gas_law
from cranktrain.dynamics.topology.laws import Piece, connection_law, pieces_of
from cranktrain.dynamics.topology.relations import Group, groups
from cranktrain.dynamics.topology.terms import PORTS, Direction, Term, terms_of
from cranktrain.dynamics.topology.values import BLOCK, CRANK, GROUND, REST, Body, Connection, End, Frame, Topology
from cranktrain.film.laws.films import NUMBERS, SIZE, IntArray
from cranktrain.film.laws.parameters import COLUMNS

AROUND = np.linspace(0.0, 4.0 * np.pi, 97)[:-1]
"""Crank angles (rad) at which what depends on them is looked at."""
KINDS = {
    "force": at.FORCE_KIND, "place": at.PLACE_KIND, "velocity": at.VELOCITY_KIND, "out": at.OUT_KIND,
}  # fmt: skip
BODY_KINDS = (
    (at.BODY_SPEED, 0), (at.BODY_TURN, 0), (at.BODY_PLACE, 0), (at.BODY_PLACE, 1), (at.BODY_PLACE, 2),
)  # fmt: skip
"""What is shown of a body, in the order of its outputs' names."""


@record
class AddedBodies(NamedTuple):
    """B bodies with N modes in all, W of the largest one, and M ports, V of the one that has most.

    Bodies in one group have their modes in common: N counts them once for each, V the ports of a whole group.
    """

    rows: Array  # (B, BODY) see dynamics.topology.slots
    gyroscopic: Array  # (N, W) G transposed, of each body
    spin: Array  # (N, W) (K_σ − C) transposed
    centrifugal_load: Array  # (N,)
    euler_load: Array  # (N,)
    translation: Array  # (3, N)
    centre: Array  # (3, N) motion of the centre of mass in axes of the frame, x, y, z
    turn: Array  # (N,) rotation about z of each body as a whole
    shapes: Array  # (M, W)
    transposed: Array  # (N, V)
    carried: Array  # (N, 6) motion that goes along with the block's rigid modes
    fastest: Array  # (FASTEST_SIZE,) how fast frames turn at most, see slots


@record
class AddedConnections(NamedTuple):
    """K pieces of connections with C components, T terms, and what they hold."""

    frames: Array  # (F, FRAME) of bodies, laws and directions
    rows: Array  # (K, CONNECTION)
    table: Array  # (K, 5) number of components and the Newton components, as ModelArrays.connections
    terms: Array  # (T, TERM) in the order of their components
    starts: Array  # (C + 1,) first term of each component
    scales: Array  # (C,)
    meets: Array  # (C, C + 1) 1 where a component's force moves another one, at last one of the engine's own
    order: Array  # (n,) components, the engine's among them, in the order of their elimination
    slides: Array  # (C, SLIDES)
    leans: Array  # (L, LEAN)
    interfaces: Array  # (I, INTERFACE)
    ports: Array  # (P,) all ports that connections load
    entry: IntArray  # (K, 3) addresses of the law and of its record, and the number by which the record knows it
    place: Array  # (K, 4)
    velocity: Array  # (K, 4)
    numbers: Array  # (NUMBERS,)
    out: Array  # (SIZE,)
    bearings: Array  # (K, COLUMNS) of films
    oil: Array  # (K,) viscosity that a film has by itself, Pa s; 0: the engine's, −1: no film
    shown: Array  # (O, SHOWN) of each output
    hooks: IntArray  # (HOOKS,) addresses of what a stage calls, see dynamics.motion.added_hooks


class AddedWork(NamedTuple):
    """Memory of a stage for added bodies and connections."""

    scratch: Array  # (W, W)
    inverse: Array  # (slots, N, W)
    response: Array  # (slots, M, W)
    compliance: Array  # (slots, M, V)
    frames: Array  # (F, MOVED) angle and place of each frame, and their derivatives by the crank angle
    coefficients: Array  # (T, 2) of each term, and its rate
    permuted: Array  # (n, n) the Newton matrix in the order of elimination
    gaps: Array  # (GAPS, C)
    answered: Array  # (m,) motion of all ports by one component's force
    axes: Array  # (B, 2) displacement of each body's centre of mass across its axis, m
    blocks: Array  # (K, 16)
    factored: Array  # (K, 16)
    newton: Array  # (1, n) step of all components, to a multiple of four
    sizes: Array  # (SIZES,), the angle no number at first


class Added(NamedTuple):
    """What a topology adds to a model: arrays, and what crank and block are held by."""

    bodies: AddedBodies
    connections: AddedConnections
    crank: Array  # (·, n_t) shapes of further ports
    block: Array  # (·, n_b)
    omega: Array  # (N,)
    damping: Array  # (N,) 1/s


class Base(NamedTuple):
    """What a topology is added to: bodies ``crank`` and ``block`` and how many modes, ports, components there are."""

    crank: ReducedBody | None
    block: ReducedBody | None
    modes: int
    turning_ports: int
    block_ports: int
    newton: int


# In one piece: one group of arrays after the other, in the order in which they need each other.
def added(topology: Topology, base: Base) -> Added:
    """Arrays of a topology.

    Raises
    ------
    InputError
        an interface that a body lacks, ends that a law does not join
    """
    topology = topology if base.block is not None else on_ground(topology)
    held = _held(topology, base)
    topology = _touching(topology, base)
    crank_ports, block_ports = held.pop(CRANK, {}), held.pop(BLOCK, {})
    first = base.turning_ports + PORTS * len(crank_ports) + base.block_ports + PORTS * len(block_ports)
    joined = groups(topology)
    frames = _Frames()
    bodies, port_of = _bodies(topology, joined, held, base, first, frames)
    for k, name in enumerate(crank_ports):
        port_of[CRANK, name] = base.turning_ports + PORTS * k
    for k, name in enumerate(block_ports):
        port_of[BLOCK, name] = base.turning_ports + PORTS * len(crank_ports) + base.block_ports + PORTS * k
    names = [body.name for group in joined for body in group.bodies]
    grouped = {body.name: k for k, group in enumerate(joined) for body in group.bodies}
    connections = _connections(topology, names, port_of, base.newton, frames, grouped)
    return Added(
        bodies,
        connections,
        _shapes(base.crank, list(crank_ports)),
        _shapes(base.block, list(block_ports)),
        np.concatenate([np.zeros(0), *(group.omega for group in joined)]),
        np.concatenate([np.zeros(0), *(group.damping for group in joined)]),
    )


class _Frames(dict[Frame, int]):
    """Numbers of frames in the order in which they are asked for."""

    def __missing__(self, frame: Frame) -> int:
        self[frame] = len(self)
        return self[frame]


def on_ground(topology: Topology) -> Topology:
    """The topology on a rigid block at rest: what it holds at the block, the ground holds."""

    def end(given: End) -> End:
        return End(GROUND) if given.body == BLOCK else given

    connections = tuple(
        replace(connection, ends=tuple(end(one) for one in connection.ends)) for connection in topology.connections
    )
    return replace(topology, connections=connections)


def _touching(topology: Topology, base: Base) -> Topology:
    """The topology with ends on bodies at rest where those that slide over them are at crank angle 0."""
    own: Mapping[str, ReducedBody | None] = {BLOCK: base.block, **{body.name: body.reduced for body in topology.bodies}}
    connections = list(topology.connections)
    for k, connection in enumerate(connections):
        frames = [topology.end_frame(end) for end in connection.ends]
        for number, (frame, other) in enumerate(zip(frames, frames[::-1], strict=True) if len(frames) == 2 else ()):
            end, slider = connection.ends[number], connection.ends[1 - number]
            wall, moving = own.get(end.body), own.get(slider.body)
            if frame != REST or other.slider is None or wall is None or moving is None:
                continue
            turn = np.column_stack([other.turned(axis) for axis in np.eye(3)])
            place = other.origin + turn.T @ (moving.positions[moving.index(slider.interface)] + slider.offset)
            x, y, z = place - wall.positions[wall.index(end.interface)]
            ends = [slider, slider]
            ends[number] = replace(end, offset=(float(x), float(y), float(z)))
            connections[k] = replace(connection, ends=tuple(ends))
    return replace(topology, connections=tuple(connections))


def _shapes(body: ReducedBody | None, names: list[str]) -> Array:
    n = 0 if body is None else body.n_modes
    rows = [body.shapes[body.index(name)] for name in names] if body is not None else []
    return np.concatenate([np.zeros((0, n)), *rows])


def _held(topology: Topology, base: Base) -> dict[str, dict[str, None]]:
    """Interfaces that connections hold, by body, in order."""
    own: Mapping[str, ReducedBody | None] = {
        CRANK: base.crank, BLOCK: base.block, **{body.name: body.reduced for body in topology.bodies},
    }  # fmt: skip
    held: dict[str, dict[str, None]] = {}
    for connection in topology.connections:
        for end in connection.ends:
            if end.body == GROUND:
                continue
            body = own[end.body]
            where = f"connection '{connection.name}'"
            if body is None:
                raise InputError(f"{where}: there is no {end.body} here; take another body, or the ground")
            if end.interface not in body.interfaces:
                raise InputError(
                    f"{where}: body '{end.body}' has no interface '{end.interface}'; "
                    f"{nearest(end.interface, list(body.interfaces))}"
                )
            held.setdefault(end.body, {})[end.interface] = None
    return held


class _Body(NamedTuple):
    """A body in the modes of its group: what its arrays hold."""

    gyroscopic: Array
    spin: Array
    centrifugal_load: Array
    euler_load: Array
    translation: Array
    turn: Array
    carried: Array
    shapes: Array  # (6 p, n) of the interfaces that are held, and the rotation of an elastic body as a whole


def _turns_whole(body: ReducedBody, held: int) -> bool:
    """Whether a body's rotation as a whole is a port: a moment about its centre at one interface would bend it."""
    return held > 0 and body.n_modes > PORTS


def _ports(body: Body, held: Mapping[str, Mapping[str, None]]) -> int:
    """Number of ports of a body in its group."""
    names = held.get(body.name, {})
    return PORTS * len(names) + _turns_whole(body.reduced, len(names))


def _in_modes(
    body: Body, frame: Frame, held: Sequence[str], block: ReducedBody | None, part: Array | None, tied: bool
) -> _Body:
    """A body in modes of which ``part`` (n, z) are its own, None: its own ones."""
    reduced, n = body.reduced, body.reduced.n_modes
    turn = np.zeros(n)
    turn[:PORTS] = rigid_coordinates(reduced)[5]
    shapes = [reduced.shapes[reduced.index(name)] for name in held]
    own = _Body(
        reduced.gyroscopic, reduced.stress_stiffness - reduced.centrifugal, reduced.centrifugal_load,
        reduced.euler_load, reduced.translation, turn,
        np.zeros((n, PORTS)) if block is None else _carried(reduced, frame, block, tied),
        np.concatenate([np.zeros((0, n)), *shapes, *([turn[None]] if _turns_whole(reduced, len(held)) else [])]),
    )  # fmt: skip
    if part is None:
        return own
    return _Body(
        part.T @ own.gyroscopic @ part, part.T @ own.spin @ part, part.T @ own.centrifugal_load,
        part.T @ own.euler_load, own.translation @ part, own.turn @ part, part.T @ own.carried, own.shapes @ part,
    )  # fmt: skip


# In one piece: one row and one body's span of every array.
def _bodies(
    topology: Topology,
    joined: list[Group],
    held: Mapping[str, Mapping[str, None]],
    base: Base,
    first: int,
    frames: _Frames,
) -> tuple[AddedBodies, dict[tuple[str, str], int]]:
    """Arrays of the bodies, group by group, and the first port of each interface that is held."""
    sizes = [group.omega.size for group in joined]
    counts = [[_ports(body, held) for body in group.bodies] for group in joined]
    n, w = sum(size * len(own) for size, own in zip(sizes, counts, strict=True)), max(sizes, default=1)
    m, v = sum(map(sum, counts)), max([1, *map(sum, counts)])
    z = zeros
    arrays = AddedBodies(
        np.zeros((sum(map(len, counts)), at.BODY)), z((n, w)), z((n, w)), z(n), z(n), z((3, n)), z((3, n)), z(n),
        z((m, w)), z((n, v)), z((n, PORTS)), _fastest(topology),
    )  # fmt: skip
    port_of: dict[tuple[str, str], int] = {}
    mode, row_at, port, tied, number = 0, 0, 0, _tied(topology), 0
    for group, size, own_counts in zip(joined, sizes, counts, strict=True):
        start, group_port = row_at, port
        columns = np.zeros((0, size))
        for k, (body, ports) in enumerate(zip(group.bodies, own_counts, strict=True)):
            reduced, frame, row = body.reduced, topology.frame(body.frame), arrays.rows[number]
            names = held.get(body.name, {})
            own = _in_modes(
                body, frame, list(names), base.block, None if group.parts is None else group.parts[k], body.name in tied
            )
            span = slice(row_at, row_at + size)
            row[: at.CARRIED] = (
                base.modes + mode, size, first + port, ports, row_at, port, frames[frame], frame.rate, frame.sense,
                reduced.mass,
            )  # fmt: skip
            row[at.CARRIED], row[at.TIED] = not _grounded(topology, body), body.name in tied
            row[at.REFLECTED] = row[at.TIED] * _reflected(reduced, frame)
            row[[at.UNBALANCE_X, at.UNBALANCE_Y]] = reduced.mass * reduced.centre[:2]
            row[at.INERTIA] = float(reduced.euler_load @ reduced.euler_load)
            row[at.GROUP], row[at.ENDS_GROUP] = start, k == len(group.bodies) - 1
            row[at.GROUP_PORT], row[at.GROUP_PORTS] = first + group_port, sum(own_counts)
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
        mode += size
    return arrays, port_of


def _tied(topology: Topology) -> set[str]:
    """Bodies that laws make turn as the crank does, directly or through others, and those whose frames are a rod's."""
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
    """Inertia (kg m²) that the crank feels of a body that moves as its frame does, mean over a turn."""
    if frame.slider is None:
        return frame.rate**2 * float(body.euler_load @ body.euler_load)
    motions = [frame.moved(angle) for angle in AROUND]
    swept = [follows(body, moved, frame.sense) for moved in motions]
    return float(np.mean([row @ row for row in swept]))


def _grounded(topology: Topology, body: Body) -> bool:
    """Whether the ground holds a body, directly."""
    return any(
        body.name in names and GROUND in names
        for names in ([end.body for end in connection.ends] for connection in topology.connections)
    )


def _carried(body: ReducedBody, frame: Frame, block: ReducedBody, tied: bool) -> Array:
    """Modal motion (n, 6) of a body that goes along with the rigid modes of the block, at crank angle 0.

    The crank does not turn with the block, so that bodies ``tied`` to it turn back against it as the crank does.
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
    """Modal motion (n,) of a body by the crank angle with which its frame moves, as in ``moved`` (MOVED,)."""
    return np.asarray(body.translation[:2].T @ moved[[at.OWN_X1, at.OWN_Y1]] + sense * moved[at.TURN] * body.euler_load)


def _connections(
    topology: Topology,
    names: list[str],
    port_of: Mapping[tuple[str, str], int],
    newton: int,
    numbers_of: _Frames,
    grouped: Mapping[str, int],
) -> AddedConnections:
    """Arrays of the connections, bodies in the order of ``names``; compiles their laws."""
    rows, tables, terms, starts, shown = [], [], [], [0], []
    scales: list[float] = []
    slides: list[list[float]] = []
    leans: list[list[float]] = []
    oil: list[float] = []
    kept: list[Piece] = []
    shown += [(names.index(body.name), *kind) for body in topology.bodies for kind in BODY_KINDS]
    for connection, piece in _all_pieces(topology):
        frames = [topology.end_frame(end) for end in connection.ends]
        size, first = len(piece.components), len(scales)
        ports, senses = [], []
        for end, frame in zip(connection.ends, frames, strict=True):
            turns = piece.rubs and end.body != GROUND
            ports.append(port_of[end.body, end.interface] + 5 if turns else -1)
            senses.append(frame.sense * piece.axes.sense)
        rows.append([
            size, first, numbers_of[piece.axes], piece.axes.sense, piece.pairs, *ports, *senses,
            *(numbers_of[frame] for frame in frames), piece.rubs, piece.closes, piece.cylinder - 1,
            piece.kernel is gas_law,
        ])  # fmt: skip
        leans += _leans(connection, frames, port_of, numbers_of, len(rows) - 1)
        tables.append([size, *(newton + first + j for j in range(size)), *[0] * (4 - size)])
        for j, pair in enumerate(piece.components):
            found: list[Term] = []
            slides.append(_slide(pair, frames, numbers_of))
            for end, frame, direction, other in zip(connection.ends, frames, pair, frames[::-1], strict=True):
                if end.body != GROUND:
                    over = other if frame == REST and other.slider is not None else None
                    found += terms_of(end, frame, direction, over)
            for term in found:
                terms.append([
                    first + j, port_of[term.body, term.interface] + term.component, term.amplitude,
                    numbers_of[term.given], numbers_of[term.own], term.phase,
                    *((-1, 0, 0.0) if term.lever is None else
                      (numbers_of[term.lever], term.way, term.lever.moved(0.0)[at.PLACE_X + term.way])),
                ])  # fmt: skip
            starts.append(len(terms))
        scales += piece.scales
        shown += [(len(rows) - 1, KINDS[kind], place) for _, kind, place in piece.outputs]
        oil.append(piece.viscosity)
        kept.append(piece)
    # Laws of films look at all rows: those of other laws are filled up.
    any_film = next((piece.parameters for piece in kept if piece.parameters is not None), np.zeros(COLUMNS))
    bearings = [any_film if piece.parameters is None else piece.parameters for piece in kept]
    films = _table(bearings, COLUMNS)
    entry, place, velocity, numbers, out = _entries(kept, films)
    interfaces = []
    last = {body: port for (body, _), port in port_of.items()}
    for (body, _), port in port_of.items():
        own = body not in (CRANK, BLOCK) and _turns_whole(topology.body(body).reduced, 1)
        owner = at.OF_CRANK if body == CRANK else at.OF_BLOCK if body == BLOCK else names.index(body)
        interfaces.append([owner, port, port + 1, last[body] + PORTS if own else port + 5])
    meets, order = _neighbours(len(scales), newton, terms, port_of, grouped)
    loaded = np.unique([*np.array(terms).reshape(-1, at.TERM)[:, at.TERM_PORT], *(row[3] for row in interfaces)])
    arrays = AddedConnections(
        _table([frame.row for frame in numbers_of], at.FRAME), _table(rows, at.CONNECTION), _table(tables, 5),
        _table(terms, at.TERM), np.array(starts, dtype=float), np.array(scales, dtype=float), meets,
        order,
        _table(slides, at.SLIDES), _table(leans, at.LEAN),
        _table(interfaces, at.INTERFACE), loaded.astype(float), entry, place, velocity, numbers, out, films,
        np.array(oil, dtype=float), _table(shown, at.SHOWN),
        np.zeros(at.HOOKS, dtype=np.int64),
    )  # fmt: skip
    return arrays


def _entries(pieces: Sequence[Piece], films: Array) -> tuple[IntArray, Array, Array, Array, Array]:
    """Addresses of laws and records (K, 3), and the arrays with which they are called; compiles the laws."""
    k = len(pieces)
    entry = np.zeros((k, 3), dtype=np.int64)
    place, velocity, out = np.zeros((k, 4)), np.zeros((k, 4)), np.zeros(SIZE)
    numbers, memory = np.zeros(NUMBERS), np.zeros(1)
    for number, (piece, row) in enumerate(zip(pieces, entry, strict=True)):
        is_film = piece.parameters is not None
        row[1] = keep_record(piece.record(films) if is_film else piece.record, entry)
        row[2] = number if is_film else 0
        row[0] = kernel_address(piece.kernel, 0, 0, 0, place[0], velocity[0], numbers, memory, out)
    return entry, place, velocity, numbers, out


def _neighbours(
    count: int, newton: int, terms: Sequence[Any], port_of: Mapping[tuple[str, str], int], grouped: Mapping[str, int]
) -> tuple[Array, Array]:
    """Which components move each other (C, C + 1), and the order (n,) in which all are eliminated.

    Components of one added body alone, or of one group, come first, body by body: they do not couple with another's.
    """
    own = np.zeros((count, len(grouped) + 2), dtype=bool)
    columns = {CRANK: len(grouped), BLOCK: len(grouped) + 1} | dict(grouped)
    owners = {port + k: columns[body] for (body, _), port in port_of.items() for k in range(PORTS)}
    for term in terms:
        own[int(term[at.COMPONENT]), owners[int(term[at.TERM_PORT])]] = True
    alone = (own.sum(axis=1) == 1) & ~own[:, -2:].any(axis=1)
    first = np.flatnonzero(alone)
    first = first[np.argsort(own[first].argmax(axis=1), kind="stable")]
    order = np.concatenate((newton + first, newton + np.flatnonzero(~alone), np.arange(newton)))
    meets = np.column_stack((own.astype(int) @ own.T.astype(int) > 0, own[:, -2:].any(axis=1)))
    return meets.astype(float), order.astype(float)


def _leans(
    connection: Connection,
    frames: Sequence[Frame],
    port_of: Mapping[tuple[str, str], int],
    numbers_of: _Frames,
    number: int,
) -> list[list[float]]:
    """Row of ``leans`` where an end of connection ``number`` slides over a body, else nothing."""
    for sign, slider, wall in ((1.0, 0, 1), (-1.0, 1, 0)):
        own, body = connection.ends[slider], connection.ends[wall]
        frame = frames[slider]
        if frame.slider is not None and frames[wall] == REST and body.body != GROUND:
            beside = np.array(body.offset[:2]) - frame.moved(0.0)[[at.PLACE_X, at.PLACE_Y]]
            ports = [port_of[end.body, end.interface] for end in (own, body)]
            return [[number, sign, numbers_of[frame], ports[0], *own.offset[:2], ports[1], *beside]]
    return []


def _slide(pair: tuple[Direction, Direction], frames: Sequence[Frame], numbers_of: _Frames) -> list[float]:
    """Row of ``slides``: pistons and rods move by their frames alone along what stands, pistons along each other."""
    apart = [frame.slider is not None and not frame.swings for frame in frames]
    resting = [frame == REST for frame in frames]
    slides = any(frame.slider is not None for frame in frames) and (any(resting) or all(apart))
    if not slides or frames[0] == frames[1]:
        return [-1.0, -1.0, 0.0, 0.0, 0.0]
    first, along = pair[0].frame, pair[0].sign * pair[0].along
    return [*(numbers_of[frame] for frame in frames), numbers_of[first], along[0], first.sense * along[1]]


def _all_pieces(topology: Topology) -> list[tuple[Connection, Piece]]:
    return [
        (connection, piece)
        for connection in topology.connections
        for piece in pieces_of(connection, *(topology.end_frame(end) for end in connection.ends))
    ]


def _table(rows: Sequence[Any], columns: int) -> Array:
    return np.array(rows, dtype=float).reshape(-1, columns)


def added_work(bodies: AddedBodies, connections: AddedConnections, ports: int, newton: int, slots: int) -> AddedWork:
    """Memory for a model with ``ports`` and ``newton`` components in all."""
    n, w = bodies.gyroscopic.shape
    m, v = bodies.shapes.shape[0], bodies.transposed.shape[1]
    k, c, t = len(connections.rows), len(connections.scales), len(connections.terms)
    f = len(connections.frames)
    z = zeros
    return AddedWork(
        z((w, w)), z((slots, n, w)), z((slots, m, w)), z((slots, m, v)), z((f, at.MOVED)), z((t, 2)),
        z((newton, newton)), z((at.GAPS, c)),
        z(ports), z((len(bodies.rows), 2)), z((k, 16)), z((k, 16)), z((1, -4 * (-newton // 4))),
        np.full(at.SIZES, np.nan),
    )  # fmt: skip
