"""Sizes of an engine from its bore, stroke and fuel, by proportions of practice.

Proportions of the crankshaft over the bore B are those of Heisler, *Advanced Engine Technology* (1995), for in-line
engines: journals 0.75 B and pins 0.65 B thick, big-end journals 0.35 B wide, webs 0.25 B thick, fillets 0.04 B,
cylinders 1.20 B apart, which leaves 0.35 B for the main journals. Two rods on a pin need a wider one; webs are thinner
there. Rods have λ = r/l = 0.30, of the 0.25 to 0.33 of Köhler and Flierl, *Verbrennungsmotoren*. Powers and speeds
follow from mean effective pressures and mean piston speeds of the kind that Heywood, *Internal Combustion Engine
Fundamentals*, and Taylor, *The Internal-Combustion Engine in Theory and Practice*, list by fuel.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cranktrain.core.errors import InputError, nearest
from cranktrain.engine.parts import Crankshaft
from cranktrain.studies.design.layouts import VEE, Layout

RPM = math.pi / 30.0
LAMBDA = 0.30
"""Throw over rod length."""
MECHANICAL_EFFICIENCY = 0.85
"""Brake over indicated power at full load."""
MAIN_DIAMETER, PIN_DIAMETER, PIN_WIDTH, WEB, FILLET, PITCH = 0.75, 0.65, 0.35, 0.25, 0.04, 1.20
"""Of an in-line engine, over the bore."""
VEE_BIG_END, VEE_WEB, VEE_MAIN = 0.26, 0.20, 0.30
"""Width of one of two big ends on a pin, thickness of a web and width of a main journal, over the bore."""
FLYING_WEB = 0.12
"""Thickness of the web between split pins, over the bore; chosen."""
WEB_ABOUT_MAIN, WEB_ABOUT_PIN = 0.47, 0.40
"""Radii of the web's outline about the main and the pin axis, over the bore: journal and fillet with a shoulder."""
SKIRT = 0.37
"""Lower edge of the piston below its pin with the clearance to the counterweight, over the bore."""
WIDEST_PRESSURE, LEAST_PRESSURE = 40e5, 1e5
"""Mean effective pressures that a four-stroke engine may have, Pa."""


class Fuel(NamedTuple):
    """What practice gives by fuel.

    Attributes
    ----------
    imep : indicated mean effective pressure at full load, Pa
    efficiency : indicated efficiency, of the heat of the fuel
    piston_speed : mean piston speed at rated speed, m/s
    lowest, best : lowest speed and that of the largest torque, over the rated one
    air : air over that of complete combustion
    compression : compression ratio, naturally aspirated or lightly charged
    burn : start (deg after dead centre), duration (deg) and Wiebe exponent
    piston, rod : masses of the piston group and of the rod, over the bore cubed, kg/m³
    """

    imep: float
    efficiency: float
    piston_speed: float
    lowest: float
    best: float
    air: float
    compression: float
    burn: tuple[float, float, float]
    piston: float
    rod: float


FUELS = {
    "petrol": Fuel(11e5, 0.38, 18.0, 0.16, 0.70, 1.0, 10.5, (-20.0, 60.0, 2.0), 700.0, 900.0),
    "diesel": Fuel(18e5, 0.45, 12.0, 0.25, 0.60, 1.5, 16.5, (-3.0, 60.0, 0.8), 1500.0, 1900.0),
}


class Sizes(NamedTuple):
    """Sizes and loads that all tables of an engine file follow from (SI).

    ``imep`` is that of the rated speed; ``displacement`` that of all cylinders; ``rod_given``, ``power_given`` and
    ``speed_given`` tell whether the user stated them. ``crank`` is a crankshaft found in CAD, whose dimensions replace
    the proportions; ``bore_note`` says where the bore comes from.
    """

    layout: Layout
    fuel_name: str
    bore: float
    stroke: float
    rod_length: float
    rated: float
    imep: float
    rod_given: bool
    power_given: bool
    speed_given: bool
    crank: Crankshaft | None = None
    bore_note: str = "given"
    stated_thrust_main: int = 0

    @property
    def fuel(self) -> Fuel:
        """Practice of the fuel."""
        return FUELS[self.fuel_name]

    @property
    def throw(self) -> float:
        """Half the stroke, m."""
        return 0.5 * self.stroke

    @property
    def swept(self) -> float:
        """Swept volume of a cylinder, m³."""
        return 0.25 * math.pi * self.bore**2 * self.stroke

    @property
    def displacement(self) -> float:
        """Swept volume of all cylinders, m³."""
        return self.layout.cylinders * self.swept

    @property
    def indicated_power(self) -> float:
        """Of the rated speed, W."""
        return self.imep * self.displacement * self.rated / (4.0 * math.pi)

    @property
    def brake_power(self) -> float:
        """Of the rated speed, W."""
        return MECHANICAL_EFFICIENCY * self.indicated_power

    @property
    def rods_on_pin(self) -> int:
        """Number of rods on a pin."""
        return 2 if self.vee and not self.layout.split else 1

    @property
    def vee(self) -> bool:
        """Whether two banks share the length of one."""
        return self.layout.form == VEE

    @property
    def lowest(self) -> float:
        """Lowest speed, rad/s."""
        return _round_speed(self.fuel.lowest * self.rated)

    @property
    def best(self) -> float:
        """Speed of the largest torque, rad/s."""
        return _round_speed(self.fuel.best * self.rated)

    @property
    def piston_mass(self) -> float:
        """Piston with pin and rings, kg."""
        return self.fuel.piston * self.bore**3

    @property
    def big_end_mass(self) -> float:
        """Part of the rod's mass at the pin, kg: 0.7 of it."""
        return 0.7 * self.fuel.rod * self.bore**3

    @property
    def small_end_mass(self) -> float:
        """Part of the rod's mass at the piston, kg."""
        return 0.3 * self.fuel.rod * self.bore**3

    @property
    def thrust_main(self) -> int:
        """Main journal with the thrust bearing: the middle one, where nobody states another."""
        if self.crank:
            return self.stated_thrust_main or (len(self.crank.main_widths) + 1) // 2
        return len(self.layout.throws_deg) // (2 if self.layout.split else 1) // 2 + 1

    @property
    def main_diameter(self) -> float:
        """Diameter of the main journals, m."""
        return self.crank.main_diameter if self.crank else MAIN_DIAMETER * self.bore

    @property
    def pin_diameter(self) -> float:
        """Diameter of the pins, m."""
        return self.crank.pin_diameter if self.crank else PIN_DIAMETER * self.bore

    @property
    def fillet(self) -> float:
        """Radius of the fillets, m."""
        return self.crank.fillet if self.crank else FILLET * self.bore

    @property
    def pin_width(self) -> float:
        """Width of a pin between its webs, m."""
        if self.crank:
            return self.crank.pin_width
        share = self.rods_on_pin * VEE_BIG_END + 2.0 * FILLET if self.vee else PIN_WIDTH
        return share * self.bore

    @property
    def web(self) -> float:
        """Thickness of a web, m."""
        if self.crank:
            return self.crank.web_thickness
        return (VEE_WEB if self.vee else WEB) * self.bore

    @property
    def flying_web(self) -> float:
        """Thickness of the web between split pins, m."""
        return FLYING_WEB * self.bore

    @property
    def main_width(self) -> float:
        """Width of a main journal between its webs, m; the narrowest."""
        if self.crank:
            return min(self.crank.main_widths)
        share = VEE_MAIN if self.vee else PITCH - PIN_WIDTH - 2.0 * WEB
        return share * self.bore

    @property
    def big_end_width(self) -> float:
        """Width of a big end's bearing, m: the pin's without its fillets, divided by its rods."""
        return self.pin_width / self.rods_on_pin - 2.0 * self.fillet / self.rods_on_pin

    @property
    def main_bearing_width(self) -> float:
        """Width of a main bearing, m: the journal's without its fillets."""
        return self.main_width - 2.0 * self.fillet


def _round_speed(speed: float) -> float:
    """A speed rounded to two digits of rev/min, rad/s."""
    return float(f"{speed / RPM:.2g}") * RPM


# In one piece: parameters are those of the verb `new`.
def sizes(
    layout: Layout,
    bore: float,
    stroke: float,
    fuel: str = "petrol",
    rod: float | None = None,
    power: float | None = None,
    rated: float | None = None,
    crank: Crankshaft | None = None,
) -> Sizes:
    """Sizes of an engine (SI); what is None follows from the fuel and the proportions of this module.

    Parameters
    ----------
    rod : length between the rod's eyes, m
    power : brake power at the rated speed, W
    rated : rated speed, rad/s
    crank : dimensions of a crankshaft that was found in CAD

    Raises
    ------
    InputError
        an unknown fuel, and sizes that no engine has
    """
    if fuel not in FUELS:
        raise InputError(f"--fuel '{fuel}' is not known; {nearest(fuel, FUELS)}")
    own = FUELS[fuel]
    if not 0.3 <= stroke / bore <= 5.0:
        raise InputError(
            f"--stroke-mm {1e3 * stroke:g}: with a bore of {1e3 * bore:g} mm the stroke is {stroke / bore:.3g} bores; "
            "engines have 0.3 to 5, check both"
        )
    throw = 0.5 * stroke
    web = WEB_ABOUT_MAIN * bore
    if crank is not None:
        web = max(crank.web_main_radius, crank.counterweight_radius if any(crank.counterweights) else 0.0)
    least = throw + web + (SKIRT + 0.03) * bore
    length = max(throw / LAMBDA, throw + bore, least) if rod is None else rod
    if length < least:
        raise InputError(
            f"--rod-mm {1e3 * length:g}: the piston would meet the crank's webs; give {1e3 * least:.4g} mm or more, or "
            "leave it out"
        )
    speed = _round_speed(math.pi * own.piston_speed / stroke) if rated is None else rated
    found = Sizes(layout, fuel, bore, stroke, length, speed, own.imep, rod is not None, power is not None,
                  rated is not None, crank)  # fmt: skip
    if power is None:
        return found
    imep = power / found.brake_power * own.imep
    if not LEAST_PRESSURE <= imep <= WIDEST_PRESSURE:
        litres = 1e3 * found.displacement
        raise InputError(
            f"--power-kw {1e-3 * power:g}: {litres:.3g} l at {speed / RPM:.0f} rev/min would need an indicated mean "
            f"effective pressure of {1e-5 * imep:.3g} bar; four-stroke engines have {1e-5 * LEAST_PRESSURE:g} to "
            f"{1e-5 * WIDEST_PRESSURE:g}, change power, --rated-rpm or sizes"
        )
    return found._replace(imep=imep)
