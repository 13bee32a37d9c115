"""The command line: one file a verb.

As long as the command is being loaded, an interrupt ends it as the system does: without a traceback, exit code 130.
"""

import signal
import sys

# Of python -m the name is known only from the whole command, before the module itself is loaded.
_NAME = (getattr(sys, "argv", None) or [""])[0]
_COMMAND = _NAME.endswith(("/cranktrain", "\\cranktrain", "cranktrain.exe")) or (
    _NAME == "-m" and "cranktrain.cli.main" in sys.orig_argv
)
if _COMMAND and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)
