"""Total error of a run's levels by the shipped figures, and the cheapest levels with half of it."""

from __future__ import annotations

import math

from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import bearing_law
from cranktrain.studies.planning.charted import ChartedChoice, around, choices
from cranktrain.studies.planning.plan import percent
from cranktrain.studies.total_error.families import FAMILIES
from cranktrain.studies.total_error.shipped import shipped

TORSION = "torsion"
SMALL = 0.01
"""Total error up to which no better levels are named."""
HALF = 0.5
"""Fraction of a run's total error that better levels must reach."""
WORTH = 1.25
"""Cost over that of the cheapest better levels up to which levels with a smaller error are named in their place."""
CONDITIONS = {"damper": "none", "big_ends": "rigid", "gas_load": 1.0, "film_temperature": "engine",
              "boundary": "speed", "control": "fixed", "axial_force": None}  # fmt: skip
"""Settings of the runs that the figures were measured with."""

OWN_DATA = "Error of these levels: not measured with pressures or meshes of one's own (docs/tradeoff.md)."


def level_error_text(engine: Engine, settings: Settings, speed_rpm: float) -> str:
    """One line: the total error of the torsion at a run's levels, and options that halve it, with their time.

    ``settings`` are complete. A line says so where the figures do not cover the run.
    """
    figures = shipped(engine)
    if figures is None:
        return "Error of these levels: not measured for this engine; docs/tradeoff.md has figures of the shipped ones."
    speeds = around([speed_rpm], figures.speeds_rpm)
    usual = all(getattr(settings, name) == value for name, value in CONDITIONS.items())
    found = [] if speeds is None or not usual else choices(figures.points, speeds, [TORSION])
    label = _label(settings)
    own = next((one for one in found if one.label == label), None)
    if speeds is None or own is None:
        low, high = figures.speeds_rpm[0], figures.speeds_rpm[-1]
        return (
            f"Error of these levels: not measured for this run; figures are for {low:g} to {high:g} rev/min at full "
            "load, without damper, on rigid big ends (docs/tradeoff.md)."
        )
    best = figures.best[next(point.scene for point in figures.points if point.speed_rpm == speeds[-1])].name
    old = "" if figures.current else ", by earlier sources"
    at = ", ".join(f"{rpm:g}" for rpm in speeds)
    text = (
        f"{FAMILIES[TORSION].title[0].upper()}{FAMILIES[TORSION].title[1:]} at these levels: within about "
        f"{percent(own.total)} of the best model here, {best} (measured at {at} rev/min{old})"
    )
    if own.total <= SMALL:
        return f"{text}."
    better = halving(own, found)
    if better is None:
        return f"{text}; no measured levels halve this."
    return f"{text}; {_options(own, better)}: {percent(better.total)}, {better.cost / own.cost:.2g} times the time."


def halving(own: ChartedChoice, found: list[ChartedChoice]) -> ChartedChoice | None:
    """Cheapest choice with at most half the total error; a closer one that costs little more goes before it."""
    better = [one for one in found if one.total <= HALF * own.total and one.label == one.plain]
    if not better:
        return None
    cheapest = min(one.cost for one in better)
    return min((one for one in better if one.cost <= WORTH * cheapest), key=lambda one: one.total)


def _label(settings: Settings) -> str:
    """Label of the measured choice that a run makes."""
    method = "" if settings.integrator == bearing_law(settings.bearings).integrator else f" {settings.integrator}"
    step = math.degrees(settings.step)
    return f"{settings.crank}/{settings.bearings}/{settings.block}{method} {step:.6g}°"


def _options(own: ChartedChoice, better: ChartedChoice) -> str:
    """Options of ``simulate`` that lead from one choice to another, with the step of the second."""
    levels = [
        f"--{name} {getattr(better, name)}"
        for name in ("crank", "bearings", "block")
        if getattr(better, name) != getattr(own, name)
    ]
    step = better.label.rpartition(" ")[2].rstrip("°")
    return " ".join(levels if step == own.label.rpartition(" ")[2].rstrip("°") else [*levels, f"--step-deg {step}"])
