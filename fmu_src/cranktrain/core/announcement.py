"""What an FMU's user is told while kernels compile at the first start on a machine."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from numba.core import event


class _Announcement(event.Listener):
    """Says on stderr that kernels are being compiled, when the first one is."""

    said = False

    def __init__(self, instance: str, time: str) -> None:
        self.instance, self.time = instance, time

    def on_start(self, event: Any) -> None:
        """Before a kernel compiles: one line, once in a process."""
        if _Announcement.said:
            return
        _Announcement.said = True
        place = event.data["dispatcher"]._cache.cache_path
        kept = f"kept in {Path(place).parents[1]}" if place else "not kept, because the cache cannot be written"
        print(
            f"cranktrain: {self.instance}: compiling kernels, up to {self.time} of processor time at the first start "
            f"of this FMU's code and levels on a machine; {kept}",
            file=sys.stderr,
            flush=True,
        )

    def on_end(self, event: Any) -> None:
        """Nothing: kernels compile within each other."""


@contextmanager
def announced(instance: str, time: str) -> Iterator[None]:
    """Let the user of an instance know what takes so long, up to ``time`` in words, while kernels compile."""
    with event.install_listener("numba:compile", _Announcement(instance, time)):
        yield
