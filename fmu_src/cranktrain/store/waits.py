"""Progress lines on stderr: one for each step that takes longer than a second, none for shorter ones."""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

from cranktrain.core.announcement import heard_compiling
from cranktrain.core.cache import cache_folder
from cranktrain.store.side_by_side import BEFORE_PROCESSES

LINES: ContextVar[bool] = ContextVar("LINES", default=True)
"""True to print a line for each stage if stderr is no terminal; calls of the library print only long stages."""
LATE, AGAIN = 1.0, 10.0
"""Seconds after which the name of a step of work is printed, and seconds between its further progress lines."""


def print_line(text: str) -> None:
    """Print a line on stderr."""
    print(text, file=sys.stderr, flush=True)


class Waits:
    """Prints the name of a step once it has taken :data:`LATE` seconds, unless the next step or the end comes first.

    Parameters
    ----------
    title : text before each step
    line : function that receives each line
    """

    def __init__(self, title: str = "", line: Callable[[str], None] = print_line) -> None:
        self._title, self._line = title, line
        self._timer: threading.Timer | None = None
        self._pending = ""
        self._told = time.monotonic()
        self._lock = threading.Lock()

    def tell(self, stage: str) -> None:
        """Begin a step of work named ``stage``; the step before ends."""
        self.end()
        with self._lock:
            self._pending = f"{self._title}: {stage}" if self._title and stage else self._title or stage
            self._told = time.monotonic()
            self._timer = threading.Timer(LATE, self._say)
            self._timer.daemon = True
            self._timer.start()

    def follow(self, share: float) -> None:
        """Report that the fraction ``share`` of a step is done; a line is printed from time to time."""
        if share < 1.0 and time.monotonic() - self._told > AGAIN:
            self._told = time.monotonic()
            self._line(f"{self._title}: {100.0 * share:.0f} %")

    def now(self) -> None:
        """Print the pending step at once; used before long work that cannot run next to a timer thread."""
        if self._timer is not None:
            self._stop()
            self._say()

    def end(self) -> None:
        """End the step; a short step is not printed."""
        self._stop()
        self._pending = ""

    def _stop(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer.join()
            self._timer = None

    def _say(self) -> None:
        with self._lock:
            text, self._pending = self._pending, ""
            if text:
                self._line(text)


@contextmanager
def waits(title: str = "", line: Callable[[str], None] = print_line) -> Iterator[Waits]:
    """Context that prints the steps of its block, also before processes are started; see :class:`Waits`."""
    made = Waits(title, line)
    BEFORE_PROCESSES.append(made.now)
    try:
        yield made
    finally:
        BEFORE_PROCESSES.remove(made.now)
        made.end()


class _Compiled:
    """Listener of numba's compile events that prints a line once all compilation has taken :data:`LATE` seconds."""

    def __init__(self, told: Waits) -> None:
        self._told, self._depth, self._began, self._spent = told, 0, 0.0, 0.0

    def notify(self, event: Any) -> None:
        """Handle the start or end of a kernel's compilation. Events are nested: called kernels compile in between."""
        self._depth += 1 if event.is_start else -1
        if event.is_start and self._depth == 1:
            self._began = time.monotonic()
            if self._spent < LATE:
                self._told.tell(compiling_text())
        elif event.is_end and self._depth == 0:
            self._spent += time.monotonic() - self._began
            if self._spent > LATE:
                self._told.now()
            self._told.end()


def compiling_text(system: str = sys.platform) -> str:
    """Message while kernels compile, for a ``system`` named as in ``sys.platform``."""
    untested = "; there is no machine code for macOS, where this program is untested" if system == "darwin" else ""
    folder = cache_folder() / "kernels"
    return f"compiling kernels that are not in this package's machine code{untested}; kept in {folder}"


@contextmanager
def told_compiling(line: Callable[[str], None] = print_line) -> Iterator[None]:
    """Context that prints a line if kernels compile for more than a second."""
    with waits(line=line) as told, heard_compiling(_Compiled(told)):
        yield
