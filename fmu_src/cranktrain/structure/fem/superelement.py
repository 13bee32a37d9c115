"""Reduced body of a superelement that another program condensed.

Its stiffness K and mass M belong to displacements and rotations of retained nodes, and to modal coordinates that move
no retained node (fixed-interface modes of Craig and Bampton). Modes, frequencies and interface shapes follow from K and
M without loss. The rigid modes are the exact motions of the nodes. The body is refused if K resists them, or if M in
these motions is not the mass of a rigid body.

The terms of rotation (G, C, K_σ and the loads of rotation) need the distribution of mass in space, which K and M do not
contain. The mass is lumped at the nodes. Each node carries a rigid slice (:mod:`cranktrain.core.rigid_slices`)
with the same response to a rigid acceleration as the node's rows of M. All slices together have the mass, centre and
inertia of M. In rigid motion these terms are therefore exact, and an elastic mode's slices have no momentum. Left out
are

* motion of elastic modes between retained nodes, modal coordinates included: ``slice_mass_error`` of the quality is the
  deviation of the slices' modal mass from 1;
* the stress of the centrifugal load between elastic modes; its work on the slices' rotations is included.

Reference: R. Craig and A. Kurdila, *Fundamentals of Structural Dynamics* (2006), chapter 17.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cholesky, eigh, qr, solve_triangular

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import ReducedBody, signed, sliced_body
from cranktrain.core.rigid_slices import Slices, fields, rigid_modes, rigid_motion, second_moments, skew
from cranktrain.core.types import Array

RIGID_SHARE = 0.01
"""Limit of a rigid motion's frequency over the first elastic frequency; seven-digit matrices stay far below it."""
MASS_SHARE = 1e-3
"""Largest relative deviation of the mass in rigid motions from that of a rigid body."""
CHECKED_HZ = 1000.0
"""Frequency, Hz, up to which the modal mass of slices is checked."""


@dataclass(frozen=True, eq=False)
class Superelement:
    """Condensed matrices of a superelement, SI.

    Attributes
    ----------
    source : name used in messages
    stiffness, mass : (n, n)
    nodes, components : (n,) node of each row, and 0–5: displacement along x, y, z, rotation about x, y, z
    places : node → position (3,), m; nodes without a position are modal coordinates
    interfaces : name → one node, or several nodes whose mean motion it follows
    """

    source: str
    stiffness: Array
    mass: Array
    nodes: NDArray[np.int_]
    components: NDArray[np.int_]
    places: Mapping[int, Array]
    interfaces: Mapping[str, tuple[int, ...]]
    digest: str = ""

    def rows(self, node: int) -> dict[int, int]:
        """Row of the matrices for each retained component (from 0) of a node."""
        return {int(self.components[row]): int(row) for row in np.flatnonzero(self.nodes == node)}

    def rigid_motions(self) -> Array:
        """Translations along and rotations about x, y, z through the origin, (n, 6); zero in modal coordinates."""
        result = np.zeros((self.nodes.size, 6))
        for node, place in self.places.items():
            motion = rigid_motion(place[None])[0]
            for component, row in self.rows(node).items():
                result[row] = motion[component]
        return result


def superelement_body(element: Superelement, name: str) -> ReducedBody:
    """Reduced body of a superelement in all its modes.

    Raises ``InputError``: a stiffness that resists rigid motion, a mass that is not that of a body, an interface that
    is not determined by its nodes.
    """
    motions = element.rigid_motions()
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            inertia = _rigid_inertia(element, motions)
            coefficients = rigid_modes(inertia)
            omega, modes = _modes(element, motions @ coefficients)
    except (ValueError, LinAlgError):
        raise InputError(
            f"{element.source}: values of the matrices or coordinates are too large for any body; check units and "
            "exponents, or export the files again"
        ) from None
    positions, averaging = _interfaces(element)
    shapes = (averaging @ modes).reshape(-1, 6, omega.size)
    signs = signed(shapes)
    signs[:6] = 1.0
    modes, shapes = modes * signs, shapes * signs
    slices, motion, error = _sliced(element, motions, inertia, coefficients, omega, modes)
    body = sliced_body(
        name, element.digest, positions, slices, omega, shapes, motion, np.zeros((omega.size, omega.size))
    )
    quality = {"dofs_full": float(omega.size), "slice_mass_error": error, "rigid_hz": _rigid_hz(element, modes[:, :6])}
    return replace(body, quality=quality, records=_sections(body, slices))


def _rigid_inertia(element: Superelement, motions: Array) -> Array:
    """Mass matrix (6, 6) in the rigid motions; ``InputError`` if it is not that of a rigid body."""
    raw = np.asarray_chkfinite(motions.T @ element.mass @ motions)
    mass, first = float(np.trace(raw[:3, :3]) / 3.0), _axial(raw[3:, :3])
    rigid = np.zeros((6, 6))
    rigid[:3, :3], rigid[3:, :3], rigid[:3, 3:] = mass * np.eye(3), skew(first), -skew(first)
    rigid[3:, 3:] = 0.5 * (raw[3:, 3:] + raw[3:, 3:].T)
    size = np.sqrt(np.abs(np.diag(rigid)))
    off = np.abs(raw - rigid).max() if mass <= 0.0 else np.max(np.abs(raw - rigid) / np.outer(size, size))
    if not (mass > 0.0 and np.linalg.eigvalsh(rigid)[0] > 0.0 and off < MASS_SHARE):
        raise InputError(
            f"{element.source}: the mass in rigid motions is not a rigid body's ({mass:.4g} kg, off by {off:.1g}); "
            "give consistent or lumped mass of the whole free body, and coordinates of all retained nodes"
        )
    return rigid


def _modes(element: Superelement, rigid: Array) -> tuple[Array, Array]:
    """ω (n,) and modes (n, n) of unit modal mass, rigid modes first; ``InputError`` if K resists the rigid modes."""
    try:
        factor = cholesky(element.mass, lower=True)
    except LinAlgError:
        raise InputError(
            f"{element.source}: the mass is not positive: some retained motion has none; condense it, or use "
            "consistent mass"
        ) from None
    complete, _ = qr(factor.T @ rigid)
    space = solve_triangular(factor, complete[:, 6:], trans="T", lower=True)
    squares, turn = eigh(space.T @ element.stiffness @ space)
    hz = _rigid_hz(element, rigid)
    first = float(np.sqrt(max(squares[0], 0.0)) / (2.0 * np.pi))
    if not (first > 0.0 and hz <= RIGID_SHARE * first):
        loads = np.abs(element.stiffness @ rigid).max(axis=1)
        node = int(element.nodes[int(np.argmax(loads))])
        unplaced = sorted(set(element.nodes.tolist()) - set(element.places))
        added = f"; nodes without place: {', '.join(map(str, unplaced[:5]))}" if unplaced else ""
        raise InputError(
            f"{element.source}: rigid motion is resisted ({hz:.3g} Hz, first elastic mode {first:.4g} Hz), most at "
            f"node {node}{added}; condense the free body, without supports, and give every node its place and unit"
        )
    return np.concatenate((np.zeros(6), np.sqrt(squares))), np.hstack((rigid, space @ turn))


def _rigid_hz(element: Superelement, rigid: Array) -> float:
    """Largest frequency of a rigid motion that results from the stiffness, Hz."""
    squares = np.linalg.eigvalsh(rigid.T @ element.stiffness @ rigid)
    return float(np.sqrt(np.abs(squares).max()) / (2.0 * np.pi))


def _interfaces(element: Superelement) -> tuple[dict[str, tuple[float, float, float]], Array]:
    """Positions of the interfaces, and the rows (6 m, n) that give their motion."""
    positions, averaging = {}, np.zeros((6 * len(element.interfaces), element.nodes.size))
    for k, (name, nodes) in enumerate(element.interfaces.items()):
        place = np.mean([element.places[node] for node in nodes], axis=0)
        positions[name] = (float(place[0]), float(place[1]), float(place[2]))
        block = averaging[6 * k : 6 * k + 6]
        rows = [element.rows(node) for node in nodes]
        if len(nodes) == 1 and len(rows[0]) == 6:
            for component, row in rows[0].items():
                block[component, row] = 1.0
            continue
        # The interface follows the rigid motion that fits the displacements of its nodes best.
        arms = np.array([element.places[node] for node in nodes]) - place
        followed = rigid_motion(arms)[:, :3].reshape(-1, 6)
        moved = [at.get(c, -1) for at in rows for c in range(3)]
        if -1 in moved or np.linalg.matrix_rank(followed) < 6:
            raise InputError(
                f"{element.source}: interface '{name}' does not follow from its nodes {', '.join(map(str, nodes))}; "
                "name one with six components, or three or more off a line with three"
            )
        block[:, moved] = np.linalg.pinv(followed)
    return positions, averaging


def _sliced(
    element: Superelement, motions: Array, inertia: Array, coefficients: Array, omega: Array, modes: Array
) -> tuple[Slices, Array, float]:
    """Slices of the nodes, their motion (s, 6, n) in the modes, and the largest error of their modal mass."""
    carriers = [node for node in element.places if {0, 1, 2} <= set(element.rows(node))]
    if not carriers:
        raise InputError(f"{element.source}: no node has all three displacements; retain them")
    places = np.array([element.places[node] for node in carriers])
    answers = element.mass @ motions
    moments, motion = np.zeros((len(carriers), 4, 4)), np.zeros((len(carriers), 6, omega.size))
    for k, node in enumerate(carriers):
        rows = element.rows(node)
        felt = np.zeros((6, 6))
        felt[list(rows)] = answers[list(rows.values())]
        moments[k] = _moments(felt @ np.linalg.inv(rigid_motion(places[k : k + 1])[0]))
        motion[k, list(rows), 6:] = modes[list(rows.values()), 6:]
    slices = _with_total(places, moments, _moments(inertia))
    rigid = rigid_motion(places) @ coefficients
    motion[:, :, :6] = rigid
    # Elastic modes have no momentum with the mass matrix, so the momentum of their slices is removed too.
    elastic = motion[:, :, 6:]
    motion[:, :, 6:] = elastic - rigid @ slices.paired(fields(rigid), fields(elastic))
    elastic = motion[:, :, 6:][:, :, omega[6:] < 2.0 * np.pi * CHECKED_HZ]
    carried = np.diag(slices.paired(fields(elastic), fields(elastic))) if elastic.shape[2] else np.ones(1)
    return slices, motion, float(np.abs(carried - 1.0).max())


def _moments(felt: Array) -> Array:
    """Mass moments (4, 4) of the rigid slice that best fits the inertia forces (6, 6) of a node in rigid motion."""
    moments = np.zeros((4, 4))
    moments[0, 0] = np.trace(felt[:3, :3]) / 3.0
    moments[0, 1:] = moments[1:, 0] = 0.5 * (_axial(felt[3:, :3]) - _axial(felt[:3, 3:]))
    moments[1:, 1:] = second_moments(0.5 * (felt[3:, 3:] + felt[3:, 3:].T))
    return moments


def _with_total(places: Array, moments: Array, total: Array) -> Slices:
    """Slices corrected to the sum of moments ``total`` about the origin; the difference is distributed by mass."""
    missing = total - Slices(places, moments).total()
    back = np.tile(np.eye(4), (len(places), 1, 1))
    back[:, 1:, 0] = -places
    share = moments[:, 0, 0] / moments[:, 0, 0].sum()
    return Slices(places, moments + share[:, None, None] * (back @ missing @ back.swapaxes(1, 2)))


def _axial(matrix: Array) -> Array:
    """Axial vector v of the skew part of a matrix, r ↦ v×r."""
    odd = 0.5 * (matrix - matrix.T)
    return np.array([odd[2, 1], odd[0, 2], odd[1, 0]])


def _sections(body: ReducedBody, slices: Slices) -> dict[str, Array]:
    """Mass and inertia of slices around each interface on the axis, as ``structure.crank.reduction.sections``."""
    across = np.hypot(*body.positions[:, :2].T)
    on_axis = np.flatnonzero(across < 1e-3 * np.abs(body.positions).max())
    rows = np.array([row for row in on_axis if body.interfaces[row] != "thrust"], dtype=int)
    if not rows.size:
        return {}
    rows = rows[np.argsort(body.positions[rows, 2])]
    z = body.positions[rows, 2]
    nearest = np.searchsorted(0.5 * (z[1:] + z[:-1]), slices.places[:, 2])
    arms = np.tile(np.eye(4), (len(slices.places), 1, 1))
    arms[:, 1:, 0] = slices.places
    arms[:, 3, 0] -= z[nearest]
    about = arms @ slices.moments @ arms.swapaxes(1, 2)
    radial = about[:, 1, 1] + about[:, 2, 2]
    values = {"mass": about[:, 0, 0], "polar": radial, "diametral": 0.5 * radial + about[:, 3, 3]}
    gathered = {f"section_{kind}": np.bincount(nearest, one, rows.size) for kind, one in values.items()}
    return {"section_interface": rows.astype(float), **gathered}
