"""Powers of the last cycle of a run, sample by sample, for its energy balance."""

from __future__ import annotations

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at


class PowerSamples:
    """The newest samples of ``Work.powers`` of steps without a break, both ends of a cycle included.

    Parameters
    ----------
    per_cycle : steps to 720°
    """

    def __init__(self, per_cycle: int) -> None:
        self._rows = np.zeros((per_cycle + 1, at.POWERS))
        self._start: Array | None = None
        self._count = 0

    def begin(self, powers: Array) -> None:
        """Say that the next steps go on from a state with these powers (POWERS,), W; older samples stay until then."""
        self._start = powers.copy()

    def add(self, powers: Array) -> None:
        """Keep the powers (POWERS,), W, at the end of a step."""
        if self._start is not None:
            self._rows[0], self._start, self._count = self._start, None, 1
        self._rows[self._count % len(self._rows)] = powers
        self._count += 1

    @property
    def cycle(self) -> Array | None:
        """The samples in order, (per_cycle + 1, POWERS) W; nothing before a cycle is full."""
        if self._count < len(self._rows):
            return None
        return np.roll(self._rows, -(self._count % len(self._rows)), axis=0)
