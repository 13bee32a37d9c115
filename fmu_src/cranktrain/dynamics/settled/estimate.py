"""Estimated distance of the last cycle of a run from the periodic cycle.

Cycle j starts from x_j, changes it by r_j = G(x_j) − x_j and has the outputs o_j. Near the periodic cycle differences
of all three are linear maps of one another. So factors c_j are sought that minimise r + Σ c_j (r_j − r). The known part
of the outputs' error is then Σ c_j (o_j − o). The remaining part of r gives an error e of the state by the slow modes'
formula, (I − M)⁻¹ of it (:mod:`slow_modes`), and is converted to outputs by the largest |o_j − o|/|x_j − x| seen. The
sizes of both parts are added, by the triangle inequality. States are measured by their energies: of the block for
outputs that need it, else of crank and pistons.
"""

from collections.abc import Mapping

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.settled.anderson import anderson_step, shares
from cranktrain.dynamics.settled.judging import Judge
from cranktrain.dynamics.settled.motion import Motion
from cranktrain.dynamics.settled.slow_modes import SlowModes

DEPTH = 3
"""Number of cycles before the last that the estimate uses; earlier cycles are too far away for linear maps."""
DISTINCT = 0.1
"""Relative singular value of normalised changes below which the changes count as linearly dependent."""
MARGIN = 2.0
"""Safety factor of the estimate, for errors of linear maps from few cycles; chosen to stay above the true error."""
MARGIN_OF_ONE = 20.0
"""Safety factor with two cycles only, whose difference has another direction than the error, up to ten times off."""


class Past:
    """The last cycles of a run, or its last blocks of ``cycles`` cycles.

    ``left`` is the distance of the newest one from the periodic cycle, by output family; empty if there is only one.
    """

    def __init__(self, modes: SlowModes, judge: Judge, cycles: int = 1) -> None:
        self._modes, self._judge, self._cycles = modes, judge, cycles
        self._kept: list[tuple[Motion, Motion, Array]] = []

    def add(self, start: Motion, change: Motion, rows: Array) -> None:
        """Add a cycle: its start, the change of its start, and its outputs (samples, outputs)."""
        self._kept = [*self._kept[-DEPTH:], (start, change, rows)]

    def learn(self) -> None:
        """Update the modes from the last two cycles, which show how a change of the start develops over a cycle."""
        (first, changed, _), (second, changed_again, _) = self._kept[-2:]
        before = second.minus(first)
        self._modes.learn(before, before.plus(changed_again.minus(changed)), len(self._kept) == 2)

    def further(self) -> Motion:
        """Motion that Anderson's method adds to the correction by slow modes after the last cycle.

        Unless modes are being learned it is that of the drive line alone, whose connections may be far from linear: the
        collar could be led to an unstable motion.
        """
        known = [(start, change.plus(self._modes.correction(change, self._cycles))) for start, change, _ in self._kept]
        if self._modes.learned is None:
            known = [(self._modes.of_line(start), self._modes.of_line(missed)) for start, missed in known]
        return anderson_step(self._modes, known)

    @property
    def left(self) -> Mapping[str, float]:
        """Estimated distance of the newest cycle from the periodic cycle, by output family."""
        if len(self._kept) < 2:
            return {}
        *before, (start, change, rows) = self._kept
        starts = [self._modes.coordinates(s.minus(start)) for s, _, _ in before]
        differences = [r.minus(change) for _, r, _ in before]
        changes = [self._modes.coordinates(d) for d in differences]
        outputs = np.array([o - rows for _, _, o in before])
        estimates = []
        # Two estimates: from the motion of crank and pistons, and from the motion of the block.
        for body, known in enumerate(self._modes.coordinates(change)):
            # Factors whose weighted sum of the changes is nearest to −``known``.
            share = shares([c[body] for c in changes], -known, DISTINCT)
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
