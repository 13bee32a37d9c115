"""Text from files, made safe for a terminal: what a terminal obeys is shown as an escape, and nothing else changes.

Names of channels, units and engines come from files of anybody. A sequence of control characters in them would move the
cursor, rewrite lines or set the title. All printed text goes through :class:`VisibleStream`; tables with styles of our
own go past it, with their cells made visible one by one.
"""

from __future__ import annotations

import json
import sys
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TextIO, cast

KEPT = "\n\t"
"""Control characters that tables and lines consist of."""
OBEYED = ("Cc", "Cf", "Cs", "Zl", "Zp")
"""Unicode's categories of characters that control, format, are half a character, or end a line."""


def visible(text: str) -> str:
    """A text with each character that a terminal obeys as JSON escapes it, four hexadecimal digits behind a u."""
    if text.isprintable():
        return text
    return "".join(json.dumps(c)[1:-1] if c not in KEPT and unicodedata.category(c) in OBEYED else c for c in text)


class VisibleStream:
    """A text stream that writes visible text to another one."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream

    def write(self, text: str) -> int:
        """Write a text."""
        self.stream.write(visible(text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


def unfiltered(stream: TextIO) -> TextIO:
    """The stream below a :class:`VisibleStream`, for texts with styles of our own; any other stream as it is."""
    return stream.stream if isinstance(stream, VisibleStream) else stream


@contextmanager
def visible_streams() -> Iterator[None]:
    """Let what is printed be visible text."""
    before = sys.stdout, sys.stderr
    wrapped = [
        stream if stream is None or isinstance(stream, VisibleStream) else VisibleStream(stream) for stream in before
    ]
    sys.stdout, sys.stderr = cast(tuple[TextIO, TextIO], tuple(wrapped))
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before
