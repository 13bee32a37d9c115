"""Which choices are worth their cost: the Pareto front over cost and error, and the cost at an error."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from cranktrain.studies.tradeoff.point import MODEL, Point


def pareto_front(costs: Sequence[float], errors: Sequence[float]) -> list[int]:
    """Indices of the choices that none other beats, cheapest first.

    A choice is beaten by one that is no worse in both and better in one; of equal ones the first stays.
    """
    front: list[int] = []
    for index in sorted(range(len(costs)), key=lambda k: (costs[k], errors[k], k)):
        if not front or errors[index] < errors[front[-1]]:
            front.append(index)
    return front


def marked(points: Sequence[Point]) -> list[Point]:
    """The points with ``pareto`` set, each within its scene and kind of error; the error is the largest one.

    Differences to a next level up have no front: each is compared with something else.
    """
    groups: dict[tuple[str, str], list[int]] = defaultdict(list)
    for index, point in enumerate(points):
        if point.usable and point.parameters["error_kind"] != MODEL:
            groups[point.group].append(index)
    front = set()
    for members in groups.values():
        costs = [points[k].seconds_per_simulated_second or 0.0 for k in members]
        errors = [points[k].worst or 0.0 for k in members]
        front |= {members[k] for k in pareto_front(costs, errors)}
    return [replace(point, pareto=index in front) for index, point in enumerate(points)]


def cost_at(error: float, found: Sequence[float], costs: Sequence[float]) -> float | None:
    """Cost at an error by log-log interpolation along the front; None where no run reaches it.

    Nothing is extrapolated to smaller errors, and above the largest error the cheapest run counts.
    """
    order = pareto_front(costs, found)
    front = [(found[k], costs[k]) for k in order]
    if not front:
        return None
    if front[0][0] <= error:
        return front[0][1]
    for (e0, c0), (e1, c1) in pairwise(front):
        if e1 <= error:
            share = math.log(e0 / error) / math.log(e0 / max(e1, 1e-300))
            return math.exp(math.log(c0) + share * math.log(c1 / c0))
    return None
