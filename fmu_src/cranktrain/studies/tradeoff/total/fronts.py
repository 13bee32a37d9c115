"""The Pareto fronts of the choices at one speed: which of them no other beats in cost and total error."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from cranktrain.studies.total_error.families import FAMILIES
from cranktrain.studies.total_error.point import TotalPoint, shown
from cranktrain.studies.tradeoff.pareto import pareto_front


def with_fronts(points: Sequence[TotalPoint]) -> list[TotalPoint]:
    """The points of one speed with the families in whose Pareto front each is."""
    fronts = {family: set(map(id, front(points, family))) for family in FAMILIES}
    return [replace(p, front=tuple(name for name, found in fronts.items() if id(p) in found)) for p in points]


def front(points: Iterable[TotalPoint], family: str) -> list[TotalPoint]:
    """Points of a speed that no other beats in cost and total error of a family, the cheapest first."""
    own = shown(points, family)
    return [own[k] for k in pareto_front([p.cost or 0.0 for p in own], [p.total(family) or 0.0 for p in own])]
