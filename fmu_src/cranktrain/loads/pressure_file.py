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
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from cranktrain.core.errors import InputError, nearest

Array = NDArray[np.float64]

UNITS = {"Pa": 1.0, "kPa": 1e3, "bar": 1e5, "MPa": 1e6}
_SPELT = {unit.lower(): unit for unit in UNITS}
# Peaks of engines: the ranges of the units do not overlap, so the size of a peak tells the unit.
LOWEST_PEAK, HIGHEST_PEAK = 3e6, 3e7
WIDEST_GAP = 40.0
PERIOD = 720.0
_FINE = 2880


def read_pressure(
    path: str | Path, unit: str | None, dead_centre_deg: float | None, n: int
) -> tuple[NDArray[np.float64], str]:
    """Absolute pressure at ``n`` uniform crank angles after firing dead centre, Pa, and a line that says how it came.

    Parameters
    ----------
    path : file with one point per line; ``;``, ``,``, tab or blanks between; a header may name the pressure's unit
    unit : Pa, kPa, bar or MPa; None takes it from the header or the size of the peak
    dead_centre_deg : angle of the file that is firing dead centre; None takes 0 or 360, whichever is within 60 degrees
        of the peak
    n : number of samples; divides 2880

    Raises
    ------
    InputError
        one line with file and row: not readable, empty, NaN, negative, too short, wrong unit, dead centre not found
    """
    name = Path(path).name
    angle, pressure, header = _points(Path(path), name)
    scale, stated = _scale(pressure, header, unit, name)
    pressure = pressure * scale
    if dead_centre_deg is not None and not math.isfinite(dead_centre_deg):
        raise InputError(f"{name}: dead centre at {dead_centre_deg} deg is not an angle")
    centre = _dead_centre(angle, pressure, name) if dead_centre_deg is None else dead_centre_deg
    angle, pressure = _one_cycle(angle - centre, pressure, name)
    noise = _noise(angle, pressure)
    smooth = _smooth(angle, pressure, noise)
    if smooth.min() <= 0.0:
        raise InputError(f"{name}: smoothing gives a pressure below zero; the points scatter by {noise:.3g} Pa")
    source = (
        f"{name}: {angle.size} points in {stated}, firing dead centre at {centre:g} deg of the file, "
        f"noise {1e-5 * noise:.2g} bar"
    )
    return np.ascontiguousarray(smooth[:: _FINE // n]), source


def _points(path: Path, name: str) -> tuple[Array, Array, str]:
    """Angles (deg), pressures as written, and the header's text."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except FileNotFoundError:
        raise InputError(f"{path}: no such pressure file; give a text file of angle in degrees and pressure") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as text ({type(error).__name__})") from None
    rows: list[list[float]] = []
    header = ""
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
            if rows or header:
                raise InputError(f"{name}: line {number}: '{text[:40]}' is not two numbers") from None
            header = text
            continue
        if len(values) != 2:
            raise InputError(f"{name}: line {number}: {len(values)} columns; give two, angle in degrees and pressure")
        if not all(map(math.isfinite, values)):
            raise InputError(f"{name}: line {number}: '{text[:40]}' holds a value that is not finite; remove the line")
        if values[1] < 0.0:
            raise InputError(f"{name}: line {number}: pressure {values[1]:g} is negative; absolute pressure is wanted")
        rows.append(values)
    if not rows:
        raise InputError(f"{name}: no points; give lines of angle in degrees and pressure")
    if len(rows) < 20:
        raise InputError(f"{name}: {len(rows)} points are too few for a cycle; give at least 20")
    data = np.array(rows)
    return data[:, 0], data[:, 1], header


def _scale(pressure: Array, header: str, unit: str | None, name: str) -> tuple[float, str]:
    """Factor to Pa, and the unit with the way it was found."""
    words = re.findall(r"[a-z]+", header.lower())
    if "rad" in words:
        raise InputError(f"{name}: the header says rad; angles are wanted in degrees")
    peak = float(pressure.max())
    if unit is not None:
        if unit.lower() not in _SPELT:
            raise InputError(f"unknown pressure unit '{unit}': {nearest(unit, UNITS)}")
        found = how = _SPELT[unit.lower()]
    elif named := [_SPELT[word] for word in words if word in _SPELT]:
        found, how = named[-1], f"{named[-1]} by the header"
    else:
        fits = [key for key, factor in UNITS.items() if LOWEST_PEAK <= peak * factor < HIGHEST_PEAK]
        if not fits:
            raise InputError(f"{name}: no unit is stated and a peak of {peak:g} fits none; state Pa, kPa, bar or MPa")
        found, how = fits[0], f"{fits[0]} (not stated; the only unit that fits a peak of {peak:.4g})"
    scale = UNITS[found]
    if not 0.1 * LOWEST_PEAK <= peak * scale <= 2.0 * HIGHEST_PEAK:
        raise InputError(
            f"{name}: a peak of {peak:g} {found} is no cylinder pressure of an engine (0.3 to 60 MPa); "
            "state another unit"
        )
    return scale, how


def _dead_centre(angle: Array, pressure: Array, name: str) -> float:
    """Angle of the file that is firing dead centre: the multiple of 360 degrees next to the peak."""
    peak = float(angle[pressure.argmax()])
    centre = 360.0 * round(peak / 360.0)
    if abs(peak - centre) > 60.0:
        raise InputError(
            f"{name}: the peak lies at {peak:g} deg, not within 60 deg of 0 or 360; say where firing dead centre is"
        )
    return centre


def _one_cycle(angle: Array, pressure: Array, name: str) -> tuple[Array, Array]:
    """Points folded into [0, 720), ordered, those within a quarter degree averaged; refuse what leaves a cycle open."""
    folded = angle % PERIOD
    cell = np.floor(folded * (_FINE / PERIOD)).astype(int) % _FINE
    order = np.argsort(cell, kind="stable")
    _, start, count = np.unique(cell[order], return_index=True, return_counts=True)
    x = np.add.reduceat(folded[order], start) / count
    y = np.add.reduceat(pressure[order], start) / count
    gaps = np.diff(np.append(x, x[0] + PERIOD))
    if gaps.max() > WIDEST_GAP:
        at = int(gaps.argmax())
        raise InputError(
            f"{name}: no points over {gaps[at]:.0f} deg after {x[at]:.0f} deg past firing dead centre; "
            f"a whole cycle of 720 deg is wanted, with gaps of {WIDEST_GAP:.0f} deg at most"
        )
    return x, y


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
    """Periodic smoothing spline of the points at 2880 uniform angles that misses them by ``noise`` (RMS) at most."""
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
