"""Pareto front of choices over cost and error."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import replace

from cranktrain.studies.total_error.families import FAMILIES
from cranktrain.studies.total_error.point import TotalPoint, shown
from cranktrain_lab.tradeoff.point import MODEL, Point


def pareto_front(costs: Sequence[float], errors: Sequence[float]) -> list[int]:
    """Return indices of the non-dominated choices, cheapest first.

    A choice is dominated by another that is no worse in both and better in one; of equal ones the first stays.
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


def with_fronts(points: Sequence[TotalPoint]) -> list[TotalPoint]:
    """The points of one speed with the families in whose Pareto front each is."""
    fronts = {family: set(map(id, front(points, family))) for family in FAMILIES}
    return [replace(p, front=tuple(name for name, found in fronts.items() if id(p) in found)) for p in points]


def front(points: Iterable[TotalPoint], family: str) -> list[TotalPoint]:
    """Points of a speed that no other beats in cost and total error of a family, the cheapest first."""
    own = shown(points, family)
    return [own[k] for k in pareto_front([p.cost or 0.0 for p in own], [p.total(family) or 0.0 for p in own])]
