"""Cubic B-splines over equidistant nodes: fit and evaluation, for the maps and tables of the films."""

from typing import Any

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.core.reduced_body import Array

# Slots in the output of :func:`bicubic`: two functions and their derivatives.
VALUE, BY_ALONG, BY_AROUND, SECOND, SECOND_BY_ALONG, SECOND_BY_AROUND = range(6)


def not_a_knot(n: int) -> Array:
    """Matrix of n + 2 cubic coefficients to n values and two not-a-knot conditions (no jump of f''' near the ends)."""
    rows = np.zeros((n + 2, n + 2))
    for i in range(n):
        rows[i, i : i + 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0]
    rows[n, :5] = rows[n + 1, -5:] = [1.0, -4.0, 6.0, -4.0, 1.0]
    return rows


def circulant(n: int) -> Array:
    """Matrix from n periodic cubic coefficients to n values on a circle."""
    row = np.zeros(n)
    row[[0, 1, -1]] = [4.0 / 6.0, 1.0 / 6.0, 1.0 / 6.0]
    return np.array([np.roll(row, i) for i in range(n)])


def wrapped(n: int) -> Any:
    """Index (n + 3,) that extends n periodic coefficients by one at the begin and two at the end."""
    return np.arange(-1, n + 2) % n


@kernel
def cubic(t, slope):
    """Weights of a cubic B-spline at position t in [0, 1] within a cell, and their derivatives times ``slope``."""
    r = 1.0 - t
    a0 = r * r * r / 6.0
    a1 = (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0
    a3 = t * t * t / 6.0
    d0 = -0.5 * r * r * slope
    d1 = t * (1.5 * t - 2.0) * slope
    d3 = 0.5 * t * t * slope
    return a0, a1, 1.0 - a0 - a1 - a3, a3, d0, d1, -d0 - d1 - d3, d3


@kernel
def bicubic(table, first, i, j, along, around, out):
    """Evaluate two functions of ``table`` (functions, n, m), from number ``first`` on, in cell (i, j).

    ``along`` and ``around`` are the weights of :func:`cubic` in each direction. ``out[0:6]`` receives the values and
    the derivatives along both axes: slots VALUE to SECOND_BY_AROUND.
    """
    a0, a1, a2, a3, d0, d1, d2, d3 = along
    b0, b1, b2, b3, e0, e1, e2, e3 = around
    for k in range(2):
        value = 0.0
        by_x = 0.0
        by_y = 0.0
        for m in range(4):
            a = a0 if m == 0 else (a1 if m == 1 else (a2 if m == 2 else a3))
            d = d0 if m == 0 else (d1 if m == 1 else (d2 if m == 2 else d3))
            c0 = table[first + k, i + m, j]
            c1 = table[first + k, i + m, j + 1]
            c2 = table[first + k, i + m, j + 2]
            c3 = table[first + k, i + m, j + 3]
            line = b0 * c0 + b1 * c1 + b2 * c2 + b3 * c3
            value += a * line
            by_x += d * line
            by_y += a * (e0 * c0 + e1 * c1 + e2 * c2 + e3 * c3)
        out[3 * k] = value
        out[3 * k + 1] = by_x
        out[3 * k + 2] = by_y
