"""Sub-models of one throw with a fine mesh at one fillet or oil bore, driven by motion and loads of the reduced crank.

The mesh of the crank has one element over a fillet and gives too low peak stresses. A sub-model reaches from the middle
of one main journal to the middle of the next, with short edges at one place and the crank's edge length elsewhere. Its
cut faces move with the crank. Its pin and half journals carry the loads of their interfaces. Its mass has the
acceleration of the pin, as if the throw were rigid:

    K u = Wᵀ L − M R a + Ω² M X_⊥  inside,      u = P Φ q + C s  on the cuts

P fits a cubic polynomial in x, y, z to the displacements of the crank's nodes near a cut. This needs no search for
elements and smooths the coarse field. The solution is linear in the *drive* [q, L_pin, L_front, L_rear, a, Ω²] and in
s, so the sub-model is solved once for each entry, and stresses in a run are a matrix product.

C are rigid motions of the two cuts. With s = 0 the cuts follow the *motion* of the crank, whose coarse mesh is too
stiff. Alternatively s is chosen so that the rest of the crank acts on the cuts with its *resultants* in the run. Then
the forces come from the run, and the motion only gives their distribution over a cut.

Reference: Zienkiewicz, Taylor and Zhu, *The Finite Element Method*, 7th ed., chapter 15; sub-models by displacements of
their borders: Cook, Malkus, Plesha and Witt, *Concepts and Applications of Finite Element Analysis*, 4th ed., section
10.12.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from skfem import MeshTet2

from cranktrain.core.errors import InputError
from cranktrain.core.rigid_slices import skew
from cranktrain.core.threads import one_thread
from cranktrain.core.types import Array, Integers
from cranktrain.engine.parts import Crankshaft, Material
from cranktrain.structure.crank.shape import oil_outlet, pin_centre, stations
from cranktrain.structure.fem.craig_bampton import rigid_motions
from cranktrain.structure.fem.elasticity import FEModel, component_dofs, finite_elements, sample
from cranktrain.structure.fem.factor import factorise
from cranktrain.structure.fem.interfaces import averaged_interfaces, unit_motions
from cranktrain.structure.fem.mesh import surface_basis
from cranktrain.structure.fem.reduction import Progress
from cranktrain.structure.stress.features import surface_features
from cranktrain.structure.stress.nodal_stress import NodalStress
from cranktrain.structure.stress.throw_mesh import place_fineness, throw_mesh

SLAB = 0.4
"""Half thickness of the slab whose nodes define the motion of a cut, over the main journal's width."""
LOADS = 6 * 4 + 1
"""Number of a throw's drive entries after the modal coordinates: loads (pin, two mains), acceleration, Ω²."""
CUTS = 6 * 2
"""Number of rigid motions of the front and the rear cut of a throw."""
_ON_PLANE = 1e-7
_BATCH = 32
_FREE = 1e-6


@dataclass(frozen=True, eq=False)
class FilletModes:
    """Stress at s nodes on a fillet, or at the mouth of an oil bore, for each entry of its throw's drive.

    Attributes
    ----------
    name : name of the place, one of :func:`cranktrain.structure.stress.throw_mesh.throw_places`
    throw : number from 1
    modes : (n + LOADS + CUTS, 6, s) float32, Pa per unit of each entry (SI)
    beyond : (n + LOADS + CUTS, CUTS) force and moment, about the middle of each cut, of the crank beyond the cut per
        unit of each entry; loads on the whole main journals are included
    points : (s, 3) m
    """

    name: str
    throw: int
    modes: NDArray[np.float32]
    beyond: Array
    points: Array

    def by_resultants(self, drive: Array, wrenches: Array) -> Array:
        """Motions s (k, CUTS) of the cuts for which the rest of the crank acts on them with ``wrenches``.

        Parameters
        ----------
        drive : (k, n + LOADS)
        wrenches : (k, CUTS), N and N m; their imbalance with the drive remains
        """
        stiffness = 0.5 * (self.beyond[-CUTS:] + self.beyond[-CUTS:].T)
        size = np.sqrt(np.diag(stiffness))
        # A pseudo-inverse is used because six of the cuts' twelve motions move the whole throw and cause no force.
        compliance = np.linalg.pinv(stiffness / np.outer(size, size), rcond=_FREE, hermitian=True)
        return np.asarray((wrenches - drive @ self.beyond[:-CUTS]) / size @ compliance / size)


def fillet_modes(
    crankshaft: Crankshaft,
    material: Material,
    coarse: tuple[Array, Array],
    throw: int,
    place: str,
    say: Progress = lambda stage: None,
    fineness: float | None = None,
) -> FilletModes:
    """Solve the sub-model of a throw (numbered from 1) with a fine mesh at ``place``, for each entry of its drive.

    Raises ``InputError`` if the CAD kernel fails or the crank's mesh has too few nodes near a cut.

    Parameters
    ----------
    coarse : nodes (3, p) m of the crank's mesh and its modes there, (3, p, n)
    place : one of :func:`cranktrain.structure.stress.throw_mesh.throw_places`
    fineness : radius of a fillet or bore over the edges on it; by default a value that resolves the place
    """
    say(f"throw {throw}: mesh, fine at {place}")
    model = finite_elements(throw_mesh(crankshaft, throw, place, fineness or place_fineness(place)), material)
    say(f"throw {throw}: {place}, {model.basis.N} degrees of freedom")
    dofs = component_dofs(model.basis)
    nodes, moved = cut_motion(model.mesh, crankshaft, throw, coarse)
    held, n = dofs[:, nodes].ravel(), coarse[1].shape[2]
    free = np.setdiff1d(np.arange(model.basis.N), held)
    # Displacements (3 nodes, CUTS) of nodes on the cuts in rigid motions of each cut about its middle.
    motions = np.zeros((3, len(nodes), CUTS))
    for first, middle in zip((0, 6), cut_places(crankshaft, throw), strict=True):
        arm = model.mesh.doflocs[:, nodes] - np.array([[0.0], [0.0], [middle]])
        on = np.abs(arm[2]) < _ON_PLANE
        motions[:, on, first : first + 3] = np.eye(3)[:, None]
        motions[:, on, first + 3 : first + 6] = -skew(arm[:, on].T).transpose(1, 0, 2)
    rigid = motions.reshape(-1, CUTS)
    known = np.zeros((held.size, n + LOADS + CUTS))
    known[:, :n], known[:, -CUTS:] = moved.reshape(held.size, n), rigid
    loads, halves = throw_loads(model, crankshaft, throw)
    force = np.zeros((model.basis.N, n + LOADS + CUTS))
    force[:, n:-CUTS] = loads
    chosen = _watched(model.mesh, crankshaft, throw, place)
    stress = NodalStress.of(model.mesh, material, chosen)
    modes = np.empty((n + LOADS + CUTS, 6, chosen.size), dtype=np.float32)
    beyond = np.empty((n + LOADS + CUTS, CUTS))
    with one_thread():
        rows, own = model.stiffness[free], model.stiffness[held]
        coupling, factor = rows[:, held], factorise(rows[:, free].tocsc(), model.positions[:, free])
        for first in range(0, len(modes), _BATCH):
            part = slice(first, min(first + _BATCH, len(modes)))
            answer = np.zeros((model.basis.N, part.stop - part.start))
            answer[held] = known[:, part]
            answer[free] = factor.solve(np.ascontiguousarray(force[free, part] - coupling @ known[:, part]))
            modes[part] = stress(answer[dofs])
            beyond[part] = (own @ answer - force[held, part]).T @ rigid
    beyond[n + 6 : n + 18] += halves
    return FilletModes(place, throw, modes, beyond, np.ascontiguousarray(model.mesh.doflocs[:, chosen].T))


def cut_places(c: Crankshaft, throw: int) -> tuple[float, float]:
    """Position z (m) of front and rear cut of a throw (numbered from 1), the middles of its main journals."""
    front, rear = (0.5 * sum(span) for span in stations(c).mains[throw - 1 : throw + 1])
    return front, rear


def throw_loads(model: FEModel, crankshaft: Crankshaft, throw: int) -> tuple[Array, Array]:
    """Forces (ndof, LOADS) of the entries of a drive after the modal coordinates.

    The second array (12, CUTS) has force and moment about the cuts of those halves of the main journals that lie
    inside, per unit load on the whole journals.
    """
    pin = np.array(pin_centre(crankshaft, throw))
    columns = [averaged_interfaces(model, [f"pin[{throw}]"], {f"pin[{throw}]": pin}).averaging.T.toarray()]
    halves = np.zeros((12, CUTS))
    motions = rigid_motions(model)
    for k, z in enumerate(cut_places(crankshaft, throw)):
        middle = np.array([0.0, 0.0, z])
        columns.append(_half_journal(model, f"main[{throw + k}]", middle))
        own = slice(6 * k, 6 * k + 6)
        halves[own, own] = columns[-1].T @ _about(motions, middle)
    outward = sample(model, lambda x: x * np.array([[1.0], [1.0], [0.0]]))
    inertia = -(model.mass @ _about(motions, pin))
    return np.hstack((*columns, inertia, (model.mass @ outward)[:, None])), halves


def _about(motions: Array, place: Array) -> Array:
    """Rigid motions (ndof, 6) with rotations about a point (3,)."""
    turned = motions.copy()
    turned[:, 3:] -= motions[:, :3] @ np.cross(np.eye(3), place).T
    return turned


def _half_journal(model: FEModel, name: str, middle: Array) -> Array:
    """Forces (ndof, 6) on the half of a main journal in this sub-model, from a unit load on the whole journal."""
    facets = surface_basis(model.mesh, model.basis.elem, name, 4)
    fields = unit_motions(np.asarray(facets.global_coordinates()) - middle[:, None, None])
    here = np.einsum("kafq,lafq,fq->kl", fields, fields, facets.dx)
    signs = np.array([1.0, 1.0, -1.0, -1.0, -1.0, 1.0])  # the outer half is the mirror image across the cut
    whole = here + signs[:, None] * here * signs
    averaging = averaged_interfaces(model, [name], {name: middle}).averaging
    return np.asarray(averaging.T @ np.linalg.solve(whole, here).T)


def cut_motion(mesh: MeshTet2, c: Crankshaft, throw: int, coarse: tuple[Array, Array]) -> tuple[Integers, Array]:
    """Nodes on both cuts and their displacement (3, nodes, n) in the crank's modes; ``coarse`` as :func:`fillet_modes`.

    Raises ``InputError`` if the crank's mesh has too few nodes near a cut.
    """
    places, modes = coarse
    nodes, moved = [], []
    for z, span in zip(cut_places(c, throw), stations(c).mains[throw - 1 : throw + 1], strict=True):
        scale = 0.5 * c.main_diameter
        near = np.flatnonzero(np.abs(places[2] - z) < SLAB * (span[1] - span[0]))
        on = np.flatnonzero(np.abs(mesh.doflocs[2] - z) < _ON_PLANE)
        centre = np.array([[0.0], [0.0], [z]])
        known = _cubic((places[:, near] - centre) / scale)
        if near.size < known.shape[1] or np.linalg.matrix_rank(known, 1e-6) < known.shape[1]:
            raise InputError(
                f"crankshaft: {near.size} nodes of its mesh near z = {1e3 * z:.0f} mm do not determine the motion of a "
                "cut there; use a smaller mesh_size"
            )
        fit = _cubic((mesh.doflocs[:, on] - centre) / scale) @ np.linalg.pinv(known)
        nodes.append(on)
        moved.append(np.einsum("cp,apn->acn", fit, modes[:, near], optimize=True))
    return np.concatenate(nodes), np.concatenate(moved, axis=1)


def _cubic(places: Array) -> Array:
    """Monomials (p, 20) up to the third degree of positions (3, p)."""
    x, y, z = places
    powers = [(i, j, k) for i in range(4) for j in range(4 - i) for k in range(4 - i - j)]
    return np.stack([x**i * y**j * z**k for i, j, k in powers], axis=1)


def _watched(mesh: MeshTet2, c: Crankshaft, throw: int, place: str) -> Integers:
    """Corner nodes at which stress is evaluated: on a fillet, or at the mouth of an oil bore on its pin."""
    nodes = np.unique(mesh.facets[:, mesh.boundary_facets()])
    names, number = surface_features(replace(c, oil_holes="hole" in place), mesh.p[:, nodes].T)
    wanted = number == names.index(place)
    if "hole" in place:
        apart = mesh.p[:, nodes] - np.array(oil_outlet(c, throw))[:, None]
        wanted &= np.linalg.norm(apart, axis=0) < c.oil_hole_diameter
    return nodes[wanted]
