"""Functions and quantities that a script passes: called and converted to numbers, or refused with ``InputError``."""

import inspect
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError, shown


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
