"""Bearing saddle: a slice of crankcase with cap and main bore, the elastic bore of models without a flexible block.

The slice is one solid plate. Above the split line it is the bulkhead, clamped at its top and two flanks, where it
continues into the crankcase. Below is the free cap. The bolted joint is assumed closed. The shell passes the film's
load on to the housing at the same angle (p R dφ = p_h R_h dφ).

The compliance on patterns ψ_i of pressure (:mod:`cranktrain.film.elastic.bore_compliance`) is computed on quadratic
tetrahedra from the load vectors f_i, so it is symmetric by construction:

    C_ij = ∫ ψ_i u_r(ψ_j) dA = f_iᵀ K⁻¹ f_j,      f_i · v = ∫ ψ_i e_r · v dA
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import MeshTet2

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array, Progress
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import SHELL_SHARE, JournalBearing, Material
from cranktrain.engine.quantities import Length
from cranktrain.film.elastic.bore_compliance import BoreCompliance, patterns, reduced_compliance
from cranktrain.structure.fem.elasticity import FEModel, finite_elements
from cranktrain.structure.fem.mesh import cad_solid, surface_basis
from cranktrain.structure.fem.surface_compliance import compliance_of, kept_compliance, radial_loads

# Version of the stored compliance: raised when changed code gives another compliance for the same saddle.
RECIPE = 1
WAVES = 12
"""Number of Fourier waves of the pressure patterns around the bore; film pressure has only small higher waves."""
DEGREE = 4
"""Legendre degree of the pressure patterns along the bore."""
FACET_ORDER = 10
CAST_IRON = Material(youngs_modulus=120e9, poisson_ratio=0.26, density=7200.0)
"""Cast iron of crankcases, grey to vermicular (110 to 130 GPa); the values are chosen."""


@dataclass(frozen=True)
class Saddle:
    """Dimensions of a saddle, m; x across, y up along the cylinders, the bore's axis is z.

    Attributes
    ----------
    film_diameter, film_width : diameter and width of the oil film
    bore_diameter : diameter of the housing's bore, outside the shells
    thickness : thickness of the plate along the axis
    half_width, height : distance from the axis to the clamped flanks and to the clamped top of the bulkhead
    cap_half_width, cap_depth : half width and depth of the cap, from the axis
    mesh_size : largest edge in the plate; largest edge on the bore is ``bore_mesh_share`` times this
    """

    film_diameter: Length
    film_width: Length
    bore_diameter: Length
    thickness: Length
    half_width: Length
    height: Length
    cap_half_width: Length
    cap_depth: Length
    mesh_size: Length
    bore_mesh_share: float = 0.35
    material: Material = CAST_IRON


def saddle_for(bearing: JournalBearing) -> Saddle:
    """Saddle of usual proportions for a main bearing of diameter D and width L; the ratios are chosen.

    The shells are 0.03 D thick, the plate 1.1 L. The bulkhead extends 1.5 D to either flank and 1.3 D up. The cap
    extends 0.95 D to either side (bore, bolts and their bosses) and 0.95 D down, so 0.42 D of iron lies under the bore.
    """
    d, width = bearing.diameter, bearing.width
    return Saddle(
        film_diameter=d,
        film_width=width,
        bore_diameter=(1.0 + 2.0 * SHELL_SHARE) * d,
        thickness=1.1 * width,
        half_width=1.5 * d,
        height=1.3 * d,
        cap_half_width=0.95 * d,
        cap_depth=0.95 * d,
        mesh_size=0.2 * d,
    )


def bore_compliance(
    engine: Engine,
    count: int = 8,
    with_motion: bool = False,
    progress: Progress | None = None,
) -> BoreCompliance:
    """Elastic shapes of a main bearing's bore in a saddle; computed once, then read from the user's cache.

    Raises ``InputError``: dimensions that make no saddle, or a count that the patterns cannot give.

    Parameters
    ----------
    count : shapes to keep, the softest first
    with_motion : include the bore's rigid motion in the shapes; only for models in which no body carries this motion
    """
    plan = saddle_for(engine.plain_mains)
    area = np.pi * plan.film_diameter * plan.film_width
    say = progress or (lambda stage: None)

    def computed() -> Array:
        say("meshing the saddle")
        mesh = saddle_mesh(plan)
        say(f"finite elements of the saddle ({3 * mesh.doflocs.shape[1]} degrees of freedom)")
        model = finite_elements(mesh, plan.material)
        clamped = model.basis.get_dofs(mesh.boundaries["clamped"]).flatten()
        return pattern_compliance(model, clamped, plan.film_diameter, plan.film_width)

    patternwise = kept_compliance("saddle", [RECIPE, WAVES, DEGREE, asdict(plan)], computed)
    return reduced_compliance(patternwise, area, count, with_motion)


def pattern_compliance(
    model: FEModel, clamped: NDArray[np.integer], film_diameter: float, film_width: float, waves: int = WAVES,
    degree: int = DEGREE,
) -> Array:  # fmt: skip
    """Compliance of the boundary ``bore`` on patterns of pressure; the bore's axis is z, its middle z = 0.

    Raises ``InputError``: if ``clamped`` lets the body move.

    Parameters
    ----------
    clamped : fixed degrees of freedom, enough to prevent rigid motion
    film_diameter, film_width : dimensions of the film, m; the bore takes the film's pressure at the same angle

    Returns
    -------
    (2 waves + 1, degree + 1, 2 waves + 1, degree + 1) m³/Pa, symmetric in its pairs of indices
    """
    loads = pattern_loads(model, film_diameter, film_width, waves, degree)
    try:
        compliance = compliance_of(model, clamped, loads)
    except RuntimeError:
        raise InputError("saddle: its supports let it move; hold surfaces that do not lie on one line") from None
    shape = (2 * waves + 1, degree + 1)
    return compliance.reshape(*shape, *shape)


def pattern_loads(model: FEModel, film_diameter: float, film_width: float, waves: int, degree: int) -> Array:
    """Load vectors f_i of unit pressure in each pattern, (ndof, patterns) m²."""
    facets = surface_basis(model.mesh, model.basis.elem, "bore", FACET_ORDER)
    x, y, z = np.asarray(facets.global_coordinates())
    radius = np.hypot(x, y)
    around, along = patterns(np.arctan2(y, x), 2.0 * z / film_width, waves, degree)
    # Weights are areas of the film, because the force on an area dφ dz of the film acts on the larger bore.
    weight = facets.dx * (0.5 * film_diameter / radius)
    pressure = np.einsum("mfq,lfq,fq->mlfq", around, along, weight).reshape(-1, *weight.shape)
    return radial_loads(model, facets, pressure)


def saddle_mesh(saddle: Saddle) -> MeshTet2:
    """Mesh with the boundaries ``bore`` (under the film) and ``clamped``, in curved tetrahedra; ``InputError``."""
    remedy = "mesh_size or a dimension"
    mesh = cad_solid("cranktrain.structure.block.saddle:_solid", asdict(saddle), "saddle", remedy)
    skin = mesh.boundary_facets()
    x, y, z = mesh.p[:, mesh.facets[:, skin]]
    small = 1e-6 * saddle.bore_diameter
    on_bore = (np.abs(np.hypot(x, y) - 0.5 * saddle.bore_diameter) < small).all(axis=0)
    under_film = (np.abs(z) < 0.5 * saddle.film_width + small).all(axis=0)
    top = (np.abs(y - saddle.height) < small).all(axis=0)
    flank = (np.abs(np.abs(x) - saddle.half_width) < small).all(axis=0)
    return mesh.with_boundaries({"bore": skin[on_bore & under_film], "clamped": skin[top | flank]})


def _solid(s: dict[str, Any]) -> tuple[Any, float, float]:
    """Solid, largest edge and fineness for the mesher; runs in its child process."""
    from netgen import occ

    slices = []
    # The solid is made of three slices with common faces, so the film's edges become edges of the mesh.
    inner, outer = 0.5 * s["film_width"], 0.5 * s["thickness"]
    spans = [(-outer, -inner), (-inner, inner), (inner, outer)] if outer > inner else [(-inner, inner)]
    for low, high in spans:
        bulkhead = occ.Box(occ.Pnt(-s["half_width"], 0.0, low), occ.Pnt(s["half_width"], s["height"], high))
        cap = occ.Box(occ.Pnt(-s["cap_half_width"], -s["cap_depth"], low), occ.Pnt(s["cap_half_width"], 0.0, high))
        bore = occ.Cylinder(occ.Pnt(0.0, 0.0, low), occ.gp_Dir(0, 0, 1), r=0.5 * s["bore_diameter"], h=high - low)
        bore.faces.maxh = s["bore_mesh_share"] * s["mesh_size"]
        slices.append(bulkhead + cap - bore)
    return occ.Glue(slices), s["mesh_size"], 1.0
