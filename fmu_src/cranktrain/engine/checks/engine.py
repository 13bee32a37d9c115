"""Whether the parts of an engine fit together: values within their fields' bounds, then rules between values.

Masses and inertias that are unlikely for an engine of this size are warned of only, because a study may need them:
masses are compared with a steel cube as wide as the bore, radii of gyration with a length of the part or the bore. The
limits are a factor of ten to a hundred beyond what engines have from models to ships.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from functools import partial

from cranktrain.engine.additions import check_additions
from cranktrain.engine.checks.bearings import check_bearings
from cranktrain.engine.checks.block import check_block, check_mounts
from cranktrain.engine.checks.crankshaft import check_balance_weights, check_crankshaft, check_cylinders, check_damper
from cranktrain.engine.drive_line_chain import FURTHER, DriveLineChain
from cranktrain.engine.firing import uneven
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import AxialPath, Combustion, Oil
from cranktrain.engine.quantities import ZERO_CELSIUS, check_values, mm, need, need_equal_lengths, need_table
from cranktrain.engine.roller_bearing import check_rollers
from cranktrain.engine.torsional_chain import LINE_ENDS, check_chain, gear_speeds

OIL_VISCOSITIES = (1e-5, 100.0)
"""Thinnest and thickest oil, Pa s, at the temperatures that an engine's oil has over its speeds."""
LEAST_EXCHANGE = math.radians(20.0)
"""Least angle from the opening of the exhaust to the closing of the intake, of the fastest two-strokes."""
STEEL = 7850.0
MASSES = {
    "cylinders.piston_mass": (0.005, 5.0),
    "rod.big_end_mass": (0.005, 5.0),
    "rod.small_end_mass": (0.002, 5.0),
    "flywheel.mass": (0.01, 300.0),
    "pulley.mass": (0.005, 100.0),
    "clutch.mass": (0.005, 300.0),
    "damper.mass": (0.005, 100.0),
    "block.head_mass": (0.01, 100.0),
}
"""Least and largest mass of a part, over that of a steel cube as wide as the bore."""
GYRATIONS = {"flywheel": (0.1, 10.0), "pulley": (0.05, 10.0), "clutch": (0.05, 10.0)}
"""Least and largest radius of gyration about the crank's axis, over the bore."""
ROD_GYRATION = (0.1, 1.5)
"""Of the rod about its centre of mass, over its length."""


def check_engine(engine: Engine) -> None:
    """Refuse an engine whose parts do not fit together.

    Raises ``InputError``: one line that starts with ``table.key``.
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
    _check_oil(engine.oil)
    _check_combustion(engine.combustion, engine.cylinders.cycle)
    warn_of_masses(engine)
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
    check_additions(engine.frame, engine.body, engine.connection, engine.n_cylinders)
    if engine.axial_path is not None:
        _check_axial_path(engine.axial_path)
    for text in uneven(engine.crankshaft, engine.cylinders):  # raises where the throws cannot fire in the order
        warnings.warn(f"{engine.name}: {text}", stacklevel=2)
    if engine.mounts is not None:
        check_mounts(engine.mounts)
    if engine.block is not None:  # after its mounts, whose pads it carries
        check_block(engine, engine.block)


def check_drive_line(line: DriveLineChain) -> None:
    """Refuse lists of unequal length, and what is no drive line from flywheel to dynamometer; ``InputError``."""
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
    """Refuse points of shafts that do not rise, belong to no shaft, or whose columns differ in length."""
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


def _check_axial_path(path: AxialPath) -> None:
    """Refuse a spline without the data of its friction; ``InputError``."""
    of = partial(need, "axial_path")
    if path.joint == "spline":
        text = "is missing; a spline slides by friction x torque / spline_radius"
        for key in ("spline_radius", "friction"):
            of(key, getattr(path, key) > 0.0, f"{text}; give it, or take joint bolted")


def _check_oil(oil: Oil) -> None:
    """Refuse an oil whose law lacks its constants."""
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
        thick, warmth = 1e3 * _thickness(oil, temperature), temperature - ZERO_CELSIUS
        text = f"{oil.law} gives {thick:.4g} mPa s at {warmth:.4g} degC, not {low:g} to {high:g}; check its constants"
        of("law", low <= thick <= high, text)
    text = f"is missing; pressure_law {oil.pressure_law} needs it, mineral oils have 15 to 25 1/GPa"
    of("pressure_viscosity", oil.pressure_viscosity > 0.0 or oil.pressure_law == "none", text)


def _thickness(oil: Oil, temperature: float) -> float:
    """Viscosity, Pa s, as :mod:`cranktrain.engine.lubricant` has it; infinite where the law overflows."""
    try:
        if oil.law == "vogel":
            return oil.vogel_a * math.exp(oil.vogel_b / (temperature - oil.vogel_c))
        points = zip(oil.walther_temperatures, oil.walther_viscosities, strict=True)
        (t1, w1), (t2, w2) = ((math.log(t), math.log10(math.log10(1e6 * nu + 0.7))) for t, nu in points)
        exponent = w1 + (w2 - w1) * (math.log(temperature) - t1) / (t2 - t1)
        return 1e-6 * oil.density * (10.0**10.0**exponent - 0.7)
    except OverflowError:
        return math.inf


def _check_combustion(burn: Combustion, cycle: float) -> None:
    """Refuse valves or ports that are open while the charge burns, and a two-stroke without time for its gas exchange.

    ``cycle`` is its angle, rad.
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


def warn_of_masses(engine: Engine) -> None:
    """Warn of masses and inertias that are hardly of this engine, one line each: ``table.key``, value, limits."""
    for text in _unlikely(engine):
        warnings.warn(f"{engine.name}: {text}; check its unit", stacklevel=2)


def _unlikely(engine: Engine) -> Iterator[str]:
    bore, rod = engine.cylinders.bore, engine.rod
    cube = STEEL * bore**3
    for name, (low, high) in MASSES.items():
        table, key = name.split(".")
        own = getattr(getattr(engine, table), key, 0.0)  # a linear damper may state no mass
        if own and not low * cube <= own <= high * cube:
            yield f"{name}: {own:.4g} kg with a bore of {mm(bore)}, usual {low * cube:.3g} to {high * cube:.3g} kg"
    for table, (low, high) in GYRATIONS.items():
        if (part := getattr(engine, table)) is not None:
            radius = (part.polar_inertia / part.mass) ** 0.5
            if not low * bore <= radius <= high * bore:
                yield (
                    f"{table}.polar_inertia: a radius of gyration of {mm(radius)} with a bore of {mm(bore)}, "
                    f"usual {mm(low * bore)} to {mm(high * bore)}"
                )
    (low, high), radius = ROD_GYRATION, (rod.inertia / (rod.big_end_mass + rod.small_end_mass)) ** 0.5
    if not low * rod.length <= radius <= high * rod.length:
        yield (
            f"rod.inertia: a radius of gyration of {mm(radius)} in a rod of {mm(rod.length)}, "
            f"usual {mm(low * rod.length)} to {mm(high * rod.length)}"
        )
