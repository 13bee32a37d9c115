"""Stress modes of a crankshaft: the stress at its surface in each mode of the reduction.

They are computed from the finite-element shapes of the reduction. These shapes are not stored, so the first request for
stress modes repeats the reduction. Stress modes are stored in a separate file next to the body's file, so runs without
stresses do not load them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError, StoreError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.threads import one_thread
from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.store.hdf5 import load_body
from cranktrain.store.whole_file import whole_file
from cranktrain.structure.crank.reduction import reduction_task
from cranktrain.structure.fem.craig_bampton import Reduced
from cranktrain.structure.fem.elasticity import FEModel, component_dofs, sample
from cranktrain.structure.fem.interfaces import InterfaceSet
from cranktrain.structure.fem.own_body import is_body
from cranktrain.structure.fem.reduction import (
    SAME,
    Progress,
    ReductionTask,
    repeated_reduction,
    surface_triangles,
)
from cranktrain.structure.stress.nodal_stress import NodalStress

RECIPE = 1
"""Version of the stored stresses: raised when changed code gives other stresses for the same mode shapes."""


@dataclass(frozen=True, eq=False)
class StressModes:
    """Stress modes at the s surface nodes of a crankshaft; components xx, yy, zz, xy, yz, zx in axes of the frame.

    Attributes
    ----------
    modes : (n, 6, s) float32, Pa per unit coordinate of each bare mode
    centrifugal : (6, s) float32, Pa s², part of the bare crankshaft's static stress under the centrifugal load of 1
        rad/s that the modes do not contain
    points : (s, 3) undeformed positions, m
    triangles : (t, 3) triangles of the surface, as rows of ``points``
    """

    modes: NDArray[np.float32]
    centrifugal: NDArray[np.float32]
    points: Array
    triangles: NDArray[np.int32]

    def of_running(self, complete: ReducedBody, running: ReducedBody) -> NDArray[np.float32]:
        """Stress (r + 1, 6, s) in the r modes of a running model's crankshaft, and in the last row for Ω² = 1 (rad/s)².

        The last row includes the static response of modes beyond the cut-off to the centrifugal load.

        Parameters
        ----------
        complete : crankshaft with all rigid parts, in all its modes
        running : truncated crankshaft of the running model
        """
        basis = np.eye(self.modes.shape[0]) if running.basis is None else running.basis
        dropped = _centrifugal_answer(complete) - _centrifugal_answer(running)
        coefficients = np.vstack((basis.T, dropped)).astype(np.float32)
        found = (coefficients @ self.modes.reshape(len(basis), -1)).reshape(-1, *self.modes.shape[1:])
        found[-1] += self.centrifugal
        return found


@dataclass(frozen=True, eq=False)
class ShapedCrank:
    """A bare crankshaft with its finite elements and the shapes of its modes."""

    model: FEModel
    interfaces: InterfaceSet
    reduced: Reduced

    @property
    def surface_stress(self) -> tuple[NodalStress, NDArray[np.intp]]:
        """Stress operator at the surface nodes, in the order of :class:`StressModes`, and its input dofs (3, nodes)."""
        nodes = np.unique(surface_triangles(self.model.mesh))
        return NodalStress.of(self.model.mesh, self.model.material, nodes), component_dofs(self.model.basis)

    @classmethod
    def of(cls, engine: Engine, mesh_file: str | Path | None, say: Progress) -> "ShapedCrank":
        """Repeat a body's reduction with mode shapes; a stored body that differs (of another machine) is replaced."""
        return cls(*repeated_reduction(reduction_task(engine, mesh_file), say))


def stress_modes(
    engine: Engine,
    mesh_file: str | Path | None = None,
    progress: Progress | None = None,
    shaped: Callable[[], ShapedCrank] | None = None,
) -> StressModes:
    """Stress modes of an engine's bare crankshaft; computed once, then read from the user's cache.

    Raises ``InputError``, ``StoreError`` as :func:`cranktrain.structure.crank.reduction.reduced_crankshaft`.

    Parameters
    ----------
    mesh_file : user's own mesh in place of the parametric crankshaft
    shaped : function that makes the crankshaft with its shapes if needed; by default the reduction is repeated
    """
    check_has_elements(mesh_file)
    say = progress or (lambda stage: None)
    task = reduction_task(engine, mesh_file)
    path = task.path.with_name(f"{task.path.stem}-stress.npz")
    kept = _read(path, task)
    if kept is not None:
        return kept
    crank = shaped() if shaped else ShapedCrank.of(engine, mesh_file, say)
    say("stress modes")
    with one_thread():
        made = surface_stress_modes(crank.model, crank.reduced)
    body = crank.reduced.body
    with whole_file(path) as temporary, temporary.open("wb") as file:
        np.savez(file, recipe=RECIPE, omega=body.omega, shapes=body.shapes, **vars(made))
    return made


def check_has_elements(mesh_file: str | Path | None) -> None:
    """Refuse a reduced body or superelement in place of a mesh; ``InputError``."""
    if mesh_file is not None and is_body(mesh_file):
        raise InputError(
            f"{mesh_file}: a reduced body has no stresses, because they need its finite elements; give their mesh "
            "by --mesh, or leave the body out"
        )


def surface_stress_modes(model: FEModel, reduced: Reduced) -> StressModes:
    """Compute stress modes from a reduction with its finite-element shapes."""
    triangles = surface_triangles(model.mesh)
    used, renumbered = np.unique(triangles, return_inverse=True)
    stress = NodalStress.of(model.mesh, model.material, used)
    dofs, shapes = component_dofs(model.basis), reduced.modes
    modes = np.empty((shapes.shape[1], 6, used.size), dtype=np.float32)
    for k in range(0, len(modes), 16):
        modes[k : k + 16] = stress(shapes[dofs, k : k + 16])
    outward = model.mass @ sample(model, lambda x: x * np.array([[1.0], [1.0], [0.0]]))
    static = reduced.flexibility.solve(outward[:, None]) - (shapes @ _centrifugal_answer(reduced.body))[:, None]
    points = np.ascontiguousarray(model.mesh.doflocs[:, used].T)
    numbers = renumbered.reshape(triangles.shape).astype(np.int32)
    return StressModes(modes, stress(static[dofs])[0].astype(np.float32), points, numbers)


def _centrifugal_answer(body: ReducedBody) -> Array:
    """Static response of the elastic modes to the centrifugal load of 1 rad/s, in coordinates of the bare body."""
    answer = np.zeros(body.n_modes)
    answer[6:] = body.centrifugal_load[6:] / body.omega[6:] ** 2
    return answer if body.basis is None else body.basis @ answer


def _read(path: Path, task: ReductionTask) -> StressModes | None:
    """Stored stress modes of the body in the cache, or None if none were stored."""
    try:
        body = load_body(task.path, task.digest)
        with np.load(path) as file:
            if int(file["recipe"]) != RECIPE or not (
                file["shapes"].shape == body.shapes.shape and np.allclose(file["shapes"], body.shapes, rtol=SAME)
            ):
                return None
            return StressModes(file["modes"], file["centrifugal"], file["points"], file["triangles"])
    except (OSError, ValueError, KeyError, EOFError, BadZipFile, StoreError):
        return None
