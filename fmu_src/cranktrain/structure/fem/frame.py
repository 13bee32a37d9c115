"""Timoshenko frames in three dimensions: members between nodes of six degrees of freedom, and their masses.

A beam of length L has local axes e_1 along it and e_2, e_3 across. Its interpolation solves the static Timoshenko
equations exactly (Φ = 12EI/(κGAL²)), so its stiffness is exact and its mass consistent. The mass is lumped into rigid
slices of the section at four Gauss points (:mod:`cranktrain.core.rigid_slices`), which integrates the cubic
interpolation exactly. The shear factor is Cowper's, for a circle κ = 6(1+ν)/(7+6ν).

A member may also be given by its flexibility between two nodes and its own slices. Loads of rotation and the stiffness
K_σ that they cause (axial forces of members, and rotation of slices about their nodes) have the same form as for any
body; e_z×u is evaluated for the motion of slices, not for nodal values.

References: J. Przemieniecki, *Theory of Matrix Structural Analysis* (1968), section 5.6; M. Friswell et al., *Dynamics
of Rotating Machines* (2010), section 5.4; G. Cowper, J. Appl. Mech. 33 (1966) 335.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from threadpoolctl import threadpool_limits

from cranktrain.core.reduced_body import ReducedBody, sliced_body
from cranktrain.core.rigid_slices import Slices, fields, rigid_motion, skew
from cranktrain.core.types import Array
from cranktrain.structure.fem.craig_bampton import reduced_basis

_POINTS, _WEIGHTS = (np.asarray(x, dtype=np.float64) for x in np.polynomial.legendre.leggauss(4))
_POINTS, _WEIGHTS = 0.5 * (1.0 + _POINTS), 0.5 * _WEIGHTS


@dataclass(frozen=True)
class Section:
    """Section of a beam in m², m⁴, kg/m, kg m; stiffness and mass may belong to different cross-sections.

    ``area``, ``bending`` I and ``torsion`` J are those of a section with equal properties in both transverse
    directions; ``shear`` is κA, ``mass`` mass per length, ``rotary`` ρI per length about a transverse axis.
    """

    area: float
    shear: float
    bending: float
    torsion: float
    mass: float
    rotary: float


@dataclass(frozen=True, eq=False)
class Member:
    """A member between two nodes: stiffness, slices, and geometric stiffness of a unit axial force.

    Attributes
    ----------
    nodes : (2,) indices
    stiffness : (12, 12) in global axes, displacement and rotation of the first node, then of the second
    slices : rigid slices of its mass, or None
    motion : (s, 6, 12) motion of the slices per nodal motion
    along : (12,) row that gives the member's axial force from the nodal motion, N/m
    tension : (12, 12) geometric stiffness of a unit axial force, 1/m
    levers : (2, s, 3) vectors from each node to the slices, each times the fraction by which the slice follows the node
    """

    nodes: tuple[int, int]
    stiffness: Array
    slices: Slices | None
    motion: Array
    along: Array
    tension: Array
    levers: Array | None = None


@dataclass
class Frame:
    """A frame of nodes and members, to which both can be added.

    Attributes
    ----------
    youngs_modulus, shear_modulus : Pa
    positions : position (3,) of each node, m
    """

    youngs_modulus: float
    shear_modulus: float
    positions: list[Array] = field(default_factory=list)
    members: list[Member] = field(default_factory=list)

    def node(self, position: Sequence[float]) -> int:
        """Add a node and return its index."""
        self.positions.append(np.asarray(position, dtype=float))
        return len(self.positions) - 1

    def beam(self, first: int, second: int, section: Section) -> None:
        """Add a straight beam between two nodes."""
        start = self.positions[first]
        span = self.positions[second] - start
        length = float(np.linalg.norm(span))
        axes = _axes(span / length)
        turn = np.kron(np.eye(4), axes)
        e, g = self.youngs_modulus, self.shear_modulus
        phi = 12.0 * e * section.bending / (g * section.shear * length**2)
        own = _beam_stiffness(e, g, section, length, phi)
        shapes = np.stack([_interpolation(x, length, phi) for x in _POINTS])
        motion = np.kron(np.eye(2), axes.T) @ shapes @ turn
        slopes = np.stack([_slopes(x, length, phi) for x in _POINTS]) @ turn
        law = np.diag([1.0, 1.0, 2.0 * section.bending / section.area])
        tension = length * np.einsum("s,sai,ab,sbj->ij", _WEIGHTS, slopes, law, slopes)
        slices = None
        if section.mass > 0.0:
            moments = np.zeros((4, 4, 4))
            across = np.eye(3) - np.outer(axes[0], axes[0])
            moments[:, 0, 0] = section.mass * length * _WEIGHTS
            moments[:, 1:, 1:] = section.rotary * length * _WEIGHTS[:, None, None] * across
            slices = Slices(start + _POINTS[:, None] * span, moments)
        along = np.zeros(12)
        along[:3], along[6:9] = -axes[0], axes[0]
        stiffness = turn.T @ own @ turn
        self.members.append(
            Member((first, second), stiffness, slices, motion, e * section.area / length * along, tension)
        )

    def flexible_link(self, first: int, second: int, flexibility: Array, slices: Slices, share: Array) -> None:
        """Add a member whose second node moves by ``flexibility`` (6, 6) under its loads with the first node clamped.

        Each of its ``slices`` moves with both nodes as if rigidly fixed to them, with weight ``share`` (s,) for the
        second.
        """
        span = self.positions[second] - self.positions[first]
        length = float(np.linalg.norm(span))
        carried = np.eye(6)
        carried[:3, 3:] = -skew(span)
        relative = np.hstack((-carried, np.eye(6)))
        clamped = np.linalg.inv(flexibility)
        stiffness = relative.T @ clamped @ relative
        axis = span / length
        across = np.hstack((-np.eye(3), np.zeros((3, 3)), np.eye(3), np.zeros((3, 3))))
        across = (np.eye(3) - np.outer(axis, axis)) @ across
        along = axis @ (clamped @ relative)[:3]
        shares = np.stack((1.0 - share, share))
        arms = np.stack([slices.places - self.positions[node] for node in (first, second)])
        motion = np.concatenate([rigid_motion(arm) * s[:, None, None] for arm, s in zip(arms, shares, strict=True)], 2)
        tension = across.T @ across / length
        levers = arms * shares[..., None]
        self.members.append(Member((first, second), stiffness, slices, motion, along, tension, levers))

    @threadpool_limits.wrap(limits=1, user_api="blas")
    def reduced(
        self,
        name: str,
        digest: str,
        interfaces: Mapping[str, int],
        fixed_modes: int,
        say: Callable[[str], None] = lambda stage: None,
    ) -> ReducedBody:
        """Reduced body of the frame: constraint modes of the ``interfaces`` (nodes by name) and fixed-interface modes.

        Raises ``SolverError`` if the eigenmodes are not found.
        """
        ndof = 6 * len(self.positions)
        places = np.array(self.positions)
        slices, motion = self._slices(ndof)
        mass = sparse.csc_matrix(slices.paired(fields(motion), fields(motion)))
        stiffness = self._assembled([member.stiffness for member in self.members])
        motions = rigid_motion(places).reshape(ndof, 6)
        rows = np.concatenate([np.arange(6 * node, 6 * node + 6) for node in interfaces.values()])
        averaging = sparse.csr_matrix((np.ones(rows.size), (np.arange(rows.size), rows)), shape=(rows.size, ndof))
        basis = reduced_basis(stiffness, mass, motions, averaging, min(fixed_modes, ndof - rows.size), say)
        load = slices.paired(fields(motion), slices.outward())
        stretched = basis.free.solve(load)[:, 0]
        tension = self._assembled(
            [self._force(member, stretched) * member.tension + _lever_turning(member) for member in self.members]
        )
        stress = basis.modes.T @ (tension @ basis.modes)
        at = {name: (float(places[k, 0]), float(places[k, 1]), float(places[k, 2])) for name, k in interfaces.items()}
        return sliced_body(name, digest, at, slices, basis.omega, basis.shapes, motion @ basis.modes, stress)

    def matrices(self) -> tuple[Array, Array]:
        """Stiffness and consistent mass (ndof, ndof), six degrees of freedom per node."""
        slices, motion = self._slices(6 * len(self.positions))
        mass = slices.paired(fields(motion), fields(motion))
        return self._assembled([member.stiffness for member in self.members]).toarray(), mass

    def _slices(self, ndof: int) -> tuple[Slices, Array]:
        """All slices and their motion (s, 6, ndof) per nodal motion."""
        places, moments, motions = [], [], []
        for member in self.members:
            if member.slices is None:
                continue
            places.append(member.slices.places)
            moments.append(member.slices.moments)
            motion = np.zeros((member.motion.shape[0], 6, ndof))
            motion[:, :, _dofs(member)] = member.motion
            motions.append(motion)
        return Slices(np.concatenate(places), np.concatenate(moments)), np.concatenate(motions)

    def _assembled(self, matrices: Sequence[Array]) -> sparse.csc_matrix:
        """Sum of the members' matrices (12, 12) in the frame's degrees of freedom."""
        ndof = 6 * len(self.positions)
        dofs = [_dofs(member) for member in self.members]
        rows = np.concatenate([np.repeat(d, 12) for d in dofs])
        columns = np.concatenate([np.tile(d, 12) for d in dofs])
        values = np.concatenate([matrix.ravel() for matrix in matrices])
        return sparse.csc_matrix((values, (rows, columns)), shape=(ndof, ndof))

    @staticmethod
    def _force(member: Member, displacement: Array) -> float:
        """Axial force of a member, N."""
        return float(member.along @ displacement[_dofs(member)])


def _lever_turning(member: Member) -> Array:
    """Stiffness (12, 12) by centrifugal load (Ω = 1 rad/s) on a member's slices, which move with their nodes' rotation.

    The force f of a slice at the lever r does work in the second-order motion ½ θ×(θ×r).
    """
    result = np.zeros((12, 12))
    if member.levers is None or member.slices is None:
        return result
    force = np.einsum("sb,sab->sa", member.slices.moments[:, 0], member.slices.outward()[:, 0])
    for k, levers in enumerate(member.levers):
        arm = levers.T @ force
        rows = slice(6 * k + 3, 6 * k + 6)
        result[rows, rows] = np.trace(arm) * np.eye(3) - 0.5 * (arm + arm.T)
    return result


def circular(diameter: float, density: float, poisson_ratio: float, heavy_diameter: float | None = None) -> Section:
    """Solid circular section; ``heavy_diameter`` is the diameter for its mass if different (0: no mass)."""
    heavy = diameter if heavy_diameter is None else heavy_diameter
    area, bending = 0.25 * np.pi * diameter**2, np.pi * diameter**4 / 64.0
    shear = 6.0 * (1.0 + poisson_ratio) / (7.0 + 6.0 * poisson_ratio) * area
    weight = density * 0.25 * np.pi * heavy**2
    return Section(area, shear, bending, 2.0 * bending, weight, weight * heavy**2 / 16.0)


def _dofs(member: Member) -> NDArray[np.intp]:
    """Degrees of freedom (12,) of a member."""
    return np.concatenate([np.arange(6 * node, 6 * node + 6) for node in member.nodes])


def _axes(along: Array) -> Array:
    """Local axes of a member as rows: e_1 along it, e_2 and e_3 across (z, x, y for a member along z)."""
    helper = np.eye(3)[(int(np.argmax(np.abs(along))) + 1) % 3]
    second = helper - along * (helper @ along)
    second /= np.linalg.norm(second)
    return np.stack((along, second, np.cross(along, second)))


def _beam_stiffness(e: float, g: float, section: Section, length: float, phi: float) -> Array:
    """Stiffness (12, 12) of a Timoshenko beam in its local axes."""
    k = np.zeros((12, 12))
    for i, value in ((0, e * section.area / length), (3, g * section.torsion / length)):
        k[np.ix_((i, i + 6), (i, i + 6))] = value * np.array([[1.0, -1.0], [-1.0, 1.0]])
    a = e * section.bending / ((1.0 + phi) * length**3)
    plane = a * np.array(
        [
            [12.0, 6.0 * length, -12.0, 6.0 * length],
            [6.0 * length, (4.0 + phi) * length**2, -6.0 * length, (2.0 - phi) * length**2],
            [-12.0, -6.0 * length, 12.0, -6.0 * length],
            [6.0 * length, (2.0 - phi) * length**2, -6.0 * length, (4.0 + phi) * length**2],
        ]
    )
    k[np.ix_((1, 5, 7, 11), (1, 5, 7, 11))] = plane
    signs = np.array([1.0, -1.0, 1.0, -1.0])  # along e_3 a positive slope is a negative rotation about e_2
    k[np.ix_((2, 4, 8, 10), (2, 4, 8, 10))] = plane * np.outer(signs, signs)
    return k


def _interpolation(x: float, length: float, phi: float) -> Array:
    """Displacement and rotation (6, 12) of the section at x (fraction of the length) per nodal motion, local axes."""
    n = np.zeros((6, 12))
    for i in (0, 3):
        n[i, i], n[i, i + 6] = 1.0 - x, x
    w = 1.0 + phi
    v = np.array(
        [
            (1.0 + phi * (1.0 - x) - 3.0 * x**2 + 2.0 * x**3) / w,
            length * x * (2.0 + phi - (4.0 + phi) * x + 2.0 * x**2) / (2.0 * w),
            (phi * x + 3.0 * x**2 - 2.0 * x**3) / w,
            length * x * (-phi + (phi - 2.0) * x + 2.0 * x**2) / (2.0 * w),
        ]
    )
    r = np.array(
        [
            6.0 * x * (x - 1.0) / (length * w),
            (1.0 + phi - (4.0 + phi) * x + 3.0 * x**2) / w,
            -6.0 * x * (x - 1.0) / (length * w),
            ((phi - 2.0) * x + 3.0 * x**2) / w,
        ]
    )
    signs = np.array([1.0, -1.0, 1.0, -1.0])
    n[1, [1, 5, 7, 11]], n[5, [1, 5, 7, 11]] = v, r
    n[2, [2, 4, 8, 10]], n[4, [2, 4, 8, 10]] = signs * v, -signs * r
    return n


def _slopes(x: float, length: float, phi: float) -> Array:
    """Slopes of the axis in both transverse directions and rate of twist (3, 12) per nodal motion, local axes, 1/m."""
    n = np.zeros((3, 12))
    w = (1.0 + phi) * length
    v = np.array(
        [
            (-phi - 6.0 * x + 6.0 * x**2) / w,
            length * (2.0 + phi - 2.0 * (4.0 + phi) * x + 6.0 * x**2) / (2.0 * w),
            (phi + 6.0 * x - 6.0 * x**2) / w,
            length * (-phi + 2.0 * (phi - 2.0) * x + 6.0 * x**2) / (2.0 * w),
        ]
    )
    n[0, [1, 5, 7, 11]] = v
    n[1, [2, 4, 8, 10]] = np.array([1.0, -1.0, 1.0, -1.0]) * v
    n[2, [3, 9]] = -1.0 / length, 1.0 / length
    return n
