"""Announcement on stderr that an FMU compiles its kernels at the first start on a machine."""

import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from cranktrain.core.kernel import BEFORE_COMPILING, compiler

_said: list[str] = []


class _Announcement:
    """Listener of numba's compile events that prints one line to stderr when the first kernel is compiled."""

    def __init__(self, instance: str, time: str) -> None:
        self.instance, self.time = instance, time

    def notify(self, event: Any) -> None:
        """Print the announcement at the first start of a compilation, once in a process."""
        if _said or not event.is_start:
            return
        place = event.data["dispatcher"]._cache.cache_path
        kept = f"kept in {Path(place).parents[1]}" if place else "not kept, because the cache cannot be written"
        _said.append(
            f"cranktrain: {self.instance}: compiling kernels, up to {self.time} of processor time at the first start "
            f"of this FMU's code and levels on a machine; {kept}"
        )
        print(_said[0], file=sys.stderr, flush=True)


@contextmanager
def announced(instance: str, time: str) -> Iterator[None]:
    """Context that announces compilations to the user of ``instance``; ``time`` is their longest duration in words."""
    with heard_compiling(_Announcement(instance, time)):
        yield


@contextmanager
def heard_compiling(listener: Any) -> Iterator[None]:
    """Context that passes numba's compile events to a listener; numba is loaded only if something is compiled."""
    with ExitStack() as listening:

        def listen() -> None:
            from numba.core import event

            event.Listener.register(type(listener))
            listening.enter_context(event.install_listener("numba:compile", listener))

        if compiler.cache_info().currsize:
            listen()
            yield
            return
        BEFORE_COMPILING.append(listen)
        try:
            yield
        finally:
            BEFORE_COMPILING.remove(listen)
