"""Reduction of any body: mesh → finite elements → interfaces → Craig–Bampton modes → stored file.

On request the reduction is compared with the full model, and with the other type of mass matrix.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import null_space
from skfem import MeshTet2

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.threads import one_thread
from cranktrain.core.types import Array, Progress
from cranktrain.engine.parts import Material
from cranktrain.store.hdf5 import load_body, save_body
from cranktrain.store.whole_file import check_kept
from cranktrain.structure.fem.craig_bampton import Flexibility, Reduced, craig_bampton, eigenmodes, give_back
from cranktrain.structure.fem.elasticity import FEModel, component_dofs, finite_elements, lumped_volume, scalar_basis
from cranktrain.structure.fem.interfaces import InterfaceSet

# Frequency (Hz) up to which the reduced body is compared with the full finite-element model.
CHECKED_HZ = 1000.0
# Number of modes (rigid ones and the first elastic ones) whose surface motion is stored for pictures.
PICTURED_MODES = 36
SAME = 1e-9
"""Relative tolerance within which frequencies and shapes of a repeated reduction equal those of the stored body."""

_ERROR = "max_relative_error"
"""Key of a body's ``quality``, present only after a check against the full model."""

Comparison = tuple[dict[str, float], dict[str, Array]]


@dataclass(frozen=True)
class ReductionTask:
    """A body to be reduced, and the path of its stored file.

    Attributes
    ----------
    path, digest : stored file, and digest of all inputs of the body
    mesh : function that makes or reads the mesh with its named surfaces
    mesh_file : path of the user's own mesh, or None
    interfaces : function that makes the averaged interfaces of a model
    records : function that makes further records of the reduced body, or None
    compared : function that makes further figures and records of the checks, or None
    beside : function that takes further results from the finite elements and their factors, or None
    """

    name: str
    path: Path
    digest: str
    mesh: Callable[[], MeshTet2]
    mesh_file: str | Path | None
    material: Material
    interfaces: Callable[[FEModel], InterfaceSet]
    fixed_modes: int
    consistent_mass: bool
    records: Callable[[FEModel, ReducedBody], dict[str, Array]] | None = None
    compared: Callable[[FEModel, ReducedBody, InterfaceSet, Progress], Comparison] | None = None
    beside: Callable[[FEModel, Flexibility, Progress], None] | None = None

    def model(self, say: Progress) -> FEModel:
        """Finite elements of the body."""
        say("meshing" if self.mesh_file is None else f"reading {Path(self.mesh_file).name}")
        mesh = self.mesh()
        say(f"finite elements ({3 * mesh.doflocs.shape[1]} degrees of freedom)")
        made = finite_elements(mesh, self.material, self.consistent_mass)
        give_back()
        return made


def reduced_structure(
    task: ReductionTask, progress: Progress | None = None, rebuild: bool = False, checked: bool = False
) -> ReducedBody:
    """Body in all its Craig–Bampton modes, from the store or computed; ``checked`` compares it with the full model."""
    if task.path.exists() and not rebuild:
        kept = load_body(task.path, task.digest)
        if not checked or _ERROR in kept.quality:
            return kept
    check_kept(task.path)
    say = progress or (lambda stage: None)
    body = _stored(task, reduced_with_shapes(task, say), say, checked)
    give_back()
    return body


def _stored(
    task: ReductionTask, shaped: tuple[FEModel, InterfaceSet, Reduced], say: Progress, checked: bool
) -> ReducedBody:
    """Write a body's file from its reduction with shapes, with its quality and further results; returns the body."""
    model, interfaces, reduced = shaped
    with one_thread():
        rigid = reduced.flexibility.rigid
        quality = {
            "dofs_full": float(model.basis.N),
            "rigid_hz": float(np.sqrt(np.abs(np.diag(rigid.T @ (model.stiffness @ rigid))).max()) / (2.0 * np.pi)),
            "static_error": static_error(reduced),
        }
        body = replace(reduced.body, quality=quality)
        if task.records is not None:
            body = replace(body, records=task.records(model, body))
        if checked:
            body = _with(body, _checks(model, reduced, task.consistent_mass, say))
            if task.compared is not None:
                body = _with(body, task.compared(model, body, interfaces, say))
        if task.beside is not None:
            task.beside(model, reduced.flexibility, say)
    save_body(task.path, body, _surface(model, reduced.modes[:, :PICTURED_MODES]))
    return body


def reduced_with_shapes(task: ReductionTask, say: Progress) -> tuple[FEModel, InterfaceSet, Reduced]:
    """Finite elements of a body, its interfaces, and its reduction with the shapes of modes, which are not stored."""
    model = task.model(say)
    interfaces = task.interfaces(model)
    with one_thread():
        return model, interfaces, craig_bampton(model, interfaces, task.fixed_modes, task.name, task.digest, say)


def repeated_reduction(task: ReductionTask, say: Progress) -> tuple[FEModel, InterfaceSet, Reduced]:
    """Repeat a body's reduction with mode shapes; a stored body that is missing or another machine's is replaced."""
    check_kept(task.path)
    found = reduced_with_shapes(task, say)
    own = found[2].body
    kept = load_body(task.path, task.digest) if task.path.exists() else None
    pairs = () if kept is None else ((kept.omega, own.omega), (kept.shapes, own.shapes))  # signs of modes count too
    same = [a.shape == b.shape and np.allclose(a, b, rtol=SAME, atol=SAME * np.abs(b).max()) for a, b in pairs]
    if kept is None or not all(same):
        _stored(task, found, say, checked=False)
    return found


def _with(body: ReducedBody, found: Comparison) -> ReducedBody:
    return replace(body, quality=body.quality | found[0], records=body.records | found[1])


def _checks(model: FEModel, reduced: Reduced, consistent: bool, say: Progress) -> Comparison:
    """Errors of a reduction against the full model, and differences with the other type of mass matrix."""
    body = reduced.body
    count = int(np.count_nonzero(body.frequencies_hz[6:] < CHECKED_HZ)) + 1

    def frequencies(flexibility: Flexibility) -> Array:
        return eigenmodes(flexibility.solve, flexibility.mass, count)[0] / (2.0 * np.pi)

    say(f"full model to {CHECKED_HZ:g} Hz")
    full = frequencies(reduced.flexibility)
    other_mass = lumped_mass(model) if consistent else finite_elements(model.mesh, model.material).mass
    other = frequencies(reduced.flexibility.with_mass(other_mass))
    error = body.frequencies_hz[6 : 6 + count] / full - 1.0
    records = {"full_hz": full, "lumped_hz" if consistent else "consistent_hz": other}
    quality = {
        _ERROR: float(np.abs(error[full < CHECKED_HZ]).max(initial=0.0)),
        "other_mass_shifts_first": float(other[0] / full[0] - 1.0),
    }
    return quality, records


def lumped_mass(model: FEModel) -> sparse.csc_matrix:
    """Diagonal mass of the model by Hinton, Rock and Zienkiewicz, (ndof, ndof) kg."""
    scalar = scalar_basis(model.mesh)
    share = model.material.density * lumped_volume(scalar)
    diagonal = np.empty(model.basis.N)
    diagonal[component_dofs(model.basis)] = share[np.hstack((scalar.nodal_dofs[0], scalar.edge_dofs[0]))]
    return sparse.diags_array(diagonal).tocsc()


def static_error(reduced: Reduced) -> float:
    """Error of the reduced interface compliance relative to the full one, over loads in balance (Frobenius norms)."""
    body = reduced.body
    elastic = body.shapes[:, :, 6:].reshape(-1, body.n_modes - 6)
    motions = body.shapes[:, :, :6].reshape(-1, 6)
    # Forces and moments have different units, so each is scaled by the motion that it causes at its own point.
    size = np.sqrt(np.diag(reduced.compliance))
    balanced = null_space((motions / size[:, None]).T)
    full = reduced.compliance / np.outer(size, size)
    scaled = elastic / body.omega[6:] / size[:, None]
    difference = balanced.T @ (full - scaled @ scaled.T) @ balanced
    return float(np.linalg.norm(difference) / np.linalg.norm(balanced.T @ full @ balanced))


def surface_triangles(mesh: MeshTet2) -> NDArray[np.intp]:
    """Boundary of the mesh, each six-node facet as four triangles: (t, 3) columns of ``mesh.doflocs``.

    Seen from outside the corners are in counter-clockwise order.
    """
    facets = mesh.boundary_facets()
    a, b, c = mesh.facets[:, facets]
    inside = mesh.p[:, mesh.t[:, mesh.f2t[0, facets]]].mean(axis=1)
    normal = np.cross(mesh.p[:, b] - mesh.p[:, a], mesh.p[:, c] - mesh.p[:, a], axis=0)
    inward = np.einsum("af,af->f", normal, inside - mesh.p[:, a]) > 0.0
    b, c = np.where(inward, c, b), np.where(inward, b, c)
    edge_of = {tuple(pair): index for index, pair in enumerate(np.sort(mesh.edges, axis=0).T.tolist())}
    ab, bc, ca = (
        np.array([mesh.nvertices + edge_of[min(p, q), max(p, q)] for p, q in zip(u.tolist(), v.tolist(), strict=True)])
        for u, v in ((a, b), (b, c), (c, a))
    )
    return np.hstack([np.stack(t) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]).T


def _surface(model: FEModel, modes: Array) -> dict[str, tuple[NDArray[Any], str]]:
    """Records of the mesh boundary and the modes on it, for pictures."""
    triangles = surface_triangles(model.mesh)
    used, renumbered = np.unique(triangles, return_inverse=True)
    dofs = component_dofs(model.basis)[:, used]
    return {
        "surface_points": (model.positions[:, dofs[0]].T, "m"),
        "surface_triangles": (renumbered.reshape(triangles.shape).astype(np.int32), "1"),
        "surface_modes": (modes[dofs].transpose(2, 1, 0).astype(np.float32), "1/kg^0.5"),
    }
