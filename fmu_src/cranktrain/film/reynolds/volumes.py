"""Control volumes around the nodes of a rectangle, and the faces between them.

A node's volume extends half way to its neighbours; volumes at edges are halves and quarters. A film may be given at
nodes: a face lies half way between nodes and has the mean film (second order). A film with steps is constant in each
cell between nodes: a face crosses two cells, and h³ and h are summed over its halves, so steps on node lines are exact.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.types import Array


class Rectangle(NamedTuple):
    """Nodes, spacings and areas of a rectangle; lengths in m."""

    x: Array
    z: Array
    step_x: Array
    """Spacing to the next node, (n_x,); the last leads back to the first node if periodic, and is 0 otherwise."""
    step_z: Array
    """Spacing to the next node, (n_z,); the last is 0."""
    width_x: Array
    """Width of each node's volume in x, (n_x,)."""
    width_z: Array
    areas: Array
    """Area of each node's volume, (n_x, n_z), m²."""
    periodic: bool


def rectangle(x: Array, z: Array, lengths: tuple[float, float], periodic: bool) -> Rectangle:
    """Make the rectangle of increasing nodes ``x`` (n_x,), ``z`` (n_z,); a single z node covers the whole length."""
    step_x = np.append(np.diff(x), lengths[0] - x[-1] + x[0] if periodic else 0.0)
    step_z = np.append(np.diff(z), 0.0)
    width_x = 0.5 * (step_x + np.roll(step_x, 1))
    width_z = 0.5 * (step_z + np.roll(step_z, 1)) if len(z) > 1 else np.array([lengths[1]])
    return Rectangle(x, z, step_x, step_z, width_x, width_z, width_x[:, None] * width_z, periodic)


class Faces(NamedTuple):
    """Integrals over faces between neighbours, (n_x, n_z) each; face (i, j) leads to the next node as in ``Rectangle``.

    Entries without a face are zero.
    """

    cube_x: Array
    """Integral ∫h³ dz over the face, m⁴."""
    cube_z: Array
    film_x: Array
    """Integral ∫h dz over the face, m²."""
    film_z: Array


def node_faces(h: Array, grid: Rectangle) -> Faces:
    """Return the faces of a film given at nodes, (n_x, n_z)."""
    mean_x = 0.5 * (h + np.roll(h, -1, axis=0)) * (grid.step_x > 0.0)[:, None]
    mean_z = 0.5 * (h + np.roll(h, -1, axis=1)) * (grid.step_z > 0.0)
    across_x, across_z = grid.width_z, grid.width_x[:, None]
    return Faces(mean_x**3 * across_x, mean_z**3 * across_z, mean_x * across_x, mean_z * across_z)


def cell_sums(values: Array, grid: Rectangle) -> tuple[Array, Array, Array]:
    """Integrate a quantity constant in each cell over faces along x, faces along z, and volumes of nodes.

    ``values`` is (cells in x, cells in z): n_x if periodic, else n_x − 1; n_z − 1, or 1 for a single node in z.
    """
    n_x, n_z = len(grid.x), len(grid.z)
    half_x, half_z = 0.5 * grid.step_x, 0.5 * grid.step_z if n_z > 1 else grid.width_z
    padded = np.zeros((n_x, n_z))
    padded[: values.shape[0], : values.shape[1]] = values
    in_x, in_z = padded * half_z, padded * half_x[:, None]
    in_both = in_x * half_x[:, None]
    along_x = in_x.copy()
    volumes = in_both + np.roll(in_both, 1, axis=0)
    if n_z > 1:
        along_x += np.roll(in_x, 1, axis=1)
        volumes = volumes + np.roll(volumes, 1, axis=1)
    along_z = (in_z + np.roll(in_z, 1, axis=0)) * (grid.step_z > 0.0)
    return along_x, along_z, volumes


def cell_faces(h: Array, grid: Rectangle) -> Faces:
    """Return the faces of a film that is constant in each cell; shape as in :func:`cell_sums`."""
    cube_x, cube_z, _ = cell_sums(h**3, grid)
    film_x, film_z, _ = cell_sums(h, grid)
    return Faces(cube_x, cube_z, film_x, film_z)


def band_order(free: NDArray[np.bool_], periodic: bool) -> tuple[NDArray[np.int64], int]:
    """Return the band-matrix row of each free node (−1 for others), (n_x, n_z), and the bandwidth of neighbours.

    Numbering runs fastest along the shorter direction. A ring along the other direction is folded (first, last, ...).
    """
    n_x, n_z = free.shape
    rows = np.arange(n_x)
    if periodic and n_x >= n_z:
        folded = np.empty(n_x, dtype=np.int64)
        folded[0::2] = rows[: (n_x + 1) // 2]
        folded[1::2] = rows[::-1][: n_x // 2]
        rows = folded
    order = np.full((n_x, n_z), -1, dtype=np.int64)
    sorted_free = free[rows]
    if n_z <= n_x:
        places = np.cumsum(sorted_free.ravel()).reshape(sorted_free.shape) - 1
    else:
        places = (np.cumsum(sorted_free.T.ravel()).reshape(sorted_free.T.shape) - 1).T
    order[rows] = np.where(sorted_free, places, -1)
    width = 0
    pairs = [(order[:-1], order[1:]), (order[:, :-1], order[:, 1:])]
    if periodic:
        pairs.append((order[-1], order[0]))
    for one, other in pairs:
        both = (one >= 0) & (other >= 0)
        if both.any():
            width = max(width, int(np.abs(one - other)[both].max()))
    return order, width
