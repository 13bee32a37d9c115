"""Settling of an engine that creeps along the crank's axis, as the spline of its drive line slides in each cycle.

A cycle moves block and crank together by d(s) from the position s, until the mounts balance the mean thrust. Far from
that position d hardly depends on s, because friction does not. Near it d falls steeply. So at first the next position
is the root of the secant through the last two, at most the collar's clearance away, until d is small or changes its
sign. Then all modes settle together by Anderson's method (:mod:`anderson`). With a bolted joint nothing creeps, so only
that method is used.
"""

import numpy as np

from cranktrain.dynamics.model.records import ModelArrays, dimensions
from cranktrain.dynamics.settled.anderson import anderson_step
from cranktrain.dynamics.settled.motion import Motion
from cranktrain.dynamics.settled.slow_modes import ALONG, SlowModes

DEPTH = 5
"""Number of differences between cycles that Anderson's method uses."""
NEAR, FARTHEST, LONGEST = 0.05, 1.0, 0.25
"""In clearances of the collar: drift per cycle below which Anderson's method takes over; longest step of the secant;
longest step of Anderson's method along the axis."""
FRESH_STARTS = 2
"""Number of times that a run without further progress drops the data of its old cycles and begins again."""


class Creep:
    """Corrections of a creeping engine, block by block of cycles."""

    def __init__(self, model: ModelArrays, modes: SlowModes) -> None:
        self._modes = modes
        sizes, t = dimensions(model), model.ports.shape[1]
        self._clearance = 2.0 * float(model.scales[sizes.collar])
        along, faces = model.ports[sizes.collar], int(model.axial[0, 1]) - model.ports.shape[0]
        self._block, per_mode = t + ALONG, float(model.block_ports[faces, ALONG])
        self._per_metre = 1.0 / per_mode
        # Crank and block move one metre along the axis, the shaft behind the spline does not move.
        rigid = np.where(model.omega2[:t] == 0.0, along, 0.0)
        place = np.zeros(model.omega2.size)
        place[:t] = rigid / float(along @ rigid)
        place[self._block] = self._per_metre
        still = np.zeros_like(place)
        self._metre = Motion(place, still, still, 0.0, 0.0)
        self._slides, self._fresh_starts = sizes.slides, 0
        self.forget()

    def fresh_start(self) -> bool:
        """Forget all cycles, at most ``FRESH_STARTS`` times; returns True if it was done."""
        if self._fresh_starts == FRESH_STARTS:
            return False
        self._fresh_starts += 1
        self.forget()
        return True

    def forget(self) -> None:
        """Drop the data of former cycles."""
        self._near, self._drifts = not self._slides, list[tuple[float, float]]()
        self._known: list[tuple[Motion, Motion]] = []

    def correction(self, start: Motion, change: Motion, known: Motion) -> Motion:
        """Motion to add to the correction ``known`` after cycles from ``start`` that changed it by ``change``."""
        place, drift = (float(motion.place[self._block]) / self._per_metre for motion in (start, change))
        before = self._drifts[-1][1] if self._drifts else 0.0
        if abs(drift) < NEAR * self._clearance or before * drift < 0.0:
            self._near = True
        self._drifts = [*self._drifts[-1:], (place, drift)]
        if not self._near:
            return self._metre.minus(self._metre).plus(self._metre, self._step())
        self._known = [*self._known[-DEPTH:], (start, change.plus(known))]
        return self._anderson()

    def _step(self) -> float:
        """Step along the axis beyond the drift of the last cycle, m."""
        farthest = FARTHEST * self._clearance
        place, drift = self._drifts[-1]
        step = np.copysign(farthest, drift)
        if len(self._drifts) > 1:
            before, drifted = self._drifts[0]
            if (drift - drifted) * (place - before) < 0.0:
                step = -drift * (place - before) / (drift - drifted) - drift
        return float(np.clip(step, -farthest, farthest))

    def _anderson(self) -> Motion:
        """Correction by Anderson's method, limited to ``LONGEST`` along the axis."""
        total = anderson_step(self._modes, self._known)
        over = abs(float(total.place[self._block] / self._per_metre)) / (LONGEST * self._clearance)
        return total.minus(total).plus(total, 1.0 / max(1.0, over))


def creep_of(model: ModelArrays, modes: SlowModes) -> Creep | None:
    """Corrections of a model that may creep; None without an axial joint or without a block on mounts."""
    held = dimensions(model).joint >= 0 and model.block_ports.shape[0] > 0
    return Creep(model, modes) if held else None
