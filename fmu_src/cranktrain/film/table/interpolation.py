"""Splines of the film table: their axes, their fit and their evaluation with exact derivatives.

Axes: x = −ln(1 − 0.97 ε) + 0.6 ln(1 + ε/0.1) and y = γ − 0.4 sin γ − 0.15 sin 2γ, uniform, y periodic (nodes gather
where a thin film passes from squeeze to wedge, about γ = ±95°, and where the surfaces part); the tilt as shares

    A = a/(√(1 − b²) − ε),  B = b/√(1 − ε²)

of what is possible before an end touches, both stretched by artanh. The box |A|, |B| ≤ tilt range fills the lens of
possible tilts without a kink. Two mirrors, z → −z and about the line of centres, leave a quarter of it to store; the
splines are those of the whole.

Cubic in x and y (C²), quadratic in A and B (C¹). Coefficients of all functions lie side by side, so that each axis is
contracted for many numbers at once.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.core.reduced_body import Array

STRETCH, LOW_SHARE, LOW_WIDTH = 0.97, 0.6, 0.1
GATHERED = (0.4, 0.15)
TILT_STRETCH = 0.9
ALIGNED_MAX = 0.995
TILTED_MAX = 0.98
"""Largest eccentricities of the two tables."""

# Functions of the aligned and of the tilted table.
LN_FORCE, TURN, LN_ALIGNED_PRESSURE, LN_FLOW = 0, 1, 2, 3
MOMENT_R, MOMENT_T, REST = 2, 3, 4
FUNCTIONS = 12
"""Of the tilted table: ln M, β, both moments over |F|, and R (4, 2) of :mod:`cranktrain.film.table.family` over M."""
ACROSS = (1.0, -1.0, 1.0, -1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0)
ENDS = (1.0, 1.0, -1.0, -1.0, -1.0, -1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 1.0)
"""Signs that these functions take in the mirrors about the line of centres and z → −z."""
PLACE = 23
SCRATCH = 4 * 2 * 9 * FUNCTIONS + 3 * 9 * FUNCTIONS + 4 * 3 * FUNCTIONS + PLACE
"""Length of the memory that :func:`interpolate_tilted` works in; its last numbers are the place in ε, A and B."""


class TableArrays(NamedTuple):
    """What kernels read: contiguous float64.

    aligned : (4, n_ε + 2, n_γ + 3) spline coefficients
    tilted : (n_ε + 2, n_γ + 3, n_t + 2, 12 (n_t + 2)) spline coefficients; of length 1 in each where not built
    pressure : (n_ε + 2, n_γ + 3, n_t + 2, n_t + 2) the same of ln p̂
    axes : (8,) (D/L)² of the film, tilt range, largest x of the aligned and the tilted table, :func:`aligned_norms`,
        and the tilt rates |w − w_ref| / |v| where the law begins and ends to hand over to the film solved in place
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
    along = np.linalg.solve(_not_a_knot(n_eps), np.concatenate([values, ends]).reshape(n_eps + 2, -1))
    around = np.linalg.solve(_circulant(n_gamma), along.reshape(n_eps + 2, n_gamma, 4))
    return np.ascontiguousarray(np.moveaxis(around[:, _wrapped(n_gamma)], 2, 0))


def _opposite(n: int) -> Any:
    """Index of −γ on the circle that starts at −π."""
    return (-np.arange(n)) % n


def _wrapped(n: int) -> Any:
    return np.arange(-1, n + 2) % n


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
        _not_a_knot(n_eps), np.concatenate([whole, np.zeros((2, *whole.shape[1:]))]).reshape(n_eps + 2, -1)
    )
    c = c.reshape(n_eps + 2, n_gamma, -1)
    c = np.linalg.solve(_circulant(n_gamma), c)[:, _wrapped(n_gamma)]
    c = c.reshape(n_eps + 2, n_gamma + 3, count, count, functions)
    tilt = np.linalg.inv(_quadratic(count))[:, :count]
    c = np.einsum("ka,lb,xgabf->xgklf", tilt[n_tilt - 1 :], tilt[n_tilt - 1 :], c, optimize=True)
    return np.ascontiguousarray(c.reshape(n_eps + 2, n_gamma + 3, n_tilt + 2, functions * (n_tilt + 2)))


def _not_a_knot(n: int) -> Array:
    """Matrix from n + 2 cubic coefficients to n values and two conditions: no jump of f''' one node from the ends."""
    rows = np.zeros((n + 2, n + 2))
    for i in range(n):
        rows[i, i : i + 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0]
    rows[n, :5] = rows[n + 1, -5:] = [1.0, -4.0, 6.0, -4.0, 1.0]
    return rows


def _quadratic(n: int) -> Array:
    """Matrix from n + 2 quadratic coefficients to n values and no jump of f'' next to the ends."""
    rows = np.zeros((n + 2, n + 2))
    for i in range(n):
        rows[i, i : i + 3] = [0.125, 0.75, 0.125]
    rows[n, :4] = rows[n + 1, -4:] = [1.0, -3.0, 3.0, -1.0]
    return rows


def _circulant(n: int) -> Array:
    row = np.zeros(n)
    row[[0, 1, -1]] = [4.0 / 6.0, 1.0 / 6.0, 1.0 / 6.0]
    return np.array([np.roll(row, i) for i in range(n)])


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
def _cubic(t, slope):
    """Weights of a cubic B-spline at t in [0, 1] of a cell, and their derivatives times ``slope``."""
    r = 1.0 - t
    a0 = r * r * r / 6.0
    a1 = (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0
    a3 = t * t * t / 6.0
    d0 = -0.5 * r * r * slope
    d1 = t * (1.5 * t - 2.0) * slope
    d3 = 0.5 * t * t * slope
    return a0, a1, 1.0 - a0 - a1 - a3, a3, d0, d1, -d0 - d1 - d3, d3


@kernel
def interpolate_aligned(eps, cos, sin, table, first, out):
    """Two functions of the aligned table from ``first`` on, at ε ≤ ALIGNED_MAX and the angle γ of (cos, sin).

    ``out[0:6]`` = f, ∂ε, ∂γ, g, ∂ε, ∂γ.
    """
    coefficients = table.aligned
    n = coefficients.shape[1] - 2
    count = coefficients.shape[2] - 3
    x, slope = stretched(eps)
    scale = (n - 1) / table.axes[2]
    x *= scale
    i = int(x)
    if i > n - 2:
        i = n - 2
    j, s, turn = _around(cos, sin, count)
    a0, a1, a2, a3, d0, d1, d2, d3 = _cubic(x - i, slope * scale)
    b0, b1, b2, b3, e0, e1, e2, e3 = _cubic(s, turn)
    for k in range(2):
        value = 0.0
        by_x = 0.0
        by_y = 0.0
        for m in range(4):
            a = a0 if m == 0 else (a1 if m == 1 else (a2 if m == 2 else a3))
            d = d0 if m == 0 else (d1 if m == 1 else (d2 if m == 2 else d3))
            c0 = coefficients[first + k, i + m, j]
            c1 = coefficients[first + k, i + m, j + 1]
            c2 = coefficients[first + k, i + m, j + 2]
            c3 = coefficients[first + k, i + m, j + 3]
            line = b0 * c0 + b1 * c1 + b2 * c2 + b3 * c3
            value += a * line
            by_x += d * line
            by_y += a * (e0 * c0 + e1 * c1 + e2 * c2 + e3 * c3)
        out[3 * k] = value
        out[3 * k + 1] = by_x
        out[3 * k + 2] = by_y


@kernel
def _share_place(share, tilt_range, cells, place):
    """Nearest node of A or B in [0, tilt range]; ``place[0:6]`` three weights and their derivatives by the share."""
    z = share * TILT_STRETCH / tilt_range
    scale = cells / math.atanh(TILT_STRETCH)
    s = math.atanh(z) * scale
    k = int(s + 0.5)
    if k > cells:
        k = cells
    t = s - k
    slope = scale * TILT_STRETCH / tilt_range / (1.0 - z * z)
    place[0] = 0.5 * (0.5 - t) * (0.5 - t)
    place[1] = 0.75 - t * t
    place[2] = 0.5 * (0.5 + t) * (0.5 + t)
    place[3] = (t - 0.5) * slope
    place[4] = -2.0 * t * slope
    place[5] = (t + 0.5) * slope
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
    scale = (n - 1) / table.axes[3]
    x *= scale
    i = int(x)
    if i > n - 2:
        i = n - 2
    place[0] = i
    place[1] = _share_place(share_a, table.axes[1], c.shape[2] - 3, place[11:17])
    place[2] = _share_place(share_b, table.axes[1], c.shape[2] - 3, place[17:23])
    a0, a1, a2, a3, d0, d1, d2, d3 = _cubic(x - i, slope * scale)
    place[3] = a0
    place[4] = a1
    place[5] = a2
    place[6] = a3
    place[7] = d0
    place[8] = d1
    place[9] = d2
    place[10] = d3


@kernel
def interpolate_tilted(cos, sin, table, scratch, functions):
    """All functions of the tilted table and their derivatives by ε, γ, A, B: ``functions`` (5, 12).

    At the angle γ of (cos, sin) and the rest as :func:`tilted_place` left it. Contracted axis by axis, all functions
    of three by three tilts at a time.
    """
    c = table.tilted
    where = scratch[SCRATCH - PLACE :]
    i = int(where[0])
    ka = int(where[1])
    first = int(where[2]) * FUNCTIONS
    a0 = where[3]
    a1 = where[4]
    a2 = where[5]
    a3 = where[6]
    d0 = where[7]
    d1 = where[8]
    d2 = where[9]
    d3 = where[10]
    j, s, turn = _around(cos, sin, c.shape[1] - 3)
    row = 3 * FUNCTIONS
    block = 9 * FUNCTIONS
    for g in range(4):
        for k in range(3):
            c0 = c[i, j + g, ka + k, first : first + row]
            c1 = c[i + 1, j + g, ka + k, first : first + row]
            c2 = c[i + 2, j + g, ka + k, first : first + row]
            c3 = c[i + 3, j + g, ka + k, first : first + row]
            place = 2 * g * block + k * row
            value = scratch[place : place + row]
            by_x = scratch[place + block : place + block + row]
            for q in range(36):
                value[q] = a0 * c0[q] + a1 * c1[q] + a2 * c2[q] + a3 * c3[q]
                by_x[q] = d0 * c0[q] + d1 * c1[q] + d2 * c2[q] + d3 * c3[q]
    a0, a1, a2, a3, d0, d1, d2, d3 = _cubic(s, turn)
    start = 8 * block
    v0 = scratch[:block]
    v1 = scratch[2 * block : 3 * block]
    v2 = scratch[4 * block : 5 * block]
    v3 = scratch[6 * block : 7 * block]
    x0 = scratch[block : 2 * block]
    x1 = scratch[3 * block : 4 * block]
    x2 = scratch[5 * block : 6 * block]
    x3 = scratch[7 * block : 8 * block]
    value = scratch[start : start + block]
    by_x = scratch[start + block : start + 2 * block]
    by_y = scratch[start + 2 * block : start + 3 * block]
    for q in range(108):
        value[q] = a0 * v0[q] + a1 * v1[q] + a2 * v2[q] + a3 * v3[q]
        by_y[q] = d0 * v0[q] + d1 * v1[q] + d2 * v2[q] + d3 * v3[q]
        by_x[q] = a0 * x0[q] + a1 * x1[q] + a2 * x2[q] + a3 * x3[q]
    last = start + 3 * block
    u0 = scratch[last : last + row]
    u1 = scratch[last + row : last + 2 * row]
    u2 = scratch[last + 2 * row : last + 3 * row]
    u3 = scratch[last + 3 * row : last + 4 * row]
    a0 = where[11]
    a1 = where[12]
    a2 = where[13]
    d0 = where[14]
    d1 = where[15]
    d2 = where[16]
    for q in range(36):
        u0[q] = a0 * value[q] + a1 * value[q + 36] + a2 * value[q + 72]
        u1[q] = a0 * by_x[q] + a1 * by_x[q + 36] + a2 * by_x[q + 72]
        u2[q] = a0 * by_y[q] + a1 * by_y[q + 36] + a2 * by_y[q + 72]
        u3[q] = d0 * value[q] + d1 * value[q + 36] + d2 * value[q + 72]
    a0 = where[17]
    a1 = where[18]
    a2 = where[19]
    d0 = where[20]
    d1 = where[21]
    d2 = where[22]
    for q in range(12):
        functions[0, q] = a0 * u0[q] + a1 * u0[q + 12] + a2 * u0[q + 24]
        functions[1, q] = a0 * u1[q] + a1 * u1[q + 12] + a2 * u1[q + 24]
        functions[2, q] = a0 * u2[q] + a1 * u2[q + 12] + a2 * u2[q + 24]
        functions[3, q] = a0 * u3[q] + a1 * u3[q + 12] + a2 * u3[q + 24]
        functions[4, q] = d0 * u0[q] + d1 * u0[q + 12] + d2 * u0[q + 24]


@kernel
def interpolate_pressure(cos, sin, table, scratch):
    """Ln p̂ at the angle γ of (cos, sin) and the rest as :func:`tilted_place` left it."""
    c = table.pressure
    where = scratch[SCRATCH - PLACE :]
    i = int(where[0])
    ka = int(where[1])
    kb = int(where[2])
    j, s, _ = _around(cos, sin, c.shape[1] - 3)
    b0, b1, b2, b3, _, _, _, _ = _cubic(s, 0.0)
    total = 0.0
    for m in range(4):
        for g in range(4):
            b = b0 if g == 0 else (b1 if g == 1 else (b2 if g == 2 else b3))
            for k in range(3):
                row = c[i + m, j + g, ka + k]
                line = where[17] * row[kb] + where[18] * row[kb + 1] + where[19] * row[kb + 2]
                total += where[3 + m] * b * where[11 + k] * line
    return total
