r"""Contact pressure of rough surfaces after Greenwood and Tripp.

The combined asperity heights of both surfaces are Gaussian with standard deviation σ; η asperities per area have the
tip radius β. At a mean gap h the contact pressure and the fraction of area in real contact are

    p = (16 √2 π / 15) (ηβσ)² √(σ/β) E' F_{5/2}(h/σ),      A_real / A = π² (ηβσ)² √(σ/β) F_2(h/σ)

    F_n(H) = ∫_H^∞ (s − H)ⁿ exp(−s²/2) / √(2π) ds

A lining yields at its hardness p_H. The pressure approaches this limit as p → p/(1 + (p/p_H)³)^⅓. This form is smooth
and hardly changes light contact (0.3 % at a fifth of the hardness).

The integrals are computed exactly and stored as cubic splines of their logarithm over H (twice continuously
differentiable). Above H = 5 they fade out smoothly and vanish from H = 6 on, where the pressure would be some pascal at
most. They are valid for H < 0 too, which occurs in an overloaded film. Far below zero F_n(H) → |H|ⁿ; four terms of this
expansion are used.

Source: J. A. Greenwood, J. H. Tripp, The Contact of Two Nominally Flat Rough Surfaces, Proc. Inst. Mech. Eng. 185
(1970) 625.
"""

import math
from functools import cache

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import kernel
from cranktrain.core.spline import cubic, not_a_knot
from cranktrain.core.types import Array
from cranktrain.engine.parts import PlainBearing

HIGHEST = 6.0
"""Gap over roughness above which there is no contact."""
FADING = 5.0
"""Gap over roughness at which contact begins to fade out."""
LOWEST = -20.0
"""Gap over roughness below which the integrals are computed by their asymptotic series."""
GAP_STEP = 0.04
"""Spacing of the tables of contact integrals in H, the gap over roughness."""
SMOOTH_SPEED = 0.01
"""Sliding speed (m/s) of the smooth transition in which boundary friction changes its sign."""
TABLE_TOP = 14.0
"""Largest H of the table of integrals; resultants of a bearing slice at HIGHEST need values beyond HIGHEST."""

# Indices of the constants of one rough contact.
SIGMA, PRESSURE, AREA, FRICTION, SHEAR, PER_HARDNESS, CONSTANTS = range(7)


def greenwood_tripp_integral(power: float, gap_ratio: Array | float) -> Array:
    """Return F_n(H) of Greenwood and Tripp to a relative accuracy of 1e-11, in the shape of ``gap_ratio``.

    n = ``power`` is a multiple of ½. With s − H = u² the integral becomes ∫ |u|^{2n+1} φ(u² + H) du from −∞ to ∞. The
    trapezoidal rule converges exponentially if 2n + 1 is even; integer powers use Gauss's rule over u ≥ 0.
    """
    gap = np.asarray(gap_ratio, dtype=float)[..., None]
    top = np.sqrt(9.0 - np.minimum(gap, 0.0))  # beyond this u, φ(u² + H) has fallen by exp(−40)
    if float(2 * power + 1) % 2.0 == 0.0:
        places, weights = np.linspace(0.0, 1.0, 601), np.full(601, 2.0 / 600.0)
    else:
        places, weights = np.polynomial.legendre.leggauss(150)
        places = 0.5 * (places + 1.0)
    u = top * places
    # For large H the factor φ(H) is taken out of the integral to avoid underflow.
    tail = np.maximum(gap, 0.0)
    integrand = u ** (2.0 * power + 1.0) * np.exp(-0.5 * ((u * u + gap) ** 2 - tail**2))
    total = np.sum(top * weights * integrand, axis=-1)
    return np.asarray(total * np.exp(-0.5 * tail[..., 0] ** 2) / math.sqrt(2.0 * math.pi))


def log_spline(values: Array) -> Array:
    """Return B-spline coefficients (n + 2, k) of ln ``values`` (n, k) on an even grid, not-a-knot at both ends."""
    n = len(values)
    right = np.concatenate([np.log(values), np.zeros((2, values.shape[1]))])
    return np.ascontiguousarray(np.linalg.solve(not_a_knot(n), right))


def contact_table() -> Array:
    """Return spline coefficients (n, 2) of ln F_{5/2} and ln F_2 for :func:`contact_pressure`, for any surface."""
    return _contact_table().copy()


@cache
def _contact_table() -> Array:
    n = round((TABLE_TOP - LOWEST) / GAP_STEP) + 1
    gaps: Array = LOWEST + GAP_STEP * np.arange(n, dtype=np.float64)
    return log_spline(np.stack([greenwood_tripp_integral(2.5, gaps), greenwood_tripp_integral(2.0, gaps)], axis=1))


def contact_constants(
    roughness: float,
    asperity_factor: float,
    asperity_ratio: float,
    contact_modulus: float,
    boundary_friction: float = 0.0,
    boundary_shear: float = 0.0,
    hardness: float = math.inf,
) -> Array:
    """Return the constants of one rough contact: σ, factors of pressure and area before the integrals, μ, τ₀, hardness.

    Parameters
    ----------
    roughness : combined σ of both surfaces, m
    asperity_factor : ηβσ
    asperity_ratio : σ/β
    contact_modulus : E' = 1/((1 − ν₁²)/E₁ + (1 − ν₂²)/E₂), Pa
    boundary_friction : coefficient μ on the contact pressure
    boundary_shear : shear stress τ₀ on the real contact area, Pa

    Raises
    ------
    InputError
        if a value is not positive, or friction is negative
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
    if not hardness > 0.0:
        raise InputError(f"asperity contact: hardness {hardness:.4g} Pa must be positive; linings have 100 to 600 MPa")
    shape = asperity_factor**2 * math.sqrt(asperity_ratio)
    pressure = 16.0 * math.sqrt(2.0) * math.pi / 15.0 * shape * contact_modulus
    return np.array([roughness, pressure, math.pi**2 * shape, boundary_friction, boundary_shear, 1.0 / hardness])


def bearing_contact_constants(bearing: PlainBearing) -> Array:
    """Return :func:`contact_constants` of the surfaces of ``bearing``, (CONSTANTS,)."""
    return contact_constants(
        bearing.roughness,
        bearing.asperity_factor,
        bearing.asperity_ratio,
        bearing.contact_modulus,
        bearing.boundary_friction,
        bearing.boundary_shear,
        bearing.hardness,
    )


# Kernels -------------------------------------------------------------------------------------------------------------


@kernel
def fading(gap_ratio):
    """Return the weight, smooth to second order, that fades contact out from FADING to HIGHEST, and its slope."""
    if gap_ratio <= FADING:
        return 1.0, 0.0
    if gap_ratio >= HIGHEST:
        return 0.0, 0.0
    t = (HIGHEST - gap_ratio) / (HIGHEST - FADING)
    weight = t * t * t * (10.0 - t * (15.0 - 6.0 * t))
    slope = 30.0 * t * t * (1.0 - t) * (1.0 - t)
    return weight, -slope / (HIGHEST - FADING)


@kernel
def spline_place(gap_ratio, n):
    """Return the table interval of a gap and the position in it, clamped to a table of ``n`` coefficients."""
    y = (gap_ratio - LOWEST) / GAP_STEP
    i = int(y)
    if i < 0:
        i = 0
    if i > n - 4:
        i = n - 4
    return i, y - i


@kernel
def spline_value(table, column, i, t):
    """Return the spline value of one table column and its derivative by H."""
    b0, b1, b2, b3, d0, d1, d2, d3 = cubic(t, 1.0)
    c0 = table[i, column]
    c1 = table[i + 1, column]
    c2 = table[i + 2, column]
    c3 = table[i + 3, column]
    return b0 * c0 + b1 * c1 + b2 * c2 + b3 * c3, (d0 * c0 + d1 * c1 + d2 * c2 + d3 * c3) / GAP_STEP


@kernel
def contact_integrals(gap_ratio, table, faded):
    """Return F_{5/2}, its derivative by H, and F_2 at H = ``gap_ratio``; if ``faded``, zero above HIGHEST."""
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
    i, t = spline_place(gap_ratio, table.shape[0])
    value, slope = spline_value(table, 0, i, t)
    area, _ = spline_value(table, 1, i, t)
    f = math.exp(value)
    slope *= f
    f2 = math.exp(area)
    if faded and gap_ratio > FADING:
        weight, by_gap = fading(gap_ratio)
        slope = slope * weight + f * by_gap
        f *= weight
        f2 *= weight
    return f, slope, f2


@kernel
def contact_pressure(h, constants, table):
    """Return contact pressure p (Pa), dp/dh (Pa/m) and fraction of area in real contact at the mean gap ``h`` (m)."""
    gap_ratio = h / constants[SIGMA]
    if gap_ratio >= HIGHEST:
        return 0.0, 0.0, 0.0
    f, slope, f2 = contact_integrals(gap_ratio, table, True)
    share = constants[AREA] * f2
    p, yields = yielding(constants[PRESSURE] * f, constants[PER_HARDNESS])
    return p, yields * constants[PRESSURE] / constants[SIGMA] * slope, share if share < 1.0 else 1.0


@kernel
def yielding(pressure, per_hardness):
    """Limit an elastic ``pressure`` by the hardness 1/``per_hardness``. Return the limited pressure and its slope."""
    ratio = pressure * per_hardness
    both = 1.0 + ratio * ratio * ratio
    share = both ** (-1.0 / 3.0)
    return pressure * share, share / both
