"""Whether connections hold all added bodies, and whether rigid gears drive each of them once.

A rigid motion of the bodies that moves no component of any connection is held by nothing. Gas, loads and rods push and
do not hold, and a liner holds across its cylinder. A body that turns may be free to turn about its own axis.
"""

from __future__ import annotations

import math

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.topology import slots as at
from cranktrain.dynamics.topology.gas import gas_law
from cranktrain.dynamics.topology.laws import pieces_of, relations_of
from cranktrain.dynamics.topology.liner import liner_law
from cranktrain.dynamics.topology.spring import load_law
from cranktrain.dynamics.topology.terms import terms_of
from cranktrain.dynamics.topology.values import GROUND, Body, Topology

WAYS = ("along x", "along y", "along z", "against tilting about x", "against tilting about y", "against turning")
AT = 0.35
"""Crank angle (rad) of the check, at which no rod stands upright; chosen."""
HELD = 1.0e-9
"""Ratio of singular values, and size of a unit motion's part, above which it counts; chosen."""


def check_held(topology: Topology) -> None:
    """Raise ``InputError`` for a body that no connection holds, and for rigid gears that turn a body once more."""
    _check_relations(topology)
    bodies = topology.bodies
    if not bodies:
        return
    first = {body.name: 6 * k for k, body in enumerate(bodies)}
    reach = max((float(np.ptp(body.reduced.positions, axis=0).max()) for body in bodies), default=0.0)
    rows = np.array(_motions(topology, bodies, first)).reshape(-1, 6 * len(bodies))
    rows[:, [k for k in range(6 * len(bodies)) if k % 6 > 2]] /= max(reach, 1e-3)
    _, sizes, vectors = np.linalg.svd(
        np.vstack((rows, np.zeros((6 * len(bodies), 6 * len(bodies))))), full_matrices=False
    )
    free = np.abs(vectors[sizes <= HELD * max(1.0, sizes.max(initial=0.0))]).max(axis=0, initial=0.0)
    for body in bodies:
        loose = free[first[body.name] : first[body.name] + 6] > math.sqrt(HELD)
        if topology.frame(body.frame).slider is None:
            loose[5] = False
        if loose.any():
            ways = ", ".join(way for way, is_loose in zip(WAYS, loose, strict=True) if is_loose)
            raise InputError(
                f"body '{body.name}': no connection holds it {ways}; add one, such as a film, a spring, or a thrust"
            )


def _motions(topology: Topology, bodies: tuple[Body, ...], first: dict[str, int]) -> list[Array]:
    """Motion of each component that holds, by rigid motions of bodies about the middles of their interfaces."""
    rows = []
    for connection in topology.connections:
        frames = [topology.end_frame(end) for end in connection.ends]
        for piece in pieces_of(connection, *frames):
            holding = 0 if piece.has_mass else {gas_law: 0, load_law: 0, liner_law: 2}.get(piece.kernel, 4)
            for pair in piece.components[:holding]:
                row = np.zeros(6 * len(bodies))
                for end, frame, direction in zip(connection.ends, frames, pair, strict=True):
                    if end.body not in first:
                        continue
                    body = topology.body(end.body).reduced
                    place = body.positions[body.index(end.interface)] - body.positions.mean(axis=0)
                    own = row[first[end.body] : first[end.body] + 6]
                    for term in terms_of(end, frame, direction):
                        turned = term.given.moved(AT)[at.TURNED] - term.own.moved(AT)[at.TURNED]
                        share, way = term.amplitude * math.cos(turned + term.phase), np.eye(3)[term.component % 3]
                        if term.component > 2:
                            own[3:] += share * way
                        else:
                            own[:3] += share * way
                            own[3:] += share * np.cross(place, way)
                rows.append(row)
    return rows


def _check_relations(topology: Topology) -> None:
    """Raise ``InputError`` for a relation of rotations that follows from those before it."""
    places = {body.name: k for k, body in enumerate(topology.bodies)}
    rows = np.zeros((0, len(places)))
    for connection in topology.connections:
        for own in relations_of(connection, [topology.end_frame(end) for end in connection.ends]):
            row = np.zeros(len(places))
            for end, share in zip(connection.ends, own / np.linalg.norm(own), strict=True):
                if end.body != GROUND and end.body in places:
                    row[places[end.body]] += share
            more = np.vstack((rows, row))
            if np.linalg.matrix_rank(more, tol=HELD) < len(more):
                raise InputError(
                    f"connection '{connection.name}': rigid gears turn its bodies with this ratio already; leave it "
                    "out, or take a gear_mesh, whose force follows from its stiffness"
                )
            rows = more
