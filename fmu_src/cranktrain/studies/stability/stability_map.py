"""A stability map: two parameters, where a method holds and where it fails, and the curves between.

A map sets a *numerical* boundary, found by bisection with the product's kernels and integrators, beside a *theoretical*
one from a stability function, an eigenvalue or a closed form. Points of curves are (column value, row value).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]
"""Told the stage at work and the share of the map that is done, 0 to 1."""


def silent(stage: str, share: float) -> None:
    """Progress that nobody follows."""


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
    """The map in plain values, as JSON keeps it: see the verb ``stability``."""

    def axis(a: Axis) -> dict[str, Any]:
        return {"name": a.name, "unit": a.unit, "values": a.values.tolist(), "log": a.log}

    def curves(boundaries: tuple[Boundary, ...]) -> list[dict[str, Any]]:
        return [{"label": b.label, "points": b.points.tolist(), "source": b.source} for b in boundaries]

    measure = None
    if found.measure is not None:
        measure = [[v if math.isfinite(v) else None for v in row] for row in found.measure.tolist()]
    return {
        "title": found.title,
        "axes": {"rows": axis(found.rows), "columns": axis(found.columns)},
        "stable": found.stable.tolist(),
        "measure": measure,
        "measure_label": found.measure_label,
        "theory": curves(found.theory),
        "numerical": curves(found.numerical),
        "max_deviation": found.max_deviation,
        "explanation": found.explanation,
        "failure": found.failure,
    }


def from_record(name: str, record: dict[str, Any]) -> StabilityMap:
    """The map that :func:`as_record` wrote; ``KeyError``, ``TypeError`` or ``ValueError`` where it is none."""

    def axis(r: dict[str, Any]) -> Axis:
        return Axis(r["name"], r["unit"], np.array(r["values"], dtype=float), bool(r["log"]))

    def curves(rows: list[dict[str, Any]]) -> tuple[Boundary, ...]:
        return tuple(Boundary(r["label"], np.array(r["points"], dtype=float).reshape(-1, 2), r["source"]) for r in rows)

    rows, columns = axis(record["axes"]["rows"]), axis(record["axes"]["columns"])
    stable = np.array(record["stable"], dtype=bool)
    measure = None if record["measure"] is None else np.array(record["measure"], dtype=float)
    for values in (stable, measure):
        if values is not None and values.shape != (rows.values.size, columns.values.size):
            raise ValueError(f"map '{name}' is {values.shape}, its axes are not")
    return StabilityMap(
        name=name, title=record["title"], rows=rows, columns=columns, stable=stable, measure=measure,
        measure_label=record["measure_label"], theory=curves(record["theory"]), numerical=curves(record["numerical"]),
        max_deviation=record["max_deviation"], explanation=record["explanation"], failure=record["failure"],
    )  # fmt: skip
