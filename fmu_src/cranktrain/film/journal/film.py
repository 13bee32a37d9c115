"""Rigid-bore journal film with tilt: Reynolds' equation with Swift–Stieber rupture, force, moments and tangents.

With φ the angle from the x axis in the sense of rotation and ζ = 2z/L, the film over the clearance c is

    H = 1 − (e + ζ t)·n,    n = (cos φ, sin φ),

e the eccentricity of the journal's middle and t its tilt (displacement of the axis at ζ = +1), both over c. In a frame
that turns at half the sum of the surface speeds only pure squeeze is left (v = ė − ω̄ e_z×e, w = ṫ − ω̄ e_z×t):

    ∂φ(H³ ∂φΠ) + (D/L)² ∂ζ(H³ ∂ζΠ) = −(v + ζ w)·n,   Π ≥ 0,   P = 12 η (R/c)² Π,   Π = 0 at ζ = ±1.

Rupture and reformation follow from complementarity: Π ≥ 0, and no flow is created where Π = 0. The matrix is an
M-matrix, so an active set that drops tension and takes up compression node by node ends at the one solution, from any
start; the last set is solved afresh, so the result does not depend on the start.

With the four sources g = (n, ζ n) and A λ = g on that set: Π = Σ v_k λ_k; −⟨g_j, λ_k⟩ = ∂F_j/∂v_k is symmetric, and
∂F_j/∂e_k = −Σ λ_j (∂A/∂e_k) Π sums over the faces: both exact for the discrete film at a fixed set.

Grid: node-centred finite volumes with midpoint faces on the nodes of :mod:`cranktrain.film.journal.grid`.
Below :data:`FLOOR` the film is frozen, with a smooth passage from twice that: contact carries there, and a tilted or
overloaded journal still has a finite force. Above twice the floor the film is not altered at all.

Source of the half-speed form: Booker, J. Basic Eng. 87 (1965) 537; of the substitution: Sommerfeld 1904.
"""

from __future__ import annotations

import math

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import ZEROS, four, minus, plus, put_four, scaled
from cranktrain.film.journal.grid import (
    CELL,
    COS,
    FACE_COS,
    FACE_SIN,
    FACE_ZETA,
    GUEMBEL,
    NODE_GRADING,
    PER_DISTANCE,
    RATIO2,
    RUPTURE,
    SIDES,
    SIN,
    STRIP,
    SWIFT_STIEBER,
    V_X,
    WEIGHT,
    ZETA,
)
from cranktrain.film.journal.rupture import rupture_pressure

FLOOR = 2.0e-4
"""Least film over the clearance that the pressure sees; reached smoothly from twice this."""
_GAUSS = np.array([half[4:] for half in np.polynomial.legendre.leggauss(8)])

# Result of journal_film.
FORCE, STIFFNESS, DAMPING, OUT_SIZE = 0, 4, 20, 36


@kernel
def journal_film(grid, ratio2, at, work, active, out):
    """Dimensionless forces and moments of the film on the journal, with tangents.

    ``ratio2`` (D/L)²; ``at`` Motion of the journal. ``active`` (N, m): the set of the last solution nearby, or negative
    for none; updated.

    ``out`` (36,): from FORCE on force and moments F = −∫∫ Π (n, ζ n) dφ dζ (N: times 12 η (R/c)² R L/2; the moment
    ∫ z dF, N m: times L/2 more); from STIFFNESS on ∂F_j/∂(ex, ey, tx, ty) at fixed (v, w), row-major; from DAMPING on
    ∂F_j/∂(v, w). On half the width all that belongs to tilt is zero.
    Returns the number of passes of the active set, negative where it did not settle or a pivot failed.
    """
    put_four(work.squeeze, V_X, (at.vx, at.vy, at.wx, at.wy))
    work.squeeze[RATIO2] = ratio2
    _film(grid, ratio2, at, work)
    passes = rupture_pressure(grid, at, work, active)
    journal_tangents(grid, at, work, active, out)
    return passes


@kernel
def _gathering(grading, at):
    """Vector m towards which nodes gather: a mean of the two ends, weighted by what is left of their films."""
    ex, ey, tx, ty = at.ex, at.ey, at.tx, at.ty
    if tx == 0.0 and ty == 0.0:
        return grading * ex, grading * ey
    a = math.sqrt((ex + tx) * (ex + tx) + (ey + ty) * (ey + ty))
    b = math.sqrt((ex - tx) * (ex - tx) + (ey - ty) * (ey - ty))
    a = 1.02 - a if a < 1.0 else 0.02
    b = 1.02 - b if b < 1.0 else 0.02
    share = b * b / (a * a + b * b)
    mx = ex + (2.0 * share - 1.0) * tx
    my = ey + (2.0 * share - 1.0) * ty
    return grading * mx, grading * my


@kernel
def _place_nodes(grid, at, work):
    """Angles and widths of the nodes, into ``work.angle`` and ``work.width``."""
    circle = grid.circle
    grading = grid.settings[NODE_GRADING]
    mx, my = _gathering(grading, at)
    m = math.sqrt(mx * mx + my * my)
    ax = 1.0
    ay = 0.0
    if m > 1.0e-12:
        ax = mx / m
        ay = my / m
    if m > grading:
        m = grading
    root = math.sqrt(1.0 - m * m)
    for i in range(circle.shape[1]):
        for k in range(0, 4, 2):
            d = 1.0 / (1.0 + m * circle[k, i])
            c = (circle[k, i] + m) * d
            s = root * circle[k + 1, i] * d
            work.angle[k, i] = c * ax - s * ay
            work.angle[k + 1, i] = s * ax + c * ay
            work.width[k // 2, i] = root * d * grid.spacing[k // 2, i]


@kernel
def _film(grid, ratio2, at, work):
    """Angles of the nodes, and conductances of all faces with their derivatives by the film."""
    _place_nodes(grid, at, work)
    axial = grid.axial
    n = axial.shape[1] - 1
    for i in range(grid.circle.shape[1]):
        c = work.angle[FACE_COS, i]
        s = work.angle[FACE_SIN, i]
        middle = 1.0 - at.ex * c - at.ey * s
        end = at.tx * c + at.ty * s
        inverse = 1.0 / work.width[1, i]
        for j in range(n):
            factor = axial[CELL, j] * inverse
            work.conduct[0, i, j], work.slope[0, i, j] = _conductance(middle - axial[ZETA, j] * end, factor)
        c = work.angle[COS, i]
        s = work.angle[SIN, i]
        middle = 1.0 - at.ex * c - at.ey * s
        end = at.tx * c + at.ty * s
        cell = ratio2 * work.width[0, i]
        for j in range(n + 1):
            factor = axial[PER_DISTANCE, j] * cell
            work.conduct[1, i, j], work.slope[1, i, j] = _conductance(middle - axial[FACE_ZETA, j] * end, factor)


@kernel
def _conductance(h, factor):
    """``factor`` h³ of the film above its floor, and its derivative by the film."""
    u = min(max(h / (2.0 * FLOOR), 0.0), 1.0)
    h = FLOOR + 2.0 * FLOOR * u * u * u * (1.0 - 0.5 * u) + max(h - 2.0 * FLOOR, 0.0)
    return h * h * h * factor, 3.0 * h * h * factor * u * u * (3.0 - 2.0 * u)


@kernel
def journal_tangents(grid, at, work, active, out):
    """Forces, ∂/∂(e, t) and ∂/∂(v, w) from the unit solutions that ``rupture_pressure`` left; ``out`` (36,)."""
    columns = active.shape[0]
    n = grid.axial.shape[1] - 1
    sides = grid.settings[SIDES]
    guembel = int(grid.settings[RUPTURE]) == GUEMBEL
    adjoint = work.adjoint if guembel else work.unit
    for k in range(OUT_SIZE):
        out[k] = 0.0
    for i in range(columns):
        after = i + 1 if i + 1 < columns else 0
        if work.used[i] == 0.0 and work.used[after] == 0.0:
            continue
        # Sums over the column: face terms without and with ζ, around (s, t) and axial (q, r); weighted unit solutions.
        s, t = _sums_around(grid, adjoint, work, i, after)
        q = r = ZEROS
        if work.used[i] != 0.0:
            q, r = _sums_across(grid, adjoint, work, i)
        d = f = ZEROS
        for j in range(n):
            weight = grid.axial[WEIGHT, j] * (work.source[i, j] if guembel else 1.0)
            d = plus(d, scaled(weight, four(work.unit[i, j], 0)))
            weight *= grid.axial[ZETA, j]
            f = plus(f, scaled(weight, four(work.unit[i, j], 0)))
        cos = sides * work.angle[COS, i]
        sin = sides * work.angle[SIN, i]
        face_cos = sides * work.angle[FACE_COS, i]
        face_sin = sides * work.angle[FACE_SIN, i]
        width = work.width[0, i]
        _add_lane(out, STIFFNESS, 4, plus(scaled(face_cos, s), scaled(cos, q)), -1.0)
        _add_lane(out, STIFFNESS + 1, 4, plus(scaled(face_sin, s), scaled(sin, q)), -1.0)
        _add_lane(out, STIFFNESS + 2, 4, plus(scaled(face_cos, t), scaled(cos, r)), -1.0)
        _add_lane(out, STIFFNESS + 3, 4, plus(scaled(face_sin, t), scaled(sin, r)), -1.0)
        _add_lane(out, DAMPING, 1, scaled(cos, d), -width)
        _add_lane(out, DAMPING + 4, 1, scaled(sin, d), -width)
        _add_lane(out, DAMPING + 8, 1, scaled(cos, f), -width)
        _add_lane(out, DAMPING + 12, 1, scaled(sin, f), -width)
    if sides > 1.5:
        # Half the width knows nothing of tilt.
        for j in range(4):
            for k in range(4):
                if j > 1 or k > 1:
                    out[STIFFNESS + 4 * j + k] = 0.0
                    out[DAMPING + 4 * j + k] = 0.0
    for j in range(4):
        row = DAMPING + 4 * j
        out[j] = out[row] * at.vx + out[row + 1] * at.vy + out[row + 2] * at.wx + out[row + 3] * at.wy


@kernel
def _sums_around(grid, adjoint, work, i, after):
    """Sums over the faces from column i to ``after``: slope of the flow times adjoint, for four, without and with ζ."""
    s = t = ZEROS
    for j in range(grid.axial.shape[1] - 1):
        flow = work.slope[0, i, j] * (work.pressure[after, j] - work.pressure[i, j])
        g = scaled(flow, minus(four(adjoint[after, j], 0), four(adjoint[i, j], 0)))
        s = plus(s, g)
        t = plus(t, scaled(grid.axial[ZETA, j], g))
    return s, t


@kernel
def _sums_across(grid, adjoint, work, i):
    """The same over the axial faces of column i."""
    p = work.pressure
    n = grid.axial.shape[1] - 1
    q = r = ZEROS
    for j in range(n + 1):
        low = 1.0 if j > 0 else 0.0
        high = 1.0 if j < n else 0.0
        a = j - 1 if j > 0 else 0
        b = j if j < n else n - 1
        flow = work.slope[1, i, j] * (high * p[i, b] - low * p[i, a])
        g = scaled(flow, minus(scaled(high, four(adjoint[i, b], 0)), scaled(low, four(adjoint[i, a], 0))))
        q = plus(q, g)
        r = plus(r, scaled(grid.axial[FACE_ZETA, j], g))
    return q, r


@kernel
def _add_lane(out, first, stride, values, factor):
    """Add ``factor`` times four values to a row (stride 1) or a column (stride 4) of a 4 × 4 matrix."""
    a, b, c, d = values
    out[first] += factor * a
    out[first + stride] += factor * b
    out[first + 2 * stride] += factor * c
    out[first + 3 * stride] += factor * d


@kernel
def film_observables(grid, work):
    """Largest pressure and side flow of the film that ``journal_film`` left in ``work``.

    Returns max Π, by parabolas through the largest node (P: times 12 η (R/c)²); the flow out of both ends
    Σ ∫H³ |∂ζΠ| dφ (m³/s: times 2 c R³/L). It is that of the discrete balance: what crosses the last face inside, and
    what the strip beyond the last node adds where the film reaches it; so it equals what the gap displaces in the
    whole film. A film that may draw oil in (full, guembel) counts what leaves only.
    """
    p = work.pressure
    axial = grid.axial
    columns = p.shape[0]
    n = axial.shape[1] - 1
    vx, vy, wx, wy = four(work.squeeze, V_X)
    half = grid.settings[SIDES] > 1.5
    ruptures = int(grid.settings[RUPTURE]) == SWIFT_STIEBER
    best_i = 0
    best_j = 0
    highest = -1.0
    for i in range(columns):
        for j in range(n):
            # Beside an end the weight of source and force exceeds the cell; where the film is too thin for the axial
            # step, the pressure there does as well.
            value = p[i, j] * min(axial[CELL, j] / axial[WEIGHT, j], 1.0)
            if value > highest:
                highest = value
                best_i = i
                best_j = j
    top = p[best_i, best_j]
    before = p[best_i - 1 if best_i > 0 else columns - 1, best_j]
    after = p[best_i + 1 if best_i + 1 < columns else 0, best_j]
    highest += _rise(before, top, after)
    after = p[best_i, best_j + 1] if best_j + 1 < n else 0.0
    before = p[best_i, best_j - 1] if best_j > 0 else (after if half else 0.0)
    highest += _rise(before, top, after)
    flow = 0.0
    strip = grid.settings[STRIP]
    for i in range(columns):
        c = work.angle[COS, i] * work.width[0, i]
        s = work.angle[SIN, i] * work.width[0, i]
        for end in range(1 if half else 2):
            last = n - 1 if end == 0 else 0
            out = work.conduct[1, i, n if end == 0 else 0] * p[i, last]
            if grid.blocked[i, last] == 0.0 and not (ruptures and p[i, last] == 0.0):
                side = 1.0 if end == 0 else -1.0
                out += strip * ((vx + side * wx) * c + (vy + side * wy) * s)
            flow += out if ruptures else max(out, 0.0)
    return highest, grid.settings[SIDES] * flow / work.squeeze[RATIO2]


@kernel
def film_shear(ex, ey, tx, ty):
    """½ ∫∫ dφ dζ / H of a filled gap: 2π/√(1 − ε²) without tilt, Gauss' rule of eight points over the width with it.

    The torque on the journal that shears a filled film is −η R³ L (ω_j − ω_b)/c times this, less half of e × F.
    """
    if tx == 0.0 and ty == 0.0:
        return _circle_shear(ex, ey)
    total = 0.0
    for k in range(4):
        at = _GAUSS[0, k]
        total += _GAUSS[1, k] * (_circle_shear(ex + at * tx, ey + at * ty) + _circle_shear(ex - at * tx, ey - at * ty))
    return 0.5 * total


@kernel
def _circle_shear(x, y):
    """½ ∫∫ dφ dζ / H of one slice at the eccentricity (x, y)."""
    left = 1.0 - x * x - y * y
    return 2.0 * math.pi / math.sqrt(max(left, 2.0 * FLOOR))


@kernel
def _rise(before, top, after):
    """How far the parabola through three equidistant values rises above the middle one."""
    bend = 2.0 * top - before - after
    return 0.125 * (after - before) * (after - before) / bend if bend > 0.0 else 0.0
