"""Rigid gears as relations between rotations, which eliminate coordinates when a model is made.

A relation is Σ c_k Φ_k = 0 for the rotations Φ_k of its ends about z relative to their frames, whose own rotation
fulfils it already. Bodies joined by relations, directly or through others, form a group. The modal coordinates q of its
bodies, with unit inertia, are reduced to coordinates z that fulfil all relations,

    q = T z,    C T = 0,    Tᵀ T = 1,    Tᵀ diag(ω²) T diagonal.

Each body of the group is then described in z; modal damping keeps the diagonal of Tᵀ D T.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array, damping_in_modes
from cranktrain.dynamics.topology.laws import relations_of
from cranktrain.dynamics.topology.values import BLOCK, CRANK, GROUND, Body, Connection, Topology

INDEPENDENT = 1.0e-12
"""Singular value above which a relation between rotations counts as independent of all other relations."""


class Group(NamedTuple):
    """Group of bodies with common modes, or a single body with modes of its own.

    Attributes
    ----------
    bodies : bodies of the group, in the order of the topology
    omega, damping : angular frequency and damping of its modes, rad/s and 1/s
    parts : modal coordinates of each body in these modes (n, z); None for a single body without relations
    """

    bodies: list[Body]
    omega: Array
    damping: Array
    parts: list[Array] | None


def groups(topology: Topology) -> list[Group]:
    """Groups of all added bodies; ``InputError`` for a relation that holds crank or block, or contradicts frames."""
    rows = [
        (connection, row)
        for connection in topology.connections
        for row in relations_of(connection, [topology.end_frame(end) for end in connection.ends])
    ]
    leader = {body.name: body.name for body in topology.bodies}
    for connection, _ in rows:
        names = _joined(connection)
        first = leader[names[0]]
        others = {leader[name] for name in names}
        leader = {name: first if own in others else own for name, own in leader.items()}
    found = []
    for name in dict.fromkeys(leader.values()):
        bodies = [body for body in topology.bodies if leader[body.name] == name]
        own = [row for row in rows if leader[_joined(row[0])[0]] == name]
        found.append(_group(topology, bodies, own))
    return found


def _joined(connection: Connection) -> list[str]:
    names = [end.body for end in connection.ends if end.body != GROUND]
    if CRANK in names or BLOCK in names:
        raise InputError(
            f"connection '{connection.name}': law '{connection.law}' joins added bodies and the ground alone; take a "
            "coupling or a gear_mesh between one of them and the crank"
        )
    return names


def _group(topology: Topology, bodies: list[Body], rows: list[tuple[Connection, Array]]) -> Group:
    reduced = [body.reduced for body in bodies]
    omega = np.concatenate([body.omega for body in reduced])
    damping = np.concatenate([body.damping if body.damping.size else np.zeros(body.n_modes) for body in reduced])
    if not rows:
        return Group(bodies, omega, damping, None)
    first = dict(zip((body.name for body in bodies), np.cumsum([0, *(b.n_modes for b in reduced)]), strict=False))
    matrix = np.zeros((len(rows), omega.size))
    for line, (connection, coefficients) in zip(matrix, rows, strict=True):
        for end, coefficient in zip(connection.ends, coefficients, strict=True):
            if end.body == GROUND:
                continue
            body = topology.body(end.body).reduced
            at = int(first[end.body])
            turn = body.shapes[body.index(end.interface), 5]
            line[at : at + body.n_modes] += coefficient * topology.end_frame(end).sense * turn
        line /= np.linalg.norm(line)
    _, sizes, rows_of = np.linalg.svd(matrix)
    free = rows_of[int(np.sum(sizes > INDEPENDENT)) :].T
    squares, modes = np.linalg.eigh(free.T @ (omega[:, None] ** 2 * free))
    kept, joined = free @ modes, np.sqrt(np.maximum(squares, 0.0))
    parts = np.split(kept, np.cumsum([body.n_modes for body in reduced])[:-1])
    return Group(bodies, joined, damping_in_modes(damping, omega, kept, joined), parts)
