"""Panels of a block's outer surface, from the plan of the block or from the named surfaces of the user's own mesh.

The boundary of a block's mesh also contains its inner walls, which bores and liners join to the outer ones. So the
running surfaces of bores and liners are cut out; of the pieces that remain, the one with the largest extent is the
outer surface. Water jackets are pieces of their own. Left and right are seen from the flywheel: right along +x.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from skfem import MeshTet2

from cranktrain.core.types import Array
from cranktrain.structure.block.mesh import interface_places
from cranktrain.structure.block.shape import BlockPlan

FACING = 0.7
"""Least component of a facet's normal along a direction at which the facet faces this direction, about cos 45°."""
ROUND = 0.02
"""Relative tolerance of the radius of a bore's or liner's running surface."""
MOUNTS = "mounts"
"""Panel of the pads and arms of the mounts."""

Integers = NDArray[np.intp]
_A, _B = 0.445948490915965, 0.091576213509771
POINTS = np.array([[_A, _A], [1 - 2 * _A, _A], [_A, 1 - 2 * _A], [_B, _B], [1 - 2 * _B, _B], [_B, 1 - 2 * _B]])
"""Points (6, 2) of a quadrature of degree 4 on the reference triangle: exact for squares of quadratic fields."""
WEIGHTS = 0.5 * np.repeat([0.223381589678011, 0.109951743655322], 3)
"""Weights (6,) of the quadrature (Strang and Fix 1973)."""


class Facets(NamedTuple):
    """Quadratic facets of a surface.

    ``points`` are (p, 3) m, ``nodes`` (f, 6) three corners, counter-clockwise from outside, then the middles of the
    edges from the first to the second, the second to the third, the third to the first corner.
    """

    points: Array
    nodes: Integers

    @property
    def area_vectors(self) -> Array:
        """Outward normal times area at each quadrature point, with its weight, (f, 6 points, 3) m²."""
        slopes = facet_shapes()[1]
        edges = np.einsum("qnd,fnx->dfqx", slopes, self.points[self.nodes])
        return np.asarray(np.cross(edges[0], edges[1]) * WEIGHTS[None, :, None])


def facet_shapes() -> tuple[Array, Array]:
    """Quadratic shape functions (6 points, 6 nodes) and their slopes (6, 6, 2) at the quadrature points."""
    r, s = POINTS.T
    t = 1.0 - r - s
    values = np.stack([t * (2 * t - 1), r * (2 * r - 1), s * (2 * s - 1), 4 * t * r, 4 * r * s, 4 * s * t], axis=1)
    zero = 0.0 * r
    by_r = np.stack([1 - 4 * t, 4 * r - 1, zero, 4 * (t - r), 4 * s, -4 * s], axis=1)
    by_s = np.stack([1 - 4 * t, zero, 4 * s - 1, -4 * r, 4 * r, 4 * (t - s)], axis=1)
    return values, np.stack((by_r, by_s), axis=2)


def six_node_facets(triangles: Integers) -> Integers:
    """Facets (f, 6) from the triangles (4 f, 3) of :func:`cranktrain.structure.fem.reduction.surface_triangles`."""
    first, second, third, _ = np.split(np.asarray(triangles, dtype=np.intp), 4)
    return np.column_stack((first[:, 0], second[:, 1], third[:, 2], first[:, 1], second[:, 2], third[:, 0]))


def block_panels(plan: BlockPlan, mesh: MeshTet2, surface: Facets) -> tuple[tuple[str, ...], Integers]:
    """Names of the panels, and the panel (f,) of each facet of the mesh's boundary; −1 for facets of no panel.

    Surfaces of an own mesh that are no interfaces are the panels, if there are any.

    Parameters
    ----------
    surface : all facets of the boundary, in the order of ``mesh.boundary_facets()``
    """
    skin = mesh.boundary_facets()
    interfaces = interface_places(plan)
    named = {name: np.isin(skin, own) for name, own in (mesh.boundaries or {}).items()}
    own_names = [name for name, own in named.items() if name not in interfaces and own.any()]
    labels = np.full(len(skin), "", dtype=object)
    if own_names:
        for name in own_names:
            labels[named[name]] = name
    else:
        held = [own for name, own in named.items() if name.startswith(("bore", "liner"))]
        outer = _outer(surface, _running(plan, surface) | np.logical_or.reduce(held))
        feet = [own for name, own in named.items() if name.startswith("mount")]
        labels = np.where(outer & ~np.logical_or.reduce(feet), _by_place(plan, surface), "")
    names = tuple(sorted(set(labels) - {""}))
    return names, np.array([names.index(one) if one else -1 for one in labels], dtype=np.intp)


def _running(plan: BlockPlan, surface: Facets) -> NDArray[np.bool_]:
    """True (f,) for facets on the running surface of a cylinder or main bore, by the positions of their corners."""
    x, y, z = surface.points[surface.nodes[:, :3]].transpose(2, 0, 1)
    low = plan.block.foot_height - plan.block.wall_thickness

    def on(radius: Array, value: float) -> NDArray[np.bool_]:
        return np.asarray((np.abs(radius / value - 1.0) < ROUND).all(axis=1))

    found = np.zeros(len(surface.nodes), dtype=bool)
    half = 0.5 * plan.block.housing_thickness
    for diameter, place in zip(plan.bores, plan.mains, strict=True):
        found |= on(np.hypot(x, y), 0.5 * diameter) & (np.abs(z - place) < 1.01 * half).all(axis=1)
    for bank in plan.banks:
        c, s = np.cos(bank.angle), np.sin(bank.angle)
        above = (y * c - x * s > 0.9 * low).all(axis=1)
        for place in bank.positions:
            found |= above & on(np.hypot(x * c + y * s, z - place), 0.5 * plan.cylinder_bore)
    return found


def _outer(surface: Facets, cut: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """True (f,) for facets of the piece with the largest extent, after facets were cut out; joined at their edges."""
    kept = np.flatnonzero(~cut)
    middles = surface.nodes[kept, 3:]
    rows, columns = np.repeat(np.arange(kept.size), 3), middles.ravel()
    to_edges = sparse.coo_matrix((np.ones(rows.size), (rows, columns)), shape=(kept.size, len(surface.points))).tocsr()
    _, piece = connected_components(to_edges @ to_edges.T, directed=False)
    centre = surface.points[surface.nodes[kept, :3]].mean(axis=1)
    sizes = [float(np.linalg.norm(np.ptp(centre[piece == k], axis=0))) for k in range(piece.max() + 1)]
    outer = np.zeros(len(surface.nodes), dtype=bool)
    outer[kept[piece == int(np.argmax(sizes))]] = True
    return outer


def _by_place(plan: BlockPlan, surface: Facets) -> NDArray[np.object_]:
    """Panel of each facet by its middle and normal: front, rear, cover, deck, banks, valley, skirts, mounts."""
    b = plan.block
    centre = surface.points[surface.nodes[:, :3]].mean(axis=1)
    normal = surface.area_vectors.sum(axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    side = np.where(np.where(np.abs(normal[:, 0]) > 0.2, normal[:, 0], centre[:, 0]) > 0.0, "right", "left")
    found = np.char.add("skirt ", side).astype(object)
    vee = len(plan.banks) > 1
    if vee:
        found[normal[:, 1] > FACING] = "valley"
    for bank in plan.banks:
        along = np.array([-np.sin(bank.angle), np.cos(bank.angle), 0.0])
        where = "" if not vee else " right" if along[0] > 0.0 else " left"
        height, across = centre @ along, np.abs(centre @ np.cross([0.0, 0.0, 1.0], along))
        own = (height > b.foot_height) & (across < 1.01 * b.bank_half_width)
        if vee:
            inner = normal[:, 0] * along[0] < 0.0
            found[own] = np.where(inner, "valley", "bank" + where)[own]
        else:
            found[own] = np.char.add("bank ", side[own])
        found[own & (normal @ along > FACING) & (height > 0.95 * b.deck_height)] = "deck" + where
    found[(normal[:, 1] < -FACING) & (centre[:, 1] < -b.skirt_depth)] = "cover"
    ends = np.abs(normal[:, 2]) > FACING
    front, rear = plan.ends
    found[ends & (centre[:, 2] < front + 0.5 * b.wall_thickness)] = "front"
    found[ends & (centre[:, 2] > rear - 0.5 * b.wall_thickness)] = "rear"
    beyond = np.abs(centre[:, 0]) > 1.001 * b.crankcase_half_width
    for x, y, z in plan.mounts:
        near = (np.abs(centre - [x, y + 0.5 * b.pad_size, z]) < 0.51 * b.pad_size)[:, 1:].all(axis=1)
        found[near & beyond & (centre[:, 0] * x > 0.0) & (np.abs(centre[:, 0]) < abs(x) + 0.51 * b.pad_size)] = MOUNTS
    return found
