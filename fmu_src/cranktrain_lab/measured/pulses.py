"""Times of pulses of a sampled signal, as level crossings with hysteresis, to fractions of a sample.

A rising crossing counts when the signal has been below ``level − h`` since the last crossing and rises above
``level + h``. Its time is the last passage of the level before, interpolated by a straight line or by the cubic through
four samples. If a flank has many samples, a cubic is fitted to all its samples by least squares, which averages noise:
with n samples the error of a crossing falls to 1.5/√n of the error of one sample (Savitzky and Golay, Anal. Chem. 36
(1964) 1627). Samples are read in blocks, so a channel of any length takes bounded memory.

If not given, level and hysteresis follow from the range between the 2nd and 98th percentile of the signal in each
stretch of ``STRETCH`` samples, because the amplitude of inductive pick-ups changes with the speed. In a stretch whose
range is below ``FAINT`` of the largest, the shaft is at rest.
"""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import kernel
from cranktrain.core.types import Array
from cranktrain_lab.measured.channels import TIME, Channel
from cranktrain_lab.measured.counters import counted_times, ticks_hint

HYSTERESIS = 0.1
"""Half width of the hysteresis of level crossings, as a fraction of the signal's range."""
FAINT = 0.02
"""Range of a stretch of the signal, relative to the largest range, below which the shaft counts as at rest."""
STRETCH, PROBES = 2**16, 64
"""Number of samples of a stretch with one crossing level, and number of stretches whose range is evaluated first."""
FEWEST_SAMPLES, STRETCH_OF_PULSES = 4.0, 64
"""Samples per pulse below which pulses are undersampled, and number of pulses over which samples are counted."""
INTERPOLATED, BY_SAMPLES = 0.0035, 4.8
"""Error of crossings of a sine at four samples per pulse, as a fraction of a pitch (rms), and exponent of its decrease
with their number. Measured with the cubic through four samples: 1.1 % at 3.2, 0.35 % at 4.1, 0.1 % at 5.3, 0.012 % at
8.3, 0.004 % at 10.3 samples.
"""
GOOD, PART = 8.0, 1_000_000
"""Samples per pulse below which a remark gives the timing error, and number of samples to test for two levels."""
BETWEEN = 0.05
"""Fraction of samples in the middle half of the range below which a signal has two levels. For a sine the fraction is
a third, for a square wave only the samples of its flanks count.
"""
FLANK, OF_PITCH, LONGEST = 0.65, 0.12, 48
"""Limits of a flank's samples: distance from the level as a fraction of half the range, distance from the crossing as a
fraction of the distance to the next pulse, and largest number on either side.
"""
FEWEST_OF_FLANK = 3
"""Least number of samples on either side for a fit of the flank."""
EDGES = ("rising", "falling")
_ARMED, _LAST, _BEFORE, _BEFORE2, _PENDING = range(5)


class Pulses(NamedTuple):
    """Times (s) of a channel's k pulses, with level and hysteresis in the channel's unit, and remarks.

    ``spacing`` has the median and the least number of samples per pulse; ``two_levels`` is True for square pulses.
    """

    times: Array
    level: float
    hysteresis: float
    remarks: tuple[str, ...] = ()
    spacing: tuple[float, float] = (math.inf, math.inf)
    two_levels: bool = False


def pulse_times(
    channel: Channel,
    level: float | None = None,
    hysteresis: float | None = None,
    edge: str = "rising",
    cubic: bool = True,
    clock: float | None = None,
) -> Pulses:
    """Return the times of a channel's pulses; the samples of a counter's channel are these times themselves.

    Raises ``InputError`` for a channel that is not over time, without pulses, or with too few samples per pulse.

    Parameters
    ----------
    level, hysteresis : in the channel's unit; by default from the signal
    edge : ``rising`` or ``falling``
    cubic : True to interpolate by a cubic through four samples, False by a straight line, better for square pulses
    clock : frequency of the counter whose ticks the samples are, Hz
    """
    if edge not in EDGES:
        raise InputError(f"edge '{edge}' does not exist; valid: {', '.join(EDGES)}")
    if (held := counted_times(channel, clock)) is not None:
        return Pulses(held[0], math.nan, math.nan, held[1])
    if channel.abscissa != TIME:
        raise InputError(
            f"{channel.where}: is over {channel.abscissa}, not over time; pulses need a channel over time"
            f"{ticks_hint(channel)}"
        )
    sign = 1.0 if edge == "rising" else -1.0
    parts, used, remarks = _crossings(channel, level, hysteresis, sign, cubic)
    places = np.concatenate(parts) if parts else np.zeros(0)
    if not math.isfinite(used[1]):
        some = channel.values(0, min(channel.size, 2**16))
        raise InputError(
            f"{channel.where}: does not vary, 0 pulses in {channel.size} samples at {float(np.nanmean(some)):.4g} "
            f"{channel.unit}; the shaft stands still, or it is another channel"
        )
    if places.size < 2:
        raise InputError(
            f"{channel.where}: {places.size} pulses cross {used[0]:.4g} {channel.unit} with a hysteresis of "
            f"{used[1]:.3g}; give another level or channel{ticks_hint(channel)}"
        )
    if channel.places is None:
        times = channel.start + channel.step * places
    else:
        times = np.interp(places, np.arange(channel.size, dtype=np.float64), channel.abscissae())
    spacing, square = _spacing(places, times, channel.where), _has_two_levels(channel)
    error = timing_error(spacing[1], square)
    if spacing[1] < GOOD or square:
        remarks.append(
            f"{channel.where}: {spacing[1]:.3g} samples a pulse at the least"
            f"{', of two levels' if square else ''}; a crossing is off by {100.0 * error:.2g} % of a pitch (rms)"
        )
    return Pulses(times, *used, tuple(remarks), spacing, square)


def timing_error(samples: float, two_levels: bool = False) -> float:
    """Return the error (rms) of a crossing by sampling alone, as a fraction of a pitch, for ``samples`` per pulse.

    A step between two levels may lie anywhere between two samples, so its error is 1/√12 of a sample.
    """
    if two_levels:
        return 1.0 / (math.sqrt(12.0) * samples)
    return INTERPOLATED * (4.1 / samples) ** BY_SAMPLES


def _spacing(places: Array, times: Array, where: str) -> tuple[float, float]:
    """Return median and least number of samples per pulse; raises ``InputError`` if they are too few (aliasing)."""
    reach = min(STRETCH_OF_PULSES, places.size - 1)
    means = (places[reach:] - places[:-reach]) / reach
    k = int(np.argmin(means))
    least, median = float(means[k]), float(np.median(np.diff(places)))
    if min(least, median) < FEWEST_SAMPLES:
        raise InputError(
            f"{where}: {min(least, median):.2g} samples a pulse from {times[k]:.4g} to {times[k + reach]:.4g} s, below "
            f"the {FEWEST_SAMPLES:g} that are needed to time each (aliasing); sample faster or take fewer pulses a "
            "revolution"
        )
    return median, least


def _has_two_levels(channel: Channel) -> bool:
    """True if hardly any sample lies between two levels, as for square pulses with short flanks."""
    some = channel.values(0, min(channel.size, PART))
    low, high = _range(some)
    middle, half = 0.5 * (low + high), 0.25 * (high - low)
    return bool(half > 0.0 and np.mean(np.abs(some - middle) < half) < BETWEEN)


def _crossings(
    channel: Channel, level: float | None, hysteresis: float | None, sign: float, cubic: bool
) -> tuple[list[Array], tuple[float, float], list[str]]:
    """Return positions of level crossings (fractional sample numbers), last level and hysteresis, and remarks."""
    memory = np.array([-1.0, math.nan, math.nan, math.nan, math.nan])
    out = np.empty(STRETCH // 2 + 2)
    parts: list[Array] = []
    tail, pending = np.zeros(0), np.zeros((3, 0))
    largest, used, missing = _largest_range(channel), (math.nan, math.nan), 0
    for first, values in channel.blocks():
        if not math.isfinite(values.sum()):
            missing += int(values.size - np.count_nonzero(np.isfinite(values)))
        found = [pending]
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
            ends = np.full((2, count), [[own_level], [0.5 * FLANK * (high - low)]])
            found.append(np.vstack((out[:count], ends)))
        # The last crossings of a block are refined with the next block, because their flanks may extend into it.
        rows = np.hstack(found)
        last = first + values.size >= channel.size
        ready = rows.shape[1] if last else int(np.searchsorted(rows[0], first + values.size - LONGEST - 2))
        if cubic:
            joined = np.concatenate((tail, values))
            refine_crossings(joined, float(first - tail.size), sign, rows, ready)
            tail = joined[-4 * LONGEST :]
        parts.append(rows[0, :ready].copy())
        pending = rows[:, ready:]
    remarks = []
    if missing:
        remarks.append(f"{channel.where}: {missing} of {channel.size} samples are not numbers")
    return parts, used, remarks


def _largest_range(channel: Channel) -> float:
    """Return the largest range of some stretches over the whole channel; a much smaller range is noise at rest."""
    if channel.size <= STRETCH * 2:
        return 0.0
    short = min(STRETCH // 8, channel.size // PROBES)
    places = np.linspace(0, channel.size - short, PROBES).astype(int).tolist()
    ranges = [high - low for low, high in (_range(channel.values(place, place + short)) for place in places)]
    return float(np.nanmax(ranges)) if np.isfinite(ranges).any() else 0.0


def _range(values: Array) -> tuple[float, float]:
    """Return the 2nd and 98th percentile of some thousand samples of a block."""
    some = values[:: max(1, values.size // 4099)]
    some = some[np.isfinite(some)]
    if some.size < 2:
        return math.nan, math.nan
    low, high = np.percentile(some, (2.0, 98.0))
    if high - low < FAINT * (some.max() - some.min()):  # narrow pulses with long pauses lie outside the percentiles
        low, high = float(some.min()), float(some.max())
    return float(low), float(high)


def _level(low: float, high: float) -> float:
    """Return zero for a signal about zero, as from inductive pick-ups, else the middle of the range."""
    about_zero = low < 0.0 < high and 1.0 / 3.0 < -low / high < 3.0
    return 0.0 if about_zero else 0.5 * (low + high)


@kernel
def find_crossings(values, first, level, width, cubic, memory, out):
    """Write positions of rising crossings, in samples from the channel's begin, to ``out``. Return their number.

    ``memory`` (5,) is passed from block to block: 1.0 if the signal was below the hysteresis, the last three samples,
    and the position of the last passage of the level since then.
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
    """Return the fraction (0 to 1) between samples b and c, with neighbours a and d, at which the level is crossed."""
    s = (level - b) / (c - b)
    if cubic == 0 or a != a or d != d:
        return s
    # Lagrange cubic through −1, 0, 1, 2, and three Newton steps from the straight line.
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


@kernel
def refine_crossings(values, first, sign, rows, count):
    """Refine the positions ``rows[0]`` of ``count`` crossings by a cubic fitted to each flank.

    ``values`` (n,) are the samples from sample ``first`` on; ``rows`` (3, k) have positions, levels and the largest
    distance of a flank's sample from the level. The position of a flank with few samples, or of one that is not smooth,
    is not changed.
    """
    n = values.shape[0]
    total = rows.shape[1]
    before = math.nan
    for k in range(count):
        place = rows[0, k]
        pitch = math.inf
        if k > 0:
            pitch = place - before
        if k + 1 < total:
            pitch = min(pitch, rows[0, k + 1] - place)
        before = place
        middle = math.floor(place - first + 0.5)
        reach = int(min(OF_PITCH * pitch, LONGEST)) if pitch < math.inf else LONGEST
        reach = min(reach, middle, n - 1 - middle)
        level = rows[1, k]
        limit = rows[2, k]
        m = 0
        while m < reach:
            below = sign * (values[middle - m - 1] - level)
            above = sign * (values[middle + m + 1] - level)
            # Near the crossing level noise may have either sign. Farther out all samples of a flank have one sign.
            if not (-limit < below < 0.2 * limit and -0.2 * limit < above < limit):
                break
            m += 1
        if m < FEWEST_OF_FLANK:
            continue
        x = _fitted_crossing(values, middle, m, level)
        if -1.5 < x - (place - first - middle) < 1.5:
            rows[0, k] = first + middle + x


@kernel
def _fitted_crossing(values, middle, m, level):
    """Return where the cubic fitted to 2 m + 1 samples about ``middle`` crosses the level, in samples from it, or NaN.

    Sums of even powers of −m to m separate the even and the odd coefficients.
    """
    s2 = m * (m + 1.0) * (2.0 * m + 1.0) / 3.0
    s4 = s2 * (3.0 * m * m + 3.0 * m - 1.0) / 5.0
    s6 = s2 * (3.0 * m**4 + 6.0 * m**3 - 3.0 * m + 1.0) / 7.0
    y0 = values[middle] - level
    y1 = 0.0
    y2 = 0.0
    y3 = 0.0
    for j in range(1, m + 1):
        up = values[middle + j] - level
        down = values[middle - j] - level
        y0 += up + down
        y1 += j * (up - down)
        y2 += j * j * (up + down)
        y3 += j * j * j * (up - down)
    even = (2.0 * m + 1.0) * s4 - s2 * s2
    odd = s2 * s6 - s4 * s4
    a0 = (y0 * s4 - y2 * s2) / even
    a2 = ((2.0 * m + 1.0) * y2 - s2 * y0) / even
    a1 = (y1 * s6 - y3 * s4) / odd
    a3 = (s2 * y3 - s4 * y1) / odd
    if a1 == 0.0:
        return math.nan
    x = -a0 / a1
    for _ in range(4):
        slope = a1 + x * (2.0 * a2 + 3.0 * a3 * x)
        if slope * a1 <= 0.0:
            return math.nan
        x -= (a0 + x * (a1 + x * (a2 + a3 * x))) / slope
    return x
