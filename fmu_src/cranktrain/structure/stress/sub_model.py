"""Sub-model of one throw with fine fillets, driven by the reduced crank's motion at cuts through its main journals.

The crank's own mesh has one element over a fillet and reads its peak too low. The sub-model reaches from the middle of
one main journal to that of the next. Its cut faces move as the crank does there; its pin and half journals carry the
loads of their interfaces; its mass is accelerated as the pin is, as if the throw were rigid:

    K u = Wᵀ L − M R a + Ω² M X_⊥  inside,      u = P Φ q  on the cuts

P fits a cubic polynomial in x, y, z to the crank's nodes near a cut: it takes no search for elements and smooths the
coarse field. All is linear in the *drive* [q, L_pin, L_front, L_rear, a, Ω²], so the sub-model is solved once for each
of its entries, and stresses in a run are a product.

Reference: Zienkiewicz, Taylor and Zhu, *The Finite Element Method*, 7th ed., chapter 15; sub-models by displacements of
their borders: Cook, Malkus, Plesha and Witt, *Concepts and Applications of Finite Element Analysis*, 4th ed., section
10.12.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from skfem import MeshTet2

from cranktrain.core.errors import InputError
from cranktrain.engine.parts import Crankshaft, Material
from cranktrain.structure.crank.shape import pin_centre, stations
from cranktrain.structure.fem.craig_bampton import rigid_motions
from cranktrain.structure.fem.elasticity import FEModel, component_dofs, finite_elements, sample
from cranktrain.structure.fem.factor import factorise, one_thread
from cranktrain.structure.fem.interfaces import averaged_interfaces, unit_motions
from cranktrain.structure.fem.mesh import surface_basis
from cranktrain.structure.fem.reduction import Progress
from cranktrain.structure.stress.features import surface_features
from cranktrain.structure.stress.nodal_stress import NodalStress
from cranktrain.structure.stress.throw_mesh import FINENESS, throw_mesh

Array = NDArray[np.float64]
Integers = NDArray[np.integer]

SLAB = 0.4
"""Half thickness of the slab about a cut whose nodes tell its motion, over the main journal's width."""
LOADS = 6 * 4 + 1
"""Entries of a drive behind the modal coordinates: loads of pin, front and rear main, acceleration, Ω²."""
_ON_PLANE = 1e-7
_BATCH = 32


@dataclass(frozen=True, eq=False)
class FilletModes:
    """Stress at s nodes on fillets and oil holes of one throw, for each entry of its drive.

    Attributes
    ----------
    throw : number from 1
    modes : (n + LOADS, 6, s) float32, Pa per unit of each entry (SI)
    points : (s, 3) m
    features, number : names of the fillets and holes, and (s,) that of each node
    """

    throw: int
    modes: NDArray[np.float32]
    points: Array
    features: tuple[str, ...]
    number: Integers


def fillet_modes(
    crankshaft: Crankshaft,
    material: Material,
    coarse: tuple[Array, Array],
    throw: int,
    say: Progress = lambda stage: None,
    fineness: float = FINENESS,
) -> FilletModes:
    """Solve the sub-model of a throw (numbered from 1) for each entry of its drive.

    Raises ``InputError``: where the CAD kernel fails or the crank's mesh has too few nodes near a cut.

    Parameters
    ----------
    coarse : nodes (3, p) m of the crank's mesh and its modes there, (3, p, n)
    fineness : radius of a fillet over the edges on it
    """
    say(f"throw {throw}: mesh of the sub-model")
    model = finite_elements(throw_mesh(crankshaft, throw, fineness), material)
    say(f"throw {throw}: sub-model of {model.basis.N} degrees of freedom")
    dofs = component_dofs(model.basis)
    nodes, moved = cut_motion(model.mesh, crankshaft, throw, coarse)
    held = dofs[:, nodes].ravel()
    free = np.setdiff1d(np.arange(model.basis.N), held)
    count = coarse[1].shape[2]
    known = np.zeros((held.size, count + LOADS))
    known[:, :count] = moved.reshape(held.size, count)
    force = np.zeros((free.size, count + LOADS))
    force[:, count:] = throw_loads(model, crankshaft, throw)[free]
    chosen, features, number = _watched(model.mesh, crankshaft)
    stress = NodalStress.of(model.mesh, material, chosen)
    modes = np.empty((count + LOADS, 6, chosen.size), dtype=np.float32)
    with one_thread():
        rows = model.stiffness[free]
        coupling, factor = rows[:, held], factorise(rows[:, free].tocsc())
        for first in range(0, count + LOADS, _BATCH):
            part = slice(first, min(first + _BATCH, count + LOADS))
            answer = np.zeros((model.basis.N, part.stop - part.start))
            answer[held] = known[:, part]
            answer[free] = factor.solve(np.ascontiguousarray(force[:, part] - coupling @ known[:, part]))
            modes[part] = stress(answer[dofs])
    return FilletModes(throw, modes, np.ascontiguousarray(model.mesh.doflocs[:, chosen].T), features, number)


def throw_loads(model: FEModel, crankshaft: Crankshaft, throw: int) -> Array:
    """Forces (ndof, LOADS) of a drive's entries behind the modal coordinates."""
    at = stations(crankshaft)
    pin = np.array(pin_centre(crankshaft, throw))
    columns = [averaged_interfaces(model, [f"pin[{throw}]"], {f"pin[{throw}]": pin}).averaging.T.toarray()]
    for main in (throw, throw + 1):
        middle = np.array([0.0, 0.0, 0.5 * sum(at.mains[main - 1])])
        columns.append(_half_journal(model, f"main[{main}]", middle))
    motions = rigid_motions(model)
    motions[:, 3:] -= motions[:, :3] @ np.cross(np.eye(3), pin).T
    outward = sample(model, lambda x: x * np.array([[1.0], [1.0], [0.0]]))
    return np.hstack((*columns, -(model.mass @ motions), (model.mass @ outward)[:, None]))


def _half_journal(model: FEModel, name: str, middle: Array) -> Array:
    """Forces (ndof, 6) on the half of a main journal that a unit load on the whole of it leaves here."""
    facets = surface_basis(model.mesh, model.basis.elem, name, 4)
    fields = unit_motions(np.asarray(facets.global_coordinates()) - middle[:, None, None])
    here = np.einsum("kafq,lafq,fq->kl", fields, fields, facets.dx)
    signs = np.array([1.0, 1.0, -1.0, -1.0, -1.0, 1.0])  # the other half is the mirror image across the cut
    whole = here + signs[:, None] * here * signs
    averaging = averaged_interfaces(model, [name], {name: middle}).averaging
    return np.asarray(averaging.T @ np.linalg.solve(whole, here).T)


def cut_motion(mesh: MeshTet2, c: Crankshaft, throw: int, coarse: tuple[Array, Array]) -> tuple[Integers, Array]:
    """Nodes on both cuts, and their displacement (3, nodes, n) in the crank's modes, ``coarse`` as above.

    ``InputError`` where the crank's mesh has too few nodes near a cut.
    """
    places, modes = coarse
    nodes, moved = [], []
    for span in stations(c).mains[throw - 1 : throw + 1]:
        z, scale = 0.5 * sum(span), 0.5 * c.main_diameter
        near = np.flatnonzero(np.abs(places[2] - z) < SLAB * (span[1] - span[0]))
        on = np.flatnonzero(np.abs(mesh.doflocs[2] - z) < _ON_PLANE)
        centre = np.array([[0.0], [0.0], [z]])
        known = _cubic((places[:, near] - centre) / scale)
        if near.size < known.shape[1] or np.linalg.matrix_rank(known, 1e-6) < known.shape[1]:
            raise InputError(
                f"crankshaft: {near.size} nodes of its mesh near z = {1e3 * z:.0f} mm do not tell the motion of a cut "
                "there; use a smaller mesh_size"
            )
        fit = _cubic((mesh.doflocs[:, on] - centre) / scale) @ np.linalg.pinv(known)
        nodes.append(on)
        moved.append(np.einsum("cp,apn->acn", fit, modes[:, near], optimize=True))
    return np.concatenate(nodes), np.concatenate(moved, axis=1)


def _cubic(places: Array) -> Array:
    """Monomials (p, 20) up to the third degree of places (3, p)."""
    x, y, z = places
    powers = [(i, j, k) for i in range(4) for j in range(4 - i) for k in range(4 - i - j)]
    return np.stack([x**i * y**j * z**k for i, j, k in powers], axis=1)


def _watched(mesh: MeshTet2, c: Crankshaft) -> tuple[Integers, tuple[str, ...], Integers]:
    """Corner nodes on fillets and oil holes, the names of these and the number of each node's."""
    nodes = np.unique(mesh.facets[:, mesh.boundary_facets()])
    names, number = surface_features(c, mesh.p[:, nodes].T)
    kept = [k for k, name in enumerate(names) if "fillet" in name or "hole" in name]
    of = np.full(len(names), -1)
    of[kept] = np.arange(len(kept))
    wanted = of[number] >= 0
    return nodes[wanted], tuple(names[k] for k in kept), of[number[wanted]]
