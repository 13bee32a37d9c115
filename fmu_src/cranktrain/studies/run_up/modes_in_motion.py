"""Peaks of a run-up and the torsional mode in motion, in the run's own block and bearings.

The mode is the first torsional one of :mod:`cranktrain.structure.in_motion.eigenproblem` about the steady cycle beside
a peak.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from cranktrain.core.errors import SolverError
from cranktrain.results.orders.resonances import Peak
from cranktrain.structure.in_motion.eigenproblem import modes_in_motion
from cranktrain.studies.run_up.report import SHOWN
from cranktrain.studies.run_up.steady import CycleStart, SteadyRuns

NEAR = 0.02
"""Relative difference of speed up to which a steady motion is used for a peak: modes in motion depend little on
speed."""
SAME = 0.04
"""Largest relative distance of a peak from the mode in motion; beyond it the peak belongs to another mode."""


def in_motion(found: Sequence[Peak], runs: SteadyRuns, starts: Sequence[CycleStart]) -> list[Peak]:
    """The peaks, the highest of which have the torsional mode in motion, where they are near it.

    It is that at the nearest of the speeds whose steady motion is given; peaks of other speeds have none.
    """
    known: dict[float, float] = {}

    def hz(peak: Peak) -> float:
        near = min(starts, key=lambda start: abs(start.speed - peak.speed), default=None)
        if near is None or abs(near.speed - peak.speed) > NEAR * peak.speed:
            return math.nan
        if near.speed not in known:
            runs.enter(near.speed, [near])
            known[near.speed] = _hz(runs)
        return known[near.speed]

    named = []
    for k, peak in enumerate(found):
        motion = hz(peak) if k < SHOWN and peak.periodic else math.nan
        named.append(replace(peak, motion_hz=motion) if abs(peak.hz - motion) <= SAME * motion else peak)
    return named


def _hz(runs: SteadyRuns) -> float:
    """Frequency of the torsional mode at the steady cycle of a simulation; not a number where nothing shows it."""
    try:
        return modes_in_motion(runs.simulation).torsional_hz
    except SolverError:  # of the cycle that is linearised, after all speeds have run
        return math.nan
