"""Measured orders at one speed: points with phase and band, and the resulting motion over a cycle."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cranktrain.core.types import Array
from cranktrain.results.orders.measured import Measured, band_of, phases_of


class Point(NamedTuple):
    """Measured order at a speed: amplitude, SI, zero to peak; phase, rad, and half width of band, NaN if unknown."""

    order: float
    amplitude: float
    phase: float
    band: float


def points_at(measured: Measured | None, output: str, speed: float, reach: float) -> list[Point]:
    """Points of all measured orders of an output within ``reach`` of a speed, both rad/s, sorted by order.

    If a speed was measured several times, the amplitude is the mean; phase and band are those of the first point.
    """
    found = []
    for order, (speeds, sizes) in sorted((measured or {}).get(output, {}).items()):
        k = int(np.argmin(np.abs(speeds - speed)))
        if abs(speeds[k] - speed) > reach:
            continue
        assert measured is not None
        phases, bands = phases_of(measured, output, order), band_of(measured, output, order)
        found.append(
            Point(
                order,
                float(sizes[speeds == speeds[k]].mean()),
                math.nan if phases is None else float(phases[k]),
                math.nan if bands is None else float(bands[k]),
            )
        )
    return found


def motion_of(points: Sequence[Point], angle: Array) -> tuple[Array, float] | None:
    """Motion (n,) at crank angles (n,) rad, and half width of its band (root of the sum of squares); SI.

    Orders without a phase are left out. The result is None if no phase is known.
    """
    known = [point for point in points if math.isfinite(point.phase)]
    if not known:
        return None
    motion = sum(point.amplitude * np.cos(point.order * angle + point.phase) for point in known)
    bands = [point.band for point in known if math.isfinite(point.band)]
    return np.asarray(motion), math.sqrt(sum(band**2 for band in bands))


def reach_of(speeds: Array) -> float:
    """Distance, rad/s, up to which a measured speed belongs to one of ``speeds`` (s,), rad/s: half of their step."""
    return 0.5 * float(np.diff(speeds).mean()) + 1e-6 if speeds.size > 1 else 0.1
