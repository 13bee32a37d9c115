"""Units of measurement that a harness file may name, as ports for conversion of values."""

import math

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.units import base_powers, known_factor
from cranktrain_lab.coupling.connections import conversion
from cranktrain_lab.coupling.unit import DIMENSIONS, Port

_POWERS: dict[str, tuple[dict[str, int], dict[str, float]]] = {
    "number": ({}, {"1": 1.0, "%": 0.01}),
    "angle": ({"rad": 1}, {"rad": 1.0, "deg": math.pi / 180.0}),
    "speed": ({"rad": 1, "s": -1}, {"rad/s": 1.0, "rev/min": math.pi / 30.0}),
    "time": ({"s": 1}, {"s": 1.0, "ms": 1e-3}),
    "length": ({"m": 1}, {"m": 1.0, "mm": 1e-3, "um": 1e-6}),
    "velocity": ({"m": 1, "s": -1}, {"m/s": 1.0}),
    "mass": ({"kg": 1}, {"kg": 1.0, "g": 1e-3, "mg": 1e-6}),
    "force": ({"kg": 1, "m": 1, "s": -2}, {"N": 1.0, "kN": 1e3}),
    "pressure": ({"kg": 1, "m": -1, "s": -2}, {"Pa": 1.0, "kPa": 1e3, "bar": 1e5, "MPa": 1e6}),
    "torque or energy": ({"kg": 1, "m": 2, "s": -2}, {"N.m": 1.0, "N m": 1.0, "J": 1.0, "kJ": 1e3}),
    "power": ({"kg": 1, "m": 2, "s": -3}, {"W": 1.0, "kW": 1e3}),
    "temperature": ({"K": 1}, {"K": 1.0, "degC": 1.0}),
}
_OFFSETS = {"degC": 273.15}
MEASURED = {
    unit: Port(unit, factor, _OFFSETS.get(unit, 0.0), tuple(powers.get(name, 0) for name in DIMENSIONS))
    for powers, units in _POWERS.values()
    for unit, factor in units.items()
}
"""Units of measurement that a harness file may name, by name."""


def named(unit: str, where: str) -> str:
    """Check that a unit of measurement is known or empty, and return it; raises ``InputError``."""
    if unit and _port(unit) is None:
        raise InputError(f"{where}: unit '{unit}' is not known; {nearest(unit, MEASURED)}")
    return unit


def between(unit: str, port: Port, where: str, difference: bool = False) -> tuple[float, float]:
    """Return factor and shift from a value in ``unit`` (empty: the port's own) to a value of a port; ``InputError``.

    A ``difference`` has no shift. A variable without a declared unit takes values without unit only, because the target
    of a conversion is unknown.
    """
    if unit in ("", port.unit):
        return 1.0, 0.0
    if not port.unit and unit != "1":
        raise InputError(
            f"{where}: unit {shown(unit)} is given, and the variable declares none; leave the unit out, and give the "
            "value as the variable has it"
        )
    own = _port(unit)
    if own is None:
        raise InputError(f"{where}: unit '{unit}' is not known; {nearest(unit, MEASURED)}")
    factor, shift = conversion(own, port, where)
    return factor, 0.0 if difference else shift


def of_unit(port: Port, unit: str) -> tuple[float, float]:
    """Return factor and shift from a value of a port to a unit that :func:`between` accepts."""
    own = port if unit == port.unit else _port(unit)
    return (1.0, 0.0) if own is None else conversion(port, own, unit)


def _port(unit: str) -> Port | None:
    """Return a unit of the table, or of another spelling that :mod:`cranktrain.core.units` knows."""
    if unit in MEASURED:
        return MEASURED[unit]
    if (found := known_factor(unit)) is None:
        return None
    powers = base_powers(found.si)
    return Port(unit, found.scale, found.zero, tuple(powers.get(name, 0) for name in DIMENSIONS))
