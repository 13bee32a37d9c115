"""Warnings for values of an engine file that are each possible but unlikely together.

A study may need an unlikely engine, so such values cause a warning and no error. Limits are ratios: masses over the
mass of a steel cube with the bore as edge, lengths over bore, throw or journal, heat over the mass of trapped air. They
leave room for a model aircraft's single, a motorcycle at 15000 rev/min, a low-speed marine engine with crossheads and a
compressor.
"""

import math
import warnings
from collections.abc import Iterator, Sequence
from itertools import pairwise

from cranktrain.core.units import RPM
from cranktrain.engine.checks.oil import thickness
from cranktrain.engine.checks.units_and_signs import STEEL, UNIT, misread, outside
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import LumpedInertia, PistonGuidance, PlainBearing, Rod
from cranktrain.engine.quantities import ZERO_CELSIUS, mm

MASSES = {
    "cylinders.piston_mass": (0.02, 5.0),
    "rod.big_end_mass": (0.005, 5.0),
    "rod.small_end_mass": (0.002, 5.0),
    "articulated_rod.big_end_mass": (0.002, 5.0),
    "articulated_rod.small_end_mass": (0.002, 5.0),
    "flywheel.mass": (0.01, 300.0),
    "pulley.mass": (0.005, 100.0),
    "clutch.mass": (0.005, 300.0),
    "damper.mass": (0.005, 100.0),
    "block.head_mass": (0.01, 100.0),
}
"""Smallest and largest mass of a part, over the mass of a steel cube with the bore as edge."""
SOLID_PISTON = 0.6
"""Mass of a solid steel cylinder, 3/4 of the bore tall, over that of a steel cube with the bore as edge."""
CROSSHEAD = 3.0
"""Largest mass of piston, piston rod and crosshead, as a multiple of the connecting rod's mass."""
GYRATIONS = {"flywheel": (0.1, 10.0), "pulley": (0.05, 10.0), "clutch": (0.05, 10.0)}
"""Smallest and largest radius of gyration about the crank axis, over the bore."""
ROD_GYRATION = (0.16, 0.8)
"""Limits of a rod's radius of gyration about its centre of mass, over its length; two end masses give 0.5 or less."""
KNUCKLES, WHOLE, MOST_OFF = (1.1, 4.0), (0.75, 1.25), 30.0
"""Radius of knuckle pins over that of the crank pin; rod length plus knuckle radius over the master rod's length;
largest angle (deg) of a knuckle pin from its bank."""
LONG_STROKE = 2.5
"""Stroke over bore above which an engine has crossheads; its rods may be shorter, since there is no skirt to strike."""
AIR = 287.0
"""Gas constant of air, J/(kg K)."""
MOST_HEAT = 5.0e6
"""Largest heat of combustion per air mass, J/kg: 3.5 MJ/kg with hydrogen, and more air than the swept volume's."""
COMPRESSOR = 3.0e4
"""Heat (J per kg of air) below which an engine has no combustion: a hundredth of what air can burn."""
RADIANS = "it looks like radians; give deg, or state the unit rad"


def warn_of_doubts(engine: Engine) -> None:
    """Warn of implausible values, one line each: ``table.key``, value, usual limits, what to check."""
    for text in doubts(engine):
        warnings.warn(f"{engine.name}: {text}", stacklevel=2)


def doubts(engine: Engine) -> Iterator[str]:
    """Texts of all warnings of implausible values, one for each."""
    yield from _masses(engine)
    yield from _articulated(engine)
    yield from _piston(engine)
    yield from _crank(engine)
    yield from _cylinders(engine)
    yield from _lumped(engine)
    yield from _bearings(engine)
    yield from _oil(engine)
    yield from _combustion(engine)
    yield from _stiffnesses(engine)
    yield from misread(engine)
    if engine.piston_guidance is not None:
        yield from _guidance(engine, engine.piston_guidance)


def heat_of_air(engine: Engine) -> float:
    """Heat of a cycle per mass of air that fills the swept volume at intake pressure and temperature, J/kg.

    The heat is 0 for a compressor.
    """
    burn, swept = engine.combustion, engine.displacement / engine.n_cylinders
    if burn is None:
        return 0.0
    return burn.heat * AIR * burn.intake_temperature / (burn.intake_pressure * swept)


def _masses(engine: Engine) -> Iterator[str]:
    bore = engine.cylinders.bore
    cube = STEEL * bore**3
    for name, (low, high) in MASSES.items():
        table, key = name.split(".")
        own = getattr(getattr(engine, table), key, 0.0)
        if own and not low * cube <= own <= high * cube:  # a linear damper may have no mass
            yield (
                f"{name}: {own:.4g} kg with a bore of {mm(bore)}, usual {low * cube:.3g} to {high * cube:.3g} kg; "
                f"{UNIT}"
            )
    for table, (low, high) in GYRATIONS.items():
        if (part := getattr(engine, table)) is not None:
            radius = (part.polar_inertia / part.mass) ** 0.5
            if not low * bore <= radius <= high * bore:
                yield (
                    f"{table}.polar_inertia: a radius of gyration of {mm(radius)} with a bore of {mm(bore)}, "
                    f"usual {mm(low * bore)} to {mm(high * bore)}; {UNIT}"
                )
    for table in ("rod", "articulated_rod"):
        if (rod := getattr(engine, table)) is not None:
            yield from _gyration(table, rod)


def _gyration(table: str, rod: Rod) -> Iterator[str]:
    """Warn of a moment of inertia that is implausible for a rod's length and mass."""
    (low, high), radius = ROD_GYRATION, (rod.inertia / (rod.big_end_mass + rod.small_end_mass)) ** 0.5
    if not low * rod.length <= radius <= high * rod.length:
        yield (
            f"{table}.inertia: a radius of gyration of {mm(radius)} in a rod of {mm(rod.length)}, "
            f"usual {mm(low * rod.length)} to {mm(high * rod.length)}; {UNIT}"
        )


def _articulated(engine: Engine) -> Iterator[str]:
    """Warn of knuckle pins inside the crank pin or far from it, and of rods too long or short beside the master rod."""
    joint, pin = engine.articulated_rod, 0.5 * engine.crankshaft.pin_diameter
    if joint is None:
        return
    where = "the knuckle pin lies in the master rod's big end, around the crank pin"
    over = joint.knuckle_radius / pin
    yield from outside("articulated_rod.knuckle_radius", "over the crank pin's radius it is", over, KNUCKLES, where)
    whole, hint = (joint.length + joint.knuckle_radius) / engine.rod.length, "usual rods end at the same height"
    yield from outside("articulated_rod.length", "with knuckle_radius over rod.length it is", whole, WHOLE, hint)
    for c, own in enumerate(engine.articulations):
        if own is not None:
            off = math.degrees((math.atan2(-own.x, own.y) - own.turn + math.pi) % (2.0 * math.pi) - math.pi)
            if abs(off) > MOST_OFF and joint.knuckle_radius > 0.0:
                yield (
                    f"articulated_rod.knuckle_angles: {off:.4g} deg off the bank of cylinder {c + 1}, usual at most "
                    f"{MOST_OFF:g} deg; they count from the master rod in the sense of rotation"
                )
                break


def _piston(engine: Engine) -> Iterator[str]:
    """Warn of a piston heavier than solid steel without a crosshead, whose rod is also too light for a crosshead."""
    if engine.cylinders.crosshead:
        return
    cube, mass = STEEL * engine.cylinders.bore**3, engine.cylinders.piston_mass
    most = max(SOLID_PISTON * cube, CROSSHEAD * (engine.rod.big_end_mass + engine.rod.small_end_mass))
    if most < mass <= MASSES["cylinders.piston_mass"][1] * cube:
        yield (
            f"cylinders.piston_mass: {mass:.4g} kg with a bore of {mm(engine.cylinders.bore)} is heavier than solid "
            f"steel and than {CROSSHEAD:g} rods, usual at most {most:.3g} kg; {UNIT}, or state crosshead = true"
        )


def _crank(engine: Engine) -> Iterator[str]:
    crank, rod, bore = engine.crankshaft, engine.rod.length, engine.cylinders.bore
    stroke, pin = 2.0 * crank.throw, crank.pin_diameter
    half = "the throw is half the stroke; check both"
    shortest = 1.9 if engine.cylinders.crosshead or stroke > LONG_STROKE * bore else 2.5
    yield from outside("crankshaft.throw", "the rod's length over the throw is", rod / crank.throw, (shortest, 8), half)
    yield from outside("crankshaft.throw", "stroke over bore is", stroke / bore, (0.15, 6.0), half)
    yield from outside("crankshaft.pin_diameter", "pin over throw is", pin / crank.throw, (0.2, 5.0))
    pitch = min(b - a for a, b in pairwise(crank.main_positions))
    yield from outside("crankshaft.pin_diameter", "pin over main bearing pitch is", pin / pitch, (0.1, 1.5))
    yield from outside("crankshaft.main_diameter", "journal over pin is", crank.main_diameter / pin, (0.5, 3.0))
    yield from outside("crankshaft.web_thickness", "web over pin is", crank.web_thickness / pin, (0.12, 2.0))
    yield from outside("crankshaft.pin_width", "width over diameter is", crank.pin_width / pin, (0.15, 4.0))
    for width in sorted({min(crank.main_widths), max(crank.main_widths)}):
        what = "width of a journal over its diameter is"
        yield from outside("crankshaft.main_widths", what, width / crank.main_diameter, (0.1, 4.0))
    # A piston reaches below its pin at least as far as its bosses.
    room, under = rod - crank.throw - 0.2 * bore, crank.pin_width < bore
    if any(crank.counterweights) and under and crank.counterweight_radius > room:
        yield (
            f"crankshaft.counterweight_radius: {mm(crank.counterweight_radius)} strikes the piston, whose pin comes "
            f"within {mm(rod - crank.throw)} of the crank's axis; give at most {mm(max(room, 0.0))}"
        )
    if (weights := engine.balance_weights) is not None:
        for k, (radius, mass) in enumerate(zip(weights.radii, weights.masses, strict=True), 1):
            yield from outside(f"balance_weights.radii[{k}]", "radius over throw is", radius / crank.throw, (0.0, 5.0))
            cubes, what = mass / (STEEL * bore**3), "over a steel cube of the bore it is"
            yield from outside(f"balance_weights.masses[{k}]", what, cubes, (0.0, 10.0))
    yield from _radians("crankshaft.throw_angles", crank.throw_angles)


def _radians(key: str, angles: Sequence[float]) -> Iterator[str]:
    """Warn of angles within 6.3 deg of each other that differ by more than rounding, because they may be in radians."""
    if len(angles) > 1 and 0.02 < math.degrees(max(angles) - min(angles)) < 6.3:
        yield f"{key}: they differ by {math.degrees(max(angles) - min(angles)):.3g} deg at most; {RADIANS}"


def _cylinders(engine: Engine) -> Iterator[str]:
    cylinders, places = engine.cylinders, engine.cylinder_positions
    bore, banks = cylinders.bore, sorted(set(cylinders.bank_angles))
    yield from _radians("cylinders.bank_angles", cylinders.bank_angles)
    yield from _radians("cylinders.firing_angles", cylinders.firing_angles)
    shortest = max(cylinders.firing_intervals, default=math.pi)
    if shortest < math.radians(13.0):
        yield f"cylinders.firing_intervals: the longest is {math.degrees(shortest):.3g} deg; {RADIANS}"
    between = math.degrees(banks[-1] - banks[0])
    own = len(set(cylinders.pins)) == engine.n_cylinders > 2 and not engine.crankshaft.pins_between_mains
    if own and len(banks) == 2 and 30.0 < between < 150.0:
        yield (
            f"cylinders.bank_angles: two banks {between:.4g} deg apart and a throw for each cylinder; in line all "
            "bank angles are equal, and a V engine has two rods on a pin (cylinders.pins)"
        )
    ratio = "piston engines have 8 to 24"
    yield from outside("cylinders.compression_ratio", "", cylinders.compression_ratio, (2.0, 30.0), ratio)
    yield from outside("cylinders.pin_offset", "offset over bore is", cylinders.pin_offset / bore, (-0.25, 0.25))
    for bank in banks:
        row = sorted(z for z, own in zip(places, cylinders.bank_angles, strict=True) if own == bank)
        nearest = min((b - a for a, b in pairwise(row)), default=math.inf)
        if nearest < 0.9 * bore:
            yield (
                f"cylinders.bore: {mm(bore)}, but the cylinders of a bank are {mm(nearest)} apart; check bore, pins "
                "and the widths of crankshaft"
            )


def _lumped(engine: Engine) -> Iterator[str]:
    """Warn of bodies that are far from the crank's ends, or long and thin."""
    crank, bore = engine.crankshaft, engine.cylinders.bore
    ends = {"pulley": crank.nose_length, "flywheel": crank.flange_length, "clutch": crank.flange_length}
    for table, length in ends.items():
        part: LumpedInertia | None = getattr(engine, table)
        if part is None:
            continue
        farthest = 3.0 * bore + length
        if abs(part.offset) > farthest:
            yield (
                f"{table}.offset: its centre of mass {mm(abs(part.offset))} from the crank's end, usual at most "
                f"{mm(farthest)}; {UNIT}"
            )
        slender, body = part.diametral_inertia / part.polar_inertia, "a disc has 0.5, a roller as long as wide 0.8"
        yield from outside(f"{table}.diametral_inertia", "over polar_inertia it is", slender, (0.49, 6.0), body)


def _bearings(engine: Engine) -> Iterator[str]:
    crank, thrust = engine.crankshaft, engine.thrust
    for table in ("main_bearing", "big_end_bearing"):
        film: PlainBearing | None = getattr(engine, table)
        if film is None:
            continue
        play = "diametral clearance (twice the value) over diameter is"
        yield from outside(f"{table}.clearance", play, 2.0 * film.clearance / film.diameter, (3e-4, 5e-3))
        yield from outside(f"{table}.width", "width over diameter is", film.width / film.diameter, (0.1, 2.0))
        if not film.supply_pressure <= 3e6:
            yield f"{table}.supply_pressure: {1e-5 * film.supply_pressure:.4g} bar, usual at most 30 bar; {UNIT}"
    if thrust.taper > thrust.clearance:
        yield (
            f"thrust.taper: {mm(thrust.taper)} is deeper than the axial play, {mm(thrust.clearance)}; usual 0.01 to "
            f"0.1 mm; {UNIT}"
        )
    size = thrust.clearance / thrust.outer_diameter
    yield from outside("thrust.clearance", "axial play over outer_diameter is", size, (1e-5, 0.05))
    outer = thrust.outer_diameter / crank.main_diameter
    yield from outside("thrust.outer_diameter", "over the journal it is", outer, (1.0, 3.0))


def _oil(engine: Engine) -> Iterator[str]:
    oil = engine.oil
    warmth = [temperature - ZERO_CELSIUS for temperature in oil.temperatures]
    for (before, after), speed in zip(pairwise(warmth), oil.temperature_speeds[1:], strict=True):
        if after < before - 1.0:
            yield (
                f"oil.temperatures: they fall from {before:.4g} to {after:.4g} degC up to "
                f"{speed / RPM:.4g} rev/min; oil warms with speed, check the order of the values"
            )
            break
    for temperature in sorted({min(oil.temperatures), max(oil.temperatures)}):
        thick = 1e3 * thickness(oil, temperature)
        if not 2.0 <= thick <= 300.0:
            yield (
                f"oil.law: {oil.law} gives {thick:.3g} mPa s at {temperature - ZERO_CELSIUS:.4g} degC, usual 2 to 300 "
                "mPa s; check oil.temperatures and the constants of the law"
            )
    yield from outside("oil.density", "", oil.density, (700.0, 1200.0), "mineral oil has 850", " kg/m^3")
    heat = "mineral oil has 2000 J/(kg K)"
    yield from outside("oil.heat_capacity", "", oil.heat_capacity, (1200.0, 4500.0), heat, " J/(kg K)")
    if not oil.supply_pressure <= 3e6:
        yield f"oil.supply_pressure: {1e-5 * oil.supply_pressure:.4g} bar, usual at most 30 bar; {UNIT}"


def _combustion(engine: Engine) -> Iterator[str]:
    burn, throw, oil = engine.combustion, engine.crankshaft.throw, engine.oil
    if burn is None:
        return
    if (heat := heat_of_air(engine)) > MOST_HEAT:
        yield (
            f"combustion.heat: {1e-3 * burn.heat:.4g} kJ a cycle and cylinder is {1e-6 * heat:.3g} MJ per kg of air, "
            f"which can burn 3 MJ/kg; usual at most {1e-3 * burn.heat * MOST_HEAT / heat:.3g} kJ; {UNIT}"
        )
    speed = 2.0 * throw * burn.best_speed / math.pi
    yield from outside("combustion.best_speed", "mean piston speed of", speed, (0.3, 30.0), UNIT, " m/s")
    span = burn.best_speed / oil.temperature_speeds[-1], burn.best_speed / oil.temperature_speeds[0]
    if span[0] > 2.0 or span[1] < 0.2:
        rpm = [one / RPM for one in (burn.best_speed, oil.temperature_speeds[0], oil.temperature_speeds[-1])]
        yield (
            f"combustion.best_speed: {rpm[0]:.4g} rev/min lies far outside oil.temperature_speeds, {rpm[1]:.4g} to "
            f"{rpm[2]:.4g} rev/min; check both"
        )
    lost = "it is the fraction of heat lost at twice best_speed"
    yield from outside("combustion.falloff", "", burn.falloff, (0.0, 1.0), lost)
    degrees = {
        "start": (-60.0, 40.0), "duration": (5.0, 200.0), "intake_closes": (-250.0, -40.0),
        "exhaust_opens": (60.0, 260.0),
    }  # fmt: skip
    for key, limits in degrees.items():
        hint = "angles count from firing dead centre; check deg against rad"
        yield from outside(f"combustion.{key}", "", math.degrees(getattr(burn, key)), limits, hint, " deg")
    kelvin = {"intake_temperature": (200.0, 450.0), "wall_temperature": (230.0, 700.0)}
    for key, limits in kelvin.items():
        yield from outside(f"combustion.{key}", "", getattr(burn, key), limits, "check K against degC", " K")
    back = burn.exhaust_pressure / burn.intake_pressure
    both = "both are absolute; check their units"
    yield from outside("combustion.exhaust_pressure", "over intake_pressure it is", back, (0.1, 10.0), both)


def _stiffnesses(engine: Engine) -> Iterator[str]:
    """Warn of castings with a speed of sound that no metal has, and of damping higher than in structures."""
    for table, part in (("material", engine.material), ("block", engine.block)):
        if part is not None:
            sound = (part.youngs_modulus / part.density) ** 0.5
            yield from outside(
                f"{table}.youngs_modulus", "a speed of sound (root of modulus over density) of", sound,
                (2500.0, 7500.0), "steel has 5170, cast iron 4000; check both units", " m/s",
            )  # fmt: skip
    share = "metal structures have 0.002 to 0.05; check % against 1"
    if engine.damping.kind == "modal":
        yield from outside("damping.ratio", "", engine.damping.ratio, (0.0, 0.2), share)
    if engine.block is not None:
        yield from outside("block.damping_ratio", "", engine.block.damping_ratio, (0.0, 0.2), share)
    if engine.mounts is not None:
        reach = engine.crankshaft.main_positions[-1] + 15.0 * engine.cylinders.bore
        for k, place in enumerate(engine.mounts.positions, 1):
            if max(map(abs, place)) > reach:
                yield f"mounts: mount {k} lies {mm(max(map(abs, place)))} away, usual at most {mm(reach)}; {UNIT}"
                break


def _guidance(engine: Engine, skirt: PistonGuidance) -> Iterator[str]:
    bore = engine.cylinders.bore
    if skirt.upper_height <= skirt.lower_height:
        yield (
            f"piston_guidance.upper_height: {mm(skirt.upper_height)} is not above lower_height, "
            f"{mm(skirt.lower_height)}; both count upwards from the pin"
        )
    for key in ("upper_height", "lower_height", "mass_height"):
        yield from outside(f"piston_guidance.{key}", "over the bore it is", getattr(skirt, key) / bore, (-1.5, 1.5))
    yield from outside("piston_guidance.clearance", "radial play over bore is", skirt.clearance / bore, (0.0, 0.01))
    radius = (skirt.tilt_inertia / engine.cylinders.piston_mass) ** 0.5 / bore
    yield from outside("piston_guidance.tilt_inertia", "radius of gyration over bore is", radius, (0.1, 1.0))
