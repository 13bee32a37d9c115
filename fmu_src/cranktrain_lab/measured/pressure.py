"""Cycles of measured cylinder pressures, with mean and scatter, from encoder-triggered or time-sampled channels.

A cycle goes from −360 to 360 degrees around firing dead centre of its cylinder (two-strokes: −180 to 180). Time-sampled
channels are resampled at equal steps of the measured rotation, torsion included. The zero of each cycle (drift of a
charge amplifier) follows from the shape of the fitted compression (:mod:`.compression`), from two points of a
polytropic change, or from the intake pressure.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.core.units import RPM, unit_factor
from cranktrain_lab.measured.channels import Channel
from cranktrain_lab.measured.compression import (
    BAND,
    FIRST_OF_TWO_STROKES_DEG,
    Compression,
    fit_compression,
    two_point_zero,
)
from cranktrain_lab.measured.cycles import BLOCK, CycleRows, Cycles, period
from cranktrain_lab.measured.cylinder import Cylinder
from cranktrain_lab.measured.rotation import Rotation

STEP_DEG = 0.5
MODEL, POLYTROPIC, INTAKE, KEPT = "compression", "polytropic", "intake", "keep"
PEGGING = (MODEL, POLYTROPIC, INTAKE, KEPT)
PEG_RANGE = (-110.0, -50.0)
"""Range of crank angles, deg, in which the pressure zero of a single cycle is fitted."""
INTAKE_RANGE = (-190.0, -170.0)
"""Range of angles, deg, in which the cylinder has intake pressure."""
RESONANCE_FROM = 1500.0
"""Lowest frequency, Hz, in the search for oscillations of the indicating channel and the chamber."""
SPEED_OF_SOUND = 900.0, 450.0
"""Speed of sound in burning gas and in the gas of an indicating channel, m/s, for the chamber's frequency and the
channel's length.
"""
EXACT = math.radians(0.1)
"""Half width of the dead centre's 95 % confidence interval above which a remark reports the interval."""
UNUSUAL = 2e4, 3e7
"""Limits of the difference between highest and lowest pressure, Pa; other values indicate a wrong unit."""


def pascal(channel: Channel, unit: str = "") -> tuple[float, float]:
    """Return factor and offset (Pa) of a channel's unit; raises ``InputError`` if it is not a unit of pressure."""
    stated = unit or channel.unit
    if not stated:
        raise InputError(f"{channel.where}: states no unit; give one, e.g. bar")
    try:
        scale, zero, _ = unit_factor(stated, "pressure")
    except InputError as error:
        raise InputError(f"{channel.where}: {error}") from None
    return float(scale), float(zero)


def cycles_by_encoder(
    channel: Channel, samples: int, first_deg: float, speed: float, *, cycle: float = 4.0 * math.pi, unit: str = ""
) -> Cycles:
    """Return cycles of an encoder-triggered channel, with samples at equal crank angles.

    Parameters
    ----------
    samples : number of samples per cycle
    first_deg : crank angle of the first sample after the cylinder's firing dead centre
    speed : speed, rad/s
    cycle : angle of a cycle, rad
    """
    scale, zero = pascal(channel, unit)
    step = cycle / samples
    lead = -0.5 * cycle - math.radians(first_deg)
    skip = round((lead % cycle) / step) % samples
    # Dead centre may lie between samples.
    rest = lead + (0.0 if lead >= 0 else cycle * math.ceil(-lead / cycle)) - skip * step
    count = (channel.size - skip) // samples
    if count < 1:
        raise InputError(
            f"{channel.where}: {channel.size} samples hold no whole cycle of {samples} from "
            f"{math.degrees(-0.5 * cycle):g} deg on"
        )

    def read(first: int, last: int) -> Array:
        values = channel.values(skip + first * samples, skip + last * samples)
        return np.asarray((values * scale + zero).reshape(-1, samples))

    angle = -0.5 * cycle + step * np.arange(samples, dtype=np.float64) - rest
    values, remarks = _whole(CycleRows(count, samples, read), channel)
    made = Cycles(channel.name, angle, values, speed, samples * speed / cycle, np.zeros(len(values)), tuple(remarks))
    return _checked(made, channel)


def cycles_by_rotation(
    channel: Channel, rotation: Rotation, *, firing: float = 0.0, cycle: float = 4.0 * math.pi, unit: str = ""
) -> Cycles:
    """Return cycles of a channel sampled over time, resampled at equal steps of the measured rotation.

    ``firing``: crank angle, rad, of the cylinder's firing dead centre after that of cylinder 1. If the rotation does
    not show which of two revolutions fires, the one with the higher pressure is used.
    """
    scale, zero = pascal(channel, unit)
    if not math.isfinite(channel.rate):
        raise InputError(f"{channel.where}: its samples have no even step in time")
    count = round(math.degrees(cycle) / STEP_DEG)
    low = max(rotation.angle[0], float(np.interp(channel.start, rotation.times, rotation.angle)))
    high = min(rotation.angle[-1], float(np.interp(channel.start + channel.duration, rotation.times, rotation.angle)))
    begin = math.ceil((low - firing + 0.5 * cycle) / cycle) * cycle + firing - 0.5 * cycle
    cycles = math.floor((high - begin) / cycle)
    if cycles < 1:
        raise InputError(
            f"{channel.where}: {max(0.0, high - low) / cycle:.2g} cycles lie within the rotation; one is needed"
        )
    relative = cycle / count * np.arange(count, dtype=np.float64)

    def sampled() -> Iterator[Array]:
        step = max(1, BLOCK // count)
        for first in range(0, cycles, step):
            begins = begin + cycle * np.arange(first, min(first + step, cycles))
            times = (np.interp(one + relative, rotation.angle, rotation.times) for one in begins)
            yield np.array([_sampled_at(channel, own) for own in times]) * scale + zero

    values, remarks = _whole(CycleRows.kept(sampled()), channel)
    speed = cycles * cycle / float(np.ptp(np.interp([begin, begin + cycles * cycle], rotation.angle, rotation.times)))
    made = Cycles(
        channel.name, relative - 0.5 * cycle, values, speed, channel.rate, np.zeros(len(values)), tuple(remarks)
    )
    if period(made.angle) > 3.0 * math.pi and abs(made.angle[int(np.argmax(made.mean))]) >= math.pi:
        # The peak lies in the other revolution.
        turned = made.pressure.mapped(lambda _, rows: np.roll(rows, made.angle.size // 2, axis=1))
        return _checked(replace(made, pressure=turned), channel)
    return _checked(made, channel)


def _sampled_at(channel: Channel, times: Array) -> Array:
    """Return values at times, as means over the spacing if samples are denser, else by a cubic through samples."""
    from scipy.interpolate import CubicSpline

    place = (times - channel.start) / channel.step
    first, last = max(0, math.floor(place[0]) - 4), min(channel.size, math.ceil(place[-1]) + 5)
    values = channel.values(first, last)
    spacing = (place[-1] - place[0]) / (place.size - 1)
    if spacing > 2.0:
        total = np.concatenate(([0.0], np.cumsum(values)))
        edges = np.arange(total.size) - 0.5
        high, low = (np.interp(place - first + side * 0.5 * spacing, edges, total) for side in (1, -1))
        return np.asarray((high - low) / spacing)
    return np.asarray(CubicSpline(np.arange(values.size), values)(place - first))


def _whole(rows: CycleRows, channel: Channel) -> tuple[CycleRows, list[str]]:
    """Remove cycles with missing values; raises ``InputError`` if no cycle remains."""
    good = rows.each(lambda block: np.asarray(np.isfinite(block).all(axis=1)))
    if not good.any():
        raise InputError(f"{channel.where}: every cycle has values that are not numbers")
    lost = int(np.count_nonzero(~good))
    told = [f"{channel.where}: {lost} of {len(rows)} cycles have missing values and are left out"]
    return rows.chosen(np.flatnonzero(good)) if lost else rows, told * bool(lost)


def _checked(cycles: Cycles, channel: Channel) -> Cycles:
    """Raise ``InputError`` for pressures that are impossible in an engine."""
    swing = float(np.ptp(cycles.mean))
    if not UNUSUAL[0] < swing < UNUSUAL[1]:
        raise InputError(
            f"{channel.where}: its pressure swings by {1e-5 * swing:.3g} bar over a cycle; check its unit "
            f"({channel.unit or 'none stated'})"
        )
    return cycles


def pegged(
    cycles: Cycles,
    cylinder: Cylinder,
    *,
    method: str = MODEL,
    exponent: float = 1.34,
    intake_pressure: float | None = None,
    intake_temperature: float = 310.0,
    wall_temperature: float = 430.0,
    correct_shift: bool = False,
) -> tuple[Cycles, Compression | None]:
    """Return cycles with true zeros, and the compression fit of their mean (None if not needed and it fails).

    Raises ``InputError`` for an unknown method, a missing intake pressure for ``intake``, or another engine's data.

    Parameters
    ----------
    method : ``compression`` (first law), ``polytropic`` (two points), ``intake`` or ``keep``
    correct_shift : True to shift the cycles by the fitted shift of dead centre
    """
    if method not in PEGGING:
        raise InputError(f"pegging '{method}' does not exist; valid: {', '.join(PEGGING)}")
    if method == INTAKE and intake_pressure is None:
        raise InputError("pegging by the intake needs its pressure; give it, absolute")
    # Standard deviation of a value of the mean cycle, Pa, from third differences in the compression.
    inside = (cycles.angle >= math.radians(-115.0)) & (cycles.angle <= math.radians(-30.0))
    third = np.diff(cycles.mean[inside], 3)
    noise = float(np.std(third) / math.sqrt(20.0)) if third.size else 0.0
    try:
        fit = fit_compression(
            cycles.angle,
            cycles.mean,
            cylinder,
            cycles.speed,
            intake_temperature=intake_temperature,
            wall_temperature=wall_temperature,
            noise=noise,
        )
    except InputError:
        if method == MODEL:
            raise
        fit = None
    if fit is not None and fit.doubt:
        cycles = replace(cycles, remarks=(*cycles.remarks, f"{cycles.name}: {fit.doubt}"))
    if fit is not None and BAND * fit.shift_error > EXACT:
        flanks = "both flanks tell" if fit.motored else "the compression of a fired trace alone tells"
        told = (
            f"{cycles.name}: {flanks} the dead centre within {math.degrees(BAND * fit.shift_error):.2g} deg and the "
            f"zero within {1e-2 * BAND * fit.zero_error:.2g} mbar (95 %)"
        )
        cycles = replace(
            cycles, remarks=(*cycles.remarks, told + ("" if fit.motored else "; a motored trace tells more"))
        )
    if fit is not None and correct_shift:
        cycles = cycles.turned(fit.shift)
    if method == KEPT:
        return cycles, fit
    if method == MODEL and fit is not None:
        zeros = fit.zero + _relative_zeros(cycles)
    elif method == POLYTROPIC:
        zeros = cycles.pressure.each(
            lambda rows: np.array([two_point_zero(cycles.angle, row, cylinder, exponent) for row in rows])
        )
    else:
        near = (cycles.angle >= math.radians(INTAKE_RANGE[0])) & (cycles.angle <= math.radians(INTAKE_RANGE[1]))
        zeros = float(intake_pressure or 0.0) - cycles.pressure.each(lambda rows: rows[:, near].mean(axis=1))
    lifted = cycles.pressure.mapped(lambda first, rows: rows + zeros[first : first + len(rows), None])
    return replace(cycles, pressure=lifted, zeros=zeros), fit


def _relative_zeros(cycles: Cycles) -> Array:
    """Return each cycle's pressure zero relative to the mean cycle, by fitting the scaled mean compression to it."""
    first = PEG_RANGE[0] if period(cycles.angle) > 3.0 * math.pi else FIRST_OF_TWO_STROKES_DEG
    inside = (cycles.angle >= math.radians(first)) & (cycles.angle <= math.radians(PEG_RANGE[1]))
    shape = cycles.mean[inside]
    # Charge varies little, so the scale has a prior of 1 ± 1 %, which keeps noise from exchanging scale and zero.
    off = cycles.pressure.each(lambda rows: (rows[:, inside] - shape).mean(axis=1))
    square = cycles.pressure.each(lambda rows: ((rows[:, inside] - shape) ** 2).mean(axis=1))
    noise = max(math.sqrt(max(0.0, float(square.mean() - off.mean() ** 2))), 1.0)
    basis = np.column_stack([np.ones(shape.size), shape - shape.min()]) / noise
    stacked = np.vstack([basis, np.array([[0.0, 1.0 / 0.01]])])

    def zeros(rows: Array) -> Array:
        right = np.vstack([((rows[:, inside] - shape) / noise).T, np.zeros((1, len(rows)))])
        return np.asarray(-np.linalg.lstsq(stacked, right, rcond=None)[0][0])

    return cycles.pressure.each(zeros)


def resonance(cycles: Cycles, cylinder: Cylinder) -> dict[str, float] | None:
    """Return frequency, amplitude and likely length of the expansion's strongest oscillation above 1.5 kHz, or None.

    ``chamber_hz`` is the first circumferential mode of the chamber, 1.84 c/(π B), ``channel_m`` the length of a channel
    whose quarter wave has the frequency.
    """
    step = float(cycles.angle[1] - cycles.angle[0]) / cycles.speed
    inside = (cycles.angle > math.radians(5.0)) & (cycles.angle < math.radians(100.0))
    size = int(np.count_nonzero(inside))
    if size < 64 or 0.5 / step < 1.5 * RESONANCE_FROM:
        return None
    smooth, window = _smooth(cycles.mean[inside], step), np.hanning(size)
    power = np.zeros(size // 2 + 1)
    for _, rows in cycles.pressure.blocks():
        power += (np.abs(np.fft.rfft((rows[:, inside] - smooth) * window, axis=1)) ** 2).sum(axis=0)
    power /= len(cycles.pressure)
    hz = np.fft.rfftfreq(size, step)
    high = hz >= RESONANCE_FROM
    if np.count_nonzero(high) < 8:
        return None
    k = int(np.argmax(np.where(high, power, 0.0)))
    floor = float(np.median(power[high]))
    amplitude = 2.0 * math.sqrt(float(power[max(0, k - 1) : k + 2].sum()) / float(np.sum(window**2)) / size)
    if power[k] < 20.0 * floor or amplitude < 0.002 * float(np.ptp(cycles.mean)):
        return None
    return {
        "hz": float(hz[k]),
        "amplitude": amplitude,
        "chamber_hz": 1.841 * SPEED_OF_SOUND[0] / (math.pi * cylinder.bore),
        "channel_m": SPEED_OF_SOUND[1] / (4.0 * float(hz[k])),
    }


def _smooth(values: Array, step: float) -> Array:
    """Apply a moving average over a period of the lowest frequency of interest, twice."""
    wide = max(3, round(1.0 / (RESONANCE_FROM * step)) | 1)
    for _ in range(2):
        values = np.convolve(
            np.pad(values, wide // 2, mode="reflect", reflect_type="odd"), np.ones(wide) / wide, mode="valid"
        )
    return values


def statistics(cycles: Cycles, cylinder: Cylinder, fit: Compression | None) -> dict[str, Any]:
    """Summarise cycles for tables and JSON: peaks, work, scatter, zeros, dead centre."""
    volume, derivative = cylinder.volume(cycles.angle)
    step = float(cycles.angle[1] - cycles.angle[0])
    scale = step / float(np.ptp(volume))
    work = cycles.pressure.each(lambda rows: rows @ derivative * scale)
    peaks = cycles.pressure.each(lambda rows: rows.max(axis=1))
    places = np.degrees(cycles.pressure.each(lambda rows: cycles.angle[rows.argmax(axis=1)]))
    count = cycles.zeros.size
    drift = float(np.polyfit(np.arange(count), cycles.zeros, 1)[0]) if count > 2 else 0.0
    found = resonance(cycles, cylinder)
    told: dict[str, Any] = {
        "channel": cycles.name,
        "cycles": len(cycles.pressure),
        "speed_rpm": cycles.speed / RPM,
        "peak_bar": 1e-5 * float(peaks.mean()),
        "peak_scatter_bar": 1e-5 * _deviation(peaks),
        "peak_deg": float(places.mean()),
        "peak_deg_scatter": _deviation(places),
        "imep_bar": 1e-5 * float(work.mean()),
        "imep_cov_percent": 100.0 * _deviation(work) / abs(float(work.mean())) if work.mean() else None,
        "zero_bar": 1e-5 * float(cycles.zeros.mean()),
        "zero_scatter_bar": 1e-5 * _deviation(cycles.zeros),
        "zero_drift_bar_per_cycle": 1e-5 * drift,
        "resonance": found,
        "remarks": list(cycles.remarks),
    }
    if fit is not None:
        told |= {
            "motored": fit.motored,
            "dead_centre_shift_deg": math.degrees(fit.shift),
            "dead_centre_error_deg": math.degrees(fit.shift_error),
            "dead_centre_interval_deg": [math.degrees(one) for one in fit.shift_interval],
            "zero_error_bar": 1e-5 * fit.zero_error,
            "zero_interval_bar": [
                1e-5 * (float(cycles.zeros.mean()) + side * BAND * fit.zero_error) for side in (-1, 1)
            ],
            "loss_angle_deg": math.degrees(fit.loss),
            "polytropic_exponent": fit.exponent,
            "heat_factor": fit.heat,
        }
    return told


def _deviation(values: Array) -> float:
    return float(np.std(values, ddof=1)) if values.size > 1 else 0.0
