"""What is left of settling in each family of outputs, without a further cycle.

A cycle that started from x has the outputs o, the one before x₋ and o₋: the change o − o₋ belongs to x − x₋. The
periodic cycle starts from x + e, with e estimated from the cycle's own end (:mod:`slow_modes`). So |e|/|x − x₋| times
the change is left, over the RMS of the outputs' alternating part. Sizes are energies: of the block for outputs that
need it, else of crank and pistons.
"""

from __future__ import annotations

import json
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


@dataclass(frozen=True)
class Settling:
    """How settled a run is.

    Attributes
    ----------
    cycles : that were run, those before the recorded ones included
    repeats : cycles after which the run repeats within the tolerance: 1, 2 or 4; 0 where it does not
    tolerance : of what may be left
    left : what the last cycle is still off the periodic one, by family of outputs (``bearing.force``): RMS of the
        difference over RMS of the alternating part; empty where one cycle has nothing to be compared with
    steady : whether a cycle repeats at all: not where a load torque leaves the speed free, which then is still changing
    """

    cycles: int
    repeats: int
    tolerance: float
    left: Mapping[str, float] = field(default_factory=dict)
    steady: bool = True

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
        return f"Settling: not periodic to {self.tolerance:g} after {count}; {what}"

    @property
    def attributes(self) -> dict[str, str | int | float]:
        """As result files hold it: a scalar each, where it is known, and what is left by family as JSON text."""
        found: dict[str, str | int | float] = {
            "cycles": self.cycles, "repeats_every_cycles": self.repeats, "settling_tolerance": self.tolerance,
            "settling_left_by_family": json.dumps(dict(self.left)),
        }  # fmt: skip
        return found | ({"settling_left": self.worst[1]} if self.left else {})

    def as_dict(self) -> dict[str, object]:
        """As JSON holds it."""
        return {
            "cycles": self.cycles, "repeats_every_cycles": self.repeats, "tolerance": self.tolerance,
            "left": dict(self.left),
        }  # fmt: skip


class Judge:
    """Families of outputs in the columns of recorded rows.

    ``families`` maps a name to its outputs' columns, ``of_block`` names those whose motion is the block's.
    """

    def __init__(self, families: Mapping[str, Sequence[int]], of_block: frozenset[str]) -> None:
        self._families = {name: np.array(columns, dtype=int) for name, columns in families.items()}
        self._of_block = of_block

    def left(self, rows: Array, before: Array, ratios: tuple[float, float] = (1.0, 1.0)) -> dict[str, float]:
        """What is left by family, from rows (samples, outputs) of a cycle and of one before.

        ``ratios`` are |e|/|x − x₋| of crank and block.
        """
        found = {}
        for name, columns in self._families.items():
            now = rows[:, columns]
            alternating = now - now.mean(axis=0)
            size = float(np.linalg.norm(alternating))
            if size > LEAST * float(np.linalg.norm(now)):
                change = float(np.linalg.norm(now - before[:, columns]))
                found[name] = change / size * ratios[name in self._of_block]
        return found
