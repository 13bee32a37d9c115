"""The crankshaft as a solid: journals with fillets, webs with counterweights, nose and flange, from a few dimensions.

The sequence along z is nose, main journal 1, web, pin 1, web, main journal 2 … last main journal, flange; z = 0 is the
middle of main journal 1. Several pins between two mains are joined by flying webs. In the plane of a web (pin along +η)
its outline is the hull of a circle about the main axis and one about the pin axis, or about the axes of both pins for a
flying web. A counterweight adds the part of a disc with η ≤ 0 and |ξ| ≤ half width. Every round piece is a body of
revolution with its own fillets and touches its neighbours only on plane faces, so the boolean operations of the CAD
kernel are simple and no fillet has to be found afterwards.
"""

from collections.abc import Sequence
from dataclasses import MISSING, asdict, dataclass, fields
from math import asin, atan2, cos, hypot, pi, sin, sqrt
from typing import Any, NamedTuple

from cranktrain.engine.checks.crankshaft import check_crankshaft
from cranktrain.engine.parts import Crankshaft

# Edge length in an oil hole over its diameter; longer edges would cut across the bore.
HOLE_FINENESS = 0.5


class Web(NamedTuple):
    """A crank web: begin and end along z (m), and numbers (from 1) of the main journals and pins that the web joins.

    ``main`` is its main journal, or 0 for a flying web, which joins two ``pins``. A ``front`` web lies in front of its
    pin.
    """

    span: tuple[float, float]
    main: int
    pins: tuple[int, ...]
    front: bool = True


@dataclass(frozen=True)
class Stations:
    """Axial layout of a crankshaft: (start, end) of each piece along z, m, and the webs."""

    nose: tuple[float, float]
    mains: tuple[tuple[float, float], ...]
    pins: tuple[tuple[float, float], ...]
    joins: tuple[Web, ...]
    flange: tuple[float, float]

    @property
    def webs(self) -> tuple[tuple[float, float], ...]:
        """Begin and end of each web along z, m."""
        return tuple(web.span for web in self.joins)


def stations(crankshaft: Crankshaft) -> Stations:
    """Axial layout; z = 0 in the middle of main journal 1, z grows towards the flange."""
    c = crankshaft
    z = -0.5 * c.main_widths[0]
    nose = (z - c.nose_length, z)
    mains, joins = [(z, -z)], []
    pins: list[tuple[float, float]] = []
    z = -z
    for main, (width, count) in enumerate(zip(c.main_widths[1:], c.bays, strict=True), 1):
        joins.append(Web((z, z + c.web_thickness), main, (len(pins) + 1,)))
        for k in range(count):
            start = z + c.web_thickness + k * c.pin_pitch
            pins.append((start, start + c.pin_width))
            if k + 1 < count:
                joins.append(Web((pins[-1][1], start + c.pin_pitch), 0, (len(pins), len(pins) + 1)))
        z = z + 2 * c.web_thickness + c.pin_width + (count - 1) * c.pin_pitch
        joins.append(Web((pins[-1][1], z), main + 1, (len(pins),), front=False))
        mains.append((z, z + width))
        z += width
    return Stations(nose, tuple(mains), tuple(pins), tuple(joins), (z, z + c.flange_length))


def webs_of(crankshaft: Crankshaft, pin: int) -> tuple[int, int]:
    """Numbers (from 1) of the web in front of a pin and the web behind it."""
    return pin + crankshaft.main_before[pin - 1] - 1, pin + crankshaft.main_before[pin - 1]


def crank_interfaces(crankshaft: Crankshaft) -> tuple[str, ...]:
    """Names of the interfaces of a crankshaft with these dimensions."""
    return interface_names(len(crankshaft.main_widths), len(crankshaft.throw_angles))


def interface_names(mains: int, pins: int) -> tuple[str, ...]:
    """Names of interfaces of a crankshaft: main[1 … mains], pin[1 … pins], pulley, flywheel, thrust."""
    journals = [f"main[{i}]" for i in range(1, mains + 1)] + [f"pin[{i}]" for i in range(1, pins + 1)]
    return (*journals, "pulley", "flywheel", "thrust")


class Outline(NamedTuple):
    """Outline of a web across the axis: radii about centres at η = 0 and η = ``apart``, and a counterweight (m).

    ``angle`` (rad) is the angle of η from +y, ``origin`` the position (x, y) of η = 0.
    """

    low: float
    high: float
    apart: float
    angle: float
    origin: tuple[float, float] = (0.0, 0.0)
    weight_radius: float = 0.0
    weight_half_width: float = 0.0


def web_outline(crankshaft: Crankshaft, number: int) -> Outline:
    """Outline of the web with this ``number`` (from 1), seen along the crank's axis."""
    c, web = crankshaft, stations(crankshaft).joins[number - 1]
    if web.main:
        pin = web.pins[0] - 1
        weight = (c.counterweight_radius, c.counterweight_half_width) if c.counterweights[number - 1] else (0.0, 0.0)
        return Outline(c.web_main_radius, c.web_pin_radius, c.throws[pin], c.throw_angles[pin], (0.0, 0.0), *weight)
    (x, y, _), (x2, y2, _) = (pin_centre(c, pin) for pin in web.pins)
    return Outline(c.web_pin_radius, c.web_pin_radius, hypot(x2 - x, y2 - y), atan2(x - x2, y2 - y), (x, y))


def shaping(crankshaft: Crankshaft) -> dict[str, Any]:
    """Dimensions of a crankshaft for its digest; a dimension with a default value only if it differs from it."""
    usual = {entry.name: entry.default for entry in fields(crankshaft) if entry.default is not MISSING}
    return {key: value for key, value in asdict(crankshaft).items() if key not in usual or value != usual[key]}


def pin_centre(crankshaft: Crankshaft, pin: int) -> tuple[float, float, float]:
    """Middle of a pin (numbered from 1), m; a throw at angle α points along (−sin α, cos α)."""
    angle, throw = crankshaft.throw_angles[pin - 1], crankshaft.throws[pin - 1]
    start, end = stations(crankshaft).pins[pin - 1]
    return -throw * sin(angle), throw * cos(angle), 0.5 * (start + end)


def oil_outlet(crankshaft: Crankshaft, pin: int) -> tuple[float, float, float]:
    """Mouth of the oil bore on a pin (numbered from 1), away from the crank's axis, m."""
    x, y, z = pin_centre(crankshaft, pin)
    out = 1.0 + 0.5 * crankshaft.pin_diameter / crankshaft.throws[pin - 1]
    return out * x, out * y, z


def fillet_ends(crankshaft: Crankshaft) -> dict[str, tuple[float, float]]:
    """Every fillet by name: z of the web's plane where it begins, m, and its signed extent along z, m.

    ``pin[1] front fillet`` is at the end of pin 1 towards the pulley, ``rear`` at the end towards the flywheel.
    """
    at, r = stations(crankshaft), crankshaft.fillet
    journals = [(f"main[{i}]", span) for i, span in enumerate(at.mains, 1)]
    journals += [(f"pin[{i}]", span) for i, span in enumerate(at.pins, 1)]
    sides = (("front", 0, r), ("rear", 1, -r))
    return {f"{name} {side} fillet": (span[k], extent) for name, span in journals for side, k, extent in sides}


def crankshaft_shape(crankshaft: Crankshaft, fineness: float = 0.0, fillets: Sequence[str] | None = None) -> Any:
    """Build the crankshaft as one solid of netgen's CAD kernel, m.

    With a ``fineness`` the largest edge on fillets is their radius over it, on all fillets or on those named in
    ``fillets`` as by :func:`fillet_ends`.

    Faces ``main[i]``, ``pin[i]``, ``pulley`` (the nose's cylinder) and ``flange`` (rim of the flange) carry names.
    The kernel may crash, so call it in a child process as :func:`cranktrain.structure.fem.mesh.crankshaft_mesh` does.
    """
    from netgen import occ

    c = crankshaft
    check_crankshaft(c)
    at = stations(c)
    r_main, r_pin, r_nose = 0.5 * c.main_diameter, 0.5 * c.pin_diameter, 0.5 * c.nose_diameter
    axis = (0.0, 0.0)
    pieces = [journal(occ, axis, r_nose, at.nose, (0.0, c.fillet), "pulley")]
    pieces += [
        journal(occ, axis, r_main, span, (c.fillet if i else 0.0, c.fillet), f"main[{i + 1}]")
        for i, span in enumerate(at.mains)
    ]
    for i, span in enumerate(at.pins):
        x, y, _ = pin_centre(c, i + 1)
        pieces.append(journal(occ, (x, y), r_pin, span, pin_fillets(c, i + 1), f"pin[{i + 1}]"))
    pieces += [web(occ, c, j) for j, span in enumerate(at.webs, 1) if span[1] > span[0]]
    pieces.append(journal(occ, axis, 0.5 * c.flange_diameter, at.flange, (0.0, 0.0), "flange"))
    pieces.sort(key=lambda piece: piece.center.z)
    solid = pieces[0]
    for piece in pieces[1:]:
        solid = solid + piece
    if c.oil_holes:
        for i in range(1, len(at.pins) + 1):
            if oil_main(c, i):
                solid = solid - oil_hole(occ, c, i)
    if fineness > 0.0:
        ends = fillet_ends(c)
        refine_fillets(solid, [ends[name] for name in fillets or ends], fineness)
    return solid


def journal(
    occ: Any,
    centre: tuple[float, float],
    radius: float,
    span: tuple[float, float],
    fillets: tuple[float, float],
    name: str,
) -> Any:
    """Cylinder between two planes with a quarter-circle fillet at either end; its running surface is named."""
    x, y = centre
    start, end = span
    f0, f1 = fillets

    def at(r: float, z: float) -> Any:
        return occ.Pnt(x + r, y, z)

    profile = [occ.Segment(at(0, start), at(radius + f0, start))]
    bend = 1 - sqrt(0.5)
    if f0 > 0:
        profile.append(
            occ.ArcOfCircle(at(radius + f0, start), at(radius + bend * f0, start + bend * f0), at(radius, start + f0))
        )
    profile.append(occ.Segment(at(radius, start + f0), at(radius, end - f1)))
    if f1 > 0:
        profile.append(
            occ.ArcOfCircle(at(radius, end - f1), at(radius + bend * f1, end - bend * f1), at(radius + f1, end))
        )
    profile += [occ.Segment(at(radius + f1, end), at(0, end)), occ.Segment(at(0, end), at(0, start))]
    solid = occ.Face(occ.Wire(profile)).Revolve(occ.Axis(occ.Pnt(x, y, 0), occ.Z), 360)
    middle = 0.5 * (start + f0 + end - f1)
    running = 2 * pi * radius * (end - f1 - start - f0)
    surface = min(solid.faces, key=lambda face: abs(face.center.z - middle) + abs(face.mass - running) / radius)
    surface.name = name
    return solid


def pin_fillets(c: Crankshaft, pin: int) -> tuple[float, float]:
    """Radii of a pin's fillets at its front and rear end, m; 0 where it meets the next pin without a web."""
    webs = stations(c).webs
    front, rear = (c.fillet if end > start else 0.0 for start, end in (webs[j - 1] for j in webs_of(c, pin)))
    return front, rear


def web(occ: Any, c: Crankshaft, number: int) -> Any:
    """Web (numbered from 1) as a plate between two planes."""
    return plate(occ, web_outline(c, number), stations(c).webs[number - 1])


def plate(occ: Any, outline: Outline, span: tuple[float, float]) -> Any:
    """Plate with this outline between two planes across z."""
    z = span[0]
    face = _web_outline(occ, outline.low, outline.high, outline.apart, z)
    if outline.weight_radius > 0.0:
        face = face + _counterweight_outline(occ, outline.weight_radius, outline.weight_half_width, z)
    solid = face.Extrude((span[1] - span[0]) * occ.Z)
    solid = solid.Rotate(occ.Axis(occ.Pnt(0, 0, 0), occ.Z), outline.angle * 180 / pi)
    x, y = outline.origin
    return solid.Move(occ.Vec(x, y, 0)) if x or y else solid


def _web_outline(occ: Any, r_main: float, r_pin: float, throw: float, z: float) -> Any:
    """Hull of the two circles about the main and the pin axis, as a CAD face at height z (m)."""
    if throw <= abs(r_main - r_pin):
        y, r = (0.0, r_main) if r_main > r_pin else (throw, r_pin)
        right, left = occ.Pnt(r, y, z), occ.Pnt(-r, y, z)
        arcs = [occ.ArcOfCircle(a, occ.Pnt(0, y + s * r, z), b) for a, b, s in ((right, left, 1), (left, right, -1))]
        return occ.Face(occ.Wire(arcs))
    tangent = asin((r_main - r_pin) / throw)
    low = [occ.Pnt(s * r_main * cos(tangent), r_main * sin(tangent), z) for s in (1, -1)]
    high = [occ.Pnt(s * r_pin * cos(tangent), throw + r_pin * sin(tangent), z) for s in (1, -1)]
    edges = [
        occ.Segment(low[0], high[0]),
        occ.ArcOfCircle(high[0], occ.Pnt(0, throw + r_pin, z), high[1]),
        occ.Segment(high[1], low[1]),
        occ.ArcOfCircle(low[1], occ.Pnt(0, -r_main, z), low[0]),
    ]
    return occ.Face(occ.Wire(edges))


def _counterweight_outline(occ: Any, radius: float, half_width: float, z: float) -> Any:
    """Counterweight outline: half disc opposite to the pin, cut off at its half width, as a CAD face at z (m)."""
    b = min(half_width, radius)
    depth = sqrt(radius**2 - b**2)
    corners = [occ.Pnt(b, 0, z), occ.Pnt(b, -depth, z), occ.Pnt(-b, -depth, z), occ.Pnt(-b, 0, z)]
    arc = occ.ArcOfCircle(corners[1], occ.Pnt(0, -radius, z), corners[2])
    if depth < 1e-6 * radius:
        half = occ.ArcOfCircle(corners[0], occ.Pnt(0, -radius, z), corners[3])
        return occ.Face(occ.Wire([half, occ.Segment(corners[3], corners[0])]))
    sides = [occ.Segment(corners[0], corners[1]), arc, occ.Segment(corners[2], corners[3])]
    return occ.Face(occ.Wire([*sides, occ.Segment(corners[3], corners[0])]))


def oil_main(c: Crankshaft, pin: int) -> int:
    """Number (from 1) of the main journal whose oil bore leads to a pin. Return 0 if there is no oil bore."""
    before = [web.main for web in stations(c).joins if web.main and web.pins == (pin,)]
    return before[0] if before else 0


def oil_hole(occ: Any, c: Crankshaft, pin: int) -> Any:
    """Straight oil bore from a main journal's far side to the outer side of a pin (from 1), through their middles."""
    x, y, z_pin = pin_centre(c, pin)
    throw = c.throws[pin - 1]
    out = (x / throw, y / throw)
    start, end = stations(c).mains[oil_main(c, pin) - 1]
    z_main = 0.5 * (start + end)
    rise = throw + 0.5 * c.pin_diameter + 0.5 * c.main_diameter
    run = z_pin - z_main
    length = hypot(rise, run)
    along = (out[0] * rise / length, out[1] * rise / length, run / length)
    reach = c.oil_hole_diameter
    low = -0.5 * c.main_diameter
    foot = occ.Pnt(out[0] * low - reach * along[0], out[1] * low - reach * along[1], z_main - reach * along[2])
    bore = occ.Cylinder(foot, occ.gp_Dir(*along), r=0.5 * c.oil_hole_diameter, h=length + 2 * reach)
    for part in (*bore.faces, *bore.edges):
        part.maxh = HOLE_FINENESS * c.oil_hole_diameter
    return bore


def refine_fillets(solid: Any, fillets: Sequence[tuple[float, float]], fineness: float) -> Any:
    """Limit mesh edges on fillets, each (z of its web's plane, signed extent), to their radius over ``fineness``."""
    for face in solid.faces:
        low, high = (corner.z for corner in face.bounding_box)
        for z, extent in fillets:
            begins, length = (low, high - low) if extent > 0.0 else (high, high - low)
            # The CAD kernel's bounding box of a fillet includes its control points, which lie outside the fillet.
            if abs(begins - z) < 0.02 * abs(extent) and 0.9 < length / abs(extent) < 2.5:
                face.maxh = abs(extent) / fineness
    return solid


def refine_rim(solid: Any, crankshaft: Crankshaft, pin: int, fineness: float) -> Any:
    """Limit mesh edges at the oil bore's mouth on a pin (numbered from 1) to the bore's radius over ``fineness``."""
    outlet, reach = oil_outlet(crankshaft, pin), crankshaft.oil_hole_diameter
    for edge in solid.edges:
        if max(abs(a - b) for a, b in zip(edge.center, outlet, strict=True)) < reach and edge.mass < 2 * pi * reach:
            edge.maxh = 0.5 * reach / fineness
    return solid
