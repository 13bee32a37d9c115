"""What the last cycles of a run tell about the periodic one.

Cycle j started from x_j, changed it by r_j = G(x_j) − x_j and had the outputs o_j. Near the periodic cycle all three
differ by linear maps of one another. So those c_j are sought for which r + Σ c_j (r_j − r) is least; of the outputs
Σ c_j (o_j − o) is then known to be left. What no combination explains is taken through the slow modes' formula,
e = (I − M)⁻¹ of it (:mod:`slow_modes`), and counts with the largest |o_j − o|/|x_j − x| seen. Both are added, sizes by
the triangle inequality. States are measured by their energies: of the block for outputs that need it, else of crank and
pistons.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.settled.anderson import anderson_step
from cranktrain.dynamics.settled.judging import Judge
from cranktrain.dynamics.settled.motion import Motion
from cranktrain.dynamics.settled.slow_modes import SlowModes

DEPTH = 3
"""Cycles before the last that are made use of: those before them are too far away for linear maps."""
DISTINCT = 0.1
"""Share of their size by which changes must differ in direction to tell two things."""
MARGIN = 2.0
"""Factor on what is estimated, for what linear maps of few cycles leave out; chosen, to be above the truth."""
MARGIN_OF_ONE = 20.0
"""The same where two cycles are all: their difference is another direction than what is left, up to ten times off."""


class Past:
    """The last cycles, or blocks of so many cycles, of a run.

    ``left`` is what the last of them is off the periodic one, by family of outputs; empty while there is but one.
    """

    def __init__(self, modes: SlowModes, judge: Judge, cycles: int = 1) -> None:
        self._modes, self._judge, self._cycles = modes, judge, cycles
        self._kept: list[tuple[Motion, Motion, Array]] = []

    def add(self, start: Motion, change: Motion, rows: Array) -> None:
        """One more: where it started, what it changed, and its outputs (samples, outputs)."""
        self._kept = [*self._kept[-DEPTH:], (start, change, rows)]

    def learn(self) -> None:
        """Have the modes learn from the last two what a cycle makes of a change of its start."""
        (first, changed, _), (second, changed_again, _) = self._kept[-2:]
        before = second.minus(first)
        self._modes.learn(before, before.plus(changed_again.minus(changed)), len(self._kept) == 2)

    def further(self) -> Motion:
        """Motion that Anderson's method adds to the modes' correction after the last cycle, from all that are kept."""
        missed = [change.plus(self._modes.correction(change, self._cycles)) for _, change, _ in self._kept]
        starts = [start for start, _, _ in self._kept]
        return anderson_step(self._modes, list(zip(starts, missed, strict=True)))

    @property
    def left(self) -> Mapping[str, float]:
        """See above."""
        if len(self._kept) < 2:
            return {}
        *before, (start, change, rows) = self._kept
        starts = [self._modes.coordinates(s.minus(start)) for s, _, _ in before]
        differences = [r.minus(change) for _, r, _ in before]
        changes = [self._modes.coordinates(d) for d in differences]
        outputs = np.array([o - rows for _, _, o in before])
        estimates = []
        # Once by what crank and pistons tell, once by the block.
        for body, known in enumerate(self._modes.coordinates(change)):
            share = _combination(np.array([c[body] for c in changes]).T, known)
            rest = change
            for c, difference in zip(share, differences, strict=True):
                rest = rest.plus(difference, c)
            unknown = float(np.linalg.norm(self._modes.coordinates(self._modes.left(rest, self._cycles))[body]))
            far = np.array([np.linalg.norm(s[body]) for s in starts])
            weights = np.divide(unknown, far, out=np.zeros_like(far), where=far > 0.0)
            estimates.append((np.tensordot(share, outputs, 1), weights))
        left = self._judge.estimated(rows, outputs, estimates)
        margin = MARGIN if len(before) > 1 else MARGIN_OF_ONE
        return {name: margin * value for name, value in left.items()}


def _combination(columns: Array, known: Array) -> Array:
    """Factors (m,) of columns (n, m) whose sum comes nearest to −``known`` (n,)."""
    size = np.linalg.norm(columns, axis=0)
    size[size == 0.0] = 1.0
    return np.asarray(np.linalg.lstsq(columns / size, -known, rcond=DISTINCT)[0] / size)
