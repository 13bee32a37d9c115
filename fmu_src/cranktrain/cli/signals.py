"""Interrupts and terminations of the command's process before its verb begins and after it has ended.

While the command is loading, no file exists yet, so a signal ends the process at once, with one line and exit code 130
or 143. After the end of the verb its exit code is final: the first signal changes nothing, a second one ends the
process. During the shutdown of the interpreter, when Python would return signals to the system, they are ignored.

This module imports only a few modules of the standard library, because signals are not handled before :func:`guard`.
"""

import atexit
import os
import signal
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:  # loading typing takes longer than all else here
    from typing import Any

NOTHING = "nothing was written, and what earlier runs wrote is kept"
"""Message of an interrupt if no file was written."""
_MODULES = ("cranktrain", "cranktrain.cli.main")
"""Names by which ``python -m`` runs the command."""
_begun: list[str] = []
_late: list[int] = []


def guard() -> None:
    """Handle signals from now on, if this process is the command and its caller does not ignore them."""
    if not _is_command():
        return
    held = [signal.SIGTERM] if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL else []
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        held.append(signal.SIGINT)
    for number in held:
        signal.signal(number, outside)

    def ignore() -> None:
        for number in held:
            signal.signal(number, signal.SIG_IGN)

    atexit.register(ignore)  # what is registered first is called last


def begun() -> None:
    """Mark the begin of the verb: it handles signals itself from now on, and its exit code is final."""
    _begun.append("verb")


def outside(number: int, frame: "Any") -> None:
    """Handle a signal before the verb begins or after it has ended."""
    if not _begun:
        text = f'{{"error": {{"what": "interrupted", "where": null, "remedy": "{NOTHING}"}}}}\n'
        os.write(2, f"cranktrain: interrupted; {NOTHING}\n".encode())
        if "--json" in sys.argv:
            os.write(1, text.encode())
        os._exit(128 + number)
    if _late:
        os._exit(128 + number)
    _late.append(number)


def _is_command() -> bool:
    """True if this process is the command: a script of its name, or ``python -m``."""
    name, given = (getattr(sys, "argv", None) or [""])[0], sys.orig_argv
    if name.endswith(("/cranktrain", "\\cranktrain", "cranktrain.exe")):
        return True
    return "-m" in given and given[given.index("-m") + 1 :][:1] in [[module] for module in _MODULES]
