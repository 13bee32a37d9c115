"""Force on an aligned journal read from a film table, handed over to the film solved in place as ε → 1.

Conventions, hand-over and status as in :mod:`cranktrain.film.table.law`, with two degrees of freedom.
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import kernel
from cranktrain.film.journal.film import DAMPING, STIFFNESS, journal_film
from cranktrain.film.table.interpolation import ALIGNED_MAX, interpolate_aligned
from cranktrain.film.table.law import BLENDED, CENTRED, FAILED, SOLVED, TABLE, fall

ALIGNED_MARGIN = 0.005
"""Margin inside the edge in ε where the table and the film solved in place are blended."""


@kernel
def aligned_force(x, y, vx, vy, half_speed, c, factor, table, grid, film_work, active, work, out):
    """Force on a journal without tilt, in axes at rest with the bore, from the aligned table.

    Arguments as in :func:`table_force`; ``grid`` may be one of half the width. ``out[0:2]`` force (N), ``out[2:6]``
    ∂F/∂(x, y), ``out[6:10]`` ∂F/∂(vx, vy), row-major, ``out[10]`` eccentricity, ``out[11]`` share of the solved film.
    """
    inverse = 1.0 / c
    e = math.sqrt(x * x + y * y)
    nx = 1.0
    ny = 0.0
    if e > 0.0:
        nx = x / e
        ny = y / e
    eps = e * inverse
    sx = (vx + half_speed * y) * inverse
    sy = (vy - half_speed * x) * inverse
    vr = sx * nx + sy * ny
    vt = sy * nx - sx * ny
    arm = eps if eps > CENTRED else CENTRED
    weight = 0.0
    slope = 0.0
    if eps < ALIGNED_MAX:
        weight, slope = fall((eps - ALIGNED_MAX) / ALIGNED_MARGIN + 1.0)
        slope /= ALIGNED_MARGIN
    fr = ft = k_rr = k_rt = k_tr = k_tt = d_rr = d_rt = d_tr = d_tt = 0.0
    status = TABLE
    if weight > 0.0:
        speed = math.sqrt(vr * vr + vt * vt)
        cos = 1.0
        sin = 0.0
        if speed > 0.0:
            cos = vr / speed
            sin = vt / speed
        f = work.scratch
        interpolate_aligned(eps, cos, sin, table, 0, f)
        size = math.exp(f[0])
        # Direction of −F, and the slope of M·direction by γ and ε.
        gr = size * math.cos(f[3])
        gt = size * math.sin(f[3])
        mr = gr * cos - gt * sin
        mt = gr * sin + gt * cos
        gr = mr * f[2] - mt * (1.0 + f[5])
        gt = mt * f[2] + mr * (1.0 + f[5])
        fr = -speed * mr
        ft = -speed * mt
        d_rr = -(mr * cos - gr * sin)
        d_rt = -(mr * sin + gr * cos)
        d_tr = -(mt * cos - gt * sin)
        d_tt = -(mt * sin + gt * cos)
        k_rr = -speed * (mr * f[1] - mt * f[4])
        k_tr = -speed * (mt * f[1] + mr * f[4])
        k_rt = (d_rr * vt - d_rt * vr - ft) / arm
        k_tt = (d_tr * vt - d_tt * vr + fr) / arm
    if weight < 1.0:
        status = BLENDED if weight > 0.0 else SOLVED
        film = work.film
        if journal_film(grid, table.axes[4], eps, 0.0, 0.0, 0.0, vr, vt, 0.0, 0.0, film_work, active, film) < 0:
            status = FAILED
        rest = 1.0 - weight
        k_rr = weight * k_rr + rest * film[STIFFNESS] + slope * (fr - film[0])
        k_rt = weight * k_rt + rest * film[STIFFNESS + 1]
        k_tr = weight * k_tr + rest * film[STIFFNESS + 4] + slope * (ft - film[1])
        k_tt = weight * k_tt + rest * film[STIFFNESS + 5]
        d_rr = weight * d_rr + rest * film[DAMPING]
        d_rt = weight * d_rt + rest * film[DAMPING + 1]
        d_tr = weight * d_tr + rest * film[DAMPING + 4]
        d_tt = weight * d_tt + rest * film[DAMPING + 5]
        fr = weight * fr + rest * film[0]
        ft = weight * ft + rest * film[1]
    stiff = factor * inverse
    out[0] = factor * (fr * nx - ft * ny)
    out[1] = factor * (fr * ny + ft * nx)
    _turn(k_rr, k_rt, k_tr, k_tt, nx, ny, stiff, out, 2)
    _turn(d_rr, d_rt, d_tr, d_tt, nx, ny, stiff, out, 6)
    out[2] -= half_speed * out[7]
    out[3] += half_speed * out[6]
    out[4] -= half_speed * out[9]
    out[5] += half_speed * out[8]
    out[10] = eps
    out[11] = 1.0 - weight
    return status


@kernel
def _turn(rr, rt, tr, tt, nx, ny, factor, out, first):
    """Write a 2 × 2 matrix of the line of centres in axes at rest."""
    rx = rr * nx - rt * ny
    ry = rr * ny + rt * nx
    tx = tr * nx - tt * ny
    ty = tr * ny + tt * nx
    out[first] = factor * (rx * nx - tx * ny)
    out[first + 1] = factor * (ry * nx - ty * ny)
    out[first + 2] = factor * (rx * ny + tx * nx)
    out[first + 3] = factor * (ry * ny + ty * nx)


@kernel
def aligned_observables(x, y, vx, vy, half_speed, c, viscosity, radius, width, table, out):
    """Largest pressure (Pa) and flow out of both ends (m³/s) of a film without tilt; held beyond the table's edge."""
    sx = vx + half_speed * y
    sy = vy - half_speed * x
    speed = math.sqrt(sx * sx + sy * sy)
    eps = math.sqrt(x * x + y * y) / c
    radial = x * sx + y * sy
    across = x * sy - y * sx
    size = math.sqrt(radial * radial + across * across)
    cos = radial / size if size > 0.0 else 1.0
    sin = across / size if size > 0.0 else 0.0
    interpolate_aligned(min(eps, ALIGNED_MAX), cos, sin, table, 2, out)
    highest = 12.0 * viscosity * (radius / c) ** 2 * speed / c * math.exp(out[0])
    return highest, 2.0 * radius**3 / width * speed * math.exp(out[3]) * table.axes[5]
