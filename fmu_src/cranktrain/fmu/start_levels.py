"""Start values of an FMU's parameters, levels included, that are chosen when the FMU is built."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from cranktrain.core.errors import InputError, nearest
from cranktrain.dynamics.model.settings import Settings, check_levels, resolved
from cranktrain.engine.model import Engine
from cranktrain.fmu.description import Interface, Variable
from cranktrain.fmu.native.engine_model import LEVELS


def with_starts(interface: Interface, starts: Mapping[str, Any]) -> Interface:
    """Interface with other start values of parameters, by name.

    Raises ``InputError``: a name that is not a parameter, or a value that the parameter cannot have.
    """
    parameters = {v.name: v for v in interface.variables if v.causality == "parameter" and v.start_of is None}
    for name in starts:
        if name not in parameters:
            raise InputError(
                f"start: the FMU has no parameter '{name}' to start elsewhere; {nearest(name, parameters)}"
            )
    changed = {name: replace(parameters[name], start=_value(parameters[name], value)) for name, value in starts.items()}
    return replace(interface, variables=tuple(changed.get(v.name, v) for v in interface.variables))


def start_settings(interface: Interface, engine: Engine, starts: Mapping[str, Any]) -> Settings:
    """Complete settings at which an engine's FMU starts; ``InputError`` if the levels contradict each other."""
    variables = with_starts(interface, starts).variables
    chosen: dict[str, Any] = {str(v.setting): v.start for v in variables if v.setting in LEVELS}
    settings = resolved(Settings(**chosen), engine)
    check_levels(settings, engine)
    return settings


def _value(variable: Variable, value: Any) -> Any:
    """Start value converted to a parameter's type; ``InputError`` if the parameter cannot have it."""
    if variable.type == "String":
        if variable.choices and value not in variable.choices:
            raise InputError(f"start: '{variable.name}' is '{value}'; {nearest(str(value), variable.choices)}")
        return str(value)
    low = -math.inf if variable.min is None else variable.min
    high = math.inf if variable.max is None else variable.max
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not (math.isfinite(number) and low <= number <= high):
        unit = "" if variable.unit in (None, "1") else f" {variable.unit}"
        raise InputError(
            f"start: '{variable.name}' is {value}; it must be a number between {low:g} and {high:g}{unit}, without unit"
        )
    return number
