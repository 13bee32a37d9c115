"""Numbers that a user's file states as text with a unit, ``speed_rpm = "2000 1/min"``, converted to the key's unit.

A key with a unit of its own (:func:`cranktrain.core.typed_file.between`, :func:`~cranktrain.core.typed_file.measure`)
accepts a text in any unit of its dimension. A table with a key ``unit`` accepts a text for each number listed in
``Table.measured``. The text is converted to the table's unit, or defines that unit if the table states none.
"""

import re
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from cranktrain.core.errors import InputError, shown
from cranktrain.core.units import UNITS, UnitFactor, base_powers, unit_factor

NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(.*)", re.DOTALL)
Step = str | int


class Stated(NamedTuple):
    """A number and its unit."""

    number: float
    unit: str


def begins_as_number(text: Any) -> bool:
    """True if a value is a text that begins with a number."""
    return isinstance(text, str) and NUMBER.match(text) is not None


def stated(text: str, example: str) -> Stated:
    """Number and unit of a text; ``InputError`` if it has no unit or is not a number."""
    match = NUMBER.fullmatch(text)
    if match is None:
        raise InputError(f"{shown(text)} is no number with a unit; write it as in '{example}'")
    number, unit = float(match[1]), match[2].strip()
    if unit.startswith(",") or (re.match(r"\d", unit) and not re.match(r"1\s*/", unit)):
        raise InputError(f"{shown(text)} is no number with a unit; write decimals with a point, as in '{example}'")
    if not unit:
        raise InputError(f"{shown(text)} is a text without a unit; write {match[1]} without quotes, or '{example}'")
    return Stated(number, unit)


def in_unit(value: Stated, unit: str, dimension: str | None = None, difference: bool = False) -> float:
    """Number of a value in another unit; a ``difference`` is converted without offset. ``InputError`` if units misfit.

    Parameters
    ----------
    dimension : dimension that both units must have; None for any common one
    """
    own, wanted = unit_factor(value.unit, dimension), unit_factor(unit, dimension)
    if dimension is None and own.si != wanted.si:
        own = _like(value.unit, own, unit, wanted)
    if value.unit == unit:
        return value.number
    zero = 0.0 if difference else own.zero - wanted.zero
    return (value.number * own.scale + zero) / wanted.scale


def _like(text: str, own: UnitFactor, unit: str, wanted: UnitFactor) -> UnitFactor:
    """Factor of a unit whose SI unit is spelled differently; ``InputError`` if the dimension of the unit differs."""
    if base_powers(own.si) != base_powers(wanted.si):
        raise InputError(f"unit {shown(text)} has another dimension than {shown(unit)}; give one of the same dimension")
    return own


def text_paths(value: Any, path: tuple[Step, ...] = ()) -> Iterator[tuple[Step, ...]]:
    """Paths of the texts in a document that begin with a number."""
    if isinstance(value, Mapping):
        for key, entry in value.items():
            yield from text_paths(entry, (*path, key))
    elif isinstance(value, list):
        for k, entry in enumerate(value):
            yield from text_paths(entry, (*path, k))
    elif begins_as_number(value):
        yield path


def in_own_unit(
    table: Mapping[str, Any], measured: tuple[str, ...], differences: tuple[str, ...], dimension: str | None
) -> dict[str, Any]:
    """Copy of a TOML table with its numbers converted to one unit, which is named in it; ``InputError`` names the key.

    Parameters
    ----------
    measured, differences : keys of numbers in the table's unit; those of them that are differences
    """
    unit = table.get("unit") or None
    if unit is not None and not isinstance(unit, str):
        return dict(table)  # the value has a wrong type, which the reader of the table reports
    found, bare = dict(table), list[str]()
    example = next(iter(UNITS[dimension])) if dimension else "rev/min"

    def number(key: str, entry: Any) -> Any:
        nonlocal unit
        if not begins_as_number(entry):
            bare.append(f"{key}: {shown(entry)}")
            return entry
        try:
            value = stated(entry, f"20 {unit or example}")
            unit = unit or value.unit
            return in_unit(value, unit, dimension, key in differences)
        except InputError as error:
            raise InputError(f"{key}: {error}") from None

    for key in (key for key in measured if key in table):
        entry = table[key]
        found[key] = [number(key, one) for one in entry] if isinstance(entry, list) else number(key, entry)
    if bare and not table.get("unit"):
        raise InputError(f"{bare[0]} has no unit, but other numbers have; give each its unit, or the key unit once")
    return {**found, "unit": unit}
