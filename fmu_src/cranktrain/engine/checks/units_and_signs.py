"""Warnings for values that a wrong unit or sign makes: radians for degrees, °F for °C, a radius for a diameter.

Such values are possible but unlikely, so each causes a warning. A wrong unit is recognised from a quantity derived from
two values, such as the thickness of a steel disc of a body's mass and inertia, or the twist of a shaft under the
engine's torque.
"""

import math
from collections.abc import Iterator

from cranktrain.engine.model import Engine
from cranktrain.engine.parts import LumpedInertia
from cranktrain.engine.quantities import ZERO_CELSIUS, mm

STEEL = 7850.0
UNIT = "check its unit"
THIN, FOIL, RIM = 0.01, 0.0015, 160.0
"""``THIN`` is the thickness over radius of a steel disc below which its rim speed is at most ``RIM`` m/s, as for the
blades of a propeller; ``FOIL`` the thickness over radius below which no disc is made."""
INSIDE_FLANGE, INSIDE_NOSE = 0.25, 0.5
"""Largest reach of a flywheel behind its flange, in bores, and of a pulley behind the crank's nose, in nose lengths."""
MOST_HEAT = 1.0e7
"""Largest heat of a cycle over the swept volume, J/m³: a mean effective pressure of 40 bar."""
LEAST_HEAT = 1.0e5
"""Heat of a cycle over the swept volume, J/m³, below which there is no combustion, as in a compressor."""
EFFICIENCY = 0.42
"""Indicated work over heat, to estimate the engine's torque."""
TWIST, LINE_TWIST, FREE = (0.06, 30.0), (0.002, 360.0), 400.0
"""Smallest and largest twist (deg) under the mean torque, of the connecting shaft and of shafts in a drive line. A
connecting shaft that twists by more than ``FREE`` is meant to decouple the flywheel."""
DAMPED = (0.01, 3.0)
"""Smallest and largest plausible damping ratio of flywheel and dynamometer on the connecting shaft."""
PER_DEGREE = "N m/deg is 57.3 N m/rad"
OIL_DEG_C = (43.0, 160.0)
"""Lowest and highest temperature of a warm engine's oil, degC; 176 degF is 80 degC."""
OIL_PRESSURE = 0.7e5
"""Least gauge pressure of an oil supply, Pa."""
LATEST_START = 2.0
"""Latest usual start of combustion, deg after firing dead centre."""


def outside(
    key: str, what: str, value: float, limits: tuple[float, float], hint: str = UNIT, unit: str = ""
) -> Iterator[str]:
    """Warning for a value outside its usual limits."""
    low, high = limits
    if not low <= value <= high:
        yield f"{key}: {f'{what} {value:.4g}'.lstrip()}{unit}, usual {low:g} to {high:g}{unit}; {hint}"


def misread(engine: Engine) -> Iterator[str]:
    """Warnings for probable mistakes of units and signs, one line each."""
    yield from _discs(engine)
    yield from _burn(engine)
    yield from _shafts(engine)
    yield from _oil(engine)


def _discs(engine: Engine) -> Iterator[str]:
    """Warn of bodies as thin as foil for their mass and inertia, or inside the crank's ends (z points to the rear)."""
    for name in ("flywheel", "pulley", "clutch"):
        part: LumpedInertia | None = getattr(engine, name)
        if part is None or not part.mass:
            continue
        radius = math.sqrt(2.0 * part.polar_inertia / part.mass)
        thickness, rim = part.mass / (STEEL * math.pi * radius**2), radius * engine.speeds[1]
        if thickness < FOIL * radius or (thickness < THIN * radius and rim > RIM):
            yield (
                f"{name}.mass: {part.mass:.4g} kg with {part.polar_inertia:.4g} kg m^2 are a steel disc of radius "
                f"{mm(radius)}, {mm(thickness)} thick, whose rim runs at {rim:.3g} m/s; check mass and polar_inertia"
            )
    crank = engine.crankshaft
    behind = {
        "flywheel": (-engine.flywheel.offset, crank.flange_length + INSIDE_FLANGE * engine.cylinders.bore),
        "pulley": (engine.pulley.offset, INSIDE_NOSE * crank.nose_length),
    }
    for name, (inwards, most) in behind.items():
        if inwards > most:
            sign = "negative" if name == "pulley" else "positive"
            yield (
                f"{name}.offset: its centre of mass lies {mm(inwards)} from the crank's end towards the cylinders, "
                f"usual at most {mm(most)}; z points to the flywheel, so away from the cylinders is {sign}"
            )


def _burn(engine: Engine) -> Iterator[str]:
    """Warn of more heat than the swept volume can hold, and of combustion that starts after dead centre."""
    burn, swept = engine.combustion, engine.displacement / engine.n_cylinders
    if burn is None:
        return
    if (density := burn.heat / swept) > MOST_HEAT:
        yield (
            f"cylinders.bore: {mm(engine.cylinders.bore)} and combustion.heat {1e-3 * burn.heat:.4g} kJ are a mean "
            f"effective pressure of about {1e-5 * EFFICIENCY * density:.3g} bar, usual at most "
            f"{1e-5 * EFFICIENCY * MOST_HEAT:.3g} bar; the bore is a diameter, and heat that of a cylinder and cycle"
        )
    start = math.degrees(burn.start)
    if LATEST_START < start <= 40.0:
        yield (
            f"combustion.start: {start:.4g} deg after firing dead centre, usual -60 to {LATEST_START:g} deg; before "
            "dead centre it is negative"
        )


def _shafts(engine: Engine) -> Iterator[str]:
    """Warn of shafts behind the flywheel that the engine's torque twists hardly at all, or by whole turns."""
    burn, line, chain = engine.combustion, engine.drive_line, engine.drive_line_chain
    if burn is None or burn.heat < LEAST_HEAT * engine.displacement / engine.n_cylinders:
        return
    torque = EFFICIENCY * burn.heat * engine.n_cylinders / engine.cylinders.cycle
    if chain is not None:
        for start, end, stiffness in zip(chain.starts, chain.ends, chain.stiffnesses, strict=True):
            twist = math.degrees(torque / stiffness) if stiffness else 1.0
            if end != "dynamometer" and not LINE_TWIST[0] <= twist <= LINE_TWIST[1]:
                yield (
                    f"drive_line_chain.stiffnesses: {stiffness:.4g} N m/rad from {start} to {end} twists by "
                    f"{twist:.3g} deg under {torque:.3g} N m, usual {LINE_TWIST[0]:g} to {LINE_TWIST[1]:g} deg; "
                    f"{PER_DEGREE}"
                )
        return
    twist = math.degrees(torque / line.stiffness)
    if twist > FREE:
        return
    if not TWIST[0] <= twist <= TWIST[1]:
        yield (
            f"drive_line.stiffness: {line.stiffness:.4g} N m/rad twists by {twist:.3g} deg under {torque:.3g} N m, "
            f"usual {TWIST[0]:g} to {TWIST[1]:g} deg; {PER_DEGREE}"
        )
        return
    inertia = 1.0 / (1.0 / engine.flywheel.polar_inertia + 1.0 / line.dynamometer_inertia)
    ratio = line.damping / (2.0 * math.sqrt(line.stiffness * inertia))
    hint = "N m s/deg is 57.3 N m s/rad"
    yield from outside("drive_line.damping", "a damping ratio of the shaft of", ratio, DAMPED, hint)


def _oil(engine: Engine) -> Iterator[str]:
    """Warn of oil temperatures in degF, and of a supply pressure too low to reach the bearings."""
    warmth = max(engine.oil.temperatures) - ZERO_CELSIUS
    fahrenheit = f"{warmth:.4g} degF is {(warmth - 32.0) / 1.8:.3g} degC"
    yield from outside("oil.temperatures", "the warmest is", warmth, OIL_DEG_C, fahrenheit, " degC")
    supplies = {"oil": engine.oil, "main_bearing": engine.main_bearing, "big_end_bearing": engine.big_end_bearing}
    for name, part in supplies.items():
        if part is not None and 0.0 < part.supply_pressure < OIL_PRESSURE:
            yield (
                f"{name}.supply_pressure: {1e-5 * part.supply_pressure:.3g} bar, usual {1e-5 * OIL_PRESSURE:g} to 30 "
                f"bar above the atmosphere; {UNIT}"
            )
