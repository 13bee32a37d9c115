"""Outer surface of a body for pictures: triangles oriented outwards, points duplicated along sharp edges."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import breadth_first_order, connected_components

from cranktrain.core.types import Array

SHARP = math.radians(35.0)
"""Least angle between two triangles at which their common edge is sharp, rad."""


class Skin(NamedTuple):
    """Body surface and its motion: ``points`` (p, 3) m, ``triangles`` (t, 3), ``modes`` (m, p, 3), ``origin`` (p,).

    ``origin`` is the index of each point's original point, because points along sharp edges occur several times.
    """

    points: Array
    triangles: NDArray[np.int32]
    modes: NDArray[np.float32]
    origin: NDArray[np.int32]

    @classmethod
    def of(cls, points: Array, triangles: NDArray[np.int32], modes: NDArray[np.float32]) -> "Skin":
        """Make the skin of a closed surface whose triangles have any orientation."""
        facing = outward(points, triangles)
        origin, split = creased(points, facing)
        return cls(points[origin], split, modes[:, origin], origin)


def outward(points: Array, triangles: NDArray[np.int32]) -> NDArray[np.int32]:
    """Triangles (t, 3) of closed surfaces, reoriented so that corners are counter-clockwise from outside."""
    pairs, corners = _neighbours(triangles)
    # Two neighbouring triangles have the same orientation if their common edge has opposite directions in them.
    agree = corners[:, 0, 0] == corners[:, 1, 1]
    count = len(triangles)
    sign = np.where(agree, 1.0, -1.0)
    graph = sparse.coo_matrix((sign, (pairs[:, 0], pairs[:, 1])), shape=(count, count)).tocsr()
    graph = graph + graph.T
    parts, part = connected_components(graph, directed=False)
    side = np.ones(count)
    for k in range(parts):
        order, before = breadth_first_order(graph, int(np.flatnonzero(part == k)[0]), directed=False)
        steps = np.asarray(graph[order[1:], before[order[1:]]]).ravel()
        for triangle, previous, step in zip(order[1:], before[order[1:]], steps, strict=True):
            side[triangle] = step * side[previous]
    a, b, c = points[triangles].transpose(1, 0, 2)
    volume = np.bincount(part, side * np.einsum("ti,ti->t", a, np.cross(b, c)))
    turned = side * volume[part] < 0.0
    return np.where(turned[:, None], triangles[:, ::-1], triangles)


def creased(points: Array, triangles: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Duplicate points at edges sharper than SHARP; returns the origin (p,) of each point and triangles (t, 3)."""
    pairs, corners = _neighbours(triangles)
    a, b, c = points[triangles].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    flat = np.einsum("ei,ei->e", normal[pairs[:, 0]], normal[pairs[:, 1]]) > math.cos(SHARP)
    joined = []
    for end in (0, 1):
        vertex = corners[flat, 0, end]
        place = [(triangles[pairs[flat, side]] == vertex[:, None]).argmax(axis=1) for side in (0, 1)]
        joined.append(np.column_stack([3 * pairs[flat, side] + place[side] for side in (0, 1)]))
    one, other = np.concatenate(joined).T
    graph = sparse.coo_matrix((np.ones(len(one)), (one, other)), shape=(triangles.size, triangles.size))
    parts, part = connected_components(graph, directed=False)
    origin = np.empty(parts, dtype=np.int32)
    origin[part] = triangles.ravel()
    return origin, part.reshape(triangles.shape).astype(np.int32)


def _neighbours(triangles: NDArray[np.int32]) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
    """Two triangles of each of e edges, (e, 2), and the edge's end points in each triangle's direction, (e, 2, 2)."""
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    keys = np.sort(edges, axis=1)
    order = np.lexsort(keys.T)
    same = np.flatnonzero((keys[order[1:]] == keys[order[:-1]]).all(axis=1))
    both = np.column_stack((order[same], order[same + 1]))
    return both // 3, edges[both]
