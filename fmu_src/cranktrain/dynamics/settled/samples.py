"""Samples of a run with their times and crank angles, passed on to a sink, and of its powers in the last cycle."""

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at


class Sink(Protocol):
    """Store that takes the samples of a run as they are computed, so that they need not stay in memory."""

    def begin(self, names: tuple[str, ...], samples: int) -> None:
        """Prepare for ``samples`` samples of the outputs ``names``; samples of an earlier run are dropped."""

    @property
    def count(self) -> int:
        """Number of samples stored, which an interrupt may have kept below the number passed on."""

    def keep(self, time: Array, angle: Array, values: Array) -> None:
        """Store samples: times (k,), s, crank angles (k,), rad, and outputs (k, names), SI."""


class Samples:
    """Selects the shown outputs from rows of all outputs, and passes them to a sink, if any.

    Parameters
    ----------
    columns : column of each shown output, by name
    step : communication step, s
    speed : given speed of the shaft, rad/s; None if it is free
    """

    def __init__(self, columns: Mapping[str, int], step: float, speed: float | None, sink: Sink | None) -> None:
        self.columns, self.sink = columns, sink
        self._step, self._speed = step, speed

    def begin(self, samples: int) -> None:
        """Announce the number of samples to the sink."""
        if self.sink is not None:
            self.sink.begin(tuple(self.columns), samples)

    @property
    def count(self) -> int:
        """Number of samples in the sink; 0 without a sink."""
        return 0 if self.sink is None else self.sink.count

    def keep(self, rows: Array) -> None:
        """Pass the next k rows of all outputs, (k, outputs), to the sink."""
        if self.sink is not None:
            self.sink.keep(*self.axes(rows, self.count), rows[:, list(self.columns.values())])

    def keep_all(self, rows: Array) -> None:
        """Pass the rows of a whole run to the sink."""
        self.begin(len(rows))
        self.keep(rows)

    def axes(self, rows: Array, first: int) -> tuple[Array, Array]:
        """Times (s) and crank angles (rad) of rows that begin ``first`` steps after time 0."""
        times = np.arange(first, first + len(rows), dtype=np.float64) * self._step
        # With a given speed the angle is the shaft's, uniform in time; otherwise it is the crank's own.
        return times, rows[:, 0].copy() if self._speed is None else self._speed * times


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
