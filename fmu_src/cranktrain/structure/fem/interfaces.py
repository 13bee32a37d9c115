"""Interfaces: nodes with six degrees of freedom, each representing a named surface.

*Averaged* (RBE3): the node moves as the rigid motion that fits the surface best,

    min over (t, θ) of ∫ |u − t − θ×(X − X₀)|² dA   ⇒   u_I = W u,   S W = ∫ Bᵀ N dA,   S = ∫ Bᵀ B dA,

with B = [I, −(X − X₀)×] and the finite-element interpolation N. A force at the node acts on the surface as Wᵀ f, which
is as uniform as balance allows; the surface remains free to deform.

*Tied* (RBE2): the surface itself is rigid, u = B u_I on it. This stiffens the body and is used only for comparison.
"""

import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from skfem import LinearForm

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.types import Array
from cranktrain.structure.fem.elasticity import FEModel
from cranktrain.structure.fem.mesh import surface_basis


@dataclass(frozen=True, eq=False)
class InterfaceSet:
    """Averaged interfaces of a finite-element body (SI).

    Attributes
    ----------
    names : m names
    positions : (m, 3) reference point of each, m
    averaging : (6 m, ndof) csr, W: translations (m) then rotations (rad) of each interface from nodal displacements
    """

    names: tuple[str, ...]
    positions: Array
    averaging: sparse.csr_matrix


def averaged_interfaces(
    model: FEModel, names: Iterable[str] | None = None, positions: Mapping[str, Array] | None = None
) -> InterfaceSet:
    """Interfaces averaged over named surfaces, weighted by area.

    Raises ``InputError`` for a missing surface, or a surface that does not determine a rotation.

    Parameters
    ----------
    names : surfaces to use; by default all named boundaries of the mesh
    positions : reference point (3,) by name; by default the surface's centroid
    """
    boundaries = model.mesh.boundaries or {}
    chosen = tuple(boundaries if names is None else names)
    if missing := [name for name in chosen if name not in boundaries]:
        raise InputError(
            f"mesh has no surface '{missing[0]}'; {nearest(missing[0], boundaries)} - name the facets of each interface"
        )
    places, blocks = [], []
    for name in chosen:
        place, block = _averaging(model, name, None if positions is None else positions.get(name))
        places.append(place)
        blocks.append(block)
    return InterfaceSet(names=chosen, positions=np.array(places), averaging=sparse.vstack(blocks, format="csr"))


def placed_interfaces(model: FEModel, names: Iterable[str], place: Callable[[str, Array], Array]) -> InterfaceSet:
    """Interfaces averaged over named surfaces; ``place`` maps name and centroid (3,) to the reference point."""
    centroids = averaged_interfaces(model, names)
    places = {name: place(name, at) for name, at in zip(centroids.names, centroids.positions, strict=True)}
    return averaged_interfaces(model, centroids.names, places)


def _averaging(model: FEModel, name: str, place: Array | None) -> tuple[Array, sparse.csr_matrix]:
    """Reference point (3,) and averaging rows (6, ndof) of one surface."""
    facets = surface_basis(model.mesh, model.basis.elem, name, 4)
    points = np.asarray(facets.global_coordinates())
    if place is None:
        place = np.einsum("afq,fq->a", points, facets.dx) / facets.dx.sum()
    motions = unit_motions(points - np.asarray(place)[:, None, None])
    moments = np.einsum("kafq,lafq,fq->kl", motions, motions, facets.dx)
    size = np.sqrt(np.diag(moments))
    if np.linalg.cond(moments / np.outer(size, size)) > 1e8:
        raise InputError(f"surface '{name}' does not determine a rotation; give it facets that do not lie on one line")
    form = LinearForm(lambda v, w: w["b"][0] * v[0] + w["b"][1] * v[1] + w["b"][2] * v[2])
    rows = np.stack([np.asarray(form.assemble(facets, b=motion)) for motion in motions])
    dofs = np.flatnonzero(np.any(rows != 0.0, axis=0))
    weights = np.linalg.solve(moments, rows[:, dofs])
    row, column = np.divmod(np.arange(6 * dofs.size), dofs.size)
    block = sparse.csr_matrix((weights.ravel(), (row, dofs[column])), shape=(6, model.basis.N))
    return np.asarray(place, dtype=float), block


def unit_motions(arm: Array) -> Array:
    """Unit translations and rotations as fields (6, 3, ...) at positions ``arm`` (3, ...) from the reference point."""
    motions = np.zeros((6, *arm.shape))
    for k in range(3):
        motions[k, k] = 1.0
        unit = np.zeros(3)
        unit[k] = 1.0
        motions[3 + k] = np.moveaxis(np.cross(unit, np.moveaxis(arm, 0, -1)), -1, 0)
    return motions


def tied_surfaces(model: FEModel, interfaces: InterfaceSet, motions: Array) -> tuple[sparse.csr_matrix, Array]:
    """Make the interface surfaces rigid (RBE2): u = T [free dofs, nodes of the rigid surfaces].

    An edge shared by two surfaces belongs to the first; a surface without own degrees of freedom has no node. Warns,
    because tied surfaces raise the first frequencies of a crankshaft.

    Parameters
    ----------
    motions : (ndof, 6) rigid-body motions

    Returns
    -------
    T (ndof, r) and the rigid-body motions in its coordinates, (r, 6)
    """
    warnings.warn("rigidly tied surfaces (RBE2) stiffen the body; prefer averaged interfaces", stacklevel=2)
    ndof = model.basis.N
    owner = np.full(ndof, -1)
    for index, name in reversed(list(enumerate(interfaces.names))):
        owner[model.basis.get_dofs(model.mesh.boundaries[name]).flatten()] = index
    free, tied = np.flatnonzero(owner < 0), np.flatnonzero(owner >= 0)
    owners, owner_of_tied = np.unique(owner[tied], return_inverse=True)
    arm = model.positions[:, tied] - interfaces.positions[owner[tied]].T
    across = unit_motions(arm)[:, model.components[tied], np.arange(tied.size)]
    columns = free.size + 6 * owner_of_tied[None, :] + np.arange(6)[:, None]
    tie = sparse.csr_matrix(
        (
            np.concatenate((np.ones(free.size), across.ravel())),
            (np.concatenate((free, np.tile(tied, 6))), np.concatenate((np.arange(free.size), columns.ravel()))),
        ),
        shape=(ndof, free.size + 6 * owners.size),
    )
    at_nodes = (interfaces.averaging @ motions).reshape(-1, 6, 6)[owners].reshape(-1, 6)
    return tie, np.vstack((motions[free], at_nodes))
