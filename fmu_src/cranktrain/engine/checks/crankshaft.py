"""Checks of a crankshaft, the rods on its pins and the damper on its pulley.

Faults are refused in one line before any CAD kernel runs. For example every cylinder fires once, and rods on one pin
lie side by side.
"""

import math
from functools import partial
from itertools import accumulate, pairwise

from cranktrain.engine.articulated_rod import ARTICULATED, reach
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import BalanceWeights, Crankshaft, Cylinders, Damper
from cranktrain.engine.quantities import (
    NEWTONIAN,
    ZERO_CELSIUS,
    check_values,
    kinds,
    mm,
    need,
    need_equal_lengths,
    need_table,
)

# Densities of the lightest and heaviest metal of a damper ring, kg/m³: light alloy to tungsten.
RING_DENSITIES = (2500.0, 19500.0)
MOST_APART = 0.7
"""Largest distance of two pins that meet without a web, over their diameter; they then overlap in a quarter section."""
LEAST_APART = 1e-3
"""Distance of two pins, over their diameter, below which they count as one pin."""
_LENGTHS = ("ring_outer_radius", "ring_inner_radius", "ring_width")
_GAPS = ("axial_gap", "outer_gap", "inner_gap")
_cylinders = partial(need, "cylinders")


def check_crankshaft(c: Crankshaft) -> None:
    """Refuse parameters that describe no crankshaft, before any CAD kernel runs.

    Raises ``InputError``, one line that starts with the key, e.g. ``crankshaft.web_pin_radius``.
    """
    of = partial(need, "crankshaft")
    _check_layout(c)
    check_values(c, "crankshaft")
    for k, (count, first) in enumerate(zip(c.bays, accumulate(c.bays, initial=0), strict=False)):
        for number in range(first + 1, first + count):
            _check_neighbours(c, number)
        flying = c.counterweights[first + k + 1 : first + k + count]
        of("counterweights", not any(flying), "a flying web, between two pins, carries none; give false for it")
    main, pin = 0.5 * c.main_diameter + c.fillet, 0.5 * c.pin_diameter + c.fillet
    least = min((c.pin_width, *c.main_widths))
    text = f"the pin lies outside its web: {mm(c.web_pin_radius)} is less than its radius and fillet, {mm(pin)}"
    of("web_pin_radius", c.web_pin_radius >= pin, text)
    text = f"the main journal lies outside the web: {mm(c.web_main_radius)} is less than radius and fillet, {mm(main)}"
    of("web_main_radius", c.web_main_radius >= main, text)
    text = f"two fillets of {mm(c.fillet)} leave nothing of the narrowest journal, {mm(least)}"
    of("fillet", 2.0 * c.fillet < least, text)
    text = f"{mm(c.nose_diameter)} and two fillets must be thinner than the main journal, {mm(c.main_diameter)}"
    of("nose_diameter", 0.5 * c.nose_diameter + c.fillet < 0.5 * c.main_diameter, text)
    of("nose_length", c.nose_length > c.fillet, f"{mm(c.nose_length)} is shorter than the fillet")
    text = f"{mm(c.flange_diameter)} must be wider than the last main journal and its fillets, {mm(2.0 * main)}"
    of("flange_diameter", 0.5 * c.flange_diameter > main, text)
    if any(c.counterweights):
        text = f"{mm(c.counterweight_radius)} does not reach beyond the web, {mm(c.web_main_radius)}"
        of("counterweight_radius", c.counterweight_radius > c.web_main_radius, text)
        text = f"{mm(c.counterweight_half_width)} is narrower than the main journal with its fillet, {mm(main)}"
        of("counterweight_half_width", c.counterweight_half_width > main, text)
    widest = min(0.5 * min(c.pin_diameter, c.main_diameter), least - 2.0 * c.fillet)
    text = f"{mm(c.oil_hole_diameter)} does not fit between the fillets or exceeds half of a journal's diameter"
    of("oil_hole_diameter", c.oil_hole_diameter < widest or not c.oil_holes, text)
    finest = 0.02 * c.main_diameter
    text = f"{mm(c.mesh_size)} would take millions of elements; give at least {mm(finest)}"
    of("mesh_size", c.mesh_size >= finest, text)


def _check_layout(c: Crankshaft) -> None:
    """Raise ``InputError`` if the lists of pins, main journals and webs do not fit each other."""
    of, throws, widths, webs = (
        partial(need, "crankshaft"),
        len(c.throw_angles),
        len(c.main_widths),
        len(c.counterweights),
    )
    of("throw_angles", throws >= 1, "is empty; give the angle of each throw")
    text = f"{len(c.pin_throws)} values for {throws} throws; give one for each, or none"
    of("pin_throws", len(c.pin_throws) in (0, throws), text)
    if c.pin_throws:
        of("pin_throws", c.pin_throws[0] == c.throw, f"begins with {mm(c.pin_throws[0])}, throw is {mm(c.throw)}")
    bays, pins = c.pins_between_mains, sum(c.pins_between_mains)
    text = f"{pins} pins between mains, but throw_angles has {throws}; give the number of pins from main to main"
    of("pins_between_mains", not bays or (pins == throws and min(bays) > 0), text)
    if not bays:
        text = (
            f"{widths} widths for {throws} throws; give one more than there are throws, or say by pins_between_mains "
            "where mains are"
        )
        of("main_widths", widths == throws + 1, text)
    text = f"{widths} widths for {len(bays)} entries of pins_between_mains; give one more than these"
    of("main_widths", not bays or widths == len(bays) + 1, text)
    wanted = throws + len(c.bays)
    text = f"{webs} entries for {throws} throws; give one for each of the two webs of a throw"
    if bays:
        text = f"{webs} entries for {wanted} webs; give one for each in their order, flying ones (false) included"
    of("counterweights", webs == wanted, text)


def _check_neighbours(c: Crankshaft, pin: int) -> None:
    """Refuse two pins that meet without a web and overlap too little; ``pin`` is the first of them."""
    (first, second), (low, high) = c.throws[pin - 1 : pin + 1], c.throw_angles[pin - 1 : pin + 1]
    apart = math.sqrt(first**2 + second**2 - 2.0 * first * second * math.cos(high - low))
    text = f"pins {pin} and {pin + 1} lie in line; make them one pin, which cylinders.pins may name more than once"
    need("crankshaft", "throw_angles", apart > LEAST_APART * c.pin_diameter, text)
    most = MOST_APART * c.pin_diameter
    text = f"pins {pin} and {pin + 1} lie {mm(apart)} apart and overlap too little to meet without a web; give one"
    need("crankshaft", "flying_web_thickness", c.flying_web_thickness > 0.0 or apart <= most, text)


def check_balance_weights(weights: BalanceWeights, mains: int) -> None:
    """Refuse balance weights that are incomplete or at no journal; the error starts with ``balance_weights.key``."""
    need_equal_lengths(weights, "balance_weights")
    for main in weights.mains:
        text = f"{main} is not one of the main journals 1..{mains}"
        need("balance_weights", "mains", 1 <= main <= mains, text)


def check_cylinders(engine: Engine) -> None:
    """Raise ``InputError`` (starting with ``table.key``) for rods, firing orders, pins and banks that do not fit."""
    crank, length, cylinders = engine.crankshaft, engine.rod.length, engine.cylinders
    pins, n, throws = cylinders.pins, len(cylinders.firing_order), len(crank.throw_angles)
    given = len(cylinders.axis_offsets)
    _cylinders("axis_offsets", given in (0, n), f"{given} values for {n} cylinders; give one for each, or none")
    across = max(crank.throws) + max(map(abs, engine.offsets))
    need("rod", "length", length > across, f"{mm(length)} is shorter than throw and pin offset, {mm(across)}")
    joint = engine.articulated_rod
    text = 'is there, but no rod hangs on another; write cylinders.rods_on_pin = "articulated", or leave it out'
    need("articulated_rod", "length", joint is None or cylinders.rods_on_pin == ARTICULATED, text)
    # Webs are below the piston at bottom dead centre.
    lowest, under = length - crank.throw, any(crank.counterweights) and crank.pin_width < cylinders.bore
    text = (
        f"{mm(crank.counterweight_radius)} reaches the piston's pin, which comes within {mm(lowest)} of the crank's "
        "axis; give less, and check that throw is half the stroke"
    )
    need("crankshaft", "counterweight_radius", not under or crank.counterweight_radius < lowest, text)
    _cylinders("firing_order", n >= 1, "is empty")
    _check_order(cylinders)
    _cylinders("pins", len(pins) == n, f"{len(pins)} pins for {n} cylinders; give one each")
    _cylinders(
        "pins", all(1 <= pin <= throws for pin in pins), f"{list(pins)} names a pin that is not one of 1..{throws}"
    )
    banks = len(cylinders.bank_angles)
    _cylinders("bank_angles", banks == n, f"{banks} angles for {n} cylinders; give one for each")
    for key in ("firing_angles", "firing_intervals"):
        given = len(getattr(cylinders, key))
        _cylinders(key, given in (0, n), f"{given} values for {n} cylinders; give one for each, or none")
    text = f"{math.degrees(cylinders.cycle):g} deg is neither 720 deg of a four-stroke nor 360 deg of a two-stroke"
    _cylinders("cycle", min(abs(cylinders.cycle - turns * math.pi) for turns in (2.0, 4.0)) < 1e-9, text)
    both = bool(cylinders.firing_angles and cylinders.firing_intervals)
    _cylinders("firing_intervals", not both, "and firing_angles are both given; leave one of them out")
    _check_rods(engine)
    if cylinders.rods_on_pin == ARTICULATED:
        _check_articulated(engine)


def _check_articulated(engine: Engine) -> None:
    """Refuse articulated rods that are not described, share no pin with a master rod or miss their cylinders."""
    joint, pins, n = engine.articulated_rod, engine.cylinders.pins, engine.n_cylinders
    _cylinders("rods_on_pin", len(set(pins)) < n, "is articulated, but no pin of cylinders.pins has two rods")
    _cylinders(
        "rods_on_pin", joint is not None, "is articulated; add the table [articulated_rod] of the rods that hang"
    )
    assert joint is not None
    of, angles = partial(need, "articulated_rod"), joint.knuckle_angles
    of("knuckle_angles", len(angles) in (0, n), f"{len(angles)} angles for {n} cylinders; give one for each, or none")
    for c, own in enumerate(engine.articulations):
        text = f"is {math.degrees(angles[c] if angles else 0.0):.4g} deg for cylinder {c + 1}, a master rod's; give 0"
        of("knuckle_angles", own is not None or not angles or angles[c] == 0.0, text)
    longest = engine.rod.length
    text = f"{mm(joint.knuckle_radius)} is no less than the master rod's length, {mm(longest)}"
    of("knuckle_radius", joint.knuckle_radius < longest, text)
    for c, own in enumerate(engine.articulations):
        if own is not None:
            text = f"rods {own.master + 1} and {c + 1} on pin {pins[c]} lie in one plane; leave rod_offsets out"
            _cylinders("rod_offsets", engine.rod_offsets[c] == engine.rod_offsets[own.master], text)
            across = reach(engine, c)
            text = f"{mm(joint.length)} is too short for cylinder {c + 1}: its knuckle pin moves {mm(across)} across it"
            of("length", across < joint.length, text)
    for frame in engine.frame:
        shared = 0 < frame.cylinder <= n and pins.count(pins[frame.cylinder - 1]) > 1
        text = f"has master or articulated rods on its pin, which no frame follows; leave cylinder {frame.cylinder} out"
        need(f"frame '{frame.name}'", "cylinder", not shared, text)


def _check_order(cylinders: Cylinders) -> None:
    """Refuse a firing order in which a cylinder fires twice or never."""
    order, pins, banks = cylinders.firing_order, len(cylinders.pins), len(cylinders.bank_angles)
    # If pins and banks agree on the number of cylinders, the firing order may have lost one.
    n = pins if pins == banks else len(order)
    twice = sorted({c for c in order if order.count(c) > 1})
    never = sorted(set(range(1, n + 1)) - set(order))
    strange = sorted(set(order) - set(range(1, n + 1)))
    wrong = [f"cylinder {c} fires twice" for c in twice[:1]]
    wrong += [f"cylinder {c} of 1..{n} never fires" for c in never[:1]]
    spare = (twice or strange)[:1]
    remedy = f"; put {never[0]} in place of {'one ' if twice else 'the '}{spare[0]}" if spare and never else ""
    _cylinders("firing_order", not (twice or never), f"{', '.join(wrong)}{remedy or '; each fires once'}")
    _cylinders("firing_order", not strange, f"cylinder {(strange or (0,))[0]} has no pin; cylinders.pins knows 1..{n}")


def _check_rods(engine: Engine) -> None:
    """Refuse rods on a common pin that are neither side by side nor in one plane, as ``rods_on_pin`` states."""
    crank, cylinders, big_end = engine.crankshaft, engine.cylinders, engine.big_end_bearing
    n, offsets, half_pin = len(cylinders.firing_order), cylinders.rod_offsets, 0.5 * crank.pin_width
    one_plane = {"fork-and-blade": "a fork and its blade", ARTICULATED: "a master rod and those that hang on it"}
    text = f"{len(offsets)} offsets for {n} cylinders; give one for each, or none"
    _cylinders("rod_offsets", len(offsets) in (0, n), text)
    for k, offset in enumerate(offsets, start=1):
        text = f"rod {k} at {mm(offset)} lies beside its pin, which ends {mm(half_pin)} from its middle"
        _cylinders("rod_offsets", abs(offset) < half_pin, text)
    if big_end is None:
        return
    width = big_end.width
    for pin in sorted(set(cylinders.pins)):
        rods = sorted((engine.rod_offsets[k], k + 1) for k in range(n) if cylinders.pins[k] == pin)
        if rods == [(0.0, rods[0][1])]:
            continue  # the width of a single big end is checked with its big-end bearing
        if cylinders.rods_on_pin in one_plane:
            text = f"rods of {one_plane[cylinders.rods_on_pin]} on pin {pin} lie in one plane; leave rod_offsets out"
            _cylinders("rod_offsets", all(offset == rods[0][0] for offset, _ in rods), text)
            blades = len(rods) <= 2 or cylinders.rods_on_pin == ARTICULATED
            _cylinders("rods_on_pin", blades, f"{len(rods)} rods on pin {pin}; a fork has one blade")
            continue
        names = " and ".join(str(k) for _, k in rods)
        together = len(rods) * width
        text = (
            f"pin {pin} is {mm(crank.pin_width)} wide, but rods {names} of {mm(width)} each need {mm(together)}; "
            f"widen it or lessen big_end_bearing.width to {mm(crank.pin_width / len(rods))}"
        )
        need("crankshaft", "pin_width", together <= crank.pin_width, text)
        for (before, first), (after, second) in pairwise(rods):
            text = (
                f"rods {first} and {second} overlap on pin {pin}: {mm(after - before)} apart, their big ends "
                f"{mm(width)} wide; set them at least {mm(width)} apart, e.g. at -{mm(0.5 * width)} and "
                f"{mm(0.5 * width)}"
            )
            _cylinders("rod_offsets", after - before >= width * (1.0 - 1e-9), text)
        for offset, k in rods:
            text = (
                f"rod {k} at {mm(offset)} with its big end of {mm(width)} reaches beyond pin {pin}; keep within "
                f"{mm(half_pin - 0.5 * width)} of its middle"
            )
            _cylinders("rod_offsets", abs(offset) + 0.5 * width <= half_pin * (1.0 + 1e-9), text)


def check_damper(d: Damper) -> None:
    """Raise ``InputError`` (starting with ``damper.key``) for values that describe no damper."""
    of, lowest, highest = partial(need, "damper"), d.lowest_temperature, d.highest_temperature
    if d.kind == "linear":
        _check_linear_damper(d)
        return
    needed = ("mass", "frequency", "lowest_temperature", "highest_temperature", "temperatures", "ambient_temperature",
              "heat_transfer", "cooling_area", "power_limit")  # fmt: skip
    for key in needed:
        many, rule = kinds(Damper)[key][1:]
        text = "is missing" if many else rule.wrong(getattr(d, key))
        of(key, bool(getattr(d, key)), f"{text}; a damper of kind {d.kind} needs it")
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


def _check_linear_damper(d: Damper) -> None:
    """Refuse a damper of kind ``linear`` that lacks stiffness and damping, or whose columns differ in length."""
    of = partial(need, "damper")
    if not d.frequencies:
        of("damping", d.damping > 0.0 or d.stiffness > 0.0, "is missing; a linear damper needs damping or stiffness")
        return
    for key in ("stiffnesses", "dampings"):
        count = len(getattr(d, key))
        of(key, count == len(d.frequencies), f"{count} values for {len(d.frequencies)} frequencies; give one for each")
    of("frequencies", all(a < b for a, b in pairwise(d.frequencies)), "must increase")
    text = "is missing; give the frequency whose stiffness and damping runs in time take"
    of("frequency", d.frequency > 0.0, text)
