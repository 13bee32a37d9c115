"""Interface of a unit (an FMU or any object that takes steps) to a master: names, values, steps, states."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from cranktrain.core.errors import CranktrainError
from cranktrain.core.reduced_body import Array

DIMENSIONS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
"""SI base units, as FMI counts them."""


@dataclass(frozen=True)
class Port:
    """One real input or output of a unit.

    Attributes
    ----------
    unit : as the unit calls it, empty for none
    factor, offset : SI value = factor · value + offset
    dimensions : exponents of :data:`DIMENSIONS`; None where nothing is known
    low, high : bounds, in ``unit``
    feeds : outputs that an input changes without a step
    """

    unit: str = ""
    factor: float = 1.0
    offset: float = 0.0
    dimensions: tuple[int, ...] | None = None
    low: float = -float("inf")
    high: float = float("inf")
    feeds: frozenset[str] = frozenset()


class UnitError(CranktrainError):
    """A unit refused a value or a step: its name, the time and its message."""


class EndingError(UnitError):
    """A unit did not end well, after a run that is complete and that the end leaves as it was."""


class Unit(Protocol):
    """A unit under a master.

    Attributes
    ----------
    name : in results and messages
    inputs, outputs : its real inputs and outputs
    restorable : whether its state can be kept and set again
    """

    name: str
    inputs: Mapping[str, Port]
    outputs: Mapping[str, Port]
    restorable: bool

    def link(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Name the inputs that ``write`` sets and the outputs that ``read`` returns, in their order."""

    def initialize(self, time: float) -> None:
        """Get ready for steps from ``time`` (s) on, with the inputs that were written."""

    def write(self, values: Array) -> None:
        """Set the linked inputs (k,)."""

    def read(self) -> Array:
        """Linked outputs (k,); the array may be the same each time."""

    def step(self, time: float, size: float) -> None:
        """Go from ``time`` to ``time + size``, s; ``UnitError`` where it cannot."""

    def keep(self, held: Any = None) -> Any:
        """The state; ``held`` is an earlier state whose memory may be reused."""

    def restore(self, state: Any) -> None:
        """Set a state of ``keep``."""

    def close(self) -> None:
        """End it; harmless where it has ended. ``EndingError``: it did not end well; ``UnitError``: fatally."""


class Around:
    """A unit around another one, to which all calls go on; see :class:`Unit`."""

    def __init__(self, unit: Unit) -> None:
        self._unit = unit
        self.name, self.restorable = unit.name, unit.restorable
        self.inputs, self.outputs = unit.inputs, unit.outputs
        self.updates = bool(getattr(unit, "updates", False))

    def _on(self, call: str, *arguments: Any) -> Any:
        return getattr(self._unit, call)(*arguments)

    def link(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """See the protocol."""
        self._on("link", inputs, outputs)

    def initialize(self, time: float) -> None:
        """See the protocol."""
        self._on("initialize", time)

    def write(self, values: Array) -> None:
        """See the protocol."""
        self._on("write", values)

    def read(self) -> Array:
        """See the protocol."""
        found: Array = self._on("read")
        return found

    def step(self, time: float, size: float) -> None:
        """See the protocol."""
        self._on("step", time, size)

    def keep(self, held: Any = None) -> Any:
        """See the protocol."""
        return self._on("keep", held)

    def restore(self, state: Any) -> None:
        """See the protocol."""
        self._on("restore", state)

    def listen(self, *calls: Callable[[float], None]) -> None:
        """See :mod:`cranktrain_lab.coupling.intermediate` and :mod:`cranktrain_lab.coupling.stages`."""
        unit: Any = self._unit
        unit.listen(*calls)

    def close(self) -> None:
        """See the protocol."""
        self._on("close")
