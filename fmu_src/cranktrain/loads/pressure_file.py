"""Measured cylinder pressure from a text file: crank angle in degrees, and pressure in a stated unit.

One column of pressures is that of all cylinders. As many columns as there are cylinders are one for each, in the order
of the cylinders' numbers or as numbers in the header say. Their angles count from each cylinder's own firing dead
centre, or all from that of cylinder 1; the places of the peaks tell which. The angles of a two-stroke are folded into
its cycle of 360 degrees, which is laid twice over 720.

Points may be irregular, noisy, unordered, doubled, or from several cycles. They are shifted so that 0 is firing dead
centre, joined by a monotone interpolant (Fritsch–Carlson; no overshoot between sparse points), and smoothed by a
periodic smoothing spline that minimises ∫ (s − p)² + λ ∫ s″², with λ such that the points are missed by no more than
their estimated noise. The noise comes from the points' distances to the cubic through their four neighbours.

Sources: F. N. Fritsch and R. E. Carlson, SIAM J. Numer. Anal. 17 (1980) 238; C. H. Reinsch, Numer. Math. 10 (1967) 177.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from cranktrain.core.errors import InputError, shown
from cranktrain.core.user_file import read_text
from cranktrain.engine.model import Engine
from cranktrain.loads.pressure_units import (
    HIGHEST_PEAK,
    LOWEST_PEAK,
    PressureUnit,
    header_unit,
    named_unit,
    unit_of_size,
)
from cranktrain.loads.trace_doubts import trace_doubts

Array = NDArray[np.float64]

WIDEST_GAP = 40.0
FARTHEST_PEAK = 60.0
"""Distance (deg) of the peak from firing dead centre within which dead centre is found by the peak."""
HEADER_LINES = 3
LARGEST = 1e12
"""Beyond which a number is no angle or pressure in any unit."""
# Warnings about a trace, issued after it is read.
LEAST_RATIO = 3.0
"""Least ratio of peak to lowest pressure: that of the weakest compression of the intake's pressure."""
LARGEST_NOISE = 0.03
"""Standard deviation of the points over the peak."""
SECOND_PEAK, APART = 0.95, 90.0
"""Height of a second peak over the first, and how far away (deg) it belongs to no pilot burn."""
CONFLICT = 0.2
"""Range of the points at one angle over the peak: more than cycles of one engine differ."""
GAP_AT_PEAK, NEAR_PEAK = 10.0, 15.0
"""Gap (deg) within so many degrees of the peak in which the true peak may hide."""
PERIOD = 720.0
_FINE = 2880
_INDEX = re.compile(r"(?<=\w)\[\s*(\d+)\s*\]")
_BRACKETS = re.compile(r"\[[^\]]*\]|\([^)]*\)")


def read_pressure(
    path: str | Path,
    unit: str | None,
    dead_centre_deg: float | None,
    n: int,
    engine: Engine,
) -> tuple[list[NDArray[np.float64]], str]:
    """Absolute pressures (Pa) at ``n`` uniform crank angles after firing dead centre, and a line on their origin.

    One array for all cylinders, or one for each.

    Parameters
    ----------
    path : file with one point per line; ``;``, ``,``, tab or blanks between; a header may name the pressure's unit
    unit : see :mod:`cranktrain.loads.pressure_units`; None takes it from the header or the size of the peak
    dead_centre_deg : angle of the file that is firing dead centre, of cylinder 1 where all angles count from there;
        None takes 0 or 360, whichever is within 60 degrees of the peak
    n : number of samples; divides 2880
    engine : gives number, firing angles and cycle of its cylinders

    Raises
    ------
    InputError
        one line with file and row: not readable, empty, NaN, negative, too short, wrong unit, dead centre not found

    Warns, one line each, of an unlikely cylinder pressure: constant, noisy, with two peaks, contradictory points, or a
    gap at the peak; else of one that is hardly of this engine (:mod:`cranktrain.loads.trace_doubts`).
    """
    name, period, phases = Path(path).name, math.degrees(engine.cylinders.cycle), np.degrees(engine.firing_angles)
    angle, pressures, found = _points(path, name, unit, len(phases))
    pressures = _absolute(pressures, found, name)
    if dead_centre_deg is not None and not math.isfinite(dead_centre_deg):
        raise InputError(f"{name}: dead centre at {dead_centre_deg} deg is not an angle")
    peaks = angle[pressures.argmax(axis=0)]
    first = _dead_centre(float(peaks[0]), name) if dead_centre_deg is None else dead_centre_deg
    centres, base = _centres(peaks, first, phases, period, name)
    rows, noises = [], []
    for k, (centre, pressure) in enumerate(zip(centres, pressures.T, strict=True), 1):
        own = name if len(centres) == 1 else f"{name}, cylinder {k}"
        x, y, conflict = _one_cycle(angle - centre, pressure, own, period)
        noises.append(_noise(x, y))
        rows.append(_smooth(x, y, noises[-1]))
        doubts = list(_doubts(x, y, noises[-1], rows[-1], conflict, period))
        for doubt in doubts or trace_doubts(engine, rows[-1]):
            warnings.warn(f"{own}: {doubt}", stacklevel=3)
        if rows[-1].min() <= 0.0:
            raise InputError(f"{own}: smoothing gives a pressure below zero; the points scatter by {noises[-1]:.3g} Pa")
    source = (
        f"{name}: {x.size * period / PERIOD:.0f} points in {found.how}, firing dead centre at {first:g} deg of the "
        f"file{base}, noise {1e-5 * max(noises):.2g} bar"
    )
    return [np.ascontiguousarray(row[:: _FINE // n]) for row in rows], source


def _points(path: str | Path, name: str, unit: str | None, cylinders: int) -> tuple[Array, Array, PressureUnit]:
    """Angles (N,) deg, pressures as written (N, 1) or (N, cylinders), and their unit."""
    lines = read_text(path, "pressure file", "give a text file of angle in degrees and pressure").splitlines()
    rows: list[list[float]] = []
    header: list[list[str]] = []
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if not text or text.startswith("#"):
            continue
        separator = next((s for s in (";", "\t", ",") if s in text), None)
        cells = [cell.strip() for cell in (text.split(separator) if separator else text.split())]
        if separator in (";", "\t"):
            cells = [cell.replace(",", ".") for cell in cells]
        try:
            values = [float(cell) for cell in cells]
        except ValueError:
            if rows or len(header) == HEADER_LINES:
                raise InputError(f"{name}: line {number}: {shown(text)} is not two numbers") from None
            header.append(cells)
            continue
        if len(values) not in (2, 1 + cylinders) or (rows and len(values) != len(rows[0]) - 1):
            each = f", or a pressure for each of the {cylinders} cylinders" if cylinders > 1 else ""
            raise InputError(
                f"{name}: line {number}: {len(values)} columns; give two, angle in degrees and pressure{each}"
            )
        if not all(abs(value) <= LARGEST for value in values):
            raise InputError(f"{name}: line {number}: {shown(text)} holds a value that is not finite; remove the line")
        rows.append([*values, number])
    if not rows:
        raise InputError(f"{name}: no points; give lines of angle in degrees and pressure")
    header = [[_INDEX.sub(r"\1", cell) for cell in cells] for cells in header]
    data = np.array(rows)
    found = _stated(header, unit, name, data.shape[1] - 2)
    angle, pressures = data[:, 0], data[:, 1:-1][:, _columns(header, data.shape[1] - 2)]
    if found is None or found.zero == 0.0:
        for value, number in zip(pressures.min(axis=1), data[:, -1], strict=True):
            if value >= 0.0:
                continue
            raise InputError(
                f"{name}: line {number:.0f}: pressure {value:g} is negative; absolute pressure is wanted, or a gauge "
                "unit such as barg"
            )
    if len(rows) < 20:
        raise InputError(f"{name}: {len(rows)} points are too few for a cycle; give at least 20")
    return angle, pressures, found or unit_of_size(float(pressures.max()), name)


def _columns(header: list[list[str]], count: int) -> list[int]:
    """Columns of pressure by cylinder: as the numbers of a header with all of 1..count say, else as they stand."""
    for cells in header:
        found = [re.findall(r"\d+", _BRACKETS.sub(" ", cell)) for cell in cells[1:]]
        numbers = [int(one[0]) for one in found if len(one) == 1 and len(one[0]) < 4]
        if sorted(numbers) == list(range(1, count + 1)) and len(cells) == count + 1:
            return [numbers.index(k) for k in range(1, count + 1)]
    return list(range(count))


def _stated(header: list[list[str]], unit: str | None, name: str, count: int = 1) -> PressureUnit | None:
    """The unit that option or header state, if they do; all ``count`` columns of pressure have it."""
    if any("rad" in re.findall(r"[a-z]+", cell.lower()) for cells in header for cell in cells):
        raise InputError(f"{name}: the header says rad; angles are wanted in degrees")
    if unit is not None:
        return named_unit(unit)
    units: list[PressureUnit] = []
    for cells in header:
        own = [[cells[0], cell] for cell in cells[1:]] if len(cells) == count + 1 > 2 else [cells]
        stated = {found for one in own if (found := header_unit(one, name)) is not None}
        if len(stated) > 1:
            names = ", ".join(sorted(found.name for found in stated))
            raise InputError(f"{name}: the header states several pressure units, {names}; give all columns in one")
        units += stated
    return units[-1]._replace(how=f"{units[-1].how} by the header") if units else None


def _absolute(pressure: Array, unit: PressureUnit, name: str) -> Array:
    """Pressures (N, k) in Pa; refuses values that no engine has."""
    absolute = pressure * unit.scale + unit.zero
    for own, peak in zip(pressure.max(axis=0), absolute.max(axis=0), strict=True):
        if 0.1 * LOWEST_PEAK <= peak <= 2.0 * HIGHEST_PEAK:
            continue
        raise InputError(
            f"{name}: a peak of {own:g} {unit.name} is no cylinder pressure of an engine (0.3 to 60 MPa); "
            "state another unit"
        )
    if absolute.min() < 0.0:
        raise InputError(f"{name}: {pressure.min():g} {unit.name} is less than nothing; state another unit")
    return np.asarray(absolute)


def _dead_centre(peak: float, name: str) -> float:
    """Angle of the file that is firing dead centre: the multiple of 360 degrees next to the peak, all in degrees."""
    centre = 360.0 * round(peak / 360.0)
    if abs(peak - centre) > FARTHEST_PEAK:
        raise InputError(
            f"{name}: the peak lies at {peak:g} deg, not within {FARTHEST_PEAK:g} deg of 0 or 360; say where firing "
            "dead centre is"
        )
    return centre


def _centres(peaks: Array, first: float, phases: Array, period: float, name: str) -> tuple[Array, str]:
    """Firing dead centre of each column of pressures by the places of the ``peaks`` (k,), deg; and what tells of it."""
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


def _one_cycle(angle: Array, pressure: Array, name: str, period: float) -> tuple[Array, Array, tuple[float, float]]:
    """Points folded into [0, 720), ordered, those within a quarter degree averaged; refuse what leaves a cycle open.

    Of a two-stroke they are folded into 360 and repeated. Also the largest range (Pa) of points that were averaged, and
    its angle.
    """
    turns = round(PERIOD / period)
    once = angle % period
    once[once >= period] = 0.0  # a remainder that rounding made a whole period
    folded = np.concatenate([once + k * period for k in range(turns)])
    pressure = np.tile(pressure, turns)
    cell = np.floor(folded * (_FINE / PERIOD)).astype(int) % _FINE
    order = np.argsort(cell, kind="stable")
    _, start, count = np.unique(cell[order], return_index=True, return_counts=True)
    x = np.add.reduceat(folded[order], start) / count
    y = np.add.reduceat(pressure[order], start) / count
    spread = np.maximum.reduceat(pressure[order], start) - np.minimum.reduceat(pressure[order], start)
    gaps = np.diff(np.append(x, x[0] + PERIOD))
    if gaps.max() > WIDEST_GAP:
        at = int(gaps.argmax())
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
    """Warnings of an unlikely cylinder pressure; angles in messages are those after firing dead centre."""
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
    """Standard deviation of the points' noise, Pa, from their distance to the cubic through four neighbours."""
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
    """Periodic smoothing spline at 2880 uniform angles that deviates from the points by ``noise`` (RMS) at most."""
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
    floor = missed(joined)  # the grid's own share
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if missed(spline(middle)) < max(noise, 1.01 * floor) else (low, middle)
    return spline(low)
