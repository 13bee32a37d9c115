"""Cost at equal error, from points of error and cost."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array


class Point(NamedTuple):
    """What a setting costs, s, and how far it is off."""

    setting: str
    error: float
    seconds: float


def front(points: Sequence[Point]) -> list[Point]:
    """Those that nothing beats in both, from the largest error to the least."""
    found: list[Point] = []
    for point in sorted(points, key=lambda one: (one.seconds, one.error)):
        if not found or point.error < found[-1].error:
            found.append(point)
    return found


def cost_at(points: Sequence[Point], error: float) -> float | None:
    """Least cost of an error: on the front, log-log between neighbours; None where no setting is as good.

    Where the cheapest is better than asked its cost is taken: nothing is extrapolated.
    """
    best = front(points)
    if best[-1].error > error:
        return None
    if best[0].error <= error:
        return best[0].seconds
    logs = np.log([[point.error, point.seconds] for point in reversed(best)])
    return float(np.exp(np.interp(math.log(error), logs[:, 0], logs[:, 1])))


def relative_error(values: Array, exact: Array) -> float:
    """RMS of the difference over the RMS of the reference's alternating part."""
    return float(np.sqrt(np.mean((values - exact) ** 2)) / np.std(exact))


def beside(own: Sequence[Point], other: Sequence[Point], errors: Sequence[float]) -> list[dict[str, float | None]]:
    """Costs (s) and their ratio at each error."""
    rows = []
    for error in errors:
        ours, theirs = cost_at(own, error), cost_at(other, error)
        ratio = None if ours is None or theirs is None else round(theirs / ours, 2)
        rows.append({"error": error, "own_s": ours, "other_s": theirs, "ratio": ratio})
    return rows


def listed(points: Sequence[Point]) -> list[dict[str, float | str]]:
    """Points as a result holds them."""
    return [
        {"setting": one.setting, "error": float(f"{one.error:.3g}"), "seconds": float(f"{one.seconds:.4g}")}
        for one in points
    ]
