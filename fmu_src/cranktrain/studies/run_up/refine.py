"""Speeds between those of a run-up, where the amplitude of an order is bent more than a straight line follows."""

from __future__ import annotations

import numpy as np

from cranktrain.results.run_up.run_up import TORSION, RunUp

FINEST = 8
"""Largest number of parts that a step is divided into."""
MATTERS = 0.05
"""Share of the largest amplitude of all orders from which an order counts."""


def speeds_between(run_up: RunUp, tolerance: float, step: float) -> list[float]:
    """Middles (rad/s) of the steps next to which an order's torsion is bent too much.

    Half a step beside, a parabola through three speeds leaves the line by a quarter of its second difference over a
    step (an eighth of h² times the curvature). Speeds without a periodic motion do not count: what they show of one
    cycle is no curve.

    Parameters
    ----------
    tolerance : of that, over the largest amplitude of the order
    step : of the run-up as it was asked for, rad/s; no step gets shorter than an eighth of it
    """
    periodic = run_up.repeats >= 1
    speeds, sizes = run_up.speeds[periodic], np.abs(run_up.amplitudes[TORSION][periodic])
    if speeds.size < 3:
        return []
    h = np.diff(speeds)
    slopes = np.diff(sizes, axis=0) / h[:, None]
    curvature = np.abs(np.diff(slopes, axis=0)) / (0.5 * (h[1:] + h[:-1]))[:, None]
    largest = sizes.max(axis=0)
    counts = largest >= MATTERS * largest.max()
    # Each step is as bent as the more bent of its two ends.
    bent = np.zeros((h.size, int(counts.sum())))
    bent[:-1] = curvature[:, counts]
    bent[1:] = np.maximum(bent[1:], curvature[:, counts])
    off = (0.125 * h[:, None] ** 2 * bent / largest[counts]).max(axis=1)
    split = (off > tolerance) & (h > 1.5 * step / FINEST) & (h < 1.5 * step)
    return [float(0.5 * (a + b)) for a, b in zip(speeds[:-1][split], speeds[1:][split], strict=True)]
