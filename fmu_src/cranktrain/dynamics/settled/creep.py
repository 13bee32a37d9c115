"""An engine that creeps along the crank's axis on its mounts: the spline of its drive line slides a little each cycle.

A cycle moves block and crank together by d(s) from the place s, until the mounts balance the mean thrust. Far from that
place d hardly depends on s, for friction does not; near it d falls steeply. So far away the next place is the root of
the secant through the last two, but no further on than the collar's clearance, until d is small or changes its sign.
Then all modes settle together by Anderson's method: with the starts x_j of the last cycles and what each misses,
f_j = G(x_j) − x_j and the slow modes' correction, the next start is

    x + f − Σ γ_j (Δx_j + Δf_j),    γ the least squares of f ≈ Σ γ_j Δf_j

between one cycle and the next, by the energies in :meth:`slow_modes.SlowModes.coordinates`. No multiplier has to be
known, and it ends at the same cycle as plain running. Behind a bolted joint nothing creeps, and all is left to that.

Source: D. G. Anderson, Iterative procedures for nonlinear integral equations, J. ACM 12, 1965.
"""

from __future__ import annotations

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.arrays import ModelArrays, dimensions
from cranktrain.dynamics.settled.motion import Motion
from cranktrain.dynamics.settled.slow_modes import ALONG, SlowModes

DEPTH = 5
"""Differences that Anderson's method knows: as many as slow motions that no formula tells."""
DISTINCT = 0.02
"""Singular value of normalised differences, over the largest, below which they tell nothing new."""
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
        """−Σ γ_j (Δx_j + Δf_j)."""
        _, missed = self._known[-1]
        total = missed.minus(missed)
        pairs = list(zip(self._known, self._known[1:], strict=False))
        if not pairs:
            return total
        starts, changes = ([later[k].minus(sooner[k]) for sooner, later in pairs] for k in range(2))
        columns = np.array([self._measure(change) for change in changes]).T
        size = np.linalg.norm(columns, axis=0)
        size[size == 0.0] = 1.0
        shares = np.linalg.lstsq(columns / size, self._measure(missed), rcond=DISTINCT)[0] / size
        for share, start, change in zip(shares, starts, changes, strict=True):
            total = total.plus(start.plus(change), -share)
        over = abs(float(total.place[self._block] / self._per_metre)) / (LONGEST * self._clearance)
        return missed.minus(missed).plus(total, 1.0 / max(1.0, over))

    def _measure(self, motion: Motion) -> Array:
        return np.concatenate(self._modes.coordinates(motion))


def creep_of(model: ModelArrays, modes: SlowModes) -> Creep | None:
    """How a model creeps; None where no joint holds it along the axis, or nothing stands on mounts."""
    held = dimensions(model).joint >= 0 and model.block_ports.shape[0] > 0
    return Creep(model, modes) if held else None
