"""Values that a script gives: refused in one line where they are of another kind than what they are for."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError, shown

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_ \-]*(\[\d+\])?")


def given_number(value: Any, where: str) -> float:
    """A finite number; ``InputError`` that starts with ``where``."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
        raise InputError(f"{where} is {shown(value)}, no number; give one, in SI units")
    if not math.isfinite(value):
        raise InputError(f"{where} is {value}; give a finite number, in SI units")
    return float(value)


def given_numbers(value: Any, count: int, where: str) -> tuple[float, ...]:
    """So many finite numbers, or any for ``count`` −1; ``InputError`` that starts with ``where``."""
    if isinstance(value, (str, bytes)) or not hasattr(value, "__len__") or np.ndim(value) != 1:
        raise InputError(f"{where} is {shown(value)}; give a list of {count if count >= 0 else 'its'} numbers")
    if count not in (-1, len(value)):
        raise InputError(f"{where} has {len(value)} values; give {count}")
    return tuple(given_number(entry, f"{where}[{k}]") for k, entry in enumerate(value, 1))


def given_name(value: Any, where: str) -> str:
    """A name that outputs can bear; ``InputError`` that starts with ``where``."""
    if not isinstance(value, str) or not NAME.fullmatch(value):
        raise InputError(
            f"{where}: {shown(value)} is no name; take letters, digits, spaces, _ and -, a letter first, and a number "
            "in brackets where there are several, as in balancer[1]"
        )
    return value


def given_kind(value: Any, kind: type, where: str, remedy: str) -> None:
    """Refuse a value that is not of a class; ``InputError``."""
    if not isinstance(value, kind):
        raise InputError(f"{where} is {shown(value)}, a {type(value).__name__}; {remedy}")
