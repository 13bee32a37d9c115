"""Making of machine code libraries when a run first needs their kernels."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from cranktrain.core import machine_code
from cranktrain.core.errors import InputError
from cranktrain.store.waits import print_line, told_compiling


@contextmanager
def made_at_first_use(line: Callable[[str], None] = print_line) -> Iterator[None]:
    """Context in which missing libraries are made, for this and all later runs; ``line`` receives messages.

    If there is no compiler to link them, numba compiles the kernels at their first call.
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
