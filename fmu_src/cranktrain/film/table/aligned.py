"""Force on an aligned journal, read from a film table or, for ε → 1, solved online.

Conventions, transition and status are those of :mod:`cranktrain.film.table.law`, with two degrees of freedom.
"""

import math

from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import put_four, scaled
from cranktrain.core.spline import BY_ALONG, BY_AROUND, SECOND, SECOND_BY_ALONG, SECOND_BY_AROUND, VALUE
from cranktrain.film.journal.film import DAMPING, STIFFNESS, journal_film
from cranktrain.film.journal.grid import Motion
from cranktrain.film.laws.films import PLANE_BY_PLACE, PLANE_BY_VELOCITY, PLANE_ECCENTRICITY
from cranktrain.film.laws.parameters import CLEARANCE, RADIUS, VISCOSITY, WIDTH
from cranktrain.film.table.interpolation import (
    ALIGNED_MAX,
    ALIGNED_RATIO2,
    FLOW_NORM,
    LN_ALIGNED_PRESSURE,
    LN_FORCE,
    interpolate_aligned,
)
from cranktrain.film.table.law import BLENDED, CENTRED, FAILED, SOLVED, TABLED, fall, turned_block

ALIGNED_MARGIN = 0.005
"""Width in ε, inside the edge of the table, of the transition from the table to the film solved online."""


SOLVED_SHARE = PLANE_ECCENTRICITY + 1
"""Index of the weight of the solved film in the result of aligned_force."""


@kernel
def aligned_force(place, velocity, half_speed, c, factor, tabled, out):
    """Compute the force on a journal without tilt from the aligned table, in axes fixed to the bore.

    Arguments and result are those of :func:`table_force`, with only two entries of ``place`` and ``velocity``; the grid
    may be one of half the width. ``out`` (≥ 12,): force (N); from PLANE_BY_PLACE on ∂F/∂(x, y), from
    PLANE_BY_VELOCITY on ∂F/∂(vx, vy), row-major; PLANE_ECCENTRICITY; SOLVED_SHARE.
    """
    x = place[0]
    y = place[1]
    inverse = 1.0 / c
    e = math.sqrt(x * x + y * y)
    nx = 1.0
    ny = 0.0
    if e > 0.0:
        nx = x / e
        ny = y / e
    eps = e * inverse
    sx = (velocity[0] + half_speed * y) * inverse
    sy = (velocity[1] - half_speed * x) * inverse
    vr = sx * nx + sy * ny
    vt = sy * nx - sx * ny
    weight = 0.0
    slope = 0.0
    if eps < ALIGNED_MAX:
        weight, slope = fall((eps - ALIGNED_MAX) / ALIGNED_MARGIN + 1.0)
        slope /= ALIGNED_MARGIN
    fr = ft = k_rr = k_rt = k_tr = k_tt = d_rr = d_rt = d_tr = d_tt = 0.0
    status = TABLED
    if weight > 0.0:
        fr, ft, k_rr, k_rt, k_tr, k_tt, d_rr, d_rt, d_tr, d_tt = _tabled(eps, vr, vt, tabled.table, tabled.work.scratch)
    if weight < 1.0:
        status = BLENDED if weight > 0.0 else SOLVED
        film = tabled.work.film
        at = Motion(eps, 0.0, 0.0, 0.0, vr, vt, 0.0, 0.0)
        if journal_film(tabled.grid, tabled.table.axes[ALIGNED_RATIO2], at, tabled.journal, tabled.active, film) < 0:
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
    k_xx, k_xy, k_yx, k_yy = scaled(stiff, turned_block((k_rr, k_rt), (k_tr, k_tt), nx, ny))
    d_xx, d_xy, d_yx, d_yy = scaled(stiff, turned_block((d_rr, d_rt), (d_tr, d_tt), nx, ny))
    # The velocity of pure squeeze depends on the position through the surface speeds.
    by_place = k_xx - half_speed * d_xy, k_xy + half_speed * d_xx, k_yx - half_speed * d_yy, k_yy + half_speed * d_yx
    put_four(out, PLANE_BY_PLACE, by_place)
    put_four(out, PLANE_BY_VELOCITY, (d_xx, d_xy, d_yx, d_yy))
    out[PLANE_ECCENTRICITY] = eps
    out[SOLVED_SHARE] = 1.0 - weight
    return status


@kernel
def _tabled(eps, vr, vt, table, f):
    """Return the force (r, t) on the line of centres, derivatives by (r, t) and by (v_r, v_t); ``f`` is scratch."""
    speed = math.sqrt(vr * vr + vt * vt)
    cos = 1.0
    sin = 0.0
    if speed > 0.0:
        cos = vr / speed
        sin = vt / speed
    interpolate_aligned(eps, cos, sin, table, LN_FORCE, f)
    size = math.exp(f[VALUE])
    # Direction of −F, and the slope of M·direction by γ and ε.
    gr = size * math.cos(f[SECOND])
    gt = size * math.sin(f[SECOND])
    mr = gr * cos - gt * sin
    mt = gr * sin + gt * cos
    gr = mr * f[BY_AROUND] - mt * (1.0 + f[SECOND_BY_AROUND])
    gt = mt * f[BY_AROUND] + mr * (1.0 + f[SECOND_BY_AROUND])
    fr = -speed * mr
    ft = -speed * mt
    d_rr = -(mr * cos - gr * sin)
    d_rt = -(mr * sin + gr * cos)
    d_tr = -(mt * cos - gt * sin)
    d_tt = -(mt * sin + gt * cos)
    k_rr = -speed * (mr * f[BY_ALONG] - mt * f[SECOND_BY_ALONG])
    k_tr = -speed * (mt * f[BY_ALONG] + mr * f[SECOND_BY_ALONG])
    arm = eps if eps > CENTRED else CENTRED
    k_rt = (d_rr * vt - d_rt * vr - ft) / arm
    k_tt = (d_tr * vt - d_tt * vr + fr) / arm
    return fr, ft, k_rr, k_rt, k_tr, k_tt, d_rr, d_rt, d_tr, d_tt


@kernel
def aligned_observables(place, velocity, half_speed, bearing, table, out):
    """Return largest pressure (Pa) and flow out of both ends (m³/s) without tilt; ε is limited to the table's edge.

    ``bearing`` are the parameters of :mod:`cranktrain.film.laws.parameters`; ``out`` (6,) is scratch.
    """
    x = place[0]
    y = place[1]
    c = bearing[CLEARANCE]
    radius = bearing[RADIUS]
    sx = velocity[0] + half_speed * y
    sy = velocity[1] - half_speed * x
    speed = math.sqrt(sx * sx + sy * sy)
    eps = math.sqrt(x * x + y * y) / c
    radial = x * sx + y * sy
    across = x * sy - y * sx
    size = math.sqrt(radial * radial + across * across)
    cos = radial / size if size > 0.0 else 1.0
    sin = across / size if size > 0.0 else 0.0
    interpolate_aligned(min(eps, ALIGNED_MAX), cos, sin, table, LN_ALIGNED_PRESSURE, out)
    highest = 12.0 * bearing[VISCOSITY] * (radius / c) ** 2 * speed / c * math.exp(out[VALUE])
    return highest, 2.0 * radius**3 / bearing[WIDTH] * speed * math.exp(out[SECOND]) * table.axes[FLOW_NORM]
