"""Numbering of a wheel's teeth from the times of its pulses, with gaps, lost and double pulses, and pitch errors.

The ratio of an interval between two pulses to the local median interval is 1 between teeth and 2, 3, … across missing
pulses. Two intervals that add up to 1 contain a double pulse. Missing pulses that recur once per revolution are the gap
of a wheel such as 60−2; others count as lost. Each pulse gets the number of its tooth, so lost pulses cause no error.

Pitch errors are deviations that recur each revolution. A single wheel cannot distinguish them from torsional vibration
of whole orders with constant amplitude and phase. They are therefore learned only on request, from a stretch without
torsion (coasting, another recording) or from a whole recording.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array

REACH = 9
"""Number of pulse intervals in the local median; fewer for wheels with few teeth."""
DOUBLE = 0.55
"""Ratio to the local median below which a pulse interval is part of a double pulse."""
CYCLE = 4.0 * math.pi
MOST_MISSING = 6
"""Number of consecutive missing pulses above which the shaft counts as at rest."""
GRID = 8
"""Number of values of the mean rotation per cycle."""
SPLINED = 4.0
"""Least number of cycles for which the mean rotation is a spline. For fewer cycles it is a parabola."""
STIFF = 1e-7
"""Weight of sixth differences of the mean rotation's coefficients relative to its values."""
FEWEST_REVOLUTIONS = 8
"""Least number of revolutions to learn pitch errors."""
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Wheel:
    """Toothed wheel with ``teeth`` per revolution, including missing teeth, and ``missing`` teeth in a gap (60−2).

    Several equal ``gaps`` are equally spaced.
    """

    teeth: int
    missing: int = 0
    gaps: int = 1

    def __post_init__(self) -> None:
        fits = self.gaps >= 1 and self.teeth % max(1, self.gaps) == 0
        if self.teeth < 1 or not fits or not 0 <= self.missing < max(1, self.teeth // self.gaps // 2):
            raise InputError(
                f"a wheel of {self.teeth} teeth of which {self.missing} are missing does not exist; "
                "give teeth as if none were missing, e.g. 60 with 2 missing"
            )

    @property
    def pulses(self) -> int:
        """Number of pulses of the wheel per revolution."""
        return self.teeth - self.gaps * self.missing

    @property
    def sector(self) -> "Wheel":
        """Sector from one gap to the next as a separate wheel; the wheel itself if it has one gap."""
        return Wheel(self.teeth // self.gaps, self.missing)

    @property
    def name(self) -> str:
        """Name of the wheel in usual notation of teeth and missing teeth: 60-2, 60-2-2-2."""
        return f"{self.teeth}" + f"-{self.missing}" * self.gaps


@dataclass(frozen=True)
class Numbered:
    """Pulses of a toothed wheel with their tooth numbers.

    Attributes
    ----------
    times : (k,) s, double pulses removed
    teeth : (k,) increasing tooth number of each pulse from the first revolution's tooth 0; tooth 0 follows the gap, or
        one of several
    lost, doubled : number of missing pulses outside gaps, and of removed double pulses
    slips : revolutions with a displaced gap, with the number of excess (+) or missing (−) pulses
    stops : time intervals of standstill; numbering continues after them
    """

    times: Array
    teeth: Indices
    lost: int
    doubled: int
    slips: tuple[tuple[int, int], ...]
    stops: tuple[tuple[float, float], ...]


def number_teeth(times: Array, wheel: Wheel, where: str) -> Numbered:
    """Number the pulses of a wheel; raises ``InputError`` for fewer than two revolutions or a gap that does not recur.

    Parameters
    ----------
    times : (k,) rising times of pulses, s
    """
    if times.size < 2 * wheel.pulses:
        raise InputError(
            f"{where}: {times.size} pulses are {times.size / wheel.pulses:.2g} revolutions of {wheel.pulses} pulses; "
            "at least 2 are needed"
        )
    times, doubled = _without_doubles(times, wheel)
    intervals = np.diff(times)
    local = _local(intervals, wheel)
    steps = np.maximum(1, np.rint(intervals / local)).astype(np.int64)
    long = steps > MOST_MISSING + wheel.missing
    stops = tuple((float(times[k]), float(times[k + 1])) for k in np.flatnonzero(long)) if wheel.pulses > 2 else ()
    teeth = np.concatenate(([0], np.cumsum(steps)))
    lost = int(np.sum((steps - 1)[~long]))
    slips: tuple[tuple[int, int], ...] = ()
    if wheel.missing:
        teeth, slips = _from_the_gap(teeth, steps, wheel.sector, where)
        lost = _absent(teeth, wheel.sector)
    return Numbered(times, teeth, lost, doubled, slips, stops)


def _local(intervals: Array, wheel: Wheel) -> Array:
    """Return the local median interval at each interval; over whole revolutions for wheels with few teeth."""
    from scipy.ndimage import median_filter

    reach = REACH if wheel.teeth >= 3 * REACH else max(3, 2 * (wheel.pulses // 2) + 1)
    return np.asarray(median_filter(intervals, size=reach, mode="nearest"))


def _without_doubles(times: Array, wheel: Wheel) -> tuple[Array, int]:
    """Remove double pulses: of two pulses that are too close, remove the pulse that fits the neighbours worse."""
    removed = 0
    for _ in range(3):
        intervals = np.diff(times)
        local = _local(intervals, wheel)
        short = intervals < DOUBLE * local
        if wheel.pulses < 4 or not short.any():
            break
        drop = []
        taken = -2
        for k in np.flatnonzero(short):
            if k <= taken:
                continue
            # Removing pulse k lengthens the interval before it; removing k + 1 the interval after it.
            before = abs(times[k + 1] - times[k - 1] - local[k]) if k > 0 else math.inf
            after = abs(times[k + 2] - times[k] - local[k]) if k + 2 < times.size else math.inf
            if min(before, after) > 0.45 * local[k]:
                continue
            if k > 0 and k + 2 < times.size:
                # The pulse nearer to the middle of its neighbours is kept.
                expected = 0.5 * (times[k - 1] + times[k + 2])
                drop.append(int(k if abs(times[k] - expected) > abs(times[k + 1] - expected) else k + 1))
            else:
                drop.append(int(k if before < after else k + 1))
            taken = int(k) + 1
        if not drop:
            break
        times = np.delete(times, drop)
        removed += len(drop)
    return times, removed


def _from_the_gap(
    teeth: Indices, steps: Indices, wheel: Wheel, where: str
) -> tuple[Indices, tuple[tuple[int, int], ...]]:
    """Return tooth numbers counted from the gap and corrected at each gap, and the revolutions that do not fit."""
    candidates = np.flatnonzero(steps == wheel.missing + 1) + 1  # index of the first pulse after a gap
    if not candidates.size:
        raise InputError(
            f"{where}: no gap of {wheel.missing} missing teeth among {teeth.size} pulses; check teeth and missing"
        )
    phase = teeth[candidates] % wheel.teeth
    # The gap is at the most frequent tooth of the candidates. Lost pulses cause other candidates; a slip moves the gap.
    found: list[int] = []
    slips: list[tuple[int, int]] = []
    shift = 0
    result = teeth.copy()
    common = int(np.bincount(phase, minlength=wheel.teeth).argmax())
    if np.count_nonzero(phase == common) < 0.3 * (teeth[-1] // wheel.teeth):
        places = np.diff(teeth[candidates])
        usual = int(np.median(places)) if places.size else 0
        raise InputError(
            f"{where}: gaps of {wheel.missing} teeth are {usual} teeth apart, not {wheel.teeth}; check the "
            f"count of teeth"
        )
    anchor = None
    for c in candidates:
        if anchor is None:
            if int(teeth[c] % wheel.teeth) == common:
                anchor = int(teeth[c])
                found.append(int(c))
            continue
        apart = int(teeth[c]) + shift - anchor
        off = (apart + wheel.teeth // 2) % wheel.teeth - wheel.teeth // 2
        if off == 0:
            found.append(int(c))
        elif abs(off) <= 3 and _recurs(teeth, candidates, int(c), wheel):
            slips.append((apart // wheel.teeth, off))
            shift -= off
            result[c:] -= off
            found.append(int(c))
    first = int(result[found[0]]) % wheel.teeth
    return result - first, tuple(slips)


def _absent(teeth: Indices, wheel: Wheel) -> int:
    """Return the number of lost pulses between the first and the last pulse, without standstills."""
    inside = np.concatenate(([False], np.diff(teeth) <= MOST_MISSING + wheel.missing))
    numbers = np.arange(int(teeth[0]), int(teeth[-1]) + 1)
    due = numbers % wheel.teeth < wheel.pulses
    upto = np.cumsum(due)[teeth - teeth[0]]
    return int(np.sum((np.diff(upto) - 1)[inside[1:]].clip(min=0)))


def _recurs(teeth: Indices, candidates: Indices, at: int, wheel: Wheel) -> bool:
    """True if a gap follows the gap at pulse ``at`` after one revolution, or if no gap follows at all."""
    behind = teeth[candidates[candidates > at]] - teeth[at]
    return bool(behind.size == 0 or np.any(behind[:4] == wheel.teeth))


def learn_errors(numbered: Numbered, wheel: Wheel, window: tuple[float, float] | None, where: str) -> Array:
    """Learn the pitch error of each tooth, (teeth,) rad, with zero mean. Errors of missing teeth are zero.

    Each revolution gives every tooth's deviation from the mean rotation over a cycle around it; the error is the mean
    over all revolutions. Raises ``InputError`` for too few revolutions.

    Parameters
    ----------
    window : begin and end of the stretch to learn from, s; None for the whole recording
    """
    inside = slice(None)
    if window is not None:
        inside = slice(*np.searchsorted(numbered.times, window).tolist())
    times, teeth = numbered.times[inside], numbered.teeth[inside]
    revolutions = int(teeth[-1] - teeth[0]) // wheel.teeth if teeth.size else 0
    if revolutions < FEWEST_REVOLUTIONS:
        raise InputError(
            f"{where}: teeth are learned from {FEWEST_REVOLUTIONS} revolutions or more; there are {revolutions}"
        )
    if wheel.teeth == 1:
        return np.zeros(1)
    even = teeth < teeth[0] + wheel.teeth * (revolutions - revolutions % 2)
    times, teeth = times[even], teeth[even]  # half orders change sign each revolution and cancel in the mean
    angle = teeth * (2.0 * math.pi / wheel.teeth)
    error = np.zeros(wheel.teeth)
    number = teeth % wheel.teeth
    count = np.bincount(number, minlength=wheel.teeth)
    for _ in range(6):
        corrected = angle + error[number]
        deviation = corrected - MeanRotation.of(times, corrected, CYCLE).at(times)
        keep = np.isfinite(deviation)
        own = np.bincount(number[keep], weights=deviation[keep], minlength=wheel.teeth)
        step = -own / np.maximum(1, np.bincount(number[keep], minlength=wheel.teeth))
        present = count > 0.2 * count.max()
        step[present] -= step[present].mean()
        step[~present] = 0.0
        error = error + step
        if np.abs(step).max() < 1e-9:
            break
    return error


@dataclass(frozen=True)
class MeanRotation:
    """Mean rotation over time, as a grid of angles (k,) rad and times (k,) s."""

    angle: Array
    times: Array

    @classmethod
    def of(cls, times: Array, angle: Array, span: float) -> "MeanRotation":
        """Compute a smooth time S over the angle with the same means over ``span`` rad as the times of pulses.

        Means are integrals of the straight lines between pulses, so uneven teeth need no resampling, and deviations
        that recur over ``span`` cancel. S is a spline of degree 5 with knots ``span`` apart. The mean of a B-spline of
        degree 5 over its knot distance is the B-spline of degree 6, so S has the coefficients of the spline of degree 6
        that fits the means (I. J. Schoenberg, Quart. Appl. Math. 4 (1946) 45). S therefore follows any change of speed
        that is smooth over some cycles, up to both ends. ``InputError`` if the mean rotation is not monotonic.
        """
        from scipy.interpolate import BSpline

        area = np.concatenate(([0.0], np.cumsum(0.5 * (times[1:] + times[:-1]) * np.diff(angle))))
        cycles = float(angle[-1] - angle[0]) / span

        def integral(x: Array) -> Array:
            k = np.clip(np.searchsorted(angle, x) - 1, 0, angle.size - 2)
            part = x - angle[k]
            slope = (times[k + 1] - times[k]) / (angle[k + 1] - angle[k])
            return np.asarray(area[k] + part * (times[k] + 0.5 * slope * part))

        steps = max(4, math.ceil(cycles * GRID))
        grid = angle[0] + span * cycles * np.arange(steps + 1) / steps
        if cycles < SPLINED:
            line = np.polynomial.Polynomial.fit(angle, times, min(2, max(1, int(cycles))))
            return cls(grid, _rising(np.asarray(line(grid))))
        count = math.ceil((cycles - 1.0) * GRID)
        v = 1.0 + (cycles - 1.0) * np.arange(count + 1) / count  # ends of the averaging windows, in spans
        ends = angle[0] + span * v
        means = (integral(ends) - integral(ends - span)) / span
        knots = np.arange(-5, math.ceil(cycles) + 7, dtype=np.float64)
        coefficients = _spline_coefficients(BSpline.design_matrix(v, knots, 6), means)
        smooth = np.asarray(BSpline(knots[:-1], coefficients, 5)((grid - angle[0]) / span))
        return cls(grid, _rising(smooth))

    @property
    def inner(self) -> tuple[float, float]:
        """Range of angles (rad) whose mean uses a whole cycle around the angle; all for fewer than two cycles."""
        half = 0.5 * CYCLE if np.ptp(self.angle) > 2.0 * CYCLE else 0.0
        return float(self.angle[0]) + half, float(self.angle[-1]) - half

    def at(self, times: Array) -> Array:
        """Return the mean rotation (n,) rad at times (n,) s, extrapolated by speed and acceleration at the ends."""
        from scipy.interpolate import CubicSpline

        spline = CubicSpline(self.times, self.angle)
        inside = spline(np.clip(times, self.times[0], self.times[-1]))
        for k, end in ((0, self.times[0]), (-1, self.times[-1])):
            beyond = times < end if k == 0 else times > end
            if beyond.any():
                dt = times[beyond] - end
                inside[beyond] = self.angle[k] + dt * (spline(end, 1) + 0.5 * dt * spline(end, 2))
        return np.asarray(inside)

    def speed(self, times: Array) -> Array:
        """Return the mean speed (n,) rad/s at times (n,) s."""
        from scipy.interpolate import CubicSpline

        return np.asarray(CubicSpline(self.times, self.angle)(np.clip(times, self.times[0], self.times[-1]), 1))


def _rising(times: Array) -> Array:
    """Check that the k times (s) of the mean rotation increase, and return the times; raises ``InputError``."""
    falls = np.diff(times) <= 0.0
    if falls.any():
        raise InputError(
            f"the mean rotation goes back at {times[int(np.argmax(falls))]:.4g} s, so these are no pulses of a wheel, "
            "or they are sampled too slowly (aliasing); check channel, level and teeth"
        )
    return times


def _spline_coefficients(design: Any, values: Array) -> Array:
    """Return least-squares coefficients of a banded ``design``; penalised 6th differences fix undetermined ones."""
    from scipy.linalg import cho_solve_banded, cholesky_banded
    from scipy.sparse import diags

    count = design.shape[1]
    taps = [(-1.0) ** k * math.comb(6, k) for k in range(7)]
    rough = diags(taps, range(7), shape=(max(0, count - 6), count))
    normal = (design.T @ design + STIFF * (rough.T @ rough)).todia()
    bands = np.zeros((7, count))
    for lag, row in zip(normal.offsets, normal.data, strict=True):
        if 0 <= lag <= 6:
            bands[6 - lag] = row[:count]
    factor = cholesky_banded(bands)
    found = np.zeros(count)
    for _ in range(3):  # iterative refinement, because times are large compared with the corrections
        found = found + cho_solve_banded((factor, False), design.T @ (values - design @ found))
    return np.asarray(found)
