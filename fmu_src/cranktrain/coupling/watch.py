"""Report of the calls to a process's units, in memory shared with the supervising process."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any

from cranktrain.core.reduced_body import Array
from cranktrain.coupling.unit import Port, Unit

NOTHING, INITIALIZATION, INPUTS, OUTPUTS, STEP, STATE, END = range(7)
WORDS = ("after a call", "initialization", "its inputs", "its outputs", "step", "its state", "its end")
"""Calls in words."""


class Notes(ctypes.Structure):
    """Entries of the report.

    ``unit`` counts in the master's order, ``call`` as above, ``count`` rises with each call and each end of one;
    ``time`` (s) is the last communication point, ``seconds`` the run's wall time, ``stop`` asks the process to end.
    """

    _fields_ = (
        ("unit", ctypes.c_int), ("call", ctypes.c_int), ("count", ctypes.c_longlong), ("time", ctypes.c_double),
        ("seconds", ctypes.c_double), ("sweeps", ctypes.c_longlong), ("refused", ctypes.c_longlong),
        ("stop", ctypes.c_int),
    )  # fmt: skip


class Watched:
    """A unit whose calls are reported; see :class:`cranktrain.coupling.unit.Unit`."""

    def __init__(self, unit: Unit, place: int, notes: Notes) -> None:
        self._unit, self._place, self._notes = unit, place, notes
        self.name, self.restorable = unit.name, unit.restorable
        self.inputs: Mapping[str, Port] = unit.inputs
        self.outputs: Mapping[str, Port] = unit.outputs

    def link(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """See the protocol."""
        self._unit.link(inputs, outputs)

    def initialize(self, time: float) -> None:
        """See the protocol."""
        self._told(INITIALIZATION, self._unit.initialize, time)

    def write(self, values: Array) -> None:
        """See the protocol."""
        self._told(INPUTS, self._unit.write, values)

    def read(self) -> Array:
        """See the protocol."""
        found: Array = self._told(OUTPUTS, self._unit.read)
        return found

    def step(self, time: float, size: float) -> None:
        """See the protocol; ends like an interrupt if the process is to stop."""
        if self._notes.stop:
            raise KeyboardInterrupt
        self._told(STEP, self._unit.step, time, size)

    def keep(self, held: Any = None) -> Any:
        """See the protocol."""
        return self._told(STATE, self._unit.keep, held)

    def restore(self, state: Any) -> None:
        """See the protocol."""
        self._told(STATE, self._unit.restore, state)

    def close(self) -> None:
        """See the protocol."""
        self._told(END, self._unit.close)

    def _told(self, call: int, function: Any, *arguments: Any) -> Any:
        """Call, and report the current call meanwhile."""
        notes = self._notes
        notes.unit, notes.call = self._place, call
        notes.count += 1
        found = function(*arguments)
        notes.call = NOTHING
        notes.count += 1
        return found
