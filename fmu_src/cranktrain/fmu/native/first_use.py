"""Libraries of machine code that are made when a run first asks for their kernels."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from cranktrain.core import machine_code
from cranktrain.core.errors import InputError
from cranktrain.store.waits import print_line, told_compiling


@contextmanager
def made_at_first_use(line: Callable[[str], None] = print_line) -> Iterator[None]:
    """Make in this block the libraries that lack, for this and all later runs; ``line`` tells what takes long.

    Where no compiler links them, numba compiles the kernels that are called.
    """

    def make(kind: str) -> bool:
        from cranktrain.fmu.native import link

        try:
            link.library(kind, machine_code.this_platform(), line)
        except (InputError, OSError):
            return False
        return True

    machine_code.makers.append(make)
    try:
        with told_compiling(line):
            yield
    finally:
        machine_code.makers.remove(make)
