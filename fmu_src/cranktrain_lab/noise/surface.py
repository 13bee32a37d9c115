"""Outer surface of a block and its motion in the block's modes, kept next to the reduced block in the user's cache.

Shapes of the finite elements are not stored with a reduced block, so the first request repeats the reduction. The mean
square of a panel's normal velocity is a quadratic form of the modal velocities,

    ∫ v_n² dA = q̇ᵀ G q̇,   G_ij = ∫ (n·φ_i) (n·φ_j) dA,

which is integrated exactly over facets with straight sides.
"""

from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import StoreError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.threads import one_thread
from cranktrain.core.types import Array, Progress
from cranktrain.engine.model import Engine
from cranktrain.store.hdf5 import load_body
from cranktrain.store.whole_file import whole_file
from cranktrain.structure.block.reduction import reduction_task
from cranktrain.structure.block.shape import BlockPlan, block_plan
from cranktrain.structure.fem.craig_bampton import Reduced
from cranktrain.structure.fem.elasticity import FEModel, component_dofs
from cranktrain.structure.fem.reduction import SAME, ReductionTask, repeated_reduction, surface_triangles
from cranktrain_lab.noise.panels import Facets, Integers, block_panels, facet_shapes, six_node_facets

RECIPE = 1
"""Version of the stored surface: raised when changed code gives another surface for the same block."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Panels of a body's surface and their motion in its modes.

    Attributes
    ----------
    facets : the f facets of all panels
    panel : (f,) panel of each facet
    names : names of the panels
    modes : (n, p, 3) displacement of the points per unit modal coordinate, 1/kg^0.5
    """

    facets: Facets
    panel: Integers
    names: tuple[str, ...]
    modes: NDArray[np.floating]

    def in_modes(self, basis: Array | None) -> "Surface":
        """The same surface in new modes, given as columns (n, r) in its present modes; None: unchanged."""
        if basis is None:
            return self
        flat = self.modes.reshape(len(self.modes), -1)
        modes = (basis.T.astype(flat.dtype) @ flat).reshape(-1, *self.modes.shape[1:])
        return Surface(self.facets, self.panel, self.names, modes)

    def areas(self) -> Array:
        """Area (k,) of each panel, m²."""
        of_facets = np.linalg.norm(self.facets.area_vectors, axis=2).sum(axis=1)
        return np.asarray(np.bincount(self.panel, of_facets, len(self.names)), dtype=float)

    def lengths(self) -> Array:
        """Sides (k, 2), m, of the rectangle of each panel's area whose first side is the panel's largest extent."""
        own = [self.facets.points[self.facets.nodes[self.panel == k]].reshape(-1, 3) for k in range(len(self.names))]
        longest = np.array([float(np.ptp(points, axis=0).max()) for points in own])
        return np.column_stack((longest, self.areas() / longest))

    def products(self) -> Array:
        """Integrals G (k, n, n) of the product of two modes' normal motion over each panel, m²/kg."""
        values, _ = facet_shapes()
        vectors = self.facets.area_vectors
        size = np.linalg.norm(vectors, axis=2)
        found = np.empty((len(self.names), len(self.modes), len(self.modes)))
        for k in range(len(self.names)):
            own = np.flatnonzero(self.panel == k)
            weighted = vectors[own] / np.sqrt(size[own])[:, :, None]
            normal = np.zeros((len(self.modes), own.size, len(values)))
            for node in range(values.shape[1]):
                moved = self.modes[:, self.facets.nodes[own, node]]
                normal += values[:, node] * np.einsum("mfx,fqx->mfq", moved, weighted, optimize=True)
            flat = normal.reshape(len(normal), -1)
            found[k] = flat @ flat.T
        return found


def block_surface(engine: Engine, mesh_file: str | Path | None, say: Progress) -> Surface:
    """Outer surface of an engine's bare block; computed once, then read from the cache. Raises ``InputError``."""
    task = reduction_task(engine, mesh_file)
    path = task.path.with_name(f"{task.path.stem}-surface.npz")
    if (kept := _read(path, task)) is not None:
        return kept
    model, _, reduced = repeated_reduction(task, say)
    say("surface of the block")
    with one_thread():
        made = outer_surface(block_plan(engine), model, reduced)
    body: ReducedBody = reduced.body
    with whole_file(path) as temporary, temporary.open("wb") as file:
        np.savez(
            file, recipe=RECIPE, shapes=body.shapes, points=made.facets.points, nodes=made.facets.nodes,
            panel=made.panel, names=np.array(made.names), modes=made.modes,
        )  # fmt: skip
    return made


def outer_surface(plan: BlockPlan, model: FEModel, reduced: Reduced) -> Surface:
    """Panels of a block from its finite elements and the shapes of its modes."""
    triangles = surface_triangles(model.mesh)
    whole = Facets(np.ascontiguousarray(model.mesh.doflocs.T), six_node_facets(triangles))
    names, panel = block_panels(plan, model.mesh, whole)
    return chosen(whole, panel, names, model, reduced.modes)


def chosen(whole: Facets, panel: Integers, names: tuple[str, ...], model: FEModel, modes: Array) -> Surface:
    """Surface of the facets that belong to a panel, ``panel`` ≥ 0, with modes (ndof, n) of the finite elements."""
    kept = np.flatnonzero(panel >= 0)
    used, renumbered = np.unique(whole.nodes[kept], return_inverse=True)
    moved = modes[component_dofs(model.basis)[:, used]].transpose(2, 1, 0).astype(np.float32)
    return Surface(Facets(whole.points[used], renumbered.reshape(-1, 6)), panel[kept], names, moved)


def _read(path: Path, task: ReductionTask) -> Surface | None:
    """Stored surface of the body in the cache, or None if there is none."""
    try:
        body = load_body(task.path, task.digest)
        with np.load(path) as file:
            if int(file["recipe"]) != RECIPE or file["shapes"].shape != body.shapes.shape:
                return None
            if not np.allclose(file["shapes"], body.shapes, rtol=SAME, atol=SAME * np.abs(body.shapes).max()):
                return None
            names = tuple(str(name) for name in file["names"])
            return Surface(Facets(file["points"], file["nodes"]), file["panel"], names, file["modes"])
    except (OSError, ValueError, KeyError, EOFError, BadZipFile, StoreError):
        return None
