"""Natural frequencies over speed of the crank whose run-up is in a file.

Peaks of a run-up, and the modes in motion that cause them, computed in the run's own block and bearings.

Modes are those of :mod:`cranktrain.structure.in_motion.eigenproblem` about the steady cycle beside a peak. A peak
belongs to the mode whose residue, by the rods' forces of the peak's order, contributes most to the pulley's torsion at
the peak's frequency. That mode may bend more than it twists, and different peaks may belong to different modes.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cranktrain.core.errors import InputError, SolverError
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import fitted_engine
from cranktrain.engine.levels import crank_level
from cranktrain.engine.model import Engine
from cranktrain.results.orders.modes_over_speed import ModesOverSpeed
from cranktrain.results.orders.resonances import Peak
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.structure.assembly import running_crank
from cranktrain.structure.crank.modal import KINDS
from cranktrain.structure.in_motion.eigenproblem import ModesInMotion, modes_in_motion
from cranktrain.studies.campbell import campbell
from cranktrain.studies.run_up.report import SHOWN
from cranktrain.studies.run_up.steady import CycleStart, SteadyRuns

SPEEDS = 21


def run_up_modes(engine: Engine, run_up: RunUp) -> ModesOverSpeed | None:
    """Modes over the speeds of a run-up; None for a rigid crank, or for a single speed.

    Raises ``InputError``: an engine whose crank is not that of the run-up.
    """
    level = str(run_up.attributes.get("crank", "solid"))
    if run_up.speeds.size < 2 or not crank_level(level).elastic:
        return None
    damper = str(run_up.attributes.get("damper", "none"))
    fitted = fitted_engine(engine, Settings(crank=level, damper=damper))
    for inherit in (True, False):
        body = running_crank(fitted, level, inherit=inherit)
        if body.digest == run_up.attributes.get("body_digest", body.digest):
            speeds = np.linspace(run_up.speeds[0], run_up.speeds[-1], SPEEDS)
            return campbell(fitted, body, speeds, level, damper=damper != "none")
    raise InputError(
        f"the crank of engine '{engine.name}' is not the one that the run-up has (its engine file has changed, or it "
        "has a mesh of its own)"
    )


NEAR = 0.02
"""Largest relative difference between the speeds of a peak and of the steady motion used for its modes in motion, which
depend little on speed."""
SAME = 0.02
"""Largest relative distance of a peak from its mode in motion. A peak farther away is the sum of several modes."""


def in_motion(found: Sequence[Peak], runs: SteadyRuns, starts: Sequence[CycleStart]) -> list[Peak]:
    """Peaks of a run-up. The highest peaks get the nearby mode in motion.

    It is that at the nearest of the speeds whose steady motion is given; peaks of other speeds have none, and neither
    have peaks of the drive line.
    """
    known: dict[float, ModesInMotion | None] = {}

    def modes(peak: Peak) -> ModesInMotion | None:
        near = min(starts, key=lambda start: abs(start.speed - peak.speed), default=None)
        if near is None or abs(near.speed - peak.speed) > NEAR * peak.speed:
            return None
        if near.speed not in known:
            runs.enter(near.speed, [near])
            known[near.speed] = _modes(runs)
        return known[near.speed]

    return [_belonging(peak, modes(peak)) if k < SHOWN and peak.periodic else peak for k, peak in enumerate(found)]


def _belonging(peak: Peak, modes: ModesInMotion | None) -> Peak:
    """Peak with the mode that contributes most to its amplitude, if this mode is near."""
    k = -1 if modes is None else modes.strongest(peak.order, peak.hz)
    if modes is None or k < 0 or not modes.of_crank[k] or abs(peak.hz - modes.hz[k]) > SAME * modes.hz[k]:
        return peak
    torsion = float(modes.shares[k, KINDS.index("torsional")])
    return replace(peak, motion_hz=float(modes.hz[k]), motion_torsion=torsion)


def _modes(runs: SteadyRuns) -> ModesInMotion | None:
    """Modes about the steady cycle of a simulation; None if they cannot be found."""
    try:
        return modes_in_motion(runs.simulation)
    except SolverError:  # a failure of the cycle to be linearised does not spoil a finished run-up
        return None
