"""Calls of a master by its last unit inside a step (FMI 3.0): what all schemes that use them have in common.

A unit that calls its master has the attribute ``updates``, true, and a method ``listen`` that takes functions to call
with a time in s: at a point that the unit has reached and, if it asks for inputs beforehand, at one that lies ahead.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from cranktrain.core.errors import InputError
from cranktrain_lab.coupling.unit import Unit, UnitError

Master: TypeAlias = Any
"""A :class:`cranktrain_lab.coupling.master.Master`, which imports the schemes."""


class Updates:
    """The last unit in a master's order, which calls its master inside a step.

    Nothing may be raised into the unit that calls. An error in a call is kept, and raised when the step has returned.
    """

    def __init__(self, order: Sequence[Unit], scheme: str) -> None:
        """``InputError`` that names the scheme if the last unit does not call its master."""
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
        """Let the unit take its step; an error in one of its calls goes before the unit's own."""
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
        """A function that the unit may call: it raises nothing, and does nothing after an error."""

        def called(time: float) -> None:
            if self._error is not None:
                return
            try:
                call(time)
            except BaseException as error:  # an interrupt too: the unit would swallow it
                self._error = error

        return called
