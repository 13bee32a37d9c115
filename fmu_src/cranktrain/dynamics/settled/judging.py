"""What is left of settling in each family of outputs: RMS of the difference over RMS of the alternating part."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from cranktrain.core.reduced_body import Array

TOLERANCE = 1.0e-3
"""What may be left of each family of outputs, unless a run asks for another."""
MOST_CYCLES = 48
"""Cycles after which a run that does not repeat ends."""
FREE_CYCLES = 6
"""Cycles of a run whose speed a load torque leaves free, unless it asks for others: it settles in seconds only."""
LEAST = 1.0e-9
"""Alternating part over RMS below which an output counts as constant."""
NOTHING = 1.0e-13
"""Alternating part (RMS, SI) that is rounding, of whatever output: a collar that nothing tilts has 1e-15 N m."""


@dataclass(frozen=True)
class Settling:
    """How settled a run is.

    Attributes
    ----------
    cycles : that were run, those before the recorded ones included
    repeats : cycles after which the run repeats within the tolerance, 1 to 6; 0 where it does not
    tolerance : of what may be left
    left : what the last cycle is still off the periodic one, by family of outputs (``bearing.force``): RMS of the
        difference over RMS of the alternating part; empty where one cycle has nothing to be compared with
    steady : whether a cycle repeats at all: not where a load torque leaves the speed free, which then is still changing
    parting : factor by which cycles that are alike are farther apart after the next one, where that is why the run
        ended: it has no period; else not a number
    """

    cycles: int
    repeats: int
    tolerance: float
    left: Mapping[str, float] = field(default_factory=dict)
    steady: bool = True
    parting: float = math.nan

    @property
    def worst(self) -> tuple[str, float]:
        """Family of which most is left, and how much; not a number where nothing is known."""
        return max(self.left.items(), key=lambda item: item[1], default=("", float("nan")))

    @property
    def text(self) -> str:
        """One sentence."""
        count = f"{self.cycles} cycle" + ("s" if self.cycles > 1 else "")
        if not self.left:
            return f"Settling: unknown after {count}; run two or more, or until the outputs repeat"
        family, most = self.worst
        what = f"{most:.1e} is left, most of it in {family}"
        if not self.steady:
            return f"Settling: the speed is free; the last of {count} changed {family} by {most:.1e}"
        if self.repeats > 1:
            return f"Settling: repeats every {self.repeats} cycles, after {count}; {what}"
        if self.repeats == 1:
            return f"Settling: periodic after {count}; {what}"
        if math.isfinite(self.parting):
            return (
                f"Settling: no period after {count}: two that are alike differ {self.parting:.2g} times as much in the "
                f"next one; {what}"
            )
        return f"Settling: not periodic to {self.tolerance:g} after {count}; {what}"

    @property
    def attributes(self) -> dict[str, str | int | float]:
        """As result files hold it: a scalar each, where it is known, and what is left by family as JSON text."""
        found: dict[str, str | int | float] = {
            "cycles": self.cycles, "repeats_every_cycles": self.repeats, "settling_tolerance": self.tolerance,
            "settling_left_by_family": json.dumps(dict(self.left)),
        }  # fmt: skip
        if math.isfinite(self.parting):
            found["cycles_part_by"] = self.parting
        return found | ({"settling_left": self.worst[1]} if self.left else {})

    def as_dict(self) -> dict[str, object]:
        """As JSON holds it."""
        return {
            "cycles": self.cycles, "repeats_every_cycles": self.repeats, "tolerance": self.tolerance,
            "left": dict(self.left), **({"cycles_part_by": self.parting} if math.isfinite(self.parting) else {}),
        }  # fmt: skip


class Judge:
    """Families of outputs in the columns of recorded rows.

    ``families`` maps a name to its outputs' columns, ``of_block`` names those whose motion is the block's.
    """

    def __init__(self, families: Mapping[str, Sequence[int]], of_block: frozenset[str]) -> None:
        self._names = list(families)
        self._columns = np.array([column for columns in families.values() for column in columns], dtype=int)
        self._family = np.repeat(np.arange(len(families)), [len(columns) for columns in families.values()])
        self._of_block = np.array([name in of_block for name in families], dtype=bool)

    def weights(self, rows: Array) -> Array:
        """Weights (outputs,) by which rows (samples, outputs) have families with alternating parts of size 1."""
        sizes = self._alternating(rows)
        weights = np.zeros(rows.shape[1])
        weights[self._columns] = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=sizes > 0.0)[self._family]
        return weights

    def left(self, rows: Array, before: Array) -> dict[str, float]:
        """Difference by family between the rows (samples, outputs) of two cycles, over the first's alternating part."""
        return self._over(self._norms(rows - before), self._alternating(rows))

    def estimated(self, rows: Array, differences: Array, estimates: Sequence[tuple[Array, Array]]) -> dict[str, float]:
        """What is left by family of a cycle's rows, from those of others less these (k, samples, outputs).

        ``estimates`` are those of crank and block: what is known to be left (samples, outputs), and the weights (k,) of
        which the largest with its difference is left besides.
        """
        apart = np.array([self._norms(difference) for difference in differences])
        crank, block = (self._norms(known) + (weights[:, None] * apart).max(axis=0) for known, weights in estimates)
        return self._over(np.where(self._of_block, block, crank), self._alternating(rows))

    def _over(self, found: Array, sizes: Array) -> dict[str, float]:
        """By the names of families that are not constant."""
        shares = np.divide(found, sizes, out=np.zeros_like(found), where=sizes > 0.0)
        return {name: float(share) for name, share, size in zip(self._names, shares, sizes, strict=True) if size > 0.0}

    def _alternating(self, rows: Array) -> Array:
        """Size of each family's alternating part; 0 of those that are constant."""
        sizes = self._norms(rows - rows.mean(axis=0))
        least = np.maximum(LEAST * self._norms(rows), NOTHING * math.sqrt(len(rows)))
        return np.where(sizes > least, sizes, 0.0)

    def _norms(self, rows: Array) -> Array:
        """Norm of each family's part of rows (samples, outputs)."""
        squares = np.einsum("ij,ij->j", rows, rows)[self._columns]
        return np.sqrt(np.bincount(self._family, squares, len(self._names)))
