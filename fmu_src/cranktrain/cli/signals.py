"""Interrupts and terminations of the command's process before its verb begins and after it has ended.

While the command is being loaded nothing is written yet: a signal ends the process at once, with one line and exit code
130 or 143. Once the verb has ended its exit code stands: the first signal changes nothing, a second one ends the
process. While the interpreter is being taken down, when Python would give signals back to the system, they are ignored.

Standard library only, and little of it: what is loaded before :func:`guard` is without it.
"""

from __future__ import annotations

import atexit
import os
import signal
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:  # loading typing takes longer than all else here
    from typing import Any

NOTHING = "nothing was written, and what earlier runs wrote is kept"
"""What an interrupt says where no file is there."""
_MODULES = ("cranktrain", "cranktrain.cli.main")
"""Names by which ``python -m`` runs the command."""
_begun: list[str] = []
_late: list[int] = []


def guard() -> None:
    """Take signals from here on, where this process is the command's and its caller does not ignore them."""
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
    """The verb begins: from here on it answers to signals by itself, and an end of it stands."""
    _begun.append("verb")


def outside(number: int, frame: Any) -> None:
    """Answer to a signal outside of the verb."""
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
    """Whether this process is the command: a script of its name, or ``python -m``."""
    name, given = (getattr(sys, "argv", None) or [""])[0], sys.orig_argv
    if name.endswith(("/cranktrain", "\\cranktrain", "cranktrain.exe")):
        return True
    return "-m" in given and given[given.index("-m") + 1 :][:1] in [[module] for module in _MODULES]
