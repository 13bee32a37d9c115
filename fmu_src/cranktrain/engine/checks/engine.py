"""Checks that the parts of an engine fit together: bounds of single values first, then rules between values.

For values that are possible but unlikely together :mod:`cranktrain.engine.checks.plausible` gives warnings.
"""

import math
import warnings
from dataclasses import fields, is_dataclass
from functools import partial

from cranktrain.core.errors import InputError, nearest
from cranktrain.engine.additions import check_additions, split_end
from cranktrain.engine.checks.block import check_block, check_mounts
from cranktrain.engine.checks.crankshaft import check_balance_weights, check_crankshaft, check_cylinders, check_damper
from cranktrain.engine.checks.mounts import check_mount_dynamics
from cranktrain.engine.checks.oil import check_oil
from cranktrain.engine.checks.plausible import warn_of_doubts
from cranktrain.engine.drive_line_chain import FURTHER, DriveLineChain
from cranktrain.engine.firing import uneven
from cranktrain.engine.limits import JUDGED, MAIN
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Combustion, PlainBearing
from cranktrain.engine.quantities import check_values, mm, need, need_equal_lengths
from cranktrain.engine.rod_shape import check_rod_shape
from cranktrain.engine.roller_bearing import check_rollers
from cranktrain.engine.torsional_chain import LINE_ENDS, check_chain, gear_speeds


def check_bearings(engine: Engine) -> None:
    """Raise ``InputError`` (starting with ``table.key``) for bearings that do not fit their journals."""
    crank, main, big_end = engine.crankshaft, engine.main_bearing, engine.big_end_bearing
    if main is None and engine.main_roller is None:
        raise InputError(
            "main_bearing: is missing; the mains are plain bearings ([main_bearing]) or roller bearings ([main_roller])"
        )
    if main is not None and not engine.plain_numbers:
        raise InputError(
            "main_bearing: is given together with [main_roller]; keep one of the two, or name the mains that run on "
            "rollers, as main_roller.mains = [1]"
        )
    if main is None and engine.plain_numbers:
        raise InputError(
            f"main_bearing: is missing for mains {', '.join(str(i + 1) for i in engine.plain_numbers)}, which are not "
            "among main_roller.mains; add the table, or leave main_roller.mains out"
        )
    if main is not None:
        _check_film("main_bearing", main, "main journal", crank.main_diameter, min(crank.main_widths))
    if big_end is not None:
        _check_film("big_end_bearing", big_end, "crank pin", crank.pin_diameter, crank.pin_width)
    if engine.bearing_limits is not None and engine.rollers_only:
        for what in JUDGED:
            text = "limits a film, and the mains are roller bearings; leave it out"
            need("bearing_limits", f"main_{what}", engine.bearing_limits.of(MAIN, what) == 0.0, text)
    of, thrust, mains = partial(need, "thrust"), engine.thrust, len(crank.main_widths)
    inner, outer, journal = thrust.inner_diameter, thrust.outer_diameter, crank.main_diameter
    of("main", 1 <= thrust.main <= mains, f"{thrust.main} is not one of the main journals 1..{mains}")
    of("inner_diameter", inner < outer, f"{mm(inner)} is not less than outer_diameter {mm(outer)}")
    text = f"{mm(inner)} is less than the main journal it surrounds, {mm(journal)}"
    of("inner_diameter", inner >= journal, text)
    text = f"two of {mm(thrust.contact_height)} leave nothing of the clearance, {mm(thrust.clearance)}"
    of("contact_height", 2.0 * thrust.contact_height < thrust.clearance, text)


def _check_film(table: str, film: PlainBearing, journal: str, diameter: float, narrowest: float) -> None:
    """Refuse a plain bearing that does not fit journals of ``diameter`` with least width ``narrowest``."""
    of, clearance = partial(need, table), film.clearance
    text = f"{mm(film.diameter)} does not fit the {journal}, {mm(diameter)}"
    of("diameter", abs(film.diameter - diameter) <= 0.01 * diameter, text)
    text = f"{mm(film.width)} is wider than the narrowest {journal}, {mm(narrowest)}"
    of("width", film.width <= narrowest, text)
    text = f"{mm(clearance)} is more than 1 % of the diameter; it is the radial clearance, often given in um"
    of("clearance", clearance < 0.01 * film.diameter, text)
    text = f"{mm(film.contact_height)} is not less than the clearance, {mm(clearance)}"
    of("contact_height", film.contact_height < clearance, text)
    text = (
        f"six of {1e6 * film.roughness:.4g} um bridge the clearance, {1e6 * clearance:.4g} um; "
        "it is the standard deviation of the heights, a fraction of a micrometre"
    )
    of("roughness", 6.0 * film.roughness < clearance, text)
    text = f"{1e6 * film.relief.depth:.4g} um is more than the clearance, {1e6 * clearance:.4g} um; give a few um"
    of("relief_depth", film.relief.depth <= clearance, text)
    text = f"{mm(film.supply_width)} leaves no land of the bearing's width, {mm(film.width)}; give less than that"
    of("supply_width", film.supply_width < film.width, text)


LEAST_EXCHANGE = math.radians(20.0)
"""Least crank angle from exhaust opening to intake closing, as the fastest two-strokes have."""


def check_engine(engine: Engine) -> None:
    """Refuse an engine whose parts do not fit together.

    Raises ``InputError``, one line that starts with ``table.key``.
    """
    charts = "BICERA's method reads charts, there is no closed form of it; use ker-wilson, carter or solid"
    source = engine.reduction.torsional_source.lower()
    need("reduction", "torsional_source", not source.startswith("bicer"), charts)
    check_crankshaft(engine.crankshaft)
    for entry in fields(engine):
        part = getattr(engine, entry.name)
        if is_dataclass(part):
            check_values(part, entry.name)
    mains = len(engine.crankshaft.main_widths)
    if engine.balance_weights is not None:
        check_balance_weights(engine.balance_weights, mains)
    check_cylinders(engine)
    check_bearings(engine)
    for name in ("flywheel", "pulley", "clutch"):
        if (part := getattr(engine, name)) is not None:
            plausible = part.polar_inertia <= 2.0 * part.diametral_inertia * (1.0 + 1e-9)
            need(name, "polar_inertia", plausible, "is more than twice diametral_inertia, which no body has")
    check_oil(engine.oil)
    _check_gas(engine)
    need_equal_lengths(engine.published, "published", "cranktrain_hz", "cranktrain_shapes", "measured_hz")
    orders = ("critical_orders", "critical_speeds", "measured_critical_speeds")
    need_equal_lengths(engine.published, "published", *orders)
    if engine.damper is not None:
        check_damper(engine.damper)
    if engine.main_roller is not None:
        check_rollers(engine.main_roller, engine.crankshaft)
    if engine.drive_line_chain is not None:
        check_drive_line(engine.drive_line_chain)
    if engine.load is not None:
        key = "power" if engine.load.kind == "power" else "torque"
        need("load", key, getattr(engine.load, key) > 0.0, f"is missing; a load of kind {engine.load.kind} needs it")
    if engine.rod_shape is not None:
        check_rod_shape(engine, engine.rod_shape)
    check_additions(engine.additions, engine.n_cylinders)
    _check_line_start(engine)
    if engine.axial_path is not None and engine.axial_path.joint == "spline":
        text = "is missing; a spline slides by friction x torque / spline_radius; give it, or take joint bolted"
        for key in ("spline_radius", "friction"):
            need("axial_path", key, getattr(engine.axial_path, key) > 0.0, text)
    for text in uneven(engine):  # raises an error if the throws cannot fire in this order
        warnings.warn(f"{engine.name}: {text}", stacklevel=2)
    if engine.mounts is not None:
        check_mounts(engine.mounts)
    check_mount_dynamics(engine)
    text = "is that of trunk pistons in their liners and has no guide of a crosshead; leave [block] or crosshead out"
    need("block", "deck_height", engine.block is None or not engine.cylinders.crosshead, text)
    few = len(engine.damping.torsional_ratios) <= 2
    need("damping", "torsional_ratios", few, "has more than two entries; give the first one or two torsional modes")
    if engine.block is not None:  # checked after the mounts, whose pads are part of the block
        check_block(engine, engine.block)
    warn_of_doubts(engine)  # warnings only for an engine whose parts fit


def _check_line_start(engine: Engine) -> None:
    """Raise ``InputError`` if the drive line begins where nothing can drive it."""
    start = engine.drive_line.start
    (name, interface), bodies = split_end(start), {table.name: table for table in engine.body}
    known = ["crank", *bodies]
    need("drive_line", "start", name in known, f"no body '{name}'; {nearest(name, known)}")
    need("drive_line", "start", bool(interface), f"'{start}' names no interface; write body.interface")
    if engine.line_on_crank:
        return
    own = bodies[name].interfaces
    need("drive_line", "start", not own or interface in own, f"body '{name}' has no interface '{interface}'; "
         f"{nearest(interface, own)}")  # fmt: skip
    text = f"body '{name}' turns {engine.line_ratio:g} times as fast as the crank; begin at one that turns forwards"
    need("drive_line", "start", engine.line_ratio > 0.0, text)
    text = f"joins the shaft at the crank's flywheel, but the drive line begins at '{start}'; add an axial_joint"
    need("axial_path", "joint", engine.axial_path is None, text)
    lossy = engine.drive_line_chain is not None and any(engine.drive_line_chain.loss_factors)
    text = f"act in the modes of crank and line alone, but the line begins at '{start}'; give dampings"
    need("drive_line_chain", "loss_factors", not lossy, text)


def check_drive_line(line: DriveLineChain) -> None:
    """Raise ``InputError`` for lists of unequal length, or for no drive line from flywheel to dynamometer."""
    table = "drive_line_chain"
    columns = ("ends", "stiffnesses", "dampings", "loss_factors", "ratios", *FURTHER.values())
    given = [key for key in columns if getattr(line, key)]
    need_equal_lengths(line, table, "starts", *given)
    need_equal_lengths(line, table, "discs", "inertias", *(["disc_dampings"] if line.disc_dampings else []))
    _check_points(line, table)
    chain = line.chain
    zero = next((k for k, ratio in enumerate(line.ratios, 1) if ratio == 0.0), 0)
    need(table, f"ratios[{zero}]", not zero, "turns nothing; give the speed of the second end over that of the first")
    check_chain(table, chain, LINE_ENDS)
    gear_speeds(chain, table)


def _check_points(line: DriveLineChain, table: str) -> None:
    """Refuse points of shaft curves that do not increase, belong to no shaft, or have columns of different length."""
    keys = ("point_torques", "point_frequencies", "point_stiffnesses", "point_dampings")
    need_equal_lengths(line, table, "point_shafts", *(key for key in keys if getattr(line, key)))
    text = "is missing; give the stiffness of each point"
    need(table, "point_stiffnesses", len(line.point_stiffnesses) == len(line.point_shafts), text)
    for number in line.point_shafts:
        text = f"no shaft {number}; the drive line has 1 to {len(line.starts)}"
        need(table, "point_shafts", number <= len(line.starts), text)
        own = [k for k, one in enumerate(line.point_shafts) if one == number]
        over = [
            key
            for key in ("point_torques", "point_frequencies")
            if any(column[k] for column in [getattr(line, key)] if column for k in own)
        ]
        text = f"shaft {number} needs points over either torque or frequency; give one of the two columns"
        need(table, "point_torques", len(over) == 1, text)
        values = [getattr(line, over[0])[k] for k in own]
        need(table, over[0], values == sorted(values), f"must increase from point to point of shaft {number}")


def _check_gas(engine: Engine) -> None:
    """Refuse an engine that has neither or both of combustion and compressor."""
    burn, gas = engine.combustion, engine.compressor
    both = "is given together with [combustion]; keep one of the two"
    need("compressor", "discharge", burn is None or gas is None, both)
    text = "is missing; give [combustion], or [compressor] of cylinders that compress gas"
    need("combustion", "heat", burn is not None or gas is not None, text)
    if burn is not None:
        _check_combustion(burn, engine.cylinders.cycle)
    if gas is not None:
        text = "must be 360 deg: a compressor's cylinder compresses once a revolution"
        need("cylinders", "cycle", engine.cylinders.cycle < 3.0 * math.pi, text)
        text = f"{1e-5 * gas.discharge:.4g} bar is not above suction, {1e-5 * gas.suction:.4g} bar"
        need("compressor", "discharge", gas.discharge > gas.suction, text)
        reach = engine.cylinders.compression_ratio**gas.exponent
        text = (
            f"{1e-5 * gas.discharge:.4g} bar is not reached with cylinders.compression_ratio "
            f"{engine.cylinders.compression_ratio:.4g}: at most {1e-5 * gas.suction * reach:.4g} bar"
        )
        need("compressor", "discharge", gas.discharge < gas.suction * reach, text)


def _check_combustion(burn: Combustion, cycle: float) -> None:
    """Refuse valves or ports open during combustion, and a two-stroke without time for its gas exchange.

    ``cycle`` is the angle of a cycle, rad.
    """
    of, latest = partial(need, "combustion"), 1.5 * math.pi
    text = "must lie before the start of combustion, in (-270, 0) deg after firing dead centre"
    of("intake_closes", -latest < burn.intake_closes < min(burn.start, 0.0), text)
    text = "must lie after the end of combustion, below 270 deg after firing dead centre"
    of("exhaust_opens", burn.start + burn.duration <= burn.exhaust_opens < latest, text)
    opens, closes = (round(math.degrees(angle), 6) for angle in (burn.exhaust_opens, burn.intake_closes + cycle))
    text = (
        f"from {opens:g} to {closes:g} deg, where the intake closes, there is no time for the gas exchange; leave at "
        f"least {math.degrees(LEAST_EXCHANGE):g} deg"
    )
    of("exhaust_opens", burn.intake_closes + cycle - burn.exhaust_opens >= LEAST_EXCHANGE, text)
