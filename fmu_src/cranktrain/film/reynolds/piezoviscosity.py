"""Reduced pressure, which includes a pressure-dependent viscosity without iterations of the film.

With η = η₀ f(p) and q = ∫₀ᵖ dp/f the Poiseuille flow reads h³/(12η) ∇p = h³/(12η₀) ∇q. So q obeys the equation of
constant viscosity with the same rupture (q ≥ 0 where p ≥ 0), whatever the law f, and p follows from q at each node.
If f grows fast, q has a limit (1/α for Barus' law f = exp αp); a rigid film that needs a larger q has no solution.
"""

from collections.abc import Callable

import numpy as np

from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.types import Array

Law = Callable[[Array], Array]
"""Function f(p) = η(p)/η(0) of an array of pressures (Pa), increasing from f(0) = 1."""
FACTOR_LIMIT = 1e12
"""Largest valid viscosity factor; beyond it the oil would be glass, or the law is outside its range."""
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(48)


def viscosity_factor(law: Law, pressure: Array) -> Array:
    """Return η/η₀ at ``pressure`` (Pa, any shape); ``SolverError`` if the law gives no valid factor."""
    with np.errstate(over="ignore"):
        factor = np.asarray(law(pressure), dtype=float)
    if factor.shape != pressure.shape:
        raise InputError(
            f"pressure_viscosity: {factor.shape} factors for {pressure.shape} pressures; give one for each"
        )
    if factor.size and not (factor.min() > 0.0 and factor.max() < FACTOR_LIMIT):
        raise SolverError(
            f"pressure_viscosity: the oil stiffens without bound at {pressure.max():.4g} Pa; "
            "the film is too thin for this law between rigid surfaces"
        )
    return factor


def reduced_pressure(law: Law, pressure: Array) -> Array:
    """Return ∫₀ᵖ dp/f, Pa, of each ``pressure`` (Pa), by Gauss' rule (error 1e-12 for Barus' law up to αp = 25)."""
    places = 0.5 * pressure[..., None] * (1.0 + POINTS)
    return np.asarray(0.5 * pressure * ((1.0 / viscosity_factor(law, places)) @ WEIGHTS))


def true_pressure(law: Law, reduced: Array) -> Array:
    """Return the pressure (Pa) whose reduced pressure is ``reduced``, by Newton's method from below."""
    pressure = reduced.copy()
    scale = float(np.abs(reduced).max(initial=1e-300))
    for _ in range(100):
        missing = reduced - reduced_pressure(law, pressure)
        step = missing * viscosity_factor(law, pressure)
        pressure += step
        # Close to the limit of q the pressure is sensitive to rounding.
        if not np.any((np.abs(step) >= 1e-12 * scale) & (np.abs(missing) > 1e-15 * np.abs(reduced))):
            return pressure
    raise SolverError("pressure_viscosity: no pressure found; the factor must grow steadily with pressure")
