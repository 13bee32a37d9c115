"""Text files of users in any common encoding: UTF-8, UTF-16 and UTF-32, with or without byte-order mark, and cp1252.

Windows calls cp1252 "ANSI" in western Europe. A text that is not UTF-8 is read as cp1252, because a degree sign or an
umlaut in a header must not make the numbers below it unreadable.
"""

import codecs
import io
import sys
from pathlib import Path
from typing import TextIO

from cranktrain.core.errors import InputError
from cranktrain.core.user_file import check_file, user_path

SAMPLE = 1 << 16
"""Number of bytes at the beginning of a file by which text is recognised."""
_MARKS = (
    (codecs.BOM_UTF32_LE, "utf-32"), (codecs.BOM_UTF32_BE, "utf-32"), (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"),
)  # fmt: skip
_CONTROLS = frozenset(range(32)) - set(b"\t\n\r\f\v\x1a")


def open_text(path: str | Path, what: str, remedy: str) -> TextIO:
    """Open a user's text file, which should be ``what``, for reading; all line ends become newlines.

    Raises ``InputError`` (one line that ends with ``remedy``) if the file cannot be read or is not text.
    """
    shown, path = f"{path}", user_path(path)
    try:
        if path.is_dir():
            raise InputError(f"{shown}: no such {what}, it is a folder; {remedy}")
        check_file(path, shown, remedy, most=sys.maxsize)
        if not path.is_file():
            raise InputError(f"{shown}: no such {what}; {remedy}")
        found = _encoding(path)
        if found is None:
            raise InputError(f"{shown}: holds bytes that are no text; {remedy}")
        return io.TextIOWrapper(path.open("rb"), encoding=found, errors="replace", newline=None)
    except OSError as error:
        raise InputError(f"{shown}: cannot be read ({error.strerror}); {remedy}") from None
    except ValueError:
        raise InputError(f"{shown}: not a valid file name; {remedy}") from None


def _encoding(path: Path) -> str | None:
    """Encoding of a file; None if it is not text."""
    with path.open("rb") as file:
        sample = file.read(SAMPLE)
        for mark, name in _MARKS:
            if sample.startswith(mark):
                return name
        if b"\0" in sample:
            return _without_mark(sample)
        if _CONTROLS & set(sample):
            return None
        decoder, block = codecs.getincrementaldecoder("utf-8")(), sample
        try:
            while block:
                if not block.isascii() or decoder.getstate()[0]:
                    decoder.decode(block)
                block = file.read(1 << 22)
            decoder.decode(b"", final=True)
        except UnicodeDecodeError:
            return "cp1252"
    return "utf-8"


def _without_mark(sample: bytes) -> str | None:
    """Encoding of UTF-16 without mark: in Latin text the zero bytes are the upper halves; None for other content."""
    half = len(sample) // 2
    first, second = (sample[k : 2 * half : 2].count(0) for k in (0, 1))
    if second > 0.7 * half and first < 0.05 * half:
        return "utf-16-le"
    if first > 0.7 * half and second < 0.05 * half:
        return "utf-16-be"
    return None
