"""Additional speeds of a run-up where the amplitude of an order deviates too much from a straight line."""

from __future__ import annotations

import numpy as np

from cranktrain.results.run_up.run_up import TORSION, RunUp

FINEST = 8
"""Largest number of parts into which a step between two requested speeds is divided."""
MATTERS = 0.05
"""Fraction of the largest amplitude of all orders above which an order's curvature counts."""


def speeds_between(run_up: RunUp, tolerance: float, step: float) -> list[float]:
    """Middles (rad/s) of the steps next to speeds with too large a curvature of an order's torsion.

    In the middle of a step h, a parabola through three speeds deviates from the line by an eighth of h² times the
    curvature (a quarter of the second difference). Speeds without a periodic motion are left out, because their
    amplitudes of one cycle do not lie on a curve.

    Parameters
    ----------
    tolerance : of this deviation, over the largest amplitude of the order
    step : requested step of the run-up, rad/s; no step gets shorter than an eighth of it
    """
    periodic = (run_up.repeats >= 1) & np.isfinite(run_up.amplitudes[TORSION]).all(axis=1)
    speeds, sizes = run_up.speeds[periodic], np.abs(run_up.amplitudes[TORSION][periodic])
    if speeds.size < 3:
        return []
    h = np.diff(speeds)
    slopes = np.diff(sizes, axis=0) / h[:, None]
    curvature = np.abs(np.diff(slopes, axis=0)) / (0.5 * (h[1:] + h[:-1]))[:, None]
    largest = sizes.max(axis=0)
    counts = largest >= MATTERS * largest.max()
    # The curvature of a step between two speeds is the larger curvature at its two ends.
    bent = np.zeros((h.size, int(counts.sum())))
    bent[:-1] = curvature[:, counts]
    bent[1:] = np.maximum(bent[1:], curvature[:, counts])
    off = (0.125 * h[:, None] ** 2 * bent / largest[counts]).max(axis=1)
    split = (off > tolerance) & (h > 1.5 * step / FINEST) & (h < 1.5 * step)
    return [float(0.5 * (a + b)) for a, b in zip(speeds[:-1][split], speeds[1:][split], strict=True)]
