"""Text and TOML files of users: read completely, or refused in one line."""

import math
import stat
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeGuard

from cranktrain.core.errors import InputError

LARGEST_FILE = 10_000_000
"""Largest text file that is read as a whole, bytes: a thousand times the size of an engine file."""


LARGEST_BODY, LONGEST_LINE = 2_000_000_000, 1 << 20
"""Size (bytes) of the largest file of any kind that is read as a whole, and longest line (characters) of a text."""


TABLES = (".csv", ".txt", ".dat", ".tsv", ".tab", ".asc", ".prn")
"""File endings of text tables, in small letters."""


def user_path(path: str | Path) -> Path:
    """Path that a user gave, with ``~`` and ``~name`` replaced by the home folder; unchanged for an unknown user."""
    try:
        return Path(path).expanduser()
    except RuntimeError:
        return Path(path)


def file_exists(path: str | Path) -> bool:
    """True if a path is an existing file; False also for impossible names, such as too long ones."""
    try:
        return Path(path).is_file()
    except (OSError, ValueError):
        return False


def folder_exists(path: str | Path) -> bool:
    """True if a path is an existing folder; False also for impossible names."""
    try:
        return Path(path).is_dir()
    except (OSError, ValueError):
        return False


def special(path: str | Path) -> str:
    """Kind of a path that is a device, a pipe or a socket, in words; empty for any other path."""
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
    """Refuse a path that must not be opened: a device, a pipe, a socket, or a file of more than ``most`` bytes.

    The check comes before reading, so nothing is allocated for a file without end. ``InputError`` ends with ``remedy``.
    A path that does not exist passes, because the reader has a better message for it.
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
    """Line numbers and lines of a large text file, which should be ``what``, without line ends.

    ``InputError`` for a device or a pipe, more than ``most`` bytes, a line that is not text or longer than
    ``LONGEST_LINE`` characters.
    """
    check_file(path, f"{path}", remedy, most)
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        for number, line in enumerate(iter(lambda: file.readline(LONGEST_LINE), ""), 1):
            if "\0" in line or len(line) == LONGEST_LINE:
                told = "holds bytes that are no text" if "\0" in line else f"has more than {LONGEST_LINE} characters"
                raise InputError(f"{path}, line {number}: {told}, so it is no {what}; {remedy}")
            yield number, line.rstrip("\r\n")


def beside(file: str | Path, text: str) -> Path:
    """Path named in a user's file: relative to that file's folder, in the home folder (~), or absolute."""
    return Path(file).parent / user_path(text)


def ending(path: str | Path) -> str:
    """File ending with its dot, in small letters; for a name such as ``.csv`` the whole name."""
    name = Path(path).name.lower()
    return name[name.rfind(".") :] if "." in name else ""


def read_text(path: str | Path, what: str, remedy: str) -> str:
    """Text of a user's file, which should be ``what``; ``InputError`` ends with the remedy if it cannot be read."""
    shown, path = f"{path}", user_path(path)
    try:
        check_file(path, shown, remedy)
        if not path.is_file():
            raise InputError(f"{shown}: no such {what}; {remedy}")
        large, text = path.stat().st_size > LARGEST_FILE, ""
        if not large:  # files such as those in /proc state no size
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
    """Document of a TOML file, which should be ``what``; ``InputError`` if it cannot be read or is not TOML."""
    text, name = read_text(path, what, remedy), Path(path).name
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{name}: not a TOML file: {error}") from None
    except RecursionError:
        raise InputError(f"{name}: not a TOML file: brackets are nested too deeply") from None
    except ValueError as error:  # an integer of thousands of digits
        raise InputError(f"{name}: not a TOML file: {error}") from None


def is_number(value: Any) -> TypeGuard[int | float]:
    """True if a value of a file is a number that fits in a float; False for true and false."""
    whole_or_float = isinstance(value, int | float) and not isinstance(value, bool)
    return whole_or_float and (math.isfinite(value) if isinstance(value, float) else abs(value) <= sys.float_info.max)
