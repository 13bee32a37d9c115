"""Range of possible tilts of a film table.

A journal tilted by a along its line of centres has the gap 1 + g(ζ) − ε − ζ a on this line. The largest possible tilt
a_max(ε) is that whose least gap is one roughness below zero. In a straight shell the journal's end then lies at
ρ = ε + a_max = 1 + σ; a relieved shell allows more tilt at a small eccentricity. For any tilt (a, b) the end may lie
within the circle of radius ρ(ε). ρ is approximated by a polynomial, and the table is made for this polynomial.
"""

from functools import cache

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.film.contact.gap import least_gap

DEGREE = 4
TERMS = DEGREE + 1
DEEPEST = 1.0
"""Overlap of the surfaces at the largest possible tilt, over the roughness; chosen above that in a running engine."""
_SAMPLES, _HALVINGS = 60, 50


@cache
def reach_terms(profile: tuple[float, float, float], roughness: float, top: float) -> tuple[float, ...]:
    """Return coefficients of ρ(ε) from ε⁰ on, for ε up to ``top``; profile and roughness are over the clearance."""
    eccentricities = np.linspace(0.0, top, _SAMPLES)
    ends = []
    for eps in eccentricities:
        low, high = 0.0, 3.0
        for _ in range(_HALVINGS):
            a = 0.5 * (low + high)
            gap, _ = least_gap((eps, 0.0, a, 0.0), 1.0, profile)
            low, high = (a, high) if gap > -DEEPEST * roughness else (low, a)
        ends.append(eps + low)
    fitted = np.polynomial.Polynomial.fit(eccentricities, np.array(ends), DEGREE).convert().coef
    terms = np.zeros(TERMS)
    terms[: len(fitted)] = fitted
    return tuple(float(f"{term:.9g}") for term in terms)


@kernel
def reach(eps, terms):
    """Return ρ² and half its slope by ε; ``terms`` start with the coefficients of :func:`reach_terms`."""
    value = 0.0
    slope = 0.0
    for k in range(DEGREE, -1, -1):
        slope = slope * eps + value
        value = value * eps + terms[k]
    return value * value, value * slope
