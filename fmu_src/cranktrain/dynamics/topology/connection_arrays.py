"""Arrays of added connections: addresses of laws, terms of components, and couplings between components."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import keep_record, kernel_address
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.topology import slots as at
from cranktrain.dynamics.topology.body_arrays import turns_whole
from cranktrain.dynamics.topology.gas import gas_law
from cranktrain.dynamics.topology.laws import pieces_of
from cranktrain.dynamics.topology.pieces import FilmParts, Piece
from cranktrain.dynamics.topology.records import AddedConnections, FrameNumbers
from cranktrain.dynamics.topology.spring import load_law
from cranktrain.dynamics.topology.terms import PORTS, Direction, Term, terms_of
from cranktrain.dynamics.topology.values import BLOCK, CRANK, GROUND, REST, Connection, End, Frame, Topology
from cranktrain.film.laws.films import NUMBERS, SIZE, IntArray
from cranktrain.film.laws.parameters import COLUMNS

KINDS = {
    "force": at.FORCE_KIND, "place": at.PLACE_KIND, "velocity": at.VELOCITY_KIND, "out": at.OUT_KIND,
}  # fmt: skip
BODY_KINDS = (
    (at.BODY_SPEED, 0), (at.BODY_TURN, 0), (at.BODY_PLACE, 0), (at.BODY_PLACE, 1), (at.BODY_PLACE, 2),
)  # fmt: skip
"""Kinds of an added body's outputs, in the order of the names of these outputs."""


def connection_arrays(
    topology: Topology,
    names: list[str],
    port_of: Mapping[tuple[str, str], int],
    newton: int,
    numbers_of: FrameNumbers,
    grouped: Mapping[str, int],
    films_of: FilmParts,
    reduced_of: Mapping[str, ReducedBody | None],
) -> AddedConnections:
    """Arrays of the connections between bodies in the order of ``names``; compiles the force laws.

    ``InputError`` if a film lacks a part.
    """
    rows, tables, terms, starts, shown = [], [], [], [0], []
    scales: list[float] = []
    slides: list[list[float]] = []
    leans: list[list[float]] = []
    oil: list[float] = []
    kept: list[Piece] = []
    parts: list[FilmParts] = []
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
            piece.kernel is gas_law, piece.tilt,
            piece.kernel is load_law or piece.carried,
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
        parts.append(films_of._replace(at_main=at_main(connection.ends), connection=connection.name))
    # Laws of films read the rows of all bearings, so rows of other laws are filled with valid values.
    any_film = next((piece.parameters for piece in kept if piece.parameters is not None), np.zeros(COLUMNS))
    bearings = [any_film if piece.parameters is None else piece.parameters for piece in kept]
    films = _table(bearings, COLUMNS)
    entry, place, velocity, numbers, out, traits = _entries(kept, films, parts)
    remembered = np.concatenate((np.zeros(1), np.cumsum(traits[:, at.KEEPS]))).astype(np.int64)
    interfaces = _interfaces(topology, names, port_of, reduced_of)
    meets, order = _neighbours(len(scales), newton, terms, port_of, grouped)
    loaded = np.unique([*np.array(terms).reshape(-1, at.TERM)[:, at.TERM_PORT], *(row[3] for row in interfaces)])
    arrays = AddedConnections(
        _table([frame.row for frame in numbers_of], at.FRAME), _table(rows, at.CONNECTION), _table(tables, 5),
        _table(terms, at.TERM), np.array(starts, dtype=float), np.array(scales, dtype=float), meets,
        order,
        _table(slides, at.SLIDES), _table(leans, at.LEAN),
        _table(interfaces, at.INTERFACE), loaded.astype(float), entry, place, velocity, numbers, out, films,
        np.array(oil, dtype=float), traits, remembered, _table(shown, at.SHOWN),
        np.zeros(at.HOOKS, dtype=np.int64),
    )  # fmt: skip
    return arrays


def _entries(
    pieces: Sequence[Piece], films: Array, parts: Sequence[FilmParts]
) -> tuple[IntArray, Array, Array, Array, Array, Array]:
    """Addresses of K laws and their records (K, 3), arrays for calls, and traits; compiles the force laws."""
    k = len(pieces)
    entry, traits = np.zeros((k, 3), dtype=np.int64), np.zeros((k, at.TRAITS))
    place, velocity, out = np.zeros((k, 4)), np.zeros((k, 4)), np.zeros(SIZE)
    numbers, memory = np.zeros(NUMBERS), np.zeros(1)
    for number, (piece, made, row, told) in enumerate(zip(pieces, parts, entry, traits, strict=True)):
        is_film = callable(piece.record)
        try:
            record = piece.record(films, made) if is_film else piece.record
        except InputError as error:
            raise InputError(f"connection '{made.connection}': {error}") from None
        row[1] = keep_record(record, entry)
        row[2] = number if is_film else 0
        row[0] = kernel_address(piece.kernel, 0, 0, 0, place[0], velocity[0], numbers, memory, out)
        told[[at.TOLD_OIL, at.TOLD_SPEED, at.TELLS_RATE]] = piece.told_oil, piece.told_speed, piece.tells_rate
        if piece.memory is not None:
            told[at.KEEPS] = piece.memory(record)
    return entry, place, velocity, numbers, out, traits


def at_main(ends: Sequence[End]) -> bool:
    """True if a connection between ``ends`` holds a main journal of the crank in its bore, or on a block at rest."""
    first, second = ends[:2]
    number = re.fullmatch(r"main(\[\d+\])", first.interface)
    if first.body != CRANK or number is None or any(first.offset) or any(second.offset):
        return False
    return second.body == GROUND or (second.body, second.interface) == (BLOCK, f"bore{number[1]}")


def _interfaces(
    topology: Topology, names: list[str], port_of: Mapping[tuple[str, str], int],
    reduced_of: Mapping[str, ReducedBody | None],
) -> list[list[float]]:  # fmt: skip
    """Rows of ``AddedConnections.interfaces``, one for each interface that a connection holds."""
    found, last = list[list[float]](), {body: port for (body, _), port in port_of.items()}
    for (body, interface), port in port_of.items():
        own = body not in (CRANK, BLOCK) and turns_whole(topology.body(body).reduced, 1)
        owner = at.OF_CRANK if body == CRANK else at.OF_BLOCK if body == BLOCK else names.index(body)
        reduced = reduced_of[body]
        fixed = np.zeros(2) if reduced is None else reduced.positions[reduced.index(interface)][:2]
        found.append([owner, port, port + 1, last[body] + PORTS if own else port + 5, *fixed.tolist()])
    return found


def _neighbours(
    count: int, newton: int, terms: Sequence[Any], port_of: Mapping[tuple[str, str], int], grouped: Mapping[str, int]
) -> tuple[Array, Array]:
    """Marks (C, C + 1) of components that couple with each other, and the order (n,) of elimination of all components.

    Components of a single added body or group come first, because they do not couple with those of another one.
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
    numbers_of: FrameNumbers,
    number: int,
) -> list[list[float]]:
    """Row of ``AddedConnections.leans`` if an end of connection ``number`` slides over a body, else none."""
    for sign, slider, wall in ((1.0, 0, 1), (-1.0, 1, 0)):
        own, body = connection.ends[slider], connection.ends[wall]
        frame = frames[slider]
        if frame.slider is not None and frames[wall] == REST and body.body != GROUND:
            beside = np.array(body.offset[:2]) - frame.moved(0.0)[[at.PLACE_X, at.PLACE_Y]]
            ports = [port_of[end.body, end.interface] for end in (own, body)]
            return [[number, sign, numbers_of[frame], ports[0], *own.offset[:2], ports[1], *beside]]
    return []


def _slide(pair: tuple[Direction, Direction], frames: Sequence[Frame], numbers_of: FrameNumbers) -> list[float]:
    """Row of ``AddedConnections.slides`` for a component along which a piston or rod frame moves past the other end."""
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
