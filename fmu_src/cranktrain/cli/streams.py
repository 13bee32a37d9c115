"""Preparation of the standard streams: all are open, and can write every character in some spelling."""

import codecs
import os
import sys
import unicodedata

PLAIN = "cranktrain.plain"
"""Name of the error handler that replaces characters which an encoding lacks."""
_SPELLING = {
    "–": "-", "—": "-", "−": "-", "·": "*", "×": "x", "±": "+-", "°": " deg", "…": "...", "µ": "u", "μ": "u",
    "Ω": "Ohm", "→": "->", "≤": "<=", "≥": ">=", "≈": "~", "‘": "'", "’": "'", "“": '"', "”": '"',
    "θ": "theta", "φ": "phi",
}  # fmt: skip
"""ASCII spelling of typographic symbols; other characters lose their accents or become ``?``."""


def prepare() -> None:
    """Open the null device in place of closed streams; let ``stdout`` and ``stderr`` replace characters they lack.

    Otherwise a file that the verb opens would get the descriptor of a closed stream, and so the printed text.
    """
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        if getattr(sys, name) is None:
            try:
                os.fstat(number)
            except OSError:
                opened = os.open(os.devnull, os.O_RDWR)
                if opened != number:
                    os.dup2(opened, number)
                    os.close(opened)
            setattr(sys, name, open(number, mode, encoding="utf-8", closefd=False))  # noqa: SIM115 - stays open
    codecs.register_error(PLAIN, _spelled)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure") and codecs.lookup(stream.encoding).name != "utf-8":
            stream.reconfigure(errors=PLAIN)


def _spelled(error: UnicodeError) -> tuple[str, int]:
    """ASCII spelling of the characters that an encoding lacks, and the position after them."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lacking = error.object[error.start : error.end]
    plain = "".join(_SPELLING.get(c) or unicodedata.normalize("NFKD", c) for c in lacking)
    return plain.encode("ascii", "replace").decode(), error.end
