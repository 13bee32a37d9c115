"""Engine file from the sizes of an engine. Every value follows from a rule, which its note states.

Values without a rule of practice follow from physics. The heat per cycle gives the mean effective pressure; the intake
pressure brings the air for it; counterweights balance their throw as far as the pistons leave room; the flywheel limits
how unevenly the engine turns at its lowest speed; the stand-in springs of the mains carry a usual load at a usual
eccentricity. See :mod:`cranktrain.studies.design.sizes` for the proportions.
"""

import math
from collections.abc import Callable

from cranktrain.core.units import RPM
from cranktrain.engine.parts import Crankshaft
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.studies.design.balance import cylinder_places, free_forces
from cranktrain.studies.design.document import Block, Document, Entry, chosen, derived, given
from cranktrain.studies.design.equipment import damper, with_dual_mass
from cranktrain.studies.design.fitting import (
    FALLOFF,
    STEEL,
    Fitted,
    balanced_mass,
    counterweight,
    flywheel_inertia,
    full_load,
    gyration,
)
from cranktrain.studies.design.layouts import IN_LINE, VEE
from cranktrain.studies.design.limits import bearing_limits, limits
from cranktrain.studies.design.mounted_block import mounted_block, piston_guidance
from cranktrain.studies.design.sizes import BARE, FILLET, FLYING_WEB, LAMBDA, MECHANICAL_EFFICIENCY, Equipment, Sizes

HEISLER = "Heisler"
LOWER_HEATING, AIR_BURNT, GAS_CONSTANT, INTAKE_KELVIN = 43e6, 14.6, 287.0, 323.0
"""Lower heating value of a fuel, J/kg; air per fuel for combustion, kg/kg; gas constant of air, J/(kg K); charge
temperature, K."""
SPECIFIC_LOAD = 2.5e6
"""Mean load of a main bearing over its width and diameter, Pa, for the stiffness of its stand-in springs."""
DAMPING_TIME = 8e-5
"""Damping over stiffness of the main bearings' stand-in springs, s; a loss factor of 0.1 at 200 Hz."""
IRON = 110e9
"""Young's modulus of the block's cast iron, Pa."""
CUTOFF_SPEED = 270.0
"""Cut-off frequency of the running model times the bore, m/s; 3000 Hz for a bore of 90 mm."""
TWIST = math.radians(1.0)
"""Twist of the connecting shaft under the mean torque, rad."""
CHARGED = 1.1e5
"""Intake pressure above which an engine is called charged, Pa."""
ROUNDS = 4


def document(name: str, sizes: Sizes, equipment: Equipment = BARE) -> Document:
    """Complete engine file with this name, these sizes and the requested equipment.

    Raises ``InputError`` if the engine has no room, or no use, for the equipment.
    """
    sizes = sizes._replace(wide_mains=equipment.mounts)
    made = first_design(name, sizes)
    if equipment.dual_mass:
        made = with_dual_mass(made, sizes)
    made = made.with_blocks(piston_guidance(sizes), bearing_limits(), limits(sizes, made.engine))
    if equipment.damper is not None:
        made = made.with_blocks(damper(sizes, made.engine, equipment.damper))
    return made.with_blocks(*mounted_block(made, sizes)) if equipment.mounts else made


def first_design(name: str, sizes: Sizes) -> Document:
    """Engine file from sizes, with the heat per cycle that gives the mean effective pressure on the built-in cycle."""
    fitted = Fitted(sizes.swept * full_load(sizes) / sizes.fuel.efficiency, 0.6 * sizes.bore, 0.0, 1.0)
    for _ in range(ROUNDS):
        trace = GasTrace.from_engine(_document(name, sizes, fitted).engine)
        fitted = fitted._replace(heat=fitted.heat * full_load(sizes) / trace.imep)
    radius, balanced = counterweight(sizes, _document(name, sizes, fitted).engine)
    fitted = fitted._replace(radius=radius, balanced=balanced)
    flywheel = flywheel_inertia(sizes, _document(name, sizes, fitted).engine, trace)
    return _document(name, sizes, fitted._replace(flywheel=flywheel))


def _document(name: str, s: Sizes, fitted: Fitted) -> Document:
    layout, litres = s.layout, 1e3 * s.displacement
    title = f"{litres:.2g} l {layout.title}, {s.fuel_name}, {1e3 * s.bore:.7g} x {1e3 * s.stroke:.7g} mm"
    firing = f"fires {'-'.join(map(str, layout.order))}"
    intervals = ", ".join(f"{gap:.4g}" for gap in layout.intervals_deg)
    firing += f" every {720.0 / layout.cylinders:.4g} deg" if layout.even else f" at intervals of {intervals} deg"
    head: tuple[str, ...] = (
        f"{title}: a first design, made by cranktrain new; {firing}.",
        "Every value states its unit and where it comes from: chosen (by the user, or a figure of practice) or derived",
        "(from others, by the rule in the note). Put in what you know. B is the bore, r the throw.",
    )
    makers: tuple[Callable[[Sizes], Block], ...] = (_pulley, _rod, _cylinders, _mains, _big_ends, _thrust, _oil)
    blocks = [_material(), _crankshaft(s, fitted), _strength(s), _flywheel(s, fitted.flywheel),
              *(make(s) for make in makers),
              _drive_line(s, fitted.flywheel), _damping(), _combustion(s, fitted.heat), _reduction(s)]  # fmt: skip
    places = cylinder_places(Document(name, title, head, tuple(blocks)).engine)
    free = free_forces(layout, places.along)
    where = f"the distance a = {1e3 * places.distance:.4g} mm of {places.words} and " if places.words else ""
    head += (
        f"Free forces of the oscillating masses m: first order {free.first:.3g} m r w^2,",
        f"second order {free.second:.3g} lambda m r w^2; free moments {free.first_moment:.3g} m r w^2 a and "
        f"{free.second_moment:.3g} lambda m r w^2 a,",
        f"with {where}lambda = r over the length of the rod.",
    )
    return Document(name, title, head + ((f"Layout: {layout.note}.",) if layout.note else ()), tuple(blocks))


def _material() -> Block:
    note = "forged steel"
    return Block("material", "Of the crankshaft.", (
        chosen("youngs_modulus", 210.0, "GPa", note), chosen("poisson_ratio", 0.3, "1", note),
        chosen("density", STEEL, "kg/m^3", note),
    ))  # fmt: skip


def _mm(key: str, metres: float, note: str, of: Callable[..., Entry] = derived) -> Entry:
    """Entry of a length in mm."""
    return of(key, 1e3 * metres, "mm", note)


def _of_bore(s: Sizes, key: str, share: float, source: str) -> Entry:
    """Entry of a length that is a fraction of the bore."""
    return _mm(key, share * s.bore, f"{share:.3g} B, {source}")


def _crankshaft(s: Sizes, fitted: Fitted) -> Block:
    throws, b, of = len(s.layout.throws_deg), s.bore, s.proportions
    if s.crank is not None:
        return found_crankshaft(s.crank)
    bays = throws // 2 if s.layout.split else throws
    source = HEISLER if s.rods_on_pin == 1 else "two rods on a pin"
    pin = f"{s.pin_width / b:.3g} B, {HEISLER}" if s.rods_on_pin == 1 else "two big ends of 0.26 B and their fillets"
    main = (
        "distance of cylinders 1.20 B less pin and webs, " + HEISLER
        if s.rods_on_pin == 1
        else f"{s.main_width / b:.3g} B, {source}"
    )
    main += "; room for bulkheads between the cylinders" if s.wide_mains and s.vee else ""
    note = f"half disc; balances {100.0 * fitted.balanced:.0f} % of {balanced_mass(s)}, in the room under the pistons"
    return Block("crankshaft", "Angles of throws from the vertical, in the sense of rotation.", (
        given("throw", 1e3 * s.throw, "mm", "half the stroke", "derived"),
        derived("throw_angles", s.layout.throws_deg, "deg", "bank angle less firing angle of each cylinder"),
        _of_bore(s, "main_diameter", of.main, of.source),
        derived("main_widths", (bays + 1) * [1e3 * s.main_width], "mm", f"between webs: {main}"),
        _of_bore(s, "pin_diameter", of.pin, of.source),
        _mm("pin_width", s.pin_width, f"between webs: {pin}"),
        _of_bore(s, "web_thickness", s.web / b, source),
        _of_bore(s, "web_main_radius", of.about_main, "a shoulder around journal and fillet"),
        _of_bore(s, "web_pin_radius", of.about_pin, "a shoulder around pin and fillet"),
        _mm("counterweight_radius", fitted.radius, note),
        _mm("counterweight_half_width", fitted.radius, "half disc"),
        *_counterweights(s, bays),
        _of_bore(s, "nose_diameter", 0.45, "fits the usual pulley hubs"),
        _of_bore(s, "nose_length", 0.55, "pulley and timing drive"),
        _of_bore(s, "flange_diameter", 1.05, "wider than journal and fillets"),
        _of_bore(s, "flange_length", 0.20, "usual"),
        _of_bore(s, "fillet", FILLET, HEISLER),
        _of_bore(s, "oil_hole_diameter", 0.06, "used where oil_holes is true"),
        chosen("oil_holes", False, "", "they change frequencies little and cost elements"),
        _of_bore(s, "mesh_size", 0.17, "largest element edge; the solid crank takes seconds a throw"),
    ))  # fmt: skip


def _counterweights(s: Sizes, bays: int) -> tuple[Entry, ...]:
    """Entries on webs with counterweights, and on split pins."""
    if not s.layout.split:
        return (chosen("counterweights", 2 * bays * [True], "", "at every web"),)
    note = f"{FLYING_WEB:g} B, between the pins of a pair"
    return (
        chosen("counterweights", bays * [True, False, True], "", "at every web beside a main journal"),
        chosen("pins_between_mains", bays * [2], "", "split pins, a pair between two mains"),
        _mm("flying_web_thickness", s.flying_web, note, chosen),
    )


def _flywheel(s: Sizes, polar: float) -> Block:
    mass, width = polar / gyration(s) ** 2, 0.35 * s.bore
    return Block("flywheel", "A disc on the flange; offsets count from there, away from the engine.", (
        derived("mass", mass, "kg", "polar inertia over the square of a radius of gyration of 1.35 B, or of 1.35 r"),
        derived("polar_inertia", polar, "kg m^2",
                "W / (delta omega^2), Köhler and Flierl, less crank, rods and pistons: irregularity delta of "
                "0.15 from the excess work W of the gas, at the lowest speed and full load, or the disc of a clutch"),
        derived("diametral_inertia", 0.5 * polar + mass * width**2 / 12.0, "kg m^2", "a disc 0.35 B wide"),
        _mm("offset", 0.10 * s.bore, "0.1 B behind the flange"),
    ))  # fmt: skip


def _pulley(s: Sizes) -> Block:
    mass, gyration, width = 0.5 * STEEL * s.bore**3, 0.57 * s.bore, 0.35 * s.bore
    polar = mass * gyration**2
    return Block("pulley", "On the nose; a torsional damper is a table [damper] of its own.", (
        derived("mass", mass, "kg", "half a cube of steel with edges of B"),
        derived("polar_inertia", polar, "kg m^2", "radius of gyration of 0.57 B"),
        derived("diametral_inertia", 0.5 * polar + mass * width**2 / 12.0, "kg m^2", "a disc 0.35 B wide"),
        chosen("offset", 0.0, "mm", "in the middle of the nose"),
    ))  # fmt: skip


def _rod(s: Sizes) -> Block:
    big, small, fuel = s.big_end_mass, s.small_end_mass, s.fuel
    points = big * small / (big + small) * s.rod_length**2
    rule = f"throw to rod {s.throw / s.rod_length:.3g}"
    ratio = f"; the larger of r / {LAMBDA:g} and r + B"
    length = _mm("length", s.rod_length, rule + ratio)
    if s.rod_given:
        length = given("length", 1e3 * s.rod_length, "mm", f"given; {rule}")
    note = f"of a rod of {1e-3 * fuel.rod:.3g} g/cm^3 x B^3, usual for {s.fuel_name} engines"
    return Block("rod", "Its masses at big and small end stand for its mass and its centre of mass.", (
        length, derived("big_end_mass", big, "kg", f"0.7 {note}"),
        derived("small_end_mass", small, "kg", f"0.3 {note}"),
        derived("inertia", 0.94 * points, "kg m^2", "about the centre of mass: 0.94 of that of two point masses"),
    ))  # fmt: skip


def _cylinders(s: Sizes) -> Block:
    layout = s.layout
    order = {IN_LINE: "usual in line", VEE: "first bank 1 to n/2, second bank from n/2 + 1 on"}.get(
        layout.form, "odd numbers to one side, even ones to the other"
    )
    rods = "two rods on each pin" if s.rods_on_pin == 2 else "one rod on each pin"
    entries = [
        _mm("bore", s.bore, s.bore_note, chosen) if s.crank else given("bore", 1e3 * s.bore, "mm", s.bore_note),
        chosen("firing_order", layout.order, "", order),
        derived("pins", layout.pins, "", rods),
        chosen("bank_angles", layout.banks_deg, "deg", f"{layout.bank_deg:g} deg between the banks"),
        derived("piston_mass", s.piston_mass, "kg", f"with pin and rings: {1e-3 * s.fuel.piston:.3g} g/cm^3 x B^3, "
                f"usual for {s.fuel_name} engines"),
        chosen("pin_offset", 0.0, "mm", "none"),
        chosen("compression_ratio", _compression(s), "1", f"usual for {s.fuel_name}"),
    ]  # fmt: skip
    if s.rods_on_pin == 2:
        half = 0.5 * s.pin_width / s.rods_on_pin
        offsets = [1e3 * (-half if k < layout.cylinders // 2 else half) for k in range(layout.cylinders)]
        entries.append(derived("rod_offsets", offsets, "mm", "side by side on their pin"))
    if not layout.even:
        note = "uneven, as shared pins make it; from each cylinder of the order to the next"
        entries.append(derived("firing_intervals", layout.intervals_deg, "deg", note))
    return Block("cylinders", f"{layout.title}.", tuple(entries))


def _compression(s: Sizes) -> float:
    charged = s.fuel_name == "petrol" and _intake(s) > CHARGED
    return s.fuel.compression - (1.0 if charged else 0.0)


def _intake(s: Sizes) -> float:
    """Intake pressure, Pa, that brings the air for the heat of the full load; at least that of the ambient air."""
    fuel = s.fuel
    burnt = full_load(s) / fuel.efficiency / LOWER_HEATING
    return max(1e5, fuel.air * AIR_BURNT * burnt * GAS_CONSTANT * INTAKE_KELVIN)


def _film(s: Sizes, diameter: float, width: float, of: str) -> tuple[Entry, ...]:
    """Common entries of main and big-end bearings."""
    return (
        _mm("diameter", diameter, f"the {of}'s"),
        _mm(
            "width", width, f"the {of}'s width less its fillets" if of == "journal" else "of one rod, less the fillets"
        ),
        derived("clearance", 5e2 * diameter, "um", "radial: half a thousandth of the diameter"),
        chosen("contact_height", 1.0, "um", "combined roughness at which the surfaces begin to touch"),
        chosen("contact_pressure", 300.0, "MPa", "of a usual lining"),
    )


def _mains(s: Sizes) -> Block:
    diameter, width = s.main_diameter, s.main_bearing_width
    film = SPECIFIC_LOAD * diameter * width / (5e-4 * diameter)
    block = IRON * width * 4.0 / 3.0
    loaded = "level linear: a load of 2.5 MPa over the projected area moves the journal by its clearance"
    return Block("main_bearing", "Plain mains; the springs stand in for film and block at level linear.", (
        *_film(s, diameter, width, "journal"),
        derived("stiffness_x", 0.5 * film, "N/m", "level linear: half of stiffness_y"),
        derived("stiffness_y", film, "N/m", f"{loaded}; modal shows the films' own"),
        derived("damping_x", 0.5 * film * DAMPING_TIME, "N s/m", "level linear: loss factor of 0.1 at 200 Hz"),
        derived("damping_y", film * DAMPING_TIME, "N s/m", "level linear: loss factor of 0.1 at 200 Hz"),
        derived("block_stiffness_x", 0.3 * block, "N/m", "on ground: 0.3 of block_stiffness_y"),
        derived("block_stiffness_y", block, "N/m",
                "on ground: bulkhead of cast iron of 110 GPa, as thick as the bearing, 4/3 as wide as high"),
    ))  # fmt: skip


def _big_ends(s: Sizes) -> Block:
    return Block("big_end_bearing", "Plain big ends; used where they float.",
                 _film(s, s.pin_diameter, s.big_end_width, "pin"))  # fmt: skip


def _thrust(s: Sizes) -> Block:
    inner = s.main_diameter + 2.0 * s.fillet
    outer = inner + 0.24 * s.bore if s.crank is None else max(2.0 * s.crank.web_main_radius, 1.1 * inner)
    area = 0.25 * math.pi * (outer**2 - inner**2)
    return Block("thrust", "Axial bearing at one main; clearance is the whole axial play.", (
        chosen("main", s.thrust_main, "", "the middle one" if s.crank is None else "see --thrust-main"),
        chosen("clearance", 0.2, "mm", "usual axial play"),
        _mm("inner_diameter", inner, "the journal's and its fillets"),
        _mm("outer_diameter", outer, "a ring 0.12 B wide" if s.crank is None else "the web's about the main axis"),
        chosen("pads", 4, "", "usual"),
        chosen("pad_fraction", 0.75, "1", "of the ring"),
        chosen("taper", 30.0, "um", "of the pads"),
        chosen("contact_height", 2.0, "um", "of the surfaces"),
        derived("contact_stiffness", 0.5 * 210e9 * area / s.main_diameter, "N/m",
                "the ring's area of steel over two journal diameters"),
        derived("block_stiffness", IRON * area / s.main_diameter, "N/m",
                "the ring's area of cast iron over one journal diameter"),
        derived("damping", DAMPING_TIME * 0.05 * IRON * area / s.main_diameter, "N s/m",
                "a twentieth of the block's stiffness times 80 us"),
    ))  # fmt: skip


def _oil(s: Sizes) -> Block:
    return Block("oil", "Viscosity, and temperature of the films over the engine's speeds.", (
        chosen("density", 850.0, "kg/m^3", "SAE 15W-40 when warm"),
        chosen("law", "vogel", "", "vogel or walther"),
        derived("vogel_a", 0.1073, "mPa s", "0.1 Pa s at 40 degC, 0.0143 at 100 degC, 0.0056 at 150 degC"),
        derived("vogel_b", 1031.94, "K", "same three points"), derived("vogel_c", 162.222, "K", "same three points"),
        derived("temperature_speeds", (s.lowest / RPM, s.rated / RPM), "rev/min",
                f"lowest speed, {s.fuel.lowest:g} of the rated one, and the rated one"),
        chosen("temperatures", (80.0, 105.0), "degC", "at those speeds, linear between"),
        chosen("supply_pressure", 4.0, "bar", "gauge"),
    ))  # fmt: skip


def _drive_line(s: Sizes, inertia: float) -> Block:
    torque = full_load(s) * s.displacement / (4.0 * math.pi)
    stiffness = torque / TWIST
    return Block("drive_line", "Shaft to a dynamometer, whose speed a run gives.", (
        derived("stiffness", stiffness, "N m/rad", "the mean torque at full load twists it by 1 deg"),
        derived("damping", 0.6 * math.sqrt(stiffness * inertia), "N m s/rad", "0.3 of critical with the flywheel"),
        chosen("speed_filter_time", 5.0, "ms", "of the dynamometer's speed"),
        derived("dynamometer_inertia", 10.0 * inertia, "kg m^2",
                "ten flywheels; counts where the load torque is given"),
    ))  # fmt: skip


def _damping() -> Block:
    return Block("damping", "Structural damping.", (
        chosen("kind", "modal", "", "modal or rayleigh"),
        chosen("ratio", 0.01, "1", "of every elastic mode"),
    ))  # fmt: skip


def _combustion(s: Sizes, heat: float) -> Block:
    fuel, intake = s.fuel, _intake(s)
    start, duration, exponent = fuel.burn
    power = f"{1e-3 * s.brake_power:.3g} kW at {s.rated / RPM:.0f} rev/min with a mechanical efficiency of "
    power += f"{MECHANICAL_EFFICIENCY:g}" + ("" if s.power_given else f", as is usual for {s.fuel_name}")
    charged = intake > CHARGED
    return Block("combustion", "One cylinder at full load; angles count from its firing dead centre.", (
        chosen("start", start, "deg", f"usual for {s.fuel_name}"), chosen("duration", duration, "deg", "usual"),
        derived("wiebe_a", 6.908, "1", "99.9 % burnt at the end"),
        chosen("wiebe_m", exponent, "1", f"usual for {s.fuel_name}"),
        derived("heat", 1e-3 * heat, "kJ", f"indicated mean effective pressure of {1e-5 * s.imep:.3g} bar at the rated "
                f"speed: {power}"),
        derived("intake_pressure", 1e-5 * intake, "bar",
                f"absolute; air for the heat, {fuel.air:g} of what burns it" if charged else "absolute; not charged"),
        chosen("intake_temperature", 50.0, "degC", "of the charge"),
        derived("exhaust_pressure", 1e-5 * (0.9 * intake if charged else 1.05e5), "bar",
                "absolute; 0.9 of the intake's" if charged else "absolute; behind the valves"),
        chosen("intake_closes", -150.0, "deg", "usual"), chosen("exhaust_opens", 130.0, "deg", "usual"),
        chosen("wall_temperature", 450.0, "K", "mean of piston, head and liner"),
        derived("best_speed", s.best / RPM, "rev/min", f"largest torque at {fuel.best:g} of the rated speed"),
        chosen("falloff", FALLOFF, "1", "part of the heat that is lost at twice that speed"),
    ))  # fmt: skip


def _strength(s: Sizes) -> Block:
    petrol = s.fuel_name == "petrol"
    note = "least; microalloyed steel 38MnVS6" if petrol else "least; 42CrMo4, quenched and tempered"
    return Block("crank_strength", "For the fatigue of the fillets.", (
        chosen("tensile_strength", 800.0 if petrol else 900.0, "MPa", note),
        chosen("forming", "grain-flow", "", "drop-forged"),
        chosen("roughness", 4.0, "um", "depth Rz of ground fillets"),
    ))  # fmt: skip


def _reduction(s: Sizes) -> Block:
    cutoff = float(f"{min(max(CUTOFF_SPEED / s.bore, 100.0), 20000.0):.2g}")
    return Block("reduction", "How the crankshaft is reduced to modes.", (
        chosen("fixed_modes", 60, "", "fixed-interface modes kept"),
        derived("running_cutoff_hz", cutoff, "Hz", "270 m/s over B; elastic modes of the running model"),
        chosen("consistent_mass", True, "", "usual"),
        chosen("torsional_source", *(
            ("solid", "", "crank level torsional by finite elements: no formula has split pins") if s.layout.split else
            ("ker-wilson", "", "crank level torsional by formula, without finite elements")
        )),
    ))  # fmt: skip


FROM_STEP = "measured in the STEP file"
LENGTH_DECIMALS, ANGLE_DECIMALS = 4, 6
"""Number of decimals of lengths in mm and of angles in deg."""


def found_crankshaft(c: Crankshaft) -> Block:
    """Table of a crankshaft's dimensions, m and rad, with origin measured."""

    def mm(key: str, value: float | tuple[float, ...], note: str = FROM_STEP) -> Entry:
        return Entry(key, _scaled(value, 1e3, LENGTH_DECIMALS), "mm", "derived", note)

    split = bool(c.pins_between_mains)
    entries = (
        mm("throw", c.throw),
        Entry("throw_angles", _scaled(c.throw_angles, 180.0 / math.pi, ANGLE_DECIMALS), "deg", "derived",
              f"{FROM_STEP}; turned as the layout has them"),
        mm("main_diameter", c.main_diameter),
        mm("main_widths", c.main_widths, f"between webs, {FROM_STEP}"),
        mm("pin_diameter", c.pin_diameter),
        mm("pin_width", c.pin_width, f"between webs, {FROM_STEP}"),
        mm("web_thickness", c.web_thickness),
        mm("web_main_radius", c.web_main_radius, f"outline about the main axis, {FROM_STEP}"),
        mm("web_pin_radius", c.web_pin_radius, f"outline about the pin axis, {FROM_STEP}"),
        mm("counterweight_radius", c.counterweight_radius),
        mm("counterweight_half_width", c.counterweight_half_width),
        Entry("counterweights", list(c.counterweights), "", "derived", FROM_STEP),
        *((Entry("pins_between_mains", list(c.pins_between_mains), "", "derived", FROM_STEP),
           mm("flying_web_thickness", c.flying_web_thickness)) if split else ()),
        *((mm("pin_throws", c.pin_throws),) if c.pin_throws else ()),
        mm("nose_diameter", c.nose_diameter),
        mm("nose_length", c.nose_length, f"from main journal 1 to the front end, {FROM_STEP}"),
        mm("flange_diameter", c.flange_diameter),
        mm("flange_length", c.flange_length, f"from the last main journal to the rear end, {FROM_STEP}"),
        mm("fillet", c.fillet),
        mm("oil_hole_diameter", c.oil_hole_diameter, "used where oil_holes is true"),
        Entry("oil_holes", False, "", "chosen", "the mesh of the STEP file has its own"),
        mm("mesh_size", c.mesh_size, "largest element edge"),
    )  # fmt: skip
    return Block("crankshaft", "Angles of throws from the vertical, in the sense of rotation.", entries)


def _scaled(value: float | tuple[float, ...], factor: float, decimals: int) -> float | list[float]:
    if isinstance(value, tuple):
        return [round(factor * one, decimals) + 0.0 for one in value]
    return round(factor * value, decimals) + 0.0
