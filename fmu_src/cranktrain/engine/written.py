"""Conversion of an engine to the document and the text of an engine file: inverse of :mod:`cranktrain.engine.file`.

Values are written in the unit that messages use if the reader gets the same SI number from it, else in SI. Values equal
to their defaults are left out. An engine in memory does not store the origins of its values, so each is written as
*derived*.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import MISSING, fields, is_dataclass
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError, as_float, shown
from cranktrain.engine.additions import TABLES
from cranktrain.engine.additions import TEXTS as TEXTS_OF
from cranktrain.engine.connections import DATA
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import OFFSETS, UNITS, Quantity, kinds

ORIGIN = "derived"
HEAD = "# Written from an engine in memory, which does not keep the origins of its values: each says 'derived'.\n"


def document_of(engine: Engine) -> dict[str, Any]:
    """Document of the engine file that describes an engine; ``InputError`` for values that no file can hold."""
    document: dict[str, Any] = {"name": plain(engine.name, "name"), "title": plain(engine.title, "title")}
    for entry in fields(engine):
        value = getattr(engine, entry.name)
        if entry.name in document or value is None or _usual(value, entry.default):
            continue
        if entry.name in TABLES:
            given = value if isinstance(value, list | tuple) else [value]
            document[entry.name] = [_added(entry.name, one, f"{entry.name}[{k}]") for k, one in enumerate(given, 1)]
        else:
            document[entry.name] = table_of_part(value, entry.name)
    return document


def text_of(document: dict[str, Any]) -> str:
    """TOML text of a document."""
    lines = [HEAD, *(f"{key} = {toml_text(value)}" for key, value in document.items() if isinstance(value, str))]
    for name, table in document.items():
        for one in table if isinstance(table, list) else [table] if isinstance(table, dict) else []:
            lines += ["", f"[[{name}]]" if isinstance(table, list) else f"[{name}]"]
            lines += [f"{key} = {toml_text(value)}" for key, value in one.items()]
    return "\n".join(lines) + "\n"


def table_of_part(part: Any, where: str, texts: Sequence[str] = (), without: Sequence[str] = ()) -> Any:
    """TOML table for a dataclass of the engine, with an entry for each field; a plain value for anything else."""
    if not is_dataclass(part) or isinstance(part, type):
        return plain(part, where)
    found: dict[str, Any] = {}
    for entry in fields(part):
        value, name = getattr(part, entry.name), entry.name
        if name in without or _usual(value, entry.default):
            continue
        found[name] = (
            plain(value, f"{where}.{name}") if name in texts else entry_of(type(part), name, value, f"{where}.{name}")
        )
    return found


def entry_of(part: type, key: str, value: Any, where: str) -> dict[str, Any]:
    """Entry of an engine file for a field of a dataclass, from a value in SI or texts with units."""
    kind, _, rule = kinds(part).get(key, (str, False, None))
    value = plain(value, where)
    numbers = value if isinstance(value, list) else [value]
    if kind is not float or not all(isinstance(one, int | float) and not isinstance(one, bool) for one in numbers):
        return {"value": value, "origin": ORIGIN}
    dimension = rule.dimension if isinstance(rule, Quantity) else "1"
    unit, found = _in_best_unit(numbers, dimension, rule.unit if isinstance(rule, Quantity) else "")
    return {"value": found if isinstance(value, list) else found[0], "unit": unit, "origin": ORIGIN}


def plain(value: Any, where: str) -> Any:
    """Value in a type that TOML can hold; ``InputError`` for other objects."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [plain(one, where) for one in value]
    if isinstance(value, str | int | float):
        return value
    raise InputError(f"{where}: {shown(value)} is a {type(value).__name__}; give a number in SI units, or a text")


def _added(name: str, table: Any, where: str) -> Any:
    """TOML table of an added body, frame or connection; a connection's table also has the data of its force law."""
    if name != "connection" or getattr(table, "law", None) not in DATA:
        return table_of_part(table, where, TEXTS_OF[name])
    own = table_of_part(table, where, TEXTS_OF[name], tuple(DATA))
    return {**own, "law": table.law, **table_of_part(getattr(table, table.law), where)}


def _usual(value: Any, default: Any) -> bool:
    """True if a value equals the default of its field and has the same type."""
    return default is not MISSING and type(value) is type(default) and value == default


def _in_best_unit(values: list[float], dimension: str, unit: str) -> tuple[str, list[float]]:
    """Unit for an engine file, and the values in this unit; the unit is SI if rounding would change a value."""
    units = UNITS[dimension]
    si = next(iter(units))
    for name in dict.fromkeys((unit or si, si)):
        scale, zero = units[name], OFFSETS.get(name, 0.0)
        found = [_as_written(value, scale, zero) for value in values]
        if None not in found:
            return name, [one for one in found if one is not None]
    return si, values


def _as_written(value: float, scale: float, zero: float) -> float | None:
    """Shortest number that the reader converts to exactly this ``value``; None if no number does."""
    value = as_float(value)
    if not math.isfinite(value):
        return value
    near = (value - zero) / scale
    tried = [float(f"{near:.{digits}g}") for digits in (6, 9, 12, 15, 16, 17)]
    tried += [math.nextafter(near, math.inf), math.nextafter(near, -math.inf)]
    return next((one for one in tried if one * scale + zero == value), None)


def toml_text(value: Any) -> str:
    """TOML text of a value of a document."""
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{key} = {toml_text(own)}' for key, own in value.items())} }}"
    if isinstance(value, list):
        return f"[{', '.join(map(toml_text, value))}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    # JSON escapes texts as TOML does, except for DEL, which only TOML escapes.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f") if isinstance(value, str) else repr(value)


def entry_text(key: str, value: str, unit: str, origin: str, note: str) -> str:
    """Line of an engine file with a value, given as TOML text, its unit (empty: it has none), origin and note."""
    measured = f', unit = "{unit}"' if unit else ""
    return f'{key} = {{ value = {value}{measured}, origin = "{origin}", note = {toml_text(note)} }}'
