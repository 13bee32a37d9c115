"""Force of a tilted journal read from a film table, handed over to the film solved in place at the table's edges.

Position and tilt are the displacements of the journal's middle and of its axis at the end z = +L/2 (m), against the
bore; forces are conjugate to them: F = −∫∫ P n and Q = −∫∫ P ζ n, both in N (the moment ∫ z dF is Q L/2). The film sees
the velocities of pure squeeze v = ė − ω̄ e_z×e and w = ṫ − ω̄ e_z×t, ω̄ half the sum of the surface speeds.

Inside, two points of the sampled family stand for any velocity (:mod:`cranktrain.film.table.family`). Outside the table
(eccentricity, tilt, or a tilt rate so high that hardly anything else is left) the film is solved in place. Within a
margin inside the edge both answers are blended, f = W f_table + (1 − W) f_solved with W falling from 1 to 0 without a
kink; the tangents carry the slope of W. So forces and tangents are continuous across the hand-over, and nothing is
extrapolated. The law says which of them answered: :data:`TABLE`, :data:`BLENDED` or :data:`SOLVED`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.core.reduced_body import Array
from cranktrain.film.journal.film import DAMPING, OUT_SIZE, STIFFNESS, journal_film
from cranktrain.film.table.family import FADED, LEVER, spread, turning
from cranktrain.film.table.interpolation import (
    FUNCTIONS,
    LN_FORCE,
    MOMENT_R,
    REST,
    SCRATCH,
    TILTED_MAX,
    TURN,
    interpolate_pressure,
    interpolate_tilted,
    tilted_place,
)

TABLE, BLENDED, SOLVED, FAILED = 0, 1, 2, -1
TILTED_MARGIN = 0.01
SHARE_MARGIN = 0.03
"""Margins inside the edges, in ε, and in A and B as a share of the tilt range."""
CENTRED = 1.0e-3
"""Below this eccentricity the line of centres has no direction to speak of: its turning is taken at this radius."""


class TableWork(NamedTuple):
    """Memory of :func:`table_force`, one for each thread."""

    scratch: Array
    functions: Array  # (5, 12)
    slopes: Array  # (4, 9) derivatives of a family's film by ε, a, b, v_r, v_t, d_r, d_t, ζ_c, σ
    local: Array  # (4, 7) derivatives by ε, a, b, v_r, v_t, w_r, w_t
    centred: Array  # (4, 8) derivatives on the line of centres
    weight: Array  # (16,) of the table: derivatives by the seven, then by the eight
    film: Array  # (36,)


def table_work() -> TableWork:
    """Memory for :func:`table_force` and ``aligned_force``."""
    return TableWork(
        np.zeros(SCRATCH), np.zeros((5, FUNCTIONS)), np.zeros((4, 9)), np.zeros((4, 7)), np.zeros((4, 8)),
        np.zeros(16), np.zeros(OUT_SIZE),
    )  # fmt: skip


@kernel
def fall(u):
    """Smooth step from 1 (u ≤ 0) to 0 (u ≥ 1), and its slope."""
    if u <= 0.0:
        return 1.0, 0.0
    if u >= 1.0:
        return 0.0, 0.0
    return 1.0 - u * u * (3.0 - 2.0 * u), -6.0 * u * (1.0 - u)


@kernel
def _table_weight(eps, a, b, vr, vt, wr, wt, axes, slopes):
    """Weight of the table at one state; ``slopes[0:7]`` its derivatives by (ε, a, b, v_r, v_t, w_r, w_t)."""
    for k in range(7):
        slopes[k] = 0.0
    if eps >= TILTED_MAX:
        return 0.0
    tilt_range = axes[1]
    inside = axes[6] * axes[6]
    outside = axes[7] * axes[7]
    free = 1.0 - eps * eps
    height = math.sqrt(free)
    if abs(b) >= tilt_range * height:
        return 0.0
    root = math.sqrt(1.0 - b * b)
    gap = root - eps
    if abs(a) >= tilt_range * gap:
        return 0.0
    rate, bend = turning(eps)
    dr = wr + vt * rate * b
    dt = wt - vt * rate * a
    speed2 = vr * vr + vt * vt
    rest2 = dr * dr + dt * dt
    if rest2 >= outside * speed2 and rest2 > 0.0:
        return 0.0
    share_a = a / gap
    share_b = b / height
    margin = SHARE_MARGIN * tilt_range
    w_e, s_e = fall((eps - TILTED_MAX) / TILTED_MARGIN + 1.0)
    w_a, s_a = fall((abs(share_a) - tilt_range) / margin + 1.0)
    w_b, s_b = fall((abs(share_b) - tilt_range) / margin + 1.0)
    w_r = 1.0
    s_r = 0.0
    span = 1.0 / (outside - inside)
    if rest2 > inside * speed2:
        w_r, s_r = fall((rest2 / speed2 - inside) * span)
    weight = w_e * w_a * w_b * w_r
    if weight == 1.0:
        return 1.0
    s_e *= w_a * w_b * w_r / TILTED_MARGIN
    s_a *= w_e * w_b * w_r / margin * (1.0 if a >= 0.0 else -1.0)
    s_b *= w_e * w_a * w_r / margin * (1.0 if b >= 0.0 else -1.0)
    slopes[0] = s_e + s_a * share_a / gap + s_b * share_b * eps / free
    slopes[1] = s_a / gap
    slopes[2] = s_a * share_a * b / (root * gap) + s_b / height
    if s_r != 0.0:
        s_r *= w_e * w_a * w_b * span * 2.0 / speed2
        ratio2 = rest2 / speed2
        slopes[0] += s_r * vt * bend * (dr * b - dt * a)
        slopes[1] -= s_r * dt * vt * rate
        slopes[2] += s_r * dr * vt * rate
        slopes[3] -= s_r * ratio2 * vr
        slopes[4] += s_r * (rate * (dr * b - dt * a) - ratio2 * vt)
        slopes[5] = s_r * dr
        slopes[6] = s_r * dt
    return weight


@kernel
def _add_family(vr, vt, dr, dt, lever, side, share, table, work, out):
    """Add ``share`` of the family's film at v + λ d, λ = ζ_c ± σ (``lever``, sign ``side``), and its rest R d.

    Place and tilt as ``tilted_place`` left them. Adds to ``out[0:4]`` and ``work.slopes``.
    """
    sr = vr + lever * dr
    st = vt + lever * dt
    speed = math.sqrt(sr * sr + st * st)
    cos = 1.0
    sin = 0.0
    inverse = 0.0
    if speed > 0.0:
        inverse = 1.0 / speed
        cos = sr * inverse
        sin = st * inverse
    f = work.functions
    interpolate_tilted(cos, sin, table, work.scratch, f)
    # The rest fades where the direction is lost; slopes by sr and st, and by dr and dt.
    faded = FADED * FADED * (dr * dr + dt * dt)
    fade = 1.0
    by_s = 0.0
    by_d = 0.0
    if faded > 0.0:
        fade = 1.0 / (speed * speed + faded)
        by_s = 2.0 * faded * fade * fade
        by_d = -2.0 * FADED * FADED * speed * speed * fade * fade
        fade *= speed * speed
    size = share * math.exp(f[0, LN_FORCE])
    c = math.cos(f[0, TURN])
    s = math.sin(f[0, TURN])
    mr = size * (c * cos - s * sin)
    mt = size * (c * sin + s * cos)
    ln_e = f[1, LN_FORCE]
    ln_g = f[2, LN_FORCE]
    ln_a = f[3, LN_FORCE]
    ln_b = f[4, LN_FORCE]
    for k in range(4):
        first = REST + 2 * k
        r0 = size * f[0, first]
        r1 = size * f[0, first + 1]
        rest = r0 * dr + r1 * dt
        if k < 2:
            m = mr if k == 0 else mt
            across = -mt if k == 0 else mr
            by_e = m * ln_e + across * f[1, TURN]
            by_g = m * ln_g + across * (f[2, TURN] + 1.0)
            by_a = m * ln_a + across * f[3, TURN]
            by_b = m * ln_b + across * f[4, TURN]
        else:
            q = MOMENT_R + k - 2
            m = size * f[0, q]
            by_e = m * ln_e + size * f[1, q]
            by_g = m * ln_g + size * f[2, q]
            by_a = m * ln_a + size * f[3, q]
            by_b = m * ln_b + size * f[4, q]
        rest_e = rest * ln_e + size * (f[1, first] * dr + f[1, first + 1] * dt)
        rest_g = rest * ln_g + size * (f[2, first] * dr + f[2, first + 1] * dt)
        rest_a = rest * ln_a + size * (f[3, first] * dr + f[3, first + 1] * dt)
        rest_b = rest * ln_b + size * (f[4, first] * dr + f[4, first + 1] * dt)
        out[k] -= speed * m + fade * rest
        turned = by_g + fade * rest_g * inverse
        to_r = m * cos - turned * sin + rest * by_s * sr
        to_t = m * sin + turned * cos + rest * by_s * st
        along = to_r * dr + to_t * dt
        row = work.slopes[k]
        row[0] -= speed * by_e + fade * rest_e
        row[1] -= speed * by_a + fade * rest_a
        row[2] -= speed * by_b + fade * rest_b
        row[3] -= to_r
        row[4] -= to_t
        row[5] -= fade * r0 + lever * to_r + rest * by_d * dr
        row[6] -= fade * r1 + lever * to_t + rest * by_d * dt
        row[7] -= along
        row[8] -= side * along


@kernel
def _tabled(eps, a, b, vr, vt, wr, wt, table, work, out):
    """Force and moments on the line of centres from the table, ``out[0:4]``, with ``work.local`` (4, 7)."""
    # The two mirrors bring every state into the stored quarter.
    ends = 1.0
    line = 1.0
    if a < 0.0:
        ends = -1.0
    if ends * b < 0.0:
        line = -1.0
    a *= ends
    b *= ends * line
    vt *= line
    wr *= ends
    wt *= ends * line
    free = 1.0 - eps * eps
    height = math.sqrt(free)
    root = math.sqrt(1.0 - b * b)
    gap = root - eps
    share = a / gap
    tilted_place(eps, share, b / height, table, work.scratch)
    rate, bend = turning(eps)
    dr = wr + vt * rate * b
    dt = wt - vt * rate * a
    strength = LEVER * rate * eps
    lever = strength * share
    speed2 = vr * vr + vt * vt
    rest2 = dr * dr + dt * dt
    # σ(q), q = |d|²/|v|²: twice its slope over |v|².
    apart = 0.0
    apart_e = 0.0
    widens = 0.0
    q = 0.0
    if rest2 > 0.0:
        if speed2 > 0.0:
            q = rest2 / speed2
            apart, apart_e, widens = spread(eps, q)
            widens *= 2.0 / speed2
        else:
            apart, apart_e, _ = spread(eps, 1.0e300)
    slopes = work.slopes
    for k in range(4):
        out[k] = 0.0
        for p in range(9):
            slopes[k, p] = 0.0
    if apart == 0.0:
        _add_family(vr, vt, dr, dt, lever, 0.0, 1.0, table, work, out)
    else:
        _add_family(vr, vt, dr, dt, lever + apart, 1.0, 0.5, table, work, out)
        _add_family(vr, vt, dr, dt, lever - apart, -1.0, 0.5, table, work, out)
    # From shares of the possible tilt to the tilt.
    a_a = 1.0 / gap
    a_e = share * a_a
    a_b = share * b / root * a_a
    b_e = b * eps / (free * height)
    b_b = 1.0 / height
    lever_e = LEVER * (rate + eps * bend) * share
    for k in range(4):
        sums = slopes[k]
        by_share = sums[1] + strength * sums[7]
        to_r = sums[5] + sums[8] * widens * dr
        to_t = sums[6] + sums[8] * widens * dt
        narrows = sums[8] * widens * q
        row = work.local[k]
        row[0] = sums[0] + by_share * a_e + sums[2] * b_e + vt * bend * (to_r * b - to_t * a)
        row[0] += lever_e * sums[7] + apart_e * sums[8]
        row[1] = by_share * a_a - to_t * vt * rate
        row[2] = by_share * a_b + sums[2] * b_b + to_r * vt * rate
        row[3] = sums[3] - narrows * vr
        row[4] = sums[4] - narrows * vt + rate * (to_r * b - to_t * a)
        row[5] = to_r
        row[6] = to_t
        sign = 1.0 if k == 0 else (line if k == 1 else (ends if k == 2 else ends * line))
        out[k] *= sign
        row[0] *= sign
        row[1] *= sign * ends
        row[2] *= sign * ends * line
        row[3] *= sign
        row[4] *= sign * line
        row[5] *= sign * ends
        row[6] *= sign * ends * line


@kernel
def _turned(row, arm, a, b, vr, vt, wr, wt):
    """Derivative by a step across the line of centres, in axes that stay: everything else turns the other way."""
    return (row[1] * b - row[2] * a + row[3] * vt - row[4] * vr + row[5] * wt - row[6] * wr) / arm


@kernel
def _solved(eps, a, b, vr, vt, wr, wt, weight, table, grid, film_work, active, work, out):
    """Blend the film solved in place into ``out[0:4]`` and ``work.centred``; 0, or negative where it failed."""
    film = work.film
    if journal_film(grid, table.axes[0], eps, 0.0, a, b, vr, vt, wr, wt, film_work, active, film) < 0:
        return FAILED
    slopes = work.weight
    rest = 1.0 - weight
    for k in range(4):
        row = work.centred[k]
        differs = out[k] - film[k] if weight > 0.0 else 0.0
        for q in range(4):
            solved = rest * film[STIFFNESS + 4 * k + q]
            damped = rest * film[DAMPING + 4 * k + q]
            if weight > 0.0:
                solved += weight * row[q] + differs * slopes[8 + q]
                damped += weight * row[4 + q] + differs * slopes[12 + q]
            row[q] = solved
            row[4 + q] = damped
        out[k] = weight * out[k] + rest * film[k] if weight > 0.0 else film[k]
    return 0


@kernel
def table_force(x, y, ax, ay, vx, vy, wx, wy, half_speed, c, factor, table, grid, film_work, active, work, out):
    """Forces on a journal with tilt, in axes at rest with the bore, with tangents.

    Parameters
    ----------
    x, y, ax, ay : displacement of the middle, and of the axis at z = +L/2 against it, m
    vx, vy, wx, wy : their rates against the bore, m/s
    half_speed : half the sum of the surface speeds, rad/s
    c : radial clearance, m
    factor : 12 η (R/c)² R L/2, N s
    table : TableArrays with a tilted table
    grid, film_work, active : of the film solved in place (``table_grid``, ``journal_work``, ``cold_start``)
    work : TableWork
    out : (≥ 40,) ``[0:4]`` F and Q, N; ``[4:20]`` their derivatives by (x, y, ax, ay), N/m, row-major; ``[20:36]`` by
        (vx, vy, wx, wy), N s/m; ``[36]`` eccentricity; ``[37]`` share of the solved film

    Returns
    -------
    TABLE, BLENDED, SOLVED, or FAILED where the film solved in place did not converge
    """
    inverse = 1.0 / c
    e = math.sqrt(x * x + y * y)
    nx = 1.0
    ny = 0.0
    if e > 0.0:
        nx = x / e
        ny = y / e
    eps = e * inverse
    a = (ax * nx + ay * ny) * inverse
    b = (ay * nx - ax * ny) * inverse
    sx = (vx + half_speed * y) * inverse
    sy = (vy - half_speed * x) * inverse
    vr = sx * nx + sy * ny
    vt = sy * nx - sx * ny
    sx = (wx + half_speed * ay) * inverse
    sy = (wy - half_speed * ax) * inverse
    wr = sx * nx + sy * ny
    wt = sy * nx - sx * ny
    slopes = work.weight
    weight = _table_weight(eps, a, b, vr, vt, wr, wt, table.axes, slopes)
    status = TABLE
    local = work.local
    centred = work.centred
    arm = eps if eps > CENTRED else CENTRED
    if weight > 0.0:
        _tabled(eps, a, b, vr, vt, wr, wt, table, work, out)
        for k in range(4):
            row = local[k]
            other = -out[k + 1] if k % 2 == 0 else out[k - 1]
            centred[k, 0] = row[0]
            centred[k, 1] = _turned(row, arm, a, b, vr, vt, wr, wt) + other / arm
            for q in range(1, 7):
                centred[k, q + 1] = row[q]
    if weight < 1.0:
        status = BLENDED if weight > 0.0 else SOLVED
        slopes[9] = _turned(slopes, arm, a, b, vr, vt, wr, wt)
        slopes[8] = slopes[0]
        for q in range(1, 7):
            slopes[9 + q] = slopes[q]
        if _solved(eps, a, b, vr, vt, wr, wt, weight, table, grid, film_work, active, work, out) < 0:
            status = FAILED
    # Back to the axes of the bore: pairs of rows and of columns turn.
    stiff = factor * inverse
    for k in range(0, 4, 2):
        fr = out[k]
        ft = out[k + 1]
        out[k] = factor * (fr * nx - ft * ny)
        out[k + 1] = factor * (fr * ny + ft * nx)
        for q in range(0, 8, 2):
            rr = centred[k, q]
            rt = centred[k, q + 1]
            tr = centred[k + 1, q]
            tt = centred[k + 1, q + 1]
            # First the columns, then the rows.
            rx = rr * nx - rt * ny
            ry = rr * ny + rt * nx
            tx = tr * nx - tt * ny
            ty = tr * ny + tt * nx
            place = (4 if q < 4 else 20) + 4 * k + (q if q < 4 else q - 4)
            out[place] = stiff * (rx * nx - tx * ny)
            out[place + 1] = stiff * (ry * nx - ty * ny)
            out[place + 4] = stiff * (rx * ny + tx * nx)
            out[place + 5] = stiff * (ry * ny + ty * nx)
    # The velocities of pure squeeze depend on position and tilt through the surface speeds.
    for k in range(4):
        for q in range(0, 4, 2):
            out[4 + 4 * k + q] -= half_speed * out[20 + 4 * k + q + 1]
            out[4 + 4 * k + q + 1] += half_speed * out[20 + 4 * k + q]
    out[36] = eps
    out[37] = 1.0 - weight
    return status


@kernel
def tilted_pressure(x, y, ax, ay, vx, vy, half_speed, c, viscosity, radius, table, work):
    """Largest pressure (Pa) of a tilted film on the sampled family; negative where the state lies outside the table."""
    e = math.sqrt(x * x + y * y)
    nx = x / e if e > 0.0 else 1.0
    ny = y / e if e > 0.0 else 0.0
    eps = e / c
    a = (ax * nx + ay * ny) / c
    b = (ay * nx - ax * ny) / c
    sx = (vx + half_speed * y) / c
    sy = (vy - half_speed * x) / c
    vr = sx * nx + sy * ny
    vt = sy * nx - sx * ny
    if eps >= TILTED_MAX or abs(b) >= table.axes[1] * math.sqrt(1.0 - eps * eps):
        return -1.0
    share_a = abs(a) / (math.sqrt(1.0 - b * b) - eps)
    if share_a >= table.axes[1]:
        return -1.0
    speed = math.sqrt(vr * vr + vt * vt)
    cos = vr / speed if speed > 0.0 else 1.0
    sin = vt / speed if speed > 0.0 else 0.0
    tilted_place(eps, share_a, abs(b) / math.sqrt(1.0 - eps * eps), table, work.scratch)
    highest = interpolate_pressure(cos, sin if a * b >= 0.0 else -sin, table, work.scratch)
    return 12.0 * viscosity * (radius / c) ** 2 * speed * math.exp(highest)
