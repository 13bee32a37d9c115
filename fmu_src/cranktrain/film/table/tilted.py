"""Film of a tilted journal on the line of centres, read from the table, with its derivatives.

Two points of the sampled family represent any velocity (:mod:`cranktrain.film.table.family`); two mirrors bring any
state into the quarter of the table that is stored.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.core.reduced_body import Array
from cranktrain.film.journal.film import OUT_SIZE
from cranktrain.film.table.family import FADED, LEVER, spread, turning
from cranktrain.film.table.interpolation import (
    BY_A,
    BY_B,
    BY_E,
    BY_G,
    FUNCTIONS,
    LN_FORCE,
    MOMENT_R,
    REACH,
    REST,
    SCRATCH,
    TURN,
    interpolate_tilted,
    tilted_place,
)
from cranktrain.film.table.reach import reach

# Derivatives by ε, a and b (TableWork.local and the first half of .weight), or by (r, t, a, b) on the line of centres
# (.centred and the second half); then by the velocities. TableWork.slopes has d in place of w, then ζ_c and σ.
E, TILT_A, TILT_B, V_R, V_T, W_R, W_T, LEVEL, APART = range(9)
CENTRED_BY_PLACE, CENTRED_BY_VELOCITY = 8, 12
"""Second half of TableWork.weight."""


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
def _add_family(rates, lever, side, share, table, work, out):
    """Add ``share`` of the family's film at v + λ d, λ = ζ_c ± σ (``lever``, sign ``side``), and its rest R d.

    ``rates`` v and d; place and tilt as ``tilted_place`` left them. Adds to ``out[0:4]`` and ``work.slopes``.
    """
    vr, vt, dr, dt = rates
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
    ln_e = f[BY_E, LN_FORCE]
    ln_g = f[BY_G, LN_FORCE]
    ln_a = f[BY_A, LN_FORCE]
    ln_b = f[BY_B, LN_FORCE]
    for k in range(4):
        first = REST + 2 * k
        r0 = size * f[0, first]
        r1 = size * f[0, first + 1]
        rest = r0 * dr + r1 * dt
        if k < 2:
            m = mr if k == 0 else mt
            across = -mt if k == 0 else mr
            by_e = m * ln_e + across * f[BY_E, TURN]
            by_g = m * ln_g + across * (f[BY_G, TURN] + 1.0)
            by_a = m * ln_a + across * f[BY_A, TURN]
            by_b = m * ln_b + across * f[BY_B, TURN]
        else:
            q = MOMENT_R + k - 2
            m = size * f[0, q]
            by_e = m * ln_e + size * f[BY_E, q]
            by_g = m * ln_g + size * f[BY_G, q]
            by_a = m * ln_a + size * f[BY_A, q]
            by_b = m * ln_b + size * f[BY_B, q]
        rest_e = rest * ln_e + size * (f[BY_E, first] * dr + f[BY_E, first + 1] * dt)
        rest_g = rest * ln_g + size * (f[BY_G, first] * dr + f[BY_G, first + 1] * dt)
        rest_a = rest * ln_a + size * (f[BY_A, first] * dr + f[BY_A, first + 1] * dt)
        rest_b = rest * ln_b + size * (f[BY_B, first] * dr + f[BY_B, first + 1] * dt)
        out[k] -= speed * m + fade * rest
        turned = by_g + fade * rest_g * inverse
        to_r = m * cos - turned * sin + rest * by_s * sr
        to_t = m * sin + turned * cos + rest * by_s * st
        along = to_r * dr + to_t * dt
        row = work.slopes[k]
        row[E] -= speed * by_e + fade * rest_e
        row[TILT_A] -= speed * by_a + fade * rest_a
        row[TILT_B] -= speed * by_b + fade * rest_b
        row[V_R] -= to_r
        row[V_T] -= to_t
        row[W_R] -= fade * r0 + lever * to_r + rest * by_d * dr
        row[W_T] -= fade * r1 + lever * to_t + rest * by_d * dt
        row[LEVEL] -= along
        row[APART] -= side * along


@kernel
def tabled_film(at, table, work, out):
    """Force and moments on the line of centres from the table, ``out[0:4]``, with ``work.local`` (4, 7)."""
    # The two mirrors bring every state into the stored quarter.
    eps, _, a, b, vr, vt, wr, wt = at
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
    reach2, widened = reach(eps, table.axes[REACH:])
    free = reach2 - eps * eps
    height = math.sqrt(free)
    root = math.sqrt(reach2 - b * b)
    gap = root - eps
    share = a / gap
    tilted_place(eps, share, b / height, table, work.scratch)
    rate, bend = turning(eps)
    dr = wr + vt * rate * b
    dt = wt - vt * rate * a
    strength = LEVER * rate * eps
    widens, q = _family_sum((vr, vt, dr, dt), strength * share, table, work, out)
    # From shares of the possible tilt to the tilt.
    a_a = 1.0 / gap
    a_e = share * a_a * (1.0 - widened / root)
    a_b = share * b / root * a_a
    b_e = b * (eps - widened) / (free * height)
    b_b = 1.0 / height
    lever_e = LEVER * (rate + eps * bend) * share
    for k in range(4):
        sums = work.slopes[k]
        by_share = sums[TILT_A] + strength * sums[LEVEL]
        to_r = sums[W_R] + sums[APART] * widens * dr
        to_t = sums[W_T] + sums[APART] * widens * dt
        narrows = sums[APART] * widens * q
        row = work.local[k]
        row[E] = sums[E] + by_share * a_e + sums[TILT_B] * b_e + vt * bend * (to_r * b - to_t * a)
        row[E] += lever_e * sums[LEVEL]
        row[TILT_A] = by_share * a_a - to_t * vt * rate
        row[TILT_B] = by_share * a_b + sums[TILT_B] * b_b + to_r * vt * rate
        row[V_R] = sums[V_R] - narrows * vr
        row[V_T] = sums[V_T] - narrows * vt + rate * (to_r * b - to_t * a)
        row[W_R] = to_r
        row[W_T] = to_t
        sign = 1.0 if k == 0 else (line if k == 1 else (ends if k == 2 else ends * line))
        out[k] *= sign
        row[E] *= sign
        row[TILT_A] *= sign * ends
        row[TILT_B] *= sign * ends * line
        row[V_R] *= sign
        row[V_T] *= sign * line
        row[W_R] *= sign * ends
        row[W_T] *= sign * ends * line


@kernel
def _family_sum(rates, lever, table, work, out):
    """The family's film at the two points ζ_c ± σ, ζ_c = ``lever``, into ``out[0:4]`` and ``work.slopes``.

    Returns twice ∂σ/∂q over |v|², and q = |d|²/|v|².
    """
    vr, vt, dr, dt = rates
    speed2 = vr * vr + vt * vt
    rest2 = dr * dr + dt * dt
    apart = 0.0
    widens = 0.0
    q = 0.0
    if rest2 > 0.0:
        if speed2 > 0.0:
            q = rest2 / speed2
            apart, widens = spread(q)
            widens *= 2.0 / speed2
        else:
            apart, _ = spread(1.0e300)
    for k in range(4):
        out[k] = 0.0
        for p in range(APART + 1):
            work.slopes[k, p] = 0.0
    if apart == 0.0:
        _add_family(rates, lever, 0.0, 1.0, table, work, out)
    else:
        _add_family(rates, lever + apart, 1.0, 0.5, table, work, out)
        _add_family(rates, lever - apart, -1.0, 0.5, table, work, out)
    return widens, q
