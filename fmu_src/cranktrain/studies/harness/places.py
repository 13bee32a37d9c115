"""Times and variables as the entries of a harness file name them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from cranktrain.core.errors import InputError, nearest
from cranktrain.studies.harness.entries import Variable
from cranktrain.studies.typed_table import check_types


def table_of(table: Any, keys: Mapping[str, str], where: str) -> None:
    """Refuse what is no table, keys that do not exist and values of a wrong kind; ``InputError``."""
    if not isinstance(table, dict):
        raise InputError(f"{where}: is not a table")
    try:
        check_types(table, keys, "")
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def need(table: Mapping[str, Any], where: str, *keys: str) -> None:
    """Refuse an entry that lacks keys; ``InputError``."""
    for key in keys:
        if key not in table:
            raise InputError(f"{where}: {key} is missing; it has {', '.join(keys)}")


def variable(text: str, where: str, units: Iterable[str]) -> Variable:
    """Unit and name of ``unit.variable``; ``InputError`` where there is no such unit."""
    unit, _, name = text.partition(".")
    names = list(units)
    if not name:
        raise InputError(f"{where}: '{text}' is not 'unit.variable'; units: {', '.join(names)}")
    if unit not in names:
        raise InputError(f"{where}: there is no unit '{unit}'; {nearest(unit, names)}")
    return unit, name


class Times(NamedTuple):
    """Times of a scenario: speed (rad/s) that its cycles are counted by, or None, and its end (s)."""

    speed: float | None
    stop: float

    def keys(self, *names: str) -> dict[str, str]:
        """Keys that may give these times."""
        return {f"{name}_{unit}": "a finite number" for name in names for unit in ("s", "cycles")}

    def of(self, table: Mapping[str, Any], name: str, where: str, otherwise: float | None = None) -> float:
        """Time, s, that ``name_s`` or ``name_cycles`` gives; ``InputError`` where it lies outside the scenario."""
        given = [key for key in (f"{name}_s", f"{name}_cycles") if key in table]
        if not given:
            if otherwise is None:
                raise InputError(f"{where}: no time; give {name}_s or {name}_cycles")
            return otherwise
        if len(given) > 1:
            raise InputError(f"{where}: both {name}_s and {name}_cycles; give one of them")
        found = float(table[given[0]])
        if given[0].endswith("cycles"):
            if self.speed is None:
                raise InputError(f"{where}: {name}_cycles needs speed_rpm; give it, or {name}_s")
            found *= 4.0 * math.pi / self.speed
        if not 0.0 <= found <= self.stop * (1.0 + 1e-9):
            raise InputError(
                f"{where}: {given[0]} = {table[given[0]]:g} is not within the scenario, which takes {self.stop:.6g} s"
            )
        return found

    def span(self, table: Mapping[str, Any], where: str) -> tuple[float, float]:
        """Times from and to, 0 and infinity where they are not given; ``InputError`` where they are in disorder."""
        begin, end = self.of(table, "from", where, 0.0), self.of(table, "to", where, math.inf)
        if not begin < end:
            raise InputError(f"{where}: from {begin:g} s must be before to {end:g} s")
        return begin, end
