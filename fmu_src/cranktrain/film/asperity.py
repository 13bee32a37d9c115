r"""Rough surfaces that touch: contact pressure after Greenwood and Tripp, its resultant in a tilted journal bearing.

Asperity heights of both surfaces together are Gaussian with standard deviation σ; η asperities per area have the tip
radius β. Over a mean gap h the surfaces press and touch with

    p = (16 √2 π / 15) (ηβσ)² √(σ/β) E' F_{5/2}(h/σ),      A_real / A = π² (ηβσ)² √(σ/β) F_2(h/σ)

    F_n(H) = ∫_H^∞ (s − H)ⁿ exp(−s²/2) / √(2π) ds

The integrals are taken exactly and kept as cubic splines of their logarithm over H (twice continuously differentiable).
Above H = 5 they fade out smoothly and vanish from H = 6 on, where the pressure would be some pascal at most. They hold
for H < 0 too: an overloaded film goes there. Far below zero F_n(H) → |H|ⁿ, of which four terms are taken.

In a bearing every slice z of the film sees a circular gap c − e cos φ, so that its normal force per width

    N(e) = R ∫ p(c − e cos φ) cos φ dφ

depends on its eccentricity e = |(x + aζ, y + bζ)| alone, (a, b) being the displacement by tilt at the end ζ = 1. N, the
load ∫ p R dφ and the touching length are sampled once per bearing and kept in the same way; slices are then summed by
Gauss's rule over the parts of the width that touch. Pressed in deeper than 20 σ, N goes on as the cube of the depth.
Boundary friction opposes sliding with the shear stress τ₀ on the real contact and the coefficient μ on the pressure; it
acts on the journal as a torque and as a force across the line of centres.

Source: J. A. Greenwood, J. H. Tripp, The Contact of Two Nominally Flat Rough Surfaces, Proc. Inst. Mech. Eng. 185
(1970) 625.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.errors import InputError
from cranktrain.kernel import kernel

Array = NDArray[np.float64]

HIGHEST = 6.0
"""Gap over roughness from which on the surfaces do not touch."""
FADING = 5.0
"""Gap over roughness at which contact begins to fade out."""
LOWEST = -20.0
"""Gap over roughness below which the integrals follow their asymptotic series."""
GAP_STEP = 0.04
"""Spacing of the tables over H."""
SLICES = 12
"""Gauss points on each part of the width that touches."""
SMOOTH_SPEED = 0.01
"""Sliding speed, m/s, within which boundary friction changes its sign."""

TABLE_TOP = 14.0
"""End of the table of the integrals; the resultants of a slice at HIGHEST still need what lies beyond it."""

# Constants of one rough contact, and of the journal bearing it belongs to.
SIGMA, PRESSURE, AREA, FRICTION, SHEAR, RADIUS, CLEARANCE, WIDTH = 0, 1, 2, 3, 4, 5, 6, 7
# What journal_contact writes.
FORCE, STIFFNESS, TORQUE, TORQUE_BY_SLIDING, LOAD, TOUCHING, PRESSURE_MAX = 0, 4, 20, 21, 22, 23, 24
N_OUT = 25


class JournalContact(NamedTuple):
    """Rough contact of one journal bearing: the arrays that :func:`journal_contact` takes.

    ``constants`` (8,) are those of :func:`contact_constants` with radius, clearance and width (m), ``table`` the
    integrals of :func:`contact_table`, ``slices`` (n, 4) spline coefficients of the logarithms of N, ∫ p R dφ (N/m),
    touching length ∫ s R dφ and ∫ s cos φ R dφ (m; s the share of the area that touches) over (c − e)/σ, ``gauss``
    (2, SLICES) points and weights.
    """

    constants: Array
    table: Array
    slices: Array
    gauss: Array


def greenwood_tripp_integral(power: float, gap_ratio: Array | float) -> Array:
    """F_n(H) of Greenwood and Tripp to about 1e-11 of itself, shaped as ``gap_ratio``; n = ``power``, in halves.

    With s − H = u² the integral becomes ∫ |u|^{2n+1} φ(u² + H) du from −∞ to ∞. The trapezoidal rule converges
    exponentially where 2n + 1 is even; whole powers follow from Gauss's rule over u ≥ 0.
    """
    gap = np.asarray(gap_ratio, dtype=float)[..., None]
    top = np.sqrt(9.0 - np.minimum(gap, 0.0))  # φ(u² + H) has fallen by exp(−40) beyond
    if float(2 * power + 1) % 2.0 == 0.0:
        places, weights = np.linspace(0.0, 1.0, 601), np.full(601, 2.0 / 600.0)
    else:
        places, weights = np.polynomial.legendre.leggauss(150)
        places = 0.5 * (places + 1.0)
    u = top * places
    # φ(H) stands in front where the tail is thin, so that nothing underflows.
    tail = np.maximum(gap, 0.0)
    integrand = u ** (2.0 * power + 1.0) * np.exp(-0.5 * ((u * u + gap) ** 2 - tail**2))
    total = np.sum(top * weights * integrand, axis=-1)
    return np.asarray(total * np.exp(-0.5 * tail[..., 0] ** 2) / math.sqrt(2.0 * math.pi))


def _log_spline(values: Array) -> Array:
    """B-spline coefficients (n + 2, k) of ln ``values`` (n, k) on an even grid, not-a-knot at both ends."""
    n = len(values)
    rows = np.zeros((n + 2, n + 2))
    for i in range(n):
        rows[i, i : i + 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0]
    jump = np.array([1.0, -4.0, 6.0, -4.0, 1.0])
    rows[n, :5] = jump
    rows[n + 1, -5:] = jump
    right = np.concatenate([np.log(values), np.zeros((2, values.shape[1]))])
    return np.ascontiguousarray(np.linalg.solve(rows, right))


def contact_table() -> Array:
    """Spline coefficients (n, 2) of ln F_{5/2} and ln F_2 for :func:`contact_pressure`; the same for every surface."""
    n = round((TABLE_TOP - LOWEST) / GAP_STEP) + 1
    gaps: Array = LOWEST + GAP_STEP * np.arange(n, dtype=np.float64)
    return _log_spline(np.stack([greenwood_tripp_integral(2.5, gaps), greenwood_tripp_integral(2.0, gaps)], axis=1))


def contact_constants(
    roughness: float,
    asperity_factor: float,
    asperity_ratio: float,
    contact_modulus: float,
    boundary_friction: float = 0.0,
    boundary_shear: float = 0.0,
) -> Array:
    """Constants of one rough contact, (5,): σ, pressure and area in front of the integrals, μ, τ₀.

    Parameters
    ----------
    roughness : σ of both surfaces together, m
    asperity_factor : ηβσ
    asperity_ratio : σ/β
    contact_modulus : E' = 1/((1 − ν₁²)/E₁ + (1 − ν₂²)/E₂), Pa
    boundary_friction : μ on the contact pressure
    boundary_shear : τ₀ on the real contact, Pa

    Raises
    ------
    InputError
        a value that is not positive, or negative friction
    """
    for name, value in (
        ("roughness", roughness),
        ("asperity factor", asperity_factor),
        ("asperity ratio", asperity_ratio),
        ("contact modulus", contact_modulus),
    ):
        if not 0.0 < value < math.inf:
            raise InputError(f"asperity contact: {name} {value:.4g} must be positive; e.g. 0.4 um, 0.05, 0.01, 60 GPa")
    for name, value in (("boundary friction", boundary_friction), ("boundary shear", boundary_shear)):
        if not 0.0 <= value < math.inf:
            raise InputError(f"asperity contact: {name} {value:.4g} must not be negative; 0 leaves it out")
    shape = asperity_factor**2 * math.sqrt(asperity_ratio)
    pressure = 16.0 * math.sqrt(2.0) * math.pi / 15.0 * shape * contact_modulus
    return np.array([roughness, pressure, math.pi**2 * shape, boundary_friction, boundary_shear])


def journal_contact_data(
    radius: float, clearance: float, width: float, constants: Array, table: Array | None = None
) -> JournalContact:
    """Sample the resultants of a slice over its eccentricity, once per bearing.

    Parameters
    ----------
    radius, clearance, width : of the bearing, m
    constants : of :func:`contact_constants`
    table : of :func:`contact_table`, made here where not given

    Raises
    ------
    InputError
        a clearance that the roughness of both surfaces bridges
    """
    sigma = float(constants[SIGMA])
    if not clearance > HIGHEST * sigma:
        raise InputError(
            f"asperity contact: clearance {1e6 * clearance:.4g} um is not wider than {HIGHEST:g} times the roughness, "
            f"{1e6 * HIGHEST * sigma:.4g} um; check both units"
        )
    table = contact_table() if table is None else table
    points, weights = np.polynomial.legendre.leggauss(200)
    values = np.empty((round((HIGHEST - LOWEST) / GAP_STEP) + 1, 4))
    of_bearing = np.concatenate([constants, [radius, clearance, width]])
    _sample_slices(of_bearing, table, points, weights, values)
    return JournalContact(of_bearing, table, _log_spline(values), np.array(np.polynomial.legendre.leggauss(SLICES)))


# Kernels -------------------------------------------------------------------------------------------------------------


@kernel
def _fading(gap_ratio):
    """Weight that takes contact to zero from FADING to HIGHEST, and its slope; twice continuously differentiable."""
    if gap_ratio <= FADING:
        return 1.0, 0.0
    if gap_ratio >= HIGHEST:
        return 0.0, 0.0
    t = (HIGHEST - gap_ratio) / (HIGHEST - FADING)
    weight = t * t * t * (10.0 - t * (15.0 - 6.0 * t))
    slope = 30.0 * t * t * (1.0 - t) * (1.0 - t)
    return weight, -slope / (HIGHEST - FADING)


@kernel
def _spline_place(gap_ratio, n):
    """Interval of the table and place in it, clamped to the table of ``n`` coefficients."""
    y = (gap_ratio - LOWEST) / GAP_STEP
    i = int(y)
    if i < 0:
        i = 0
    if i > n - 4:
        i = n - 4
    return i, y - i


@kernel
def _spline(table, column, i, t):
    """Value of one column and its derivative by H."""
    r = 1.0 - t
    b0 = r * r * r / 6.0
    b3 = t * t * t / 6.0
    b1 = (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0
    b2 = 1.0 - b0 - b1 - b3
    d0 = -0.5 * r * r
    d3 = 0.5 * t * t
    d1 = t * (1.5 * t - 2.0)
    d2 = -d0 - d1 - d3
    c0 = table[i, column]
    c1 = table[i + 1, column]
    c2 = table[i + 2, column]
    c3 = table[i + 3, column]
    return b0 * c0 + b1 * c1 + b2 * c2 + b3 * c3, (d0 * c0 + d1 * c1 + d2 * c2 + d3 * c3) / GAP_STEP


@kernel
def contact_integrals(gap_ratio, table, faded):
    """F_{5/2}, its derivative by H, and F_2 at H = ``gap_ratio``; with ``faded`` they vanish from HIGHEST on."""
    if gap_ratio < LOWEST:
        # F_n(−x) = x^n Σ_k binomial(n, 2k) (2k − 1)!! x^{−2k}
        x = -gap_ratio
        q = 1.0 / (x * x)
        root = math.sqrt(x)
        f = x * x * root * (1.0 + q * (1.875 - q * (0.1171875 + q * 0.0732421875)))
        slope = -x * root * (2.5 - q * (-0.9375 - q * (0.17578125 + q * 0.25634765625)))
        return f, slope, x * x + 1.0
    if faded and gap_ratio >= HIGHEST:
        return 0.0, 0.0, 0.0
    i, t = _spline_place(gap_ratio, table.shape[0])
    value, slope = _spline(table, 0, i, t)
    area, _ = _spline(table, 1, i, t)
    f = math.exp(value)
    slope *= f
    f2 = math.exp(area)
    if faded and gap_ratio > FADING:
        weight, by_gap = _fading(gap_ratio)
        slope = slope * weight + f * by_gap
        f *= weight
        f2 *= weight
    return f, slope, f2


@kernel
def contact_pressure(h, constants, table):
    """Contact pressure over the mean gap ``h`` (m): p (Pa), dp/dh (Pa/m), share of the area that truly touches."""
    gap_ratio = h / constants[SIGMA]
    if gap_ratio >= HIGHEST:
        return 0.0, 0.0, 0.0
    f, slope, f2 = contact_integrals(gap_ratio, table, True)
    share = constants[AREA] * f2
    return constants[PRESSURE] * f, constants[PRESSURE] / constants[SIGMA] * slope, share if share < 1.0 else 1.0


@kernel
def _sample_slices(constants, table, points, weights, values):
    """Resultants of a slice on the grid of (c − e)/σ, (n, 4); contact is not faded here but by :func:`_slice`."""
    sigma = constants[SIGMA]
    radius = constants[RADIUS]
    for k in range(values.shape[0]):
        least = LOWEST + GAP_STEP * k
        eccentricity = constants[CLEARANCE] - least * sigma
        top = (least if least > 0.0 else 0.0) + TABLE_TOP - HIGHEST
        # Gap over roughness: least + (e/σ)(1 − cos φ).
        cos_end = 1.0 - (top - least) * sigma / eccentricity
        end = math.acos(cos_end if cos_end > -1.0 else -1.0)
        for m in range(4):
            values[k, m] = 0.0
        for i in range(points.shape[0]):
            # Both sides of the line of centres.
            phi = 0.5 * end * (points[i] + 1.0)
            weight = end * weights[i] * radius
            half = math.sin(0.5 * phi)
            f, _, f2 = contact_integrals(least + 2.0 * eccentricity / sigma * half * half, table, False)
            share = constants[AREA] * f2
            share = share if share < 1.0 else 1.0
            cos = math.cos(phi)
            values[k, 0] += weight * constants[PRESSURE] * f * cos
            values[k, 1] += weight * constants[PRESSURE] * f
            values[k, 2] += weight * share
            values[k, 3] += weight * share * cos


@kernel
def _slice(gap_ratio, slices, column):
    """One resultant of a slice and its derivative by (c − e)/σ."""
    if gap_ratio >= HIGHEST:
        return 0.0, 0.0
    n = slices.shape[0]
    if gap_ratio < LOWEST:
        value, slope = _spline(slices, column, 0, 0.0)
        # (1 + x)³ continues value and slope.
        depth = 1.0 + slope / 3.0 * (gap_ratio - LOWEST)
        value = math.exp(value)
        return value * depth * depth * depth, value * slope * depth * depth
    i, t = _spline_place(gap_ratio, n)
    value, slope = _spline(slices, column, i, t)
    value = math.exp(value)
    slope *= value
    if gap_ratio > FADING:
        weight, by_gap = _fading(gap_ratio)
        slope = slope * weight + value * by_gap
        value *= weight
    return value, slope


@kernel
def journal_contact(x, y, a, b, sliding, constants, table, slices, gauss, out):
    """Contact in the whole film of a journal at (x, y), tilted by (a, b) at its end ζ = 1 (m), in any axes.

    ``sliding`` is the journal's surface speed against the bore's (m/s, + in the sense of rotation); 0 leaves friction
    out. The other arguments are those of :class:`JournalContact`.

    Fills ``out`` (25,): [0:4] forces on the journal (F_x, F_y, Q_x, Q_y), Q = ∫ ζ dF conjugate to the displacement of
    the end (all N); [4:20] their derivatives by (x, y, a, b), row-major (N/m); [20] friction torque on it (N m,
    + in the sense of rotation), [21] its derivative by ``sliding`` (N s); [22] load ∫ p dA (N); [23] area that truly
    touches (m²); [24] largest contact pressure (Pa).
    """
    for k in range(N_OUT):
        out[k] = 0.0
    sigma = constants[SIGMA]
    c = constants[CLEARANCE]
    reach = c - HIGHEST * sigma
    tilt2 = a * a + b * b
    cross = x * a + y * b
    e2 = x * x + y * y
    end2 = e2 + tilt2 + 2.0 * abs(cross)
    if end2 <= reach * reach:
        return
    out[PRESSURE_MAX] = contact_pressure(c - math.sqrt(end2), constants, table)[0]
    speed = math.sqrt(sliding * sliding + SMOOTH_SPEED * SMOOTH_SPEED)
    sign = sliding / speed
    mu = constants[FRICTION] * sign
    tau = constants[SHEAR] * sign
    # Each side of the place nearest to the centre touches, if at all, from some ζ to its end.
    middle = 1.0
    near = 1.0
    far = 1.0
    if tilt2 > 1.0e-18 * c * c:
        middle = -cross / tilt2
        middle = -1.0 if middle < -1.0 else (1.0 if middle > 1.0 else middle)
        near = middle
        far = middle
        root = cross * cross - tilt2 * (e2 - reach * reach)
        if root > 0.0:
            root = math.sqrt(root)
            near = min(middle, (-cross - root) / tilt2)
            far = max(middle, (-cross + root) / tilt2)
    friction = 0.0
    for side in range(2):
        begin = -1.0 if side == 0 else far
        end = near if side == 0 else 1.0
        if end <= begin:
            continue
        for i in range(gauss.shape[1]):
            zeta = begin + 0.5 * (end - begin) * (gauss[0, i] + 1.0)
            # dz = ½ L dζ
            weight = 0.25 * constants[WIDTH] * (end - begin) * gauss[1, i]
            ux = x + a * zeta
            uy = y + b * zeta
            e = math.sqrt(ux * ux + uy * uy)
            gap_ratio = (c - e) / sigma
            if gap_ratio >= HIGHEST:
                continue
            nx = ux / e
            ny = uy / e
            normal, slope = _slice(gap_ratio, slices, 0)
            load, _ = _slice(gap_ratio, slices, 1)
            touching, _ = _slice(gap_ratio, slices, 2)
            normal *= weight
            slope *= -weight / sigma
            across = mu * normal
            across_slope = mu * slope
            if tau != 0.0:
                shear, shear_slope = _slice(gap_ratio, slices, 3)
                across += tau * weight * shear
                across_slope -= tau * weight / sigma * shear_slope
            out[LOAD] += weight * load
            out[TOUCHING] += weight * touching
            friction += weight * (constants[FRICTION] * load + constants[SHEAR] * touching)
            # f = −N n − T t with t across the line of centres, in the sense of rotation.
            fx = -normal * nx + across * ny
            fy = -normal * ny - across * nx
            # By a radial and by a tangential displacement of the slice.
            rx = -slope * nx + across_slope * ny
            ry = -slope * ny - across_slope * nx
            tx = (normal * ny + across * nx) / e
            ty = (-normal * nx + across * ny) / e
            k_xx = rx * nx - tx * ny
            k_xy = rx * ny + tx * nx
            k_yx = ry * nx - ty * ny
            k_yy = ry * ny + ty * nx
            out[0] += fx
            out[1] += fy
            out[2] += zeta * fx
            out[3] += zeta * fy
            for row in range(2):
                for column in range(2):
                    by = zeta if row != column else (zeta * zeta if row == 1 else 1.0)
                    place = STIFFNESS + 8 * row + 2 * column
                    out[place] += by * k_xx
                    out[place + 1] += by * k_xy
                    out[place + 4] += by * k_yx
                    out[place + 5] += by * k_yy
    out[TORQUE] = -sign * constants[RADIUS] * friction
    out[TORQUE_BY_SLIDING] = -constants[RADIUS] * friction * SMOOTH_SPEED * SMOOTH_SPEED / (speed * speed * speed)
