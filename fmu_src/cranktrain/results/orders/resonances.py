"""Peaks of orders over the speed, and the modes that they belong to.

Near a resonance of one mode under a force that hardly changes, 1/|a|² is a parabola in speed,

    1/|a|² ∝ (Ω − Ω₀)² + (ζ Ω₀)²,

whose least value is the peak; half of the power is lost ζ Ω₀ away from it. Through the three speeds round the largest
amplitude it gives place, height and damping; where it has no least value there, a parabola of |a| gives place, height.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cranktrain.results.orders.harmonics import Array
from cranktrain.results.run_up.run_up import TORSION, RunUp

COUNTS = 0.01
"""A peak counts if it exceeds this fraction of the output's largest order amplitude, or of the largest amplitude of an
order's acceleration. Uneven rotation of a light crank as a whole may be 300 times as large as its resonances, at a
hundredth of their frequency squared."""
STANDS_OUT = 0.1
"""Fraction of its height by which a peak must exceed the higher of its two neighbouring minima."""
NEAR = 0.2
"""A peak belongs to a mode if it lies within this fraction of the mode's frequency."""


@dataclass(frozen=True)
class Peak:
    """Peak of an order over the speed.

    Attributes
    ----------
    order : oscillations per revolution
    speed : rad/s
    amplitude : zero to peak, in the output's unit
    damping : damping ratio by half power; not a number where the curve does not show it
    periodic : whether the motion repeats at the speeds round it; also where no cycles were run
    mode_hz : frequency of the mode nearest to it; not a number where none is near
    kind : of that mode's motion
    motion_hz : frequency of the mode in motion, of small motions about the running crank's cycle there, that
        contributes most to the peak; not a number where it is not known
    motion_torsion : fraction of torsion in the kinetic energy of that mode; not a number where it is not known
    """

    order: float
    speed: float
    amplitude: float
    damping: float
    periodic: bool
    mode_hz: float = math.nan
    kind: str = ""
    motion_hz: float = math.nan
    motion_torsion: float = math.nan

    @property
    def hz(self) -> float:
        """Frequency, Hz."""
        return self.order * self.speed / (2.0 * math.pi)

    @property
    def critical_speed(self) -> float:
        """Speed (rad/s) at which its order meets its mode."""
        return 2.0 * math.pi * self.mode_hz / self.order

    @property
    def off(self) -> float:
        """Relative distance above its mode; not a number if it has none."""
        return self.hz / self.mode_hz - 1.0

    @property
    def off_in_motion(self) -> float:
        """Relative distance above the mode in motion; not a number if that is unknown."""
        return self.hz / self.motion_hz - 1.0


def peaks(run_up: RunUp, output: str = TORSION) -> list[Peak]:
    """Peaks of all orders of an output, the highest first; ``InputError`` for an output that the run-up lacks."""
    found = []
    # Speeds that have no result are left out.
    has = np.isfinite(run_up.amplitudes[output]).all(axis=1)
    speeds, repeats, cycles = run_up.speeds[has], run_up.repeats[has], run_up.cycles[has]
    whole = np.abs(run_up.amplitudes[output][has])
    rates = (speeds[:, None] * run_up.orders) ** 2
    largest, fastest = (float(part.max(initial=0.0)) for part in (whole, rates * whole))
    for k, order in enumerate(run_up.orders.tolist()):
        sizes = whole[:, k]
        for at in _maxima(sizes):
            if sizes[at] >= COUNTS * largest or rates[at, k] * sizes[at] >= COUNTS * fastest:
                around = slice(at - 1, at + 2)
                speed, amplitude, damping = _vertex(speeds[around], sizes[around])
                periodic = bool(np.all((repeats[around] >= 1) | (cycles[around] == 0)))
                found.append(Peak(order, speed, amplitude, damping, periodic))
    return sorted(found, key=lambda peak: -peak.amplitude)


def labelled(found: Sequence[Peak], hz: Array, kinds: Sequence[str]) -> list[Peak]:
    """The peaks with the nearest of the modes, ``hz`` (k,) and ``kinds`` (k,), where one is ``NEAR``."""
    return [_with_mode(peak, hz, kinds) for peak in found]


def _with_mode(peak: Peak, hz: Array, kinds: Sequence[str]) -> Peak:
    off = np.abs(hz / peak.hz - 1.0)
    if not off.size or off.min() > NEAR:
        return peak
    at = int(off.argmin())
    return replace(peak, mode_hz=float(hz[at]), kind=kinds[at])


def _maxima(sizes: Array) -> list[int]:
    """Indices of the peaks inside a curve (n,)."""
    places = []
    for at in range(1, sizes.size - 1):
        if not sizes[at - 1] < sizes[at] >= sizes[at + 1]:
            continue
        higher = np.flatnonzero(sizes > sizes[at])
        begin = higher[higher < at].max(initial=-1) + 1
        end = higher[higher > at].min(initial=sizes.size)
        dip = max(sizes[begin : at + 1].min(), sizes[at:end].min())
        if dip <= (1.0 - STANDS_OUT) * sizes[at]:
            places.append(at)
    return places


def _vertex(speeds: Array, sizes: Array) -> tuple[float, float, float]:
    """Place (rad/s), height and damping ratio of the peak through three speeds, the middle one the largest."""
    middle, scale = float(speeds[1]), float(sizes[1])
    x = speeds - middle
    a, b, c = np.polyfit(x, (scale / sizes) ** 2, 2)
    least = c - 0.25 * b * b / a if a > 0.0 else 0.0
    if least > 0.0:
        speed = middle - 0.5 * b / a
        return float(speed), scale / math.sqrt(least), math.sqrt(least / a) / float(speed)
    a, b, c = np.polyfit(x, sizes / scale, 2)
    return float(middle - 0.5 * b / a), float(scale * (c - 0.25 * b * b / a)), math.nan
