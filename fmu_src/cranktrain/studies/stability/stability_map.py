"""A stability map: two parameters, where a method holds and where it fails, and the curves between.

A map sets a *numerical* boundary, found by bisection with the product's kernels and integrators, beside a *theoretical*
one from a stability function, an eigenvalue or a closed form. Points of curves are (column value, row value).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]
"""Told the stage at work and the share of the map that is done, 0 to 1."""


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
    """A curve in a map: ``points`` (k, 2) [column value, row value]; ``source`` says what it was found with."""

    label: str
    points: Array
    source: str


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
        bisected; None where no theory exists
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
    """Largest relative difference of two boundaries (k,) where both are known; ``nan`` where they share no point."""
    numerical, theory = np.asarray(numerical, dtype=float), np.asarray(theory, dtype=float)
    both = np.isfinite(numerical) & np.isfinite(theory)
    if not both.any():
        return math.nan
    return float(np.max(np.abs(numerical[both] / theory[both] - 1.0)))


def curve(label: str, columns: Array, rows: Array, source: str) -> Boundary:
    """Boundary through the points at which both coordinates are known."""
    points = np.column_stack((columns, rows)).astype(float)
    return Boundary(label, points[np.isfinite(points).all(axis=1)], source)


def as_record(found: StabilityMap) -> dict[str, Any]:
    """The map in plain values, as JSON keeps it: see the verb ``stability``; None for what is no finite number."""
    record = _plain(found)
    del record["name"]
    return {"axes": {name: record.pop(name) for name in ("rows", "columns")}, **record}


def from_record(name: str, record: dict[str, Any]) -> StabilityMap:
    """The map that :func:`as_record` wrote; ``KeyError``, ``TypeError`` or ``ValueError`` where it is none."""
    plain = dict(record)
    axes = plain.pop("axes")
    for which in ("rows", "columns"):
        plain[which] = Axis(**axes[which] | {"values": np.array(axes[which]["values"], dtype=float)})
    for which in ("theory", "numerical"):
        curves = ({**curve, "points": np.array(curve["points"], dtype=float).reshape(-1, 2)} for curve in plain[which])
        plain[which] = tuple(Boundary(**curve) for curve in curves)
    plain["stable"] = np.array(plain["stable"], dtype=bool)
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
