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
Below :data:`FLOOR` the film is held, with a smooth passage from twice that: contact carries there, and a tilted or
overloaded journal still has a finite force. Above twice the floor the film is not altered at all.

Source of the half-speed form: Booker, J. Basic Eng. 87 (1965) 537; of the substitution: Sommerfeld 1904.
"""

from __future__ import annotations

import math

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.film.journal.grid import (
    GUEMBEL,
    REYNOLDS,
    JournalGrid,
    JournalWork,
    cold_start,
    journal_grid,
    journal_work,
)
from cranktrain.film.journal.rupture import rupture_pressure

__all__ = [
    "JournalGrid",
    "JournalWork",
    "cold_start",
    "film_observables",
    "film_shear",
    "journal_film",
    "journal_grid",
    "journal_work",
]

FLOOR = 2.0e-4
"""Least film over the clearance that the pressure sees; reached smoothly from twice this."""
_GAUSS = np.array([half[4:] for half in np.polynomial.legendre.leggauss(8)])

# Result of journal_film.
FORCE, STIFFNESS, DAMPING, OUT_SIZE = 0, 4, 20, 36


@kernel
def journal_film(grid, ratio2, ex, ey, tx, ty, vx, vy, wx, wy, work, active, out):
    """Dimensionless forces and moments of the film on the journal, with tangents.

    ``ratio2`` (D/L)²; (ex, ey), (tx, ty) eccentricity and tilt over c; (vx, vy), (wx, wy) the velocities of pure
    squeeze over c. ``active`` (N, m): the set of the last solution nearby, or negative for none; updated.

    ``out`` (36,): ``[0:4]`` force and moments F = −∫∫ Π (n, ζ n) dφ dζ (N: times 12 η (R/c)² R L/2; the moment ∫ z dF,
    N m: times L/2 more); ``[4:20]`` ∂F_j/∂(ex, ey, tx, ty) at fixed (v, w), row-major; ``[20:36]`` ∂F_j/∂(v, w).
    On half the width all that belongs to tilt is zero.
    Returns the number of passes of the active set, negative where it did not settle or a pivot failed.
    """
    place = work.place
    place[0] = ex
    place[1] = ey
    place[2] = tx
    place[3] = ty
    place[4] = vx
    place[5] = vy
    place[6] = wx
    place[7] = wy
    place[8] = ratio2
    _film(grid, ratio2, ex, ey, tx, ty, work)
    passes = rupture_pressure(grid, vx, vy, wx, wy, work, active)
    journal_tangents(grid, vx, vy, wx, wy, work, active, out)
    return passes


@kernel
def _gathering(grading, ex, ey, tx, ty):
    """Vector m towards which nodes gather: a mean of the two ends, weighted by what is left of their films."""
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
def _film(grid, ratio2, ex, ey, tx, ty, work):
    """Angles of the nodes, and conductances of all faces with their derivatives by the film."""
    circle = grid.circle
    axial = grid.axial
    columns = circle.shape[1]
    n = axial.shape[1] - 1
    grading = grid.settings[1]
    mx, my = _gathering(grading, ex, ey, tx, ty)
    m = math.sqrt(mx * mx + my * my)
    ax = 1.0
    ay = 0.0
    if m > 1.0e-12:
        ax = mx / m
        ay = my / m
    if m > grading:
        m = grading
    root = math.sqrt(1.0 - m * m)
    for i in range(columns):
        for k in range(0, 4, 2):
            d = 1.0 / (1.0 + m * circle[k, i])
            c = (circle[k, i] + m) * d
            s = root * circle[k + 1, i] * d
            work.angle[k, i] = c * ax - s * ay
            work.angle[k + 1, i] = s * ax + c * ay
            work.width[k // 2, i] = root * d * grid.spacing[k // 2, i]
    around = work.conduct[0]
    along = work.conduct[1]
    around_slope = work.slope[0]
    along_slope = work.slope[1]
    for i in range(columns):
        c = work.angle[2, i]
        s = work.angle[3, i]
        middle = 1.0 - ex * c - ey * s
        end = tx * c + ty * s
        inverse = 1.0 / work.width[1, i]
        for j in range(n):
            h = middle - axial[0, j] * end
            u = min(max(h / (2.0 * FLOOR), 0.0), 1.0)
            factor = axial[1, j] * inverse
            h = FLOOR + 2.0 * FLOOR * u * u * u * (1.0 - 0.5 * u) + max(h - 2.0 * FLOOR, 0.0)
            around_slope[i, j] = 3.0 * h * h * factor * u * u * (3.0 - 2.0 * u)
            around[i, j] = h * h * h * factor
        c = work.angle[0, i]
        s = work.angle[1, i]
        middle = 1.0 - ex * c - ey * s
        end = tx * c + ty * s
        cell = ratio2 * work.width[0, i]
        for j in range(n + 1):
            h = middle - axial[3, j] * end
            u = min(max(h / (2.0 * FLOOR), 0.0), 1.0)
            factor = axial[4, j] * cell
            h = FLOOR + 2.0 * FLOOR * u * u * u * (1.0 - 0.5 * u) + max(h - 2.0 * FLOOR, 0.0)
            along_slope[i, j] = 3.0 * h * h * factor * u * u * (3.0 - 2.0 * u)
            along[i, j] = h * h * h * factor


@kernel
def journal_tangents(grid, vx, vy, wx, wy, work, active, out):
    """Forces, ∂/∂(e, t) and ∂/∂(v, w) from the unit solutions that ``rupture_pressure`` left."""
    axial = grid.axial
    columns = active.shape[0]
    n = axial.shape[1] - 1
    sides = grid.settings[2]
    guembel = int(grid.settings[0]) == GUEMBEL
    unit = work.unit
    adjoint = work.adjoint if guembel else work.unit
    p = work.pressure
    for k in range(OUT_SIZE):
        out[k] = 0.0
    for i in range(columns):
        after = i + 1 if i + 1 < columns else 0
        if work.used[i] == 0.0 and work.used[after] == 0.0:
            continue
        around = work.slope[0, i]
        along = work.slope[1, i]
        # Sums over the column: face terms without and with ζ, around (s, t) and axial (q, r); weighted unit solutions.
        s0 = s1 = s2 = s3 = t0 = t1 = t2 = t3 = 0.0
        q0 = q1 = q2 = q3 = r0 = r1 = r2 = r3 = 0.0
        d0 = d1 = d2 = d3 = f0 = f1 = f2 = f3 = 0.0
        for j in range(n):
            zeta = axial[0, j]
            flow = around[j] * (p[after, j] - p[i, j])
            g0 = flow * (adjoint[after, j, 0] - adjoint[i, j, 0])
            g1 = flow * (adjoint[after, j, 1] - adjoint[i, j, 1])
            g2 = flow * (adjoint[after, j, 2] - adjoint[i, j, 2])
            g3 = flow * (adjoint[after, j, 3] - adjoint[i, j, 3])
            s0 += g0
            s1 += g1
            s2 += g2
            s3 += g3
            t0 += zeta * g0
            t1 += zeta * g1
            t2 += zeta * g2
            t3 += zeta * g3
            weight = axial[2, j] * (work.source[i, j] if guembel else 1.0)
            d0 += weight * unit[i, j, 0]
            d1 += weight * unit[i, j, 1]
            d2 += weight * unit[i, j, 2]
            d3 += weight * unit[i, j, 3]
            weight *= zeta
            f0 += weight * unit[i, j, 0]
            f1 += weight * unit[i, j, 1]
            f2 += weight * unit[i, j, 2]
            f3 += weight * unit[i, j, 3]
        if work.used[i] != 0.0:
            for j in range(n + 1):
                zeta = axial[3, j]
                low = 1.0 if j > 0 else 0.0
                high = 1.0 if j < n else 0.0
                a = j - 1 if j > 0 else 0
                b = j if j < n else n - 1
                flow = along[j] * (high * p[i, b] - low * p[i, a])
                g0 = flow * (high * adjoint[i, b, 0] - low * adjoint[i, a, 0])
                g1 = flow * (high * adjoint[i, b, 1] - low * adjoint[i, a, 1])
                g2 = flow * (high * adjoint[i, b, 2] - low * adjoint[i, a, 2])
                g3 = flow * (high * adjoint[i, b, 3] - low * adjoint[i, a, 3])
                q0 += g0
                q1 += g1
                q2 += g2
                q3 += g3
                r0 += zeta * g0
                r1 += zeta * g1
                r2 += zeta * g2
                r3 += zeta * g3
        c = sides * work.angle[0, i]
        s = sides * work.angle[1, i]
        cf = sides * work.angle[2, i]
        sf = sides * work.angle[3, i]
        width = work.width[0, i]
        _four_rows(out, STIFFNESS, cf * s0 + c * q0, sf * s0 + s * q0, cf * t0 + c * r0, sf * t0 + s * r0, 0, -1.0)
        _four_rows(out, STIFFNESS, cf * s1 + c * q1, sf * s1 + s * q1, cf * t1 + c * r1, sf * t1 + s * r1, 1, -1.0)
        _four_rows(out, STIFFNESS, cf * s2 + c * q2, sf * s2 + s * q2, cf * t2 + c * r2, sf * t2 + s * r2, 2, -1.0)
        _four_rows(out, STIFFNESS, cf * s3 + c * q3, sf * s3 + s * q3, cf * t3 + c * r3, sf * t3 + s * r3, 3, -1.0)
        _four_rows(out, DAMPING, c * d0, c * d1, c * d2, c * d3, 0, -width)
        _four_rows(out, DAMPING, s * d0, s * d1, s * d2, s * d3, 1, -width)
        _four_rows(out, DAMPING, c * f0, c * f1, c * f2, c * f3, 2, -width)
        _four_rows(out, DAMPING, s * f0, s * f1, s * f2, s * f3, 3, -width)
    if sides > 1.5:
        # Half the width knows nothing of tilt.
        for j in range(4):
            for k in range(4):
                if j > 1 or k > 1:
                    out[STIFFNESS + 4 * j + k] = 0.0
                    out[DAMPING + 4 * j + k] = 0.0
    for j in range(4):
        row = DAMPING + 4 * j
        out[j] = out[row] * vx + out[row + 1] * vy + out[row + 2] * wx + out[row + 3] * wy


@kernel
def _four_rows(out, first, a, b, c, d, row, factor):
    """Add one row of a 4 × 4 matrix."""
    k = first + 4 * row
    out[k] += factor * a
    out[k + 1] += factor * b
    out[k + 2] += factor * c
    out[k + 3] += factor * d


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
    place = work.place
    half = grid.settings[2] > 1.5
    ruptures = int(grid.settings[0]) == REYNOLDS
    best_i = 0
    best_j = 0
    highest = -1.0
    for i in range(columns):
        for j in range(n):
            # Beside an end the weight of source and force exceeds the cell; where the film is too thin for the axial
            # step, the pressure there does as well.
            value = p[i, j] * min(axial[1, j] / axial[2, j], 1.0)
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
    strip = grid.settings[3]
    for i in range(columns):
        c = work.angle[0, i] * work.width[0, i]
        s = work.angle[1, i] * work.width[0, i]
        for end in range(1 if half else 2):
            last = n - 1 if end == 0 else 0
            out = work.conduct[1, i, n if end == 0 else 0] * p[i, last]
            if grid.blocked[i, last] == 0.0 and not (ruptures and p[i, last] == 0.0):
                side = 1.0 if end == 0 else -1.0
                out += strip * ((place[4] + side * place[6]) * c + (place[5] + side * place[7]) * s)
            flow += out if ruptures else max(out, 0.0)
    return highest, grid.settings[2] * flow / place[8]


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
    left = 1.0 - x * x - y * y
    return 2.0 * math.pi / math.sqrt(max(left, 2.0 * FLOOR))


@kernel
def _rise(before, top, after):
    """How far the parabola through three equidistant values rises above the middle one."""
    bend = 2.0 * top - before - after
    return 0.125 * (after - before) * (after - before) / bend if bend > 0.0 else 0.0
