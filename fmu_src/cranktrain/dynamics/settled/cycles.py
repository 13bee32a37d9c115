"""Run of successive cycles of a simulation: a given number, or until cycles repeat.

After each cycle r = G(x) − x is the residual of the state x. The next cycle starts from G(x) + M (I − M)⁻¹ r, with the
correction for the slow modes only (:mod:`slow_modes`); by plain running the fraction M of the error would remain. In a
run-up the last cycles correct all other modes (:mod:`anderson`). An engine that creeps along the crank's axis is also
moved to its final position (:mod:`creep`). If this makes no more progress, the motion may have a longer period. Plain
cycles then show after how many cycles p it comes nearest to itself, and from then on p are taken at once, with Mᵖ for
M.
"""

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.records import ModelArrays
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.model.state import SHAFT_ANGLE, TIME, UNDER_WAY
from cranktrain.dynamics.settled.collar import Learned
from cranktrain.dynamics.settled.creep import creep_of
from cranktrain.dynamics.settled.estimate import Past
from cranktrain.dynamics.settled.judging import MOST_CYCLES, TOLERANCE, Judge, Settling
from cranktrain.dynamics.settled.longer_periods import (
    LONGEST_PERIOD,
    PLAINLY,
    comes_again,
    fading,
    nearest_period,
    repeats_every,
)
from cranktrain.dynamics.settled.motion import correct_motion, motion_of, settling_motion
from cranktrain.dynamics.settled.samples import Samples
from cranktrain.dynamics.settled.slow_modes import SlowModes

CALL = 0.2
"""Approximate longest wall time between two checks for an interrupt, s."""
INTERVALS = 48
"""Number of parts of a cycle between which connections of the drive line have secants, 15 degrees each; chosen."""
RECENT = LONGEST_PERIOD + 2
"""Number of cycles kept in memory if samples go to a sink: the cycles that are compared, and the present one."""
PATIENCE, PATIENCE_OF_BLOCKS, GAIN = 3, 2, 0.5
"""A run makes no more progress if its last PATIENCE cycles (or blocks of cycles) leave more than GAIN of the error."""
PATIENCE_OF_CREEP = 4
"""PATIENCE for an engine that creeps along the crank's axis."""
TRIED = 24
"""Most cycles of a run that starts from the motion at a neighbouring speed; usual runs settle within 8."""


class Stepped(Protocol):
    """Interface of a simulation that is run over cycles."""

    settings: Settings
    model: ModelArrays
    inputs: Array
    outputs: Array
    state: Array

    def series(self, step: float, first: int, rows: Array) -> int:
        """See :meth:`cranktrain.dynamics.simulation.Simulation.series`."""

    def step(self, t_end: float) -> None:
        """See :meth:`cranktrain.dynamics.simulation.Simulation.step`."""


class Expected(NamedTuple):
    """Data from a run at a neighbouring speed: whether its period is doubtful, and data learned while it settled.

    With ``tries`` the run ends if it makes no more progress, or after ``TRIED`` cycles, without a search for longer
    periods, because another start may succeed.
    """

    doubtful: bool = False
    learned: Learned | None = None
    tries: bool = False


NOTHING = Expected()


class Recorded(NamedTuple):
    """Outputs (samples + 1, outputs) of the recorded cycles, their settling, and whether the run is complete.

    Row 0 is the state ``first`` communication steps after time 0. ``learned`` are the learned data of settling, if such
    data were expected.
    """

    rows: Array
    settling: Settling
    complete: bool
    first: int = 0
    learned: Learned | None = None


class Recorder:
    """Recorder, which takes communication steps of a simulation and keeps their outputs.

    Attributes
    ----------
    simulation : the simulation that is stepped
    step, per_cycle : communication step, s, and number of steps in a cycle
    taken, seconds : number of all steps taken, and their wall time
    under_way : outputs of the present cycles, beginning with those at their start
    seen : (s + 1, 2, n) modal displacement and velocity at successive times of the last cycles
    """

    def __init__(self, simulation: Stepped, step: float, per_cycle: int) -> None:
        self.simulation = simulation
        self.step, self.per_cycle = step, per_cycle
        self.taken, self.seconds, self._at_once = 0, 0.0, 4
        self.under_way: Array = np.empty((0, simulation.outputs.size))
        self.seen = self._motion[None]

    def take(self, rows: Array, first: int = 0, seen: list[Array] | None = None) -> None:
        """Take one communication step for each of the ``rows``, beginning ``first`` steps after time 0.

        ``seen`` gets displacement and velocity at the start of each of ``INTERVALS`` parts of a cycle.
        """
        done = 0
        while done < len(rows):
            start = time.perf_counter()
            end = min(done + self._at_once, len(rows))
            if seen is not None:
                seen.append(self._motion)
                end = min(end, done + max(1, self.per_cycle // INTERVALS))
            before = done
            try:
                done += self.simulation.series(self.step, first + done + 1, rows[done:end])
                while done < end:
                    self.simulation.step((first + done + 1) * self.step)
                    rows[done] = self.simulation.outputs
                    done += 1
            finally:
                spent = time.perf_counter() - start
                self.taken += done - before
                self.seconds += spent
            self._at_once = max(1, min(4 * self._at_once, int((end - before) * CALL / max(spent, 1e-9))))

    def cycles(self, count: int) -> Array:
        """Take ``count`` cycles from time 0. Return their outputs, beginning with the outputs at the start."""
        rows = np.empty((count * self.per_cycle + 1, self.simulation.outputs.size))
        rows[0] = self.simulation.outputs
        before = self.taken
        seen = list[Array]()
        try:
            self.take(rows[1:], seen=seen)
        finally:
            self.under_way = rows[: self.taken - before + 1]
        self.seen = np.array([*seen, self._motion])
        return rows

    @property
    def _motion(self) -> Array:
        return np.array(motion_of(self.simulation.state, self.simulation.model.omega2.size)[:2])


def plain_cycles(
    recorder: Recorder,
    judge: Judge,
    cycles: int,
    tolerance: float,
    progress: Callable[[float], None] | None = None,
    samples: Samples | None = None,
) -> Recorded:
    """Take ``cycles`` cycles one after the other, settled or not.

    ``samples`` get the rows of each cycle, also of one that fails. Then only the last ``RECENT`` cycles stay in memory,
    or ``MOST_CYCLES`` if the speed is free, where a cycle's time may be only part of a revolution.
    """
    simulation, count = recorder.simulation, recorder.per_cycle
    driven = simulation.model.scalars[at.DRIVEN] > 0.0
    held = cycles if samples is None else min(cycles, RECENT if driven else MOST_CYCLES)
    rows = np.empty((held * count + 1, simulation.outputs.size))
    rows[0] = simulation.outputs
    if samples is not None:
        samples.keep(rows[:1])
    past = Past(SlowModes(simulation.model, float(simulation.inputs[0])), judge)
    begin = before = recorder.taken
    first, part = 0, rows[:0]
    try:
        for k in range(cycles):
            if k >= held:
                rows[:-count] = rows[count:]
                first += count
            part, before = rows[k * count - first + 1 : (k + 1) * count - first + 1], recorder.taken
            start = settling_motion(simulation.model, simulation.state)
            try:
                recorder.take(part, k * count)
            finally:
                if samples is not None:
                    samples.keep(part[: recorder.taken - before])
            past.add(start, settling_motion(simulation.model, simulation.state).minus(start), part.copy())
            if progress is not None:
                progress((k + 1) / cycles)
    except KeyboardInterrupt:
        if samples is not None:  # an interrupt may have come before all samples were passed on
            missing = recorder.taken - begin + 1 - samples.count
            samples.keep(part[recorder.taken - before - missing : recorder.taken - before])
        if recorder.taken - begin < count:
            raise
    done = recorder.taken - begin
    whole, rows = done // count, rows[: done - first + 1]
    left = past.left
    settling = Settling(whole, 0, tolerance, left, bool(driven))
    if left:
        compared = rows[1 : (whole - first // count) * count + 1].reshape(-1, count, rows.shape[1])
        settled = max(left.values(), default=0.0) <= tolerance
        settling = replace(settling, repeats=1 if settled else comes_again(judge, compared, tolerance))
    return Recorded(rows, settling, done == cycles * count, first)


def settled_cycles(
    recorder: Recorder,
    judge: Judge,
    tolerance: float = TOLERANCE,
    most: int = MOST_CYCLES,
    progress: Callable[[float], None] | None = None,
    say: Callable[[str], None] | None = None,
    expected: Expected = NOTHING,
) -> Recorded:
    """Take cycles until the residual of every output family is at most ``tolerance``. Return the cycles that repeat.

    The simulation's time begins at 0 with each cycle. ``progress`` gets the fraction done, ``say`` cycles and residual.
    If the period is doubtful, it is searched for at once.
    """
    simulation, tell = recorder.simulation, say or (lambda text: None)
    most = min(most, TRIED) if expected.tries else most
    modes = SlowModes(simulation.model, float(simulation.inputs[0]), expected.learned)
    creep = creep_of(simulation.model, modes)
    patience = PATIENCE if creep is None else PATIENCE_OF_CREEP
    search, shortest = expected.doubtful, 1 if expected.doubtful else 2
    block, done, share, apart, learns = 1, 0, 0.0, math.inf, True
    past, rows = Past(modes, judge), np.empty(0)
    worst: list[float] = []
    settling = Settling(0, 0, tolerance)
    while True:
        if search:
            modes.collar.forget()
            creep = creep_of(simulation.model, modes)
            plain = plainly(recorder, judge, tolerance, most - LONGEST_PERIOD - done, shortest)
            done, block, search = done + plain.cycles, plain.nearest, False
            if not block:
                return Recorded(plain.rows, plain.settling(judge, done, tolerance), True, learned=modes.learned)
            past, worst, apart, learns = Past(modes, judge, block), [], math.inf, False
        start = settling_motion(simulation.model, simulation.state)
        try:
            rows = recorder.cycles(block)
        except KeyboardInterrupt:
            if not rows.size:
                raise
            return Recorded(rows, settling, False)
        done += block
        rewind(simulation, block)
        change = settling_motion(simulation.model, simulation.state).minus(start)
        modes.follow(recorder.seen)
        past.add(start, change, rows[1:])
        if learns and done > 1:
            past.learn()
        left = past.left
        worst += [max(left.values(), default=0.0)] if left else []
        settling = Settling(done, 0, tolerance, left)
        if left:
            tell(f"cycle {done}: settling error {worst[-1]:.1e} (limit {tolerance:g})")
        if progress is not None:
            share = max(share, done / most, _gained(worst, tolerance))
            progress(min(share, 1.0))
        fades, apart = fading(judge, rows[1:], block, apart, tolerance)
        if left and worst[-1] <= tolerance and not fades:
            repeats = repeats_every(judge, rows[1:], block, tolerance)
            kept = rows[-repeats * recorder.per_cycle - 1 :]
            return Recorded(kept, Settling(done, repeats, tolerance, left), True, learned=modes.learned)
        if done + block > most:
            return Recorded(rows, settling, True, learned=modes.learned)
        last = patience if block == 1 else PATIENCE_OF_BLOCKS
        stays = len(worst) >= 2 * last and min(worst[-last:]) > GAIN * min(worst[:-last])
        if stays and creep is not None and creep.fresh_start():
            worst = worst[-1:]
        elif stays:
            search = done + PLAINLY + LONGEST_PERIOD <= most and not expected.tries
            if search:
                continue
            if block > 1 or expected.tries:
                return Recorded(rows, settling, True, learned=modes.learned)
        total = modes.correction(change, block)
        if creep is not None and done > 1:
            total = total.plus(creep.correction(start, change, total))
        elif creep is None and block == 1 and modes.joint_correction:
            total = total.plus(past.further())
        state = simulation.state
        correct_motion(simulation.model, state, total)
        simulation.state = state


class Plain(NamedTuple):
    """Cycles without correction: number, outputs of the last ``PLAINLY`` cycles, period, growth of differences."""

    cycles: int
    rows: Array
    nearest: int
    parting: float

    def settling(self, judge: Judge, done: int, tolerance: float) -> Settling:
        """Settling of a motion without a period after ``done`` cycles; its error is the difference of the last two."""
        count = len(self.rows) // PLAINLY
        left = judge.left(self.rows[-count:], self.rows[-2 * count : -count])
        return Settling(done, 0, tolerance, left, parting=self.parting)


def plainly(recorder: Recorder, judge: Judge, tolerance: float, most: int, shortest: int) -> Plain:
    """Take ``PLAINLY`` cycles without correction, repeatedly as long as they settle, at most ``most`` in all.

    The search is for periods of ``shortest`` cycles or more.
    """
    taken, nearest, parting = 0, -1, math.nan
    while nearest < 0 and taken + PLAINLY <= most:
        rows = recorder.cycles(PLAINLY)
        rewind(recorder.simulation, PLAINLY)
        taken += PLAINLY
        # Every second sample is enough to compare cycles.
        cycles = rows[1:].reshape(PLAINLY, recorder.per_cycle, -1)[:, ::2]
        nearest, parting = nearest_period(judge, cycles, tolerance, shortest)
    return Plain(taken, rows, abs(nearest), parting)


def rewind(simulation: Stepped, cycles: int) -> None:
    """Make the present state a start: set its time to 0 and subtract ``cycles`` cycles from the shaft's angle."""
    state = simulation.state
    state[TIME] = state[UNDER_WAY] = 0.0
    state[SHAFT_ANGLE] -= 4.0 * math.pi * cycles
    simulation.state = state


def _gained(worst: list[float], tolerance: float) -> float:
    """Progress towards the tolerance, as a fraction, by the logarithm of the residual."""
    if not worst or worst[0] <= tolerance:
        return 0.0
    return math.log(worst[0] / max(worst[-1], tolerance)) / math.log(worst[0] / tolerance)
