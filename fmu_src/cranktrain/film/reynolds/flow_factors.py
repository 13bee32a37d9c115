r"""Pressure and shear flow factors of Patir and Cheng for flow through a rough gap.

Roughness turns the Reynolds equation of the mean gap h into

    ∇·(φ_x h³/(12 η) ∇p) = ½ (U₁ + U₂) ∂h_T/∂x + ½ (U₁ − U₂) σ ∂φ_s/∂x + ∂h_T/∂t

with, over H = h/σ and the pattern γ (1 isotropic, > 1 stretched along the flow, < 1 across it),

    φ_x = 1 − C exp(−r H)  (γ ≤ 1),    1 + C H^{−r}  (γ > 1)
    Φ_s = A₁ H^{α₁} exp(−α₂ H + α₃ H²)  (H ≤ 5),    A₂ exp(−H/4)  (H > 5)

Across the flow φ_z(H, γ) = φ_x(H, 1/γ); two rough surfaces of one pattern have φ_s = (σ₁² − σ₂²)/σ² Φ_s. The published
tables give seven patterns between 1/9 and 9; between two of them the factors are weighted by ln γ. Below the published
range of H the pressure factor keeps its value at the edge. For H → ∞ φ_x → 1 and Φ_s → 0: the smooth film.

Sources: N. Patir, H. S. Cheng, J. Lubr. Technol. 100 (1978) 12 and 101 (1979) 220.
"""

import math

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import kernel
from cranktrain.core.types import Array

# Columns of PATTERNS: γ; C, r, least H of the pressure factor; A₁, α₁, α₂, α₃, A₂ of the shear factor; weight.
PATTERN, C, R, LEAST, A_1, ALPHA_1, ALPHA_2, ALPHA_3, A_2, WEIGHT = range(10)
PATTERNS = np.array(
    [
        [1 / 9, 1.480, 0.42, 1.00, 2.046, 1.12, 0.78, 0.03, 1.856],
        [1 / 6, 1.380, 0.42, 1.00, 1.962, 1.08, 0.77, 0.03, 1.754],
        [1 / 3, 1.180, 0.42, 0.75, 1.858, 1.01, 0.76, 0.03, 1.561],
        [1.000, 0.900, 0.56, 0.50, 1.899, 0.98, 0.92, 0.05, 1.126],
        [3.000, 0.225, 1.50, 0.50, 1.560, 0.85, 1.13, 0.08, 0.556],
        [6.000, 0.520, 1.50, 0.50, 1.290, 0.62, 1.09, 0.08, 0.388],
        [9.000, 0.870, 1.50, 0.50, 1.011, 0.54, 1.07, 0.08, 0.295],
    ]
)
SHEAR_RANGE = 5.0
"""Gap over roughness at which the shear flow factor changes from one formula to the other."""


def flow_factor_constants(pattern: float = 1.0) -> Array:
    """Return constants for :func:`pressure_flow_factor` and :func:`shear_flow_factor`, (2, 10).

    Each row holds one published pattern as in ``PATTERNS`` and its weight. Flow across the pattern needs 1/γ.

    Raises
    ------
    InputError
        if γ lies outside the published range 1/9 to 9
    """
    if not PATTERNS[0, 0] * (1 - 1e-12) <= pattern <= PATTERNS[-1, 0] * (1 + 1e-12):
        raise InputError(f"flow factors: pattern {pattern:.4g} lies outside the published 1/9 to 9; isotropic is 1")
    upper = min(max(int(np.searchsorted(PATTERNS[:, 0], pattern)), 1), len(PATTERNS) - 1)
    low, high = PATTERNS[upper - 1], PATTERNS[upper]
    share = min(max(math.log(pattern / low[0]) / math.log(high[0] / low[0]), 0.0), 1.0)
    return np.array([[*low, 1.0 - share], [*high, share]])


@kernel
def pressure_flow_factor(gap_ratio, constants):
    """Return the pressure flow factor φ_x and its derivative by H at H = ``gap_ratio``, the gap over roughness."""
    total = 0.0
    slope = 0.0
    for k in range(2):
        weight = constants[k, WEIGHT]
        if weight == 0.0:
            continue
        c = constants[k, C]
        r = constants[k, R]
        inside = gap_ratio > constants[k, LEAST]
        h = gap_ratio if inside else constants[k, LEAST]
        if constants[k, PATTERN] <= 1.0:
            part = -c * math.exp(-r * h)
            by = -r * part
        else:
            part = c * h ** (-r)
            by = -r * part / h
        total += weight * (1.0 + part)
        if inside:
            slope += weight * by
    return total, slope


@kernel
def shear_flow_factor(gap_ratio, constants):
    """Return the shear flow factor Φ_s of a rough surface against a smooth one, and its slope by H; zero for H ≤ 0."""
    if gap_ratio <= 0.0:
        return 0.0, 0.0
    total = 0.0
    slope = 0.0
    for k in range(2):
        weight = constants[k, WEIGHT]
        if weight == 0.0:
            continue
        if gap_ratio <= SHEAR_RANGE:
            alpha_1, alpha_2, alpha_3 = constants[k, ALPHA_1], constants[k, ALPHA_2], constants[k, ALPHA_3]
            part = constants[k, A_1] * gap_ratio**alpha_1
            part *= math.exp(-alpha_2 * gap_ratio + alpha_3 * gap_ratio * gap_ratio)
            by = part * (alpha_1 / gap_ratio - alpha_2 + 2.0 * alpha_3 * gap_ratio)
        else:
            part = constants[k, A_2] * math.exp(-0.25 * gap_ratio)
            by = -0.25 * part
        total += weight * part
        slope += weight * by
    return total, slope


@kernel
def mean_gap(gap_ratio):
    """Return the mean gap h_T/σ between Gaussian surfaces, overlap cut off, and its derivative by H."""
    tail = 0.5 * math.erfc(-gap_ratio / math.sqrt(2.0))
    return gap_ratio * tail + math.exp(-0.5 * gap_ratio * gap_ratio) / math.sqrt(2.0 * math.pi), tail
