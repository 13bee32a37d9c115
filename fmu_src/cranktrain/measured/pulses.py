"""Times of pulses of a sampled signal: crossings of a level with hysteresis, to fractions of a sample.

A rising crossing counts when the signal has been below ``level − h`` since the last one and rises above ``level + h``;
its time is that of the last passage of the level before. Between samples a straight line, or the cubic through four
samples, is taken. Samples are read in blocks, so a channel of any length takes bounded memory.

Level and hysteresis follow the signal where they are not given: they are taken from the range between its 2nd and 98th
percentile in each ``STRETCH`` samples, because the amplitude of inductive pick-ups changes with the speed. A stretch
whose range is below ``FAINT`` of the largest is at rest.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import kernel
from cranktrain.core.types import Array
from cranktrain.measured.channels import TIME, Channel

HYSTERESIS = 0.1
"""Half width of the hysteresis, as a fraction of the range of the signal."""
FAINT = 0.02
"""Range of a block, as a fraction of the largest, below which nothing turns."""
STRETCH, PROBES = 2**16, 64
"""Samples of a stretch of one level; stretches whose range is looked at before the others."""
FEWEST_SAMPLES = 3.0
"""Samples a pulse below which it is undersampled."""
TIMES = ("s", "ms", "us", "µs", "ns")
_ARMED, _LAST, _BEFORE, _BEFORE2, _PENDING = range(5)


class Pulses(NamedTuple):
    """Times (k,) s of the rising (or falling) crossings, level and hysteresis used, in the channel's unit; remarks."""

    times: Array
    level: float
    hysteresis: float
    remarks: tuple[str, ...] = ()


def pulse_times(
    channel: Channel,
    level: float | None = None,
    hysteresis: float | None = None,
    edge: str = "rising",
    cubic: bool = True,
) -> Pulses:
    """Times of a channel's pulses; the samples of a channel of rising times (a counter's) are these times themselves.

    Raises ``InputError``: a channel that is not over time, no pulse, fewer than three samples a pulse.

    Parameters
    ----------
    level, hysteresis : in the channel's unit; found from the signal where not given
    edge : ``rising`` or ``falling``
    cubic : whether the cubic through four samples is taken, not a straight line; lines fit square pulses better
    """
    where = f"{channel.source}, channel {channel.name}"
    if edge not in ("rising", "falling"):
        raise InputError(f"edge '{edge}' does not exist; valid: rising, falling")
    if (held := _counted(channel)) is not None:
        return Pulses(held, math.nan, math.nan, (f"{where}: taken as times of pulses, {held.size} of them",))
    if channel.abscissa != TIME:
        raise InputError(f"{where}: is over {channel.abscissa}, not over time; pulses need a channel over time")
    sign = 1.0 if edge == "rising" else -1.0
    parts, used, remarks = _crossings(channel, level, hysteresis, sign, cubic)
    places = np.concatenate(parts) if parts else np.zeros(0)
    if not math.isfinite(used[1]):
        some = channel.values(0, min(channel.size, 2**16))
        raise InputError(
            f"{where}: does not vary, 0 pulses in {channel.size} samples at {float(np.nanmean(some)):.4g} "
            f"{channel.unit}; "
            "the shaft stands still, or it is another channel"
        )
    if places.size < 2:
        raise InputError(
            f"{where}: {places.size} pulses cross {used[0]:.4g} {channel.unit} with a hysteresis of {used[1]:.3g}; "
            "give another level or channel"
        )
    spacing = float(np.median(np.diff(places)))
    if spacing < FEWEST_SAMPLES:
        raise InputError(
            f"{where}: {spacing:.2g} samples a pulse, below the {FEWEST_SAMPLES:g} that are needed to see each "
            "(aliasing); sample faster or take fewer pulses a revolution"
        )
    return Pulses(_times(channel, places), *used, tuple(remarks))


def _counted(channel: Channel) -> Array | None:
    """Times of pulses that a channel holds itself: rising numbers in a unit of time."""
    if channel.unit.strip().lower() not in TIMES or channel.size < 2:
        return None
    probe = channel.values(0, min(channel.size, 4096))
    if not np.all(np.diff(probe) > 0.0):
        return None
    from cranktrain.core.units import to_si

    return np.asarray(to_si(channel.values(), channel.unit), dtype=np.float64)


def _crossings(
    channel: Channel, level: float | None, hysteresis: float | None, sign: float, cubic: bool
) -> tuple[list[Array], tuple[float, float], list[str]]:
    """Places of crossings in samples, the level and hysteresis that were used last, and remarks."""
    memory = np.array([-1.0, math.nan, math.nan, math.nan, math.nan])
    out = np.empty(STRETCH // 2 + 2)
    parts: list[Array] = []
    largest, used, missing = _largest_range(channel), (math.nan, math.nan), 0
    for first, values in channel.blocks():
        if not math.isfinite(values.sum()):
            missing += int(values.size - np.count_nonzero(np.isfinite(values)))
        for begin in range(0, values.size, STRETCH):
            part = values[begin : begin + STRETCH]
            low, high = _range(part)
            if not math.isfinite(high - low):
                continue
            largest = max(largest, high - low)
            own_level = _level(low, high) if level is None else level
            width = HYSTERESIS * max(high - low, FAINT * largest) if hysteresis is None else hysteresis
            if width <= 0.0:
                continue
            used = own_level, width
            signed = np.ascontiguousarray(sign * part)
            count = int(find_crossings(signed, float(first + begin), sign * own_level, width, int(cubic), memory, out))
            parts.append(out[:count].copy())
    remarks = []
    if missing:
        remarks.append(f"{channel.source}, channel {channel.name}: {missing} of {channel.size} samples are not numbers")
    return parts, used, remarks


def _largest_range(channel: Channel) -> float:
    """Largest range of some stretches over the whole channel: what is far below it is noise at rest."""
    if channel.size <= STRETCH * 2:
        return 0.0
    short = min(STRETCH // 8, channel.size // PROBES)
    places = np.linspace(0, channel.size - short, PROBES).astype(int).tolist()
    ranges = [high - low for low, high in (_range(channel.values(place, place + short)) for place in places)]
    return float(np.nanmax(ranges)) if np.isfinite(ranges).any() else 0.0


def _range(values: Array) -> tuple[float, float]:
    """2nd and 98th percentile of some 20 000 samples of a block."""
    some = values[:: max(1, values.size // 4099)]
    some = some[np.isfinite(some)]
    if some.size < 2:
        return math.nan, math.nan
    low, high = np.percentile(some, (2.0, 98.0))
    if high - low < FAINT * (some.max() - some.min()):  # narrow pulses between long rests
        low, high = float(some.min()), float(some.max())
    return float(low), float(high)


def _level(low: float, high: float) -> float:
    """Zero for a signal about zero, as of inductive pick-ups, else the middle."""
    about_zero = low < 0.0 < high and 1.0 / 3.0 < -low / high < 3.0
    return 0.0 if about_zero else 0.5 * (low + high)


def _times(channel: Channel, places: Array) -> Array:
    """Times at fractions of samples."""
    if channel.places is None:
        return np.asarray(channel.start + channel.step * places)
    times = channel.abscissae()
    return np.asarray(np.interp(places, np.arange(times.size, dtype=np.float64), times))


@kernel
def find_crossings(values, first, level, width, cubic, memory, out):
    """Places of rising crossings, in samples from the channel's beginning, into ``out``; their number.

    ``memory`` (5,) goes from block to block: whether the signal was below the hysteresis (1.0), the last three samples,
    and the place of the last passage of the level since then.
    """
    n = values.shape[0]
    armed = memory[_ARMED]
    y0 = memory[_LAST]
    y1 = memory[_BEFORE]
    y2 = memory[_BEFORE2]
    place = memory[_PENDING]
    count = 0
    for i in range(n):
        y = values[i]
        if armed > 0.0:
            if y >= level and y0 < level:
                after = values[i + 1] if i + 1 < n else 2.0 * y - y0
                place = first + i - 1.0 + _fraction(y1, y0, y, after, level, cubic)
            if y >= level + width and place == place:
                out[count] = place
                count += 1
                armed = -1.0
        elif y <= level - width:
            armed = 1.0
            place = math.nan
        y2 = y1
        y1 = y0
        y0 = y
    memory[_ARMED] = armed
    memory[_LAST] = y0
    memory[_BEFORE] = y1
    memory[_BEFORE2] = y2
    memory[_PENDING] = place
    return count


@kernel
def _fraction(a, b, c, d, level, cubic):
    """Where between two samples b and c, their neighbours a and d, the level is crossed: 0 to 1."""
    s = (level - b) / (c - b)
    if cubic == 0 or a != a or d != d:
        return s
    # Cubic of Lagrange through −1, 0, 1, 2; three steps of Newton from the straight line.
    c1 = c - b / 2.0 - a / 3.0 - d / 6.0
    c2 = 0.5 * (a + c) - b
    c3 = (d - a) / 6.0 + 0.5 * (b - c)
    x = s
    for _ in range(3):
        slope = c1 + x * (2.0 * c2 + 3.0 * c3 * x)
        if slope <= 0.0:
            return s
        x -= (b - level + x * (c1 + x * (c2 + c3 * x))) / slope
    if x < 0.0 or x > 1.0:
        return s
    return x
