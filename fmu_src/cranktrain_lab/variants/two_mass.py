"""Closed-form two-mass model: a main mass on a spring under a harmonic force, with a damper mass attached.

With the frequency g of the force and f of the damper alone, both over that of the main mass alone, μ = damper over main
mass, and ζ = c/(2 m ω), m the damper mass and ω the frequency of the main mass alone, the main mass moves by

    (x/x_static)² = [(2ζg)² + (g² − f²)²] / [(2ζg)² (g² − 1 + μg²)² + (μf²g² − (g² − 1)(g² − f²))²]

Masses may be inertias. f = 0 is Houdaille's damper, a ring in a fluid (its optimum is usually given as c/(2 M ω) = μζ,
with the main mass M). The largest amplitude is exact: its frequency is a root of the polynomial N'D − ND' in g².

Source: J. P. Den Hartog, Mechanical Vibrations (1956), section 3.3, equation 3.24.
"""

from collections.abc import Mapping

import numpy as np
from numpy.polynomial import Polynomial

from cranktrain.core.errors import InputError

VALUES = {"inertia_ratio": 0.1, "frequency_ratio": 1.0 / 1.1, "damping_ratio": 0.1678, "force_frequency": 1.0}
"""Default values of the two-mass model: Den Hartog's optimal damper for an inertia ratio of 0.1."""
AMPLITUDE, AMPLIFICATION, AT = OUTPUTS = ("amplitude", "amplification", "peak_frequency")
"""Outputs, all ratios: amplitude at ``force_frequency``, largest amplitude over all frequencies, and its frequency."""


def two_mass_answer(values: Mapping[str, float]) -> dict[str, float]:
    """Return the two-mass model's outputs by name; raises ``InputError`` for impossible values."""
    known = {**VALUES, **values}
    mu, f, zeta, g = (known[name] for name in VALUES)
    if not (mu > 0.0 and f >= 0.0 and zeta > 0.0 and g > 0.0):
        raise InputError("two masses need an inertia_ratio, damping_ratio and force_frequency above 0")
    above, below = _squares(mu, f, zeta)
    turns = (above.deriv() * below - above * below.deriv()).roots()
    # Rounding moves double roots off the real axis. A false root is harmless: it is lower than the highest peak.
    real = turns.real[turns.real > 0.0]
    sizes = np.sqrt(above(real) / below(real))
    at = int(np.argmax(sizes)) if real.size else -1
    return {
        AMPLITUDE: float(np.sqrt(above(g * g) / below(g * g))),
        AMPLIFICATION: max(float(sizes[at]), 1.0) if real.size else 1.0,
        AT: float(np.sqrt(real[at])) if real.size else 0.0,
    }


def _squares(mu: float, f: float, zeta: float) -> tuple[Polynomial, Polynomial]:
    """Return numerator and denominator of the squared amplitude as polynomials of x = g²."""
    x = Polynomial([0.0, 1.0])
    fluid, own = 4.0 * zeta**2 * x, x - f**2
    if f == 0.0:  # all terms of both polynomials have a common factor x
        return 4.0 * zeta**2 + x, 4.0 * zeta**2 * (x - 1.0 + mu * x) ** 2 + x * (x - 1.0) ** 2
    return fluid + own**2, fluid * (x - 1.0 + mu * x) ** 2 + (mu * f**2 * x - (x - 1.0) * own) ** 2
