"""Reference runs, and estimates of their errors from two runs with coarser steps."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from cranktrain.film.laws.register import bearing_law
from cranktrain.store.kept import Kept
from cranktrain_lab.tradeoff.case import GRID_DEG, Case
from cranktrain_lab.tradeoff.measure import Progress, differences, named_errors, recorded

INTEGRATOR = "esdirk4"
STEPS_DEG = {"linear": 0.0625, "impedance": 0.0625, "held": 0.0625, "roller": 0.0625, "table": 0.25, "reynolds": 0.5}
"""Steps (degrees) of reference runs by bearing level. A quick study uses twice these steps."""
COARSEST_DEG = 0.5
SLOWEST_RATE, FASTEST_RATE = 2.0, 16.0
"""Limits of the assumed ratio of errors when the step is halved: methods of first and of fourth order."""


def reference_case(case: Case, quick: bool = False) -> Case:
    """Return the reference case for the numerical error, which is the same model with a fine step."""
    level = case.levels.bearings
    step = STEPS_DEG.get(level, COARSEST_DEG) * (2.0 if quick else 1.0)
    fine = replace(
        case.settings,
        integrator=INTEGRATOR,
        step=math.radians(step),
        control="fixed",
    )
    return replace(case, settings=fine, interval_deg=GRID_DEG)


def error_estimate(case: Case, store: Kept, say: Progress | None = None) -> dict[str, float | None]:
    """Estimate a reference run's error, by output, from runs with two and four times its step (Richardson).

    With the differences e₂ of the steps 4h and 2h, and e₁ of 2h and h, the ratio r = e₂/e₁ is what a halving gains;
    what is left at h is e₁/(r − 1), with r bounded below by 2. Where halving gains nothing it is the larger of both.
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
