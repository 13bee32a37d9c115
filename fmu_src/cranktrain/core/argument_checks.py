"""Checks of values that a script passes to the library; ``InputError`` for a value of a wrong kind."""

import math
import re
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError, shown

_WHOLE = re.compile(r"[+-]?[0-9]{1,18}")


def whole_number(text: str) -> int | None:
    """Integer that a text states, with optional sign and spaces around it; None for any other text."""
    plain = text.strip()
    return int(plain) if _WHOLE.fullmatch(plain) else None


NAME = re.compile(r"[A-Za-z][A-Za-z0-9_ \-]*(\[\d+\])?")


def given_number(value: Any, where: str) -> float:
    """Value as a finite number; otherwise ``InputError`` with a message that starts with ``where``."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
        raise InputError(f"{where} is {shown(value)}, no number; give one, in SI units")
    if not math.isfinite(value):
        raise InputError(f"{where} is {value}; give a finite number, in SI units")
    return float(value)


def given_numbers(value: Any, count: int, where: str) -> tuple[float, ...]:
    """Value as ``count`` finite numbers (any count for −1); ``InputError`` that starts with ``where``."""
    if isinstance(value, (str, bytes)) or not hasattr(value, "__len__") or np.ndim(value) != 1:
        raise InputError(f"{where} is {shown(value)}; give a list of {count if count >= 0 else 'its'} numbers")
    if count not in (-1, len(value)):
        raise InputError(f"{where} has {len(value)} values; give {count}")
    return tuple(given_number(entry, f"{where}[{k}]") for k, entry in enumerate(value, 1))


def given_name(value: Any, where: str) -> str:
    """Value as a name that outputs can have; ``InputError`` that starts with ``where``."""
    if not isinstance(value, str) or not NAME.fullmatch(value):
        raise InputError(
            f"{where}: {shown(value)} is no name; take letters, digits, spaces, _ and -, a letter first, and a number "
            "in brackets where there are several, as in balancer[1]"
        )
    return value


def given_kind(value: Any, kind: type, where: str, remedy: str) -> None:
    """Raise ``InputError`` if a value is not an instance of ``kind``."""
    if not isinstance(value, kind):
        raise InputError(f"{where} is {shown(value)}, a {type(value).__name__}; {remedy}")
