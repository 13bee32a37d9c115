"""Total error of a run's levels by the shipped figures, and the cheapest levels with half of it."""

import math
from collections.abc import Sequence
from typing import Any

from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import bearing_law
from cranktrain.studies.planning.charted import ChartedChoice, around, choices
from cranktrain.studies.total_error.families import FAMILIES
from cranktrain.studies.total_error.point import percent
from cranktrain.studies.total_error.shipped import shipped

TORSION = "torsion"
SMALL = 0.01
"""Total error of a run below which no better levels are suggested."""
HALF = 0.5
"""Largest error of suggested levels, as a fraction of the run's total error."""
WORTH = 1.25
"""Levels with a smaller error are suggested if they cost at most this multiple of the cheapest better levels."""
CONDITIONS = {"damper": "none", "big_ends": "rigid", "gas_load": 1.0, "film_temperature": "engine",
              "boundary": "speed", "control": "fixed", "axial_force": None}  # fmt: skip
"""Settings of the runs with which the shipped errors were measured."""

NOT_MEASURED = "Error of these levels: not measured"
OWN_DATA = f"{NOT_MEASURED} with pressures or meshes of one's own (docs/tradeoff.md)."


def level_error(
    engine: Engine, settings: Settings, first_rpm: float, last_rpm: float | None = None, unlike: str = ""
) -> dict[str, Any]:
    """Total error of the torsion at the levels of a run or run-up, and options that halve it; keys carry units.

    ``settings`` are complete; a run-up goes from ``first_rpm`` to ``last_rpm``. ``unlike`` says in one line how the
    run differs from those that were measured. ``total`` is None if the figures do not cover the run; ``halved_by``,
    ``halved_total`` and ``halved_time`` (its time over the run's) are None if no measured choice halves the error.
    ``text`` says all of it in one line.
    """
    none: dict[str, Any] = {"output": f"pulley.{TORSION}", "total": None, "best": None, "measured_rpm": [],
                            "halved_by": None, "halved_total": None, "halved_time": None}  # fmt: skip
    figures = None if unlike else shipped(engine)
    if figures is None:
        other = f"{NOT_MEASURED} for this engine; docs/tradeoff.md has figures of the shipped ones."
        return none | {"text": unlike or other}
    low, high = figures.speeds_rpm[0], figures.speeds_rpm[-1]
    speeds = _measured(figures.speeds_rpm, first_rpm, last_rpm)
    usual = all(getattr(settings, name) == value for name, value in CONDITIONS.items())
    found = choices(figures.points, speeds, [TORSION]) if usual and speeds else []
    method = "" if settings.integrator == bearing_law(settings.bearings).integrator else f" {settings.integrator}"
    step = math.degrees(settings.step)
    label = f"{settings.crank}/{settings.bearings}/{settings.block}{method} {step:.6g}°"
    own = next((one for one in found if one.label == label), None)
    if own is None:
        return none | {
            "text": f"{NOT_MEASURED} for this run; figures are for the levels and steps of docs/tradeoff.md at {low:g} "
            f"to {high:g} rev/min, full load, without damper, on rigid big ends."
        }
    best = figures.best[next(point.scene for point in figures.points if point.speed_rpm == speeds[-1])].name
    title = FAMILIES[TORSION].title
    text = (
        f"{title[0].upper()}{title[1:]} at these levels: within about {percent(own.total)} of the best model here, "
        f"{best} (measured at {', '.join(f'{rpm:g}' for rpm in speeds)} rev/min"
        f"{'' if figures.current else ', by earlier sources'})"
    )
    said = none | {"total": own.total, "best": best, "measured_rpm": list(speeds), "text": f"{text}."}
    if own.total <= SMALL:
        return said
    better = halving(own, found)
    if better is None:
        return said | {"text": f"{text}; no measured levels halve this."}
    options, times = _options(own, better), better.cost / own.cost
    more = f"; {options}: {percent(better.total)}, {times:.2g} times the time."
    return said | {"halved_by": options, "halved_total": better.total, "halved_time": times, "text": text + more}


def _measured(measured: Sequence[float], first: float, last: float | None) -> tuple[float, ...]:
    """Measured speeds next to the speed of a run, or within a run-up; empty if none covers it."""
    if last is None:
        return around([first], measured) or ()
    inside = [min(max(rpm, measured[0]), measured[-1]) for rpm in (first, last)]
    if last < measured[0] or first > measured[-1]:
        return ()
    return around([*inside, *(rpm for rpm in measured if inside[0] <= rpm <= inside[1])], measured) or ()


def halving(own: ChartedChoice, found: list[ChartedChoice]) -> ChartedChoice | None:
    """Cheapest choice with at most half the total error of ``own``, or a more accurate one that costs little more."""
    better = [one for one in found if one.total <= HALF * own.total and one.label == one.plain]
    if not better:
        return None
    cheapest = min(one.cost for one in better)
    return min((one for one in better if one.cost <= WORTH * cheapest), key=lambda one: one.total)


def _options(own: ChartedChoice, better: ChartedChoice) -> str:
    """Options of ``simulate`` and ``runup`` that lead from one choice to another, with the step of the second."""
    levels = [
        f"--{name} {getattr(better, name)}"
        for name in ("crank", "bearings", "block")
        if getattr(better, name) != getattr(own, name)
    ]
    step = better.label.rpartition(" ")[2].rstrip("°")
    return " ".join(levels if step == own.label.rpartition(" ")[2].rstrip("°") else [*levels, f"--step-deg {step}"])
