r"""Effective temperature of a bearing film from its heat balance.

A fraction λ of the friction power heats the oil flow; the rest leaves through journal and housing:

    λ P(η) = ρ c_p Q(η) (T_out − T_in),      T_eff = T_in + κ (T_out − T_in),      η = η(T_eff)

P is the friction power and Q the oil flow. κ sets the temperature between inlet and outlet at which the film's
viscosity is evaluated (½, the mean, by default). Hotter oil is thinner and has less friction, so T_in + κ λ P/(ρ c_p Q)
− T falls with T if P/Q does not rise with temperature. It then has one zero. Secants find the zero within a shrinking
bracket; the bracket is halved if a secant would leave it.

Source: DIN 31652 (ISO 7902-1), heat balance of a bearing cooled by its oil.
"""

import math
from collections.abc import Callable

import numpy as np

from cranktrain.core.errors import InputError, SolverError
from cranktrain.engine.lubricant import viscosity
from cranktrain.engine.parts import Oil

MEAN = 0.5
"""Fraction of the oil's temperature rise at which the film's viscosity is evaluated."""
STEPS = 100
GAUSS = 12
"""Number of Gauss points of an integral over temperature."""
LARGEST_RISE = 100.0
"""Limit of the film temperature of a run above its supply, K; bearing metals and engine oils do not endure more."""


def effective_temperature(
    oil: Oil,
    inlet: float,
    friction_power: Callable[[float], float],
    flow: Callable[[float], float],
    place: float = MEAN,
) -> float:
    """Return the temperature at which the viscosity of the film satisfies the heat balance, K.

    Parameters
    ----------
    oil : oil with viscosity, density, heat capacity and ``heat_share``
    inlet : temperature of the supplied oil, K
    friction_power, flow : friction power (W) and oil flow (m³/s) of the bearing at a viscosity (Pa s)
    place : κ, position between inlet (0) and outlet (1) whose temperature gives the viscosity

    Returns
    -------
    T_eff, K; the residual of the fixed point is at most 1e-10 K (where friction or flow jump, T_eff is at the jump)

    Raises
    ------
    InputError
        if ``place`` is outside [0, 1], or friction is negative
    SolverError
        if no flow carries the heat, or no balance exists below 1000 K above the inlet
    """
    if not 0.0 <= place <= 1.0:
        raise InputError(f"heat balance: place {place:.4g} must lie between 0 (inlet) and 1 (outlet); the mean is 0.5")

    def surplus(temperature: float) -> float:
        """Return the film temperature that results from the heat at ``temperature``, minus ``temperature``, K."""
        eta = viscosity(oil, temperature)
        power, volume = friction_power(eta), flow(eta)
        if not power >= 0.0:
            raise InputError(f"heat balance: friction power {power:.4g} W at {temperature:.5g} K must not be negative")
        if power > 0.0 and not volume > 0.0:
            raise SolverError(
                f"heat balance: no oil flow ({volume:.4g} m^3/s) carries {power:.4g} W at {temperature:.5g} K; "
                f"raise the supply or give the film's temperature"
            )
        if power == 0.0:
            return inlet - temperature
        return inlet + place * oil.heat_share * power / (oil.density * oil.heat_capacity * volume) - temperature

    low, at_low = inlet, surplus(inlet)
    if at_low <= 0.0:
        return inlet
    # Oil with constant inlet viscosity would warm by ``at_low``, an upper bound that is often far beyond boiling.
    high, at_high = low, at_low
    while at_high > 0.0:
        high = min(high + max(min(at_low, 50.0), 1e-3), inlet + 1000.0)
        at_high = surplus(high)
        if at_high > 0.0:
            low, at_low = high, at_high
        if at_high > 0.0 and high >= inlet + 1000.0:
            raise SolverError("heat balance: the film would be more than 1000 K hotter than its supply; check the flow")
    if at_high == 0.0:
        return high
    return _zero(surplus, low, at_low, high, at_high)


def balanced_temperature(
    oil: Oil, inlet: float, temperature: float, power: float, flow: float, place: float = MEAN
) -> tuple[float, str]:
    """Return the balanced temperature of a bearing that ran at ``temperature``, K, and the active bound, if any.

    Only the run's mean friction ``power`` (W) and ``flow`` (m³/s) are known. For other viscosities the same orbit of
    the journal is assumed: friction is proportional to viscosity, and flow, which depends on eccentricity and speed, is
    unchanged. The true orbit for a given load changes with viscosity, so run and balance must be repeated; this
    converges to the heat balance.

    The film's temperature lies between the inlet temperature (no friction power) and ``LARGEST_RISE`` above it (the
    flow cannot carry the heat). The second result names the active bound, and is empty between the bounds.
    """
    if not power > 0.0:
        return inlet, "friction takes no power: as warm as its supply"
    eta, hottest = viscosity(oil, temperature), inlet + LARGEST_RISE
    heat = place * oil.heat_share * power / (oil.density * oil.heat_capacity)
    if heat * viscosity(oil, hottest) / eta >= LARGEST_RISE * flow:
        return hottest, f"{1e6 * flow:.3g} cm^3/s of oil cannot carry {power:.4g} W: bounded {LARGEST_RISE:g} K above"
    return effective_temperature(oil, inlet, lambda other: power * other / eta, lambda _: flow, place), ""


def adiabatic_temperature(oil: Oil, inlet: float, temperature: float, power: float, flow: float) -> tuple[float, str]:
    """Return the temperature of the mean viscosity of a film that keeps all its heat, K, and the active bound, if any.

    ``temperature``, ``power`` (W) and ``flow`` (m³/s) are those of a run, as in :func:`balanced_temperature`. Along a
    film of uniform gap dT/dx ~ η(T), so the mean viscosity over its length between inlet and outlet is

        η_m = (T_out − T_in)/∫ dT/η(T),      P η_m/η = ρ c_p Q (T_out − T_in),

    and the film's temperature has η(T) = η_m.
    """
    if not power > 0.0:
        return inlet, "friction takes no power: as warm as its supply"
    heat = power / (viscosity(oil, temperature) * oil.density * oil.heat_capacity)
    places, weights = np.polynomial.legendre.leggauss(GAUSS)

    def fluidity(rise: float) -> float:
        """Return ∫ dT/η over the temperature rise, K/(Pa s)."""
        warm = inlet + 0.5 * rise * (places + 1.0)
        return 0.5 * rise * float(sum(w / viscosity(oil, float(t)) for w, t in zip(weights, warm, strict=True)))

    # P η_m/η = ρ c_p Q ΔT is equivalent to flow · ∫ dT/η = heat, and the integral increases with ΔT.
    low, high = 0.0, 2.0 * LARGEST_RISE
    if flow * fluidity(high) <= heat:
        rise = high
    else:
        for _ in range(STEPS):
            rise = 0.5 * (low + high)
            low, high = (rise, high) if flow * fluidity(rise) < heat else (low, rise)
            if high - low <= 1e-10:
                break
    mean = rise / fluidity(rise)
    low, high = inlet, inlet + rise
    while high - low > 1e-10:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if viscosity(oil, middle) > mean else (low, middle)
        if middle in (low, high) and high - low <= 4.0 * math.ulp(high):
            break
    found = 0.5 * (low + high)
    if rise >= 2.0 * LARGEST_RISE or found > inlet + LARGEST_RISE:
        bound = f"{1e6 * flow:.3g} cm^3/s of oil cannot carry {power:.4g} W: bounded {LARGEST_RISE:g} K above"
        return min(found, inlet + LARGEST_RISE), bound
    return found, ""


def _zero(surplus: Callable[[float], float], low: float, at_low: float, high: float, at_high: float) -> float:
    """Find the zero of a function that is positive at ``low`` and negative at ``high``, by secants in a bracket."""
    older, at_older, newer, at_newer = low, at_low, high, at_high
    for _ in range(STEPS):
        slope = (at_newer - at_older) / (newer - older) if newer != older else 0.0
        trial = newer - at_newer / slope if slope < 0.0 else math.nan
        if not low < trial < high:
            trial = 0.5 * (low + high)
        value = surplus(trial)
        if abs(value) <= 1e-10 or high - low <= 4.0 * math.ulp(high):
            return trial
        if value > 0.0:
            low = trial
        else:
            high = trial
        older, at_older, newer, at_newer = newer, at_newer, trial, value
    raise SolverError(f"heat balance: no balance found between {low:.5g} and {high:.5g} K; check friction and flow")
