"""Base class of schemes whose last unit calls its master inside a step (FMI 3.0).

A unit that calls its master has the attribute ``updates``, true, and a method ``listen`` that registers two functions
of a time (s). The unit calls the first at a point that it has reached, the second for inputs at a later time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from cranktrain.core.errors import InputError
from cranktrain_lab.coupling.unit import Unit, UnitError

Master: TypeAlias = Any
"""Stands for :class:`cranktrain_lab.coupling.master.Master`, which cannot be imported here (circular import)."""


class Updates:
    """Handler of calls by the last unit in a master's order inside a step.

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
