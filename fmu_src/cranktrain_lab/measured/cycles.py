"""Cycles of a measured pressure, as rows of samples that are read and converted in blocks when needed.

A recording of 1 GB has some 10⁴ cycles of 10⁴ samples. Means, scatter and values of each cycle need one pass over the
samples, never all samples at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain_lab.measured.channels import Held

Kind = TypeVar("Kind", bound=np.generic)
BLOCK = 1_000_000
"""Number of pressure samples that are read at once."""
HELD = 4_000_000
"""Number of samples of computed rows kept in memory; more go to a temporary file."""


class CycleRows:
    """Rows of samples, one row per cycle, read block by block; ``numpy.asarray`` returns all rows as an array.

    ``read`` is a function (first, past the last) → (k, size).
    """

    def __init__(self, count: int, size: int, read: Callable[[int, int], Array]) -> None:
        self.count, self.size, self.read = count, size, read

    @classmethod
    def of(cls, values: Array) -> CycleRows:
        """Return the rows (cycles, samples) of an array in memory."""
        return cls(len(values), values.shape[1], lambda first, last: values[first:last])

    @classmethod
    def kept(cls, blocks: Iterable[Array]) -> CycleRows:
        """Store rows of blocks (k, size) that are costly to compute, in memory or a temporary file. Return the rows."""
        held = Held(HELD)
        for block in blocks:
            held.add(block)
        return cls(held.count, held.width, held.read)

    def __len__(self) -> int:
        """Return the number of rows, one for each cycle."""
        return self.count

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        """Return all rows, for recordings that fit the memory."""
        whole = np.concatenate([block for _, block in self.blocks()]) if self.count else np.empty((0, self.size))
        return whole if dtype is None else whole.astype(dtype)

    def blocks(self) -> Iterator[tuple[int, Array]]:
        """Yield the first row of each block, and the block (k, size)."""
        step = max(1, BLOCK // self.size)
        for first in range(0, self.count, step):
            yield first, self.read(first, min(first + step, self.count))

    def mapped(self, change: Callable[[int, Array], Array]) -> CycleRows:
        """Return rows to which ``change`` (first row number, block (k, size)) is applied whenever they are read."""
        return CycleRows(self.count, self.size, lambda first, last: change(first, self.read(first, last)))

    def chosen(self, rows: NDArray[np.intp]) -> CycleRows:
        """Return the rows with these increasing row numbers."""

        def read(first: int, last: int) -> Array:
            own = rows[first:last]
            return self.read(int(own[0]), int(own[-1]) + 1)[own - own[0]] if own.size else np.empty((0, self.size))

        return CycleRows(len(rows), self.size, read)

    def mean(self) -> Array:
        """Return the mean row, (size,)."""
        total = np.zeros(self.size)
        for _, block in self.blocks():
            total += block.sum(axis=0)
        return np.asarray(total / self.count)

    def deviation(self, mean: Array) -> Array:
        """Return the standard deviation of the rows about ``mean``, (samples,); zeros for a single row."""
        total = np.zeros(self.size)
        for _, block in self.blocks():
            total += ((block - mean) ** 2).sum(axis=0)
        return np.asarray(np.sqrt(total / max(1, self.count - 1)))

    def each(self, value: Callable[[Array], NDArray[Kind]]) -> NDArray[Kind]:
        """Return one number per row, (count,), by a function of blocks (k, size)."""
        return np.concatenate([np.asarray(value(block)) for _, block in self.blocks()])


@dataclass(frozen=True)
class Cycles:
    """Measured pressure cycles of one cylinder.

    Attributes
    ----------
    name : name of the channel
    angle : (n,) rad after the assumed firing dead centre
    pressure : (c, n) Pa, with measured zeros until pegging; read block by block, ``numpy.asarray`` returns all
    speed : mean speed, rad/s
    rate : sampling rate of the channel, Hz; NaN if unknown
    zeros : (c,) Pa added by pegging
    remarks : one line each
    """

    name: str
    angle: Array
    pressure: CycleRows
    speed: float
    rate: float
    zeros: Array
    remarks: tuple[str, ...] = ()

    @cached_property
    def mean(self) -> Array:
        """Mean cycle, (n,) Pa."""
        return self.pressure.mean()

    @cached_property
    def scatter(self) -> Array:
        """Standard deviation between cycles, (n,) Pa; zeros for a single cycle."""
        return self.pressure.deviation(self.mean)

    def turned(self, by: float) -> Cycles:
        """Shift the cycles from θ to θ + ``by``, rad."""
        whole = period(self.angle)

        def moved(_: int, rows: Array) -> Array:
            return np.array([np.interp(self.angle - by, self.angle, row, period=whole) for row in rows])

        return replace(self, pressure=self.pressure.mapped(moved))

    def low_passed(self, shortest: float) -> Cycles:
        """Low-pass waves shorter than an angle, rad, without delay; ``InputError`` for an angle below two samples."""
        step = float(self.angle[1] - self.angle[0])
        if shortest < 2.0 * step:
            raise InputError(
                f"{self.name}: a low-pass of {math.degrees(shortest):.3g} deg is finer than two samples, "
                f"{math.degrees(2 * step):.3g} deg"
            )
        order = np.fft.rfftfreq(self.angle.size, step) * shortest  # relative to the order of the shortest wave
        gain = 0.5 * (1.0 + np.cos(math.pi * np.clip((order - 0.8) / 0.4, 0.0, 1.0)))

        def passed(_: int, rows: Array) -> Array:
            return np.asarray(np.fft.irfft(np.fft.rfft(rows, axis=1) * gain, self.angle.size, axis=1))

        return replace(self, pressure=self.pressure.mapped(passed))


def period(angle: Array) -> float:
    """Return the angle (rad) of the whole cycle that n sample angles cover."""
    return float(angle[1] - angle[0]) * angle.size
