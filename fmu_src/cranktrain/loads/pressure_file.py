"""Measured cylinder pressure from a text file: two columns, crank angle in degrees and pressure in a stated unit.

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
from cranktrain.loads.pressure_units import (
    HIGHEST_PEAK,
    LOWEST_PEAK,
    PressureUnit,
    header_unit,
    named_unit,
    unit_of_size,
)

Array = NDArray[np.float64]

WIDEST_GAP = 40.0
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


def read_pressure(
    path: str | Path, unit: str | None, dead_centre_deg: float | None, n: int
) -> tuple[NDArray[np.float64], str]:
    """Absolute pressure at ``n`` uniform crank angles after firing dead centre, Pa, and a line on its origin.

    Parameters
    ----------
    path : file with one point per line; ``;``, ``,``, tab or blanks between; a header may name the pressure's unit
    unit : see :mod:`cranktrain.loads.pressure_units`; None takes it from the header or the size of the peak
    dead_centre_deg : angle of the file that is firing dead centre; None takes 0 or 360, whichever is within 60 degrees
        of the peak
    n : number of samples; divides 2880

    Raises
    ------
    InputError
        one line with file and row: not readable, empty, NaN, negative, too short, wrong unit, dead centre not found

    Warns, one line each, of an unlikely cylinder pressure: constant, noisy, with two peaks, contradictory points, or a
    gap at the peak.
    """
    name = Path(path).name
    angle, pressure, found = _points(path, name, unit)
    pressure = _absolute(pressure, found, name)
    if dead_centre_deg is not None and not math.isfinite(dead_centre_deg):
        raise InputError(f"{name}: dead centre at {dead_centre_deg} deg is not an angle")
    centre = _dead_centre(angle, pressure, name) if dead_centre_deg is None else dead_centre_deg
    angle, pressure, conflict = _one_cycle(angle - centre, pressure, name)
    noise = _noise(angle, pressure)
    smooth = _smooth(angle, pressure, noise)
    for doubt in _doubts(angle, pressure, noise, smooth, conflict):
        warnings.warn(f"{name}: {doubt}", stacklevel=3)
    if smooth.min() <= 0.0:
        raise InputError(f"{name}: smoothing gives a pressure below zero; the points scatter by {noise:.3g} Pa")
    source = (
        f"{name}: {angle.size} points in {found.how}, firing dead centre at {centre:g} deg of the file, "
        f"noise {1e-5 * noise:.2g} bar"
    )
    return np.ascontiguousarray(smooth[:: _FINE // n]), source


def _points(path: str | Path, name: str, unit: str | None) -> tuple[Array, Array, PressureUnit]:
    """Angles (deg), pressures as written, and their unit."""
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
        if len(values) != 2:
            raise InputError(f"{name}: line {number}: {len(values)} columns; give two, angle in degrees and pressure")
        if not all(abs(value) <= LARGEST for value in values):
            raise InputError(f"{name}: line {number}: {shown(text)} holds a value that is not finite; remove the line")
        rows.append([*values, number])
    if not rows:
        raise InputError(f"{name}: no points; give lines of angle in degrees and pressure")
    found = _stated(header, unit, name)
    data = np.array(rows)
    if found is None or found.zero == 0.0:
        for _, value, number in data[data[:, 1] < 0.0][:1]:
            raise InputError(
                f"{name}: line {number:.0f}: pressure {value:g} is negative; absolute pressure is wanted, or a gauge "
                "unit such as barg"
            )
    if len(rows) < 20:
        raise InputError(f"{name}: {len(rows)} points are too few for a cycle; give at least 20")
    return data[:, 0], data[:, 1], found or unit_of_size(float(data[:, 1].max()), name)


def _stated(header: list[list[str]], unit: str | None, name: str) -> PressureUnit | None:
    """The unit that option or header state, if they do."""
    if any("rad" in re.findall(r"[a-z]+", cell.lower()) for cells in header for cell in cells):
        raise InputError(f"{name}: the header says rad; angles are wanted in degrees")
    if unit is not None:
        return named_unit(unit)
    units = [found for cells in header if (found := header_unit(cells, name)) is not None]
    return units[-1]._replace(how=f"{units[-1].how} by the header") if units else None


def _absolute(pressure: Array, unit: PressureUnit, name: str) -> Array:
    """Pressures in Pa; refuses values that no engine has."""
    absolute = pressure * unit.scale + unit.zero
    peak = float(absolute.max())
    if not 0.1 * LOWEST_PEAK <= peak <= 2.0 * HIGHEST_PEAK:
        raise InputError(
            f"{name}: a peak of {pressure.max():g} {unit.name} is no cylinder pressure of an engine (0.3 to 60 MPa); "
            "state another unit"
        )
    if absolute.min() < 0.0:
        raise InputError(f"{name}: {pressure.min():g} {unit.name} is less than nothing; state another unit")
    return np.asarray(absolute)


def _dead_centre(angle: Array, pressure: Array, name: str) -> float:
    """Angle of the file that is firing dead centre: the multiple of 360 degrees next to the peak."""
    peak = float(angle[pressure.argmax()])
    centre = 360.0 * round(peak / 360.0)
    if abs(peak - centre) > 60.0:
        raise InputError(
            f"{name}: the peak lies at {peak:g} deg, not within 60 deg of 0 or 360; say where firing dead centre is"
        )
    return centre


def _one_cycle(angle: Array, pressure: Array, name: str) -> tuple[Array, Array, tuple[float, float]]:
    """Points folded into [0, 720), ordered, those within a quarter degree averaged; refuse what leaves a cycle open.

    Also the largest range (Pa) of points that were averaged, and its angle.
    """
    folded = angle % PERIOD
    cell = np.floor(folded * (_FINE / PERIOD)).astype(int) % _FINE
    order = np.argsort(cell, kind="stable")
    _, start, count = np.unique(cell[order], return_index=True, return_counts=True)
    x = np.add.reduceat(folded[order], start) / count
    y = np.add.reduceat(pressure[order], start) / count
    spread = np.maximum.reduceat(pressure[order], start) - np.minimum.reduceat(pressure[order], start)
    gaps = np.diff(np.append(x, x[0] + PERIOD))
    if gaps.max() > WIDEST_GAP:
        at = int(gaps.argmax())
        raise InputError(
            f"{name}: no points over {gaps[at]:.0f} deg after {x[at]:.0f} deg past firing dead centre; "
            f"a whole cycle of 720 deg is wanted, with gaps of {WIDEST_GAP:.0f} deg at most"
        )
    widest = int(spread.argmax())
    return x, y, (float(spread[widest]), float(x[widest]))


def _doubts(x: Array, y: Array, noise: float, smooth: Array, conflict: tuple[float, float]) -> Iterator[str]:
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
    far = np.abs((grid - at + 0.5 * PERIOD) % PERIOD - 0.5 * PERIOD) > APART
    if smooth[far].max() > SECOND_PEAK * peak and peak >= LEAST_RATIO * smooth.min():
        second = grid[far][smooth[far].argmax()]
        yield (
            f"two peaks of {1e-5 * peak:.3g} and {1e-5 * smooth[far].max():.3g} bar, at {at:.4g} and {second:.4g} deg "
            "past firing dead centre; a cycle has one"
        )
    ends, starts = np.append(x[1:], x[0] + PERIOD), x
    highest = x[y.argmax()]
    for first, last in zip(starts, ends, strict=True):
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
