"""Big-end eye of a connecting rod: the elastic bore of a big end at level ``ehd``.

The eye is one steel solid: a round housing around the shells, shoulders on either side for the bolts of the cap, and a
part of the shank. The bolted joint is assumed closed. The shell passes the film's load on to the housing at the same
angle (p R dφ = p_h R_h dφ). The eye deforms as a massless body under the film's load only. The inertia of cap and eye
at speed, which also ovalises the bore, is not included.

Axes are those of the rod: x across it, y from the big end to the small end, z along the pin. A uniform traction on the
cut of the shank balances the film's force along y. A rod is pinned at both ends, so the eye has no support against a
lateral load. The inertia of the eye balances lateral loads, loads along the pin and moments (inertia relief). A shank
clamped at its cut would bend under a lateral load, unlike a real rod.

The compliance on patterns of pressure ψ_i is that of a bearing saddle, C_ij = f_iᵀ G f_j with the flexibility G of this
body, which is symmetric and cannot generate energy. The shapes include the bore's rigid motion, along y relative to the
cut of the shank and across relative to the eye's mass, because the rods of the running model are rigid and do not
contain it. Without this motion the remaining compliance would not be positive: under a load towards the shank the
pressure widens the bore, and the load path to the shank narrows it.
"""

from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import qr
from skfem import MeshTet2

from cranktrain.core.errors import InputError
from cranktrain.core.threads import one_thread
from cranktrain.core.types import Array, Progress
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import SHELL_SHARE, Material, PlainBearing, Rod
from cranktrain.engine.quantities import Length, check_values, mm, need
from cranktrain.film.elastic.bore_compliance import BoreCompliance, reduced_compliance
from cranktrain.structure.block.saddle import DEGREE, FACET_ORDER, WAVES, pattern_loads
from cranktrain.structure.fem.craig_bampton import rigid_motions
from cranktrain.structure.fem.elasticity import FEModel, finite_elements
from cranktrain.structure.fem.factor import factorise
from cranktrain.structure.fem.mesh import cad_solid, surface_basis
from cranktrain.structure.fem.surface_compliance import kept_compliance

# Version of the stored compliance: raised when changed code gives another compliance for the same eye.
RECIPE = 1
ROD_STEEL = Material(youngs_modulus=210e9, poisson_ratio=0.3, density=7850.0)
"""Forged steel of connecting rods."""
WALL, EYE_WIDTH, SHANK_WIDTH = 0.2, 1.6, 0.9
"""Usual wall of the housing, width across the bolts and width of the shank where it joins the eye, over the diameter of
the housing's bore; chosen. Round housings of rods have walls of 0.12 to 0.2, and caps also have ribs. A shank widens
towards its eye; with the width that it has halfway to the small end the bore's upper half would be unsupported."""
SHOULDER_HEIGHT, CUT = 0.35, 1.3
"""Half height of the shoulders and distance of the shank's cut, over the diameter of the housing's bore; chosen."""


@dataclass(frozen=True)
class Eye:
    """Dimensions of a big-end eye, m.

    Attributes
    ----------
    film_diameter, film_width : diameter and width of the oil film; eye and shank have the same width along the pin
    bore_diameter : diameter of the housing's bore, outside the shells
    wall, cap_wall : wall thickness of the housing towards the shank, and of the cap
    width : width across the bolts
    shoulder_height : half height of the shoulders
    shank_width : width of the shank across, where it joins the eye
    cut : distance from the pin to the cut of the shank
    mesh_size : largest edge; on the bore it is ``bore_mesh_share`` times this
    """

    film_diameter: Length
    film_width: Length
    bore_diameter: Length
    wall: Length
    cap_wall: Length
    width: Length
    shoulder_height: Length
    shank_width: Length
    cut: Length
    mesh_size: Length
    bore_mesh_share: float = 0.35
    material: Material = ROD_STEEL


def eye_of(bearing: PlainBearing, rod: Rod) -> Eye:
    """Eye of a rod, from keys of its table or else usual proportions; ``InputError`` if the dimensions make no eye.

    The error names the engine file's key.
    """
    bore = (1.0 + 2.0 * SHELL_SHARE) * bearing.diameter
    wall = rod.eye_wall or WALL * bore
    eye = Eye(
        film_diameter=bearing.diameter,
        film_width=bearing.width,
        bore_diameter=bore,
        wall=wall,
        cap_wall=rod.cap_wall or wall,
        width=rod.eye_width or max(EYE_WIDTH * bore, bore + 2.0 * wall),
        shoulder_height=SHOULDER_HEIGHT * bore,
        shank_width=rod.shank_width or SHANK_WIDTH * bore,
        cut=max(CUT * bore, 0.5 * bore + 2.0 * wall),
        mesh_size=0.2 * bearing.diameter,
    )
    of = partial(need, "rod")
    of("eye_wall", eye.wall <= bore, f"{mm(eye.wall)} is more than the bore, {mm(bore)}")
    of("cap_wall", eye.cap_wall <= bore, f"{mm(eye.cap_wall)} is more than the bore, {mm(bore)}")
    of("eye_width", eye.width >= 1.1 * bore, f"{mm(eye.width)} leaves no steel beside the bore of {mm(bore)}")
    text = f"{mm(eye.shank_width)} is wider than the eye, {mm(eye.width)}"
    of("shank_width", eye.shank_width <= eye.width, text)
    return eye


def eye_compliance(engine: Engine, count: int = 8, progress: Progress | None = None) -> BoreCompliance:
    """Elastic shapes of a big end's bore, rigid motion included; computed once, then read from the user's cache.

    Raises ``InputError``: an engine without big-end bearings, dimensions that make no eye, or a count that the patterns
    cannot give.
    """
    bearing = engine.big_end_bearing
    if bearing is None:
        raise InputError(f"engine '{engine.name}' has no [big_end_bearing]; add it, or leave big ends rigid")
    plan = eye_of(bearing, engine.rod)
    say = progress or (lambda stage: None)

    def computed() -> Array:
        say("meshing the big-end eye")
        mesh = eye_mesh(plan)
        say(f"finite elements of the big-end eye ({3 * mesh.doflocs.shape[1]} degrees of freedom)")
        model = finite_elements(mesh, plan.material)
        with one_thread():  # one thread gives the same bytes on any number of processors
            return eye_flexibility(model, plan)

    patternwise = kept_compliance("big-end", [RECIPE, WAVES, DEGREE, asdict(plan)], computed)
    return reduced_compliance(patternwise, np.pi * plan.film_diameter * plan.film_width, count, with_motion=True)


def eye_flexibility(model: FEModel, eye: Eye, waves: int = WAVES, degree: int = DEGREE) -> Array:
    """Compliance of the bore on patterns of pressure.

    The result is (2 waves + 1, degree + 1, 2 waves + 1, degree + 1) m³/Pa, symmetric in its pairs of indices.
    """
    loads = pattern_loads(model, eye.film_diameter, eye.film_width, waves, degree)
    motions = rigid_motions(model)
    balancing = np.asarray(model.mass @ motions)
    # A unit traction along y on the cut of the shank, m².
    facets = surface_basis(model.mesh, model.basis.elem, "cut", FACET_ORDER)
    load = np.zeros(model.basis.N)
    for dofs, basis in zip(facets.element_dofs, facets.basis, strict=True):
        np.add.at(load, dofs, np.einsum("fq,fq->f", np.asarray(basis[0])[1], facets.dx))
    balancing[:, 1] = load
    balanced = loads - balancing @ np.linalg.solve(motions.T @ balancing, motions.T @ loads)
    # Six supports, chosen so that they determine the rigid motions best; balanced loads cause no reaction in them.
    _, _, order = qr((motions / np.linalg.norm(motions, axis=0)).T, mode="economic", pivoting=True)
    free = np.sort(order[6:])
    with one_thread():
        answer = factorise(model.stiffness[free][:, free].tocsc()).solve(np.ascontiguousarray(balanced[free]))
    compliance = balanced[free].T @ answer
    shape = (2 * waves + 1, degree + 1)
    return np.asarray((0.5 * (compliance + compliance.T)).reshape(*shape, *shape))


def eye_mesh(eye: Eye) -> MeshTet2:
    """Mesh with the boundaries ``bore`` and ``cut``, in curved quadratic tetrahedra; ``InputError``."""
    check_values(eye, "big-end eye")
    need("big-end eye", "mesh_size", eye.mesh_size >= 0.02 * eye.bore_diameter, "would take millions of elements")
    mesh = cad_solid("cranktrain.structure.rod.eye:_solid", asdict(eye), "big-end eye", "a dimension of the rod's eye")
    skin = mesh.boundary_facets()
    x, y, _ = mesh.p[:, mesh.facets[:, skin]]
    small = 1e-6 * eye.bore_diameter
    on_bore = (np.abs(np.hypot(x, y) - 0.5 * eye.bore_diameter) < small).all(axis=0)
    cut = (np.abs(y - eye.cut) < small).all(axis=0)
    return mesh.with_boundaries({"bore": skin[on_bore], "cut": skin[cut]})


def _solid(e: dict[str, Any]) -> tuple[Any, float, float]:
    """Solid, largest edge and fineness for the mesher; runs in its child process."""
    from netgen import occ

    half, radius = 0.5 * e["film_width"], 0.5 * e["bore_diameter"]

    def box(x: float, low: float, high: float, z: float) -> Any:
        return occ.Box(occ.Pnt(-x, low, -z), occ.Pnt(x, high, z))

    def round_bar(r: float) -> Any:
        return occ.Cylinder(occ.Pnt(0.0, 0.0, -half), occ.gp_Dir(0, 0, 1), r=r, h=2.0 * half)

    far = 4.0 * e["bore_diameter"]
    solid = round_bar(radius + e["wall"]) * box(far, 0.0, far, half)
    solid += round_bar(radius + e["cap_wall"]) * box(far, -far, 0.0, half)
    solid += box(0.5 * e["width"], -e["shoulder_height"], e["shoulder_height"], half)
    solid += box(0.5 * e["shank_width"], 0.0, e["cut"], half)
    bore = round_bar(radius)
    bore.faces.maxh = e["bore_mesh_share"] * e["mesh_size"]
    return solid - bore, e["mesh_size"], 1.0
