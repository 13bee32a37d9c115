"""Checks of an oil's constants and of the viscosity that they give."""

import math
from functools import partial

from cranktrain.engine.parts import Oil
from cranktrain.engine.quantities import ZERO_CELSIUS, need, need_table

OIL_VISCOSITIES = (1e-5, 100.0)
"""Smallest and largest plausible viscosity, Pa s, over the oil temperatures of an engine."""


def check_oil(oil: Oil) -> None:
    """Raise ``InputError`` (starting with ``oil.key``) for an oil whose law lacks constants."""
    of, warm, cold = partial(need, "oil"), oil.walther_temperatures, oil.walther_viscosities
    need_table("oil", oil)
    if oil.law == "vogel":
        for key in ("vogel_a", "vogel_b", "vogel_c"):
            of(key, getattr(oil, key) > 0.0, "is missing; law vogel needs vogel_a, vogel_b and vogel_c")
        of("vogel_c", oil.vogel_c < min(oil.temperatures), "must lie below every oil temperature")
    if warm or cold or oil.law == "walther":
        text = f"{len(cold)} viscosities at {len(warm)} walther_temperatures; Walther's law takes two points"
        of("walther_viscosities", len(warm) == len(cold) == 2, text)
        text = "temperatures must increase and viscosities decrease from point to point"
        of("walther_viscosities", warm[0] < warm[1] and cold[0] > cold[1], text)
    for temperature in oil.temperatures:
        low, high = (1e3 * end for end in OIL_VISCOSITIES)
        thick, warmth = 1e3 * thickness(oil, temperature), temperature - ZERO_CELSIUS
        text = f"{oil.law} gives {thick:.4g} mPa s at {warmth:.4g} degC, not {low:g} to {high:g}; check its constants"
        of("law", low <= thick <= high, text)
    text = f"is missing; pressure_law {oil.pressure_law} needs it, mineral oils have 15 to 25 1/GPa"
    of("pressure_viscosity", oil.pressure_viscosity > 0.0 or oil.pressure_law == "none", text)


def thickness(oil: Oil, temperature: float) -> float:
    """Viscosity, Pa s, at a temperature, K, by the laws of :mod:`cranktrain.engine.lubricant`; inf on overflow."""
    try:
        if oil.law == "vogel":
            return oil.vogel_a * math.exp(oil.vogel_b / (temperature - oil.vogel_c))
        points = zip(oil.walther_temperatures, oil.walther_viscosities, strict=True)
        (t1, w1), (t2, w2) = ((math.log(t), math.log10(math.log10(1e6 * nu + 0.7))) for t, nu in points)
        exponent = w1 + (w2 - w1) * (math.log(temperature) - t1) / (t2 - t1)
        return 1e-6 * oil.density * (10.0**10.0**exponent - 0.7)
    except OverflowError:
        return math.inf
