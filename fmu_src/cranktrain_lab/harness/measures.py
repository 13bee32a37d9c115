"""Units, times and variables that entries of a harness file name; units are ports for conversion of values."""

import math
from collections.abc import Iterable
from typing import NamedTuple

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.typed_file import Table
from cranktrain.core.units import base_powers, known_factor
from cranktrain_lab.coupling.connections import conversion
from cranktrain_lab.coupling.unit import DIMENSIONS, Port
from cranktrain_lab.harness.entries import Variable

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


def variable(text: str, where: str, units: Iterable[str]) -> Variable:
    """Split ``unit.variable`` into unit and name; raises ``InputError`` for an unknown unit."""
    unit, _, name = text.partition(".")
    names = list(units)
    if not name:
        raise InputError(f"{where}: '{text}' is not 'unit.variable'; units: {', '.join(names)}")
    if unit not in names:
        raise InputError(f"{where}: there is no unit '{unit}'; {nearest(unit, names)}")
    return unit, name


class Times(NamedTuple):
    """Converter of a scenario's times, with the speed (rad/s, or None) that defines a cycle, and the end (s)."""

    speed: float | None
    stop: float

    def of(self, table: Table, name: str, where: str, otherwise: float | None = None) -> float:
        """Return the time (s) from key ``name_s`` or ``name_cycles``; raises ``InputError`` if outside the scenario."""
        given = {key: value for key in (f"{name}_s", f"{name}_cycles") if (value := getattr(table, key)) is not None}
        if not given:
            if otherwise is None:
                raise InputError(f"{where}: no time; give {name}_s or {name}_cycles")
            return otherwise
        if len(given) > 1:
            raise InputError(f"{where}: both {name}_s and {name}_cycles; give one of them")
        (key, value), *_ = given.items()
        found = value
        if key.endswith("cycles"):
            if self.speed is None:
                raise InputError(f"{where}: {name}_cycles needs speed_rpm; give it, or {name}_s")
            found *= 4.0 * math.pi / self.speed
        if not 0.0 <= found <= self.stop * (1.0 + 1e-9):
            raise InputError(f"{where}: {key} = {value:g} is not within the scenario, which takes {self.stop:.6g} s")
        return found

    def before_end(self, table: Table, name: str, where: str, otherwise: float | None = None) -> float:
        """Return the time (s) of an event from its TOML table; ``InputError`` if not before the scenario's end."""
        found = self.of(table, name, where, otherwise)
        if found >= self.stop * (1.0 - 1e-9):
            raise InputError(
                f"{where}: {name} {found:.6g} s is the end of the scenario, where it has no effect; let it come earlier"
            )
        return found

    def event(self, table: Table, where: str) -> tuple[float, float]:
        """Return begin and end (s) of an event from its TOML table; ``InputError`` if begin is the scenario's end."""
        self.before_end(table, "from", where, 0.0)
        return self.span(table, where)

    def span(self, table: Table, where: str, endless: bool = True) -> tuple[float, float]:
        """Return the times ``from`` and ``to`` (s), default 0 and, if ``endless``, infinity.

        ``InputError`` if from is not before to.
        """
        begin, end = self.of(table, "from", where, 0.0), self.of(table, "to", where, math.inf if endless else None)
        if not begin < end:
            raise InputError(f"{where}: from {begin:g} s must be before to {end:g} s")
        return begin, end
