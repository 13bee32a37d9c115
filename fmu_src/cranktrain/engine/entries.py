"""Entries of engine and module files as msgspec reads them: ``{ value = 60, unit = "mm", origin = "chosen" }``.

The dataclasses of :mod:`cranktrain.engine.parts` with their annotations from :mod:`cranktrain.engine.quantities` are
the declaration. :func:`table_of` makes the struct of a file's table from a dataclass, :func:`part_of` the dataclass in
SI from such a struct, and :func:`rules` the additional rules of the JSON schema: the range of a value in each unit.
"""

import math
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import MISSING, fields
from difflib import get_close_matches
from functools import cache
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.typed_file import Entry, Fault, Table, quantities
from cranktrain.core.units import known_factor, other_units
from cranktrain.engine import quantities as q
from cranktrain.engine.parts import Needed
from cranktrain.engine.quantities import OFFSETS, ROUNDING, UNITS, OneOf, Quantity, kinds

ORIGINS = ("chosen", "derived", "calibrated", "published", "identified")
WITH_NOTE = ("calibrated", "published", "identified")
"""Origins of values that need a note, which names the number of the source or the data."""
Origin = Literal["chosen", "derived", "calibrated", "published", "identified"]
Text = Annotated[str, Meta(min_length=1)]

_made: dict[str, tuple[Any, bool, float | None]] = {}
"""For each entry struct, by name: quantity, whether the value is a list, and a default outside the range."""


def keys_of(part: type, plain: Collection[str] = (), without: Collection[str] = ()) -> list[Any]:
    """Keys of a TOML table for a dataclass: an entry for each field, a plain text for each field in ``plain``."""
    read: list[Any] = []
    for entry in fields(part):
        own, many, rule = kinds(part)[entry.name]
        if entry.name in without:
            continue
        if entry.name in plain:
            kind: Any = list[Text] if many else Text
        else:
            kind = _entry(part, own, many, rule, entry.default)
        read.append((entry.name, kind) if entry.default is MISSING else (entry.name, kind | None, None))
    return read


def table_of(name: str, keys: Sequence[Any], about: str | None, like: str, **options: Any) -> Any:
    """Struct of a TOML table with these keys; ``like`` is an example file, ``options`` are passed to the struct.

    The option ``needed`` is described in :class:`cranktrain.core.typed_file.Table`.
    """
    space = {"__doc__": about, "remedy": f"add it as in {like}", "needed": options.pop("needed", None)}
    name = f"{name.removesuffix('Table')}Table"
    return msgspec.defstruct(name, keys, bases=(Table,), kw_only=True, namespace=space, **options)


@cache
def stated(part: Any, like: str) -> Any:
    """Struct of a TOML table for a dataclass, with an entry for every field; ``like`` is an example file."""
    return table_of(part.__name__, keys_of(part), part.__doc__, like, needed=needed_keys(part))


def needed_keys(part: Any) -> Any:
    """Option ``needed`` of :func:`table_of`: function for the optional keys that a table's values make necessary."""
    return staticmethod(lambda table: _needed(part, lambda key: _stated(table.get(key))).keys)


def _needed(part: type, given: Callable[[str], Any]) -> Needed:
    """Optional keys that a part needs because of its ``given`` values, see :class:`cranktrain.engine.parts.Needed`."""
    own: Callable[[Callable[[str], Any]], Needed] | None = getattr(part, "needed", None)
    return Needed() if own is None else own(given)


def _stated(entry: Any) -> Any:
    """Value of an entry, either as written or as read; a plain text is its own value."""
    return entry.get("value") if isinstance(entry, Mapping) else getattr(entry, "value", entry)


def part_of(part: type, read: Any, where: str, plain: Collection[str] = (), **further: Any) -> Any:
    """Dataclass in SI from a TOML table that was read; ``InputError`` for an origin without note, or missing keys."""
    wanted = _needed(part, lambda key: _stated(getattr(read, key)))
    if missing := [key for key in wanted.keys if getattr(read, key) is None]:
        are, them = ("is", "it") if len(missing) == 1 else ("are", "them")
        place = f"{where}.{missing[0]}:" if len(missing) == 1 else f"{where}: keys {', '.join(map(repr, missing))}"
        raise InputError(f"{place} {are} missing; {wanted.why} {them}")
    for entry in fields(part):
        value, key = getattr(read, entry.name, None), entry.name
        if value is None or key in further:
            continue
        if key in plain:
            further[key] = tuple(value) if isinstance(value, list) else value
        else:
            further[key] = _si(value, kinds(part)[key], f"{where}.{key}")
    return part(**further)


def _si(entry: Any, kind: tuple[type, bool, Any], where: str) -> Any:
    """Value of an entry, with numbers in SI."""
    plain, many, rule = kind
    if entry.origin in WITH_NOTE and not entry.note:
        raise InputError(f"{where}: a value of origin '{entry.origin}' needs a note that names that number")
    if plain is not float:
        return tuple(entry.value) if many else entry.value
    found = known_factor(entry.unit, dimension := _dimension(rule))
    if found is None:
        raise InputError(f"{where}: {_no_measure(entry.unit, dimension)}")
    scale, shift, _ = found
    return tuple(value * scale + shift for value in entry.value) if many else entry.value * scale + shift


def said(fault: Fault, where: str) -> str:
    """Message for a fault in an entry; empty for any other fault."""
    place, entry, value = f"{where}: {fault.place}", fault.owner, fault.value
    whole = fault.wanted is not None and issubclass(fault.wanted, Entry) and fault.problem == "value"
    if whole or (issubclass(entry, Entry) and (fault.problem, fault.key) == ("missing", "value")):
        return f'{place}: write it as {{ value = ..., unit = "...", origin = "chosen" }}'
    if not issubclass(entry, Entry):
        return ""
    if fault.problem == "unknown":
        return f"{place}: unknown entry '{fault.key}'; {nearest(fault.key, entry.__struct_fields__)}"
    if fault.key in ("unit", "origin"):
        given = None if fault.problem == "missing" else value
        place = place.removesuffix(f".{fault.key}")
        if fault.key == "origin":
            return f"{place}: origin '{given}' is not known; {nearest(str(given), ORIGINS)}"
        return f"{place}: {_no_measure('1' if given is None else given, entry.dimension)}"
    if fault.key == "value" and isinstance(value, list) != entry.many:
        return f"{place}: {'a list of values' if entry.many else 'a single value'} is wanted, got {shown(value)}"
    return ""


def rules() -> dict[str, dict[str, Any]]:
    """JSON schema rules of all entry structs made so far, by class name."""
    found: dict[str, dict[str, Any]] = {}
    for name, (rule, many, beyond) in _made.items():
        noted = {"required": ["note"], "properties": {"note": {"minLength": 1}}}
        held: list[dict[str, Any]] = [{"if": {"properties": {"origin": {"enum": list(WITH_NOTE)}}}, "then": noted}]
        if isinstance(rule, Quantity):
            held += [_in_unit(rule, unit, many, beyond) for unit in UNITS[rule.dimension]]
        found[name] = {"description": described(rule, many), "allOf": held}
        if isinstance(rule, Quantity) and rule.dimension != "1":
            # A value that is a text contains its unit.
            texts = {"items": {"type": "string"}} if many else {"type": "string"}
            held.append({"if": {"not": {"properties": {"value": texts}}}, "then": {"required": ["unit"]}})
            found[name]["required"] = ["value", "origin"]
    return found


def _no_measure(unit: Any, dimension: str) -> str:
    """Message for a wrong unit."""
    valid = UNITS[dimension]
    close = isinstance(unit, str) and get_close_matches(unit, valid, n=1, cutoff=0.5)
    meant = f"did you mean '{close[0]}'? " if close else ""
    return f"unit '{unit}' does not measure its {dimension}; {meant}use one of: {', '.join(valid)}"


def _dimension(rule: Any) -> str:
    return rule.dimension if isinstance(rule, Quantity) else "1"


def _entry(part: type, plain: type, many: bool, rule: Any, default: Any) -> Any:
    """Struct of a field's entry; files may state the default outside the range too, where it means "not given"."""
    stands = isinstance(rule, Quantity) and isinstance(default, float | int) and math.isfinite(default)
    beyond = default if stands and rule.wrong(default) else None
    return _form(_title(part, rule, plain), plain, many, rule, beyond)


@cache
def _form(title: str, plain: type, many: bool, rule: Any, beyond: float | None) -> Any:
    dimension = _dimension(rule)
    own: Any = plain
    if isinstance(rule, OneOf):
        own = Annotated[plain, Meta(extra_json_schema={"enum": list(rule.names)})]
    elif plain is float:
        own = Annotated[plain, quantities()]
    # Editors suggest these spellings and reject units of other dimensions; the reader accepts other spellings too.
    known = {"anyOf": [{"enum": list(UNITS[dimension])}, {"not": {"enum": other_units(dimension)}}]}
    unit: Any = Annotated[str, Meta(extra_json_schema=known)]
    # No TOML table of a file has such a name, so rules can be found by name.
    name = f"{title}{'_entries' if many else '_entry'}{'' if beyond is None else '_or_none'}"
    while name in _made:
        name += "_"
    _made[name] = (rule, many, beyond)
    keys = [
        ("value", list[own] if many else own), ("unit", unit, "1") if dimension == "1" else ("unit", unit),
        ("origin", Origin), ("note", str, ""),
    ]  # fmt: skip
    return msgspec.defstruct(name, keys, bases=(Entry,), kw_only=True, namespace={"dimension": dimension, "many": many})


def _in_unit(rule: Quantity, unit: str, many: bool, beyond: float | None) -> dict[str, Any]:
    """JSON schema of a quantity's range in one unit, extended by the rounding error of a converted value."""
    scales, shift = UNITS[rule.dimension], OFFSETS.get(unit, 0.0)
    own, margin = _unit(rule), 2.0 * ROUNDING
    low, high = (end * scales[own] + OFFSETS.get(own, 0.0) for end in (rule.low, rule.high))
    low, high = low - margin * abs(low), high + margin * abs(high)
    value: dict[str, Any] = {"minimum": (low - shift) / scales[unit], "maximum": (high - shift) / scales[unit]}
    if beyond is not None:
        value = {"anyOf": [value, {"const": beyond}]}
    needed = {} if unit == "1" else {"required": ["unit"]}
    own_unit = {"properties": {"unit": {"const": unit}}, **needed}
    return {"if": own_unit, "then": {"properties": {"value": {"items": value} if many else value}}}


def _unit(rule: Quantity) -> str:
    return rule.unit or next(iter(UNITS[rule.dimension]))


def described(rule: Any, many: bool) -> str:
    """Description of a value in words: quantity, range and unit, or the valid names."""
    text = f"{rule.noun}: {', '.join(rule.names)}" if isinstance(rule, OneOf) else "value"
    if isinstance(rule, Quantity):
        what, unit = ("number", "") if rule.dimension == "1" else (rule.dimension, f" {_unit(rule)}")
        text = f"{what}, {rule.low:g} to {rule.high:g}{unit}" + (f"; {rule.hint}" if rule.hint else "")
    return f"list of: {text}" if many else text


def _title(part: type, rule: Any, plain: type) -> str:
    """Name of a quantity, taken from its annotation in the part's module or in that of quantities."""
    if rule is None:
        return {bool: "Flag", int: "Count", str: "Word"}.get(plain, "Number")
    return _names_in(part.__module__).get(rule) or _names_in(q.__name__).get(rule) or type(rule).__name__


@cache
def _names_in(module: str) -> dict[Any, str]:
    """Names of a module's annotations, by the quantity that each annotation holds."""
    found = {getattr(kind, "__metadata__", (None,))[0]: name for name, kind in vars(sys.modules[module]).items()}
    return {rule: name for rule, name in found.items() if isinstance(rule, Quantity | OneOf)}
