"""Arrays of added connections: addresses of laws, terms of components, and couplings between components."""

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.model import slots as model
from cranktrain.dynamics.topology import slots as at
from cranktrain.dynamics.topology.body_arrays import turns_whole
from cranktrain.dynamics.topology.gas import gas_law
from cranktrain.dynamics.topology.laws import pieces_of
from cranktrain.dynamics.topology.pieces import FilmParts, Piece
from cranktrain.dynamics.topology.records import FrameNumbers, Links
from cranktrain.dynamics.topology.spring import load_law
from cranktrain.dynamics.topology.terms import PORTS, Direction, Term, terms_of
from cranktrain.dynamics.topology.values import BLOCK, CRANK, GROUND, REST, Connection, End, Frame, Topology
from cranktrain.film.laws import films as on
from cranktrain.film.laws.bearings import enter
from cranktrain.film.laws.films import Films, IntArray, no_films
from cranktrain.film.laws.parameters import COLUMNS

KINDS = {
    "force": at.FORCE_KIND, "place": at.PLACE_KIND, "velocity": at.VELOCITY_KIND, "out": at.OUT_KIND,
}  # fmt: skip
BODY_KINDS = (
    (at.BODY_SPEED, 0), (at.BODY_TURN, 0), (at.BODY_PLACE, 0), (at.BODY_PLACE, 1), (at.BODY_PLACE, 2),
)  # fmt: skip
"""Kinds of an added body's outputs, in the order of the names of these outputs."""


class _Component(NamedTuple):
    """Component of a connection: its scale, slide, terms (without their component), and the bodies of these terms."""

    scale: float
    slide: list[float]
    entries: list[list[float]]
    bodies: list[int]
    groups: set[int]  # −1: crank or block


def connection_arrays(
    topology: Topology,
    names: list[str],
    port_of: Mapping[tuple[str, str], int],
    numbers_of: FrameNumbers,
    grouped: Mapping[str, int],
    films_of: FilmParts,
    reduced_of: Mapping[str, ReducedBody | None],
    before: int,
) -> tuple[Links, IntArray, Films]:
    """Arrays of K connections between bodies in the order of ``names``, their rows (K, CONNECTION) and force laws.

    Compiles the force laws. ``InputError`` if a film lacks a part.
    """
    found, taken, shown = list[list[_Component]](), {CRANK: at.OF_CRANK, BLOCK: at.OF_BLOCK}, []
    taken |= {name: at.OTHERS + k for k, name in enumerate(names)}
    groups = {CRANK: -1, BLOCK: -1} | dict(grouped)
    rows: list[list[float]] = []
    leans: list[list[float]] = []
    parts: list[FilmParts] = []
    pieces = [
        (connection, frames, piece)
        for connection in topology.connections
        for frames in [[topology.end_frame(end) for end in connection.ends]]
        for piece in pieces_of(connection, *frames)
    ]
    shown += [(at.OTHERS + names.index(body.name), *kind) for body in topology.bodies for kind in BODY_KINDS]
    for connection, frames, piece in pieces:
        size = len(piece.components)
        ports, senses = [], []
        for end, frame in zip(connection.ends, frames, strict=True):
            turns = piece.rubs and end.body != GROUND
            ports.append(port_of[end.body, end.interface] + 5 if turns else -1)
            senses.append(frame.sense * piece.axes.sense)
        rows.append([
            size, *[0] * 4, piece.pairs, ports[0], model.NO_PORT, ports[1], model.NO_PORT, model.OF_TERMS, 0,
            numbers_of[piece.axes], piece.axes.sense, *senses, *(numbers_of[frame] for frame in frames), piece.rubs,
            piece.cylinder - 1, piece.kernel is load_law or piece.carried, piece.input,
            model.GAS_WORK if piece.kernel is gas_law else model.LINKS_LOSS, model.LINKS_LOSS,
            model.NO_PORT, model.NO_PORT,
        ])  # fmt: skip
        leans += _leans(connection, frames, port_of, numbers_of, before + len(rows) - 1)
        found.append([])
        for pair, scale in zip(piece.components, piece.scales, strict=True):
            own: list[Term] = []
            slide = _slide(pair, frames, numbers_of)
            for end, frame, direction, other in zip(connection.ends, frames, pair, frames[::-1], strict=True):
                if end.body != GROUND:
                    over = other if frame == REST and other.slider is not None else None
                    own += terms_of(end, frame, direction, over)
            entries = [
                [
                    port_of[term.body, term.interface] + term.component, term.amplitude, numbers_of[term.given],
                    numbers_of[term.own], term.phase,
                    *((-1, 0, 0.0) if term.lever is None else
                      (numbers_of[term.lever], term.way, term.lever.moved(0.0)[at.PLACE_X + term.way])),
                ] for term in own
            ]  # fmt: skip
            bodies = [taken[term.body] for term in own]
            found[-1].append(_Component(scale, slide, entries, bodies, {groups[term.body] for term in own}))
        shown += [(before + len(rows) - 1, KINDS[kind], place) for _, kind, place in piece.outputs]
        held = connection.ends[0]
        body = reduced_of.get(held.body)
        first = np.zeros(3) if body is None else body.positions[body.index(held.interface)] + held.offset
        at_pin = held.body == CRANK and held.interface.startswith("pin[")
        parts.append(
            films_of._replace(at_main=at_main(connection.ends), at_pin=at_pin, first=first, connection=connection.name)
        )
        if piece.has_mass and connection.ends[1].body != GROUND:
            raise InputError(
                f"connection '{connection.name}': the cylinder of law '{connection.law}' is at rest; take block level "
                "ground, or rod and piston as bodies of their own"
            )
    # Laws of films read the rows of all bearings, so rows of other laws are filled with valid values.
    kept = [piece for _, _, piece in pieces]
    any_film = next((piece.parameters for piece in kept if piece.parameters is not None), np.zeros(COLUMNS))
    bearings = [any_film if piece.parameters is None else piece.parameters for piece in kept]
    films = _table(bearings, COLUMNS)
    interfaces = _interfaces(topology, taken, port_of, reduced_of)
    laid: list[_Component] = []
    for k in _elimination([set().union(*(one.groups for one in piece)) for piece in found]):
        first, size = len(laid), len(found[k])
        rows[k][model.GAP], rows[k][model.FIRST : model.FIRST + size] = first, range(first, first + size)
        laid += found[k]
    terms = [[number, *entry] for number, one in enumerate(laid) for entry in one.entries]
    starts = np.cumsum([0, *(len(one.entries) for one in laid)])
    meets = [[j for j, other in enumerate(laid) if one.groups & other.groups] for one in laid]
    table = _table(terms, at.TERM)
    loaded = np.unique([*table[:, at.TERM_PORT], *(row[3] for row in interfaces)])
    of_term = np.array([body for one in laid for body in one.bodies], dtype=np.int64)
    arrays = Links(
        _table([frame.row for frame in numbers_of], at.FRAME), table, starts.astype(np.int64),
        np.column_stack((table[:, at.TERM_PORT].astype(np.int64), of_term)),
        np.array([one.scale for one in laid], dtype=float), np.array([j for one in meets for j in one], dtype=np.int64),
        np.cumsum([0, *map(len, meets)]).astype(np.int64), np.array([-1 in one.groups for one in laid], dtype=np.int64),
        _table([one.slide for one in laid], at.SLIDES), _table(leans, at.LEAN), _table(interfaces, at.INTERFACE),
        loaded.astype(float), films, np.array([piece.viscosity for piece in kept]),
        np.array([piece.tilt for piece in kept]), _table(shown, at.SHOWN),
    )  # fmt: skip
    return arrays, _table(rows, model.CONNECTION).astype(np.int64), _laws(kept, films, parts)


def _laws(pieces: Sequence[Piece], bearings: Array, parts: Sequence[FilmParts]) -> Films:
    """Force laws of K pieces; ``bearings`` (K, COLUMNS) are the parameters of films. Compiles the laws."""
    films = no_films(len(pieces))
    for number, (piece, made) in enumerate(zip(pieces, parts, strict=True)):
        made_late = callable(piece.record)
        try:
            record = piece.record(bearings, made) if made_late else piece.record
        except InputError as error:
            raise InputError(f"connection '{made.connection}': {error}") from None
        enter(films, piece.kernel, record, [number])
        films.entry[number, 2] = number if made_late and piece.parameters is not None else 0
        films.traits[number, [on.CLOSES, on.VISCOUS, on.WARMS, on.TELLS_RATE, on.MASS]] = (
            piece.closes, piece.told_oil, piece.told_speed, piece.tells_rate, piece.has_mass,
        )  # fmt: skip
        films.traits[number, on.MEMORY] = 0.0 if piece.memory is None else piece.memory(record)
    return films


def at_main(ends: Sequence[End]) -> bool:
    """True if a connection between ``ends`` holds a main journal of the crank in its bore, or on a block at rest."""
    first, second = ends[:2]
    number = re.fullmatch(r"main(\[\d+\])", first.interface)
    if first.body != CRANK or number is None or any(first.offset) or any(second.offset):
        return False
    return second.body == GROUND or (second.body, second.interface) == (BLOCK, f"bore{number[1]}")


def _interfaces(
    topology: Topology, owners: Mapping[str, int], port_of: Mapping[tuple[str, str], int],
    reduced_of: Mapping[str, ReducedBody | None],
) -> list[list[float]]:  # fmt: skip
    """Rows of ``Links.interfaces``, one for each interface that a connection holds."""
    found, last = list[list[float]](), {body: port for (body, _), port in port_of.items()}
    for (body, interface), port in port_of.items():
        own = body not in (CRANK, BLOCK) and turns_whole(topology.body(body).reduced, 1)
        owner = owners[body]
        reduced = reduced_of[body]
        fixed = np.zeros(2) if reduced is None else reduced.positions[reduced.index(interface)][:2]
        found.append([owner, port, port + 1, last[body] + PORTS if own else port + 5, *fixed.tolist()])
    return found


def _elimination(groups: Sequence[set[int]]) -> list[int]:
    """Pieces in the order in which their components are eliminated, from the groups of bodies that each moves with.

    Pieces of a single group come first, group by group, because they do not couple with those of another one. Crank and
    block are the group −1, which couples all pieces that hold them.
    """
    alone = {k: min(own) for k, own in enumerate(groups) if len(own) == 1 and -1 not in own}
    return [*sorted(alone, key=lambda k: alone[k]), *(k for k in range(len(groups)) if k not in alone)]


def _leans(
    connection: Connection,
    frames: Sequence[Frame],
    port_of: Mapping[tuple[str, str], int],
    numbers_of: FrameNumbers,
    number: int,
) -> list[list[float]]:
    """Row of ``Links.leans`` if an end of connection ``number`` slides over a body, else none."""
    for sign, slider, wall in ((1.0, 0, 1), (-1.0, 1, 0)):
        own, body = connection.ends[slider], connection.ends[wall]
        frame = frames[slider]
        if frame.slider is not None and frames[wall] == REST and body.body != GROUND:
            beside = np.array(body.offset[:2]) - frame.moved(0.0)[[at.PLACE_X, at.PLACE_Y]]
            ports = [port_of[end.body, end.interface] for end in (own, body)]
            return [[number, sign, numbers_of[frame], ports[0], *own.offset[:2], ports[1], *beside]]
    return []


def _slide(pair: tuple[Direction, Direction], frames: Sequence[Frame], numbers_of: FrameNumbers) -> list[float]:
    """Row of ``Links.slides`` for a component along which a piston or rod frame moves past the other end."""
    apart = [frame.slider is not None and not frame.swings for frame in frames]
    resting = [frame == REST for frame in frames]
    slides = any(frame.slider is not None for frame in frames) and (any(resting) or all(apart))
    if not slides or frames[0] == frames[1]:
        return [-1.0, -1.0, 0.0, 0.0, 0.0]
    first, along = pair[0].frame, pair[0].sign * pair[0].along
    return [*(numbers_of[frame] for frame in frames), numbers_of[first], along[0], first.sense * along[1]]


def _table(rows: Sequence[Any], columns: int) -> Array:
    return np.array(rows, dtype=float).reshape(-1, columns)
