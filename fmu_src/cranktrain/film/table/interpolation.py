"""Splines of the film table: axes, fit, and evaluation with exact derivatives.

Axes: x = −ln(1 − 0.97 ε) + 0.6 ln(1 + ε/0.1) and y = γ − 0.2 sin γ − 0.1 sin 2γ, uniform, y periodic (nodes are
concentrated at the change of a thin film from squeeze to wedge, about γ = ±95°, and at separating surfaces); the tilts

    A = a/(√(ρ² − b²) − ε),  B = b/√(ρ² − ε²)

as fractions of the tilt at which an end lies at ρ(ε) (:mod:`cranktrain.film.table.reach`), both stretched by artanh.
The box |A|, |B| ≤ tilt range covers the region of possible tilts smoothly. By the two symmetries z → −z and about the
line of centres only a quarter of the box is stored; the splines are those of the whole box.

Splines are cubic in x and y (C²), quadratic in A and B (C¹). Coefficients of all functions are adjacent in memory, so
that four functions are evaluated at once.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.lanes import four
from cranktrain.core.reduced_body import Array
from cranktrain.core.spline import bicubic, circulant, cubic, not_a_knot, wrapped
from cranktrain.core.vectors import LANES, load, load_singles, splat, store
from cranktrain.film.table.reach import TERMS

STRETCH, LOW_SHARE, LOW_WIDTH = 0.97, 0.6, 0.1
GATHERED = (0.2, 0.1)
TILT_STRETCH = 0.98
ALIGNED_MAX = 0.995
TILTED_MAX = 0.98
"""Largest eccentricities of the aligned and of the tilted table."""

# Indices of the functions of the aligned table: ln M, β, ln p̂, ln q̂; the tilted table has ln M, β, moments, rest.
LN_FORCE, TURN, LN_ALIGNED_PRESSURE, LN_FLOW = 0, 1, 2, 3
MOMENT_R, MOMENT_T, REST = 2, 3, 4
BY_E, BY_G, BY_A, BY_B = 1, 2, 3, 4
"""Rows of the derivatives of all functions by ε, γ, A, B."""
FUNCTIONS = 12
"""Number of tilted functions: ln M, β, moments over |F|, R (4, 2) of :mod:`cranktrain.film.table.family` over M."""
ACROSS = (1.0, -1.0, 1.0, -1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0)
ENDS = (1.0, 1.0, -1.0, -1.0, -1.0, -1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 1.0)
"""Signs of the tilted functions under the symmetries about the line of centres (ACROSS) and z → −z (ENDS)."""
# Indices of TableArrays.axes, the scalar settings of the table.
RATIO2, TILT_RANGE, ALIGNED_TOP, TILTED_TOP, ALIGNED_RATIO2, FLOW_NORM, REACH = range(7)
AXES = REACH + TERMS
# Layout of a position on the tilted table's axes: cells, then weights and their derivatives along each axis.
CELL_E, CELL_A, CELL_B, ALONG_E, ALONG_A, ALONG_B, PLACE = 0, 1, 2, 3, 11, 17, 23
NODE = 4 * FUNCTIONS
"""Number of values at one node of γ: all functions and their derivatives by ε, A and B."""
KEPT_NODES = 8
TAGS = KEPT_NODES * NODE
PLACE_AT = TAGS + KEPT_NODES
SCRATCH = PLACE_AT + PLACE
"""Length of the scratch of :func:`interpolate_tilted`: values of γ nodes, numbers of these nodes, place in ε, A, B."""


class TableArrays(NamedTuple):
    """Contiguous arrays of the kernels: float64, but float32 for ``tilted``, whose memory traffic limits the speed.

    aligned : (4, n_ε + 2, n_γ + 3) spline coefficients
    tilted : (n_ε + 2, n_γ + 3, n_t + 2, 12 (n_t + 2)) spline coefficients; (1, 1, 1, 1) if not built
    pressure : (n_ε + 2, n_γ + 3, n_t + 2, n_t + 2) spline coefficients of ln p̂
    axes : (AXES,) (D/L)² of the film, tilt range, largest x of the aligned and the tilted table, :func:`aligned_norms`,
        and the coefficients of the reach ρ that limits possible tilts
    """

    aligned: Array
    tilted: Array
    axes: Array
    pressure: Array = np.zeros((1, 1, 1, 1))


UNTILTED: Any = np.zeros((1, 1, 1, 1), dtype=np.float32)
"""Placeholder of a tilted table that was not built."""


def eccentricity_nodes(count: int, top: float) -> Array:
    """Return eccentricities from 0 to ``top``, uniform in the stretched coordinate x."""
    x = np.linspace(0.0, float(stretched(top)[0]), count)
    eps = top * x / x[-1]
    for _ in range(60):
        value = -np.log(1.0 - STRETCH * eps) + LOW_SHARE * np.log(1.0 + eps / LOW_WIDTH)
        eps = np.clip(eps - (value - x) / (STRETCH / (1.0 - STRETCH * eps) + LOW_SHARE / (LOW_WIDTH + eps)), 0.0, top)
    return eps


def centres(eccentricities: Array) -> Array:
    """Return the eccentricities half-way, in x, between ``eccentricities``."""
    return eccentricity_nodes(2 * len(eccentricities) - 1, float(eccentricities[-1]))[1::2]


def directions(count: int, shift: float = 0.0) -> Array:
    """Return angles γ of the nodes, uniform in y from −π, shifted by ``shift`` cells."""
    y = -math.pi + 2.0 * math.pi * (np.arange(count) + shift) / count
    gamma = y.copy()
    for _ in range(60):
        value = gamma - GATHERED[0] * np.sin(gamma) - GATHERED[1] * np.sin(2.0 * gamma)
        gamma -= (value - y) / (1.0 - GATHERED[0] * np.cos(gamma) - 2.0 * GATHERED[1] * np.cos(2.0 * gamma))
    return gamma


def aligned_spline(values: Array) -> Array:
    """Return spline coefficients (4, n_ε + 2, n_γ + 3) of values (n_ε, n_γ, 4), symmetric about the line of centres."""
    n_eps, n_gamma, _ = values.shape
    values = 0.5 * (values + values[:, _opposite(n_gamma)] * np.array([1.0, -1.0, 1.0, 1.0]))
    ends = np.zeros((2, n_gamma, 4))
    along = np.linalg.solve(not_a_knot(n_eps), np.concatenate([values, ends]).reshape(n_eps + 2, -1))
    around = np.linalg.solve(circulant(n_gamma), along.reshape(n_eps + 2, n_gamma, 4))
    return np.ascontiguousarray(np.moveaxis(around[:, wrapped(n_gamma)], 2, 0))


def _opposite(n: int) -> Any:
    """Return the indices of −γ on a circle of nodes that starts at −π."""
    return (-np.arange(n)) % n


def tilted_spline(values: Array, across: tuple[float, ...] = ACROSS, ends_sign: tuple[float, ...] = ENDS) -> Array:
    """Return spline coefficients of the stored quarter from values (n_ε, n_γ, n_t, n_t, m) and signs of m functions."""
    n_eps, n_gamma, n_tilt, _, functions = values.shape
    line, ends = np.array(across), np.array(ends_sign)
    back = _opposite(n_gamma)
    # Values on a symmetry line exist twice and agree within rounding; their mean makes them exactly symmetric.
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
    """Return the matrix of n + 2 quadratic coefficients: n values, and no jump of f'' next to the ends."""
    rows = np.zeros((n + 2, n + 2))
    for i in range(n):
        rows[i, i : i + 3] = [0.125, 0.75, 0.125]
    rows[n, :4] = rows[n + 1, -4:] = [1.0, -3.0, 3.0, -1.0]
    return rows


@kernel
def stretched(eps):
    """Return the stretched coordinate x of an eccentricity ε, and dx/dε."""
    x = -math.log(1.0 - STRETCH * eps) + LOW_SHARE * math.log(1.0 + eps / LOW_WIDTH)
    return x, STRETCH / (1.0 - STRETCH * eps) + LOW_SHARE / (LOW_WIDTH + eps)


@kernel
def _around(cos, sin, count):
    """Return the cell of γ on a circle of ``count`` cells from −π, the position in the cell, and its slope by γ."""
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
    """Evaluate aligned functions ``first`` and ``first + 1`` at ε ≤ ALIGNED_MAX and the angle γ of (cos, sin).

    ``out[0:6]`` = f, ∂ε, ∂γ, g, ∂ε, ∂γ, in the order of :func:`cranktrain.core.spline.bicubic`.
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
    """Write three values to ``row`` from index ``at`` on."""
    row[at], row[at + 1], row[at + 2] = values


@kernel
def _three(row, at):
    """Return three values of ``row`` from index ``at`` on."""
    return row[at], row[at + 1], row[at + 2]


@kernel
def _share_place(share, tilt_range, cells, place):
    """Return the nearest node of A or B in [0, tilt range]; ``place[0:6]`` receives three weights and their slopes."""
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
    """Locate ε ≤ TILTED_MAX and 0 ≤ A, B ≤ tilt range on the axes of the tilted table, for later interpolations.

    The result is stored from PLACE_AT of ``scratch`` on: three cells, weights and their derivatives along ε, A and B.
    Stored values of γ nodes are discarded.
    """
    c = table.tilted
    n = c.shape[0] - 2
    place = scratch[PLACE_AT:]
    for slot in range(TAGS, PLACE_AT):
        scratch[slot] = -1.0
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
def towards(cos, sin, table):
    """Return the cell of the angle γ of (cos, sin) on the tilted table's axis, the position in it, and its slope."""
    return _around(cos, sin, table.tilted.shape[1] - 3)


@kernel
def interpolate_tilted(direction, table, scratch, functions, slopes):
    """Evaluate all tilted functions and their derivatives by ε, γ, A, B: ``functions`` (5, 12), rows BY_E to BY_B.

    ``direction`` is the result of :func:`towards`, ``scratch`` that of :func:`tilted_place`. Nodes of γ are contracted
    over ε, A and B and kept in ``scratch``, because the family's second point mostly needs the same nodes. Without
    ``slopes`` only row 0 is computed.
    """
    count = table.tilted.shape[1] - 3
    tags = scratch[TAGS:PLACE_AT]
    j, s, turn = direction
    b0, b1, b2, b3, e0, e1, e2, e3 = cubic(s, turn)
    rows = 5 if slopes else 1
    for k in range(rows):
        for q in range(FUNCTIONS):
            functions[k, q] = 0.0
    for g in range(4):
        b, e = (b0, e0) if g == 0 else ((b1, e1) if g == 1 else ((b2, e2) if g == 2 else (b3, e3)))
        m = j + g if j + g < count else j + g - count
        slot = m % KEPT_NODES
        node = slot * NODE
        if tags[slot] != m:
            if slopes:
                _node(table.tilted, j + g, scratch[PLACE_AT:], node, scratch)
            else:
                _node_values(table.tilted, j + g, scratch[PLACE_AT:], node, scratch)
            tags[slot] = m
        for q in range(0, FUNCTIONS, LANES):
            value = load(scratch, node + q)
            store(functions, (0, q), load(functions, (0, q)) + b * value)
            if slopes:
                store(functions, (BY_G, q), load(functions, (BY_G, q)) + e * value)
                add = b, scratch, node + q
                _add_share(add, FUNCTIONS, functions, BY_E, q)
                _add_share(add, 2 * FUNCTIONS, functions, BY_A, q)
                _add_share(add, 3 * FUNCTIONS, functions, BY_B, q)


@inlined_kernel
def _add_share(share, behind, functions, row, q):
    """Add ``share`` times four values of a node, at the offset ``behind``, to four functions of a row."""
    b, scratch, at = share
    store(functions, (row, q), load(functions, (row, q)) + b * load(scratch, at + behind))


@kernel
def _node(c, j, where, at, out):
    """Contract the tilted table ``c`` at its node j of γ over ε, A and B.

    ``out[at:]`` receives all functions, then their derivatives by ε, by A and by B: NODE values.
    """
    i = int(where[CELL_E])
    k = int(where[CELL_A])
    first = int(where[CELL_B]) * FUNCTIONS
    a0, a1, a2, a3 = four(where, ALONG_E)
    d0, d1, d2, d3 = four(where, ALONG_E + 4)
    for q in range(0, FUNCTIONS, LANES):
        value = splat(0.0)
        by_e = splat(0.0)
        by_a = splat(0.0)
        by_b = splat(0.0)
        for tilt in range(3):
            column = first + tilt * FUNCTIONS + q
            line = splat(0.0)
            line_e = splat(0.0)
            line_a = splat(0.0)
            for r in range(3):
                c0 = load_singles(c, (i, j, k + r, column))
                c1 = load_singles(c, (i + 1, j, k + r, column))
                c2 = load_singles(c, (i + 2, j, k + r, column))
                c3 = load_singles(c, (i + 3, j, k + r, column))
                u = a0 * c0 + a1 * c1 + a2 * c2 + a3 * c3
                x = d0 * c0 + d1 * c1 + d2 * c2 + d3 * c3
                line += where[ALONG_A + r] * u
                line_e += where[ALONG_A + r] * x
                line_a += where[ALONG_A + 3 + r] * u
            value += where[ALONG_B + tilt] * line
            by_e += where[ALONG_B + tilt] * line_e
            by_a += where[ALONG_B + tilt] * line_a
            by_b += where[ALONG_B + 3 + tilt] * line
        store(out, at + q, value)
        store(out, at + FUNCTIONS + q, by_e)
        store(out, at + 2 * FUNCTIONS + q, by_a)
        store(out, at + 3 * FUNCTIONS + q, by_b)


@kernel
def _node_values(c, j, where, at, out):
    """Contract the tilted table at one node j of γ over ε, A and B, without derivatives."""
    i = int(where[CELL_E])
    k = int(where[CELL_A])
    first = int(where[CELL_B]) * FUNCTIONS
    a0, a1, a2, a3 = four(where, ALONG_E)
    for q in range(0, FUNCTIONS, LANES):
        value = splat(0.0)
        for tilt in range(3):
            column = first + tilt * FUNCTIONS + q
            line = splat(0.0)
            for r in range(3):
                c0 = load_singles(c, (i, j, k + r, column))
                c1 = load_singles(c, (i + 1, j, k + r, column))
                c2 = load_singles(c, (i + 2, j, k + r, column))
                c3 = load_singles(c, (i + 3, j, k + r, column))
                line += where[ALONG_A + r] * (a0 * c0 + a1 * c1 + a2 * c2 + a3 * c3)
            value += where[ALONG_B + tilt] * line
        store(out, at + q, value)


@kernel
def interpolate_pressure(cos, sin, table, scratch):
    """Return ln p̂ at the angle γ of (cos, sin) and the place stored by :func:`tilted_place`."""
    c = table.pressure
    where = scratch[PLACE_AT:]
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
