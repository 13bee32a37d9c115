"""Measured cylinder pressure from a text file of crank angle in degrees and pressure in a stated unit.

A single column of pressures applies to all cylinders. Otherwise each cylinder has a column, in the order of cylinder
numbers or of numbers in the header. Angles count from each cylinder's own firing dead centre, or all from that of
cylinder 1; the positions of the peaks decide which. Angles of a two-stroke are folded into its cycle of 360 degrees,
which is repeated to fill 720.

Points may be irregular, noisy, unordered, doubled, or from several cycles. They are shifted so that 0 is firing dead
centre, joined by a monotone interpolant (Fritsch–Carlson; no overshoot between sparse points), and smoothed by a
periodic smoothing spline that minimises ∫ (s − p)² + λ ∫ s″². λ is chosen so that the deviation from the points equals
at most their estimated noise. The noise is estimated from the distance of each point to the cubic through its four
neighbours.

Sources: F. N. Fritsch and R. E. Carlson, SIAM J. Numer. Anal. 17 (1980) 238; C. H. Reinsch, Numer. Math. 10 (1967) 177.
"""

import math
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from cranktrain.core.errors import InputError
from cranktrain.core.text_table import split_columns
from cranktrain.engine.model import Engine
from cranktrain.loads.pressure_level import CANDIDATES, meant, refuse_any_unit, unit_of_trace
from cranktrain.loads.pressure_points import FEWEST, Points, PressurePoints, read_points
from cranktrain.loads.pressure_units import FOREIGN, PressureUnit, header_unit, named_unit, unit_in_text
from cranktrain.loads.trace_doubts import trace_doubts

Array = NDArray[np.float64]

WIDEST_GAP = 40.0
FARTHEST_PEAK = 60.0
"""Largest distance (deg) of the peak from 0 or 360 at which dead centre is identified by the peak."""
LOWEST_PEAK, HIGHEST_PEAK = 3e5, 6e7
"""Range of plausible peak pressures, Pa; a stated unit that gives a peak outside is wrong."""
# Limits for warnings about a trace.
LEAST_RATIO = 3.0
"""Least plausible ratio of peak to lowest pressure, as in a weak compression."""
LARGEST_NOISE = 0.03
"""Standard deviation of the points, over the peak, above which a warning is given."""
SECOND_PEAK, APART = 0.95, 90.0
"""Height of a second peak over the first that gives a warning, and least distance (deg) of both, beyond pilot burns."""
CONFLICT = 0.2
"""Range of pressures at one angle, over the peak, that gives a warning; an engine's cycles differ less."""
GAP_AT_PEAK, NEAR_PEAK = 10.0, 15.0
"""Gap between points (deg) and its largest distance from the peak (deg) for which the true peak may be missed."""
PERIOD = 720.0
FARTHEST = 1e5
"""Largest angle of a file, deg, which allows more than a hundred successive cycles."""
_FINE = 2880


def read_pressure(
    path: str | Path,
    unit: str | None,
    dead_centre_deg: float | None,
    n: int,
    engine: Engine,
) -> tuple[list[NDArray[np.float64]], str]:
    """Read absolute pressures (Pa) at ``n`` uniform crank angles after firing dead centre and a text on their origin.

    The pressures are one array for all cylinders, or one for each.

    Parameters
    ----------
    path : text table of any dialect with one point per line (:mod:`cranktrain.core.text_table`); a colon with names or
        numbers of columns, ``bench.csv:PCYL2``, selects columns of a file with further ones
    unit : see :mod:`cranktrain.loads.pressure_units`; None takes it from the header, or from the trace if only one
        unit fits (:mod:`cranktrain.loads.pressure_level`)
    dead_centre_deg : angle of the file that is firing dead centre (of cylinder 1 if all angles count from there); None
        takes 0 or 360, whichever is within 60 degrees of the peak
    n : number of samples, a divisor of 2880
    engine : engine with number, firing angles and cycle of its cylinders

    Raises
    ------
    InputError
        one line with file and row, if it is unreadable, empty, NaN, negative, too short, of a wrong unit or dead centre

    Warns, one line each, of an implausible cylinder pressure (constant, noisy, two peaks, contradictory points, a gap
    at the peak), otherwise of one that hardly fits this engine (:mod:`cranktrain.loads.trace_doubts`).
    """
    place, columns = split_columns(path)
    points = read_points(place, columns, engine.n_cylinders)
    return folded_traces(points, _stated(points, unit, place.name), dead_centre_deg, n, engine, place.name)


def folded_traces(
    points: Points, stated: PressureUnit | None, dead_centre_deg: float | None, n: int, engine: Engine, name: str
) -> tuple[list[Array], str]:
    """Return the traces of points in the form of :func:`read_pressure`; errors and warnings begin with ``name``."""
    if dead_centre_deg is not None and not abs(dead_centre_deg) <= FARTHEST:
        raise InputError(
            f"{name}: dead centre at {dead_centre_deg:g} deg is no angle of a trace; give one within {FARTHEST:g} deg"
        )
    period, phases = math.degrees(engine.cylinders.cycle), np.degrees(engine.firing_angles)
    _refuse_impossible(points, stated, name)
    first = _dead_centre(float(points.peak_angles[0]), name) if dead_centre_deg is None else dead_centre_deg
    centres, base = _centres(points.peak_angles, first, phases, period, name)
    cycles = _cycles(points, centres, name, period)
    found = stated or unit_of_trace(f"{name}{points.column}", engine, *cycles[0][:2])
    rows, noises = [], []
    for k, (x, raw, conflict) in enumerate(cycles, 1):
        own = name if len(centres) == 1 else f"{name}, cylinder {k}"
        y = raw * found.scale + found.zero
        noises.append(_noise(x, y))
        rows.append(_smooth(x, y, noises[-1]))
        doubts = list(_doubts(x, y, noises[-1], rows[-1], (conflict[0] * found.scale, conflict[1]), period))
        for doubt in doubts or trace_doubts(engine, rows[-1]):
            warnings.warn(f"{own}: {doubt}", stacklevel=4)
        if rows[-1].min() <= 0.0:
            raise InputError(f"{own}: smoothing gives a pressure below zero; the points scatter by {noises[-1]:.3g} Pa")
    source = (
        f"{name}: {cycles[-1][0].size * period / PERIOD:.0f} points in {found.how}, firing dead centre at {first:g} "
        f"deg of the file{base}, noise {1e-5 * max(noises):.2g} bar"
    )
    if points.noun != "line":
        source = source.replace("deg of the file", "deg of the array")
    return [np.ascontiguousarray(row[:: _FINE // n]) for row in rows], source


def _stated(points: PressurePoints, unit: str | None, name: str) -> PressureUnit | None:
    """Return the unit stated by option or header, common to all columns of pressure, or None."""
    if unit is not None:
        return named_unit(unit)
    angle = points.head.names[points.columns[0]] or "deg"
    own = [
        [angle, f"{column} [{text}]" if text else column]
        for column, text in zip(points.names, points.units, strict=True)
    ]
    stated = {found for cells in own if (found := header_unit(cells, name)) is not None}
    if len(stated) > 1:
        names = ", ".join(sorted(found.name for found in stated))
        raise InputError(f"{name}: the header states several pressure units, {names}; give all columns in one")
    if not stated:
        stated = {found for cells in points.head.header[-1:] if (found := unit_in_text(cells[-1])) is not None}
    doubtful = next((column for column in points.names if column.lower() in FOREIGN), None)
    if doubtful and not stated:
        likely = meant(CANDIDATES, float(points.peaks.max()))
        raise InputError(
            f"{name}, column {doubtful}: no unit of pressure is stated, and the name may be the unit of an amplifier's "
            f"signal; state it, --pressure-unit: {likely}"
        )
    return next((found._replace(how=f"{found.how} by the header") for found in stated), None)


def _refuse_impossible(points: Points, unit: PressureUnit | None, name: str) -> None:
    """Raise ``InputError`` for too few points, or values that are impossible in a cylinder."""
    if points.negative is not None and (unit is None or unit.zero == 0.0):
        number, value = points.negative
        raise InputError(
            f"{name}: {points.noun} {number}: pressure {value:g} is negative; absolute pressure is wanted, or a gauge "
            "unit such as barg"
        )
    if points.count < FEWEST:
        raise InputError(f"{name}: {points.count} points are too few for a cycle; give at least {FEWEST}")
    if unit is None:
        refuse_any_unit(name, float(points.peaks.max()))
        return
    for own in points.peaks:
        if not LOWEST_PEAK <= own * unit.scale + unit.zero <= HIGHEST_PEAK:
            raise InputError(
                f"{name}: a peak of {own:g} {unit.name} is no cylinder pressure of an engine (0.3 to 60 MPa); state "
                "another unit"
            )
    if points.low * unit.scale + unit.zero < 0.0:
        raise InputError(f"{name}: {points.low:g} {unit.name} is less than nothing; state another unit")


def _dead_centre(peak: float, name: str) -> float:
    """Return the angle of firing dead centre in the file, deg: the multiple of 360 next to the ``peak`` (deg)."""
    centre = 360.0 * round(peak / 360.0)
    if abs(peak - centre) > FARTHEST_PEAK:
        raise InputError(
            f"{name}: the peak lies at {peak:g} deg, not within {FARTHEST_PEAK:g} deg of 0 or 360; say where firing "
            "dead centre is"
        )
    return centre


def _centres(peaks: Array, first: float, phases: Array, period: float, name: str) -> tuple[Array, str]:
    """Return the firing dead centre of each column from the angles ``peaks`` (k,), deg, and a text for the report."""
    if len(peaks) == 1:
        return np.array([first]), ""

    def fits(centres: Array) -> bool:
        away = (peaks - centres + 0.5 * period) % period - 0.5 * period
        return bool(np.abs(away).max() <= FARTHEST_PEAK)

    own, common = np.full(len(peaks), first), first + phases
    if fits(own):
        return own, ", of each cylinder its own"
    if fits(common):
        return common, ", of cylinder 1, from which all angles count"
    where = "; ".join(f"{k} at {p:g}, fires at {f:g}" for k, (p, f) in enumerate(zip(peaks, phases, strict=True), 1))
    raise InputError(
        f"{name}: the cylinders' peaks are neither within {FARTHEST_PEAK:g} deg of dead centre, {first:g} deg, nor of "
        f"their firing angles after it ({where}); check the order of the columns and dead centre"
    )


def _cycles(points: Points, centres: Array, name: str, period: float) -> list[tuple[Array, Array, tuple[float, float]]]:
    """Fold the points of each column into [0, 720), in order, with points within a quarter degree averaged.

    Points of a two-stroke are folded into 360 and repeated. Also returns the largest range of averaged points, as
    written, and its angle. ``InputError`` if the points do not cover a cycle.
    """
    folded = [_Cells(period) for _ in centres]
    for angle, pressures in points.parts():
        for cells, centre, pressure in zip(folded, centres, pressures.T, strict=True):
            cells.add(angle - centre, pressure)
    own = [name if len(centres) == 1 else f"{name}, cylinder {k}" for k in range(1, len(centres) + 1)]
    return [cells.cycle(one) for cells, one in zip(folded, own, strict=True)]


class _Cells:
    """Sums of angles and pressures of the points in each quarter degree of a cycle."""

    def __init__(self, period: float) -> None:
        self.period, self.count = period, np.zeros(_FINE)
        self.x, self.y = np.zeros(_FINE), np.zeros(_FINE)
        self.low, self.high = np.full(_FINE, np.inf), np.full(_FINE, -np.inf)

    def add(self, angle: Array, pressure: Array) -> None:
        """Add points (n,) at angles in deg after firing dead centre, of any cycle."""
        turns = round(PERIOD / self.period)
        once = angle % self.period
        once[once >= self.period] = 0.0  # rounding can turn a remainder into a whole period
        folded = np.concatenate([once + k * self.period for k in range(turns)])
        pressure = np.tile(pressure, turns)
        cell = np.floor(folded * (_FINE / PERIOD)).astype(int) % _FINE
        order = np.argsort(cell, kind="stable")
        at, start, count = np.unique(cell[order], return_index=True, return_counts=True)
        self.count[at] += count
        self.x[at] += np.add.reduceat(folded[order], start)
        self.y[at] += np.add.reduceat(pressure[order], start)
        self.low[at] = np.minimum(self.low[at], np.minimum.reduceat(pressure[order], start))
        self.high[at] = np.maximum(self.high[at], np.maximum.reduceat(pressure[order], start))

    def cycle(self, name: str) -> tuple[Array, Array, tuple[float, float]]:
        """Return means (k,) of angle and pressure in cells with points, and the largest pressure range, its angle."""
        filled = self.count > 0.0
        x, y = (sums[filled] / self.count[filled] for sums in (self.x, self.y))
        spread = self.high[filled] - self.low[filled]
        gaps = np.diff(np.append(x, x[0] + PERIOD))
        if gaps.max() > WIDEST_GAP:
            at, period = int(gaps.argmax()), self.period
            two_stroke = "; of a two-stroke state cylinders.cycle = 360 deg" if 320.0 < gaps[at] < period else ""
            raise InputError(
                f"{name}: no points over {gaps[at]:.0f} deg after {x[at]:.0f} deg past firing dead centre; "
                f"a whole cycle of {period:g} deg is wanted, with gaps of {WIDEST_GAP:.0f} deg at most{two_stroke}"
            )
        widest = int(spread.argmax())
        return x, y, (float(spread[widest]), float(x[widest]))


def _doubts(
    x: Array, y: Array, noise: float, smooth: Array, conflict: tuple[float, float], period: float
) -> Iterator[str]:
    """Yield warnings of an implausible cylinder pressure; angles in messages are after firing dead centre."""
    peak, at = float(smooth.max()), float(smooth.argmax()) * PERIOD / _FINE
    if peak < LEAST_RATIO * smooth.min():
        yield f"pressures of {1e-5 * smooth.min():.3g} to {1e-5 * peak:.3g} bar are nearly constant: no compression"
    if noise > LARGEST_NOISE * y.max():
        yield f"points scatter by {1e-5 * noise:.2g} bar, {100.0 * noise / y.max():.0f} % of the peak; it may be lower"
    if conflict[0] > CONFLICT * y.max():
        yield (
            f"points at {conflict[1]:.4g} deg past firing dead centre differ by {1e-5 * conflict[0]:.3g} bar; "
            "their mean is taken"
        )
    grid = np.arange(_FINE) * PERIOD / _FINE
    far = np.abs((grid - at + 0.5 * period) % period - 0.5 * period) > APART
    if smooth[far].max() > SECOND_PEAK * peak and peak >= LEAST_RATIO * smooth.min():
        second = grid[far][smooth[far].argmax()]
        yield (
            f"two peaks of {1e-5 * peak:.3g} and {1e-5 * smooth[far].max():.3g} bar, at {at:.4g} and {second:.4g} deg "
            "past firing dead centre; a cycle has one"
        )
    ends, starts = np.append(x[1:], x[0] + PERIOD), x
    highest = x[y.argmax()]
    for first, last in zip(starts, ends, strict=True):
        if first >= period:
            break
        middle = (0.5 * (first + last) - highest + 0.5 * PERIOD) % PERIOD - 0.5 * PERIOD
        if last - first > GAP_AT_PEAK and abs(middle) - 0.5 * (last - first) < NEAR_PEAK:
            yield (
                f"no points from {first:.4g} to {last:.4g} deg past firing dead centre, at the peak; it may be higher "
                "than read"
            )


def _noise(x: Array, y: Array) -> float:
    """Estimate the standard deviation of noise, Pa, from distances of points to cubics through four neighbours."""
    at = np.arange(x.size)
    around = [np.take(x, at + k, mode="wrap") + PERIOD * np.floor_divide(at + k, x.size) for k in (-2, -1, 1, 2)]
    value = [np.take(y, at + k, mode="wrap") for k in (-2, -1, 1, 2)]
    estimate, variance = np.zeros(x.size), np.ones(x.size)
    for i in range(4):
        weight = np.ones(x.size)
        for j in range(4):
            if j != i:
                weight = weight * (x - around[j]) / (around[i] - around[j])
        estimate += weight * value[i]
        variance += weight**2
    return float(1.4826 * np.median(np.abs(y - estimate) / np.sqrt(variance)))


def _smooth(x: Array, y: Array, noise: float) -> Array:
    """Fit a periodic smoothing spline, at 2880 uniform angles, whose RMS deviation from points is at most ``noise``."""
    wrapped = np.concatenate((x[-4:] - PERIOD, x, x[:4] + PERIOD))
    grid = np.arange(_FINE) * (PERIOD / _FINE)
    joined = PchipInterpolator(wrapped, np.concatenate((y[-4:], y, y[:4])))(grid)
    spectrum = np.fft.rfft(joined)
    wave = np.arange(spectrum.size, dtype=float) ** 4

    def spline(log_weight: float) -> Array:
        return np.asarray(np.fft.irfft(spectrum / (1.0 + 10.0**log_weight * wave), _FINE))

    def missed(values: Array) -> float:
        return float(np.sqrt(np.mean((np.interp(x, grid, values, period=PERIOD) - y) ** 2)))

    low, high = -14.0, 0.0
    floor = missed(joined)  # deviation that the grid itself causes
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if missed(spline(middle)) < max(noise, 1.01 * floor) else (low, middle)
    return spline(low)
