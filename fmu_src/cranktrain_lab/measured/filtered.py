"""Orders over speed by the Vold–Kalman filter, for orders that beat or cross a resonance within a few cycles.

Signals are sampled at uniform time steps: channels as they are, torsional vibration by a cubic through the pulses. Long
recordings are filtered in pieces that overlap by a few decay times of the filter. Envelopes are averaged in bins of the
mean speed; half a decay time at either end of a recording is left out.
"""

import math

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain_lab.measured.channels import Channel, decimated
from cranktrain_lab.measured.rotation import Rotation
from cranktrain_lab.measured.tracking import ComplexArray, Orders, Points, check_orders

OVERLAP, END = 3.0, 1.0
"""Overlap of filtered pieces, and length omitted at each end, as multiples of one over the bandwidth."""
SAMPLES = 6.0
"""Number of samples per period of the highest order."""


def filtered_orders(
    source: Rotation | Channel, turning: Rotation, orders: Array, bandwidth: float, step_rpm: float = 0.0
) -> Orders:
    """Return orders of a rotation's torsion or of a channel; ``InputError`` as :func:`.tracking.track`.

    Parameters
    ----------
    source : rotation, whose torsional vibration is used, or channel
    turning : rotation with the mean rotation
    bandwidth : bandwidth of the envelopes, Hz
    step_rpm : width of a bin, rev/min; a 40th of the speed range by default
    """
    wanted = np.atleast_1d(np.asarray(orders, dtype=np.float64))
    fastest = turning.speed_range[1] / math.tau
    rate = SAMPLES * float(wanted.max()) * fastest
    if isinstance(source, Rotation):
        times, values, step = _torsion(source, rate)
        resolved, name, unit = 0.5 * source.wheel.pulses, f"{source.name} torsion", "rad"
    else:
        start, step, values = decimated(source, rate)
        times = start + step * np.arange(values.size, dtype=np.float64)
        resolved, name, unit = 0.4 / (step * fastest), source.name, source.unit
    inside = (times >= turning.mean.times[0]) & (times <= turning.mean.times[-1])
    times, values = times[inside], values[inside]
    phase = turning.mean.at(times) if times.size else times
    check_orders(wanted, Points(phase, values, resolved, name, unit))
    if times.size < 32 or np.ptp(times) < 4.0 / bandwidth:
        raise InputError(
            f"{name}: {np.ptp(times) if times.size else 0.0:.3g} s are too short for a bandwidth of {bandwidth:g} Hz, "
            f"which needs {4.0 / bandwidth:.3g} s"
        )
    found = _in_pieces(phase, values - np.mean(values), step, wanted, bandwidth)
    return _binned(found, times, turning, (wanted, bandwidth, step_rpm), (name, unit))


def _torsion(place: Rotation, rate: float) -> tuple[Array, Array, float]:
    """Return the torsional vibration, resampled at about ``rate`` (Hz), with its times and time step."""
    from scipy.interpolate import CubicSpline

    count = max(8, math.ceil(float(np.ptp(place.times)) * rate))
    times = np.linspace(place.times[0], place.times[-1], count)
    return times, np.asarray(CubicSpline(place.times, place.torsion)(times)), float(times[1] - times[0])


def _in_pieces(phase: Array, values: Array, step: float, orders: Array, bandwidth: float) -> ComplexArray:
    """Return envelopes (t, o) of o orders at t times, filtered in pieces that are joined in mid-overlap."""
    a_sample = (2 * orders.size * POLES + 1) * 2 * orders.size
    overlap = math.ceil(OVERLAP / bandwidth / step)
    length = max(4 * overlap, MOST_UNKNOWNS // 4 // a_sample)
    parts, first = [], 0
    while first < values.size:
        last = min(values.size, first + length)
        if values.size - last < 2 * overlap:
            last = values.size
        low, high = max(0, first - overlap), min(values.size, last + overlap)
        found = envelopes(phase[low:high], values[low:high], step, orders, bandwidth)
        parts.append(found[first - low : last - low])
        first = last
    return np.concatenate(parts)


def _binned(
    found: ComplexArray, times: Array, turning: Rotation, asked: tuple[Array, float, float], words: tuple[str, str]
) -> Orders:
    """Average envelopes in bins of speed. Samples half a decay time apart count as independent."""
    orders, bandwidth, step_rpm = asked
    low, high = turning.speed_range
    width = step_rpm * RPM if step_rpm > 0.0 else max(10.0 * RPM, (high - low) / 40.0)
    keep = (times >= times[0] + END / bandwidth) & (times <= times[-1] - END / bandwidth)
    speeds, kept = turning.mean.speed(times[keep]), found[keep]
    rows = []
    for key in np.unique(np.rint(speeds / width)):
        own = np.rint(speeds / width) == key
        part = kept[own]
        mean, power = part.mean(axis=0), np.mean(np.abs(part) ** 2, axis=0)
        free = max(1.0, 2.0 * bandwidth * np.count_nonzero(own) * float(times[1] - times[0]))
        scatter = np.sqrt(np.maximum(power - np.abs(mean) ** 2, 0.0) / 2.0 / free)
        coherence = np.abs(mean) ** 2 / np.where(power > 0.0, power, 1.0)
        rows.append((float(speeds[own].mean()), mean, scatter, coherence, max(1, round(free))))
    speed, amplitudes, errors, coherence, fits = (np.array([row[k] for row in rows]) for k in range(5))
    return Orders(speed, orders, amplitudes, errors, coherence, fits, 0, *words)


POLES = 2
MOST_UNKNOWNS = 40_000_000
"""Largest number of elements of the band matrix (320 MB)."""


def envelopes(
    phase: Array, values: Array, step: float, orders: Array, bandwidth: float, poles: int = POLES
) -> NDArray[np.complex128]:
    """Return complex envelopes (t, o), zero to peak, of o orders of a signal at t uniform times.

    Raises ``InputError`` for a bandwidth not below a quarter of the sampling rate, orders above the Nyquist frequency,
    or a record too long for the memory.

    Parameters
    ----------
    phase, values : (t,) mean rotation, rad, and the signal without its trend
    step : time step, s
    orders : (o,) any positive numbers
    bandwidth : one-sided bandwidth of an envelope (−3 dB), Hz
    poles : number of poles p, 1 to 4
    """
    n, count = values.size, orders.size
    if not 0.0 < bandwidth < 0.25 / step:
        raise InputError(f"Vold-Kalman: a bandwidth of {bandwidth:g} Hz is not between 0 and {0.25 / step:g} Hz")
    fastest = float(np.diff(phase).max()) / step / math.tau
    if float(orders.max()) * fastest > 0.5 / step:
        raise InputError(
            f"Vold-Kalman: order {orders.max():g} reaches {orders.max() * fastest:.4g} Hz, samples resolve "
            f"{0.5 / step:.4g} Hz (aliasing)"
        )
    width, unknowns = 2 * count, 2 * count * n
    band = width * poles
    if (band + 1) * unknowns > MOST_UNKNOWNS:
        raise InputError(
            f"Vold-Kalman: {n} samples and {count} orders take {8e-9 * (band + 1) * unknowns:.2g} GB; "
            "take fewer orders, a lower rate or a shorter part"
        )
    from scipy.linalg import solveh_banded
    from scipy.sparse import diags

    r2 = 0.5 * (math.sqrt(2.0) - 1.0) / (2.0 - 2.0 * math.cos(math.tau * bandwidth * step)) ** poles
    waves = np.exp(1j * phase[:, None] * orders)
    rows = np.empty((n, width))
    rows[:, 0::2], rows[:, 1::2] = waves.real, -waves.imag
    matrix = np.zeros((band + 1, unknowns))  # lower form: matrix[k, j] = A[j + k, j]
    for k in range(width):
        product = rows[:, k:] * rows[:, : width - k]
        for j in range(width - k):
            matrix[k, j::width] += product[:, j]
    taps = [(-1.0) ** k * math.comb(poles, k) for k in range(poles + 1)]
    rough = diags(taps, range(poles + 1), shape=(n - poles, n))
    for lag in range(poles + 1):
        matrix[lag * width, : (n - lag) * width] += r2 * np.repeat((rough.T @ rough).diagonal(lag), width)
    found = solveh_banded(matrix, (rows * values[:, None]).ravel(), lower=True, overwrite_ab=True, check_finite=False)
    found = found.reshape(n, width)
    return np.asarray(found[:, 0::2] + 1j * found[:, 1::2])
