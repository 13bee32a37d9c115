"""Channels of a measurement, with names, units, sampling, and samples that are read in blocks.

Samples stay in the file until they are read, and have the unit of the file. A channel over time has samples at
``start + i step`` seconds, or its own time base. Channels over another abscissa (orders over speed, spectra) name the
abscissa and its unit.
"""

import math
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.types import Array

BLOCK = 2**20
"""Number of samples that are read at once as a block (8 MB)."""
UNEVEN = 1e-3
"""Time steps count as equal if their largest deviation is below this fraction of their median."""
MANY, PROBES = 2_000_000, 12
"""Largest number of sampling times that are all checked, and number of times to check in a longer channel."""
TIME = "time"
Reader = Callable[[int, int], Array]
Key = TypeVar("Key")
Value = TypeVar("Value")


@dataclass(frozen=True)
class Channel:
    """Measured channel with name, unit, samples and their times.

    Attributes
    ----------
    name, unit : name and unit in the file; the unit is empty if the file states none
    size : number of samples
    source : name of the file
    read : function (first, past the last) → samples as float64, in ``unit``
    start, step : start and step of the abscissa; ``step`` is NaN if ``places`` reads the abscissa
    places : function (first, past the last) → abscissa, or None
    abscissa, abscissa_unit : kind and unit of the abscissa: ``time`` in s, ``speed`` in rev/min, ``frequency`` in Hz, …
    about : further text of the file: title, group, direction
    began : date and time of abscissa 0, ns since 1970 UTC; None if the file does not state it
    """

    name: str
    unit: str
    size: int
    source: str
    read: Reader = field(repr=False, compare=False)
    start: float = 0.0
    step: float = math.nan
    places: Reader | None = field(default=None, repr=False, compare=False)
    abscissa: str = TIME
    abscissa_unit: str = "s"
    about: str = ""
    began: int | None = None

    @property
    def where(self) -> str:
        """File and name of the channel, for messages."""
        return f"{self.source}, channel {self.name}"

    @property
    def rate(self) -> float:
        """Sampling rate, Hz; NaN if the step varies or the samples are not over time."""
        return 1.0 / self.step if self.step > 0.0 and self.abscissa == TIME else math.nan

    def blocks(self, size: int = BLOCK) -> Iterator[tuple[int, Array]]:
        """Yield first index and samples of each block."""
        for first in range(0, self.size, size):
            yield first, self.read(first, min(first + size, self.size))

    def values(self, first: int = 0, last: int | None = None) -> Array:
        """Return the samples from index ``first`` to before ``last``, by default the whole channel."""
        return self.read(first, self.size if last is None else min(last, self.size))

    def abscissae(self, first: int = 0, last: int | None = None) -> Array:
        """Return the abscissa (time: s) of the samples from index ``first`` to before ``last``."""
        last = self.size if last is None else min(last, self.size)
        if self.places is not None:
            return self.places(first, last)
        return np.asarray(self.start + self.step * np.arange(first, last, dtype=np.float64))

    def later(self, seconds: float) -> "Channel":
        """Return the channel with its times shifted by ``seconds``."""
        own = self.places
        places = None if own is None else (lambda first, last: own(first, last) + seconds)
        return replace(self, start=self.start + seconds, places=places, began=None)

    @property
    def duration(self) -> float:
        """Duration of the channel (last minus first abscissa); 0 for fewer than two samples."""
        if self.size < 2:
            return 0.0
        if self.places is None:
            return self.step * (self.size - 1)
        return float(self.places(self.size - 1, self.size)[0] - self.places(0, 1)[0])


@dataclass(frozen=True)
class Measurement:
    """Channels of one or more files.

    ``remarks`` are one-line descriptions of irregularities in the files and how they were treated.
    """

    channels: tuple[Channel, ...]
    remarks: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels, without repetition."""
        return tuple(channel.name for channel in self.channels)

    def __getitem__(self, name: str) -> Channel:
        """Return a channel by name (case-insensitive); raises ``InputError`` suggests the nearest."""
        by_name = {channel.name: channel for channel in self.channels}
        if name in by_name:
            return by_name[name]
        lower = {known.lower(): known for known in by_name}
        if name.lower() in lower:
            return by_name[lower[name.lower()]]
        where = " and ".join(dict.fromkeys(channel.source for channel in self.channels)) or "the measurement"
        raise InputError(f"channel '{name}' is not in {where}; {nearest(name, by_name)}")

    def chosen(self, names: Sequence[str]) -> "Measurement":
        """Return a measurement with only the named channels, in the order of the names."""
        return Measurement(tuple(self[name] for name in names), self.remarks)


def last_kept(load: Callable[[Key], Value]) -> Callable[[Key], Value]:
    """Return ``load`` with its last value kept, which is released before another one is loaded."""
    kept: dict[Key, Value] = {}

    def value(key: Key) -> Value:
        if key not in kept:
            kept.clear()
            kept[key] = load(key)
        return kept[key]

    return value


def of_array(values: Array) -> Reader:
    """Return a reader of an array in memory."""
    return lambda first, last: np.asarray(values[first:last], dtype=np.float64)


class Held:
    """Rows (n, width) of float64: in memory up to ``most`` values, beyond that in a temporary file."""

    def __init__(self, most: int) -> None:
        self.count, self.width, self._most = 0, 0, most
        self._parts = list[Array]()
        self._file: Any = None

    def add(self, block: Array) -> None:
        """Append rows (k, width)."""
        self.count, self.width = self.count + len(block), block.shape[1]
        self._parts.append(np.ascontiguousarray(block, dtype=np.float64))
        if self._file is None and self.count * self.width > self._most:
            self._file = tempfile.TemporaryFile(prefix="cranktrain-")  # noqa: SIM115 - the rows are read later
        if self._file is not None:
            for part in self._parts:
                self._file.write(part.tobytes())
            self._parts = []

    def read(self, first: int, last: int) -> Array:
        """Return the rows from index ``first`` to before ``last``."""
        if self._file is None:
            if len(self._parts) > 1:
                self._parts = [np.concatenate(self._parts)]
            return self._parts[0][first:last]
        row = self.width * np.dtype(np.float64).itemsize
        self._file.flush()
        self._file.seek(first * row)
        return np.frombuffer(self._file.read((last - first) * row)).reshape(-1, self.width)


def time_base(times: Array, where: str) -> tuple[float, float, Array | None, list[str]]:
    """Return start and step of n sampling times (s), all times if the steps differ (else None), and remarks.

    ``InputError`` for times that are not finite; :func:`timed` removes their samples first.
    """
    times = np.asarray(times, dtype=np.float64)
    if times.size < 2:
        return (float(times[0]) if times.size else 0.0), math.nan, times, []
    if bad := np.flatnonzero(~np.isfinite(times)).size:
        raise InputError(f"{where}: {bad} of {times.size} times are not numbers; export the time channel again")
    steps = np.diff(times)
    usual = float(np.median(steps))
    back = int(np.count_nonzero(steps < 0.0))
    if back:
        return float(times[0]), math.nan, times, [f"{where}: time runs backwards {back} times; samples were sorted"]
    if not steps.any():
        return float(times[0]), math.nan, times, [f"{where}: time stands still at {times[0]:.6g} s"]
    if usual > 0.0 and float(np.max(np.abs(steps - usual))) <= UNEVEN * usual:
        return float(times[0]), float((times[-1] - times[0]) / steps.size), None, []
    remarks = []
    gaps = np.flatnonzero(steps > 3.5 * usual) if usual > 0.0 else np.zeros(0, dtype=int)
    if 0 < gaps.size <= 0.01 * steps.size:
        k = int(gaps[np.argmax(steps[gaps])])
        remarks.append(f"{where}: {gaps.size} gaps in time, the longest {steps[k]:.4g} s at {times[k]:.6g} s")
    elif alike := int(np.count_nonzero(steps == 0.0)):
        remarks.append(f"{where}: {alike} times are that of the sample before")
    else:
        remarks.append(f"{where}: uneven steps of time, from {steps.min():.4g} to {steps.max():.4g} s")
    return float(times[0]), math.nan, times, remarks


def timed(times: Array, where: str) -> tuple[NDArray[np.int64] | None, list[str]]:
    """Return indices of samples (n,) with a finite time (None: all), and a remark; ``InputError`` if there is none."""
    good = np.flatnonzero(np.isfinite(times))
    if good.size == times.size:
        return None, []
    lost = times.size - good.size
    if not good.size:
        raise InputError(f"{where}: none of {times.size} times is a number; export the time channel again")
    return good, [f"{where}: {lost} of {times.size} times are not numbers; their samples are left out"]


def rising_base(times: Array, where: str) -> tuple[float, float, Reader | None, NDArray[np.int64] | None, list[str]]:
    """Return start and step of n sampling times (s), a reader of them if uneven, and remarks.

    The fourth value are indices of the samples with a finite time, by time; None for all in their order.
    """
    order, remarks = timed(times, where)
    start, step, own, told = time_base(times if order is None else times[order], where)
    if own is not None and own.size > 1 and np.any(np.diff(own) < 0.0):
        rising = np.argsort(own, kind="stable")
        order = rising if order is None else order[rising]
        own, start = own[rising], float(own[rising[0]])
    return start, step, None if own is None else of_array(own), order, remarks + told


def long_time_base(read: Reader, size: int) -> tuple[float, float] | None:
    """Return start and step of many sampling times, from both ends and some positions between; None if uneven."""
    begin, end = read(0, 2), read(size - 1, size)
    step = float(end[0] - begin[0]) / (size - 1)
    places = np.linspace(0, size - 2, PROBES).astype(int).tolist()
    off = max(abs(float(read(k, k + 1)[0]) - float(begin[0]) - k * step) for k in places)
    return (float(begin[0]), step) if step > 0.0 and off <= max(UNEVEN, 1e-9 * size) * step else None


def rising_times(read: Reader, size: int, where: str) -> list[str] | None:
    """Return remarks on many uneven sampling times, read block by block; None if times decrease.

    ``InputError`` for times that are not finite.
    """
    usual = float(np.median(np.diff(read(0, min(BLOCK, size)))))
    gaps, longest, at, bad, back = 0, 0.0, 0.0, 0, False
    for first in range(0, size, BLOCK):
        times = read(first, min(first + BLOCK + 1, size))
        bad += int(np.count_nonzero(~np.isfinite(times[:BLOCK])))
        steps = np.diff(times)
        if not steps.size:
            continue
        back = back or bool((steps < 0.0).any())
        gaps += int(np.count_nonzero(steps > 3.5 * usual))
        k = int(steps.argmax())
        if steps[k] > longest:
            longest, at = float(steps[k]), float(times[k])
    if bad:
        raise InputError(f"{where}: {bad} of {size} times are not numbers; export the time channel again")
    if back:
        return None
    if usual > 0.0 and 0 < gaps <= 0.01 * size:
        return [f"{where}: {gaps} gaps in time, the longest {longest:.4g} s at {at:.6g} s"]
    return []


def sampled(
    name: str, unit: str, times: Array, values: Array, source: str, about: str = "", began: int | None = None
) -> tuple[Channel, list[str]]:
    """Return a channel over time from arrays (n,), and remarks on its times."""
    where = f"{source}, channel {name}"
    n = min(times.size, values.size)
    times, values = np.asarray(times[:n], dtype=np.float64), np.asarray(values[:n])
    start, step, places, order, remarks = rising_base(times, where)
    values = values if order is None else values[order]
    return Channel(
        name, unit, values.size, source, of_array(values), start, step, places, about=about, began=began
    ), remarks


def decimated(channel: Channel, rate: float) -> tuple[float, float, Array]:
    """Return start, step and values of a channel, low-passed without delay and thinned to ``rate`` Hz or more."""
    from scipy.signal import firwin, upfirdn

    factor = max(1, math.floor(channel.rate / rate))
    if factor == 1:
        return channel.start, channel.step, channel.values()
    half = 16 * factor
    taps = firwin(2 * half + 1, 0.8 / factor, window=("kaiser", 8.0))
    block = 2**20 // factor * factor
    parts = []
    for first in range(0, channel.size, block):
        low, high = max(0, first - half), min(channel.size, first + block + half)
        values = channel.values(low, high)
        if not math.isfinite(values.sum()):
            values = np.where(np.isfinite(values), values, np.nanmean(values))
        values = np.pad(values, (half - (first - low), max(0, first + block + half - high)), mode="edge")
        kept = math.ceil(min(block, channel.size - first) / factor)
        # upfirdn's output k is centred on sample k·factor − half of its input.
        parts.append(upfirdn(taps, values[: (kept - 1) * factor + 2 * half + 1], down=1)[2 * half :: factor][:kept])
    return channel.start, channel.step * factor, np.concatenate(parts)


def integrated(values: Array, step: float, times: int) -> Array:
    """Integrate values minus their mean over time, ``times`` times, with fourth order in the step."""
    for _ in range(times):
        values = values - values.mean()
        slope = np.gradient(values)
        # ∫ over a step = h (f₀ + f₁)/2 − h (f₁' − f₀')/12: exact for cubics.
        parts = step * (0.5 * (values[1:] + values[:-1]) - (slope[1:] - slope[:-1]) / 12.0)
        values = np.concatenate(([0.0], np.cumsum(parts)))
    return values
