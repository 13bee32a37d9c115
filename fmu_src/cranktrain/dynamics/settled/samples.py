"""Samples of a run, with their times and crank angles, on the way to where they are kept."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from cranktrain.core.reduced_body import Array


class Sink(Protocol):
    """Takes the samples of a run as they come, in place of the memory."""

    def begin(self, names: tuple[str, ...], samples: int) -> None:
        """Get ready for so many samples of these outputs; those of a run before are of no use any more."""

    @property
    def count(self) -> int:
        """Samples that it has: an interrupt may have come before some were taken, or after."""

    def keep(self, time: Array, angle: Array, values: Array) -> None:
        """Take samples: times (k,), s, crank angles (k,), rad, and outputs (k, names), SI."""


class Samples:
    """Rows of all outputs, of which some are shown, and the sink that they go to, where there is one.

    Parameters
    ----------
    columns : of the outputs that are shown, by name
    step : communication step, s
    speed : of the shaft, rad/s; None where it is free
    """

    def __init__(self, columns: Mapping[str, int], step: float, speed: float | None, sink: Sink | None) -> None:
        self.columns, self.sink = columns, sink
        self._step, self._speed = step, speed

    def begin(self, samples: int) -> None:
        """Say how many come."""
        if self.sink is not None:
            self.sink.begin(tuple(self.columns), samples)

    @property
    def count(self) -> int:
        """Samples that the sink has; 0 without one."""
        return 0 if self.sink is None else self.sink.count

    def keep(self, rows: Array) -> None:
        """Pass on the next rows (k, all outputs)."""
        if self.sink is not None:
            self.sink.keep(*self.axes(rows, self.count), rows[:, list(self.columns.values())])

    def keep_all(self, rows: Array) -> None:
        """Pass on rows that are the whole run."""
        self.begin(len(rows))
        self.keep(rows)

    def axes(self, rows: Array, first: int) -> tuple[Array, Array]:
        """Times and crank angles of rows, the first of which is so many steps after time 0."""
        times = np.arange(first, first + len(rows), dtype=np.float64) * self._step
        # Of a given speed the shaft's, even in time; a free crank has but its own.
        return times, rows[:, 0].copy() if self._speed is None else self._speed * times
