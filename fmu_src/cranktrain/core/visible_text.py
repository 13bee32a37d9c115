"""Text from files made safe for a terminal: control characters are shown as escapes, and nothing else changes.

Names of channels, units and engines come from files of unknown origin. Control characters in them could move the
cursor, rewrite lines or set the title. All printed text goes through :class:`VisibleStream`. Tables with styles bypass
it; their cells are made visible one by one.
"""

import json
import sys
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TextIO, cast

KEPT = "\n\t"
"""Control characters that are kept, because tables and lines consist of them."""
OBEYED = ("Cc", "Cf", "Cs", "Zl", "Zp")
"""Unicode categories of characters that are escaped: control, format, surrogate, line and paragraph separator."""


def visible(text: str) -> str:
    """Text with each control character as JSON escapes it (u and four hexadecimal digits)."""
    if text.isprintable():
        return text
    return "".join(json.dumps(c)[1:-1] if c not in KEPT and unicodedata.category(c) in OBEYED else c for c in text)


class VisibleStream:
    """A text stream that writes visible text to another one."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream

    def write(self, text: str) -> int:
        """Write a text, made visible."""
        self.stream.write(visible(text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


def unfiltered(stream: TextIO) -> TextIO:
    """Stream below a :class:`VisibleStream`, for our own texts with styles; any other stream unchanged."""
    return stream.stream if isinstance(stream, VisibleStream) else stream


@contextmanager
def visible_streams() -> Iterator[None]:
    """Context in which everything printed to stdout and stderr is made visible."""
    before = sys.stdout, sys.stderr
    wrapped = [
        stream if stream is None or isinstance(stream, VisibleStream) else VisibleStream(stream) for stream in before
    ]
    sys.stdout, sys.stderr = cast(tuple[TextIO, TextIO], tuple(wrapped))
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before
