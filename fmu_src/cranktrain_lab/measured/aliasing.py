"""Pulses that are sampled too slowly, and read as those of another speed.

A wheel of N teeth at f revolutions a second gives N f pulses a second. Sampled at a rate R below 2 N f, they look
exactly like N f_a = |N f − k R| pulses a second, with k whole, because a sample depends only on the fraction of a
pulse that has passed. No waveform, level or histogram tells the two apart. What tells is what the shaft does:

* a stated speed, an index pulse or a second wheel;
* the torsion of an engine, which recurs each cycle. Under the assumption (k, ±) the angle at each pulse n, at time t,
  is 2π (k R t ± n)/N. Under the right one half orders of a low number hold nearly all of the torsion. Under a wrong one
  its frequencies are no multiples of half the assumed speed.

A gap in the wheel tells too: it recurs after N pulses (:func:`cranktrain_lab.measured.wheel.number_teeth`).
"""

from __future__ import annotations

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
"""Half orders, from 0.5 to 6, that hold the torsion of an engine."""
SPAN, SHORTEST, FINE = 16, 6, 96
"""Cycles of a fit, the fewest of a recording that is too short for them, and pulses a cycle from which only some are
taken."""
FASTEST_ENGINE = 20_000.0
"""Highest speed, rev/min, that is looked for in place of the one read."""
CLEAR = 3.0
"""Size of the deviations over the errors of the crossings, from which they tell."""
TREND = 4
"""Coefficients of the polynomial by which the mean rotation varies within a fit."""
FITS = 12
"""Fits over the recording, at most."""
SURE, DOUBTFUL = 0.9, 0.5
"""Fraction of the torsion that half orders hold under a speed that is right, at least, and under one that is wrong, at
most. Both must hold for a recording to be refused."""
ALIKE = 0.02
"""Difference of such fractions that does not tell two speeds apart."""
POINTS = 3.0
"""Pulses of a fit over its unknowns, at least."""
RESTLESS = 0.02
"""Deviations that do not recur, as a fraction of a pitch (rms), from which a remark tells them."""
NEAR = 0.05
"""Relative difference of a stated speed from the range of the speeds found, from which both disagree."""


class Alias(NamedTuple):
    """A speed that fits the pulses better than the one read: rad/s, fractions of the torsion at half orders."""

    speed: float
    share: float
    share_as_read: float


def check_aliasing(turning: Rotation, channel: Channel, stated: float | None = None) -> Rotation:
    """Rotation, with a remark where its pulses may be those of another speed; ``InputError`` where they are.

    ``stated`` is a speed that the shaft had, rad/s. If it agrees with the pulses, they are right. Without one the
    torsion decides where it can.
    """
    where, low, high = f"{channel.source}, channel {channel.name}", *turning.speed_range
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
    """Part of the torsion that differs from cycle to cycle: its size (rms, rad), and its fraction of the variance.

    Each pulse is compared with that of the same tooth a cycle later, so teeth that are wrong do not count.
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
    """Say that pulses of a speed, rad/s, are sampled too slowly; empty where they are not."""
    hz = wheel.teeth * speed / math.tau
    if not channel.rate < FEWEST_SAMPLES * hz:
        return ""
    apparent = abs(hz - channel.rate * round(hz / channel.rate))
    return (
        f"; {hz:.5g} pulses a second sampled at {channel.rate:.5g} Hz look like {apparent:.4g} (aliasing); sample at "
        f"{FEWEST_SAMPLES * hz:.3g} Hz or more, or take a wheel of fewer teeth"
    )


def likely_alias(turning: Rotation, rate: float) -> Alias | None:
    """Speed of which the torsion is, where the speed read is wrong by aliasing and the torsion says so."""
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
    # A speed that is constant to the clock's last digit may have several; the lowest one is named.
    likely = [one for one in found if one.share > max(SURE, max(other.share for other in found) - ALIKE)]
    return min(likely, key=lambda one: one.speed) if likely else None


def held(times: Array, angle: Array) -> tuple[float, float]:
    """Fraction of the deviations from a smooth rotation that half orders hold, and the deviations' size (rms), rad.

    ``times`` (k,) s and ``angle`` (k,) rad, which rises from 0 on. Variances are those of degrees of freedom, so noise
    gives 0. The fraction is not a number where there are too few pulses.
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
