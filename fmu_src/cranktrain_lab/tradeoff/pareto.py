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

    A choice is dominated by a choice that is no worse in both and better in one. Of equal choices the first is kept.
    """
    front: list[int] = []
    for index in sorted(range(len(costs)), key=lambda k: (costs[k], errors[k], k)):
        if not front or errors[index] < errors[front[-1]]:
            front.append(index)
    return front


def marked(points: Sequence[Point]) -> list[Point]:
    """Return points with ``pareto`` set, by cost and largest error, within each scene and kind of error.

    Errors against the next finer level have no front, because each level has another reference.
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
    """Return the points of one speed, with ``front`` set to the output families in whose Pareto front a point is."""
    fronts = {family: set(map(id, front(points, family))) for family in FAMILIES}
    return [replace(p, front=tuple(name for name, found in fronts.items() if id(p) in found)) for p in points]


def front(points: Iterable[TotalPoint], family: str) -> list[TotalPoint]:
    """Return the Pareto front of a speed's points in cost and total error of an output family, cheapest first."""
    own = shown(points, family)
    return [own[k] for k in pareto_front([p.cost or 0.0 for p in own], [p.total(family) or 0.0 for p in own])]
