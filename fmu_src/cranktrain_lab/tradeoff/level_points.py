"""Study of integrators at a fidelity level: the cases to run, the reference runs with their error, and all results."""

import math
from dataclasses import replace

import numpy as np

from cranktrain.core.types import Progress
from cranktrain.dynamics.model.settings import Settings, keeps_peaks, resolved
from cranktrain.dynamics.time.integrators import INTEGRATORS
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import DEAR, DEAREST, bearing_law
from cranktrain.store.kept import Kept
from cranktrain.studies.output_levels import bearing_ladder
from cranktrain_lab.tradeoff.case import CYCLES, GRID_DEG, Case
from cranktrain_lab.tradeoff.measure import Entry, differences, named_errors, recorded
from cranktrain_lab.tradeoff.point import NUMERICAL

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
REFERENCE_INTEGRATOR = "esdirk4"
REFERENCE_DEG = {
    "linear": 0.0625,
    "impedance": 0.0625,
    "held": 0.0625,
    "roller": 0.0625,
    "table": 0.25,
    "reynolds": 0.5,
}
"""Steps (degrees) of reference runs by bearing level. A quick study uses twice these steps."""
COARSEST_DEG = 0.5
SLOWEST_RATE, FASTEST_RATE = 2.0, 16.0
"""Limits of the assumed ratio of errors when the step is halved: methods of first and of fourth order."""


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


def reference_case(case: Case, quick: bool = False) -> Case:
    """Return the reference case for the numerical error, which is the same model with a fine step."""
    level = case.levels.bearings
    step = REFERENCE_DEG.get(level, COARSEST_DEG) * (2.0 if quick else 1.0)
    fine = replace(case.settings, integrator=REFERENCE_INTEGRATOR, step=math.radians(step), control="fixed")
    return replace(case, settings=fine, interval_deg=GRID_DEG)


def error_estimate(case: Case, store: Kept, say: Progress | None = None) -> dict[str, float | None]:
    """Estimate a reference run's error, by output, from runs with two and four times its step (Richardson).

    With the differences e₂ of the steps 4h and 2h, and e₁ of 2h and h, the ratio r = e₂/e₁ is the gain by halving the
    step. The error at h is e₁/(r − 1), with r at least 2. If halving gains nothing, the error is the larger of both.
    """
    films = bearing_law(case.levels.bearings).film
    bearings = len(case.engine.crankshaft.main_widths)
    runs = []
    for factor in (1.0, 2.0, 4.0):
        settings = replace(case.settings, step=factor * case.levels.step)
        interval = max(GRID_DEG, factor * case.step_deg)
        runs.append(recorded(replace(case, settings=settings, interval_deg=interval), store, say))
    fine, middle, coarse = runs
    first = differences(*middle, *fine, case.cycles)
    second = differences(*coarse, *middle, case.cycles)
    with np.errstate(divide="ignore", invalid="ignore"):
        gained = np.clip(second / first, SLOWEST_RATE, FASTEST_RATE)
    estimate = np.where(second > first, first / (gained - 1.0), np.maximum(first, second))
    return named_errors(estimate, bearings, films)


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
