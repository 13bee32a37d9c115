"""Verdict of a report: results compared with the limits in the engine file."""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.engine.limits import BIG_END, JUDGED, MAIN, BearingLimits, Limits
from cranktrain.results.bearings.run_up_cycles import run_up_bearings
from cranktrain.results.bearings.tables import FAMILIES, SAID, judged
from cranktrain.results.columns import NOTHING
from cranktrain.results.run_up.run_up import FLYWHEEL, MEAN, TORSION, half_range
from cranktrain.results.tables import Table
from cranktrain.studies.report.findings import Findings

SAFE = 1.0
"""Least permissible safety factor, 1 by definition."""
ROUNDING = 1e-6
"""Relative tolerance at the ends of the speeds."""
DAMPER_HEAT = "damper.heat"
KEPT, BROKEN, NO_LIMIT, NOT_COMPUTED = "passed", "not passed", "no limit stated", "not computed"
_BEARINGS = "Bearings over the speed"
_FATIGUE = "Fatigue of the crankshaft"


class Verdict(NamedTuple):
    """Quantity with its limit, both in ``unit``; None if it was not computed or has no limit.

    ``where`` is the speed or place of the value, or the section of the report that would give it. ``key`` is the key of
    the limit in the engine file. ``least`` is True for a lower limit, False for an upper limit.
    """

    what: str
    unit: str
    value: float | None
    limit: float | None
    where: str
    key: str
    least: bool = False

    @property
    def said(self) -> str:
        """One of the four verdicts."""
        if self.limit is None:
            return NO_LIMIT
        if self.value is None:
            return NOT_COMPUTED
        return KEPT if (self.value >= self.limit if self.least else self.value <= self.limit) else BROKEN


def verdicts(found: Findings) -> list[Verdict]:
    """All quantities for which an engine file can state a limit, if the engine has the part."""
    return [one for of in (_vibration, _running, _damper, _fatigue, _bearings) for one in of(found)]


def verdict_table(all_of: list[Verdict]) -> Table:
    """Table of the verdicts as texts."""
    header = ("quantity", "found", "limit", "unit", "verdict", "where", "stated by")
    rows = tuple(
        (one.what, _text(one.value), _text(one.limit), one.unit, one.said,
         f"see “{one.where}”" if one.value is None else one.where, one.key)
        for one in all_of
    )  # fmt: skip
    return Table("Found and allowed", header, rows)


def verdict_text(all_of: list[Verdict]) -> str:
    """Sentence with the numbers of limits that are kept, exceeded, missing or not judged."""
    counts = {said: sum(one.said == said for one in all_of) for said in (KEPT, BROKEN, NO_LIMIT, NOT_COMPUTED)}
    broken = [one.what for one in all_of if one.said == BROKEN]
    stated = sum(one.limit is not None for one in all_of)
    if not stated:
        return "No limit is stated in the engine file, so nothing is judged."
    judged_limits, open_ = counts[KEPT] + counts[BROKEN], counts[NOT_COMPUTED]
    texts = [f"{counts[KEPT]} of {judged_limits} judged limits are passed"] if judged_limits else []
    texts += [f"not passed: {', '.join(broken)}"] if broken else []
    texts += [f"{open_} of {stated} stated limits are not judged, because their value is not computed"] if open_ else []
    texts += [f"{counts[NO_LIMIT]} quantities have no limit"] if counts[NO_LIMIT] else []
    return "; ".join(texts) + "."


def _vibration(found: Findings) -> Iterator[Verdict]:
    """Torsion of the pulley and twist within the engine's speeds, with the damper if the engine has one."""
    limits, made = found.engine.limits or Limits(), found.torsion if found.engine.damper is None else found.damped
    for what, key, against in (
        ("torsion of the pulley, half of peak to peak", "pulley_torsion", ()),
        ("twist from pulley to flywheel, half of peak to peak", "twist", (FLYWHEEL,)),
    ):
        value, where = None, "Torsional vibration over the speed range"
        if made is not None and FLYWHEEL in made.run_up.amplitudes:
            own = _judged(found, made.run_up.speeds)
            motion = made.run_up.amplitudes[TORSION] - sum(made.run_up.amplitudes[name] for name in against)
            sizes = np.degrees(half_range(made.run_up, motion))[own]
            at = int(np.nanargmax(sizes))
            value, where = float(sizes[at]), f"at {made.run_up.speeds_rpm[own][at]:.0f} rev/min"
        yield Verdict(what, "deg", value, _stated(math.degrees(getattr(limits, key))), where, f"limits.{key}")


def _judged(found: Findings, speeds: Array) -> NDArray[np.intp]:
    """Rows of the speeds (s,), rad/s, within the range for limits; all rows if none is within it."""
    low, high = found.speeds
    own = np.flatnonzero((speeds >= (1.0 - ROUNDING) * low) & (speeds <= (1.0 + ROUNDING) * high))
    return own if own.size else np.arange(speeds.size)


def _running(found: Findings) -> Iterator[Verdict]:
    """Mean piston speed and largest cylinder pressure."""
    limits, (low, high) = found.engine.limits or Limits(), found.speeds
    mean = 2.0 * max(found.engine.throws) * high / math.pi
    at = f"at {high / RPM:.0f} rev/min"
    yield Verdict("mean piston speed", "m/s", mean, _stated(limits.piston_speed), at, "limits.piston_speed")
    best = min(max(found.engine.best_speed, low), high)
    peaks = {speed: found.trace(speed).peak for speed in (*np.linspace(low, high, 25).tolist(), best)}
    speed = max(peaks, key=lambda one: peaks[one])
    at = f"at {speed / RPM:.0f} rev/min" if len(set(peaks.values())) > 1 else "of the trace"
    limit = _stated(1e-5 * limits.peak_pressure)
    yield Verdict("peak cylinder pressure", "bar", 1e-5 * peaks[speed], limit, at, "limits.peak_pressure")


def _damper(found: Findings) -> Iterator[Verdict]:
    """Mean heat of the damper over its cooling area."""
    damper, run_up = found.engine.damper, found.damped_run_up
    if damper is None:
        return
    value, where = None, "Torsional vibration with films"
    if run_up is not None and DAMPER_HEAT in run_up.extremes:
        own = _judged(found, run_up.speeds)
        heat = run_up.extremes[DAMPER_HEAT][own, MEAN]
        at = int(np.nanargmax(heat))
        value, where = 1e-3 * float(heat[at]) / damper.cooling_area, f"at {run_up.speeds_rpm[own][at]:.0f} rev/min"
    limit = 1e-3 * damper.power_limit
    yield Verdict("heat of the damper over its cooling area", "kW/m²", value, limit, where, "damper.power_limit")


def _fatigue(found: Findings) -> Iterator[Verdict]:
    """Least safety factor of the fillets, and acceptability by the rule if it applies to the crank."""
    if found.engine.crank_strength is None:
        return
    factor, rule, key = "least safety factor of the crankshaft", "acceptability by IACS UR M53", "crank_strength"
    if found.fatigue is None:
        yield Verdict(factor, "1", None, SAFE, _FATIGUE, key, True)
        return
    judged_places = [one for one in found.fatigue["fillets"] if one["safety_factor"] is not None]  # null: no stress
    worst = min(judged_places, key=lambda one: one["safety_factor"])
    where = f"{worst['name']} at {worst['speed_rpm']:g} rev/min"
    yield Verdict(factor, "1", worst["safety_factor"], SAFE, where, key, True)
    judges = found.fatigue["rule"]
    if not judges["outside"]:
        worst = min(judges["places"], key=lambda one: one["acceptability"])
        where = f"{worst['name']} at {worst['speed_rpm']:g} rev/min"
        yield Verdict(rule, "1", worst["acceptability"], judges["required"], where, key, True)


def _bearings(found: Findings) -> Iterator[Verdict]:
    """The worst plain bearing of each family over the speeds of the run-up."""
    engine, limits = found.engine, found.engine.bearing_limits or BearingLimits()
    worst: dict[tuple[str, str], tuple[float, str]] = {}
    computed = False
    try:
        made = [] if found.run_up is None else list(run_up_bearings(found.run_up, engine))
        reports = [made[k] for k in _judged(found, found.run_up.speeds)] if found.run_up is not None else []
    except InputError:  # a run-up without the outputs of its bearings
        reports = []
    for report in reports:
        computed = True
        for bearing in report.bearings:
            for what in JUDGED:
                value, better = judged(bearing, what), worst.get((bearing.family, what))
                choose: Callable[..., float] = min if what == "film" else max
                if value is not None and (better is None or choose(value, better[0]) != better[0]):
                    where = f"{bearing.name} at {report.speed / RPM:.0f} rev/min"
                    worst[bearing.family, what] = value, where
    there = {MAIN: engine.main_bearing, BIG_END: engine.big_end_bearing}
    for family in FAMILIES:
        for what in JUDGED:
            name, scale, unit = SAID[what]
            limit, key = _stated(scale * limits.of(family, what)), f"bearing_limits.{family}_{what}"
            value, where = worst.get((family, what), (None, _BEARINGS))
            if there[family] is not None and (value is not None or limit is not None or not computed):
                scaled = None if value is None else scale * value
                yield Verdict(
                    f"{FAMILIES[family]}: {name}", unit.replace("um", "µm"), scaled, limit, where, key, what == "film"
                )


def _stated(limit: float) -> float | None:
    """Limit, or None for 0, which stands for a limit that is not given."""
    return limit or None


def _text(value: float | None) -> str:
    return NOTHING if value is None else f"{value:.3g}" if abs(value) < 1e3 else f"{value:.0f}"
