"""Text and TOML files of users: read whole, or refused in one line."""

from __future__ import annotations

import math
import sys
import tomllib
from pathlib import Path
from typing import Any, TypeGuard

from cranktrain.core.errors import InputError

LARGEST_FILE = 10_000_000
"""Bytes of the largest text that is read: a thousand times what an engine takes."""


TABLES = (".csv", ".txt", ".dat", ".tsv", ".tab", ".asc", ".prn")
"""Endings of text tables, in small letters."""


def user_path(path: str | Path) -> Path:
    """A path that a user gave, with ``~`` and ``~name`` as the home folder; a leading ~ of no user stands as it is."""
    try:
        return Path(path).expanduser()
    except RuntimeError:
        return Path(path)


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
        if not path.is_file():
            raise InputError(f"{shown}: no such {what}; {remedy}")
        if path.stat().st_size > LARGEST_FILE:
            raise InputError(f"{shown}: larger than {LARGEST_FILE / 1e6:g} MB, too large for a {what}; {remedy}")
        return path.read_text(encoding="utf-8-sig")
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
