"""Detection of aliasing: pulses that are sampled too slowly and look like pulses of another speed.

A wheel of N teeth at f revolutions a second gives N f pulses a second. Sampled at a rate R below 2 N f, they look
exactly like N f_a = |N f − k R| pulses a second, with k whole, because a sample depends only on the fraction of a
pulse that has passed. Waveform, level and histogram do not distinguish the two. The motion of the shaft does:

* a stated speed, an index pulse or a second wheel;
* the torsion of an engine, which recurs each cycle. Under the assumption (k, ±) the angle at each pulse n, at time t,
  is 2π (k R t ± n)/N. Under the right assumption low half orders contain nearly all of the torsion. Under a wrong one
  the frequencies of the torsion are not multiples of half the assumed speed.

A gap in the wheel also shows the speed, because it recurs after N pulses
(:func:`cranktrain_lab.measured.wheel.number_teeth`).
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain_lab.measured.channels import Channel
from cranktrain_lab.measured.pulses import FEWEST_SAMPLES, timing_error
from cranktrain_lab.measured.rotation import Rotation
from cranktrain_lab.measured.wheel import CYCLE, Wheel

LINES = 12
"""Number of half orders (0.5, 1, … 6) that are assumed to contain the torsion of an engine."""
SPAN, SHORTEST, FINE = 16, 6, 96
"""Cycles of a fit, least number of cycles of a recording, and pulses per cycle above which pulses are thinned."""
FASTEST_ENGINE = 20_000.0
"""Highest alternative speed, rev/min, that is tested."""
CLEAR = 3.0
"""Ratio of the rotation's deviations to the timing errors of pulses above which the deviations are evaluated."""
TREND = 4
"""Number of polynomial coefficients of the mean rotation within a fit."""
FITS = 12
"""Largest number of fits of the torsion over a recording."""
SURE, DOUBTFUL = 0.9, 0.5
"""Least fraction of the torsion in half orders under a right speed, and largest fraction under a wrong speed. A
recording is refused only if the alternative speed meets the first and the speed as read meets the second limit."""
ALIKE = 0.02
"""Difference of two speeds' fractions of torsion in half orders below which the speeds are not distinguished."""
POINTS = 3.0
"""Least ratio of the number of pulses to the number of unknowns of a fit."""
RESTLESS = 0.02
"""RMS of deviations that differ between cycles, as a fraction of a pitch, above which a remark reports them."""
NEAR = 0.05
"""Relative deviation of a stated speed from the range of measured speeds above which they disagree."""


class Alias(NamedTuple):
    """Alternative speed (rad/s), and fractions of torsion in half orders at this speed and at the speed as read."""

    speed: float
    share: float
    share_as_read: float


def check_aliasing(turning: Rotation, channel: Channel, stated: float | None = None) -> Rotation:
    """Check a rotation for aliasing. Return it, with a remark if aliasing is possible; ``InputError`` if certain.

    ``stated`` is a known speed of the shaft, rad/s. If it agrees with the pulses, there is no aliasing. Without a known
    speed the torsion decides if possible.
    """
    where, low, high = channel.where, *turning.speed_range
    if stated is not None:
        if (1.0 - NEAR) * low <= stated <= (1.0 + NEAR) * high:
            return turning
        said = aliased(channel, turning.wheel, stated)
        raise InputError(
            f"{where}: {turning.wheel.teeth} teeth turn at {low / RPM:.5g} to {high / RPM:.5g} rev/min, not at the "
            f"stated {stated / RPM:.5g}{said or '; check the pulses a revolution'}"
        )
    if (found := likely_alias(turning, channel.rate)) is not None:
        raise InputError(
            f"{where}: of the torsion at {0.5 * (low + high) / RPM:.5g} rev/min orders up to {LINES / 2:g} hold "
            f"{100.0 * found.share_as_read:.0f} %, at {found.speed / RPM:.5g} rev/min {100.0 * found.share:.0f} %"
            f"{aliased(channel, turning.wheel, found.speed)}; if the speed is right, state it: --speed "
            f"{0.5 * (low + high) / RPM:.0f}"
        )
    size, share = restless(turning)
    pitch = math.tau / turning.wheel.teeth
    limit = pitch * max(RESTLESS, CLEAR * timing_error(turning.spacing[1], turning.two_levels))
    if not (math.isfinite(channel.rate) and size > limit and share > DOUBTFUL):
        return turning
    other = math.tau * channel.rate / turning.wheel.teeth
    likes = f"{(other - high) / RPM:.0f} or {(other + high) / RPM:.0f}"
    said = (
        f"{where}: {math.degrees(size):.2g} deg of torsion (rms), {100.0 * share:.0f} %, do not recur from cycle to "
        f"cycle; if this is no transient, the pulses may be those of {likes} rev/min, "
        f"which look the same at {channel.rate:.5g} Hz (aliasing); check by --speed, --index or --second"
    )
    return replace(turning, remarks=(*turning.remarks, said))


def restless(turning: Rotation) -> tuple[float, float]:
    """Return the part of the torsion that differs between cycles: RMS, rad, and fraction of the variance.

    Each pulse is compared with the pulse of the same tooth a cycle later, so pitch errors cancel.
    """
    teeth, torsion = turning.numbered.teeth, turning.torsion
    cycle = 2 * turning.wheel.teeth
    inside = (turning.phase >= turning.mean.inner[0]) & (turning.phase <= turning.mean.inner[1])
    _, now, later = np.intersect1d(teeth[inside] + cycle, teeth[inside], assume_unique=True, return_indices=True)
    if now.size < 4 * cycle:
        return 0.0, 0.0
    torsion = torsion[inside]
    changes = 0.5 * float(np.mean((torsion[now] - torsion[later]) ** 2))
    return math.sqrt(changes), changes / max(float(np.var(torsion)), 1e-300)


def aliased(channel: Channel, wheel: Wheel, speed: float) -> str:
    """Return the text that pulses at a speed (rad/s) are sampled too slowly, or an empty text if they are not."""
    hz = wheel.teeth * speed / math.tau
    if not channel.rate < FEWEST_SAMPLES * hz:
        return ""
    apparent = abs(hz - channel.rate * round(hz / channel.rate))
    return (
        f"; {hz:.5g} pulses a second sampled at {channel.rate:.5g} Hz look like {apparent:.4g} (aliasing); sample at "
        f"{FEWEST_SAMPLES * hz:.3g} Hz or more, or take a wheel of fewer teeth"
    )


def likely_alias(turning: Rotation, rate: float) -> Alias | None:
    """Return the alternative speed to which the torsion belongs, if the torsion shows aliasing, else None."""
    if not math.isfinite(rate) or turning.wheel.missing or turning.wheel.teeth < 2:
        return None
    times, teeth = turning.times - turning.times[0], turning.numbered.teeth - turning.numbered.teeth[0]
    pitch = math.tau / turning.wheel.teeth
    plain, size = held(times, pitch * teeth.astype(np.float64))
    spacing = rate * times[-1] / teeth[-1]
    if not plain < DOUBTFUL or size < CLEAR * pitch * timing_error(spacing, turning.two_levels):
        return None
    found = []
    k = 1
    while (k * rate - teeth[-1] / times[-1]) * pitch / RPM < FASTEST_ENGINE:
        for sign in (-1.0, 1.0):
            angle = pitch * (k * rate * times + sign * teeth)
            share = held(times, angle)[0] if angle[-1] / times[-1] / RPM < FASTEST_ENGINE else 0.0
            found.append(Alias(float(angle[-1] / times[-1]), share, plain))
        k += 1
    # A perfectly constant speed may have several alternative speeds. The lowest alternative is reported.
    likely = [one for one in found if one.share > max(SURE, max(other.share for other in found) - ALIKE)]
    return min(likely, key=lambda one: one.speed) if likely else None


def held(times: Array, angle: Array) -> tuple[float, float]:
    """Return the fraction of deviations from smooth rotation in half orders, and the RMS of the deviations, rad.

    ``times`` (k,) in s and ``angle`` (k,) in rad increase, ``angle`` from 0. Variances are divided by degrees of
    freedom, so noise gives 0. The fraction is NaN if there are too few pulses.
    """
    cycles = angle[-1] / CYCLE
    stride = max(1, int(times.size / cycles / FINE))
    times, angle = times[::stride], angle[::stride]
    unknowns = TREND + 2 * LINES
    span = max(min(SPAN, cycles), math.ceil(POINTS * unknowns * cycles / times.size))
    if span > min(cycles, 8 * SPAN) or cycles < SHORTEST:
        return math.nan, 0.0
    total = left = 0.0
    begins = np.linspace(0.0, angle[-1] - span * CYCLE, min(FITS, int(cycles // span)))
    for begin in begins.tolist():
        first, last = np.searchsorted(angle, (begin, begin + span * CYCLE))
        t, own = times[first:last], angle[first:last] - angle[first]
        if t.size <= unknowns:
            continue
        powers = np.polynomial.legendre.legvander(2.0 * (t - t[0]) / (t[-1] - t[0]) - 1.0, TREND - 1)
        coefficients = np.linalg.solve(powers.T @ powers, powers.T @ own)
        phase = powers @ coefficients
        waves = np.exp(0.5j * phase[:, None] * np.arange(1, LINES + 1))
        basis = np.column_stack((powers, waves.real, waves.imag))
        off = own - phase
        rest = off - basis @ np.linalg.lstsq(basis.T @ basis, basis.T @ off, rcond=None)[0]
        total += float(off @ off) / (t.size - TREND)
        left += float(rest @ rest) / (t.size - unknowns)
    return (1.0 - left / total, math.sqrt(total / begins.size)) if total else (math.nan, 0.0)
