"""Parsing of times and variables in entries of a harness file."""

import math
from collections.abc import Iterable
from typing import NamedTuple

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.typed_file import Table
from cranktrain_lab.harness.entries import Variable


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

    def span(self, table: Table, where: str) -> tuple[float, float]:
        """Return the times ``from`` and ``to`` (s), default 0 and infinity; ``InputError`` if from is not before to."""
        begin, end = self.of(table, "from", where, 0.0), self.of(table, "to", where, math.inf)
        if not begin < end:
            raise InputError(f"{where}: from {begin:g} s must be before to {end:g} s")
        return begin, end
