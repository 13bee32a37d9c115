"""Splines of the film table: their axes, their fit and their evaluation with exact derivatives.

Axes: x = −ln(1 − 0.97 ε) + 0.6 ln(1 + ε/0.1) and y = γ − 0.4 sin γ − 0.15 sin 2γ, uniform, y periodic (nodes gather
where a thin film passes from squeeze to wedge, about γ = ±95°, and where the surfaces part); the tilt as shares

    A = a/(√(ρ² − b²) − ε),  B = b/√(ρ² − ε²)

of what is possible before an end lies at ρ(ε) (:mod:`cranktrain.film.table.reach`), both stretched by artanh. The
box |A|, |B| ≤ tilt range fills the lens of possible tilts without a kink. Two mirrors, z → −z and about the line of
centres, leave a quarter of it to store; the splines are those of the whole.

Cubic in x and y (C²), quadratic in A and B (C¹). Coefficients of all functions lie side by side, so that each axis is
contracted for many numbers at once.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import four
from cranktrain.core.reduced_body import Array
from cranktrain.film.spline import bicubic, circulant, cubic, not_a_knot, wrapped
from cranktrain.film.table.reach import TERMS

STRETCH, LOW_SHARE, LOW_WIDTH = 0.97, 0.6, 0.1
GATHERED = (0.4, 0.15)
TILT_STRETCH = 0.95
ALIGNED_MAX = 0.995
TILTED_MAX = 0.98
"""Largest eccentricities of the two tables."""

# Functions of the aligned and of the tilted table.
LN_FORCE, TURN, LN_ALIGNED_PRESSURE, LN_FLOW = 0, 1, 2, 3
MOMENT_R, MOMENT_T, REST = 2, 3, 4
BY_E, BY_G, BY_A, BY_B = 1, 2, 3, 4
"""Rows of their derivatives by ε, γ, A, B."""
FUNCTIONS = 12
"""Of the tilted table: ln M, β, both moments over |F|, and R (4, 2) of :mod:`cranktrain.film.table.family` over M."""
ACROSS = (1.0, -1.0, 1.0, -1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0)
ENDS = (1.0, 1.0, -1.0, -1.0, -1.0, -1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 1.0)
"""Signs that these functions take in the mirrors about the line of centres and z → −z."""
# Entries of TableArrays.axes.
RATIO2, TILT_RANGE, ALIGNED_TOP, TILTED_TOP, ALIGNED_RATIO2, FLOW_NORM, REACH = range(7)
AXES = REACH + TERMS
# Place on the tilted table's axes: cells, then weights and their derivatives along each axis.
CELL_E, CELL_A, CELL_B, ALONG_E, ALONG_A, ALONG_B, PLACE = 0, 1, 2, 3, 11, 17, 23
ROW, BLOCK = 3 * FUNCTIONS, 9 * FUNCTIONS
"""All functions at three values of B, and at three by three tilts."""
SCRATCH = 4 * 2 * BLOCK + 3 * BLOCK + 4 * ROW + PLACE
"""Length of the memory that :func:`interpolate_tilted` works in; its last numbers are the place in ε, A and B."""


class TableArrays(NamedTuple):
    """What kernels read: contiguous float64.

    aligned : (4, n_ε + 2, n_γ + 3) spline coefficients
    tilted : (n_ε + 2, n_γ + 3, n_t + 2, 12 (n_t + 2)) spline coefficients; of length 1 in each where not built
    pressure : (n_ε + 2, n_γ + 3, n_t + 2, n_t + 2) the same of ln p̂
    axes : (AXES,) (D/L)² of the film, tilt range, largest x of the aligned and the tilted table, :func:`aligned_norms`,
        and the terms of the reach ρ of ends whose tilt is called possible
    """

    aligned: Array
    tilted: Array
    axes: Array
    pressure: Array = np.zeros((1, 1, 1, 1))


def eccentricity_nodes(count: int, top: float) -> Array:
    """Eccentricities, uniform in x, from 0 to ``top``."""
    x = np.linspace(0.0, float(stretched(top)[0]), count)
    eps = top * x / x[-1]
    for _ in range(60):
        value = -np.log(1.0 - STRETCH * eps) + LOW_SHARE * np.log(1.0 + eps / LOW_WIDTH)
        eps = np.clip(eps - (value - x) / (STRETCH / (1.0 - STRETCH * eps) + LOW_SHARE / (LOW_WIDTH + eps)), 0.0, top)
    return eps


def centres(eccentricities: Array) -> Array:
    """Eccentricities half-way in x between ``eccentricities``."""
    return eccentricity_nodes(2 * len(eccentricities) - 1, float(eccentricities[-1]))[1::2]


def directions(count: int, shift: float = 0.0) -> Array:
    """Angles γ of the nodes, uniform in y from −π, moved by a ``shift`` of cells."""
    y = -math.pi + 2.0 * math.pi * (np.arange(count) + shift) / count
    gamma = y.copy()
    for _ in range(60):
        value = gamma - GATHERED[0] * np.sin(gamma) - GATHERED[1] * np.sin(2.0 * gamma)
        gamma -= (value - y) / (1.0 - GATHERED[0] * np.cos(gamma) - 2.0 * GATHERED[1] * np.cos(2.0 * gamma))
    return gamma


def aligned_spline(values: Array) -> Array:
    """Coefficients (4, n_ε + 2, n_γ + 3) through values (n_ε, n_γ, 4), made symmetric about the line of centres."""
    n_eps, n_gamma, _ = values.shape
    values = 0.5 * (values + values[:, _opposite(n_gamma)] * np.array([1.0, -1.0, 1.0, 1.0]))
    ends = np.zeros((2, n_gamma, 4))
    along = np.linalg.solve(not_a_knot(n_eps), np.concatenate([values, ends]).reshape(n_eps + 2, -1))
    around = np.linalg.solve(circulant(n_gamma), along.reshape(n_eps + 2, n_gamma, 4))
    return np.ascontiguousarray(np.moveaxis(around[:, wrapped(n_gamma)], 2, 0))


def _opposite(n: int) -> Any:
    """Index of −γ on the circle that starts at −π."""
    return (-np.arange(n)) % n


def tilted_spline(values: Array, across: tuple[float, ...] = ACROSS, ends_sign: tuple[float, ...] = ENDS) -> Array:
    """Coefficients of the stored quarter, from values (n_ε, n_γ, n_t, n_t, m) of m functions on it, and their signs."""
    n_eps, n_gamma, n_tilt, _, functions = values.shape
    line, ends = np.array(across), np.array(ends_sign)
    back = _opposite(n_gamma)
    # Solved on both sides of a mirror, equal to rounding; from here on to the last bit.
    values = values.copy()
    values[:, :, :, 0] = 0.5 * (values + line * values[:, back])[:, :, :, 0]
    values[:, :, 0] = 0.5 * (values + ends * line * values[:, back])[:, :, 0]
    mirrored = line * values[:, back]
    upper = np.concatenate([mirrored[:, :, :, :0:-1], values], axis=3)
    lower = np.concatenate([ends * values[:, :, :, :0:-1], ends * mirrored], axis=3)[:, :, :0:-1]
    whole = np.concatenate([lower, upper], axis=2)
    count = 2 * n_tilt - 1
    c = np.linalg.solve(
        not_a_knot(n_eps), np.concatenate([whole, np.zeros((2, *whole.shape[1:]))]).reshape(n_eps + 2, -1)
    )
    c = c.reshape(n_eps + 2, n_gamma, -1)
    c = np.linalg.solve(circulant(n_gamma), c)[:, wrapped(n_gamma)]
    c = c.reshape(n_eps + 2, n_gamma + 3, count, count, functions)
    tilt = np.linalg.inv(_quadratic(count))[:, :count]
    c = np.einsum("ka,lb,xgabf->xgklf", tilt[n_tilt - 1 :], tilt[n_tilt - 1 :], c, optimize=True)
    return np.ascontiguousarray(c.reshape(n_eps + 2, n_gamma + 3, n_tilt + 2, functions * (n_tilt + 2)))


def _quadratic(n: int) -> Array:
    """Matrix from n + 2 quadratic coefficients to n values and no jump of f'' next to the ends."""
    rows = np.zeros((n + 2, n + 2))
    for i in range(n):
        rows[i, i : i + 3] = [0.125, 0.75, 0.125]
    rows[n, :4] = rows[n + 1, -4:] = [1.0, -3.0, 3.0, -1.0]
    return rows


@kernel
def stretched(eps):
    """x of an eccentricity, and its slope."""
    x = -math.log(1.0 - STRETCH * eps) + LOW_SHARE * math.log(1.0 + eps / LOW_WIDTH)
    return x, STRETCH / (1.0 - STRETCH * eps) + LOW_SHARE / (LOW_WIDTH + eps)


@kernel
def _around(cos, sin, count):
    """Cell of an angle γ on a circle of ``count`` cells that starts at −π, the place in it, and its slope by γ."""
    scale = count / (2.0 * math.pi)
    gamma = math.atan2(sin, cos)
    y = (gamma - (GATHERED[0] + 2.0 * GATHERED[1] * cos) * sin + math.pi) * scale
    y -= count * math.floor(y / count)
    j = int(y)
    if j > count - 1:
        j = count - 1
    return j, y - j, scale * (1.0 - GATHERED[0] * cos - 2.0 * GATHERED[1] * (2.0 * cos * cos - 1.0))


@kernel
def interpolate_aligned(eps, cos, sin, table, first, out):
    """Two functions of the aligned table from ``first`` on, at ε ≤ ALIGNED_MAX and the angle γ of (cos, sin).

    ``out[0:6]`` = f, ∂ε, ∂γ, g, ∂ε, ∂γ, in the slots of :func:`cranktrain.film.spline.bicubic`.
    """
    n = table.aligned.shape[1] - 2
    count = table.aligned.shape[2] - 3
    x, slope = stretched(eps)
    scale = (n - 1) / table.axes[ALIGNED_TOP]
    x *= scale
    i = int(x)
    if i > n - 2:
        i = n - 2
    j, s, turn = _around(cos, sin, count)
    bicubic(table.aligned, first, i, j, cubic(x - i, slope * scale), cubic(s, turn), out)


@kernel
def _put(row, at, values):
    """Write three numbers from ``row[at]`` on."""
    row[at], row[at + 1], row[at + 2] = values


@kernel
def _three(row, at):
    """Three numbers of ``row`` from ``at`` on."""
    return row[at], row[at + 1], row[at + 2]


@kernel
def _share_place(share, tilt_range, cells, place):
    """Nearest node of A or B in [0, tilt range]; ``place[0:6]`` receives three weights and their slopes."""
    z = share * TILT_STRETCH / tilt_range
    scale = cells / math.atanh(TILT_STRETCH)
    s = math.atanh(z) * scale
    k = int(s + 0.5)
    if k > cells:
        k = cells
    t = s - k
    slope = scale * TILT_STRETCH / tilt_range / (1.0 - z * z)
    _put(place, 0, (0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)))
    _put(place, 3, ((t - 0.5) * slope, -2.0 * t * slope, (t + 0.5) * slope))
    return k


@kernel
def tilted_place(eps, share_a, share_b, table, scratch):
    """Find ε ≤ TILTED_MAX and 0 ≤ A, B ≤ tilt range on the tilted table's axes, for the interpolations below.

    ``scratch`` keeps it in its last numbers: three cells, weights and their derivatives along ε, A and B.
    """
    c = table.tilted
    n = c.shape[0] - 2
    place = scratch[SCRATCH - PLACE :]
    x, slope = stretched(eps)
    scale = (n - 1) / table.axes[TILTED_TOP]
    x *= scale
    i = int(x)
    if i > n - 2:
        i = n - 2
    place[CELL_E] = i
    place[CELL_A] = _share_place(share_a, table.axes[TILT_RANGE], c.shape[2] - 3, place[ALONG_A:ALONG_B])
    place[CELL_B] = _share_place(share_b, table.axes[TILT_RANGE], c.shape[2] - 3, place[ALONG_B:PLACE])
    k = ALONG_E
    for weight in cubic(x - i, slope * scale):
        place[k] = weight
        k += 1


@kernel
def interpolate_tilted(cos, sin, table, scratch, functions):
    """All functions of the tilted table and their derivatives by ε, γ, A, B: ``functions`` (5, 12), rows BY_E to BY_B.

    At the angle γ of (cos, sin) and the rest as :func:`tilted_place` left it. Contracted axis by axis, all functions
    of three by three tilts at a time.
    """
    c = table.tilted
    where = scratch[SCRATCH - PLACE :]
    i = int(where[CELL_E])
    ka = int(where[CELL_A])
    first = int(where[CELL_B]) * FUNCTIONS
    a0, a1, a2, a3 = four(where, ALONG_E)
    d0, d1, d2, d3 = four(where, ALONG_E + 4)
    j, s, turn = _around(cos, sin, c.shape[1] - 3)
    for g in range(4):
        for k in range(3):
            c0 = c[i, j + g, ka + k, first : first + ROW]
            c1 = c[i + 1, j + g, ka + k, first : first + ROW]
            c2 = c[i + 2, j + g, ka + k, first : first + ROW]
            c3 = c[i + 3, j + g, ka + k, first : first + ROW]
            value = scratch[(6 * g + k) * ROW : (6 * g + k + 1) * ROW]
            by_x = scratch[(6 * g + k + 3) * ROW : (6 * g + k + 4) * ROW]
            for q in range(ROW):
                value[q] = a0 * c0[q] + a1 * c1[q] + a2 * c2[q] + a3 * c3[q]
                by_x[q] = d0 * c0[q] + d1 * c1[q] + d2 * c2[q] + d3 * c3[q]
    a0, a1, a2, a3, d0, d1, d2, d3 = cubic(s, turn)
    v0, x0 = scratch[:BLOCK], scratch[BLOCK : 2 * BLOCK]
    v1, x1 = scratch[2 * BLOCK : 3 * BLOCK], scratch[3 * BLOCK : 4 * BLOCK]
    v2, x2 = scratch[4 * BLOCK : 5 * BLOCK], scratch[5 * BLOCK : 6 * BLOCK]
    v3, x3 = scratch[6 * BLOCK : 7 * BLOCK], scratch[7 * BLOCK : 8 * BLOCK]
    value, by_x = scratch[8 * BLOCK : 9 * BLOCK], scratch[9 * BLOCK : 10 * BLOCK]
    by_y = scratch[10 * BLOCK : 11 * BLOCK]
    for q in range(BLOCK):
        value[q] = a0 * v0[q] + a1 * v1[q] + a2 * v2[q] + a3 * v3[q]
        by_y[q] = d0 * v0[q] + d1 * v1[q] + d2 * v2[q] + d3 * v3[q]
        by_x[q] = a0 * x0[q] + a1 * x1[q] + a2 * x2[q] + a3 * x3[q]
    u0, u1 = scratch[33 * ROW : 34 * ROW], scratch[34 * ROW : 35 * ROW]
    u2, u3 = scratch[35 * ROW : 36 * ROW], scratch[36 * ROW : 37 * ROW]
    a0, a1, a2 = _three(where, ALONG_A)
    d0, d1, d2 = _three(where, ALONG_A + 3)
    for q in range(ROW):
        u0[q] = a0 * value[q] + a1 * value[q + ROW] + a2 * value[q + 2 * ROW]
        u1[q] = a0 * by_x[q] + a1 * by_x[q + ROW] + a2 * by_x[q + 2 * ROW]
        u2[q] = a0 * by_y[q] + a1 * by_y[q + ROW] + a2 * by_y[q + 2 * ROW]
        u3[q] = d0 * value[q] + d1 * value[q + ROW] + d2 * value[q + 2 * ROW]
    a0, a1, a2 = _three(where, ALONG_B)
    d0, d1, d2 = _three(where, ALONG_B + 3)
    by_e, by_g, by_a, by_b = functions[BY_E], functions[BY_G], functions[BY_A], functions[BY_B]
    for q in range(FUNCTIONS):
        functions[0, q] = a0 * u0[q] + a1 * u0[q + FUNCTIONS] + a2 * u0[q + 2 * FUNCTIONS]
        by_e[q] = a0 * u1[q] + a1 * u1[q + FUNCTIONS] + a2 * u1[q + 2 * FUNCTIONS]
        by_g[q] = a0 * u2[q] + a1 * u2[q + FUNCTIONS] + a2 * u2[q + 2 * FUNCTIONS]
        by_a[q] = a0 * u3[q] + a1 * u3[q + FUNCTIONS] + a2 * u3[q + 2 * FUNCTIONS]
        by_b[q] = d0 * u0[q] + d1 * u0[q + FUNCTIONS] + d2 * u0[q + 2 * FUNCTIONS]


@kernel
def interpolate_pressure(cos, sin, table, scratch):
    """Ln p̂ at the angle γ of (cos, sin) and the rest as :func:`tilted_place` left it."""
    c = table.pressure
    where = scratch[SCRATCH - PLACE :]
    i = int(where[CELL_E])
    ka = int(where[CELL_A])
    kb = int(where[CELL_B])
    a0, a1, a2 = _three(where, ALONG_B)
    j, s, _ = _around(cos, sin, c.shape[1] - 3)
    b0, b1, b2, b3, _, _, _, _ = cubic(s, 0.0)
    total = 0.0
    for m in range(4):
        for g in range(4):
            b = b0 if g == 0 else (b1 if g == 1 else (b2 if g == 2 else b3))
            for k in range(3):
                row = c[i + m, j + g, ka + k]
                line = a0 * row[kb] + a1 * row[kb + 1] + a2 * row[kb + 2]
                total += where[ALONG_E + m] * b * where[ALONG_A + k] * line
    return total
