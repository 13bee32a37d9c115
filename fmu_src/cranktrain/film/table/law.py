"""Force on a tilted journal, read from a film table or, beyond the table's edges, solved online.

Position and tilt are the displacements of the journal's middle and of its axis at the end z = +L/2 (m), against the
bore. The conjugate forces are F = −∫∫ P n and Q = −∫∫ P ζ n, both in N (the moment ∫ z dF is Q L/2). The film depends
on the velocities of pure squeeze v = ė − ω̄ e_z×e and w = ṫ − ω̄ e_z×t, with half the sum ω̄ of the surface speeds.

Inside the table's range of eccentricity and tilt, the film is read from the table
(:mod:`cranktrain.film.table.tilted`); outside it is solved online. Within a margin inside the edge both are blended,
f = W f_table + (1 − W) f_solved, with W falling smoothly from 1 to 0; tangents include the slope of W. Forces and
tangents are therefore continuous, and nothing is extrapolated. The status is :data:`TABLED`, :data:`BLENDED` or
:data:`SOLVED`.
"""

import math
from typing import NamedTuple

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.lanes import four
from cranktrain.core.reduced_body import Array
from cranktrain.core.vectors import load, pack, store, swap_pairs, unpack
from cranktrain.film.journal.film import DAMPING, OUT_SIZE, STIFFNESS, journal_film
from cranktrain.film.journal.grid import JournalGrid, JournalWork, Motion
from cranktrain.film.laws.parameters import CLEARANCE, RADIUS, VISCOSITY
from cranktrain.film.table.interpolation import (
    RATIO2,
    REACH,
    TILT_RANGE,
    TILTED_MAX,
    TableArrays,
    interpolate_pressure,
    tilted_place,
)
from cranktrain.film.table.reach import reach
from cranktrain.film.table.tilted import (
    CENTRED_BY_PLACE,
    CENTRED_BY_VELOCITY,
    LEVEL,
    TILT_A,
    TILT_B,
    V_R,
    V_T,
    W_R,
    W_T,
    E,
    TableWork,
    tabled_film,
)

TABLED, BLENDED, SOLVED, FAILED = 0, 1, 2, -1
TILTED_MARGIN = 0.01
SHARE_MARGIN = 0.03
"""Widths of the transitions inside the edges, in ε, and in A and B as a fraction of the tilt range."""
CENTRED = 1.0e-3
"""Least eccentricity used in the angular rate of the line of centres, which is singular for a centred journal."""

# Result of table_force: forces and tangents as in journal_film, then eccentricity, weight of the film solved online.
ECCENTRICITY, SOLVED_SHARE, FORCE_SIZE = range(OUT_SIZE, OUT_SIZE + 3)


@kernel
def fall(u):
    """Return a smooth step from 1 (u ≤ 0) to 0 (u ≥ 1), and its slope."""
    if u <= 0.0:
        return 1.0, 0.0
    if u >= 1.0:
        return 0.0, 0.0
    return 1.0 - u * u * (3.0 - 2.0 * u), -6.0 * u * (1.0 - u)


class Tabled(NamedTuple):
    """Data of one film that is read from a table: the table, the film solved beyond its edges, and memory."""

    table: TableArrays
    grid: JournalGrid
    journal: JournalWork
    active: Array  # (N, m) active set of the solved film
    work: TableWork


@kernel
def _table_weight(at, axes, slopes):
    """Return the table's weight at a state; ``slopes[0:7]`` are its derivatives by (ε, a, b, v_r, v_t, w_r, w_t)."""
    eps, _, a, b, _, _, _, _ = at
    for k in range(LEVEL):
        slopes[k] = 0.0
    if eps >= TILTED_MAX:
        return 0.0
    tilt_range = axes[TILT_RANGE]
    reach2, widens = reach(eps, axes[REACH:])
    free = reach2 - eps * eps
    height = math.sqrt(free)
    if abs(b) >= tilt_range * height:
        return 0.0
    root = math.sqrt(reach2 - b * b)
    gap = root - eps
    if abs(a) >= tilt_range * gap:
        return 0.0
    share_a = a / gap
    share_b = b / height
    margin = SHARE_MARGIN * tilt_range
    w_e, s_e = fall((eps - TILTED_MAX) / TILTED_MARGIN + 1.0)
    w_a, s_a = fall((abs(share_a) - tilt_range) / margin + 1.0)
    w_b, s_b = fall((abs(share_b) - tilt_range) / margin + 1.0)
    weight = w_e * w_a * w_b
    if weight == 1.0:
        return 1.0
    s_e *= w_a * w_b / TILTED_MARGIN
    s_a *= w_e * w_b / margin * (1.0 if a >= 0.0 else -1.0)
    s_b *= w_e * w_a / margin * (1.0 if b >= 0.0 else -1.0)
    slopes[E] = s_e + s_a * share_a / gap * (1.0 - widens / root) + s_b * share_b * (eps - widens) / free
    slopes[TILT_A] = s_a / gap
    slopes[TILT_B] = s_a * share_a * b / (root * gap) + s_b / height
    return weight


@kernel
def _weight_turned(row, arm, at):
    """Return the derivative of the weight by a step across the line of centres, which rotates tilt and velocities."""
    _, _, a, b, vr, vt, wr, wt = at
    return (row[TILT_A] * b - row[TILT_B] * a + row[V_R] * vt - row[V_T] * vr + row[W_R] * wt - row[W_T] * wr) / arm


@inlined_kernel
def _centre(local, arm, at, out, centred):
    """Compute derivatives of the force ``out[0:4]`` in axes of the line of centres, including its rotation."""
    _, _, a, b, vr, vt, wr, wt = at
    by_a = load(local, (TILT_A, 0))
    by_b = load(local, (TILT_B, 0))
    by_vr = load(local, (V_R, 0))
    by_vt = load(local, (V_T, 0))
    by_wr = load(local, (W_R, 0))
    by_wt = load(local, (W_T, 0))
    other = pack(-1.0, 1.0, -1.0, 1.0) * swap_pairs(load(out, 0))
    turned = by_a * b - by_b * a + by_vr * vt - by_vt * vr + by_wr * wt - by_wt * wr + other
    store(centred, (0, 0), load(local, (E, 0)))
    store(centred, (1, 0), turned * (1.0 / arm))
    store(centred, (2, 0), by_a)
    store(centred, (3, 0), by_b)
    store(centred, (4, 0), by_vr)
    store(centred, (5, 0), by_vt)
    store(centred, (6, 0), by_wr)
    store(centred, (7, 0), by_wt)


@kernel
def _solved(at, weight, tabled, out):
    """Blend the film solved online into ``out[0:4]`` and ``work.centred``. Return 0, or a negative value on failure."""
    film = tabled.work.film
    if journal_film(tabled.grid, tabled.table.axes[RATIO2], at, tabled.journal, tabled.active, film) < 0:
        return FAILED
    slopes = tabled.work.weight
    rest = 1.0 - weight
    centred = tabled.work.centred
    for k in range(4):
        differs = out[k] - film[k] if weight > 0.0 else 0.0
        for q in range(4):
            solved = rest * film[STIFFNESS + 4 * k + q]
            damped = rest * film[DAMPING + 4 * k + q]
            if weight > 0.0:
                solved += weight * centred[q, k] + differs * slopes[CENTRED_BY_PLACE + q]
                damped += weight * centred[4 + q, k] + differs * slopes[CENTRED_BY_VELOCITY + q]
            centred[q, k] = solved
            centred[4 + q, k] = damped
        out[k] = weight * out[k] + rest * film[k] if weight > 0.0 else film[k]
    return 0


@kernel
def on_line_of_centres(place, velocity, half_speed, inverse):
    """Return the state in axes of the line of centres, over the clearance 1/``inverse``, and the line's direction.

    ``place`` (4,) (m) and ``velocity`` (4,) (m/s) are those of the journal against the bore in axes at rest,
    ``half_speed`` is half the sum of the surface speeds, rad/s.
    """
    x, y, ax, ay = four(place, 0)
    vx, vy, wx, wy = four(velocity, 0)
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
    return Motion(eps, 0.0, a, b, vr, vt, sx * nx + sy * ny, sy * nx - sx * ny), nx, ny


@kernel
def table_force(place, velocity, half_speed, c, factor, tabled, out, tangents):
    """Compute forces and tangents of a journal with tilt, in axes fixed to the bore.

    Parameters
    ----------
    place : (4,) displacement of the middle, and of the axis at z = +L/2 against the middle, m
    velocity : (4,) their rates against the bore, m/s
    half_speed : half the sum of the surface speeds, rad/s
    c : radial clearance, m
    factor : 12 η (R/c)² R L/2, N s
    tabled : Tabled, with a tilted table
    out : (≥ FORCE_SIZE,) ``[0:4]`` F and Q, N; from STIFFNESS on their derivatives by place, N/m, and from DAMPING on
        by velocity, N s/m, both (4, 4) row-major; ECCENTRICITY; SOLVED_SHARE
    tangents : whether tangents are computed; otherwise they may keep old values

    Returns
    -------
    TABLED, BLENDED, SOLVED, or FAILED if the film solved online did not converge
    """
    inverse = 1.0 / c
    at, nx, ny = on_line_of_centres(place, velocity, half_speed, inverse)
    work = tabled.work
    slopes = work.weight
    weight = _table_weight(at, tabled.table.axes, slopes)
    status = TABLED
    eps = at.ex
    arm = eps if eps > CENTRED else CENTRED
    if weight > 0.0:
        tangents = tangents or weight < 1.0
        tabled_film(at, tabled.table, work, out, tangents)
        if tangents:
            _centre(work.local, arm, at, out, work.centred)
    if weight < 1.0:
        status = BLENDED if weight > 0.0 else SOLVED
        slopes[CENTRED_BY_PLACE + 1] = _weight_turned(slopes, arm, at)
        slopes[CENTRED_BY_PLACE] = slopes[E]
        for q in range(TILT_A, LEVEL):
            slopes[CENTRED_BY_PLACE + 1 + q] = slopes[q]
        if _solved(at, weight, tabled, out) < 0:
            status = FAILED
    back = pack(-ny, ny, -ny, ny)
    force = load(out, 0)
    store(out, 0, factor * (force * nx + swap_pairs(force) * back))
    if tangents or weight < 1.0:
        _put_tangents((nx, ny), back, factor * inverse, half_speed, work.centred, out)
    out[ECCENTRICITY] = eps
    out[SOLVED_SHARE] = 1.0 - weight
    return status


@inlined_kernel
def _put_tangents(line, back, stiff, half_speed, centred, out):
    """Transform tangents from axes of the line of centres (direction ``line``) to axes of the bore, and write them.

    The velocities of pure squeeze depend on position and tilt through the surfaces' half speed.
    """
    for q in range(0, 4, 2):
        damped_x, damped_y = _turned_columns(centred, 4 + q, line, back, stiff)
        x, y = _turned_columns(centred, q, line, back, stiff)
        _put_column(out, STIFFNESS + q, x - half_speed * damped_y)
        _put_column(out, STIFFNESS + q + 1, y + half_speed * damped_x)
        _put_column(out, DAMPING + q, damped_x)
        _put_column(out, DAMPING + q + 1, damped_y)


@inlined_kernel
def _turned_columns(centred, q, line, back, unit):
    """Transform derivatives by a vector along and across the line of centres to axes of the bore."""
    nx, ny = line
    along = load(centred, (q, 0))
    across = load(centred, (q + 1, 0))
    x = unit * (along * nx - across * ny)
    y = unit * (along * ny + across * nx)
    return x * nx + swap_pairs(x) * back, y * nx + swap_pairs(y) * back


@inlined_kernel
def _put_column(out, at, column):
    """Write a column of a (4, 4) matrix that is stored row-major from ``out[at]`` on."""
    out[at], out[at + 4], out[at + 8], out[at + 12] = unpack(column)


@kernel
def turned_block(upper, lower, nx, ny):
    """Transform a 2 × 2 matrix, given by rows, from axes of the line of centres (nx, ny) to axes at rest, row-major."""
    rr, rt = upper
    tr, tt = lower
    # Columns are transformed first, then rows.
    rx = rr * nx - rt * ny
    ry = rr * ny + rt * nx
    tx = tr * nx - tt * ny
    ty = tr * ny + tt * nx
    return rx * nx - tx * ny, ry * nx - ty * ny, rx * ny + tx * nx, ry * ny + ty * nx


@kernel
def tilted_pressure(place, velocity, half_speed, bearing, table, work):
    """Return the largest pressure (Pa) of a tilted film on the sampled family; negative outside the table.

    ``bearing`` holds the parameters of :mod:`cranktrain.film.laws.parameters`; other arguments as in
    :func:`table_force`.
    """
    inverse = 1.0 / bearing[CLEARANCE]
    (eps, _, a, b, vr, vt, _, _), _, _ = on_line_of_centres(place, velocity, half_speed, inverse)
    tilt_range = table.axes[TILT_RANGE]
    reach2, _ = reach(eps, table.axes[REACH:])
    if eps >= TILTED_MAX or abs(b) >= tilt_range * math.sqrt(reach2 - eps * eps):
        return -1.0
    share_a = abs(a) / (math.sqrt(reach2 - b * b) - eps)
    if share_a >= tilt_range:
        return -1.0
    speed = math.sqrt(vr * vr + vt * vt)
    cos = vr / speed if speed > 0.0 else 1.0
    sin = vt / speed if speed > 0.0 else 0.0
    tilted_place(eps, share_a, abs(b) / math.sqrt(reach2 - eps * eps), table, work.scratch)
    highest = interpolate_pressure(cos, sin if a * b >= 0.0 else -sin, table, work.scratch)
    return 12.0 * bearing[VISCOSITY] * (bearing[RADIUS] * inverse) ** 2 * speed * math.exp(highest)
