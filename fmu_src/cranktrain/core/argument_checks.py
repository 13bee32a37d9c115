"""Checks of values, quantities and functions that a script passes; ``InputError`` for one of a wrong kind."""

import inspect
import math
import re
from collections.abc import Callable
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


def without_unit(value: Any, unit: str, where: str) -> Any:
    """Number or array of a quantity in ``unit``; pint quantities and run results are converted. ``InputError``."""
    if not hasattr(value, "to"):
        return value
    if hasattr(value, "magnitude"):
        try:
            return value.to(unit).magnitude
        except Exception as error:  # pint's errors; the running model does not import pint
            raise InputError(f"{where}: {str(error).splitlines()[0]}; give it in {unit}") from None
    return np.asarray(value.to(unit)) if getattr(value, "unit", "") else np.asarray(value)


def called(function: Callable[..., Any], arguments: tuple[float, ...], where: str, unit: str) -> float:
    """Result of a call of a user's function as a finite number; ``InputError`` that starts with ``where``."""
    try:
        found = function(*arguments)
    except Exception as error:  # a user's function may raise anything
        raise InputError(f"{where} the function raises {type(error).__name__}: {shown(str(error))}") from None
    found = without_unit(found, unit, where)
    try:
        number = float(found)
    except (TypeError, ValueError):
        raise InputError(f"{where} the function returns {shown(found)}; return one number, {unit}") from None
    if not math.isfinite(number):
        raise InputError(f"{where} the function returns {number}; return a finite number, {unit}")
    return number


def takes_two(function: Callable[..., Any]) -> bool:
    """True if a function takes a speed too: it requires two arguments, or its second argument is named ``speed...``."""
    try:
        parameters = list(inspect.signature(function).parameters.values())
    except (TypeError, ValueError):  # built-in functions may have no signature
        return False
    by_place = [one for one in parameters if one.kind in (one.POSITIONAL_ONLY, one.POSITIONAL_OR_KEYWORD)]
    if len(by_place) < 2:
        return False
    return by_place[1].default is inspect.Parameter.empty or by_place[1].name.startswith("speed")
