"""Force of a tilted film in axes of the line of centres, read from the table, with its derivatives.

Two points of the sampled family represent any velocity (:mod:`cranktrain.film.table.family`); two symmetries map any
state to the stored quarter of the table.
"""

import math
from typing import NamedTuple

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.memory import zeros
from cranktrain.core.reduced_body import Array
from cranktrain.core.vectors import LANES, even_lanes, load, odd_lanes, pack, splat, store, unpack
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
    MOMENT_T,
    REACH,
    REST,
    SCRATCH,
    TURN,
    interpolate_tilted,
    tilted_place,
    towards,
)
from cranktrain.film.table.reach import reach

# Rows of TableWork.local: derivatives by ε, a, b and the velocities v, w.
# Rows of TableWork.slopes: derivatives by ε, a, b, v and d, then by ζ_c (LEVEL) and σ (APART).
# Rows of TableWork.centred: derivatives by r, t, a, b on the line of centres, then by the velocities v, w.
E, TILT_A, TILT_B, V_R, V_T, W_R, W_T, LEVEL, APART = range(9)
CENTRED_BY_PLACE, CENTRED_BY_VELOCITY = 8, 12
"""Indices of the second half of TableWork.weight, the derivatives on the line of centres."""


class TableWork(NamedTuple):
    """Scratch memory of :func:`table_force`, one for each thread.

    Each row of derivatives holds the four forces, so that kernels compute them at once.
    """

    scratch: Array
    functions: Array  # (2, 5, 12) functions of both points and their derivatives
    slopes: Array  # (9, 4) derivatives of the family's force by ε, a, b, v_r, v_t, d_r, d_t, ζ_c, σ
    local: Array  # (7, 4) derivatives by ε, a, b, v_r, v_t, w_r, w_t
    centred: Array  # (8, 4) derivatives on the line of centres
    weight: Array  # (16,) derivatives of the table's weight: the seven of ``local``, then the eight of ``centred``
    film: Array  # (36,) result of the film solved online


def table_work() -> TableWork:
    """Make the scratch memory of :func:`table_force` and ``aligned_force``."""
    return TableWork(
        zeros(SCRATCH), zeros((2, 5, FUNCTIONS)), zeros((9, 4)), zeros((7, 4)), zeros((8, 4)), zeros(16),
        zeros(OUT_SIZE),
    )  # fmt: skip


@inlined_kernel
def _by(functions, row, force, across, moments, rates, ways):
    """Return one derivative of the family's force, over the speed, and of its remainder R d.

    ``row`` is that of ``functions``; ``across`` the force rotated by 90°, ``moments`` the factor of the moments'
    derivatives; ``rates`` are d; ``ways`` holds the remainder, the force's size and the derivative of γ.
    """
    dr, dt = rates
    rest, size, turns = ways
    first = load(functions, (row, LN_FORCE))
    ln, turn, _, _ = unpack(first)
    fitted = load(functions, (row, REST))
    other = load(functions, (row, REST + LANES))
    by = force * ln + across * (turn + turns) + moments * first
    return by, rest * ln + size * (even_lanes(fitted, other) * dr + odd_lanes(fitted, other) * dt)


@inlined_kernel
def _point(rates, lever, table):
    """Return the velocity v + λ d of a family point (components, size, inverse, direction), and its position in γ."""
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
    return (sr, st, speed, inverse, cos, sin), towards(cos, sin, table)


@kernel
def _add_family(rates, point, squeeze, f, work, out, slopes):
    """Add a fraction of the family's force at v + λ d, and of its remainder R d.

    ``rates`` are v and d; ``point`` is λ = ζ_c ± σ, the sign of σ, and the fraction; ``squeeze`` is the velocity of
    :func:`_point`, ``f`` (5, 12) the functions. Adds to ``out[0:4]`` and, with ``slopes``, to ``work.slopes``.
    """
    _, _, dr, dt = rates
    lever, side, share = point
    sr, st, speed, inverse, cos, sin = squeeze
    # The remainder fades out for v + λ d → 0, where the direction of this velocity is undefined.
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
    force = pack(mr, mt, size * f[0, MOMENT_R], size * f[0, MOMENT_T])
    fitted = load(f, (0, REST))
    other = load(f, (0, REST + LANES))
    r0 = size * even_lanes(fitted, other)
    r1 = size * odd_lanes(fitted, other)
    rest = r0 * dr + r1 * dt
    store(out, 0, load(out, 0) - (speed * force + fade * rest))
    if not slopes:
        return
    across = pack(-mt, mr, 0.0, 0.0)
    moments = pack(0.0, 0.0, size, size)
    d = (dr, dt)
    by_e, rest_e = _by(f, BY_E, force, across, moments, d, (rest, size, 0.0))
    by_g, rest_g = _by(f, BY_G, force, across, moments, d, (rest, size, 1.0))
    by_a, rest_a = _by(f, BY_A, force, across, moments, d, (rest, size, 0.0))
    by_b, rest_b = _by(f, BY_B, force, across, moments, d, (rest, size, 0.0))
    turned = by_g + (fade * inverse) * rest_g
    to_r = force * cos - turned * sin + rest * (by_s * sr)
    to_t = force * sin + turned * cos + rest * (by_s * st)
    along = to_r * dr + to_t * dt
    sums = work.slopes
    _subtract(sums, E, speed * by_e + fade * rest_e)
    _subtract(sums, TILT_A, speed * by_a + fade * rest_a)
    _subtract(sums, TILT_B, speed * by_b + fade * rest_b)
    _subtract(sums, V_R, to_r)
    _subtract(sums, V_T, to_t)
    _subtract(sums, W_R, fade * r0 + lever * to_r + rest * (by_d * dr))
    _subtract(sums, W_T, fade * r1 + lever * to_t + rest * (by_d * dt))
    _subtract(sums, LEVEL, along)
    _subtract(sums, APART, side * along)


@inlined_kernel
def _subtract(rows, row, what):
    """Subtract four values from a row."""
    store(rows, (row, 0), load(rows, (row, 0)) - what)


@kernel
def tabled_film(at, table, work, out, slopes):
    """Compute force and moments on the line of centres, ``out[0:4]``; if ``slopes``, also ``work.local``."""
    # The two symmetries map every state to the stored quarter.
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
    widens, q = _family_sum((vr, vt, dr, dt), strength * share, table, work, out, slopes)
    signs = pack(1.0, line, ends, ends * line)
    store(out, 0, signs * load(out, 0))
    if not slopes:
        return
    # Derivatives by fractions of the possible tilt become derivatives by the tilt.
    a_a = 1.0 / gap
    a_e = share * a_a * (1.0 - widened / root)
    a_b = share * b / root * a_a
    b_e = b * (eps - widened) / (free * height)
    b_b = 1.0 / height
    lever_e = LEVER * (rate + eps * bend) * share
    sums = work.slopes
    level = load(sums, (LEVEL, 0))
    apart = load(sums, (APART, 0))
    by_share = load(sums, (TILT_A, 0)) + strength * level
    by_b = load(sums, (TILT_B, 0))
    to_r = load(sums, (W_R, 0)) + apart * (widens * dr)
    to_t = load(sums, (W_T, 0)) + apart * (widens * dt)
    narrows = apart * (widens * q)
    turned = to_r * b - to_t * a
    local = work.local
    by_e = load(sums, (E, 0)) + by_share * a_e + by_b * b_e + turned * (vt * bend) + level * lever_e
    store(local, (E, 0), signs * by_e)
    store(local, (TILT_A, 0), (signs * ends) * (by_share * a_a - to_t * (vt * rate)))
    store(local, (TILT_B, 0), (signs * (ends * line)) * (by_share * a_b + by_b * b_b + to_r * (vt * rate)))
    store(local, (V_R, 0), signs * (load(sums, (V_R, 0)) - narrows * vr))
    store(local, (V_T, 0), (signs * line) * (load(sums, (V_T, 0)) - narrows * vt + rate * turned))
    store(local, (W_R, 0), (signs * ends) * to_r)
    store(local, (W_T, 0), (signs * (ends * line)) * to_t)


@kernel
def _family_sum(rates, lever, table, work, out, slopes):
    """Compute the mean force of the family's points ζ_c ± σ (ζ_c is ``lever``), ``out[0:4]``, and ``work.slopes``.

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
    store(out, 0, splat(0.0))
    if slopes:
        for row in range(APART + 1):
            store(work.slopes, (row, 0), splat(0.0))
    # Both points are read before both are added, so that the two evaluations can overlap in the processor.
    first = work.functions[0]
    second = work.functions[1]
    if apart == 0.0:
        squeeze, direction = _point(rates, lever, table)
        interpolate_tilted(direction, table, work.scratch, first, slopes)
        _add_family(rates, (lever, 0.0, 1.0), squeeze, first, work, out, slopes)
    else:
        ahead, direction = _point(rates, lever + apart, table)
        behind, other = _point(rates, lever - apart, table)
        interpolate_tilted(direction, table, work.scratch, first, slopes)
        interpolate_tilted(other, table, work.scratch, second, slopes)
        _add_family(rates, (lever + apart, 1.0, 0.5), ahead, first, work, out, slopes)
        _add_family(rates, (lever - apart, -1.0, 0.5), behind, second, work, out, slopes)
    return widens, q
