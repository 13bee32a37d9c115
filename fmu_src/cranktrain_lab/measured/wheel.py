"""Teeth of a wheel numbered from the times of its pulses: gaps, missing and double pulses, pitch errors.

The interval between two pulses over the local median interval is 1 within a wheel, 2, 3, … across missing pulses, and
two intervals that add up to 1 hold a double pulse. Missing pulses that recur once a revolution are the gap of a wheel
such as 60−2; others are counted as lost. Each pulse gets the number of its tooth, so lost ones leave no error behind.

Pitch errors are what recurs each revolution. One wheel alone cannot tell them from torsional vibration of whole orders
that has the same amplitude and phase throughout. They are therefore learned only where the caller says so: from a
stretch without torsion (coasting, another recording), or from all of a recording.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array

REACH = 9
"""Intervals of the local median; less where the wheel has few teeth."""
DOUBLE = 0.55
"""Fraction of the local interval below which an interval is part of a double pulse."""
CYCLE = 4.0 * math.pi
MOST_MISSING = 6
"""Pulses missing in a row beyond which the shaft is taken to have stood still."""
GRID = 8
"""Values of the mean rotation a cycle."""
SPLINED = 4.0
"""Cycles from which the mean rotation is a spline; of less it is a parabola."""
STIFF = 1e-7
"""Weight of sixth differences of the mean rotation's coefficients against its values."""
FEWEST_REVOLUTIONS = 8
"""Revolutions from which pitch errors are learned."""
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Wheel:
    """Teeth of a wheel: ``teeth`` a revolution as if none were missing, ``missing`` of them in a gap (58 = 60−2).

    A wheel of several equal ``gaps`` has them at equal distances.
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
        """Pulses a revolution."""
        return self.teeth - self.gaps * self.missing

    @property
    def sector(self) -> Wheel:
        """Wheel from one gap to the next as if that were a revolution; the wheel itself where it has one gap."""
        return Wheel(self.teeth // self.gaps, self.missing)

    @property
    def name(self) -> str:
        """Teeth and missing teeth as they are usually written: 60-2, 60-2-2-2."""
        return f"{self.teeth}" + f"-{self.missing}" * self.gaps


@dataclass(frozen=True)
class Numbered:
    """Pulses with the numbers of their teeth.

    Attributes
    ----------
    times : (k,) s, double pulses removed
    teeth : (k,) number of each pulse's tooth from the first revolution's tooth 0 on, rising; tooth 0 follows the gap,
        or one of several
    lost, doubled : pulses that are missing apart from the gap, and that were removed
    slips : revolutions whose gap is not where it was, with the pulses that they have too many (+) or few (−)
    stops : intervals in which the shaft stood still; teeth go on counting behind them
    """

    times: Array
    teeth: Indices
    lost: int
    doubled: int
    slips: tuple[tuple[int, int], ...]
    stops: tuple[tuple[float, float], ...]


def number_teeth(times: Array, wheel: Wheel, where: str) -> Numbered:
    """Number the pulses of a wheel; ``InputError``: fewer than two revolutions, a gap that does not recur.

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
    """Median of the intervals around each; of wheels of few teeth over whole revolutions."""
    from scipy.ndimage import median_filter

    reach = REACH if wheel.teeth >= 3 * REACH else max(3, 2 * (wheel.pulses // 2) + 1)
    return np.asarray(median_filter(intervals, size=reach, mode="nearest"))


def _without_doubles(times: Array, wheel: Wheel) -> tuple[Array, int]:
    """Remove second pulses: of two that are too close, the one that leaves the less even neighbours."""
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
            # Without pulse k the interval before it grows; without k + 1 the one behind it.
            before = abs(times[k + 1] - times[k - 1] - local[k]) if k > 0 else math.inf
            after = abs(times[k + 2] - times[k] - local[k]) if k + 2 < times.size else math.inf
            if min(before, after) > 0.45 * local[k]:
                continue
            if k > 0 and k + 2 < times.size:
                # The pulse nearer to where its neighbours put it stays.
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
    """Numbers counted from the gap on, anew at each gap; revolutions that do not fit."""
    candidates = np.flatnonzero(steps == wheel.missing + 1) + 1  # first pulse behind a gap
    if not candidates.size:
        raise InputError(
            f"{where}: no gap of {wheel.missing} missing teeth among {teeth.size} pulses; check teeth and missing"
        )
    phase = teeth[candidates] % wheel.teeth
    # The gap is where most candidates are; lost pulses make others. After a slip the place is another one.
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
    """Teeth between the first and the last pulse that should have had one and have none, standstills left out."""
    inside = np.concatenate(([False], np.diff(teeth) <= MOST_MISSING + wheel.missing))
    numbers = np.arange(int(teeth[0]), int(teeth[-1]) + 1)
    due = numbers % wheel.teeth < wheel.pulses
    upto = np.cumsum(due)[teeth - teeth[0]]
    return int(np.sum((np.diff(upto) - 1)[inside[1:]].clip(min=0)))


def _recurs(teeth: Indices, candidates: Indices, at: int, wheel: Wheel) -> bool:
    """Whether the next gap is a revolution behind this one."""
    behind = teeth[candidates[candidates > at]] - teeth[at]
    return bool(behind.size == 0 or np.any(behind[:4] == wheel.teeth))


def learn_errors(numbered: Numbered, wheel: Wheel, window: tuple[float, float] | None, where: str) -> Array:
    """Pitch errors of the teeth, (teeth,) rad with zero mean; those of missing teeth are zero.

    Each revolution gives every tooth's place against the mean rotation over a cycle around it; the mean of all
    revolutions is the error. Raises ``InputError``: too few revolutions.

    Parameters
    ----------
    window : times between which to learn, s; the whole recording where None
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
    times, teeth = times[even], teeth[even]  # half orders change their sign each revolution and leave the mean
    angle = teeth * (2.0 * math.pi / wheel.teeth)
    error = np.zeros(wheel.teeth)
    number = teeth % wheel.teeth
    count = np.bincount(number, minlength=wheel.teeth)
    for _ in range(6):
        deviation = angle + error[number] - smooth_rotation(times, angle + error[number], CYCLE)
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


def smooth_rotation(times: Array, angle: Array, span: float) -> Array:
    """Mean rotation at the times of pulses, (k,) rad: the time's mean over ``span`` rad, inverted.

    What recurs over ``span`` vanishes from the mean. The means of the ends are continued by their speed and its change.
    """
    return MeanRotation.of(times, angle, span).at(times)


@dataclass(frozen=True)
class MeanRotation:
    """Mean rotation over time, rad: angles (k,) of a grid and the times (k,) s at which the mean rotation has them."""

    angle: Array
    times: Array

    @classmethod
    def of(cls, times: Array, angle: Array, span: float) -> MeanRotation:
        """Smooth time S over the angle, whose means over ``span`` rad are those of the pulses' times.

        Means are integrals of the straight lines between pulses, so uneven teeth need no resampling; what recurs over
        ``span`` vanishes from them. S is a spline of degree 5 with knots ``span`` apart. The mean of a B-spline of
        degree 5 over the distance of its knots is the B-spline of degree 6, so S has the coefficients of the spline of
        degree 6 that fits the means (I. J. Schoenberg, Quart. Appl. Math. 4 (1946) 45). So S follows any change of
        speed that is smooth over some cycles, up to both ends. ``InputError``: a mean rotation that goes back.
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
        v = 1.0 + (cycles - 1.0) * np.arange(count + 1) / count  # ends of the means' windows, in spans from the begin
        ends = angle[0] + span * v
        means = (integral(ends) - integral(ends - span)) / span
        knots = np.arange(-5, math.ceil(cycles) + 7, dtype=np.float64)
        coefficients = _spline_coefficients(BSpline.design_matrix(v, knots, 6), means)
        smooth = np.asarray(BSpline(knots[:-1], coefficients, 5)((grid - angle[0]) / span))
        return cls(grid, _rising(smooth))

    @property
    def inner(self) -> tuple[float, float]:
        """Angles between which the mean rests on a cycle around it, rad; all where there are less than two cycles."""
        half = 0.5 * CYCLE if np.ptp(self.angle) > 2.0 * CYCLE else 0.0
        return float(self.angle[0]) + half, float(self.angle[-1]) - half

    def at(self, times: Array) -> Array:
        """Mean rotation (n,) rad at times (n,) s; beyond the grid's ends by its end's speed and acceleration."""
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
        """Mean speed (n,) rad/s."""
        from scipy.interpolate import CubicSpline

        return np.asarray(CubicSpline(self.times, self.angle)(np.clip(times, self.times[0], self.times[-1]), 1))


def _rising(times: Array) -> Array:
    """Times (k,) s of the mean rotation; ``InputError`` where they go back."""
    falls = np.diff(times) <= 0.0
    if falls.any():
        raise InputError(
            f"the mean rotation goes back at {times[int(np.argmax(falls))]:.4g} s, so these are no pulses of a wheel, "
            "or they are sampled too slowly (aliasing); check channel, level and teeth"
        )
    return times


def _spline_coefficients(design: Any, values: Array) -> Array:
    """Coefficients of the least-squares fit of a banded ``design``; 6th differences hold those that no value tells."""
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
    for _ in range(3):  # refinements: the times are large beside what is sought
        found = found + cho_solve_banded((factor, False), design.T @ (values - design @ found))
    return np.asarray(found)
