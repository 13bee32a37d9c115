"""Fine mesh of one throw, or of a quarter of it, with short edges at its fillets, by netgen's CAD kernel.

A throw reaches from the middle of one main journal to the middle of the next. Its pieces are those of
:mod:`cranktrain.structure.crank.shape`, so its surface is that of the crank.
"""

from dataclasses import asdict, dataclass, replace
from typing import Any

from skfem import MeshTet2

from cranktrain.engine.parts import Crankshaft
from cranktrain.structure.crank.shape import (
    Outline,
    fillet_ends,
    journal,
    oil_hole,
    pin_centre,
    plate,
    refine_fillets,
    refine_rim,
    stations,
    web,
    webs_of,
)
from cranktrain.structure.fem.mesh import NETGEN_EDGES, cad_mesh, quadratic_mesh

FINENESS = 4.0
"""Radius of a fillet over the mesh's edge length on it. With 4 the stress is converged to 0.5 %, see the tests."""

BORE_FINENESS = 16.0
"""Radius of an oil bore over the mesh's edge length at its mouth. Stress differs by 1 % with 12, by 8 % with 4."""
GRADING = 0.8
"""Growth of edge lengths away from a single fine fillet. With 0.5 a throw has twice as many unknowns."""


@dataclass(frozen=True, kw_only=True)
class QuarterThrow:
    """A quarter of a throw: x ≥ 0, from the middle of a main journal to the middle of the pin, which lies at +y (m).

    With ``web_width`` the web is a rectangle as in the rule of the classification societies, which reaches half its
    width beyond both axes. With ``crankshaft`` it is the front web of the engine's throw, counterweight included.
    """

    pin_diameter: float
    main_diameter: float
    throw: float
    web_thickness: float
    pin_fillet: float
    main_fillet: float
    half_pin: float
    half_main: float
    web_width: float = 0.0
    crankshaft: Crankshaft | None = None
    fineness: float = FINENESS

    @classmethod
    def of(cls, crankshaft: Crankshaft, throw: int = 1, fineness: float = FINENESS) -> "QuarterThrow":
        """Make the quarter with the front web of a throw (numbered from 1) of a parametric crankshaft."""
        c = crankshaft
        return cls(
            pin_diameter=c.pin_diameter, main_diameter=c.main_diameter, throw=c.throws[throw - 1],
            web_thickness=c.web_thickness, pin_fillet=c.fillet, main_fillet=c.fillet, half_pin=0.5 * c.pin_width,
            half_main=0.5 * c.main_widths[throw - 1], fineness=fineness,
            crankshaft=replace(c, counterweights=c.counterweights[2 * throw - 2 :]),
        )  # fmt: skip

    @property
    def stations(self) -> tuple[float, float, float, float]:
        """Positions z, m: end of the model in the main journal, both faces of the web, middle of the pin."""
        web_end = self.half_main + self.web_thickness
        return 0.0, self.half_main, web_end, web_end + self.half_pin

    def mesh(self) -> MeshTet2:
        """Mesh of quadratic tetrahedra; ``InputError`` if the CAD kernel fails."""
        values = asdict(self)
        return _mesh("cranktrain.structure.stress.throw_mesh:quarter_solid", values)


def throw_places(crankshaft: Crankshaft, throw: int) -> tuple[str, ...]:
    """Names of the fillets of a throw (numbered from 1) and of the oil bore of its pin."""
    fillets = (
        f"main[{throw}] rear fillet", f"pin[{throw}] front fillet", f"pin[{throw}] rear fillet",
        f"main[{throw + 1}] front fillet",
    )  # fmt: skip
    return fillets + ((f"oil hole[{throw}]",) if crankshaft.oil_hole_diameter > 0.0 else ())


def place_fineness(place: str) -> float:
    """Ratio of radius to edge length for the mesh of a fillet or an oil bore."""
    return FINENESS if place.endswith("fillet") else BORE_FINENESS


def throw_mesh(crankshaft: Crankshaft, throw: int, place: str, fineness: float) -> MeshTet2:
    """Mesh of one throw (numbered from 1) in the crank's coordinates, with short edges at one of its ``throw_places``.

    Pin and main surfaces have the names of the crank's surfaces. ``InputError`` if the CAD kernel fails.
    """
    values = {"crankshaft": asdict(crankshaft), "throw": throw, "place": place, "fineness": fineness}
    return _mesh("cranktrain.structure.stress.throw_mesh:throw_solid", values)


def _mesh(entry: str, values: dict[str, Any]) -> MeshTet2:
    nodes, tets, triangles, labels, names = cad_mesh(entry, values, "throw", "fillet or mesh_size")
    surfaces = {name: triangles[labels == k] for k, name in enumerate(names) if name.startswith(("main", "pin"))}
    return quadratic_mesh(nodes, tets, surfaces, NETGEN_EDGES)


def quarter_solid(values: dict[str, Any]) -> tuple[Any, float, float]:
    """Solid, largest edge and fineness of a quarter throw for the mesher; runs in its child process."""
    from netgen import occ

    crankshaft = _crankshaft(values.pop("crankshaft"))
    q = QuarterThrow(**values)
    start, front, rear, middle = q.stations
    at_pin = (0.0, q.throw)
    pieces = [
        journal(occ, (0.0, 0.0), 0.5 * q.main_diameter, (start, front), (0.0, q.main_fillet), "main"),
        journal(occ, at_pin, 0.5 * q.pin_diameter, (rear, middle), (q.pin_fillet, 0.0), "pin"),
    ]
    if crankshaft is not None:
        c = crankshaft
        weight = (c.counterweight_radius, c.counterweight_half_width) if c.counterweights[0] else (0.0, 0.0)
        outline = Outline(c.web_main_radius, c.web_pin_radius, q.throw, 0.0, (0.0, 0.0), *weight)
        arm = plate(occ, outline, (front, rear))
    else:
        half = 0.5 * q.web_width
        arm = occ.Box(occ.Pnt(-half, -half, front), occ.Pnt(half, q.throw + half, rear))
    far = 10.0 * (q.throw + q.pin_diameter)
    solid = (pieces[0] + arm + pieces[1]) * occ.Box(occ.Pnt(0.0, -far, -far), occ.Pnt(far, far, far))
    fillets = [(front, -q.main_fillet), (rear, q.pin_fillet)]
    return refine_fillets(solid, fillets, q.fineness), 0.2 * q.pin_diameter, 1.0


def throw_solid(values: dict[str, Any]) -> tuple[Any, float, float, float]:
    """Solid, largest edge, fineness and grading of a throw for the mesher; runs in its child process."""
    from netgen import occ

    c, number, place = _crankshaft(values["crankshaft"]), values["throw"], values["place"]
    assert c is not None
    at = stations(c)
    front, rear = at.mains[number - 1 : number + 1]
    x, y, _ = pin_centre(c, number)
    spans = ((0.5 * sum(front), front[1]), at.pins[number - 1], (rear[0], 0.5 * sum(rear)))
    mains, radius = 0.5 * c.main_diameter, 0.5 * c.pin_diameter
    pieces = [
        journal(occ, (0.0, 0.0), mains, spans[0], (0.0, c.fillet), f"main[{number}]"),
        journal(occ, (x, y), radius, spans[1], (c.fillet, c.fillet), f"pin[{number}]"),
        journal(occ, (0.0, 0.0), mains, spans[2], (c.fillet, 0.0), f"main[{number + 1}]"),
    ]
    plates = [web(occ, c, j) for j in webs_of(c, number)]
    solid = pieces[0] + plates[0] + pieces[1] + plates[1] + pieces[2]
    fillets = fillet_ends(c)
    if c.oil_holes or place not in fillets:
        solid = solid - oil_hole(occ, c, number)
    if c.oil_holes and number < len(at.pins):
        solid = solid - oil_hole(occ, c, number + 1)
    if place in fillets:
        refine_fillets(solid, [fillets[place]], values["fineness"])
    else:
        refine_rim(solid, c, number, values["fineness"])
    return solid, c.mesh_size, 1.0, GRADING


def _crankshaft(values: dict[str, Any] | None) -> Crankshaft | None:
    """Dimensions of a crankshaft from their JSON form, in which tuples are lists."""
    if values is None:
        return None
    sizes: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in values.items()}
    return Crankshaft(**sizes)
