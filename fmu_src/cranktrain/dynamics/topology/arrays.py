"""Bodies and connections as flat arrays of the running model, packed one after the other with offsets.

The modes of added bodies come after all others, their ports after those of the block. Each interface that a connection
holds adds all its six components as ports, on crank and block too. The matrices of all bodies are rows of one table, as
wide as the largest body; those of a body start at its offset.
"""

import math
import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.topology.body_arrays import body_arrays, fastest
from cranktrain.dynamics.topology.connection_arrays import connection_arrays
from cranktrain.dynamics.topology.records import Base, Bodies, FrameNumbers, Links
from cranktrain.dynamics.topology.relations import groups
from cranktrain.dynamics.topology.terms import PORTS
from cranktrain.dynamics.topology.values import BLOCK, CRANK, GROUND, REST, End, Topology
from cranktrain.film.laws.films import Films, IntArray


class Laid(NamedTuple):
    """Bodies and connections of a topology: arrays, and further ports of crank and block."""

    bodies: list[Bodies]  # of each body
    fastest: Array  # (FASTEST_SIZE,) highest speeds of frames, see slots
    connections: Links
    rows: IntArray  # (K, CONNECTION) rows of the connections, see dynamics.model.slots
    laws: Films  # their force laws
    crank: Array  # (·, n_t) shapes of further ports of the crank and of bodies joined to it
    block: Array  # (·, n_b) shapes of further ports of the block
    omega: Array  # (N,) natural frequencies of added bodies, rad/s
    damping: Array  # (N,) modal damping of added bodies, 1/s


def lay_topology(topology: Topology, base: Base) -> Laid:
    """Arrays of the bodies and connections of a topology in a running model.

    Raises
    ------
    InputError
        an interface that a body lacks, ends that a law does not join
    """
    topology = topology if base.block is not None else on_ground(topology)
    held = _held(topology, base)
    topology = _touching(topology, base)
    _check_distances(topology, base)
    crank_ports, block_ports = held.pop(CRANK, {}), held.pop(BLOCK, {})
    joined = [group for group in groups(topology) if group.bodies[0].name not in base.joined]
    on_crank = [topology.body(name) for name in base.joined]
    frames = FrameNumbers.of_engine()
    bodies, more, port_of = body_arrays(
        topology, on_crank, joined, held, base, len(crank_ports), len(block_ports), frames
    )
    for k, name in enumerate(crank_ports):
        port_of[CRANK, name] = base.turning_ports + PORTS * k
    for k, name in enumerate(block_ports):
        port_of[BLOCK, name] = base.turning_ports + PORTS * len(crank_ports) + len(more) + base.block_ports + PORTS * k
    names = [*base.joined, *(body.name for group in joined for body in group.bodies)]
    grouped = dict.fromkeys(base.joined, -1) | {body.name: k for k, group in enumerate(joined) for body in group.bodies}
    connections, rows, laws = connection_arrays(
        topology, names, port_of, frames, grouped, base.films, _bodies(topology, base), base.rows
    )
    return Laid(
        bodies,
        fastest(topology),
        connections,
        rows,
        laws,
        np.concatenate((_shapes(base.crank, list(crank_ports)), more)),
        _shapes(base.block, list(block_ports)),
        np.concatenate([np.zeros(0), *(group.omega for group in joined)]),
        np.concatenate([np.zeros(0), *(group.damping for group in joined)]),
    )


def on_ground(topology: Topology) -> Topology:
    """Topology with a rigid block at rest: all ends on the block are moved to the ground."""

    def end(given: End) -> End:
        return End(GROUND) if given.body == BLOCK else given

    connections = tuple(
        replace(connection, ends=tuple(end(one) for one in connection.ends)) for connection in topology.connections
    )
    return replace(topology, connections=connections)


def _touching(topology: Topology, base: Base) -> Topology:
    """Topology in which ends on bodies at rest are moved to where the sliding opposite ends are at crank angle 0."""
    own: Mapping[str, ReducedBody | None] = {BLOCK: base.block, **{body.name: body.reduced for body in topology.bodies}}
    connections = list(topology.connections)
    for k, connection in enumerate(connections):
        frames = [topology.end_frame(end) for end in connection.ends]
        for number, (frame, other) in enumerate(zip(frames, frames[::-1], strict=True) if len(frames) == 2 else ()):
            end, slider = connection.ends[number], connection.ends[1 - number]
            wall, moving = own.get(end.body), own.get(slider.body)
            if frame != REST or other.slider is None or wall is None or moving is None:
                continue
            x, y, z = _place(topology, moving, slider) - wall.positions[wall.index(end.interface)]
            ends = [slider, slider]
            ends[number] = replace(end, offset=(float(x), float(y), float(z)))
            connections[k] = replace(connection, ends=tuple(ends))
    return replace(topology, connections=tuple(connections))


def _place(topology: Topology, body: ReducedBody, end: End) -> Array:
    """Position (3,) of an end in the engine's axes at crank angle 0, m."""
    frame = topology.end_frame(end)
    turn = np.column_stack([frame.turned(axis) for axis in np.eye(3)])
    return np.asarray(frame.origin + turn.T @ (body.positions[body.index(end.interface)] + end.offset))


def _shapes(body: ReducedBody | None, names: list[str]) -> Array:
    n = 0 if body is None else body.n_modes
    rows = [body.shapes[body.index(name)] for name in names] if body is not None else []
    return np.concatenate([np.zeros((0, n)), *rows])


APART = 1.0e-3
"""Distance (m) between the ends of a spring or a bearing above which there is a warning."""
MEET = ("spring", "film", "roller", "thrust", "own")
"""Force laws whose two ends must coincide, because the moment of forces at a distance is not included."""


def _check_distances(topology: Topology, base: Base) -> None:
    """Warn of springs and bearings with ends apart at crank angle 0, because the moment of the forces is missing.

    ``InputError`` for plain and roller bearings that do not lie on the axes of the frames that turn.
    """
    own = _bodies(topology, base)
    for connection in topology.connections:
        if connection.law not in MEET:
            continue
        pairs = [(own.get(end.body), end) for end in connection.ends]
        known = [(end, _place(topology, body, end)) for body, end in pairs if body is not None]
        frames = [topology.end_frame(end) for end in connection.ends]
        turning = [frame for frame in frames if frame.rate > 0.0]
        alike = len({(frame.ratio, frame.axis) for frame in frames}) == 1
        if connection.law in ("film", "roller") and turning and not alike:
            for end, place in known:
                radius = math.dist(place[:2], turning[0].axis)
                if radius > APART and topology.end_frame(end).rate > 0.0:
                    raise InputError(
                        f"connection '{connection.name}': '{end.body}.{end.interface}' circles {1e3 * radius:.3g} mm "
                        f"from the axis of frame '{turning[0].name}'; a bearing joins interfaces on one axis"
                    )
        apart = float(np.linalg.norm(known[0][1] - known[-1][1])) if len(known) == len(pairs) else 0.0
        if apart > APART:
            warnings.warn(
                f"connection '{connection.name}': its ends are {1e3 * apart:.3g} mm apart at crank angle 0, and law "
                f"'{connection.law}' neglects the moment of this distance; move an interface, or give place",
                stacklevel=2,
            )


def _bodies(topology: Topology, base: Base) -> dict[str, ReducedBody | None]:
    """Every body of a model by name, None for a missing crank or block."""
    return {CRANK: base.crank, BLOCK: base.block, **{body.name: body.reduced for body in topology.bodies}}


def _held(topology: Topology, base: Base) -> dict[str, dict[str, None]]:
    """For each body, the interfaces that connections hold, in order of the connections."""
    own = _bodies(topology, base)
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
