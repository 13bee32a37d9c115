"""Interface of a unit (an FMU or any object that takes steps) to a master: names, values, steps, states, calls."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.core.reduced_body import Array

DIMENSIONS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
"""SI base units in the order of FMI."""


@dataclass(frozen=True)
class Port:
    """One real input or output of a unit.

    Attributes
    ----------
    unit : name of the unit of measurement, empty for none
    factor, offset : SI value = factor · value + offset
    dimensions : exponents of :data:`DIMENSIONS`; None if unknown
    low, high : bounds, in ``unit``
    feeds : outputs that depend on an input without a step (direct feedthrough)
    """

    unit: str = ""
    factor: float = 1.0
    offset: float = 0.0
    dimensions: tuple[int, ...] | None = None
    low: float = -float("inf")
    high: float = float("inf")
    feeds: frozenset[str] = frozenset()


class UnitError(CranktrainError):
    """Error of a unit that refused a value or a step, with its name, the time and its message."""


class EndingError(UnitError):
    """Error of a unit that could not be closed after a run; the run itself is complete and valid."""


class Unit(Protocol):
    """A unit under a master.

    Attributes
    ----------
    name : name in results and messages
    inputs, outputs : real inputs and outputs
    restorable : True if its state can be kept and restored
    """

    name: str
    inputs: Mapping[str, Port]
    outputs: Mapping[str, Port]
    restorable: bool

    def link(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Choose the inputs that ``write`` sets and the outputs that ``read`` returns, in this order."""

    def initialize(self, time: float) -> None:
        """Prepare for steps from ``time`` (s) on, with the inputs that were written."""

    def write(self, values: Array) -> None:
        """Set the linked inputs (k,); by default there are none."""
        return

    def read(self) -> Array:
        """Return the linked outputs (k,); the array may be the same object each time."""

    def step(self, time: float, size: float) -> None:
        """Go from ``time`` to ``time + size``, s; raises ``UnitError`` if the step fails."""

    def keep(self, held: Any = None) -> Any:
        """Return the state; ``held`` is an earlier state whose memory may be reused."""

    def restore(self, state: Any) -> None:
        """Restore a state that ``keep`` returned."""

    def close(self) -> None:
        """Release the unit; may be called repeatedly. Raises ``EndingError``, or ``UnitError`` if fatal."""
        return


class Around:
    """Wrapper of a unit that forwards all calls; see :class:`Unit`."""

    def __init__(self, unit: Unit) -> None:
        self._unit = unit
        self.name, self.restorable = unit.name, unit.restorable
        self.inputs, self.outputs = unit.inputs, unit.outputs
        self.updates = bool(getattr(unit, "updates", False))

    def _on(self, call: str, *arguments: Any) -> Any:
        return getattr(self._unit, call)(*arguments)

    def link(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Choose the inputs that ``write`` sets and the outputs that ``read`` returns."""
        self._on("link", inputs, outputs)

    def initialize(self, time: float) -> None:
        """Prepare the unit for steps from ``time`` (s) on."""
        self._on("initialize", time)

    def write(self, values: Array) -> None:
        """Set the values (k,) of the k linked inputs."""
        self._on("write", values)

    def read(self) -> Array:
        """Return the values (k,) of the k linked outputs."""
        found: Array = self._on("read")
        return found

    def step(self, time: float, size: float) -> None:
        """Advance the unit from ``time`` (s) by one step of ``size`` (s)."""
        self._on("step", time, size)

    def keep(self, held: Any = None) -> Any:
        """Return the unit's state; memory of the earlier state ``held`` may be reused."""
        return self._on("keep", held)

    def restore(self, state: Any) -> None:
        """Restore a state of the unit that ``keep`` returned."""
        self._on("restore", state)

    def listen(self, *calls: Callable[[float], None]) -> None:
        """Register functions that the unit calls inside a step, see :mod:`cranktrain_lab.coupling.unit`."""
        unit: Any = self._unit
        unit.listen(*calls)

    def close(self) -> None:
        """Release the unit and its memory; may be called repeatedly."""
        self._on("close")


Master: TypeAlias = Any
"""Stands for :class:`cranktrain_lab.coupling.master.Master`, which cannot be imported here (circular import)."""


class Updates:
    """Base class of schemes whose last unit calls its master inside a step (FMI 3.0).

    Such a unit has the attribute ``updates``, true, and a method ``listen`` that registers two functions of a time (s).
    The unit calls the first at a point that it has reached, the second for inputs at a later time.

    A call must not raise errors into the unit. An error in a call is stored, and raised when the step has returned.
    """

    def __init__(self, order: Sequence[Unit], scheme: str) -> None:
        """Take the last unit of ``order``; raises ``InputError`` with the scheme if it does not call its master."""
        unit: Any = order[-1]
        if not getattr(unit, "updates", False):
            raise InputError(
                f"scheme '{scheme}': {unit.name} does not call its master inside a step; take gauss-seidel, or an FMU "
                "of FMI 3.0 with providesIntermediateUpdate (build_fmu.py --fmi 3.0)"
            )
        self._unit, self._place = unit, len(order) - 1
        self._master: Master = None
        self._error: BaseException | None = None

    def _take(self, begin: float, size: float) -> None:
        """Let the last unit take its step. An error in one of its calls takes precedence over the unit's own error."""
        self._error = None
        try:
            self._unit.step(begin, size)
        except UnitError as error:
            if self._error is None:
                when = f"step from {begin:.6g} s to {begin + size:.6g} s"
                raise UnitError(f"{self._unit.name}, {when}: {error}") from None
        if self._error is not None:
            raise self._error

    def _guarded(self, call: Callable[[float], None]) -> Callable[[float], None]:
        """Return a wrapped function for the unit to call, which raises nothing, and does nothing after an error."""

        def called(time: float) -> None:
            if self._error is not None:
                return
            try:
                call(time)
            except BaseException as error:  # includes interrupts, which the unit would suppress
                self._error = error

        return called
