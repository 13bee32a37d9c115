"""Early end of a verb by an interrupt, a termination or an error: one line of text and one JSON object."""

import errno
import os
import re
import signal
import sys
import tempfile
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

from cranktrain.cli.signals import NOTHING, begun, outside

LONGEST = 1500
"""Largest number of characters of a line; the middle of a longer line is left out."""
_REFUSALS = {errno.ENAMETOOLONG, errno.EACCES, errno.EPERM, errno.EROFS, errno.ELOOP, errno.ENOTDIR, errno.EISDIR}
"""Error numbers of the system for a file that cannot be accessed or cannot exist."""
_PLACE = re.compile(r"--[a-z-]+(?= )|((?:[^\s:]+|[^:]*[/\\][^:]*|[^:]*\.\w{1,5}): )+")


class Stopped(KeyboardInterrupt):
    """Exception that a signal raises; its argument is the signal.

    It is a class of its own because Python ends a process with SIGINT, whatever its exit code, if a plain
    ``KeyboardInterrupt`` has ever left code that ``exec`` runs, as in the making of a dataclass.
    """


def one_line(text: str) -> str:
    """Text as one line of limited length, without control characters."""
    plain = " ".join(text.split())
    plain = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in plain)
    return plain if len(plain) <= LONGEST else f"{plain[: LONGEST - 200]} … {plain[-190:]}"


def parts(text: str) -> dict[str, str | None]:
    """Parts of an error message (what, where, remedy); None for a missing part.

    Messages have the form ``where: what; remedy`` or ``--option value is not …; remedy``.
    """
    what, _, remedy = text.rpartition("; ")
    what, remedy = (what, remedy) if what else (text, "")
    place = _PLACE.match(what)
    where = place.group().removesuffix(": ") if place else ""
    if place and not where.startswith("--"):
        what = what[place.end() :]
    return {"what": what, "where": where or None, "remedy": remedy or None}


@contextmanager
def terminable(stopped: list[signal.Signals]) -> Iterator[None]:
    """Let a termination end a verb like an interrupt, and append the signal of either to ``stopped``.

    An interrupt that arrives in a function whose errors Python ignores arrives once more. One that the caller ignores,
    as a shell's background job does, stays ignored.
    """
    process = os.getpid()

    def stop(number: int, frame: Any) -> NoReturn:
        if os.getpid() != process:
            os._exit(128 + number)  # a fork that has not yet set its own answer
        stopped.append(signal.Signals(number))
        raise Stopped(stopped[-1])

    def ignored(unraisable: Any) -> None:
        if not issubclass(unraisable.exc_type, KeyboardInterrupt) or not stopped:
            hook(unraisable)
            return
        again = threading.Timer(0.01, os.kill, (os.getpid(), stopped[-1]))
        again.daemon = True
        again.start()

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    begun()
    usual = signal.getsignal(signal.SIGINT) in (signal.default_int_handler, signal.SIG_DFL, outside)
    numbers = [signal.SIGTERM, *([signal.SIGINT] if usual else [])]
    before = {number: signal.signal(number, stop) for number in numbers}
    hook, sys.unraisablehook = sys.unraisablehook, ignored
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for number, handler in before.items():
            signal.signal(number, handler)


def interrupted(stop: KeyboardInterrupt) -> str:
    """Message for an interrupt: the message of the verb, or the files that were written."""
    # A module that an interrupt left half loaded cannot be loaded again: what is not there has said or written nothing.
    loaded = sys.modules.get
    if isinstance(stop, getattr(loaded("cranktrain.cli.console"), "Interrupted", ())):
        return str(stop)
    if written := getattr(loaded("cranktrain.store.whole_file"), "WRITTEN", ()):
        return f"interrupted; written before: {', '.join(map(str, written))}"
    return f"interrupted; {NOTHING}"


def refused(error: OSError) -> str:
    """Message for a file that cannot be used, or for a full standard output; empty for other errors."""
    if error.errno in _REFUSALS and error.filename is not None:
        return f"{one_line(str(error.filename))[:300]}: cannot be used ({error.strerror}); name another file"
    if "temporary directory" in str(error.strerror):
        return "no temporary folder can be written; free some space, or set TMPDIR to another folder"
    if error.errno in (errno.ENOSPC, errno.EDQUOT) and error.filename is not None:
        return f"{one_line(str(error.filename))[:300]}: cannot be written ({error.strerror}); choose another place"
    if error.errno == errno.ENOSPC:  # files that are written say which they are
        leave_stdout()
        return "standard output: cannot be written, there is no space left; choose another place"
    return ""


def leave_stdout() -> None:
    """Redirect stdout to the null device, so that flushing the remaining output cannot fail."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def fault(error: Exception) -> str:
    """Message for an unexpected error; its traceback is written to a file."""
    text = one_line(f"fault of this program, {type(error).__name__}: {error}")[:300]
    try:
        with tempfile.NamedTemporaryFile("w", prefix="cranktrain-", suffix=".log", delete=False) as file:
            file.write("".join(traceback.format_exception(error)))
    except OSError:
        return f"{text}; its traceback could not be kept"
    return f"{text}; please report it with its traceback, {file.name}"
