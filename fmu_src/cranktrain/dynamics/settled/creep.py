"""An engine that creeps along the crank's axis on its mounts: the spline of its drive line slides a little each cycle.

A cycle moves block and crank together by d(s) from the place s, until the mounts balance the mean thrust. Far from that
place d hardly depends on s, for friction does not; near it d falls steeply. So far away the next place is the root of
the secant through the last two, but no further on than the collar's clearance, until d is small or changes its sign.
Then all modes settle together by Anderson's method (:mod:`anderson`). Behind a bolted joint nothing creeps, and all is
left to that.
"""

from __future__ import annotations

import numpy as np

from cranktrain.dynamics.model.arrays import ModelArrays, dimensions
from cranktrain.dynamics.settled.anderson import anderson_step
from cranktrain.dynamics.settled.motion import Motion
from cranktrain.dynamics.settled.slow_modes import ALONG, SlowModes

DEPTH = 5
"""Differences that Anderson's method knows: as many as slow motions that no formula tells."""
NEAR, FARTHEST, LONGEST = 0.05, 1.0, 0.25
"""Drift over a cycle from which on Anderson's method takes over; longest steps of the secant, and of that method along
the axis: in clearances of the collar."""
FRESH_STARTS = 2
"""How often a run that gains no more forgets its cycles and begins anew."""


class Creep:
    """How such an engine settles, block by block of cycles."""

    def __init__(self, model: ModelArrays, modes: SlowModes) -> None:
        self._modes = modes
        sizes, t = dimensions(model), model.ports.shape[1]
        self._clearance = 2.0 * float(model.scales[sizes.collar])
        along, faces = model.ports[sizes.collar], int(model.axial[0, 1]) - model.ports.shape[0]
        self._block, per_mode = t + ALONG, float(model.block_ports[faces, ALONG])
        self._per_metre = 1.0 / per_mode
        # Crank and block go one metre along the axis, the shaft behind the spline does not.
        rigid = np.where(model.omega2[:t] == 0.0, along, 0.0)
        place = np.zeros(model.omega2.size)
        place[:t] = rigid / float(along @ rigid)
        place[self._block] = self._per_metre
        still = np.zeros_like(place)
        self._metre = Motion(place, still, still, 0.0, 0.0)
        self._slides, self._fresh_starts = sizes.slides, 0
        self.forget()

    def fresh_start(self) -> bool:
        """Forget all cycles where that may help; whether it was done."""
        if self._fresh_starts == FRESH_STARTS:
            return False
        self._fresh_starts += 1
        self.forget()
        return True

    def forget(self) -> None:
        """Know nothing of former cycles."""
        self._near, self._drifts = not self._slides, list[tuple[float, float]]()
        self._known: list[tuple[Motion, Motion]] = []

    def correction(self, start: Motion, change: Motion, known: Motion) -> Motion:
        """What to add beside the correction ``known`` after cycles that changed their ``start``."""
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
        """How far beyond its drift the engine goes next, m."""
        farthest = FARTHEST * self._clearance
        place, drift = self._drifts[-1]
        step = np.copysign(farthest, drift)
        if len(self._drifts) > 1:
            before, drifted = self._drifts[0]
            if (drift - drifted) * (place - before) < 0.0:
                step = -drift * (place - before) / (drift - drifted) - drift
        return float(np.clip(step, -farthest, farthest))

    def _anderson(self) -> Motion:
        """What that method adds, no further along the axis than ``LONGEST``."""
        total = anderson_step(self._modes, self._known)
        over = abs(float(total.place[self._block] / self._per_metre)) / (LONGEST * self._clearance)
        return total.minus(total).plus(total, 1.0 / max(1.0, over))


def creep_of(model: ModelArrays, modes: SlowModes) -> Creep | None:
    """How a model creeps; None where no joint holds it along the axis, or nothing stands on mounts."""
    held = dimensions(model).joint >= 0 and model.block_ports.shape[0] > 0
    return Creep(model, modes) if held else None
