"""Samples of the powers in the last cycle of a run, for its energy balance."""

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at


class PowerSamples:
    """Newest samples of ``Work.powers`` over one cycle of uninterrupted steps, including both ends of the cycle.

    Parameters
    ----------
    per_cycle : number of steps in 720°
    """

    def __init__(self, per_cycle: int) -> None:
        self._rows = np.zeros((per_cycle + 1, at.POWERS))
        self._start: Array | None = None
        self._count = 0

    def begin(self, powers: Array) -> None:
        """Begin a new series from a state with ``powers`` (POWERS,), W; older samples stay until the next step."""
        self._start = powers.copy()

    def add(self, powers: Array) -> None:
        """Keep the powers (POWERS,), W, at the end of a step."""
        if self._start is not None:
            self._rows[0], self._start, self._count = self._start, None, 1
        self._rows[self._count % len(self._rows)] = powers
        self._count += 1

    @property
    def cycle(self) -> Array | None:
        """Samples of the powers over a cycle in order, (per_cycle + 1, POWERS) W; None before a cycle is complete."""
        if self._count < len(self._rows):
            return None
        return np.roll(self._rows, -(self._count % len(self._rows)), axis=0)
