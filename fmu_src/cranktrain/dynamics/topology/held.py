"""Whether connections hold all added bodies, and whether rigid gears drive each of them once.

A rigid motion of the bodies that moves no component of any connection is held by nothing. Gas, loads and rods push and
do not hold, and a liner holds across its cylinder. A body that turns may be free to turn about its own axis.
"""

import math

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.topology import slots as at
from cranktrain.dynamics.topology.laws import pieces_of, relations_of
from cranktrain.dynamics.topology.terms import terms_of
from cranktrain.dynamics.topology.values import GROUND, Body, Topology

WAYS = ("along x", "along y", "along z", "against tilting about x", "against tilting about y", "against turning")
AT = 0.35
"""Crank angle (rad) of the check, at which no rod stands upright; chosen."""
HELD = 1.0e-9
"""Singular value of unit motions above which it counts; chosen."""


def check_held(topology: Topology) -> None:
    """Raise ``InputError`` for a body that nothing holds, and for rigid gears between bodies that others join."""
    _check_relations(topology)
    bodies = topology.bodies
    if not bodies:
        return
    first = {body.name: 6 * k for k, body in enumerate(bodies)}
    reach = max((float(np.ptp(body.reduced.positions, axis=0).max()) for body in bodies), default=0.0)
    rows = np.array(_motions(topology, bodies, first)).reshape(-1, 6 * len(bodies))
    rows[:, [k for k in range(6 * len(bodies)) if k % 6 > 2]] /= max(reach, 1e-3)
    # Tilts that nothing prevents are told first; a displacement counts as free if it is so without these.
    tilts = dict[str, list[int]]()
    for body in bodies:
        tilts[body.name] = []
        for way in (3, 4):
            more = np.vstack((rows, np.eye(6 * len(bodies))[first[body.name] + way]))
            if np.linalg.matrix_rank(more, HELD) > np.linalg.matrix_rank(rows, HELD):
                tilts[body.name].append(way)
                rows = more
    _, sizes, vectors = np.linalg.svd(np.vstack((rows, np.zeros((6 * len(bodies), 6 * len(bodies))))))
    free = np.abs(vectors[sizes <= HELD]).max(axis=0, initial=0.0) > math.sqrt(HELD)
    for body in bodies:
        ways = (0, 1, 2) if topology.frame(body.frame).slider is None else (0, 1, 2, 5)
        loose = sorted([*tilts[body.name], *(way for way in ways if free[first[body.name] + way])])
        if loose:
            raise InputError(
                f"body '{body.name}': no connection holds it {', '.join(WAYS[way] for way in loose)}; add one, such as "
                "a film, a spring, or a thrust"
            )


def _motions(topology: Topology, bodies: tuple[Body, ...], first: dict[str, int]) -> list[Array]:
    """Motion of each component that holds, by rigid motions of bodies about the origins of their frames."""
    rows = []
    for connection in topology.connections:
        frames = [topology.end_frame(end) for end in connection.ends]
        for piece in pieces_of(connection, *frames):
            for pair in piece.components[: piece.holds]:
                row = np.zeros(6 * len(bodies))
                for end, frame, direction in zip(connection.ends, frames, pair, strict=True):
                    if end.body not in first:
                        continue
                    body = topology.body(end.body).reduced
                    place = body.positions[body.index(end.interface)].copy()
                    place[2] -= body.positions[:, 2].mean()
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
