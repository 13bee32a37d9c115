"""Cases of levels, and entries of every integrator with its steps at one level."""

from __future__ import annotations

import math
from dataclasses import replace

from cranktrain.dynamics.model.settings import Settings, keeps_peaks, resolved
from cranktrain.dynamics.time.integrators import INTEGRATORS
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import DEAR, DEAREST, bearing_law
from cranktrain.studies.output_levels import bearing_ladder
from cranktrain_lab.tradeoff.case import CYCLES, Case
from cranktrain_lab.tradeoff.measure import Entry
from cranktrain_lab.tradeoff.point import NUMERICAL
from cranktrain_lab.tradeoff.reference import reference_case

SLOW_CYCLES = {DEAR: 2, DEAREST: 2}
"""Number of cycles of runs with films solved online; only the second cycle is evaluated."""
QUICK_STEPS = {
    "esdirk4": (6.0, 4.0, 3.0, 2.5, 2.0, 1.0, 0.5),
    "esdirk47": (6.0, 5.0, 4.0, 3.0, 2.5),
    "esdirk5": (6.0, 3.0, 1.0),
    "esdirk57": (10.0, 5.0, 2.5),
    "sdirk4": (4.0, 2.5, 1.0),
    "generalised-alpha:0.6": (1.0, 0.5),
    "tr-bdf2": (1.0,),
}
_SECOND_ORDER, _THIRD_ORDER = (2.0, 1.0, 0.5, 0.25), (4.0, 3.0, 2.0, 1.0, 0.5)
_FOURTH_ORDER = (6.0, 5.0, 4.0, 3.0, 2.5, 2.0, 1.5, 1.0, 0.75, 0.5, 0.25)
STEPS = {
    "backward-euler": (0.5, 0.25, 0.125),
    **dict.fromkeys(("trapezoidal", "hht:-0.1"), _SECOND_ORDER),
    **{f"generalised-alpha:{radius:g}": _SECOND_ORDER for radius in (0.5, 0.6, 0.8, 0.9, 1.0)},
    "bdf2": _SECOND_ORDER,
    **dict.fromkeys(("tr-bdf2", "sdirk2"), (3.0, *_SECOND_ORDER)),
    "sdirk3": _THIRD_ORDER,
    "sdirk4": _FOURTH_ORDER,
    "esdirk3": _THIRD_ORDER,
    "esdirk4": _FOURTH_ORDER,
    **dict.fromkeys(("esdirk5", "esdirk47", "esdirk57"), (10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.5, 1.0, 0.5)),
}
"""Steps in degrees of each listed integrator. Integrators that are not listed use the steps of ``sdirk2``."""


def integrator_steps(quick: bool) -> list[tuple[str, float]]:
    """Return all integrators with the steps (degrees) to measure."""
    if quick:
        return [(name, step) for name, steps in QUICK_STEPS.items() for step in steps]
    named = {name.partition(":")[0] for name in STEPS}
    others = {name: STEPS["sdirk2"] for name in INTEGRATORS if name not in named}
    return [
        (name, step)
        for name, steps in (STEPS | others).items()
        if name.partition(":")[0] in INTEGRATORS
        for step in steps
    ]


def level_case(engine: Engine, speed: float, settings: Settings, cutoff_hz: float | None = None) -> Case:
    """Return the case with default integrator and step at the settings' levels; expensive films run fewer cycles."""
    levels = resolved(settings, engine)
    plain = Settings()
    chosen = replace(
        levels, integrator=plain.integrator, step=plain.step, control=plain.control, tolerance=plain.tolerance,
        newton_tolerance=None, film_change=None,
    )  # fmt: skip
    return Case(engine, speed, chosen, SLOW_CYCLES.get(bearing_law(levels.bearings).cost, CYCLES), cutoff_hz)


def numerical_entries(case: Case, quick: bool) -> list[Entry]:
    """Return entries of every integrator and step at one level, compared with the same model at a fine step."""
    reference = reference_case(case, quick)
    chosen = [(name, step) for name, step in integrator_steps(quick) if keeps_peaks(name, case.levels, case.engine)]
    default = (case.levels.integrator, case.step_deg)
    if default not in chosen:
        chosen.append(default)
    return [
        Entry(
            "integrators", f"{name} {step:g}°",
            replace(case, settings=replace(case.settings, integrator=name, step=math.radians(step))),
            reference, NUMERICAL, {"default": (name, step) == default},
        )
        for name, step in chosen
    ]  # fmt: skip


def bearing_levels(engine: Engine) -> list[str]:
    """Return the levels of main bearings with moving journals, from the lowest to the highest."""
    return [level for level in bearing_ladder(engine.rollers_only) if bearing_law(level).carries]
