"""Tables of files that say what is wanted: which keys there are, and of what kind their values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.user_file import is_number

NUMBER, WHOLE, TEXT, FLAG = "a finite number", "a whole number", "a text", "true or false"
NUMBERS, TEXTS = "a list of numbers", "a list of texts"
TABLE, TABLES = "a table", "a list of tables"


def check_types(table: Mapping[str, Any], keys: Mapping[str, str], prefix: str) -> None:
    """Refuse unknown keys, and values of a kind that ``keys`` does not say; ``InputError``."""
    for key, value in table.items():
        if key not in keys:
            raise InputError(f"unknown key '{prefix}{key}'; {nearest(key, keys)}")
        if not _is(value, keys[key]):
            raise InputError(f"{prefix}{key}: {shown(value)} is not {keys[key]}")


_OF_ONE = {NUMBERS: NUMBER, TEXTS: TEXT, TABLES: TABLE}


def _is(value: Any, kind: str) -> bool:
    """Whether a value is of a kind."""
    if kind == NUMBER:
        return is_number(value)
    if kind in _OF_ONE:
        return isinstance(value, list) and all(_is(entry, _OF_ONE[kind]) for entry in value)
    return type(value) is {WHOLE: int, TEXT: str, FLAG: bool, TABLE: dict}[kind]
