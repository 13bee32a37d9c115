"""Sizes of an engine from its bore, stroke and fuel, by proportions of practice.

Diameters of journals and pins over the bore B are the means of :data:`PUBLISHED`, makers' service data of sixteen
engines (:func:`today`). Other proportions of the crankshaft are those of Heisler, *Advanced Engine Technology* (1995),
for in-line engines: big-end journals 0.35 B wide, webs 0.25 B thick, fillets 0.04 B, cylinders 1.20 B apart, which
leaves 0.35 B for the main journals. Two rods on a pin need a wider one; webs are thinner there. :data:`HANDBOOK` has
Heisler's diameters as well, journals of 0.75 B and pins of 0.65 B. Rods have λ = r/l = 0.30, of the 0.25 to 0.33 of
Köhler and Flierl, *Verbrennungsmotoren*. Powers and speeds follow from mean effective pressures and mean piston speeds
of the kind that Heywood, *Internal Combustion Engine Fundamentals*, and Taylor, *The Internal-Combustion Engine in
Theory and Practice*, list by fuel.
"""

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.units import RPM
from cranktrain.engine.parts import Crankshaft
from cranktrain.studies.design.layouts import VEE, Layout

LAMBDA = 0.30
"""Throw over rod length."""
MECHANICAL_EFFICIENCY = 0.85
"""Brake over indicated power at full load."""
PIN_WIDTH, WEB, FILLET, PITCH = 0.35, 0.25, 0.04, 1.20
"""Dimensions of an in-line engine over the bore: pin width, web thickness, fillet radius, distance of cylinders."""
VEE_BIG_END, VEE_WEB, VEE_MAIN = 0.26, 0.20, 0.30
"""Width of one of two big ends on a pin, thickness of a web and width of a main journal, over the bore."""
WIDE_MAIN = 0.42
"""Width of a main journal of a V whose block has its bulkheads between the cylinders, over the bore."""
FLYING_WEB = 0.12
"""Thickness of the web between split pins, over the bore; chosen."""
SKIRT = 0.37
"""Lower edge of the piston below its pin with the clearance to the counterweight, over the bore."""
WIDEST_PRESSURE, LEAST_PRESSURE = 40e5, 1e5
"""Mean effective pressures that a four-stroke engine may have, Pa."""


class Fuel(NamedTuple):
    """Values of practice for engines of one fuel.

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


HEAVY = Fuel(18e5, 0.45, 12.0, 0.25, 0.60, 1.5, 16.5, (-3.0, 60.0, 0.8), 1500.0, 1900.0)
FUELS = {
    "petrol": Fuel(11e5, 0.38, 18.0, 0.16, 0.70, 1.0, 11.5, (-18.0, 50.0, 2.0), 700.0, 900.0),
    "diesel": HEAVY,
}
"""Present practice by fuel. Petrol engines burn half of the heat by 5 deg after dead centre; their peak pressure is six
times the mean pressure."""


class Proportions(NamedTuple):
    """Journal and pin diameters, and the web's radii about both axes (with a shoulder), over the bore; their source."""

    main: float
    pin: float
    about_main: float
    about_pin: float
    source: str


class Published(NamedTuple):
    """Maker's service data of an engine: form, cylinders, fuel; bore, main journal and pin diameter, mm."""

    engine: str
    form: str
    cylinders: int
    fuel: str
    bore: float
    main: float
    pin: float


PUBLISHED = (
    Published("Toyota 2AZ-FE", "in line", 4, "petrol", 88.5, 55.0, 48.0),
    Published("Ford Duratec 2.3", "in line", 4, "petrol", 87.5, 52.0, 50.0),
    Published("Ford Zetec 2.0", "in line", 4, "petrol", 84.8, 58.0, 46.9),
    Published("Subaru EJ25", "boxer", 4, "petrol", 99.5, 60.0, 52.0),
    Published("Volvo B5254T2", "in line", 5, "petrol", 83.0, 65.0, 50.0),
    Published("Volvo B6294T", "in line", 6, "petrol", 83.0, 65.0, 50.0),
    Published("Toyota 2GR-FSE", "V", 6, "petrol", 94.0, 61.0, 53.0),
    Published("Ford Duratec 3.0", "V", 6, "petrol", 89.0, 63.0, 50.0),
    Published("Honda J32A", "V", 6, "petrol", 89.0, 72.0, 55.0),
    Published("Toyota 2UR-FSE", "V", 8, "petrol", 94.0, 67.0, 53.0),
    Published("Ford Modular 4.6", "V", 8, "petrol", 90.2, 67.5, 53.0),
    Published("Ford Modular 6.8", "V", 10, "petrol", 90.2, 67.5, 53.0),
    Published("Mitsubishi S3Q2-T", "in line", 3, "diesel", 88.0, 65.0, 58.0),
    Published("Case 445T/M2", "in line", 4, "diesel", 104.0, 83.0, 69.0),
    Published("GM Duramax 6.6 LLY", "V", 8, "diesel", 103.0, 80.0, 63.0),
    Published("Ford 7.3 Power Stroke", "V", 8, "diesel", 104.4, 79.2, 63.5),
)
"""Journal dimensions from the makers' service manuals (specifications of crankshaft and cylinder block)."""
SHORT = 4
"""Largest number of cylinders of a short crank, in line or boxer; all other cranks, also of V engines, are long."""


def is_short(form: str, cylinders: int) -> bool:
    """True if a crank counts as short: in line or boxer with up to ``SHORT`` cylinders."""
    return form != VEE and cylinders <= SHORT


def today(layout: Layout, fuel: str) -> Proportions:
    """Mean proportions of :data:`PUBLISHED` engines of this fuel; for petrol engines of the same crank length class."""
    if fuel == "diesel":
        return Proportions(0.77, 0.635, 0.48, 0.39, "mean of makers' data of four diesels")
    if is_short(layout.form, layout.cylinders):
        return Proportions(0.63, 0.55, 0.41, 0.35, "mean of makers' data of short petrol engines")
    return Proportions(0.74, 0.585, 0.465, 0.37, "mean of makers' data of long petrol engines")


class Practice(NamedTuple):
    """Rules that a design follows: values by fuel, and proportions by layout and fuel."""

    fuels: Mapping[str, Fuel]
    proportions: Callable[[Layout, str], Proportions]


TODAY = Practice(FUELS, today)
HANDBOOK = Practice(
    {"petrol": FUELS["petrol"]._replace(compression=10.5, burn=(-20.0, 60.0, 2.0)), "diesel": HEAVY},
    lambda layout, fuel: Proportions(0.75, 0.65, 0.47, 0.40, "Heisler"),
)
"""Practice of the shipped engines: journal proportions by Heisler, and a slower burn."""


class Sizes(NamedTuple):
    """Sizes and loads that all tables of an engine file follow from (SI).

    ``imep`` is that of the rated speed; ``displacement`` that of all cylinders; ``rod_given``, ``power_given`` and
    ``speed_given`` tell whether the user stated them. ``crank`` is a crankshaft found in CAD, whose dimensions replace
    the proportions; ``bore_note`` says where the bore comes from. ``practice`` has the rules.
    ``wide_mains``: those of a V leave room for bulkheads between its cylinders.
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
    practice: Practice = TODAY
    wide_mains: bool = False

    @property
    def fuel(self) -> Fuel:
        """Values of practice for the engine's fuel."""
        return self.practice.fuels[self.fuel_name]

    @property
    def proportions(self) -> Proportions:
        """Journals, pins and webs over the bore."""
        return self.practice.proportions(self.layout, self.fuel_name)

    @property
    def throw(self) -> float:
        """Throw, half the stroke, m."""
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
        """Indicated power at rated speed, W."""
        return self.imep * self.displacement * self.rated / (4.0 * math.pi)

    @property
    def brake_power(self) -> float:
        """Brake power at rated speed, W."""
        return MECHANICAL_EFFICIENCY * self.indicated_power

    @property
    def rods_on_pin(self) -> int:
        """Number of rods on a pin."""
        return 2 if self.vee and not self.layout.split else 1

    @property
    def vee(self) -> bool:
        """True for a V engine, whose two banks share the length of one."""
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
        """Mass of a piston with pin and rings, kg."""
        return self.fuel.piston * self.bore**3

    @property
    def big_end_mass(self) -> float:
        """Part of the rod's mass at the crank pin, kg; 0.7 of the rod's mass."""
        return 0.7 * self.fuel.rod * self.bore**3

    @property
    def small_end_mass(self) -> float:
        """Part of the rod's mass at the piston, kg."""
        return 0.3 * self.fuel.rod * self.bore**3

    @property
    def thrust_main(self) -> int:
        """Number of the main journal with the thrust bearing: the middle one, unless another is stated."""
        if self.crank:
            return self.stated_thrust_main or (len(self.crank.main_widths) + 1) // 2
        return len(self.layout.throws_deg) // (2 if self.layout.split else 1) // 2 + 1

    @property
    def main_diameter(self) -> float:
        """Diameter of the main journals, m."""
        return self.crank.main_diameter if self.crank else self.proportions.main * self.bore

    @property
    def pin_diameter(self) -> float:
        """Diameter of the pins, m."""
        return self.crank.pin_diameter if self.crank else self.proportions.pin * self.bore

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
        """Width of the narrowest main journal between its webs, m."""
        if self.crank:
            return min(self.crank.main_widths)
        share = (WIDE_MAIN if self.wide_mains else VEE_MAIN) if self.vee else PITCH - PIN_WIDTH - 2.0 * WEB
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


def sizes(
    layout: Layout,
    bore: float,
    stroke: float,
    fuel: str = "petrol",
    rod: float | None = None,
    power: float | None = None,
    rated: float | None = None,
    crank: Crankshaft | None = None,
    practice: Practice = TODAY,
) -> Sizes:
    """Sizes of an engine (SI). Arguments that are None follow from the fuel and the proportions of this module.

    Raises ``InputError``: an unknown fuel, and sizes that no engine has.

    Parameters
    ----------
    rod : length between the rod's eyes, m
    power : brake power at the rated speed, W
    rated : rated speed, rad/s
    crank : dimensions of a crankshaft that was found in CAD
    practice : rules for the rest
    """
    if fuel not in FUELS:
        raise InputError(f"--fuel '{fuel}' is not known; {nearest(fuel, FUELS)}")
    own = practice.fuels[fuel]
    if not 0.3 <= stroke / bore <= 5.0:
        raise InputError(
            f"--stroke-mm {1e3 * stroke:g}: with a bore of {1e3 * bore:g} mm the stroke is {stroke / bore:.3g} bores; "
            "engines have 0.3 to 5, check both"
        )
    throw = 0.5 * stroke
    web = practice.proportions(layout, fuel).about_main * bore
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
                  rated is not None, crank, practice=practice)  # fmt: skip
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


DAMPERS = ("rubber", "viscous")
FLYWHEELS = ("solid", "dual-mass")


class Equipment(NamedTuple):
    """Optional equipment: kind of ``damper`` or None, dual-mass flywheel, mounts with a block."""

    damper: str | None = None
    dual_mass: bool = False
    mounts: bool = False


BARE = Equipment()


def equipment(damper: str | None, flywheel: str, mounts: bool) -> Equipment:
    """Make the equipment from these options; ``InputError`` for an unknown word."""
    for option, word, words in (("damper", damper, DAMPERS), ("flywheel", flywheel, FLYWHEELS)):
        if word is not None and word not in words:
            raise InputError(f"--{option} '{word}' is not known; {nearest(word, words)}")
    return Equipment(damper, flywheel == FLYWHEELS[1], mounts)
