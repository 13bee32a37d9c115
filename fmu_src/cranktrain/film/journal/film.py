"""Journal film with tilt in a rigid bore: Reynolds' equation with Swift–Stieber rupture, force, moments and tangents.

With φ the angle from the x axis in the sense of rotation and ζ = 2z/L, the film over the clearance c is

    h = h(H),    H = 1 + g(ζ) − (e + ζ t)·n,    n = (cos φ, sin φ),

with the eccentricity e of the journal's middle and its tilt t (displacement of the axis at ζ = +1), both over c, the
relief g of the shell, and the mean gap h(H) of rough surfaces (:mod:`cranktrain.film.contact.gap`); h = H without
contact. In a frame that rotates at half the sum of the surface speeds the motion is pure squeeze (v = ė − ω̄ e_z×e,
w = ṫ − ω̄ e_z×t):

    ∂φ(h³ ∂φΠ) + (D/L)² ∂ζ(h³ ∂ζΠ) = −h′ (v + ζ w)·n,   Π ≥ 0,   P = 12 η (R/c)² Π,   Π = 0 at ζ = ±1.

Rupture and reformation follow from complementarity: Π ≥ 0, and no flow is created where Π = 0. The matrix is an
M-matrix. An active-set method that removes nodes in tension and adds nodes in compression therefore reaches the unique
solution from any initial guess. The last set is solved once more, so the result does not depend on the guess.

With the four sources b = h′ (n, ζ n) and A λ = b on that set: Π = Σ v_k λ_k, F = −⟨b, Π⟩ (pressure works on the mean
gap), −⟨b_j, λ_k⟩ = ∂F_j/∂v_k is symmetric, and

    ∂F_j/∂e_k = Σ λ_j (∂A/∂e_k) Π − Σ [∂b_j/∂e_k Π + λ_j ∂(Σ v b)/∂e_k]

with sums over faces and nodes. Both are exact for the discrete film at a fixed set. When a node ruptures they jump, see
:mod:`cranktrain.film.journal.rupture_border`.

Grid: node-centred finite volumes with midpoint faces on the nodes of :mod:`cranktrain.film.journal.grid`.

Source of the half-speed form: Booker, J. Basic Eng. 87 (1965) 537; of the substitution: Sommerfeld 1904.
"""

import math

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import ZEROS, four, minus, plus, put_four, scaled
from cranktrain.film.contact.gap import CLEAR, SMOOTH, mean_gap, open_gap
from cranktrain.film.journal import grid as at
from cranktrain.film.journal.grid import Motion
from cranktrain.film.journal.rupture import rupture_pressure

_STRAIGHT = np.concatenate([np.polynomial.legendre.leggauss(8), np.zeros((1, 8))])

# Indices of the result of journal_film: force and moments (4), stiffness (4 × 4), damping (4 × 4).
FORCE, STIFFNESS, DAMPING, OUT_SIZE = 0, 4, 20, 36


@kernel
def journal_film(grid, ratio2, motion, work, active, out):
    """Compute the dimensionless forces and moments of the film on the journal, with tangents.

    ``ratio2`` (D/L)²; ``motion`` is the Motion of the journal. ``active`` (N, m): active set of a previous solution,
    negative for none; updated in place.

    ``out`` (36,): from FORCE on force and moments F = −∫∫ Π (n, ζ n) dφ dζ (N: times 12 η (R/c)² R L/2; the moment
    ∫ z dF, N m: times L/2 more); from STIFFNESS on ∂F_j/∂(ex, ey, tx, ty) at fixed (v, w), row-major; from DAMPING on
    ∂F_j/∂(v, w). On half the width all terms of tilt are zero. Returns the number of active-set iterations, negative if
    the set did not converge or a pivot failed.
    """
    put_four(work.squeeze, at.V_X, (motion.vx, motion.vy, motion.wx, motion.wy))
    work.squeeze[at.RATIO2] = ratio2
    _film(grid, ratio2, motion, work)
    passes = rupture_pressure(grid, motion, work, active)
    journal_tangents(grid, motion, work, active, out)
    return passes


@kernel
def _gathering(grading, edge, motion):
    """Return the vector m of the nodes' concentration: a mean of both ends, weighted towards the end of thinner film.

    ``edge`` is the relief of the shell at its ends.
    """
    ex, ey, tx, ty = motion.ex, motion.ey, motion.tx, motion.ty
    if tx == 0.0 and ty == 0.0:
        return grading * ex, grading * ey
    a = math.sqrt((ex + tx) * (ex + tx) + (ey + ty) * (ey + ty))
    b = math.sqrt((ex - tx) * (ex - tx) + (ey - ty) * (ey - ty))
    a = 0.02 + max(1.0 + edge - a, 0.0)
    b = 0.02 + max(1.0 + edge - b, 0.0)
    share = b * b / (a * a + b * b)
    mx = ex + (2.0 * share - 1.0) * tx
    my = ey + (2.0 * share - 1.0) * ty
    return grading * mx, grading * my


@kernel
def _place_nodes(grid, motion, work):
    """Compute angles and widths of the nodes, in ``work.angle`` and ``work.width``."""
    circle = grid.circle
    grading = grid.settings[at.NODE_GRADING]
    mx, my = _gathering(grading, grid.settings[at.EDGE], motion)
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
def _film(grid, ratio2, motion, work):
    """Compute angles of the nodes, derivatives of the mean gap at nodes, and conductances of faces with derivatives."""
    _place_nodes(grid, motion, work)
    axial = grid.axial
    sigma = grid.settings[at.ROUGHNESS]
    n = axial.shape[1] - 1
    for i in range(grid.circle.shape[1]):
        c = work.angle[at.FACE_COS, i]
        s = work.angle[at.FACE_SIN, i]
        middle = 1.0 - motion.ex * c - motion.ey * s
        end = motion.tx * c + motion.ty * s
        inverse = 1.0 / work.width[1, i]
        conduct = work.conduct[0, i]
        slope = work.slope[0, i]
        least = _distances(n, middle, end, axial[at.ZETA], axial[at.PROFILE], conduct)
        _conductances(n, least, sigma, inverse, axial[at.CELL], conduct, slope)
        c = work.angle[at.COS, i]
        s = work.angle[at.SIN, i]
        middle = 1.0 - motion.ex * c - motion.ey * s
        end = motion.tx * c + motion.ty * s
        conduct = work.conduct[1, i]
        slope = work.slope[1, i]
        least = _distances(n, middle, end, axial[at.ZETA], axial[at.PROFILE], conduct)
        _growths(n, least, sigma, conduct, work.growth[0, i], work.growth[1, i])
        least = _distances(n + 1, middle, end, axial[at.FACE_ZETA], axial[at.FACE_PROFILE], conduct)
        _conductances(n + 1, least, sigma, ratio2 * work.width[0, i], axial[at.PER_DISTANCE], conduct, slope)


@kernel
def _distances(n, middle, end, zeta, profile, out):
    """Compute the distances H of the surfaces along an axial line, in ``out``. Return the least distance."""
    least = 1.0e300
    for j in range(n):
        out[j] = middle - zeta[j] * end + profile[j]
        least = min(least, out[j])
    return least


@kernel
def _conductances(n, least, sigma, factor, factors, conduct, slope):
    """Compute conductances of faces and their slopes by H. On entry ``conduct`` holds H; ``least`` is the least H."""
    if least >= CLEAR * sigma:
        for j in range(n):
            h = conduct[j]
            conduct[j] = h * h * h * (factor * factors[j])
            slope[j] = 3.0 * h * h * (factor * factors[j])
        return
    for j in range(n):
        h, grows, _ = open_gap(conduct[j], sigma)
        conduct[j] = h * h * h * (factor * factors[j])
        slope[j] = 3.0 * h * h * grows * (factor * factors[j])


@kernel
def _growths(n, least, sigma, distance, first, second):
    """Compute the first and second derivative of the mean gap by the ``distance`` H; ``least`` is the least H."""
    if least >= CLEAR * sigma:
        for j in range(n):
            first[j] = 1.0
            second[j] = 0.0
        return
    for j in range(n):
        _, first[j], second[j] = open_gap(distance[j], sigma)


@kernel
def journal_tangents(grid, motion, work, active, out):
    """Compute forces, ∂/∂(e, t) and ∂/∂(v, w), ``out`` (36,), from the unit solutions of ``rupture_pressure``."""
    columns = active.shape[0]
    n = grid.axial.shape[1] - 1
    sides = grid.settings[at.SIDES]
    guembel = int(grid.settings[at.RUPTURE]) == at.GUEMBEL
    adjoint = work.adjoint if guembel else work.unit
    for k in range(OUT_SIZE):
        out[k] = 0.0
    for i in range(columns):
        after = i + 1 if i + 1 < columns else 0
        if work.used[i] == 0.0 and work.used[after] == 0.0:
            continue
        # Sums over the column without and with weight ζ: circumferential faces (s, t), axial faces (q, r), nodes.
        s, t = _sums_around(grid, adjoint, work, i, after)
        q = r = ZEROS
        if work.used[i] != 0.0:
            q, r = _sums_across(grid, adjoint, work, i)
        d = f = ZEROS
        for j in range(n):
            weight = grid.axial[at.WEIGHT, j] * work.growth[0, i, j] * (work.source[i, j] if guembel else 1.0)
            d = plus(d, scaled(weight, four(work.unit[i, j], 0)))
            weight *= grid.axial[at.ZETA, j]
            f = plus(f, scaled(weight, four(work.unit[i, j], 0)))
        if work.used[i] != 0.0:
            g, h = _sums_of_growth(grid, motion, adjoint, work, i)
            q = minus(q, g)
            r = minus(r, h)
        cos = sides * work.angle[at.COS, i]
        sin = sides * work.angle[at.SIN, i]
        face_cos = sides * work.angle[at.FACE_COS, i]
        face_sin = sides * work.angle[at.FACE_SIN, i]
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
        # A film on half the width has no tilt.
        for j in range(4):
            for k in range(4):
                if j > 1 or k > 1:
                    out[STIFFNESS + 4 * j + k] = 0.0
                    out[DAMPING + 4 * j + k] = 0.0
    for j in range(4):
        row = DAMPING + 4 * j
        out[j] = out[row] * motion.vx + out[row + 1] * motion.vy + out[row + 2] * motion.wx + out[row + 3] * motion.wy


@kernel
def _sums_around(grid, adjoint, work, i, after):
    """Return sums of flow slope times adjoint (4) over faces from column i to ``after``, without and with factor ζ."""
    s = t = ZEROS
    for j in range(grid.axial.shape[1] - 1):
        flow = work.slope[0, i, j] * (work.pressure[after, j] - work.pressure[i, j])
        g = scaled(flow, minus(four(adjoint[after, j], 0), four(adjoint[i, j], 0)))
        s = plus(s, g)
        t = plus(t, scaled(grid.axial[at.ZETA, j], g))
    return s, t


@kernel
def _sums_across(grid, adjoint, work, i):
    """Return sums of flow slope times adjoint (4) over the axial faces of column i, without and with factor ζ."""
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
        r = plus(r, scaled(grid.axial[at.FACE_ZETA, j], g))
    return q, r


@kernel
def _sums_of_growth(grid, motion, adjoint, work, i):
    """Return sums (4) over column i of source and force terms by the gap's second derivative, without and with ζ."""
    guembel = int(grid.settings[at.RUPTURE]) == at.GUEMBEL
    c = work.angle[at.COS, i]
    s = work.angle[at.SIN, i]
    middle = motion.vx * c + motion.vy * s
    end = motion.wx * c + motion.wy * s
    width = work.width[0, i]
    g = h = ZEROS
    for j in range(grid.axial.shape[1] - 1):
        zeta = grid.axial[at.ZETA, j]
        weight = width * grid.axial[at.WEIGHT, j] * work.growth[1, i, j]
        p = work.pressure[i, j] * (work.source[i, j] if guembel else 1.0)
        both = plus((c * p, s * p, zeta * c * p, zeta * s * p), scaled(middle + zeta * end, four(adjoint[i, j], 0)))
        g = plus(g, scaled(weight, both))
        h = plus(h, scaled(zeta * weight, both))
    return g, h


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
    """Return largest pressure and side flow of the last solution of ``journal_film`` in ``work``.

    The pressure is max Π, by parabolas through the largest node (P: times 12 η (R/c)²). The flow out of both ends is
    Σ ∫H³ |∂ζΠ| dφ (m³/s: times 2 c R³/L), computed from the discrete balance: flow through the last inner face plus the
    squeeze flow of the strip beyond the last node if the film reaches it. The flow therefore equals the volume that the
    whole film displaces. For a film that may draw oil in (full, guembel) only outflow counts.
    """
    p = work.pressure
    axial = grid.axial
    columns = p.shape[0]
    n = axial.shape[1] - 1
    vx, vy, wx, wy = four(work.squeeze, at.V_X)
    half = grid.settings[at.SIDES] > 1.5
    ruptures = int(grid.settings[at.RUPTURE]) == at.SWIFT_STIEBER
    best_i = 0
    best_j = 0
    highest = -1.0
    for i in range(columns):
        for j in range(n):
            # Next to an end, a film too thin for the axial step gives a pressure too large by weight over cell.
            value = p[i, j] * min(axial[at.CELL, j] / axial[at.WEIGHT, j], 1.0)
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
    strip = grid.settings[at.STRIP]
    for i in range(columns):
        c = work.angle[at.COS, i] * work.width[0, i]
        s = work.angle[at.SIN, i] * work.width[0, i]
        for end in range(1 if half else 2):
            last = n - 1 if end == 0 else 0
            out = work.conduct[1, i, n if end == 0 else 0] * p[i, last]
            if grid.blocked[i, last] == 0.0 and not (ruptures and p[i, last] == 0.0):
                side = 1.0 if end == 0 else -1.0
                out += strip * work.growth[0, i, last] * ((vx + side * wx) * c + (vy + side * wy) * s)
            flow += out if ruptures else max(out, 0.0)
    return highest, grid.settings[at.SIDES] * flow / work.squeeze[at.RATIO2]


@kernel
def film_shear(ex, ey, tx, ty):
    """Return the shear factor ½ ∫∫ h′/h dφ dζ of a film between smooth surfaces in a straight shell."""
    return shell_shear(Motion(ex, ey, tx, ty, 0.0, 0.0, 0.0, 0.0), _STRAIGHT, SMOOTH)


@kernel
def shell_shear(motion, shear, sigma):
    """Return the shear factor ½ ∫∫ h′/h dφ dζ of a filled gap, by Gauss' rule over the width.

    A slice without contact has ∫ h′/h dφ = 2π/√(1 − ε²). ``shear`` and ``sigma`` are those of a :class:`JournalGrid`.
    The torque of a filled film on the journal is −η R³ L (ω_j − ω_b)/c times this, less half of e × F + t × Q.
    """
    if motion.tx == 0.0 and motion.ty == 0.0 and shear[2, 0] == 0.0:
        return _circle_shear(1.0, motion.ex, motion.ey, sigma)
    total = 0.0
    for k in range(shear.shape[1]):
        zeta = shear[0, k]
        total += shear[1, k] * _circle_shear(
            1.0 + shear[2, k], motion.ex + zeta * motion.tx, motion.ey + zeta * motion.ty, sigma
        )
    return 0.5 * total


@kernel
def _circle_shear(clearance, x, y, sigma):
    """Return ∫ h′/h dφ of one slice at the eccentricity (x, y)."""
    e = math.sqrt(x * x + y * y)
    gap = clearance - e
    if gap < CLEAR * sigma:
        mean = mean_gap(gap, sigma)
        # This gap is chosen so that the formula matches the integral of touching slices within 10 %.
        gap = mean + 0.4 * (mean - gap)
    return 2.0 * math.pi / math.sqrt(gap * (clearance + e))


@kernel
def _rise(before, top, after):
    """Return the height of a parabola's vertex above ``top``, the middle one of three equidistant values."""
    bend = 2.0 * top - before - after
    return 0.125 * (after - before) * (after - before) / bend if bend > 0.0 else 0.0
