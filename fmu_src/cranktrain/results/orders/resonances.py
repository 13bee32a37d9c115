"""Peaks of orders over speed, and the modes to which they belong.

Near a resonance of one mode under a nearly constant force, 1/|a|² is a parabola in speed,

    1/|a|² ∝ (Ω − Ω₀)² + (ζ Ω₀)²,

whose minimum is the peak; the half-power points are ζ Ω₀ away from it. The parabola through the three speeds around the
largest amplitude gives speed, height and damping. If it has no minimum there, a parabola of |a| gives speed and height.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cranktrain.results.orders.harmonics import Array
from cranktrain.results.run_up.run_up import TORSION, RunUp

COUNTS = 0.01
"""Fraction of an output's largest order amplitude, or of its largest order amplitude of acceleration, above which a
peak is listed. Accelerations are included because uneven rotation of a light crank may be 300 times as large as its
resonances, at a hundredth of their frequency squared."""
STANDS_OUT = 0.1
"""Least height of a peak above the higher of its two neighbouring minima, as a fraction of the peak's height."""
NEAR = 0.2
"""Largest distance of a peak from the mode to which it belongs, as a fraction of the mode's frequency."""


@dataclass(frozen=True)
class Peak:
    """Peak of an order's amplitude over speed.

    Attributes
    ----------
    order : oscillations per revolution
    speed : rad/s
    amplitude : zero to peak, in the output's unit
    damping : damping ratio by half-power points; NaN if the curve does not show it
    periodic : true if the motion is periodic at the speeds around the peak, or if no cycles were run
    mode_hz : frequency of the nearest mode; NaN if none is near
    kind : kind of motion of this mode
    motion_hz : frequency of the mode in motion (small motions about the running crank's cycle) that contributes most to
        the peak; NaN if not known
    motion_torsion : fraction of torsion in the kinetic energy of this mode in motion; NaN if not known
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
        """Frequency of the peak, Hz."""
        return self.order * self.speed / (2.0 * math.pi)

    @property
    def critical_speed(self) -> float:
        """Speed (rad/s) at which the peak's order has the frequency of its mode."""
        return 2.0 * math.pi * self.mode_hz / self.order

    @property
    def off(self) -> float:
        """Relative deviation of the peak's frequency from that of its mode at rest; NaN for a peak without a mode."""
        return self.hz / self.mode_hz - 1.0

    @property
    def off_in_motion(self) -> float:
        """Relative deviation of the peak's frequency from that of its mode in motion; NaN if the latter is unknown."""
        return self.hz / self.motion_hz - 1.0


def peaks(run_up: RunUp, output: str = TORSION) -> list[Peak]:
    """Peaks of all orders of an output, highest first; ``InputError`` for an output that the run-up lacks."""
    found = []
    # Peaks are sought over speeds with a result only.
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
                speed, amplitude, damping = vertex(speeds[around], sizes[around])
                periodic = bool(np.all((repeats[around] >= 1) | (cycles[around] == 0)))
                found.append(Peak(order, speed, amplitude, damping, periodic))
    return sorted(found, key=lambda peak: -peak.amplitude)


def labelled(found: Sequence[Peak], hz: Array, kinds: Sequence[str]) -> list[Peak]:
    """Peaks labelled with the nearest of the modes ``hz`` (k,), ``kinds`` (k,), if it lies within ``NEAR``."""
    result = []
    for peak in found:
        off = np.abs(hz / peak.hz - 1.0)
        if off.size and off.min() <= NEAR:
            at = int(off.argmin())
            peak = replace(peak, mode_hz=float(hz[at]), kind=kinds[at])
        result.append(peak)
    return result


def _maxima(sizes: Array) -> list[int]:
    """Indices of the peaks of a curve (n,), without its ends."""
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


def vertex(speeds: Array, sizes: Array) -> tuple[float, float, float]:
    """Speed (rad/s), height and damping ratio of a peak from three points of a curve, the middle one the highest."""
    middle, scale = float(speeds[1]), float(sizes[1])
    x = speeds - middle
    a, b, c = np.polyfit(x, (scale / np.maximum(sizes, 1e-6 * scale)) ** 2, 2)  # a measured amplitude may be 0
    least = c - 0.25 * b * b / a if a > 0.0 else 0.0
    if least > 0.0:
        speed = middle - 0.5 * b / a
        return float(speed), scale / math.sqrt(least), math.sqrt(least / a) / float(speed)
    a, b, c = np.polyfit(x, sizes / scale, 2)
    return float(middle - 0.5 * b / a), float(scale * (c - 0.25 * b * b / a)), math.nan
