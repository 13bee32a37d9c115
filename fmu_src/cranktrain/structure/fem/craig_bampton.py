"""Craig–Bampton reduction of a free body with averaged interfaces, and its rotation invariants.

Interface motions are q_B = W u. The reduced space holds

    constraint modes      K Ψ + Wᵀ Λ = 0,         W Ψ = I     (static response to unit interface motions)
    fixed-interface modes K φ + Wᵀ μ = ω² M φ,    W φ = 0

The stiffness of a free body is singular, so everything is built on its inertia-relief flexibility

    G = Pᵀ K_c⁻¹ P,   P = I − M R Rᵀ     (R: rigid-body modes, RᵀMR = I; K_c: K clamped at six well-chosen dofs)

which needs one factorisation for any mass matrix. The loads P f are in balance, so the six supports carry no force. The
modes of the reduced body are Ritz vectors of this space; its six rigid modes are the analytic fields.

References: Craig and Bampton, AIAA J. 6 (1968) 1313; Craig and Kurdila, *Fundamentals of Structural Dynamics*, 2006,
chapter 17; inertia relief: MacNeal, *Finite Elements: Their Design and Performance*, 1994; block Lanczos with full
orthogonalisation: Saad, *Numerical Methods for Large Eigenvalue Problems*, 2011, section 6.4.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import cholesky, eigh, qr, solve_triangular

from cranktrain.core.errors import SolverError
from cranktrain.core.reduced_body import ReducedBody, check, signed, with_rigid_rows
from cranktrain.core.rigid_slices import rigid_modes
from cranktrain.core.types import Array
from cranktrain.structure.fem.elasticity import FEModel, component_dofs, geometric_stiffness, sample
from cranktrain.structure.fem.factor import Factor, factorise
from cranktrain.structure.fem.interfaces import InterfaceSet


@dataclass(frozen=True, eq=False)
class Flexibility:
    """Inertia-relief flexibility of a free body, its static response to balanced loads, G = Pᵀ K_c⁻¹ P.

    Attributes
    ----------
    mass : (ndof, ndof) csc
    rigid : (ndof, 6) rigid-body modes, M-orthonormal
    """

    mass: sparse.csc_matrix
    rigid: Array
    _momentum: Array
    _free: NDArray[np.intp]
    _factor: Factor

    @classmethod
    def of(
        cls, stiffness: sparse.csc_matrix, mass: sparse.csc_matrix, motions: Array, places: Array | None = None
    ) -> Flexibility:
        """Factorise the stiffness; ``motions`` (ndof, 6) span the rigid motions, ``places`` as in :func:`factorise`."""
        scaled = motions / np.linalg.norm(motions, axis=0)
        _, _, order = qr(scaled.T, mode="economic", pivoting=True)
        free = np.sort(order[6:])
        placed = None if places is None else places[:, free]
        return cls._with(factorise(stiffness[free][:, free].tocsc(), placed), free, mass, motions)

    def with_mass(self, mass: sparse.csc_matrix) -> Flexibility:
        """Flexibility with the same factors and another mass matrix."""
        return self._with(self._factor, self._free, mass, self.rigid)

    @classmethod
    def _with(cls, factor: Factor, free: NDArray[np.intp], mass: sparse.csc_matrix, motions: Array) -> Flexibility:
        """Flexibility from a factorised stiffness and a mass matrix; ``motions`` (ndof, 6) span the rigid motions."""
        rigid = motions @ rigid_modes(motions.T @ (mass @ motions))
        return cls(mass, rigid, mass @ rigid, free, factor)

    def solve(self, load: Array) -> Array:
        """Displacement (ndof, k), free of rigid motion, under loads (ndof, k) balanced by inertia forces."""
        balanced = load - self._momentum @ (self.rigid.T @ load)
        answer = np.zeros_like(load)
        answer[self._free] = self._factor.solve(np.ascontiguousarray(balanced[self._free]))
        return np.asarray(answer - self.rigid @ (self._momentum.T @ answer))


@dataclass(frozen=True, eq=False)
class ClampedFlexibility:
    """Flexibility of the body with its averaged interfaces clamped, W u = 0, and its constraint modes."""

    free: Flexibility
    constraint_modes: Array
    compliance: Array
    _answers: Array
    _at_interfaces: Array
    _solution: Array

    @classmethod
    def of(cls, free: Flexibility, averaging: sparse.csr_matrix) -> ClampedFlexibility:
        """Clamp the interfaces of ``averaging`` (nb, ndof)."""
        answers = free.solve(averaging.T.toarray())
        compliance = averaging @ answers
        motions = averaging @ free.rigid
        nb = compliance.shape[0]
        # Rows in N and N m, m and rad differ by orders of magnitude, so each is scaled by its own compliance.
        scale = np.concatenate((1.0 / np.sqrt(np.diag(compliance)), np.ones(6)))
        scale[nb:] /= np.abs(scale[:nb, None] * motions).max(axis=0)
        saddle = np.block([[0.5 * (compliance + compliance.T), motions], [motions.T, np.zeros((6, 6))]])
        solution = np.linalg.inv(scale[:, None] * saddle * scale) * scale[:, None] * scale
        modes = answers @ solution[:nb, :nb] + free.rigid @ solution[nb:, :nb]
        return cls(free, modes, compliance, answers, motions, solution)

    def solve(self, load: Array) -> Array:
        """Displacement (ndof, k) with W u = 0 under loads (ndof, k); the interfaces carry the unbalanced part."""
        nb = self._at_interfaces.shape[0]
        # W u = W G f − F λ + W R α = 0 with the interface forces λ in balance with the load, (W R)ᵀ λ = Rᵀ f.
        known = np.vstack((self._answers.T @ load, self.free.rigid.T @ load))
        forces = self._solution @ known
        return np.asarray(self.free.solve(load) - self._answers @ forces[:nb] - self.free.rigid @ forces[nb:])


def eigenmodes(
    flexibility: Callable[[Array], Array],
    mass: sparse.csc_matrix,
    count: int,
    tolerance: float = 1e-8,
    block: int = 16,
) -> tuple[Array, Array]:
    """Lowest elastic modes by block Lanczos on a flexibility, orthogonalised in full.

    If the basis fills the space of a small body, the modes are computed from the full matrix. Raises ``SolverError`` if
    the basis becomes larger than a well-posed body needs, or if the body has fewer modes.

    Parameters
    ----------
    flexibility : f (ndof, k) ↦ u (ndof, k), symmetric; solves K u = f in the space of the modes
    count : modes wanted
    tolerance : bound of the relative error of ω², estimated from the square of the residual

    Returns
    -------
    ω (count,) rad/s ascending, modes (ndof, count) with unit modal mass
    """
    ndof = mass.shape[0]
    needed = 6 * count + 20 * block
    limit = min(ndof - 6, needed)
    basis, momenta = (np.empty((ndof, limit + block), order="F") for _ in range(2))
    projected = np.zeros((limit, limit))
    image = flexibility(mass @ np.random.default_rng(20110).standard_normal((ndof, block)))
    size = 0
    while True:
        vectors, with_mass = _orthonormal(image, mass, basis[:, :size], momenta[:, :size])
        grown = size + vectors.shape[1]
        if size >= count:
            coupling = with_mass.T @ image
            squares, turn = eigh(projected[:size, :size])
            squares, turn = squares[::-1][:count], turn[:, ::-1][:, :count]
            residual = np.linalg.norm(coupling @ turn[size - image.shape[1] :], axis=0) / squares
            if np.all(residual**2 < tolerance):
                return 1.0 / np.sqrt(squares), basis[:, :size] @ turn
        if grown > limit or grown == size:
            if limit < needed:
                return _all_modes(flexibility, mass, count)
            raise SolverError(
                f"{count} eigenmodes not found in {size} Lanczos vectors; ask for fewer modes or check the mesh"
            )
        basis[:, size:grown], momenta[:, size:grown] = vectors, with_mass
        image = flexibility(with_mass)
        column = momenta[:, :grown].T @ image
        projected[:grown, size:grown] = column
        projected[size:grown, :grown] = column.T
        size = grown


def _all_modes(flexibility: Callable[[Array], Array], mass: sparse.csc_matrix, count: int) -> tuple[Array, Array]:
    """The ``count`` lowest modes of a small body from its full matrix, for which a Lanczos basis would be too large.

    With M = L Lᵀ the eigenvalues of Lᵀ G L are 1/ω²; those of rigid and of clamped motions are zero.
    """
    weights, turn = eigh(mass.toarray())
    held = weights > 1e-14 * weights[-1]
    root = turn[:, held] * np.sqrt(weights[held])
    image = flexibility(root)
    projected = root.T @ image
    squares, vectors = eigh(0.5 * (projected + projected.T))
    squares, vectors = squares[::-1][:count], vectors[:, ::-1][:, :count]
    if squares.size < count or squares[-1] <= 1e-13 * squares[0]:
        found = int(np.count_nonzero(squares > 1e-13 * squares[0]))
        raise SolverError(
            f"{count} eigenmodes asked of a body that has {found}; ask for fewer modes or refine the mesh"
        )
    return 1.0 / np.sqrt(squares), image @ vectors / squares


def _orthonormal(vectors: Array, mass: sparse.csc_matrix, basis: Array, momenta: Array) -> tuple[Array, Array]:
    """Part of ``vectors`` M-orthogonal to ``basis``, made M-orthonormal, and its product with the mass."""
    vectors = vectors / np.sqrt(np.abs(np.einsum("ij,ij->j", vectors, mass @ vectors)))
    for _ in range(2):
        vectors = vectors - basis @ (momenta.T @ vectors)
        squares, turn = eigh(vectors.T @ (mass @ vectors))
        independent = squares > 1e-20
        vectors = vectors @ (turn[:, independent] / np.sqrt(squares[independent]))
    return vectors, mass @ vectors


@dataclass(frozen=True, eq=False)
class Reduced:
    """Result of a Craig–Bampton reduction.

    Attributes
    ----------
    body : the reduced body
    modes : (ndof, n) modes in the finite-element degrees of freedom
    flexibility : flexibility of the full model
    compliance : (6 m, 6 m) full-model interface motion per interface load, balanced by inertia; m/N, rad/(N m)
    """

    body: ReducedBody
    modes: Array
    flexibility: Flexibility
    compliance: Array


def craig_bampton(
    model: FEModel,
    interfaces: InterfaceSet,
    fixed_modes: int = 40,
    name: str = "body",
    digest: str = "",
    progress: Callable[[str], None] | None = None,
) -> Reduced:
    """Reduce a free body to orthogonalised constraint modes and fixed-interface modes.

    Raises ``SolverError`` if the eigenmodes are not found.

    Parameters
    ----------
    fixed_modes : number of fixed-interface modes; the body has 6 further modes per interface
    progress : called with the name of each stage before it starts
    """
    say = progress or (lambda stage: None)
    basis = reduced_basis(model.stiffness, model.mass, rigid_motions(model), interfaces.averaging, fixed_modes, say)
    body = _rotating(model, interfaces, basis.free, basis.modes, basis.omega, basis.shapes, name, digest)
    check(body)
    return Reduced(body, basis.modes, basis.free, basis.compliance)


def condensed(model: FEModel, interfaces: InterfaceSet) -> tuple[Array, Array]:
    """Guyan's condensed stiffness and mass (6 m, 6 m) of a free body at its interfaces, AIAA J. 3 (1965) 380."""
    free = Flexibility.of(model.stiffness, model.mass, rigid_motions(model))
    modes = ClampedFlexibility.of(free, interfaces.averaging).constraint_modes
    return modes.T @ (model.stiffness @ modes), modes.T @ (model.mass @ modes)


class ReducedBasis(NamedTuple):
    """Modes of a reduction without rotation invariants.

    ``omega`` (n,) rad/s, ``modes`` (ndof, n), ``shapes`` (m, 6, n) at the interfaces; ``free`` and ``compliance`` as in
    :class:`Reduced`.
    """

    omega: Array
    modes: Array
    shapes: Array
    free: Flexibility
    compliance: Array


def reduced_basis(
    stiffness: sparse.csc_matrix,
    mass: sparse.csc_matrix,
    motions: Array,
    averaging: sparse.csr_matrix,
    fixed_modes: int,
    say: Callable[[str], None],
) -> ReducedBasis:
    """Orthogonal modes of any free structure in the space of constraint and fixed-interface modes, rigid modes first.

    Parameters
    ----------
    stiffness, mass : (ndof, ndof)
    motions : (ndof, 6) rigid motions, translations along and rotations about x, y, z
    averaging : (6 m, ndof) interface motions W
    say : called with the name of each stage before it starts
    """
    say("factorising the stiffness")
    free = Flexibility.of(stiffness, mass, motions)
    say("constraint modes")
    clamped = ClampedFlexibility.of(free, averaging)
    say(f"{fixed_modes} fixed-interface modes")
    # A low tolerance suffices for the fixed-interface modes, because they only span a space for the Ritz modes.
    _, fixed = eigenmodes(clamped.solve, mass, fixed_modes, tolerance=1e-5)
    say("orthogonal modes and rotation invariants")
    parts, compliance = [clamped.constraint_modes, fixed], clamped.compliance
    del clamped, fixed
    modes, omega = _ritz_modes(stiffness, mass, free.rigid, parts)
    shapes = (averaging @ modes).reshape(averaging.shape[0] // 6, 6, -1)
    signs = signed(shapes)
    signs[:6] = 1.0
    modes *= signs
    return ReducedBasis(omega, modes, shapes * signs, free, compliance)


def rigid_motions(model: FEModel) -> Array:
    """Translations along and rotations about x, y, z through the frame's origin, (ndof, 6)."""
    position = sample(model, lambda x: x)
    fields = []
    for axis in np.eye(3):
        translation = np.empty_like(position)
        translation[_nodes(model)] = axis[:, None]
        fields.append(translation)
    fields += [_cross(model, axis, position) for axis in np.eye(3)]
    return np.stack(fields, axis=1)


def _ritz_modes(
    stiffness: sparse.csc_matrix, mass: sparse.csc_matrix, rigid: Array, parts: list[Array]
) -> tuple[Array, Array]:
    """Ritz modes of the space of ``parts`` and their ω; rigid modes first, the others M-orthogonal to them.

    The arrays ``parts`` (ndof, …) are removed from their list to free memory, a gigabyte for a block.
    """
    space = np.hstack(parts)
    parts.clear()
    give_back()
    space -= rigid @ (rigid.T @ (mass @ space))
    space /= np.sqrt(np.einsum("ij,ij->j", space, mass @ space))
    # Rigid motions were removed from the space, so six eigenvalues are only rounding and are dropped.
    squares, turn = eigh(space.T @ (mass @ space))
    space = space @ (turn[:, 6:] / np.sqrt(squares[6:]))
    lower = cholesky(space.T @ (mass @ space), lower=True)
    space = solve_triangular(lower, space.T, lower=True, overwrite_b=True).T
    projected = space.T @ (stiffness @ space)
    squares, turn = eigh(0.5 * (projected + projected.T))
    space = space @ turn
    return np.hstack((rigid, space)), np.concatenate((np.zeros(6), np.sqrt(squares)))


def _rotating(
    model: FEModel,
    interfaces: InterfaceSet,
    free: Flexibility,
    modes: Array,
    omega: Array,
    shapes: Array,
    name: str,
    digest: str,
) -> ReducedBody:
    """Reduced body with its rotation invariants, which are exact in the finite-element space."""
    mass = model.mass
    turned = _turned(model, modes)
    momenta = mass @ modes
    position = sample(model, lambda x: x)
    outward = sample(model, lambda x: x * np.array([[1.0], [1.0], [0.0]]))
    turned_outward = np.stack([_cross(model, axis, outward) for axis in np.eye(3)], axis=1)
    centrifugal, coupling = turned.T @ (mass @ turned), momenta.T @ turned
    del turned  # frees an array as large as the modes
    stretched = free.solve((mass @ outward)[:, None])[:, 0]
    elastic = modes[:, 6:]
    stress = np.zeros_like(centrifugal)
    stress[6:, 6:] = elastic.T @ (geometric_stiffness(model, stretched) @ elastic)
    motions = rigid_motions(model)
    inertia = motions.T @ (mass @ motions)
    rigid = np.linalg.solve(inertia, motions.T @ momenta[:, :6])
    total = float(inertia[0, 0])
    centre = np.array([inertia[1, 5], inertia[2, 3], inertia[0, 4]]) / total
    return ReducedBody(
        name=name,
        omega=omega,
        interfaces=interfaces.names,
        positions=interfaces.positions,
        shapes=shapes,
        gyroscopic=0.5 * (coupling - coupling.T),
        centrifugal=centrifugal,
        stress_stiffness=with_rigid_rows(stress, centrifugal, rigid, turned_outward.T @ momenta),
        centrifugal_load=outward @ momenta,
        euler_load=_cross(model, np.array([0.0, 0.0, 1.0]), position) @ momenta,
        translation=motions[:, :3].T @ momenta,
        mass=total,
        centre=centre,
        inertia=inertia[3:, 3:],
        digest=digest,
    )


def _cross(model: FEModel, axis: Array, values: Array) -> Array:
    """Nodal values of axis × v for one field v (ndof,)."""
    result = np.empty_like(values)
    nodes = _nodes(model)
    result[nodes] = np.cross(axis, values[nodes], axisb=0).T
    return result


def _turned(model: FEModel, modes: Array) -> Array:
    """Cross products e_z × φ of the crank's axis with all modes φ (ndof, n)."""
    nodes = _nodes(model)
    result = np.zeros_like(modes)
    result[nodes[0]], result[nodes[1]] = -modes[nodes[1]], modes[nodes[0]]
    return result


def _nodes(model: FEModel) -> NDArray[np.intp]:
    """Indices (3, nodes) of the degrees of freedom in x, y and z of each node."""
    return component_dofs(model.basis)


def give_back() -> None:
    """Give freed memory back to the operating system if the C library can do so (glibc); otherwise do nothing.

    glibc keeps freed arrays of up to 32 MB for later use. Between the stages of a reduction they are most of its
    memory, for example 0.3 of 0.5 GB after the finite elements of a crankshaft with 74,000 unknowns.
    """
    with suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
