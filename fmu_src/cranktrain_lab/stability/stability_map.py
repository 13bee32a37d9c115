"""A stability map: two parameters, where a method holds and where it fails, and the curves between.

A map sets a *numerical* boundary, found by bisection with the product's kernels and integrators, beside a *theoretical*
one from a stability function, an eigenvalue or a closed form. Points of curves are (column value, row value).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.types import Array

Progress = Callable[[str, float], None]
"""Told the stage at work and the share of the map that is done, 0 to 1."""
Refine = Callable[[float, float], float]


@dataclass(frozen=True, eq=False)
class Axis:
    """One parameter of a map: ascending ``values`` (n,), drawn over a logarithm where ``log``."""

    name: str
    unit: str
    values: Array
    log: bool = False

    @property
    def label(self) -> str:
        """Name and unit, as an axis carries them."""
        return f"{self.name} / {self.unit}" if self.unit else self.name


@dataclass(frozen=True, eq=False)
class Boundary:
    """A curve in a map: ``points`` (k, 2) [column value, row value]; ``source`` says what it was found with.

    ``verdicts`` says of each value that was looked at what the search gave: a value, ``stable to …`` or ``below …``.
    """

    label: str
    points: Array
    source: str
    verdicts: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class StabilityMap:
    """Where a method holds.

    Attributes
    ----------
    name, title : as in the registry, and as drawn
    rows, columns : the two parameters, r and c values
    stable : (r, c) bool
    measure : (r, c) what stability is read from (a spectral radius, a number of halvings), or None
    measure_label : its name with unit
    theory, numerical : boundaries from theory, and by bisection with the product's kernels
    max_deviation : largest relative difference of a numerical boundary from its theory, in the parameter that was
        bisected; None where no theory exists, infinite where only one of both has a boundary
    explanation : three to six lines: what fails, why, what to do
    failure : what ``stable`` being false means, in a word or few for the legend
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
    """Parameter from which on a method fails: the value itself, never ``nan``.

    Infinite where the method holds up to ``limit``, the largest value looked at. Where it fails at the least value
    looked at already it is that value, with ``below`` true.
    """

    below: bool
    limit: float

    def __new__(cls, value: float, below: bool = False, limit: float = math.inf) -> Onset:
        """Onset at ``value``."""
        self = super().__new__(cls, value)
        self.below, self.limit = below, limit
        return self

    @property
    def found(self) -> bool:
        """Whether it is a value between a place that holds and one that fails."""
        return math.isfinite(self) and not self.below

    def scaled(self, factor: float) -> Onset:
        """The same in another unit."""
        return Onset(factor * self, self.below, factor * self.limit)

    def __str__(self) -> str:
        """The verdict, as a map's curve carries it."""
        if math.isinf(self):
            return f"stable to {self.limit:.4g}"
        return f"{'below ' if self.below else ''}{float(self):.4g}"


def onset(
    fails: Callable[[float], bool], places: Array, tolerance: float, least: float, refine: Refine | None = None
) -> Onset:
    """First value at which a method begins to fail, looked for at ascending ``places`` (k,) > 0.

    Where it fails at the first place already, the search goes on below it, by halving, down to ``least``. ``refine``
    (low, high) finds the value between a place that holds and one that fails; by default bisection to ``tolerance``.
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
    """Parameter between ``low`` and ``high`` at which ``fails`` changes, to a relative ``tolerance``.

    Positive bounds are halved by their ratio. ``nan`` where ``fails`` is the same at both.
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
    """Largest relative difference of two boundaries (k,); ``nan`` where neither has a point.

    Infinite where only one of them has a point: a boundary that a search lost is no agreement.
    """
    numerical, theory = np.asarray(numerical, dtype=float), np.asarray(theory, dtype=float)
    both = np.isfinite(numerical) & np.isfinite(theory)
    if (np.isfinite(numerical) != np.isfinite(theory)).any():
        return math.inf
    if not both.any():
        return math.nan
    return float(np.max(np.abs(numerical[both] / theory[both] - 1.0)))


def curve(label: str, columns: Sequence[float] | Array, rows: Sequence[float] | Array, source: str) -> Boundary:
    """Boundary through the points at which both coordinates are known; onsets among them leave their verdicts."""
    onsets = [value for values in (columns, rows) for value in values if isinstance(value, Onset)]
    points = np.column_stack((columns, rows)).astype(float)
    known = np.isfinite(points).all(axis=1) & (np.array([value.found for value in onsets]) if onsets else True)
    return Boundary(label, points[known], source, tuple(str(value) for value in onsets))


def as_record(found: StabilityMap) -> dict[str, Any]:
    """The map in plain values, as JSON keeps it: see the verb ``stability``.

    What is no finite number is None; an infinite ``max_deviation`` is ``"inf"``.
    """
    record = _plain(found)
    del record["name"]
    if found.max_deviation == math.inf:
        record["max_deviation"] = "inf"
    return {"axes": {name: record.pop(name) for name in ("rows", "columns")}, **record}


def from_record(name: str, record: dict[str, Any]) -> StabilityMap:
    """The map that :func:`as_record` wrote; ``KeyError``, ``TypeError`` or ``ValueError`` where it is none."""
    plain = dict(record)
    axes = plain.pop("axes")
    for which in ("rows", "columns"):
        plain[which] = Axis(**axes[which] | {"values": np.array(axes[which]["values"], dtype=float)})
    for which in ("theory", "numerical"):
        plain[which] = tuple(
            Boundary(
                curve["label"],
                np.array(curve["points"], dtype=float).reshape(-1, 2),
                curve["source"],
                tuple(curve["verdicts"]),
            )
            for curve in plain[which]
        )
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


def _plain(value: Any) -> Any:
    """Dataclasses, tuples and arrays as JSON holds them."""
    if is_dataclass(value):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(entry) for entry in (value.tolist() if isinstance(value, np.ndarray) else value)]
    return None if isinstance(value, float) and not math.isfinite(value) else value
