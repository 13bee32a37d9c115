"""Entries of a run, from the library of machine code if there is one, else compiled by numba."""

from collections.abc import Callable
from functools import partial
from typing import Any

from cranktrain.core.kernel import typed_kernel
from cranktrain.core.machine_code import ENTRIES, library
from cranktrain.core.records import layout, record_image


class RunEntries:
    """Operations of a run, each a single call that returns a status.

    Entries of the library do not hold Python's lock, so runs in several threads proceed in parallel. One run serves
    one thread at a time.

    Parameters
    ----------
    kind : kind of the library, see :data:`cranktrain.core.machine_code.RESTS_ON`
    run : record of the run; its arrays are used in place from now on
    kernels : module that has the kernels named in ``ENTRIES``

    Attributes
    ----------
    run : record of the run
    compiles : True if numba compiles the entries, each at its first call
    """

    def __init__(self, kind: str, run: Any, kernels: Any) -> None:
        self.run = run
        self._entries: dict[str, Callable[[float], int]]
        code = library(kind)
        self.compiles = code is None or code.layout != layout(run)
        if code is not None and not self.compiles:
            self._image = record_image(run)
            address = int(self._image.ctypes.data)
            self._entries = {name: partial(entry, address) for name, entry in code.entries.items()}
        else:
            self._entries = {name: _Compiled(run, getattr(kernels, kernel)) for name, kernel in ENTRIES.items()}

    def prepare(self) -> int:
        """Fill the model from the run's numbers. Return a status (0: success)."""
        return self._entries["prepare"](0.0)

    def start(self, time: float) -> int:
        """Start the run at a time, s, with the present inputs. Return a status (0: success)."""
        return self._entries["start"](time)

    def advance(self, t_end: float) -> int:
        """Advance the run to ``t_end``, s, and write the outputs. Return a status (0: success)."""
        return self._entries["advance"](t_end)

    def observe(self) -> int:
        """Write the outputs of the present state. Return a status (0: success)."""
        return self._entries["observe"](0.0)


class _Compiled:
    """Kernel of a run, with or without a number as second argument, compiled at the first call."""

    def __init__(self, run: Any, kernel: Any) -> None:
        self._run, self._kernel = run, kernel
        self._takes_number = kernel.py_func.__code__.co_argcount == 2
        self._entry: Callable[..., Any] | None = None

    def __call__(self, x: float) -> int:
        arguments = (self._run, float(x)) if self._takes_number else (self._run,)
        if self._entry is None:
            self._entry = typed_kernel(self._kernel, *arguments)
        return int(self._entry(*arguments))
