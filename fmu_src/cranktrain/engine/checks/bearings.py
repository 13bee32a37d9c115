"""Checks of plain bearings and the thrust bearing against the crankshaft."""

from functools import partial

from cranktrain.core.errors import InputError
from cranktrain.engine.bearing_limits import JUDGED, MAIN
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import PlainBearing
from cranktrain.engine.quantities import mm, need


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
