"""Outlines of webs of a crank found in a solid, as radii and widths of an engine file.

In the plane of a web η points towards its pin and ξ across. The values are exact for a web with the shape of engine
files (hull of two circles, with a part of a disc as counterweight). For other webs they describe the outline with equal
reach towards the pin, equal width at the main axis, and equal reach and width opposite to the pin.
"""

import itertools
from typing import NamedTuple

import numpy as np

from cranktrain.core.types import Array, Integers
from cranktrain_lab.cad.recognition import SAME_AXIS, Journal, RecognisedCrank

UPRIGHT = 1e-4
"""Largest z component of the normals of a face parallel to the axis."""
SHORT_ARC, EXACT = np.radians(40.0), 1e-5
"""Largest angle of an arc whose radius follows from nodes at equal distance from the axis, and the largest relative
deviation of these distances."""
WEIGHT = 1.02
"""Ratio of a web's radius opposite to the pin to its radius about the main axis above which it has a counterweight."""


class WebShape(NamedTuple):
    """Shape of a web: thickness, radii about main and pin axis, and the counterweight's radius and half width, mm.

    ``main_radius`` and the following values are 0 for a flying web; ``weight_radius`` is 0 without a counterweight.
    """

    thickness: float
    main_radius: float
    pin_radius: float
    weight_radius: float
    weight_half_width: float


def web_shapes(found: RecognisedCrank) -> tuple[WebShape, ...]:
    """Return the shapes of all webs, including flying webs, from the pulley to the flywheel."""
    ordered = sorted([*found.mains, *found.pins], key=lambda journal: journal.cylinder.middle)
    mains = set(found.mains)
    return tuple(_web(found, a, b, a in mains or b in mains) for a, b in itertools.pairwise(ordered))


def _web(found: RecognisedCrank, before: Journal, after: Journal, beside_main: bool) -> WebShape:
    thickness = max(after.start - before.end, 0.0)
    pin = after if np.hypot(*after.cylinder.axis) > np.hypot(*before.cylinder.axis) else before
    throw = float(np.hypot(*pin.cylinder.axis))
    if thickness < 1e-3 * pin.cylinder.radius:
        return WebShape(thickness, 0.0, 0.0, 0.0, 0.0)
    eta = np.array(pin.cylinder.axis) / throw
    points, edges, numbers = _outline(found, 0.5 * (before.end + after.start))
    turn = np.column_stack(([eta[1], -eta[0]], eta))  # (x, y) -> (ξ, η)
    points, edges = points @ turn, edges @ turn
    arcs = _arcs(found, numbers, pin.cylinder.axis)
    short = _short_arcs(found, numbers)
    pin_radius = max([float(points[:, 1].max()) - throw, *arcs])
    if not beside_main:
        return WebShape(thickness, 0.0, pin_radius, 0.0, 0.0)
    reach = np.hypot(points[:, 0], points[:, 1])
    width = _width(edges, 1e-3 * pin.cylinder.radius)
    upper = reach[points[:, 1] > -1e-6 * throw]
    near = float(upper.min()) if upper.size else width
    # Corners do not show a straight side. The nearest point to the main axis lies on the arc about it.
    main_radius = near if near < 1.01 * width else width
    lower = points[:, 1] < 1e-6 * throw
    weight = float(reach[lower].max()) if lower.any() else 0.0
    arcs = [*_arcs(found, numbers, (0.0, 0.0)), *short]
    arcs = [radius for radius in arcs if abs(radius - weight) > 1e-3 * radius]
    main_radius = min([radius for radius in arcs if radius > 0.9 * width], default=main_radius)
    if weight < WEIGHT * main_radius:
        return WebShape(thickness, main_radius, pin_radius, 0.0, 0.0)
    rim = lower & (reach > (1.0 - 1e-4) * weight)
    return WebShape(thickness, main_radius, pin_radius, weight, float(np.abs(points[rim, 0]).max()))


def _arcs(found: RecognisedCrank, numbers: Integers, axis: tuple[float, float]) -> list[float]:
    """Return radii of the cylindrical faces about an axis along z, mm."""
    faces = found.faces
    own = [int(k) for k in numbers if faces.round[k] and abs(faces.normal[k, 2]) > 1.0 - UPRIGHT]
    return [
        float(faces.radius[k]) for k in own if np.hypot(*(faces.centre[k, :2] - axis)) < SAME_AXIS * faces.radius[k]
    ]


def _short_arcs(found: RecognisedCrank, numbers: Integers) -> list[float]:
    """Return radii of faces parallel to the axis, with few triangles, that are arcs about the main axis, mm.

    A web whose radii about main and pin axis differ little shows some degrees of the arc about the main axis. Its face
    has one or two triangles per side, too few to fit a cylinder, but its nodes are exact.
    """
    faces, radii = found.faces, []
    for k in numbers.tolist():
        if faces.round[k] or faces.plane[k]:
            continue
        # Nodes of the triangles lie on the face, but points on their sides do not.
        nodes = found.solid.nodes[found.solid.triangles[found.solid.faces == k], :2].reshape(-1, 2)
        reach, angle = np.hypot(*nodes.T), np.arctan2(nodes[:, 1], nodes[:, 0])
        wide = float(np.ptp(np.angle(np.exp(1j * (angle - angle[0])))))
        if np.ptp(reach) < EXACT * reach.max() and 1e-3 < wide < SHORT_ARC:
            radii.append(float(reach.mean()))
    return radii


def _width(edges: Array, eta: float) -> float:
    """Return the largest |ξ| at which edges (k, 2, 2) of an outline cross a line of constant η."""
    a, b = edges[:, 0], edges[:, 1]
    crossing = (a[:, 1] - eta) * (b[:, 1] - eta) < 0.0
    a, b = a[crossing], b[crossing]
    share = (eta - a[:, 1]) / (b[:, 1] - a[:, 1])
    return float(np.abs(a[:, 0] + share * (b[:, 0] - a[:, 0])).max(initial=0.0))


def _outline(found: RecognisedCrank, z: float) -> tuple[Array, Array, Integers]:
    """Return points (p, 2) on the outline of the section at z, its edges (k, 2, 2), mm, and its face numbers.

    Points are corners of faces parallel to the axis, which lie exactly on the outline, and intersections of edges of
    other faces with the plane.
    """
    corners = found.solid.nodes[found.solid.triangles]
    low, high = corners[:, :, 2].min(axis=1), corners[:, :, 2].max(axis=1)
    # Faces of bores do not belong to the outline of a web.
    bored = (found.faces.radius > 0.0) & ~found.faces.round
    cut = (low < z) & (high > z) & ~bored[found.solid.faces]
    edges = np.array([_crossing(triangle, z) for triangle in corners[cut]]).reshape(-1, 2, 2)
    numbers = found.solid.faces[cut]
    along = np.abs(found.faces.normal[:, 2])
    upright = np.where(found.faces.plane, along < UPRIGHT, (found.faces.radius > 0.0) & (along > 1.0 - UPRIGHT))
    points = []
    for face in np.unique(numbers):
        own = found.faces.corners[face][:, :2] if upright[face] else edges[numbers == face].reshape(-1, 2)
        points.append(own)
    return np.concatenate(points), edges, np.unique(numbers)


def _crossing(triangle: Array, z: float) -> Array:
    """Return the two points (2, 2) at which the sides of a triangle (3, 3) cross a plane of constant z."""
    above = triangle[:, 2] > z
    lone = int(np.flatnonzero(above)[0] if above.sum() == 1 else np.flatnonzero(~above)[0])
    a = triangle[lone]
    ends = triangle[[(lone + 1) % 3, (lone + 2) % 3]]
    share = ((z - a[2]) / (ends[:, 2] - a[2]))[:, None]
    return np.asarray(a[:2] + share * (ends[:, :2] - a[:2]))
