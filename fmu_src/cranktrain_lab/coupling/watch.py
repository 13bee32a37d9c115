"""Record of the current call to a unit, in memory shared with the supervising process."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from cranktrain.core.unit_turns import (
    CLOSING,
    INITIALIZATION,
    INPUTS,
    NOTE_SLOTS,
    NOTHING,
    OUTPUTS,
    STATE,
    STEPPING,
)
from cranktrain_lab.coupling.turns import Direct
from cranktrain_lab.coupling.unit import Around, Unit

WORDS = ("after a call", "initialization", "its inputs", "its outputs", "step", "its state", "its end")
"""Names of unit calls in messages, by the code of the call."""


class Notes(ctypes.Structure):
    """Entries of the shared record of a unit's current call.

    ``unit`` is the index in the master's order, ``call`` the index in :data:`WORDS`. ``count`` increases at the begin
    and end of each call. ``points`` counts the communication points in the file, ``time`` (s) is the last one,
    ``seconds`` the run's wall time. ``stop`` asks the process to end. The first NOTE_SLOTS entries are the kernel's.
    """

    _fields_ = (
        ("unit", ctypes.c_int64), ("call", ctypes.c_int64), ("count", ctypes.c_int64), ("stop", ctypes.c_int64),
        ("sweeps", ctypes.c_int64), ("refused", ctypes.c_int64), ("points", ctypes.c_int64), ("time", ctypes.c_double),
        ("seconds", ctypes.c_double),
    )  # fmt: skip


CALLS = {
    "initialize": INITIALIZATION, "write": INPUTS, "read": OUTPUTS, "step": STEPPING, "keep": STATE,
    "restore": STATE, "close": CLOSING,
}  # fmt: skip
"""Codes of the methods whose calls are recorded."""


class Watched(Around):
    """Wrapper of a unit that records its calls; ``step`` raises ``KeyboardInterrupt`` if the process is to stop."""

    def __init__(self, unit: Unit, place: int, notes: Notes) -> None:
        super().__init__(unit)
        self._place, self._notes = place, notes

    def direct(self) -> Direct | None:
        """Return the unit's description for compiled code, which then records the calls."""
        offer = getattr(self._unit, "direct", None)
        found: Direct | None = None if offer is None else offer()
        if found is None:
            return None
        return found._replace(notes=np.frombuffer(memoryview(self._notes), np.int64, NOTE_SLOTS), place=self._place)

    def listen(self, *calls: Callable[[float], None]) -> None:
        """Register functions that the unit calls inside a step, and record the step again after each call."""
        super().listen(*(partial(self._reported, call) for call in calls))

    def _reported(self, call: Callable[[float], None], time: float) -> None:
        call(time)
        self._notes.unit, self._notes.call = self._place, CALLS["step"]
        self._notes.count += 1

    def _on(self, call: str, *arguments: Any) -> Any:
        """Call a method of the unit and record it as the unit's current call."""
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
