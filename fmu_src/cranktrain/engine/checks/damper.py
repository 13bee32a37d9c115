"""Which values describe a torsional damper: rules that an engine file's ``[damper]`` table must keep."""

from __future__ import annotations

import math
from itertools import pairwise

from cranktrain.core.errors import nearest
from cranktrain.engine.checks.crankshaft import in_mm
from cranktrain.engine.parts import Damper

KINDS = ("viscous", "rubber")
NEWTONIAN, SHEAR_THINNING, COMPLEX_MODULUS = "newtonian", "shear-thinning", "complex-modulus"
LAWS = (NEWTONIAN, SHEAR_THINNING, COMPLEX_MODULUS)
# Lightest and heaviest metal a ring may be made of, kg/m³: light alloy to tungsten.
RING_DENSITIES = (2500.0, 19500.0)
_ZERO_CELSIUS = 273.15

Rule = tuple[str, bool, str]


def damper_rules(damper: Damper) -> list[Rule]:
    """Rules (key, whether it holds, what to say otherwise) of a damper."""
    d = damper
    coldest, hottest = min(d.temperatures, default=0.0), max(d.temperatures, default=0.0)
    valid = f"{d.lowest_temperature - _ZERO_CELSIUS:.4g} to {d.highest_temperature - _ZERO_CELSIUS:.4g} degC"
    rules: list[Rule] = [
        ("damper.kind", d.kind in KINDS, f"unknown kind '{d.kind}'; {nearest(d.kind, KINDS)}"),
        (
            "damper.temperatures",
            len(d.temperatures) == len(d.temperature_speeds) > 0,
            f"{len(d.temperatures)} temperatures for {len(d.temperature_speeds)} speeds; give one for each",
        ),
        ("damper.temperature_speeds", all(a < b for a, b in pairwise(d.temperature_speeds)), "must increase"),
        ("damper.highest_temperature", d.highest_temperature > d.lowest_temperature, "is not above lowest_temperature"),
        (
            "damper.temperatures",
            hottest <= d.highest_temperature,
            f"{hottest - _ZERO_CELSIUS:.4g} degC is hotter than the damper's law is valid ({valid}); lower it, or give "
            "a law that holds there",
        ),
        (
            "damper.temperatures",
            coldest >= d.lowest_temperature,
            f"{coldest - _ZERO_CELSIUS:.4g} degC is colder than the damper's law is valid ({valid})",
        ),
        (
            "damper.ambient_temperature",
            d.ambient_temperature < d.highest_temperature,
            f"is not below the highest temperature of the damper's law ({valid})",
        ),
        ("damper.frequency", d.frequency > 0.0, "must be positive; give the torsional frequency that it works at"),
    ]
    return rules + (_rubber_rules(d) if d.kind == "rubber" else _viscous_rules(d))


def _rubber_rules(d: Damper) -> list[Rule]:
    return [
        (f"damper.{key}", getattr(d, key) > 0.0, "is missing; a rubber damper needs stiffness and loss_factor")
        for key in ("stiffness", "loss_factor")
    ]


def _viscous_rules(d: Damper) -> list[Rule]:
    lengths = ("ring_outer_radius", "ring_inner_radius", "ring_width", "axial_gap", "outer_gap", "inner_gap")
    wanted: tuple[str, ...] = ("viscosity", "viscosity_slope", *lengths)
    if d.law != NEWTONIAN:
        wanted += ("critical_stress", "flow_exponent")
    missing = [
        (f"damper.{key}", getattr(d, key) > 0.0, f"is missing; a viscous damper of law {d.law} needs it")
        for key in wanted
    ]
    # Above: every length is positive, or the first rule that fails names the one that is not.
    section = 0.5 * math.pi * d.ring_width * (d.ring_outer_radius**4 - d.ring_inner_radius**4)
    density = d.ring_inertia / section if section > 0.0 else 0.0
    return [
        ("damper.law", d.law in LAWS, f"unknown law '{d.law}'; {nearest(d.law, LAWS)}"),
        *missing,
        (
            "damper.flow_exponent",
            d.flow_exponent < 1.0,
            f"{d.flow_exponent} is not below 1; silicone oils of high viscosity have 0.2 to 0.5",
        ),
        (
            "damper.ring_inner_radius",
            d.ring_inner_radius < d.ring_outer_radius,
            f"{in_mm(d.ring_inner_radius)} is not less than ring_outer_radius, {in_mm(d.ring_outer_radius)}",
        ),
        *(
            (
                f"damper.{key}",
                getattr(d, key) < 0.1 * d.ring_width,
                f"{in_mm(getattr(d, key))} is no thin gap beside a ring {in_mm(d.ring_width)} wide; it is often given "
                "in um",
            )
            for key in lengths[3:]
        ),
        (
            "damper.ring_inertia",
            RING_DENSITIES[0] <= density <= RING_DENSITIES[1],
            f"{d.ring_inertia:.4g} kg m^2 would take a ring of {density:.4g} kg/m^3; steel of these radii and this "
            f"width has {7850.0 * section:.4g} kg m^2",
        ),
    ]
