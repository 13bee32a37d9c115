"""Orders of measured points over the mean rotation, by local fits with confidence.

Points may be unequally spaced, such as pulses of a wheel with a gap, or samples over time. Around each position φ₀

    x(φ) = trend + Re Σ_n (a_n + a_n' τ + a_n'' τ²) exp(i n φ),   τ = φ − φ₀,

is fitted by least squares under a window cos⁴ with all half orders up to the highest one wanted, so neighbouring orders
do not leak into one another at any change of speed. Points are used at their own angles, without interpolation. The
standard error of an order follows from the residual and the fit or, if several fits share a bin of speed, from their
scatter.

Only few orders (lines) are present, and fewer change within a window, but a_n, a_n' and a_n'' of all lines absorb
noise. In the gap of a wheel, where there are no points, absent lines can cancel present ones. Each position is
therefore fitted twice. The first fits, with all coefficients free, give the variance of each coefficient in excess of
its noise among the fits of a bin and its neighbours. The second fits use this variance as prior about zero (empirical
Bayes: C. N. Morris, J. Am. Stat. Assoc. 78 (1983) 47). A line in a resonance thus stays free to change, a constant line
gets the noise of a constant amplitude, and an absent line does not disturb the others. The amplitude of each line comes
from a fit in which this line has no prior, so it is not biased towards zero.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array, ComplexArray
from cranktrain.core.units import RPM
from cranktrain_lab.measured.channels import Channel, decimated, integrated
from cranktrain_lab.measured.rotation import Rotation
from cranktrain_lab.measured.wheel import CYCLE

CYCLES, DEGREE = 4, 2
STEADY = 0.005
"""Relative change of speed below which the amplitudes of a fit are constant."""
TREND = 3
WEIGHT = 0.42
"""Effective number of points in a fit's window, as a fraction of all points in the window."""
SPARE = 1.25
"""Least ratio of the effective number of points to the number of unknowns of a fit."""
SURE = 2.0
"""Excess of an order's squared coefficients over noise, in standard deviations, above which it may vary freely."""
ABSENT = 0.01
"""Prior variance of an order that may be noise, as a fraction of the noise variance."""
DENSEST = 4
"""Largest number of fits per half window, because in fast ramps a peak could lie between two fits."""
POOLED = 8
"""Least number of fits, of a speed bin and its neighbours, from which variances are estimated."""
MOST_CYCLES = 64
MOST_FITS = 48
"""Largest number of fits in a bin of speed, spread over the bin's time."""
BAND = 1.96
"""Half width of a 95 % band in standard errors."""


class Points(NamedTuple):
    """Values (k,) at increasing mean rotations (k,) rad, with the highest resolved order, name and unit."""

    phase: Array
    values: Array
    resolved: float
    name: str
    unit: str


class FitShape(NamedTuple):
    """Shape of a fit: number of cycles, polynomial degree of the amplitudes, and the o fitted half orders."""

    cycles: int
    degree: int
    lines: Array


@dataclass(frozen=True)
class Orders:
    """Tracked orders over speed.

    Attributes
    ----------
    speeds : (s,) rad/s, increasing
    orders : (o,)
    amplitudes : (s, o) complex, zero to peak, x = Re Σ a exp(i n φ); NaN if the points do not resolve the order
    errors : (s, o) standard error of |a|
    coherence : (s, o) |mean a|² / mean |a|² of the fits in a bin; with fewer than three fits the error replaces scatter
    fits : (s,) number of fits in each bin
    cycles : number of cycles of a fit
    name, unit : name and unit of the signal
    """

    speeds: Array
    orders: Array
    amplitudes: ComplexArray
    errors: Array
    coherence: Array
    fits: NDArray[np.int64]
    cycles: int
    name: str
    unit: str

    @property
    def bands(self) -> tuple[Array, Array]:
        """Lower and upper end of the 95 % band of the amplitudes, (s, o) for each of s speeds and o orders."""
        size = np.abs(self.amplitudes)
        return np.maximum(0.0, size - BAND * self.errors), size + BAND * self.errors


def torsion_points(rotation: Rotation) -> Points:
    """Return torsional vibration at the pulses, rad, without half a cycle at either end, where φ is undefined."""
    phase = rotation.phase
    first, last = rotation.mean.inner
    inside = (phase >= first) & (phase <= last)
    phase, torsion = phase[inside], (rotation.angle - phase)[inside]
    rising = np.concatenate(([True], np.diff(phase) > 0.0))
    return Points(phase[rising], torsion[rising], 0.5 * rotation.wheel.pulses, f"{rotation.name} torsion", "rad")


def channel_points(channel: Channel, rotation: Rotation, highest: float, integrals: int = 0) -> Points:
    """Return samples of a channel over the mean rotation, low-passed and thinned to the rate for the highest order.

    ``integrals``: number of integrations over time, 1 for a vibrometer's velocity, 2 for acceleration. Raises
    ``InputError`` for a channel without a sampling rate, for aliasing, or without common time.
    """
    if not math.isfinite(channel.rate):
        raise InputError(f"{channel.where}: its samples have no even step in time; orders need one")
    fastest = rotation.speed_range[1] / math.tau
    needed = 2.0 * highest * fastest
    if channel.rate < 1.25 * needed:
        raise InputError(
            f"{channel.where}: {channel.rate:g} Hz resolve order {0.4 * channel.rate / fastest:.3g} at "
            f"{60 * fastest:.0f} rev/min, not {highest:g} (aliasing)"
        )
    # Integration needs some 25 samples per period, the fit 5.
    start, step, values = decimated(channel, (12.5 if integrals else 2.5) * needed)
    if integrals:
        values = integrated(values, step, integrals)
    times = start + step * np.arange(values.size, dtype=np.float64)
    inside = (times >= rotation.mean.times[0]) & (times <= rotation.mean.times[-1])
    if np.count_nonzero(inside) < 32:
        raise InputError(
            f"{channel.where}: runs from {times[0]:.4g} to {times[-1]:.4g} s, the rotation from "
            f"{rotation.mean.times[0]:.4g} to {rotation.mean.times[-1]:.4g} s; take channels of one recording"
        )
    phase = rotation.mean.at(times[inside])
    return Points(phase, values[inside], 0.4 / (step * fastest), channel.name, channel.unit)


def track(
    points: Points,
    rotation: Rotation,
    orders: Array,
    *,
    step_rpm: float = 0.0,
    cycles: int | None = None,
    degree: int | None = None,
) -> Orders:
    """Track orders of points in bins of the mean speed.

    Raises ``InputError`` for orders that are not multiples of 0.5 or not resolved, or for too short recordings.

    Parameters
    ----------
    orders : (o,) wanted orders
    step_rpm : width of a bin, rev/min; by default a 40th of the speed range, 10 rev/min at least
    cycles : number of cycles of a fit; by default as many as needed, 4 or more
    degree : degree of the polynomial of an amplitude within a fit; by default 0 if the speed changes by less than 0.5 %
    """
    wanted = np.atleast_1d(np.asarray(orders, dtype=np.float64))
    check_orders(wanted, points)
    cycles, degree, lines = fit_shape(points, rotation, wanted, cycles, degree)
    low, high = rotation.speed_range
    width = step_rpm * RPM if step_rpm > 0.0 else max(10.0 * RPM, (high - low) / 40.0)
    places = _places(points, cycles)
    dense = min(DENSEST, math.ceil((high - low) / width / places.size))
    places = _places(points, cycles, dense)
    # Mean speed, (n,) rad/s, at these mean rotations.
    times = np.interp(places, rotation.mean.angle, rotation.mean.times)
    reach = CYCLE / 2
    before = np.interp(places - reach, rotation.mean.angle, rotation.mean.times)
    after = np.interp(places + reach, rotation.mean.angle, rotation.mean.times)
    inside = (places - reach >= rotation.mean.angle[0]) & (places + reach <= rotation.mean.angle[-1])
    speeds = np.where(inside, 2.0 * reach / np.maximum(after - before, 1e-300), rotation.mean.speed(times))
    bins = np.rint(speeds / width).astype(np.int64)
    members = []
    for key in np.unique(bins):
        own = np.flatnonzero(bins == key)
        members.append(own[np.unique(np.linspace(0, own.size - 1, min(own.size, MOST_FITS)).astype(int))])
    shape = FitShape(cycles, degree, lines)
    fits = [[_fit(points, places[k], shape) for k in own] for own in members]
    fits = [[_fit(points, places[k], shape, held) for k in own] for own, held in zip(members, _held(fits), strict=True)]
    rows = [(float(np.mean(speeds[own])), *_joined(found), own.size) for own, found in zip(members, fits, strict=True)]
    keep = np.rint(2.0 * wanted).astype(int) - 1
    found, errors, coherence = (np.array([row[k] for row in rows])[:, keep] for k in (1, 2, 3))
    return Orders(np.array([row[0] for row in rows]), wanted, found, errors, coherence,
                  np.array([row[4] for row in rows]), cycles, points.name, points.unit)  # fmt: skip


def fit_shape(
    points: Points, rotation: Rotation, wanted: Array, cycles: int | None = None, degree: int | None = None
) -> FitShape:
    """Return the shape of fits that determine the wanted orders; raises ``InputError`` if that is impossible."""
    low, high = rotation.speed_range
    steady = (high - low) / high < STEADY
    degree = (0 if steady else DEGREE) if degree is None else degree
    highest = float(wanted.max())
    reach = math.floor(2.0 * min(highest + 1.0, 0.96 * points.resolved) + 1e-9)
    lines = np.arange(1, max(reach, round(2.0 * highest)) + 1, dtype=np.float64) / 2.0
    a_cycle = points.phase.size / max(1e-9, np.ptp(points.phase)) * CYCLE
    unknowns = TREND + 2 * lines.size * (degree + 1)
    least = max(CYCLES, math.ceil(SPARE * unknowns / (WEIGHT * a_cycle)))
    cycles = least if cycles is None else cycles
    if cycles <= degree:
        raise InputError(
            f"{points.name}: {cycles} cycles do not tell half orders of changing amplitude apart; a fit spans "
            f"{degree + 1} or more while the speed changes"
        )
    if cycles > MOST_CYCLES or WEIGHT * a_cycle * cycles < unknowns:
        raise InputError(
            f"{points.name}: {a_cycle:.3g} points a cycle over {cycles} cycles do not determine orders up to "
            f"{highest:g} ({unknowns} unknowns); ask for lower orders, more cycles or degree 0"
        )
    return FitShape(cycles, degree, lines)


def check_orders(orders: Array, points: Points) -> None:
    """Raise ``InputError`` for orders that are not multiples of 0.5 or not resolved by the points."""
    for order in orders:
        if not (order >= 0.5 and abs(2.0 * order - round(2.0 * order)) < 1e-9):
            raise InputError(f"order {order:g} is not a multiple of 0.5 from 0.5 on")
    if orders.max() > 0.95 * points.resolved:
        raise InputError(
            f"{points.name}: too few points for order {orders.max():g}; they resolve orders up to "
            f"{math.floor(1.9 * points.resolved) / 2:g}"
        )


def _places(points: Points, cycles: int, dense: int = 1) -> Array:
    """Return centres of fits (rad), half a window apart or ``dense`` times closer, over the whole recording."""
    half = 0.5 * cycles * CYCLE
    first, last = points.phase[0] + half, points.phase[-1] - half
    if last < first:
        raise InputError(f"{points.name}: {np.ptp(points.phase) / CYCLE:.2g} cycles are recorded; a fit spans {cycles}")
    count = max(1, math.floor(dense * (last - first) / half))
    return np.asarray(first + (last - first) / count * np.arange(count + 1)) if last > first else np.array([first])


class Fit(NamedTuple):
    """Result of one fit: amplitudes of o orders, (o,), and their standard errors.

    ``squares`` and ``noise`` (degree + 1, o) are mean squares and noise variances of amplitudes and their changes.
    """

    amplitudes: ComplexArray
    errors: Array
    squares: Array
    noise: Array


def _fit(points: Points, place: float, shape: FitShape, held: Array | None = None) -> Fit:
    """Fit all o orders at a position; ``held`` are prior variances (degree + 1, o) of amplitudes and their changes.

    The amplitude of each line comes from a fit in which this line has no prior and the others have.
    """
    cycles, degree, lines = shape
    half = 0.5 * cycles * CYCLE
    first, last = np.searchsorted(points.phase, (place - half, place + half))
    phase, x = points.phase[first:last], points.values[first:last]
    tau = (phase - place) / half
    root = np.cos(0.5 * math.pi * tau) ** 2
    powers = tau[:, None] ** np.arange(TREND)
    base = np.exp(0.5j * phase)
    waves = np.cumprod(np.broadcast_to(base[:, None], (phase.size, lines.size)), axis=1)
    pairs = np.concatenate((waves.real, -waves.imag), axis=1)
    basis = np.concatenate([powers] + [pairs * tau[:, None] ** k for k in range(degree + 1)], axis=1)
    weighted = basis * root[:, None]
    normal = weighted.T @ weighted
    right = weighted.T @ (root * x)
    found, inverse = _solved(normal, right)

    def noise_of(solution: Array, unknowns: float) -> float:
        left = x - basis @ solution
        free = max(1.0, float(np.sum(root**2)) ** 2 / float(np.sum(root**4)) - unknowns * WEIGHT)
        return float(np.sum(root**2 * left**2) / np.sum(root**2)) * max(1.0, phase.size * WEIGHT / free)

    s2 = noise_of(found, basis.shape[1])
    count = lines.size
    freed = np.broadcast_to(np.eye(2), (count, 2, 2))
    if held is not None:
        penalty = np.zeros(basis.shape[1])
        penalty[TREND:] = s2 / np.maximum(np.repeat(held, 2, axis=0).ravel(), 1e-9 * s2 + 1e-300)
        used = normal + np.diag(penalty)
        found, inverse = _solved(used, right)
        # The trace of the hat matrix is the effective number of unknowns.
        s2 = noise_of(found, float(np.sum(inverse * normal)))
        freed = _freed(inverse, penalty[TREND : TREND + count])
    # Weights are a window and not inverse noise variances, so the error of the estimate is s² N⁻¹ (Bᵀ W² B) N⁻¹.
    spread = weighted * root[:, None]
    middle = spread.T @ spread
    rows = inverse[TREND:].copy()
    sizes = found[TREND:].reshape(degree + 1, 2, count).copy()
    own = np.stack((rows[:count], rows[count : 2 * count]), axis=1)
    own = np.einsum("lij,ljk->lik", freed, own)
    rows[:count], rows[count : 2 * count] = own[:, 0], own[:, 1]
    sizes[0] = np.einsum("lij,jl->il", freed, sizes[0])
    variance = (s2 * np.sum((rows @ middle) * rows, axis=1)).reshape(degree + 1, 2, count)
    return Fit(sizes[0, 0] + 1j * sizes[0, 1], np.sqrt(variance[0].mean(axis=0)),
               np.mean(sizes**2, axis=1), np.mean(variance, axis=1))  # fmt: skip


def _freed(inverse: Array, penalty: Array) -> Array:
    """Return matrices that convert each order's amplitude with prior to its amplitude without prior, (o, 2, 2).

    With C a line's 2 x 2 block of the inverse in the fit with priors and p the penalty, C⁻¹ − p is the information of
    the points on this line.
    """
    count = penalty.size
    cosine, sine = TREND + np.arange(count), TREND + count + np.arange(count)
    block = np.empty((count, 2, 2))
    block[:, 0, 0], block[:, 1, 1] = inverse[cosine, cosine], inverse[sine, sine]
    block[:, 0, 1], block[:, 1, 0] = inverse[cosine, sine], inverse[sine, cosine]
    inner = np.linalg.inv(block)
    return np.asarray(np.linalg.solve(inner - penalty[:, None, None] * np.eye(2), inner))


def _held(fits: list[list[Fit]]) -> list[Array]:
    """Return prior variances, without noise, of o amplitudes and their changes in each speed bin, (degree + 1, o).

    If a coefficient may be noise only, an amplitude gets ``ABSENT`` of its noise, and a change gets zero. The larger of
    the values from the bin alone and from the bin with its neighbours is used, so a resonance in one bin stays free.
    """
    squares = [np.sum([one.squares for one in own], axis=0) for own in fits]
    noises = [np.sum([one.noise for one in own], axis=0) for own in fits]
    found = []
    for k in range(len(fits)):
        sizes = []
        for near in (range(k, k + 1), _around(k, fits)):
            count = sum(len(fits[j]) for j in near)
            total, noise = (sum(one[j] for j in near) / count for one in (squares, noises))
            least = np.zeros_like(noise)
            least[0] = ABSENT * noise[0]
            sizes.append(np.where(total > (1.0 + SURE / math.sqrt(count)) * noise, total - noise, least))
        found.append(np.maximum(*sizes))
    return found


def _around(k: int, fits: list[list[Fit]]) -> range:
    """Return the speed bins around bin ``k``, at least the neighbours, that have ``POOLED`` fits together."""
    for reach in range(1, len(fits) + 1):
        near = range(max(0, k - reach), min(len(fits), k + reach + 1))
        if sum(len(fits[j]) for j in near) >= POOLED:
            break
    return near


def _solved(normal: Array, right: Array) -> tuple[Array, Array]:
    """Return solution and inverse of a normal matrix; the pseudo-inverse if it is singular."""
    try:
        inverse = np.linalg.inv(normal)
    except np.linalg.LinAlgError:
        inverse = np.linalg.pinv(normal)
    return np.asarray(inverse @ right), np.asarray(inverse, dtype=np.float64)


def _joined(fits: list[Fit]) -> tuple[ComplexArray, Array, Array]:
    """Return mean, standard error and coherence of the fits in a speed bin; neighbours overlap by half a window."""
    found = np.array([one.amplitudes for one in fits])
    own = np.array([one.errors for one in fits])
    mean = found.mean(axis=0)
    power = np.mean(np.abs(found) ** 2, axis=0)
    coherence = np.where(power > 0.0, np.abs(mean) ** 2 / np.where(power > 0.0, power, 1.0), 0.0)
    if len(fits) < 3:
        noise = 2.0 * np.mean(own**2, axis=0)  # both components; the scatter of few fits is not meaningful
        single = np.abs(mean) ** 2 / np.maximum(np.abs(mean) ** 2 + noise, 1e-300)
        return mean, np.sqrt(np.mean(own**2, axis=0) / len(fits)), single
    scatter = np.sqrt(np.sum(np.abs(found - mean) ** 2, axis=0) / (len(fits) - 1) / 2.0)
    return mean, np.maximum(scatter, 0.0) / math.sqrt(len(fits)), coherence
