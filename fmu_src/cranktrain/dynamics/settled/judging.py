"""Settling error of each output family: RMS of the difference over RMS of the alternating part."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from cranktrain.core.reduced_body import Array

TOLERANCE = 1.0e-3
"""Default tolerance of the settling error of each output family."""
MOST_CYCLES = 48
"""Most cycles of a run; a run whose cycles do not repeat ends here."""
FREE_CYCLES = 6
"""Default number of cycles of a run whose speed is free under a load torque, which would settle only after seconds."""
FLAT = 1.0e-6
"""Ratio of the alternating part of an output to its RMS below which errors are related to this part of the RMS.

The alternating part of a steady force, the weight of a balanced disc on its bearing, is an error of the integration."""
LEAST = 1.0e-9
"""Ratio of the alternating part of an output to its RMS below which the output counts as constant."""
NOTHING = 1.0e-13
"""Alternating part (RMS, SI) of any output that counts as rounding; moments of an untilted collar are 1e-15 N m."""


@dataclass(frozen=True)
class Settling:
    """Settling of a run: the distance of its last cycle from periodic motion, by output family.

    Attributes
    ----------
    cycles : number of cycles that were run, including those before the recorded ones
    repeats : period of the run in cycles within the tolerance, 1 to 6; 0 if it is not periodic
    tolerance : tolerance of the settling error
    left : distance of the last cycle from the periodic one, by output family (``bearing.force``): RMS of the difference
       over RMS of the alternating part; empty if there is only one cycle
    steady : whether the speed is given; a speed that is free under a load torque is still changing
    parting : factor by which the difference of similar cycles grows per cycle, if the run ended because it has no
       period; else not a number
    """

    cycles: int
    repeats: int
    tolerance: float
    left: Mapping[str, float] = field(default_factory=dict)
    steady: bool = True
    parting: float = math.nan

    @property
    def worst(self) -> tuple[str, float]:
        """Output family with the largest settling error, and the error; NaN if no error is known."""
        return max(self.left.items(), key=lambda item: item[1], default=("", float("nan")))

    @property
    def text(self) -> str:
        """Settling as one sentence for users."""
        count = f"{self.cycles} cycle" + ("s" if self.cycles > 1 else "")
        if not self.left:
            return f"Settling: unknown after {count}; run two or more, or until the outputs repeat"
        family, most = self.worst
        what = f"settling error {most:.1e}, largest in {family}"
        if not self.steady:
            return f"Settling: the speed is free; the last of {count} changed {family} by {most:.1e}"
        if self.repeats > 1:
            return f"Settling: repeats every {self.repeats} cycles, after {count}; {what}"
        if self.repeats == 1:
            return f"Settling: periodic after {count}; {what}"
        if math.isfinite(self.parting):
            return (
                f"Settling: no period after {count}: the difference of similar cycles grows by a factor of "
                f"{self.parting:.2g} per cycle; {what}"
            )
        return f"Settling: not periodic to {self.tolerance:g} after {count}; {what}"

    @property
    def attributes(self) -> dict[str, str | int | float]:
        """Attributes of result files: a scalar for each known value, and the settling error by family as JSON text."""
        found: dict[str, str | int | float] = {
            "cycles": self.cycles, "repeats_every_cycles": self.repeats, "settling_tolerance": self.tolerance,
            "settling_left_by_family": json.dumps(dict(self.left)),
        }  # fmt: skip
        if math.isfinite(self.parting):
            found["cycles_part_by"] = self.parting
        return found | ({"settling_left": self.worst[1]} if self.left else {})

    def as_dict(self) -> dict[str, object]:
        """Settling as a dictionary for JSON."""
        return {
            "cycles": self.cycles, "repeats_every_cycles": self.repeats, "tolerance": self.tolerance,
            "left": dict(self.left), **({"cycles_part_by": self.parting} if math.isfinite(self.parting) else {}),
        }  # fmt: skip


class Judge:
    """Computes settling errors from recorded rows, in which each output family has known columns.

    ``families`` maps a name to its outputs' columns, ``of_block`` names those whose motion is the block's.
    """

    def __init__(self, families: Mapping[str, Sequence[int]], of_block: frozenset[str]) -> None:
        self._names = list(families)
        self._columns = np.array([column for columns in families.values() for column in columns], dtype=int)
        self._family = np.repeat(np.arange(len(families)), [len(columns) for columns in families.values()])
        self._of_block = np.array([name in of_block for name in families], dtype=bool)

    def weights(self, rows: Array) -> Array:
        """Weights (outputs,) that scale the alternating part of each family in rows (samples, outputs) to size 1."""
        sizes = self._alternating(rows)
        weights = np.zeros(rows.shape[1])
        weights[self._columns] = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=sizes > 0.0)[self._family]
        return weights

    def left(self, rows: Array, before: Array) -> dict[str, float]:
        """Difference by family between rows (samples, outputs) of two cycles, over the alternating part of ``rows``."""
        return self._over(self._norms(rows - before), self._alternating(rows))

    def estimated(self, rows: Array, differences: Array, estimates: Sequence[tuple[Array, Array]]) -> dict[str, float]:
        """Settling error of each family in a cycle's rows, from ``differences`` (k, samples, outputs) of other cycles.

        ``estimates`` belong to crank and block: the known part of the error (samples, outputs), and weights (k,). The
        unknown part is the largest product of a weight and its difference.
        """
        apart = np.array([self._norms(difference) for difference in differences])
        crank, block = (self._norms(known) + (weights[:, None] * apart).max(axis=0) for known, weights in estimates)
        return self._over(np.where(self._of_block, block, crank), self._alternating(rows))

    def _over(self, found: Array, sizes: Array) -> dict[str, float]:
        """Ratios ``found`` / ``sizes`` by the names of all families that are not constant."""
        shares = np.divide(found, sizes, out=np.zeros_like(found), where=sizes > 0.0)
        return {name: float(share) for name, share, size in zip(self._names, shares, sizes, strict=True) if size > 0.0}

    def _alternating(self, rows: Array) -> Array:
        """Size of each family's alternating part, at least ``FLAT`` of the whole; 0 for constant families."""
        sizes, whole = self._norms(rows - rows.mean(axis=0)), self._norms(rows)
        least = np.maximum(LEAST * whole, NOTHING * math.sqrt(len(rows)))
        return np.where(sizes > least, np.maximum(sizes, FLAT * whole), 0.0)

    def _norms(self, rows: Array) -> Array:
        """Norm of each family's part of rows (samples, outputs)."""
        squares = np.einsum("ij,ij->j", rows, rows)[self._columns]
        return np.sqrt(np.bincount(self._family, squares, len(self._names)))
