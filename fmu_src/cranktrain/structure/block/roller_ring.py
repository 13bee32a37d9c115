"""Linear stiffness of a roller bearing: outer ring and housing as finite elements, rollers as springs.

The route of the reference (its chapter 5.2): a finite-element model gives one radial and one tilting stiffness for the
simulation of the whole engine. Here the journal is rigid; each loaded roller is a row of springs, its contacts' tangent
at a nominal load, which presses on the track; outer ring (steel) and a round housing (cast iron) are elastic, the
housing clamped all around. The deflection at a spring's foot is the mean deflection of the track under the roller. The
contact law already includes the local indentation, so each roller's force is spread over its part of the track by a
smooth window,

    W_j(φ) = cos²(Z(φ − ψ_j)/4)  for |φ − ψ_j| < 2π/Z,      Σ_j W_j = 1,

and over its length by Legendre polynomials. With C the ring's compliance on these patterns, from the loads' own vectors
and so symmetric, S the rollers' springs and B the rollers' approach by the journal's motion (x, y) and (a, b):

    K = Bᵀ (S⁻¹ + C)⁻¹ B = Bᵀ (I + S C)⁻¹ S B.
"""

from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray
from skfem import FacetBasis, MeshTet2

from cranktrain.core.types import Array, Progress
from cranktrain.engine.parts import Material
from cranktrain.engine.quantities import Length, check_values, need
from cranktrain.engine.roller_bearing import RollerBearing
from cranktrain.structure.block.saddle import CAST_IRON
from cranktrain.structure.fem.elasticity import FEModel, finite_elements
from cranktrain.structure.fem.mesh import cad_solid
from cranktrain.structure.fem.surface_compliance import compliance_of, kept_compliance, radial_loads

# Version of the stored compliance: raised when changed code gives another compliance for the same ring.
RECIPE = 1
DEGREE = 3
"""Legendre degree of a roller's force distribution along its axis."""
FACET_ORDER = 8
BEARING_STEEL = Material(youngs_modulus=210e9, poisson_ratio=0.3, density=7850.0)


@dataclass(frozen=True)
class RollerRing:
    """Outer ring and housing of a cylindrical roller bearing, m; the bearing's axis is z.

    Attributes
    ----------
    rollers : number of rollers
    track_diameter : diameter of the outer ring's track
    roller_length : loaded width of the track
    width : width of ring and housing along the axis
    ring_diameter, housing_diameter : outer diameters
    mesh_size : largest edge of an element
    spread : width of the window over which a roller's force is spread, over twice the rollers' pitch
    """

    rollers: int
    track_diameter: Length
    roller_length: Length
    width: Length
    ring_diameter: Length
    housing_diameter: Length
    mesh_size: Length
    spread: float = 1.0
    ring: Material = BEARING_STEEL
    housing: Material = CAST_IRON

    @property
    def ring_mass(self) -> float:
        """Mass of the outer ring, kg."""
        section = 0.25 * np.pi * (self.ring_diameter**2 - self.track_diameter**2)
        return float(self.ring.density * section * self.width)


def ring_for(bearing: RollerBearing) -> RollerRing:
    """Outer ring and housing of usual proportions for a bearing; the ratios are chosen.

    The ring is half a roller's diameter thick and a quarter wider than the rollers are long. The outer diameter of the
    housing is a quarter larger than that of the ring, as in a bulkhead.
    """
    track = bearing.pitch + bearing.diameter
    outside = track + bearing.diameter
    return RollerRing(
        rollers=bearing.rollers,
        track_diameter=track,
        roller_length=bearing.length,
        width=1.25 * bearing.length,
        ring_diameter=outside,
        housing_diameter=1.25 * outside,
        mesh_size=0.075 * track,
    )


def elastic_ring_stiffness(compliance: Array, zeta: Array, springs: Array, first_angle: float) -> Array:
    """Stiffness of the bearing with its rollers as springs on the elastic ring.

    Parameters
    ----------
    compliance : (Z, degree + 1, Z, degree + 1) m/N of the track, see :func:`ring_compliance`
    zeta : (slices,) positions along a roller in [−1, 1]
    springs : (Z, slices) N/m, stiffness of each slice of each roller; 0 for an unloaded slice
    first_angle : angle of roller 0 on the track, rad

    Returns
    -------
    (4, 4) N/m for the journal's displacement (x, y) and the displacement (a, b) of its end ζ = 1 relative to its middle
    """
    count, terms = compliance.shape[:2]
    shapes = legvander(zeta, terms - 1)
    angles = first_angle + 2.0 * np.pi * np.arange(count) / count
    size = count * terms
    rows = np.zeros((size, size))
    approach = np.zeros((count, terms, 4))
    for j in range(count):
        own = slice(j * terms, (j + 1) * terms)
        rows[own, own] = shapes.T @ (springs[j][:, None] * shapes)
        # A roller's approach is constant (ζ⁰) from displacement and linear (ζ¹) from tilt: Legendre degrees 0 and 1.
        approach[j, 0, :2] = approach[j, 1, 2:] = np.cos(angles[j]), np.sin(angles[j])
    motion = approach.reshape(size, 4)
    stiffness = motion.T @ np.linalg.solve(np.eye(size) + rows @ compliance.reshape(size, size), rows @ motion)
    return np.asarray(0.5 * (stiffness + stiffness.T))


def ring_compliance(
    ring: RollerRing, first_angle: float = 0.0, progress: Progress | None = None, rebuild: bool = False
) -> Array:
    """Compliance of the outer ring's track under its rollers; computed once, then read from the user's cache.

    Raises ``InputError`` for dimensions that make no ring.

    Parameters
    ----------
    first_angle : angle of roller 0, rad
    progress : called with the name of each stage before it starts
    rebuild : compute even if a stored compliance exists

    Returns
    -------
    (Z, DEGREE + 1, Z, DEGREE + 1) m/N
    """
    say = progress or (lambda stage: None)

    def computed() -> Array:
        say("meshing ring and housing")
        mesh = ring_mesh(ring)
        say(f"finite elements of ring and housing ({3 * mesh.doflocs.shape[1]} degrees of freedom)")
        model = ring_model(ring, mesh)
        return track_compliance(ring, model, model.basis.get_dofs(mesh.boundaries["clamped"]).flatten(), first_angle)

    return kept_compliance("roller-ring", [RECIPE, DEGREE, first_angle, asdict(ring)], computed, rebuild)


def ring_model(ring: RollerRing, mesh: MeshTet2) -> FEModel:
    """Finite elements of ring and housing, each with its material; ``material`` of the model is the ring's."""
    middle = np.hypot(*mesh.p[:2, mesh.t].mean(axis=1))
    inside = middle < 0.5 * ring.ring_diameter
    model = finite_elements(mesh, ring.ring, elements=np.flatnonzero(inside))
    around = finite_elements(mesh, ring.housing, elements=np.flatnonzero(~inside))
    return FEModel(mesh, model.basis, model.stiffness + around.stiffness, model.mass + around.mass, ring.ring)


def track_compliance(ring: RollerRing, model: FEModel, clamped: NDArray[np.integer], first_angle: float = 0.0) -> Array:
    """Compliance, m/N, of the track for each of Z rollers and its patterns, (Z, DEGREE + 1, Z, DEGREE + 1).

    ``clamped`` are the fixed degrees of freedom.
    """
    shape = (ring.rollers, DEGREE + 1)
    return compliance_of(model, clamped, _roller_loads(ring, model, first_angle)).reshape(*shape, *shape)


def _roller_loads(ring: RollerRing, model: FEModel, first_angle: float) -> Array:
    """Load vectors (ndof, patterns) of rollers that press outwards: Legendre pattern P_m, scaled to unit ∫ P_m dF."""
    facets = FacetBasis(model.mesh, model.basis.elem, facets=model.mesh.boundaries["track"], intorder=FACET_ORDER)
    x, y, z = np.asarray(facets.global_coordinates())
    radius = np.hypot(x, y)
    pitch = 2.0 * np.pi / ring.rollers
    angles = first_angle + pitch * np.arange(ring.rollers)
    away = np.arctan2(y, x) - angles[:, None, None]
    away = np.abs((away + np.pi) % (2.0 * np.pi) - np.pi) / (pitch * ring.spread)
    window = np.where(away < 1.0, np.cos(0.5 * np.pi * away) ** 2, 0.0) / (pitch * ring.spread)
    zeta = 2.0 * z / ring.roller_length
    orders = np.arange(DEGREE + 1) + 0.5
    along = np.moveaxis(legvander(zeta, DEGREE) * orders, -1, 0)
    weight = facets.dx / radius * 2.0 / ring.roller_length
    pressure = np.einsum("jfq,mfq,fq->jmfq", window, along, weight).reshape(-1, *weight.shape)
    return radial_loads(model, facets, pressure)


def check_ring(ring: RollerRing) -> None:
    """Refuse dimensions that make no ring; ``InputError`` names the first one."""
    r, of = ring, partial(need, "roller ring")
    check_values(r, "roller ring")
    of("rollers", r.rollers >= 3, "at least 3 are needed")
    of("width", r.width >= r.roller_length, "is less than the rollers' length; give at least that")
    of("ring_diameter", r.ring_diameter > 1.01 * r.track_diameter, "leaves no ring outside the track")
    of("housing_diameter", r.housing_diameter > 1.01 * r.ring_diameter, "leaves no housing outside the ring")
    of("mesh_size", r.mesh_size >= 0.02 * r.track_diameter, "would take millions of elements")


def ring_mesh(ring: RollerRing) -> MeshTet2:
    """Mesh with the boundaries ``track`` (under the rollers) and ``clamped``, in curved tetrahedra; ``InputError``."""
    check_ring(ring)
    remedy = "mesh_size or a dimension"
    mesh = cad_solid("cranktrain.structure.block.roller_ring:_solid", asdict(ring), "roller ring", remedy)
    skin = mesh.boundary_facets()
    x, y, z = mesh.p[:, mesh.facets[:, skin]]
    radius, small = np.hypot(x, y), 1e-6 * ring.track_diameter
    on_track = (np.abs(radius - 0.5 * ring.track_diameter) < small).all(axis=0)
    under_rollers = (np.abs(z) < 0.5 * ring.roller_length + small).all(axis=0)
    clamped = (np.abs(radius - 0.5 * ring.housing_diameter) < small).all(axis=0)
    return mesh.with_boundaries({"track": skin[on_track & under_rollers], "clamped": skin[clamped]})


def _solid(r: dict[str, Any]) -> tuple[Any, float, float]:
    """Solid, largest edge and fineness for the mesher; runs in its child process."""
    from netgen import occ

    inner, outer = 0.5 * r["roller_length"], 0.5 * r["width"]
    # The solid is made of slices with common faces, so the ends of the rollers become edges of the mesh.
    spans = [(-outer, -inner), (-inner, inner), (inner, outer)] if outer > inner * (1 + 1e-9) else [(-inner, inner)]

    def cylinder(diameter: float, low: float, high: float) -> Any:
        return occ.Cylinder(occ.Pnt(0.0, 0.0, low), occ.gp_Dir(0, 0, 1), r=0.5 * diameter, h=high - low)

    parts = []
    for low, high in spans:
        track, ring, housing = (
            cylinder(r[key], low, high) for key in ("track_diameter", "ring_diameter", "housing_diameter")
        )
        parts += [ring - track, housing - ring]
    return occ.Glue(parts), r["mesh_size"], 1.0
