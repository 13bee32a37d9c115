"""Outputs of a solved film: flows through edges and grooves, largest pressure, shear on both surfaces."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cranktrain.film.reynolds.volumes import Array, Faces, Rectangle


def outflows(
    surplus: Array,
    owner: NDArray[np.int64],
    names: Sequence[str],
    grid: Rectangle,
    film: Array,
    cross_speeds: tuple[float, float],
) -> tuple[dict[str, float], float]:
    """Return the outflow at each edge and supply, from the balance of its nodes, and the oil created elsewhere."""
    flows = {name: float(-surplus[owner == k].sum()) for k, name in enumerate(names)}
    # A corner node belongs to the edge in x, but flow carried along z leaves through the edge in z.
    for x_edge, i in (("x0", 0), ("x1", -1)):
        for z_edge, j, sign in (("z0", 0, -1.0), ("z1", -1, 1.0)):
            if x_edge in flows and z_edge in flows and owner[i, j] == names.index(x_edge):
                part = sign * 0.5 * sum(cross_speeds) * film[i, j] * grid.width_x[i]
                flows[z_edge] += part
                flows[x_edge] -= part
    return flows, float(surplus[owner < 0].sum())


def largest_pressure(
    pressure: Array, inner: NDArray[np.bool_], grid: Rectangle, length: float
) -> tuple[float, tuple[float, float]]:
    """Return the maximum of the pressure and its position, by a parabola in each direction."""
    i, j = (int(k) for k in np.unravel_index(int(pressure.argmax()), pressure.shape))
    peak, place = float(pressure[i, j]), [float(grid.x[i]), float(grid.z[j])]
    n_x, n_z = pressure.shape
    if inner[i, j]:
        if grid.periodic or 0 < i < n_x - 1:
            line = pressure[[i - 1, i, (i + 1) % n_x], j]
            rise, shift = _vertex(line, grid.step_x[i - 1], grid.step_x[i])
            peak, place[0] = peak + rise, (place[0] + shift) % length if grid.periodic else place[0] + shift
        if 0 < j < n_z - 1:
            rise, shift = _vertex(pressure[i, j - 1 : j + 2], grid.step_z[j - 1], grid.step_z[j])
            peak, place[1] = peak + rise, place[1] + shift
    return peak, (place[0], place[1])


def _vertex(values: Array, before: float, after: float) -> tuple[float, float]:
    """Return height and shift of a parabola's vertex relative to the middle of three points, which is the largest."""
    left, right = (values[1] - values[0]) / before, (values[2] - values[1]) / after
    slope = (left * after + right * before) / (before + after)
    curvature = 2.0 * (right - left) / (before + after)
    if not curvature < 0.0:
        return 0.0, 0.0
    shift = float(np.clip(-slope / curvature, -before, after))
    return float(slope * shift + 0.5 * curvature * shift * shift), shift


def shear_forces(
    pressure: Array, couette: float, faces: Faces, speeds: tuple[float, float], cross_speeds: tuple[float, float]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return shear forces (x, z) on both surfaces, N; ``couette`` is ∫ηθ/h dA, N s/m."""
    # ∫ h/2 ∂p along an axis is half the sum over faces of film times pressure difference.
    along_x = 0.5 * float((faces.film_x * (np.roll(pressure, -1, axis=0) - pressure)).sum())
    along_z = 0.5 * float((faces.film_z * (np.roll(pressure, -1, axis=1) - pressure)).sum())
    slip_x, slip_z = speeds[1] - speeds[0], cross_speeds[1] - cross_speeds[0]
    return (
        (couette * slip_x - along_x, couette * slip_z - along_z),
        (-couette * slip_x - along_x, -couette * slip_z - along_z),
    )
