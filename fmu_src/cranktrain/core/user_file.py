"""Text and TOML files of users: read whole, or refused in one line."""

from __future__ import annotations

import math
import stat
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeGuard

from cranktrain.core.errors import InputError

LARGEST_FILE = 10_000_000
"""Bytes of the largest text that is read: a thousand times what an engine takes."""


LARGEST_BODY, LONGEST_LINE = 2_000_000_000, 1 << 20
"""Bytes of the largest file of any kind that is read whole, and characters of a line of such a text."""


TABLES = (".csv", ".txt", ".dat", ".tsv", ".tab", ".asc", ".prn")
"""Endings of text tables, in small letters."""


def user_path(path: str | Path) -> Path:
    """A path that a user gave, with ``~`` and ``~name`` as the home folder; a leading ~ of no user stands as it is."""
    try:
        return Path(path).expanduser()
    except RuntimeError:
        return Path(path)


def file_exists(path: str | Path) -> bool:
    """Whether a path is one of a file; a name that no file can have, too long say, is none."""
    try:
        return Path(path).is_file()
    except (OSError, ValueError):
        return False


def folder_exists(path: str | Path) -> bool:
    """Whether a path is one of a folder, as :func:`file_exists`."""
    try:
        return Path(path).is_dir()
    except (OSError, ValueError):
        return False


def special(path: str | Path) -> str:
    """What a path is that has no end or no content of its own, a device or a pipe; else empty."""
    try:
        mode = Path(path).stat().st_mode
    except (OSError, ValueError):
        return ""
    kinds = (
        (stat.S_ISCHR, "a device"),
        (stat.S_ISBLK, "a device"),
        (stat.S_ISFIFO, "a pipe"),
        (stat.S_ISSOCK, "a socket"),
    )
    return next((name for test, name in kinds if test(mode)), "")


def check_file(path: str | Path, shown: str, remedy: str, most: int = LARGEST_BODY) -> None:
    """Refuse a path that no reader may open: a device, a pipe, a socket, or a file of more than ``most`` bytes.

    This is done before anything is read, so nothing is allocated for what has no end. ``InputError`` ends with the
    remedy. What does not exist is left to the reader, which says what it looked for.
    """
    if kind := special(path):
        raise InputError(f"{shown}: is {kind}, no file; {remedy}")
    try:
        size = Path(path).stat().st_size
    except (OSError, ValueError):
        return
    if size > most:
        raise InputError(f"{shown}: has {size / 1e6:.4g} MB, such files are read up to {most / 1e6:g} MB; {remedy}")


def text_lines(path: Path, what: str, remedy: str, most: int = LARGEST_BODY) -> Iterator[tuple[int, str]]:
    """Number and text of each line of a large text file, which is to be ``what``, without its end.

    ``InputError``: a device or a pipe, more than ``most`` bytes, a line that is no text or longer than any of such
    files.
    """
    check_file(path, f"{path}", remedy, most)
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        for number, line in enumerate(iter(lambda: file.readline(LONGEST_LINE), ""), 1):
            if "\0" in line or len(line) == LONGEST_LINE:
                told = "holds bytes that are no text" if "\0" in line else f"has more than {LONGEST_LINE} characters"
                raise InputError(f"{path}, line {number}: {told}, so it is no {what}; {remedy}")
            yield number, line.rstrip("\r\n")


def beside(file: str | Path, text: str) -> Path:
    """A path that a user's file names: from the folder of that file, from the home folder (~), or absolute."""
    return Path(file).parent / user_path(text)


def ending(path: str | Path) -> str:
    """Ending of a file's name with its dot, in small letters; of a name that is nothing else too."""
    name = Path(path).name.lower()
    return name[name.rfind(".") :] if "." in name else ""


def read_text(path: str | Path, what: str, remedy: str) -> str:
    """Text of a user's file, which is to be ``what``; ``InputError`` ends with the remedy where it cannot be read."""
    shown, path = f"{path}", user_path(path)
    try:
        check_file(path, shown, remedy)
        if not path.is_file():
            raise InputError(f"{shown}: no such {what}; {remedy}")
        large, text = path.stat().st_size > LARGEST_FILE, ""
        if not large:  # files that the system makes while they are read state no size
            with path.open(encoding="utf-8-sig") as file:
                text = file.read(LARGEST_FILE + 1)
        if large or len(text) > LARGEST_FILE:
            raise InputError(f"{shown}: larger than {LARGEST_FILE / 1e6:g} MB, too large for a {what}; {remedy}")
        return text
    except OSError as error:
        raise InputError(f"{shown}: cannot be read ({error.strerror}); {remedy}") from None
    except UnicodeDecodeError:
        raise InputError(f"{shown}: not text in UTF-8; {remedy}") from None
    except ValueError:
        raise InputError(f"{shown}: not a valid file name; {remedy}") from None


def read_toml(path: str | Path, what: str, remedy: str) -> dict[str, Any]:
    """Document of a TOML file, which is to be ``what``; ``InputError`` where it cannot be read or is none."""
    text, name = read_text(path, what, remedy), Path(path).name
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{name}: not a TOML file: {error}") from None
    except RecursionError:
        raise InputError(f"{name}: not a TOML file: brackets are nested too deeply") from None
    except ValueError as error:  # a whole number of thousands of digits
        raise InputError(f"{name}: not a TOML file: {error}") from None


def is_number(value: Any) -> TypeGuard[int | float]:
    """Whether a value of a file is a number that a float can hold, true and false excluded."""
    whole_or_float = isinstance(value, int | float) and not isinstance(value, bool)
    return whole_or_float and (math.isfinite(value) if isinstance(value, float) else abs(value) <= sys.float_info.max)
