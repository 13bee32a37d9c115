"""Report of the calls to a process's units, in memory shared with the supervising process."""

from __future__ import annotations

import ctypes
from typing import Any

from cranktrain.coupling.unit import Around, Unit

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


CALLS = {
    "initialize": INITIALIZATION, "write": INPUTS, "read": OUTPUTS, "step": STEP, "keep": STATE, "restore": STATE,
    "close": END,
}  # fmt: skip
"""Calls that are reported."""


class Watched(Around):
    """A unit whose calls are reported; a step ends like an interrupt if the process is to stop."""

    def __init__(self, unit: Unit, place: int, notes: Notes) -> None:
        super().__init__(unit)
        self._place, self._notes = place, notes

    def _on(self, call: str, *arguments: Any) -> Any:
        """Call, and report the current call meanwhile."""
        notes = self._notes
        if call == "step" and notes.stop:
            raise KeyboardInterrupt
        if call not in CALLS:
            return super()._on(call, *arguments)
        notes.unit, notes.call = self._place, CALLS[call]
        notes.count += 1
        found = super()._on(call, *arguments)
        notes.call = NOTHING
        notes.count += 1
        return found
