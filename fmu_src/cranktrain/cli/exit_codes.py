"""How a verb ends early: interrupted, terminated, or by an error, in one line and one JSON object."""

from __future__ import annotations

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
"""Characters of a line, of which the middle is left out where there are more."""
_REFUSALS = {errno.ENAMETOOLONG, errno.EACCES, errno.EPERM, errno.EROFS, errno.ELOOP, errno.ENOTDIR, errno.EISDIR}
"""What a system says of a file that it does not give to its user, or that cannot be."""
_PLACE = re.compile(r"--[a-z-]+(?= )|((?:[^\s:]+|[^:]*[/\\][^:]*|[^:]*\.\w{1,5}): )+")


class Stopped(KeyboardInterrupt):
    """What a signal raises; its argument is the signal.

    Python lets a process die with SIGINT, whatever its exit code, if once a plain ``KeyboardInterrupt`` has left a text
    that ``exec`` runs, as each dataclass has; not so one of another class.
    """


def one_line(text: str) -> str:
    """A text as one line of bounded length, without characters that a terminal obeys."""
    plain = " ".join(text.split())
    plain = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in plain)
    return plain if len(plain) <= LONGEST else f"{plain[: LONGEST - 200]} … {plain[-190:]}"


def parts(text: str) -> dict[str, str | None]:
    """What, where and remedy of an error's line, ``where: what; remedy`` or ``--option value is not …; remedy``.

    None where it does not say.
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
    """Let a termination end a verb as an interrupt does, and note either in ``stopped``.

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
    """What to say of an interrupt: what its verb says, or which files are there."""
    # A module that an interrupt left half loaded cannot be loaded again: what is not there has said or written nothing.
    loaded = sys.modules.get
    if isinstance(stop, getattr(loaded("cranktrain.cli.console"), "Interrupted", ())):
        return str(stop)
    if written := getattr(loaded("cranktrain.store.whole_file"), "WRITTEN", ()):
        return f"interrupted; written before: {', '.join(map(str, written))}"
    return f"interrupted; {NOTHING}"


def refused(error: OSError) -> str:
    """What to say of a user's file that cannot be used, or of a standard output that is full; else empty."""
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
    """Let what is left to be flushed go nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def fault(error: Exception) -> str:
    """What to say of an error that nobody foresaw; its traceback goes into a file."""
    text = one_line(f"fault of this program, {type(error).__name__}: {error}")[:300]
    try:
        with tempfile.NamedTemporaryFile("w", prefix="cranktrain-", suffix=".log", delete=False) as file:
            file.write("".join(traceback.format_exception(error)))
    except OSError:
        return f"{text}; its traceback could not be kept"
    return f"{text}; please report it with its traceback, {file.name}"
