"""Linear isotropic elasticity on curved quadratic tetrahedra.

Stiffness and mass are the matrices of

    a(u, v) = ∫ C(ε(u)) : ε(v),  C(ε) = λ tr(ε) I + 2 μ ε,      m(u, v) = ∫ ρ u · v

on :class:`skfem.MeshTet2` with the isoparametric mapping, without constraints. By components the stiffness is K_ab = ∫
λ ∂_a v ∂_b u + μ ∂_b v ∂_a u + δ_ab μ ∇v · ∇u. Stiffness and mass are assembled from forms of the scalar element, which
gives the same matrix as the vector form and is fifteen times faster.

Reference: Bathe, *Finite Element Procedures*, 2nd ed., sections 4.2 and 6.8; lumping by Hinton, Rock and Zienkiewicz,
Earthquake Eng. Struct. Dyn. 4 (1976) 245.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from skfem import Basis, BilinearForm, ElementTetP2, ElementVector, MeshTet2

from cranktrain.core.types import Array
from cranktrain.engine.parts import Material

# Quadrature order that is exact for mass of straight and volume of curved elements; its 14 weights are positive.
QUADRATURE_ORDER = 5
_MIDDLE = np.full((3, 1), 0.25), np.full(1, 1.0 / 6.0)


@dataclass(frozen=True, eq=False)
class FEModel:
    """Free elastic body in finite elements (SI).

    Attributes
    ----------
    mesh : quadratic tetrahedra; ``mesh.boundaries`` holds the facets of each interface surface by name
    basis : vector-valued quadratic basis, ``basis.N`` = ndof, only for numbers and positions of unknowns. It is
        evaluated in the middle of each element, because at all points of :func:`scalar_basis` it takes a gigabyte
    stiffness, mass : (ndof, ndof) csc, N/m and kg
    material : density and elastic constants of the matrices
    """

    mesh: MeshTet2
    basis: Basis
    stiffness: sparse.csc_matrix
    mass: sparse.csc_matrix
    material: Material

    @property
    def positions(self) -> Array:
        """Node location of each degree of freedom, (3, ndof) m."""
        return np.asarray(self.basis.doflocs)

    @property
    def components(self) -> NDArray[np.intp]:
        """Direction of each degree of freedom, (ndof,): 0, 1, 2 for x, y, z."""
        direction = np.empty(self.basis.N, dtype=np.intp)
        direction[component_dofs(self.basis)] = np.arange(3)[:, None]
        return direction


def component_dofs(basis: Basis) -> NDArray[np.intp]:
    """Degrees of freedom of each component, (3, nodes); column j belongs to column j of ``mesh.doflocs``."""
    return np.hstack((basis.nodal_dofs, basis.edge_dofs)).astype(np.intp)


def finite_elements(
    mesh: MeshTet2, material: Material, consistent_mass: bool = True, elements: NDArray[np.integer] | None = None
) -> FEModel:
    """Stiffness and mass of a free body.

    Parameters
    ----------
    mesh : quadratic tetrahedra, m
    material : Pa, 1, kg/m³
    consistent_mass : ∫ρ u·v if true; else lumped by Hinton, Rock and Zienkiewicz (row sums would be negative)
    elements : numbers of the elements of this material, by default all; matrices of several materials are added
    """
    basis = Basis(mesh, ElementVector(ElementTetP2()), quadrature=_MIDDLE, elements=elements)
    scalar = scalar_basis(mesh, elements)
    nodes = _scalar_to_vector(basis, scalar)
    lam, mu = lame(material)

    def gradients(a: int, b: int) -> sparse.csr_matrix:
        """Matrix of ∫ ∂_a v ∂_b u dV over the body, for directions a and b."""
        return BilinearForm(lambda u, v, w: u.grad[b] * v.grad[a]).assemble(scalar)

    d = {(a, b): gradients(a, b) for a in range(3) for b in range(a, 3)}
    d.update({(b, a): d[a, b].T for a, b in ((0, 1), (0, 2), (1, 2))})
    laplace = d[0, 0] + d[1, 1] + d[2, 2]
    stiffness = _vector_matrix(
        basis.N,
        nodes,
        {(a, b): lam * d[a, b] + mu * d[b, a] + (mu * laplace if a == b else 0 * laplace) for a, b in d},
    )
    density = material.density
    if consistent_mass:
        scalar_mass = density * BilinearForm(lambda u, v, w: u * v).assemble(scalar)
    else:
        scalar_mass = sparse.diags_array(density * lumped_volume(scalar))
    mass = _vector_matrix(basis.N, nodes, {(a, a): scalar_mass for a in range(3)})
    return FEModel(mesh=mesh, basis=basis, stiffness=stiffness, mass=mass, material=material)


def scalar_basis(mesh: MeshTet2, elements: NDArray[np.integer] | None = None) -> Basis:
    """Quadratic basis of one component, evaluated at the quadrature points of the matrices."""
    return Basis(mesh, ElementTetP2(), intorder=QUADRATURE_ORDER, elements=elements)


def lame(material: Material) -> tuple[float, float]:
    """Lamé constants λ, μ, Pa."""
    e, nu = material.youngs_modulus, material.poisson_ratio
    return e * nu / ((1 + nu) * (1 - 2 * nu)), e / (2 * (1 + nu))


def lumped_volume(scalar: Basis) -> Array:
    """Volume assigned to each node, (nodes,) m³: diagonal of the consistent mass matrix, scaled in each element."""
    diagonal = np.stack([np.sum(phi[0] ** 2 * scalar.dx, axis=1) for phi in scalar.basis])
    diagonal *= scalar.dx.sum(axis=1) / diagonal.sum(axis=0)
    shares = np.bincount(scalar.element_dofs.ravel(), weights=diagonal.ravel(), minlength=scalar.N)
    return np.asarray(shares, dtype=np.float64)


def sample(model: FEModel, field: Callable[[Array], Array]) -> Array:
    """Nodal values (ndof,) of a vector field X ↦ a(X), both (3, n); exact for fields linear in position."""
    nodes = component_dofs(model.basis)
    values = np.empty(model.basis.N)
    values[nodes] = field(model.positions[:, nodes[0]])
    return values


def geometric_stiffness(model: FEModel, displacement: Array) -> sparse.csc_matrix:
    """Stress stiffness K_σ(u, v) = ∫ σ : (∇uᵀ ∇v) of a static state.

    Parameters
    ----------
    displacement : (ndof,) m, static solution that causes the stress

    Returns
    -------
    (ndof, ndof) csc, N/m; integrated at the same points as the stiffness, so its work in rigid rotations is exactly the
    virtual work of the load.
    """
    basis, scalar = model.basis, scalar_basis(model.mesh)
    nodes = _scalar_to_vector(basis, scalar)
    lam, mu = lame(model.material)
    gradient = np.stack([np.asarray(scalar.interpolate(displacement[own]).grad) for own in nodes])
    strain = 0.5 * (gradient + gradient.swapaxes(0, 1))
    stress = 2 * mu * strain + lam * np.trace(strain) * np.eye(3)[:, :, None, None]
    form = BilinearForm(lambda u, v, w: np.einsum("abeq,aeq,beq->eq", w["stress"], u.grad, v.grad))
    block = form.assemble(scalar, stress=stress)
    return _vector_matrix(basis.N, nodes, {(a, a): block for a in range(3)})


def _scalar_to_vector(basis: Basis, scalar: Basis) -> NDArray[np.intp]:
    """Vector degree of freedom (3, nodes) of each component at each scalar degree of freedom."""
    nodes = np.empty((3, scalar.N), dtype=np.intp)
    nodes[:, np.hstack((scalar.nodal_dofs[0], scalar.edge_dofs[0]))] = component_dofs(basis)
    return nodes


def _vector_matrix(
    ndof: int, nodes: NDArray[np.intp], blocks: dict[tuple[int, int], sparse.sparray | sparse.spmatrix]
) -> sparse.csc_matrix:
    """Matrix whose block (a, b) couples components a and b."""
    rows, columns, values = [], [], []
    for (a, b), block in blocks.items():
        entries = sparse.coo_matrix(block)
        rows.append(nodes[a, entries.row].astype(np.int32))
        columns.append(nodes[b, entries.col].astype(np.int32))
        values.append(entries.data)
    index = (np.concatenate(rows), np.concatenate(columns))
    return sparse.coo_matrix((np.concatenate(values), index), shape=(ndof, ndof)).tocsc()
