"""Stability map of a method over two parameters, with stable and unstable regions and boundary curves.

A map sets a *numerical* boundary, found by bisection with the product's kernels and integrators, beside a *theoretical*
one from a stability function, an eigenvalue or a closed form. Points of curves are (column value, row value).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.types import Array
from cranktrain.results.page_head import jsonable

Progress = Callable[[str, float], None]
"""Function that is called with the stage and the completed fraction of the map, 0 to 1."""
Refine = Callable[[float, float], float]


@dataclass(frozen=True, eq=False)
class Axis:
    """Parameter of a map, with ascending ``values`` (n,), drawn on a logarithmic scale if ``log``."""

    name: str
    unit: str
    values: Array
    log: bool = False

    @property
    def label(self) -> str:
        """Label of the axis, with name and unit."""
        return f"{self.name} / {self.unit}" if self.unit else self.name


@dataclass(frozen=True, eq=False)
class Boundary:
    """Curve in a map, with ``points`` (k, 2) [column value, row value] and ``source``, the method of computation.

    ``verdicts`` has the result of each search: a value, ``stable to …`` or ``below …``.
    """

    label: str
    points: Array
    source: str
    verdicts: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class StabilityMap:
    """Stability map of a method.

    Attributes
    ----------
    name, title : name in the registry, and title of the picture
    rows, columns : parameters, with r and c values
    stable : (r, c) True if stable
    measure : (r, c) quantity that shows stability (spectral radius, number of halvings), or None
    measure_label : name of the measure, with unit
    theory, numerical : boundaries from theory, and by bisection with the product's kernels
    max_deviation : largest relative difference of a numerical boundary from its theory, in the parameter that was
        bisected; None where no theory exists, infinite where only one of both has a boundary
    explanation : three to six lines: what fails, why, what to do
    failure : meaning of ``stable`` = False, in few words for the legend
    """

    name: str
    title: str
    rows: Axis
    columns: Axis
    stable: NDArray[np.bool_]
    measure: Array | None
    measure_label: str
    theory: tuple[Boundary, ...]
    numerical: tuple[Boundary, ...]
    max_deviation: float | None
    explanation: str
    failure: str = "fails"


class Onset(float):
    """Parameter value above which a method fails; never ``nan``.

    It is infinite if the method is stable up to ``limit``, the largest tested value. If the method already fails at the
    least tested value, it is this value with ``below`` true.
    """

    below: bool
    limit: float

    def __new__(cls, value: float, below: bool = False, limit: float = math.inf) -> "Onset":
        """Onset at ``value``."""
        self = super().__new__(cls, value)
        self.below, self.limit = below, limit
        return self

    @property
    def found(self) -> bool:
        """True if the value lies between a stable and a failing test."""
        return math.isfinite(self) and not self.below

    def scaled(self, factor: float) -> "Onset":
        """Return the onset with its values multiplied by ``factor``, for another unit."""
        return Onset(factor * self, self.below, factor * self.limit)

    def __str__(self) -> str:
        """Return the verdict of the search as text for a curve's point."""
        if math.isinf(self):
            return f"stable to {self.limit:.4g}"
        return f"{'below ' if self.below else ''}{float(self):.4g}"


def onset(
    fails: Callable[[float], bool], places: Array, tolerance: float, least: float, refine: Refine | None = None
) -> Onset:
    """Search the first value at which a method fails, at ascending ``places`` (k,) > 0.

    If the method fails at the first place, the search continues below it, by halving, down to ``least``. ``refine``
    (low, high) finds the value between a stable and a failing place, by default by bisection to ``tolerance``.
    """
    refine = refine or (lambda low, high: bisected(fails, low, high, tolerance))
    first = float(places[0])
    if fails(first):
        while first > least:
            low = max(0.5 * first, least)
            if not fails(low):
                return Onset(refine(low, first))
            first = low
        return Onset(first, below=True)
    for low, high in pairwise(places.tolist()):
        if fails(high):
            return Onset(refine(low, high))
    return Onset(math.inf, limit=float(places[-1]))


def bisected(fails: Callable[[float], bool], low: float, high: float, tolerance: float) -> float:
    """Return the parameter between ``low`` and ``high`` at which ``fails`` changes, to a relative ``tolerance``.

    Positive bounds are bisected geometrically. The result is ``nan`` if ``fails`` is equal at both.
    """
    at_low = fails(low)
    if fails(high) == at_low:
        return math.nan
    by_ratio = low > 0.0
    while high - low > tolerance * max(abs(low), abs(high)):
        middle = math.sqrt(low * high) if by_ratio else 0.5 * (low + high)
        if fails(middle) == at_low:
            low = middle
        else:
            high = middle
    return math.sqrt(low * high) if by_ratio else 0.5 * (low + high)


def deviation(numerical: Array, theory: Array) -> float:
    """Return the largest relative difference of two boundaries at k points; ``nan`` if neither has a point.

    It is infinite if only one of them has a point, because a missing boundary is no agreement.
    """
    numerical, theory = np.asarray(numerical, dtype=float), np.asarray(theory, dtype=float)
    both = np.isfinite(numerical) & np.isfinite(theory)
    if (np.isfinite(numerical) != np.isfinite(theory)).any():
        return math.inf
    if not both.any():
        return math.nan
    return float(np.max(np.abs(numerical[both] / theory[both] - 1.0)))


def curve(label: str, columns: Sequence[float] | Array, rows: Sequence[float] | Array, source: str) -> Boundary:
    """Return the boundary through points with both coordinates known, with verdicts of onsets."""
    onsets = [value for values in (columns, rows) for value in values if isinstance(value, Onset)]
    points = np.column_stack((columns, rows)).astype(float)
    known = np.isfinite(points).all(axis=1) & (np.array([value.found for value in onsets]) if onsets else True)
    return Boundary(label, points[known], source, tuple(str(value) for value in onsets))


def as_record(found: StabilityMap) -> dict[str, Any]:
    """Convert a map to plain values for JSON.

    Non-finite numbers become None; an infinite ``max_deviation`` becomes ``"inf"``.
    """
    record: dict[str, Any] = jsonable(asdict(found))
    del record["name"]
    if found.max_deviation == math.inf:
        record["max_deviation"] = "inf"
    return {"axes": {name: record.pop(name) for name in ("rows", "columns")}, **record}


def from_record(name: str, record: dict[str, Any]) -> StabilityMap:
    """Restore a map from :func:`as_record`; raises ``KeyError``, ``TypeError`` or ``ValueError`` for invalid data."""
    plain = dict(record)
    axes = plain.pop("axes")
    for which in ("rows", "columns"):
        plain[which] = Axis(**axes[which] | {"values": np.array(axes[which]["values"], dtype=float)})
    for which in ("theory", "numerical"):
        plain[which] = tuple(
            Boundary(**one | {"points": np.array(one["points"], dtype=float).reshape(-1, 2),
                              "verdicts": tuple(one["verdicts"])})
            for one in plain[which]
        )  # fmt: skip
    plain["stable"] = np.array(plain["stable"], dtype=bool)
    if plain["max_deviation"] is not None:
        plain["max_deviation"] = float(plain["max_deviation"])
    if plain["measure"] is not None:
        plain["measure"] = np.array(plain["measure"], dtype=float)
    found = StabilityMap(name=name, **plain)
    for values in (found.stable, found.measure):
        if values is not None and values.shape != (found.rows.values.size, found.columns.values.size):
            raise ValueError(f"map '{name}' is {values.shape}, its axes are not")
    return found
