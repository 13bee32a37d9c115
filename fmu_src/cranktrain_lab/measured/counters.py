"""Times of pulses recorded by a counter, in s or in ticks of a stated clock, which may wrap around.

A counter of n bits restarts at 0 after 2ⁿ − 1 ticks, so its times decrease there. 2ⁿ ticks are added from there on,
with the smallest usual n for which the interval at each decrease is similar to its neighbours.
"""

import re

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain_lab.measured.channels import Channel

TIMES = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9}
"""Units of time with their length in seconds."""
_FREQUENCY = re.compile(r"([0-9][0-9.]*(?:[eE]\+?\d+)?)\s*([kMG]?)Hz", re.IGNORECASE)
_TICKS = re.compile(r"(?i)\b(?:ticks?|counts?|clocks?|clk|counter|takte?|zähler|timer)\b")
_PREFIX = {"": 1.0, "k": 1e3, "m": 1e6, "g": 1e9}
BITS = (16, 24, 32, 40, 48, 64)
"""Usual numbers of bits of counters."""
PROBE, MOST_FALLS = 4096, 0.4
"""Number of samples to test for times of pulses, and largest fraction of samples at which a counter restarts."""
LIKE = 30.0
"""Largest ratio of the interval across a counter's restart to the median interval, with wheel gaps and speeds."""


def clock_of(text: str) -> float | None:
    """Return the clock frequency, Hz, from a text such as ``ticks of 80 MHz``; None if the text is not of this form."""
    match = _FREQUENCY.search(text)
    if match is None or not (_TICKS.search(text) or re.fullmatch(r"\s*1\s*/\s*.*", text)):
        return None
    return float(match[1].rstrip(".")) * _PREFIX[match[2].lower()] or None


def second_of(unit: str, clock: float | None = None) -> float | None:
    """Return the length in s of a unit of time or a tick, else None; ``clock`` (Hz) applies to ticks without clock."""
    if (known := TIMES.get(unit.strip().lower())) is not None:
        return known
    if (stated := clock_of(unit)) is not None:
        return 1.0 / stated
    return None if clock is None else 1.0 / clock


def counted_times(channel: Channel, clock: float | None = None) -> tuple[Array, tuple[str, ...]] | None:
    """Return k times of pulses (s) if a channel's samples are counted times, and remarks; None if they are a signal.

    ``InputError`` for times that decrease differently from a counter's restart, or that do not increase in spite of a
    stated ``clock``, Hz.
    """
    second = second_of(channel.unit, clock)
    if second is None or channel.size < 2:
        return None
    probe = channel.values(0, min(channel.size, PROBE))
    probe = probe[np.isfinite(probe)]
    rising = probe.size > 1 and float(np.mean(np.diff(probe) <= 0.0)) <= MOST_FALLS
    if not rising:
        if clock is None or channel.unit.strip().lower() in TIMES:
            return None
        raise InputError(f"{channel.where}: does not rise, so it holds no ticks of a counter; leave out --clock-hz")
    values = channel.values()
    values = values[np.isfinite(values)]
    remarks = [f"{channel.where}: taken as times of pulses, {values.size} of them"]
    falls = np.flatnonzero(np.diff(values) < 0.0)
    if falls.size:
        ticks = 1.0 if channel.unit.strip().lower() not in TIMES else (second * clock if clock else 0.0)
        bits = _bits(values, falls, ticks)
        if bits is None:
            raise InputError(
                f"{channel.where}: times of pulses fall {falls.size} times, first from {values[falls[0]]:.9g} to "
                f"{values[falls[0] + 1]:.9g} {channel.unit}"
                + ("; if a counter begins again there, state its clock, --clock-hz HZ" if not ticks else
                   "; no counter of 16 to 64 bits begins again so; take a stretch without that")
            )  # fmt: skip
        turns = np.zeros(values.size)
        turns[falls + 1] = 1.0
        values = values + np.cumsum(turns) * (2.0**bits / ticks)
        remarks.append(f"{channel.where}: the counter of {bits} bits begins again {falls.size} times; its times go on")
    if not np.all(np.diff(values) > 0.0):
        alike = int(np.count_nonzero(np.diff(values) == 0.0))
        remarks.append(f"{channel.where}: {alike} times are that of the pulse before and are left out")
        values = values[np.concatenate(([True], np.diff(values) > 0.0))]
    return np.asarray(values * second, dtype=np.float64), tuple(remarks)


def _bits(values: Array, falls: NDArray[np.intp], ticks: float) -> int | None:
    """Return the bits of the counter that restarts at ``falls`` (f,) of values (k,) of ``ticks`` ticks, or None."""
    steps = np.diff(values)
    usual = float(np.median(steps[steps > 0.0])) * ticks if ticks else 0.0
    for bits in BITS:
        if not usual or 2.0**bits <= ticks * float(values.max()):
            continue
        across = steps[falls] * ticks + 2.0**bits
        if np.all((across > usual / LIKE) & (across < LIKE * usual)):
            return bits
    return None


def ticks_hint(channel: Channel) -> str:
    """Return a hint for messages if the channel has increasing whole numbers (possibly ticks), else an empty text."""
    probe = channel.values(0, min(channel.size, PROBE))
    if probe.size > 2 and np.array_equal(probe, np.rint(probe)) and np.all(np.diff(probe) > 0.0):
        return "; its whole numbers rise, and if they are ticks of a counter, state its clock, --clock-hz HZ"
    return ""
