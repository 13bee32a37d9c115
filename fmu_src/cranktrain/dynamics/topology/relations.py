"""Rigid gears as relations between rotations, which eliminate coordinates when a model is made.

A relation is Σ c_k Φ_k = 0 for the rotations Φ_k of its ends about z relative to their frames, whose own rotation
fulfils it already. Bodies joined by relations, directly or through others, form a group. The modal coordinates q of its
bodies, with unit inertia, are reduced to coordinates z that fulfil all relations,

    q = T z,    C T = 0,    Tᵀ T = 1,    Tᵀ diag(ω²) T diagonal.

Each body of the group is then described in z; modal damping keeps the diagonal of Tᵀ D T.

The crank may lead a group. Its first six modes remain the rigid motions of the crank, with which all bodies of the
group turn in the ratios of their frames; other free motions follow, then elastic modes by frequency.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array, ReducedBody, damping_in_modes, in_modes, turning_stiffness
from cranktrain.dynamics.topology.laws import connection_law, relations_of
from cranktrain.dynamics.topology.values import BLOCK, CRANK, GROUND, Body, Connection, Topology

INDEPENDENT = 1.0e-12
"""Singular value above which a relation between rotations counts as independent of all other relations."""
FREE = 1.0e-12
"""Fraction of the largest squared frequency of a group below which a motion counts as free."""
RIGID, ROTATION = 6, 5
"""Number of rigid modes of a body, and index of its rotation about z among them."""


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


class JoinedCrank(NamedTuple):
    """Crank in the modes that it has in common with bodies joined to it by relations.

    Attributes
    ----------
    body : the crank in z common modes, with their damping
    own : (r, z) modal coordinates of the crank before, in the common modes
    parts : by body (n, z) its modal coordinates in the common modes
    """

    body: ReducedBody
    own: Array
    parts: dict[str, Array]


def groups(topology: Topology) -> list[Group]:
    """Groups of all added bodies that are not joined to the crank.

    ``InputError`` for a relation that holds the block, or contradicts frames.
    """
    return [_group(topology, [topology.body(name) for name in names], rows) for names, rows in _joined(topology)[1:]]


def joined_crank(topology: Topology, crank: ReducedBody, damping: Array) -> JoinedCrank | None:
    """Crank with modal ``damping`` (r,), 1/s, in common modes with bodies joined to it; None if there are none."""
    names, rows = _joined(topology)[0]
    if not rows:
        return None
    bodies = [Body(CRANK, replace(crank, damping=damping), CRANK), *map(topology.body, names[1:])]
    group = _group(topology, bodies, rows)
    own, *others = group.parts or []
    whole = replace(crank, stress_stiffness=turning_stiffness(crank) + crank.centrifugal)
    body = replace(in_modes(whole, own, group.omega), damping=group.damping)
    return JoinedCrank(body, own, dict(zip(names[1:], others, strict=True)))


def drive_train(topology: Topology, joined: Collection[str], start: str) -> list[Group]:
    """Groups of bodies through which the crank turns the body ``start``, itself included.

    Empty if the crank or a body ``joined`` to it by relations is the start. ``InputError`` if nothing turns this body.
    """
    if start in (CRANK, *joined):
        return []
    ends = [
        {end.body for end in connection.ends}
        for connection in topology.connections
        if connection_law(connection.law, connection.name).turns
    ]
    found, ahead, own = {start}, {CRANK, *joined}, {BLOCK, GROUND}
    for _ in ends:
        found |= {name for pair in ends if pair & (found - ahead) for name in pair - own}
    if not found & ahead:
        raise InputError(
            f"drive_line.start: no connection turns body '{start}' with the crank; join them by gears, a coupling or "
            "an axial_joint"
        )
    return [group for group in groups(topology) if any(body.name in found - ahead for body in group.bodies)]


_Row = tuple[Connection, Array]


def _joined(topology: Topology) -> list[tuple[list[str], list[_Row]]]:
    """Names of the bodies of each group with the relations between them; the crank's group comes first."""
    rows = [
        (connection, row)
        for connection in topology.connections
        for row in relations_of(connection, [topology.end_frame(end) for end in connection.ends])
    ]
    leader = {name: name for name in (CRANK, *(body.name for body in topology.bodies))}
    for connection, _ in rows:
        names = _held(connection)
        first = leader[names[0]]
        others = {leader[name] for name in names}
        leader = {name: first if own in others else own for name, own in leader.items()}
    return [
        (
            [body for body, own in leader.items() if own == name],
            [row for row in rows if leader[_held(row[0])[0]] == name],
        )
        for name in dict.fromkeys(leader.values())
    ]


def _held(connection: Connection) -> list[str]:
    names = [end.body for end in connection.ends if end.body != GROUND]
    if BLOCK in names:
        raise InputError(
            f"connection '{connection.name}': law '{connection.law}' holds no block that moves, because it has no "
            "force that would act on the mounts; take a gear_mesh, hold this end to the block by a coupling, or choose "
            "block level ground"
        )
    if not names:
        raise InputError(f"connection '{connection.name}': all its ends are at rest; join two bodies")
    return names


def _group(topology: Topology, bodies: Sequence[Body], rows: Sequence[_Row]) -> Group:
    reduced = [body.reduced for body in bodies]
    omega = np.concatenate([body.omega for body in reduced])
    damping = np.concatenate([body.damping if body.damping.size else np.zeros(body.n_modes) for body in reduced])
    if not rows:
        return Group(list(bodies), omega, damping, None)
    first = dict(zip((body.name for body in bodies), np.cumsum([0, *(b.n_modes for b in reduced)]), strict=False))
    own = {body.name: body.reduced for body in bodies}
    matrix = np.zeros((len(rows), omega.size))
    for line, (connection, coefficients) in zip(matrix, rows, strict=True):
        for end, coefficient in zip(connection.ends, coefficients, strict=True):
            if end.body == GROUND:
                continue
            body = own[end.body]
            if end.interface not in body.interfaces:
                raise InputError(
                    f"connection '{connection.name}': body '{end.body}' has no interface '{end.interface}'"
                )
            at = int(first[end.body])
            turn = body.shapes[body.index(end.interface), ROTATION]
            line[at : at + body.n_modes] += coefficient * topology.end_frame(end).sense * turn
        line /= np.linalg.norm(line)
    rigid = _rigid_motions(topology, bodies, first, matrix)
    free = _null(np.vstack((matrix, rigid.T)))
    squares, modes = np.linalg.eigh(free.T @ (omega[:, None] ** 2 * free))
    squares[squares < FREE * squares.max(initial=0.0)] = 0.0
    kept = np.hstack((rigid, free @ modes))
    joined = np.sqrt(np.concatenate((np.zeros(rigid.shape[1]), squares)))
    parts = np.split(kept, np.cumsum([body.n_modes for body in reduced])[:-1])
    return Group(list(bodies), joined, damping_in_modes(damping, omega, kept, joined), parts)


def _rigid_motions(topology: Topology, bodies: Sequence[Body], first: dict[str, int], matrix: Array) -> Array:
    """Orthonormal motions (n, 6) of a crank that leads the group, as a rigid body; (n, 0) without a crank.

    All other bodies turn in the ratios of their frames. The rotation about the axis comes first in the Gram-Schmidt
    process, so that it remains pure.
    """
    found = np.zeros((matrix.shape[1], RIGID))
    if bodies[0].name != CRANK:
        return found[:, :0]
    found[:RIGID] = np.eye(RIGID)
    for body in bodies[1:]:
        at, frame = int(first[body.name]), topology.frame(body.frame)
        follows = frame.rate * body.reduced.euler_load
        found[at : at + body.reduced.n_modes] = np.outer(follows, bodies[0].reduced.shapes[0, ROTATION, :RIGID])
    allowed = _null(matrix)
    order = [ROTATION, *range(ROTATION)]
    basis, triangle = np.linalg.qr((allowed @ (allowed.T @ found))[:, order])
    found[:, order] = basis * np.sign(np.diag(triangle))
    return found


def _null(matrix: Array) -> Array:
    """Orthonormal basis of the vectors that fulfil all relations, rows of ``matrix``."""
    _, sizes, rows_of = np.linalg.svd(matrix)
    return np.asarray(rows_of[int(np.sum(sizes > INDEPENDENT)) :].T)
