"""Which values describe a torsional damper."""

from __future__ import annotations

import math
from functools import partial

from cranktrain.engine.parts import Damper
from cranktrain.engine.quantities import NEWTONIAN, ZERO_CELSIUS, mm, need, need_table

# Lightest and heaviest metal a ring may be made of, kg/m³: light alloy to tungsten.
RING_DENSITIES = (2500.0, 19500.0)
_LENGTHS = ("ring_outer_radius", "ring_inner_radius", "ring_width")
_GAPS = ("axial_gap", "outer_gap", "inner_gap")


def check_damper(d: Damper) -> None:
    """Refuse values that describe no damper: ``InputError`` that starts with ``damper.key``."""
    of, lowest, highest = partial(need, "damper"), d.lowest_temperature, d.highest_temperature
    need_table("damper", d)
    coldest, hottest = (temperature - ZERO_CELSIUS for temperature in (min(d.temperatures), max(d.temperatures)))
    valid = f"{lowest - ZERO_CELSIUS:.4g} to {highest - ZERO_CELSIUS:.4g} degC"
    of("highest_temperature", highest > lowest, "is not above lowest_temperature")
    text = f"{hottest:.4g} degC is hotter than the damper's law is valid ({valid}); lower it, or give another law"
    of("temperatures", max(d.temperatures) <= highest, text)
    text = f"{coldest:.4g} degC is colder than the damper's law is valid ({valid})"
    of("temperatures", min(d.temperatures) >= lowest, text)
    text = f"is not below the highest temperature of the damper's law ({valid})"
    of("ambient_temperature", d.ambient_temperature < highest, text)
    wanted: tuple[str, ...] = ("viscosity", "viscosity_slope", *_LENGTHS, *_GAPS)
    wanted += ("critical_stress", "flow_exponent") if d.law != NEWTONIAN else ()
    rubber = d.kind == "rubber"
    whose = "a rubber damper needs stiffness and loss_factor" if rubber else f"a viscous damper of law {d.law} needs it"
    for key in ("stiffness", "loss_factor") if rubber else wanted:
        of(key, getattr(d, key) > 0.0, f"is missing; {whose}")
    if rubber:
        return
    inner, outer = d.ring_inner_radius, d.ring_outer_radius
    of("ring_inner_radius", inner < outer, f"{mm(inner)} is not less than ring_outer_radius, {mm(outer)}")
    for key in _GAPS:
        gap = getattr(d, key)
        text = f"{mm(gap)} is no thin gap beside a ring {mm(d.ring_width)} wide; it is often given in um"
        of(key, gap < 0.1 * d.ring_width, text)
    section = 0.5 * math.pi * d.ring_width * (outer**4 - inner**4)
    density = d.ring_inertia / section
    text = (
        f"{d.ring_inertia:.4g} kg m^2 would take a ring of {density:.4g} kg/m^3; steel of these radii and this "
        f"width has {7850.0 * section:.4g} kg m^2"
    )
    of("ring_inertia", RING_DENSITIES[0] <= density <= RING_DENSITIES[1], text)
