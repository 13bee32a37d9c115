"""Cylinders and planes in a solid's surface, recognised from points on its faces.

A face is a cylinder if all its points have equal distance from a line, which is fitted by Gauss–Newton with the axis of
rotation of the face's normals as initial guess. Splines and extruded faces are therefore recognised like cylinders of
the CAD program. Points lie on the surface to the accuracy of the CAD kernel, and so do radii and positions.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.types import Array
from cranktrain_lab.cad.step_file import StepSolid

FLAT = 1e-7
"""Largest squared fraction of a plane's normals perpendicular to its mean normal."""
ROUND = 5e-4
"""Largest relative deviation of a cylinder's points from its radius."""
LEAST_TURN = 0.02
"""Least squared fraction of a cylinder's normals in their second direction, for an arc of about 30 degrees."""
ITERATIONS = 8


class Faces(NamedTuple):
    """Kind and geometry of each of the f faces of a solid.

    Attributes
    ----------
    area : (f,) mm²
    plane : (f,) True for planes
    round : (f,) True for cylinders with material inside
    normal : (f, 3) outward normal of a plane, or direction of a cylinder
    centre : (f, 3) mm, a point of the plane, or of the cylinder's axis
    radius : (f,) mm, 0 for a plane
    corners : points (k, 3) mm of each face
    """

    area: Array
    plane: NDArray[np.bool_]
    round: NDArray[np.bool_]
    normal: Array
    centre: Array
    radius: Array
    corners: tuple[Array, ...]


def classified(solid: StepSolid) -> Faces:
    """Classify the faces of a solid."""
    corners = solid.nodes[solid.triangles]
    across = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(across, axis=1)
    normals = across / np.maximum(areas, 1e-300)[:, None]
    count = int(solid.faces.max()) + 1
    found = Faces(
        np.zeros(count), np.zeros(count, dtype=bool), np.zeros(count, dtype=bool), np.zeros((count, 3)),
        np.zeros((count, 3)), np.zeros(count),
        tuple(solid.nodes[np.unique(solid.triangles[solid.faces == k])] for k in range(count)),
    )  # fmt: skip
    for k in range(count):
        own = solid.faces == k
        if not own.any():
            continue
        a, n, points = areas[own], normals[own], found.corners[k]
        found.area[k], found.centre[k] = a.sum(), points.mean(axis=0)
        turn, directions = np.linalg.eigh((a[:, None] * n).T @ n / a.sum())
        if turn[1] < FLAT:
            found.plane[k] = True
            found.normal[k] = (a[:, None] * n).sum(axis=0) / a.sum()
        elif turn[0] < 0.1 * turn[1] and turn[1] > LEAST_TURN and len(points) >= 6:
            fitted = _cylinder(points, directions[:, 0])
            if fitted is not None:
                found.centre[k], found.normal[k], found.radius[k] = fitted
                middles = corners[own].mean(axis=1) - fitted[0]
                outwards = middles - (middles @ fitted[1])[:, None] * fitted[1]
                found.round[k] = float(np.sum(a * np.sum(outwards * n, axis=1))) > 0.0
    return found


def _cylinder(points: Array, direction: Array) -> tuple[Array, Array, float] | None:
    """Return point on the axis, direction and radius of the cylinder through points (k, 3), or None."""
    middle = points.mean(axis=0)
    centre, d = middle.copy(), direction / np.linalg.norm(direction)
    u, v = across(d)
    a, b = (points - middle) @ u, (points - middle) @ v
    solved = np.linalg.lstsq(np.column_stack((2.0 * a, 2.0 * b, np.ones_like(a))), a**2 + b**2, rcond=None)[0]
    centre = middle + solved[0] * u + solved[1] * v
    radius = float(np.sqrt(max(solved[2] + solved[0] ** 2 + solved[1] ** 2, 0.0)))
    size = float(np.ptp(points, axis=0).max())
    if not 0.0 < radius < 100.0 * size:
        return None
    for _ in range(ITERATIONS):
        u, v = across(d)
        from_centre = points - centre
        a, b, s = from_centre @ u, from_centre @ v, from_centre @ d
        distance = np.hypot(a, b)
        if (distance < 1e-9 * size).any():
            return None
        ca, cb = a / distance, b / distance
        rows = np.column_stack((-ca, -cb, -ca * s / size, -cb * s / size, -np.ones_like(s)))
        step, *_ = np.linalg.lstsq(rows, radius - distance, rcond=1e-9)
        centre = centre + step[0] * u + step[1] * v
        d = d + step[2] / size * u + step[3] / size * v
        d = d / np.linalg.norm(d)
        radius += float(step[4])
    from_centre = points - centre
    distance = np.linalg.norm(from_centre - (from_centre @ d)[:, None] * d, axis=1)
    if radius <= 0.0 or np.abs(distance - radius).max() > ROUND * radius:
        return None
    return centre, d, radius


def across(direction: Array) -> tuple[Array, Array]:
    """Return two unit vectors that form a right-handed system with a direction, (u, v, d)."""
    least = np.eye(3)[int(np.argmin(np.abs(direction)))]
    u = np.cross(least, direction)
    u = u / np.linalg.norm(u)
    return u, np.cross(direction, u)
