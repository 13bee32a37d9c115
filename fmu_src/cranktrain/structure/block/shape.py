"""The engine block as a solid: crankcase with bulkheads and housings, banks with liners and deck, cover and pads.

The cross-section of the crankcase is the hull of its upright walls and the feet of the banks, a shell of uniform
thickness. The first and the last bulkhead close it at the ends. Each bank is a hollow box on its foot, closed by the
deck; the liners go from the deck through the foot. The joints (caps, cover, liners) are assumed closed, and the heads
are masses on the deck. Frame and origin are those of the crankshaft: z along the axis, 0 in the middle of main journal
1. A bank at angle β points along (−sin β, cos β).

Pieces that only touch at faces are fused last and keep their edges, because these bound the interfaces in the mesh.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, hypot, pi, sin
from typing import Any

from cranktrain.core.errors import InputError
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Block

Point = tuple[float, float]
Span = tuple[float, float]

BAND_SHARE = 0.25
"""Height of each of the two liner rings on which the piston acts, as a fraction of the stroke; chosen."""
RETAINER = 10e-3
"""Least radial width of the thrust faces around a bore, m, used if the thrust bearing is smaller; chosen."""
BORE_MESH_SHARE = 0.3
"""Largest edge on the main bores over that of the block."""
LINER_MESH_SHARE = 0.45
"""Largest edge on the liners' running surface over that of the block; coarser elements invert in the thin walls."""
COVER_MESH_SHARE = 0.6
"""Largest edge on the cover over that of the block; an element is at most five times as long as thick."""
FOOT_GAP = 3e-3
"""Gap between the bearing housings and the foot of the banks, m; chosen."""
PATCH = 60e-3
"""Edge length of the square in the middle of the cover that is interface ``cover``, m; chosen."""


@dataclass(frozen=True)
class Bank:
    """One bank of cylinders: its angle (rad), the cylinders' numbers and their positions along z (m)."""

    angle: float
    cylinders: tuple[int, ...]
    positions: tuple[float, ...]


@dataclass(frozen=True)
class BlockPlan:
    """Dimensions from which the solid of a block and its interfaces are made, m and rad.

    Attributes
    ----------
    block : table [block] of the engine file
    mains : position along z of the middle of each main bearing
    bores : diameter of each main bore
    thrust : row of the thrust main (from 0) and outer diameter of its faces, which begin at the bore
    cylinder_bore, stroke : bore and stroke of the cylinders
    pin_heights : height of the piston pin at bottom and at top dead centre, along the bank from the axis; these are the
        middles of the two liner rings
    mounts : position of each mount
    """

    block: Block
    mains: tuple[float, ...]
    bores: tuple[float, ...]
    thrust: tuple[int, float]
    banks: tuple[Bank, ...]
    cylinder_bore: float
    stroke: float
    pin_heights: Span
    mounts: tuple[tuple[float, float, float], ...]

    @property
    def ends(self) -> Span:
        """Positions along z of the block's front and rear face, m."""
        half = 0.5 * self.block.housing_thickness
        return self.mains[0] - half, self.mains[-1] + half

    @property
    def bulkheads(self) -> tuple[Span, ...]:
        """Front and rear face of each bulkhead along z, m; the outer bulkheads are flush with the block's ends."""
        t = self.block.bulkhead_thickness
        front, rear = self.ends
        inner = ((z - 0.5 * t, z + 0.5 * t) for z in self.mains[1:-1])
        return ((front, front + t), *inner, (rear - t, rear))

    @property
    def liner_radius(self) -> float:
        """Outer radius of the liners, m."""
        return 0.5 * self.cylinder_bore + self.block.liner_thickness

    def bands(self) -> list[Span]:
        """Lower and upper liner ring, as heights along the bank from the axis, m."""
        half = 0.5 * BAND_SHARE * self.stroke
        return [(h - half, h + half) for h in self.pin_heights]

    def cells(self, bank: Bank) -> list[Span]:
        """Interval along z (m) of the bank's length that belongs to each cylinder."""
        front, rear = self.ends
        cuts = [0.5 * (a + b) for a, b in zip(bank.positions, bank.positions[1:], strict=False)]
        return list(zip([front, *cuts], [*cuts, rear], strict=True))


def block_plan(engine: Engine) -> BlockPlan:
    """Plan of an engine's block; ``InputError`` if the engine has no table [block] or [mounts]."""
    block, crank, cylinders = engine.block, engine.crankshaft, engine.cylinders
    if block is None or engine.mounts is None:
        missing = "block" if block is None else "mounts"
        raise InputError(f"engine '{engine.name}' has no table [{missing}]; add it as in engine/data/diesel_i6.toml")
    places = engine.cylinder_positions
    banks = []
    for angle in sorted(set(cylinders.bank_angles)):
        numbers = [k for k, own in enumerate(cylinders.bank_angles) if own == angle]
        numbers.sort(key=lambda k: places[k])
        banks.append(Bank(angle, tuple(k + 1 for k in numbers), tuple(places[k] for k in numbers)))
    thrust, row = engine.thrust, engine.thrust.main - 1
    return BlockPlan(
        block=block,
        mains=crank.main_positions,
        bores=engine.main_bores,
        thrust=(row, max(thrust.outer_diameter, engine.main_bores[row] + 2.0 * RETAINER)),
        banks=tuple(banks),
        cylinder_bore=cylinders.bore,
        stroke=2.0 * crank.throw,
        pin_heights=(engine.rod.length - crank.throw, engine.rod.length + crank.throw),
        mounts=engine.mounts.positions,
    )


def outlines(plan: BlockPlan) -> tuple[list[Point], list[Point]]:
    """Outer and inner outline of the crankcase's cross-section, anticlockwise convex polygons that end at the skirt."""
    b = plan.block
    corners = [(s * b.crankcase_half_width, y) for s in (-1.0, 1.0) for y in (-b.skirt_depth, b.side_height)]
    for bank in plan.banks:
        c, s = cos(bank.angle), sin(bank.angle)
        foot = (-b.bank_half_width, b.bank_half_width)
        corners += [(x * c - b.foot_height * s, x * s + b.foot_height * c) for x in foot]
    outer = hull(corners)
    # The crankcase's skirt is open below, so the lowest edge of the outline is not moved inwards.
    walls = [0.0 if low[1] == high[1] == -b.skirt_depth else b.wall_thickness for low, high in edges(outer)]
    return outer, inset(outer, walls)


def hull(points: Sequence[Point]) -> list[Point]:
    """Convex hull, anticlockwise, without points on its edges (Andrew's monotone chain)."""

    def chain(ordered: Sequence[Point]) -> list[Point]:
        kept: list[Point] = []
        for point in ordered:
            while len(kept) > 1 and _turn(kept[-2], kept[-1], point) <= 1e-12:
                kept.pop()
            kept.append(point)
        return kept[:-1]

    ordered = sorted(set(points))
    return chain(ordered) + chain(ordered[::-1])


def edges(polygon: Sequence[Point]) -> list[tuple[Point, Point]]:
    """Edges of a polygon, each from its point to the next."""
    return list(zip(polygon, [*polygon[1:], polygon[0]], strict=True))


def inset(polygon: Sequence[Point], distances: Sequence[float]) -> list[Point]:
    """Anticlockwise convex polygon with each edge moved inwards by its distance; ``InputError`` if no area remains."""
    lines = []
    for (a, b), distance in zip(edges(polygon), distances, strict=True):
        length = hypot(b[0] - a[0], b[1] - a[1])
        normal = ((a[1] - b[1]) / length, (b[0] - a[0]) / length)
        lines.append((normal, normal[0] * a[0] + normal[1] * a[1] + distance))
    corners = []
    for ((p, q), c), ((r, s), d) in zip([lines[-1], *lines[:-1]], lines, strict=True):
        det = p * s - q * r
        corners.append(((c * s - q * d) / det, (p * d - c * r) / det))
    # An inset edge whose direction has reversed has passed the opposite edge, so no area remains.
    moved = zip(edges(polygon), edges(corners), strict=True)
    if any((b[0] - a[0]) * (d[0] - c[0]) + (b[1] - a[1]) * (d[1] - c[1]) <= 0.0 for (a, b), (c, d) in moved):
        raise InputError("block.wall_thickness: the crankcase's walls leave no room inside; make them thinner")
    return corners


def _turn(a: Point, b: Point, c: Point) -> float:
    """Twice the area of a triangle; positive where it runs anticlockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def cut(polygon: Sequence[Point], y: float, above: bool) -> list[Point]:
    """Part of a convex polygon above or below a height y; an empty list if the polygon has no such part."""
    side = 1.0 if above else -1.0
    kept: list[Point] = []
    for a, b in edges(polygon):
        if side * (a[1] - y) >= 0.0:
            kept.append(a)
        if (a[1] - y) * (b[1] - y) < 0.0:
            kept.append((a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]), y))
    return kept if max((side * (point[1] - y) for point in kept), default=0.0) > 0.0 else []


def block_shape(plan: BlockPlan) -> Any:
    """Build the block as one solid of netgen's CAD kernel, m.

    The kernel may crash, so call it in a child process as :func:`cranktrain.structure.block.mesh.block_mesh` does.
    """
    from netgen import occ

    b = plan.block
    outer, inner = outlines(plan)
    solid = _prism(occ, outer, plan.ends)
    plates = plan.bulkheads
    for before, after in itertools.pairwise(plates):
        solid = solid - _prism(occ, cut(inner, -b.bulkhead_depth, above=True), (before[1], after[0]))
    if below := cut(inner, -b.bulkhead_depth, above=False):
        solid = solid - _prism(occ, below, (plates[0][1], plates[-1][0]))
    half = 0.5 * b.housing_thickness
    for z in plan.mains:
        x, along = b.housing_half_width, (z - half, z + half)
        housing = _box(occ, (-x, x), (-b.cap_depth, b.housing_height), along) * _prism(occ, outer, along)
        for bank in plan.banks:
            # Keep the housings clear of the liners' ends, which the wide housings of a V engine would reach.
            clear = _box(occ, (-1.0, 1.0), (-1.0, b.foot_height - b.wall_thickness - FOOT_GAP), along)
            housing = housing * _banked(occ, clear, bank)
        solid = solid + housing
    for bank in plan.banks:
        solid = _with_bank(occ, solid, plan, bank)
    bores = [_cylinder(occ, 0.5 * d, (z - half, z + half)) for d, z in zip(plan.bores, plan.mains, strict=True)]
    for bore in bores:
        bore.faces.maxh = BORE_MESH_SHARE * b.mesh_size
        solid = solid - bore

    main, outside = plan.thrust
    collar = _cylinder(occ, 0.5 * outside, (plan.mains[main] - half, plan.mains[main] + half))
    solid = solid - collar
    pieces = [collar - bores[main]]
    for bank in plan.banks:
        for z in bank.positions:
            pieces += [_banked(occ, piece, bank, z) for piece in _liner(occ, plan)]
    pieces += _cover(occ, plan)
    for x, y, z in plan.mounts:
        pieces += _pad(occ, plan, x, y, z)
    return occ.Fuse([solid, *pieces])


def _with_bank(occ: Any, solid: Any, plan: BlockPlan, bank: Bank) -> Any:
    """Crankcase with the box of a bank added, cylinder by cylinder, and holes cut for its liners."""
    b = plan.block
    front, rear = plan.ends
    w, low, deck = b.bank_half_width, b.foot_height - b.wall_thickness, b.deck_height
    t = b.wall_thickness
    hollow = _box(occ, (t - w, w - t), (b.foot_height, deck - b.deck_thickness), (front + t, rear - t))
    boxes = [_box(occ, (-w, w), (low, deck), cell) - hollow for cell in plan.cells(bank)]
    box = occ.Fuse(boxes)
    solid = occ.Fuse([solid, _banked(occ, box, bank)])
    for z in bank.positions:
        solid = solid - _banked(occ, _upright(occ, plan.liner_radius, (low, deck)), bank, z)
    return solid


def _liner(occ: Any, plan: BlockPlan) -> list[Any]:
    """Liner at z = 0 with its axis along y, divided into rings."""
    b = plan.block
    (low, high), (bottom, top) = plan.bands()
    cuts = [b.foot_height - b.wall_thickness, low, high, bottom, top, b.deck_height]
    inside = _upright(occ, 0.5 * plan.cylinder_bore, (cuts[0], cuts[-1]))
    inside.faces.maxh = LINER_MESH_SHARE * b.mesh_size
    spans = [span for span in itertools.pairwise(cuts) if span[1] > span[0] + 1e-9]
    return [_upright(occ, plan.liner_radius, span) - inside for span in spans]


def _cover(occ: Any, plan: BlockPlan) -> list[Any]:
    """Bottom cover and the separate patch in its middle."""
    b = plan.block
    y = (-b.skirt_depth - b.cover_thickness, -b.skirt_depth)
    middle = 0.5 * sum(plan.ends)
    patch = _box(occ, (-0.5 * PATCH, 0.5 * PATCH), y, (middle - 0.5 * PATCH, middle + 0.5 * PATCH))
    plate = _box(occ, (-b.crankcase_half_width, b.crankcase_half_width), y, plan.ends)
    plate.faces.maxh = COVER_MESH_SHARE * b.mesh_size
    return [plate - patch, patch]


def _pad(occ: Any, plan: BlockPlan, x: float, y: float, z: float) -> list[Any]:
    """Pad whose lower face rests on a mount, and its arm to the wall."""
    b = plan.block
    half, side = 0.5 * b.pad_size, 1.0 if x > 0.0 else -1.0
    height, along = (y, y + b.pad_size), (z - half, z + half)
    wall, near, far = side * b.crankcase_half_width, x - side * half, x + side * half
    pad = _box(occ, (near, far), height, along)
    return [pad, _box(occ, (wall, near), height, along)] if abs(near - wall) > 1e-9 else [pad]


def _prism(occ: Any, polygon: Sequence[Point], span: Span) -> Any:
    """Prism of a polygon across the axis."""
    points = [occ.Pnt(x, y, span[0]) for x, y in polygon]
    sides = [occ.Segment(a, b) for a, b in zip(points, points[1:] + points[:1], strict=True)]
    return occ.Face(occ.Wire(sides)).Extrude((span[1] - span[0]) * occ.Z)


def _box(occ: Any, x: Span, y: Span, z: Span) -> Any:
    """Box between the ends of three spans."""
    corners = list(zip(*(sorted(span) for span in (x, y, z)), strict=True))
    return occ.Box(occ.Pnt(*corners[0]), occ.Pnt(*corners[1]))


def _cylinder(occ: Any, radius: float, span: Span) -> Any:
    """Cylinder about the crank axis."""
    return occ.Cylinder(occ.Pnt(0.0, 0.0, span[0]), occ.gp_Dir(0, 0, 1), r=radius, h=span[1] - span[0])


def _upright(occ: Any, radius: float, span: Span) -> Any:
    """Cylinder about the y axis."""
    return occ.Cylinder(occ.Pnt(0.0, span[0], 0.0), occ.gp_Dir(0, 1, 0), r=radius, h=span[1] - span[0])


def _banked(occ: Any, shape: Any, bank: Bank, z: float = 0.0) -> Any:
    """Shape made along +y at z = 0, rotated into its bank and moved to position z."""
    return shape.Rotate(occ.Axis(occ.Pnt(0, 0, 0), occ.Z), bank.angle * 180.0 / pi).Move(z * occ.Z)
