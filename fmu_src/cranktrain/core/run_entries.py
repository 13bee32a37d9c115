"""The entries of a run: from the library of machine code where there is one, else compiled by numba."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from cranktrain.core.kernel import typed_kernel
from cranktrain.core.machine_code import library
from cranktrain.core.records import layout, record_image

ENTRIES = {"prepare": "prepare", "start": "start", "advance": "advance_run", "observe": "observe_run"}
"""Entries of a run, and the kernels of the module that defines its record."""


class RunEntries:
    """What a run can do; each gives a status.

    Parameters
    ----------
    kind : of the library, see :data:`cranktrain.core.machine_code.RESTS_ON`
    run : record of the run; its arrays are used in place
    kernels : by the names of ``ENTRIES``
    """

    def __init__(self, kind: str, run: Any, kernels: Mapping[str, Any]) -> None:
        self.run = run
        code = library(kind)
        if code is not None and code.layout == layout(run):
            self._image = record_image(run)
            address = int(self._image.ctypes.data)
            calls: dict[str, Callable[..., Any]] = {
                name: partial(entry, address) for name, entry in code.entries.items()
            }
            self.prepare, self.observe = partial(calls["prepare"], 0.0), partial(calls["observe"], 0.0)
            self.start, self.advance = calls["start"], calls["advance"]
            return
        self.prepare, self.observe = (partial(self._compiled, kernels[name]) for name in ("prepare", "observe"))
        self.start, self.advance = (partial(self._compiled, kernels[name]) for name in ("start", "advance"))
        self._entries: dict[Any, Callable[..., Any]] = {}

    def _compiled(self, kernel: Any, *x: float) -> int:
        """Call a kernel, compiled at its first call."""
        entry = self._entries.get(kernel)
        if entry is None:
            entry = self._entries[kernel] = typed_kernel(kernel, self.run, *x)
        return int(entry(self.run, *x))
