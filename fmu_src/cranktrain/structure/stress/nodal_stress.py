"""Stress at nodes of a mesh of quadratic tetrahedra, from displacements.

Displacement gradients are evaluated at the four points of the second-order quadrature, where quadratic elements are
most accurate. They are extrapolated linearly to the corners of each element; a mid-side node gets the mean of its two
corners. The values of all elements at a node are averaged, as in CalculiX for ten-node tetrahedra. Stress follows from
the averaged gradient by Hooke's law, σ = λ tr(ε) I + 2 μ ε.

References: Barlow, Int. J. Num. Meth. Eng. 10 (1976) 243; Zienkiewicz, Taylor and Zhu, *The Finite Element Method*,
7th ed., section 15.3.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from skfem import ElementTetP2, MeshTet2

from cranktrain.core.types import Array, Integers
from cranktrain.engine.parts import Material
from cranktrain.structure.fem.elasticity import lame
from cranktrain.structure.fem.mesh import VTK_EDGES

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "zx")
"""Order of a stress tensor's components in all arrays."""
ACROSS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))
_NEAR, _FAR = (5.0 - np.sqrt(5.0)) / 20.0, (5.0 + 3.0 * np.sqrt(5.0)) / 20.0


@dataclass(frozen=True, eq=False)
class NodalStress:
    """Stress at chosen nodes as a function of the displacement.

    Attributes
    ----------
    nodes : (s,) columns of ``mesh.doflocs``
    gradients : three (s, nodes of the mesh) csr, ∂/∂x, ∂/∂y, ∂/∂z of a nodal field at the chosen nodes, 1/m
    material : elastic constants
    """

    nodes: Integers
    gradients: tuple[sparse.csr_matrix, sparse.csr_matrix, sparse.csr_matrix]
    material: Material

    @classmethod
    def of(cls, mesh: MeshTet2, material: Material, nodes: Integers) -> "NodalStress":
        """Make the gradient operators of a mesh at ``nodes`` (columns of ``mesh.doflocs``)."""
        chosen = np.full(mesh.doflocs.shape[1], -1)
        chosen[nodes] = np.arange(len(nodes))
        numbers = mesh.dofs.element_dofs
        touching = np.flatnonzero((chosen[numbers] >= 0).any(axis=0))
        numbers = numbers[:, touching]
        slopes = _gradients_at_nodes(mesh.doflocs[:, numbers])
        share, element = np.nonzero(chosen[numbers] >= 0)
        rows = chosen[numbers[share, element]]
        weight = 1.0 / np.bincount(rows, minlength=len(nodes))[rows]
        columns = numbers[:, element].T
        row = np.repeat(rows, 10)

        def along(axis: int) -> sparse.csr_matrix:
            values = slopes[element, share, :, axis] * weight[:, None]
            shape = (len(nodes), mesh.doflocs.shape[1])
            return sparse.csr_matrix((values.ravel(), (row, columns.ravel())), shape=shape)

        return cls(np.asarray(nodes), (along(0), along(1), along(2)), material)

    def __call__(self, displacement: Array) -> Array:
        """Stress (k, 6, s) Pa of displacements (3, nodes of the mesh, k) m; components in the order of COMPONENTS."""
        gradient = [[along @ component for along in self.gradients] for component in displacement]
        lam, mu = lame(self.material)
        pressure = lam * (gradient[0][0] + gradient[1][1] + gradient[2][2])
        parts = [mu * (gradient[a][b] + gradient[b][a]) + (pressure if a == b else 0.0) for a, b in ACROSS]
        return np.stack(parts).transpose(2, 0, 1)


def von_mises(stress: NDArray[Any]) -> NDArray[Any]:
    """Von Mises stress (...) of tensors (6, ...) with components in the order of COMPONENTS."""
    xx, yy, zz, xy, yz, zx = stress
    normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return np.sqrt(0.5 * normal + 3.0 * (xy * xy + yz * yz + zx * zx))


def principal(stress: Array) -> Array:
    """Principal stresses (s, 3), ascending, of tensors (6, s)."""
    tensor = np.empty((stress.shape[1], 3, 3))
    for component, (a, b) in zip(stress, ACROSS, strict=True):
        tensor[:, a, b] = tensor[:, b, a] = component
    return np.asarray(np.linalg.eigvalsh(tensor))


def _gradients_at_nodes(places: Array) -> Array:
    """Gradients (e, node, function, 3) of the ten shape functions of e elements at nodes ``places`` (3, 10, e)."""
    points = np.full((3, 4), _NEAR)
    points[[0, 1, 2], [1, 2, 3]] = _FAR
    local = np.stack([np.asarray(ElementTetP2().lbasis(points, i)[1]) for i in range(10)])
    jacobian = np.einsum("aie,ibq->eqab", places, local)
    at_points = np.einsum("ibq,eqba->eqia", local, np.linalg.inv(jacobian))
    barycentric = np.vstack((1.0 - points.sum(axis=0), points)).T
    to_nodes = np.linalg.inv(barycentric)
    middle = np.array([0.5 * (to_nodes[a] + to_nodes[b]) for a, b in VTK_EDGES])
    return np.einsum("nq,eqia->enia", np.vstack((to_nodes, middle)), at_points)
