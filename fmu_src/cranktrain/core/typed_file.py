"""Tables of a user's file as typed records: declared once as msgspec structs, read completely or refused in one line.

A :class:`Table` declares the keys of a table, the type of each value, its unit (:func:`measure`) and its range
(:func:`between`). Numbers with a unit may be texts in another unit (:mod:`cranktrain.core.stated_units`).
:func:`record` reads a TOML table into it; :mod:`cranktrain.studies.file_schemas` makes the JSON schema for editors from
the same classes. An error says what is wrong, where, the nearest valid name and how to correct it.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any, ClassVar, NamedTuple, TypeVar

import msgspec
from msgspec import Meta, inspect

from cranktrain.core.errors import InputError, nearest, shown, within
from cranktrain.core.stated_units import in_own_unit, in_unit, stated, text_paths
from cranktrain.core.user_file import is_number

Kind = TypeVar("Kind", bound="Table")
Step = str | int
_STEP = re.compile(r"\.(\w+)|\[(\d+|\.\.\.)\]")
_KEY = re.compile(r"Object (contains unknown|missing required) field `(.*)`", re.DOTALL)
_NOUNS = {
    inspect.FloatType: "a finite number", inspect.IntType: "a whole number", inspect.StrType: "a text",
    inspect.BoolType: "true or false", inspect.StructType: "a table", inspect.DictType: "a table",
}  # fmt: skip
_OR_TEXT = {"pattern": r"^\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*(1\s*/|[^\s\d.,])"}
"""JSON schema of a number that may also be a text with number and unit."""
_MANY = {inspect.FloatType: "numbers", inspect.IntType: "whole numbers", inspect.StrType: "texts"}


class Table(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """TOML table of a user's file. An optional key has a default, None if the file does not state the key.

    ``remedy`` says what to do about a missing key. Numbers under the keys ``measured`` are in the unit of the key
    ``unit``; those under ``differences`` are differences of the measured quantity. ``needed`` takes a table and returns
    the optional keys that its other values make necessary.
    """

    remedy: ClassVar[str] = ""
    needed: ClassVar[Callable[[Mapping[str, Any]], Sequence[str]] | None] = None
    measured: ClassVar[tuple[str, ...]] = ()
    differences: ClassVar[tuple[str, ...]] = ()


class Entry(Table):
    """TOML table that stands for its key ``value``; messages name the table instead of that key."""

    measured: ClassVar[tuple[str, ...]] = ("value",)


class Fault(NamedTuple):
    """A fault in a TOML table of a user's file.

    Attributes
    ----------
    steps : keys and indices (from 0) from the table to the fault, without ``value`` of an entry
    place : the same as messages show it, ``scenario 'normal'.step[2]``; empty for the table itself
    owner : the innermost :class:`Table` that contains the fault
    key : unknown or missing key of the owner, or the key of the wrong value
    problem : ``unknown``, ``missing`` or ``value``
    value : the wrong value; for an unknown or missing key the owner's table
    type : declared type of the value
    """

    steps: tuple[Step, ...]
    place: str
    owner: Any
    key: str
    problem: str
    value: Any
    type: inspect.Type

    @property
    def wanted(self) -> Any:
        """Class of the expected table; None if a table is not expected."""
        node = _plain(self.type, self.value)
        return node.cls if isinstance(node, inspect.StructType) else None

    @property
    def names(self) -> list[str]:
        """Names that the value may be; empty if the value is not one of several names."""
        node = _plain(self.type)
        return [str(name) for name in node.values] if isinstance(node, inspect.LiteralType) else []


def between(low: float, high: float, what: str, dimension: str = "", unit: str = "") -> Meta:
    """Range of a number, both ends included; ``what`` is its unit and any alternative, for messages.

    With a ``dimension`` (a key of ``units.UNITS``) a text with any unit of it is allowed too; ``unit`` is the unit of
    the number if ``what`` says more.
    """
    if not dimension:
        return Meta(ge=low, le=high, extra={"what": what})
    extra = {"what": what, "dimension": dimension, "unit": unit or what}
    return Meta(ge=low, le=high, extra=extra, extra_json_schema=_OR_TEXT)


def measure(unit: str, dimension: str) -> Meta:
    """Unit of a number without a range; a text with any unit of its dimension is allowed too."""
    return Meta(extra={"what": unit, "dimension": dimension, "unit": unit}, extra_json_schema=_OR_TEXT)


def quantities() -> Meta:
    """Mark of a number that may also be a text with its unit, in a TOML table with a key ``unit``."""
    return Meta(extra_json_schema=_OR_TEXT)


def record(
    kind: type[Kind], table: Mapping[str, Any], where: str = "", said: Callable[[Fault, str], str] | None = None
) -> Kind:
    """Record of type ``kind`` from a TOML table of a user's file.

    Raises ``InputError``, one line that starts with ``where``, for the first key that is unknown or missing, or the
    first value of a wrong type or outside its range.

    Parameters
    ----------
    said : function that returns a message for a fault and ``where``, or an empty text for that of :func:`usual`
    """
    table = _with_numbers(kind, table, where)
    fault = _not_finite(kind, table)
    if fault is None:
        try:
            return msgspec.convert(table, kind)
        except msgspec.ValidationError as error:
            fault = _fault(kind, table, str(error))
    raise InputError((said(fault, where) if said else "") or usual(fault, where))


def _with_numbers(kind: type[Table], table: Mapping[str, Any], where: str) -> Mapping[str, Any]:
    """TOML table whose texts with units are replaced by numbers in the units of their keys; ``InputError``."""
    for path in text_paths(table):
        if not isinstance(_of(table, path), str):
            continue  # the whole table was converted together with an earlier text
        found = _at(kind, table, list(path))
        if not isinstance(_plain(found.type), inspect.FloatType):
            continue
        last = max(k for k, step in enumerate(path) if isinstance(step, str))
        own = path[:last]
        try:
            if path[last] in found.owner.measured:
                dimension = getattr(found.owner, "dimension", None)
                new = in_own_unit(_of(table, own), found.owner.measured, found.owner.differences, dimension)
                table = _replaced(table, own, new)
            elif unit := _said_of(found.type, "unit"):
                table = _replaced(
                    table, path, in_unit(stated(found.value, f"20 {unit}"), unit, _said_of(found.type, "dimension"))
                )
        except InputError as error:
            text = f"{found.place}: {error}"
            if path[last] in found.owner.measured and not issubclass(found.owner, Entry):
                text = f"{_at(kind, table, list(own)).place}.{error}".lstrip(".")  # the text begins with the key
            elif path[last] in found.owner.measured:
                text = f"{found.place}: {str(error).partition(': ')[2]}"
            raise InputError(f"{where}: {text}" if where else text) from None
    return table


def _of(table: Any, path: tuple[Step, ...]) -> Any:
    for step in path:
        table = table[step]
    return table


def _replaced(table: Any, path: tuple[Step, ...], new: Any) -> Any:
    """Copy of nested tables and lists with a new value at a path."""
    if not path:
        return new
    copy: Any = dict(table) if isinstance(table, Mapping) else list(table)
    copy[path[0]] = _replaced(table[path[0]], path[1:], new)
    return copy


def usual(fault: Fault, where: str = "") -> str:
    """Message of a fault in one line; without ``where`` keys are named with their place in the file."""
    place = ": ".join(filter(None, (where, fault.place)))
    if fault.problem == "value":
        return _wrong_value(fault, place)
    fields = inspect.type_info(fault.owner).fields  # type: ignore[attr-defined]
    apart = bool(where) or "[" in place or "'" in place
    key = fault.key if apart or not place else f"{place}.{fault.key}"
    start = f"{place}: " if apart else ""
    if fault.problem == "unknown":
        # At the top of a file a table is called a table, elsewhere a key.
        found = fault.value[fault.key]
        entries = found if isinstance(found, list) and found else [found]
        noun = "table" if not fault.steps and all(isinstance(entry, dict) for entry in entries) else "key"
        return f"{start}unknown {noun} '{key}'; {nearest(fault.key, [entry.encode_name for entry in fields])}"
    missing = _missing(fault, [entry.encode_name for entry in fields if entry.required])
    own = [entry for entry in fields if entry.encode_name in missing]
    tables = not fault.steps and all(isinstance(_plain(entry.type), inspect.StructType) for entry in own)
    noun, are = ("table" if own and tables else "key"), "is missing"
    if len(missing) > 1:
        noun, are = f"{noun}s", "are missing"
    remedy = fault.owner.remedy or f"it needs {', '.join(entry.encode_name for entry in fields if entry.required)}"
    if start or not place:
        return f"{start}{noun} {', '.join(map(repr, missing))} {are}; {remedy}"
    return f"{', '.join(f'{place}.{name}' for name in missing)} {are}; {remedy}"


def _missing(fault: Fault, required: list[str]) -> list[str]:
    """All missing keys of a TOML table: first the required keys, then keys that its values make necessary."""
    given = fault.value if isinstance(fault.value, Mapping) else {}
    missing = [name for name in required if name not in given]
    if fault.owner.needed is not None:
        missing += [name for name in fault.owner.needed(given) if name not in given and name not in missing]
    return missing if fault.key in missing else [fault.key]


def _wrong_value(fault: Fault, place: str) -> str:
    """Message for a value of a wrong type, outside its range, or not one of several names."""
    node, value = _plain(fault.type), fault.value
    if fault.names and isinstance(value, str):
        return f"{place} {shown(value)} does not exist; {nearest(value, fault.names)}"
    low, high = getattr(node, "ge", None), getattr(node, "le", None)
    if low is not None and high is not None and is_number(value):
        try:
            within(f"{place}:", value, low, high, _said_of(fault.type, "what"))
        except InputError as error:
            return str(error)
    wanted = f"one of: {', '.join(fault.names)}" if fault.names else _noun(node)
    return f"{place}: {shown(value)} is not {wanted}"


def _said_of(node: inspect.Type, key: str) -> str:
    """Text that :func:`between` or :func:`measure` attached to a number under ``key``."""
    if isinstance(node, inspect.UnionType):
        return next(filter(None, (_said_of(kind, key) for kind in node.types)), "")
    return str((getattr(node, "extra", None) or {}).get(key, ""))


def _noun(node: inspect.Type) -> str:
    if isinstance(node, inspect.ListType | inspect.VarTupleType):
        return f"a list of {_MANY.get(type(_plain(node.item_type)), 'tables')}"
    return _NOUNS.get(type(node), "a value that can be used")


def _plain(node: inspect.Type, value: Any = None) -> inspect.Type:
    """Type without metadata and without None; of several table types the type with the value's tag."""
    while isinstance(node, inspect.Metadata):
        node = node.type
    if isinstance(node, inspect.UnionType):
        kinds = [kind for kind in map(_plain, node.types) if not isinstance(kind, inspect.NoneType)]
        tables = [kind for kind in kinds if isinstance(kind, inspect.StructType) and isinstance(value, dict)]
        tagged = [kind for kind in tables if value.get(kind.tag_field) == kind.tag]
        return (tagged or kinds)[0]
    return node


def _inside(node: inspect.Type, step: Step) -> inspect.Type:
    """Type of the value under a key or at an index."""
    if isinstance(node, inspect.StructType):
        if node.tag_field == step:
            return inspect.LiteralType((node.tag,))
        return next((entry.type for entry in node.fields if entry.encode_name == step), inspect.AnyType())
    if isinstance(node, inspect.DictType):
        return node.value_type
    if isinstance(node, inspect.ListType | inspect.VarTupleType):
        return node.item_type
    return inspect.AnyType()


def _at(kind: type[Table], table: Any, path: list[Step]) -> Fault:
    """Fault for the value at a path; ``...`` in the path stands for the first key whose value does not fit."""
    node = _declared(kind)
    value, steps, place = table, list[Step](), ""
    owner: Any = kind
    for step in path:
        plain = _plain(node, value)
        if step == "...":
            step = _misfit(_plain(_inside(plain, step)), value)
        if isinstance(plain, inspect.StructType):
            owner = plain.cls
        if not (issubclass(owner, Entry) and step == "value" and isinstance(plain, inspect.StructType)):
            steps.append(step)
            if isinstance(step, str):
                place += f".{step}"
            else:  # the name or number of a table in a list
                name = value[step].get("name") if isinstance(value[step], dict) else None
                place += f" {shown(name)}" if isinstance(name, str) else f"[{step + 1}]"
        node, value = _tags(node, step) or _inside(plain, step), value[step]
    return Fault(tuple(steps), place.lstrip("."), owner, str(path[-1]) if path else "", "value", value, node)


@cache
def _declared(kind: type[Table]) -> inspect.Type:
    """Declared types of a TOML table and all its values, cached because an engine file has thousands of values."""
    return inspect.type_info(kind)


def _tags(node: inspect.Type, step: Step) -> inspect.Type | None:
    """Literal type of the tags that a choice of several tables allows."""
    kinds = list(map(_plain, node.types)) if isinstance(node, inspect.UnionType) else []
    tags = [kind.tag for kind in kinds if isinstance(kind, inspect.StructType) and kind.tag_field == step]
    return inspect.LiteralType(tuple(tags)) if tags else None


def _misfit(node: inspect.Type, table: Mapping[str, Any]) -> str:
    """First key of a table of tables whose value is not a table, or not of the wanted type."""
    for key, value in table.items():
        try:
            msgspec.convert(value, node.cls if isinstance(node, inspect.StructType) else dict)
        except msgspec.ValidationError:
            return key
    return next(iter(table))


def _fault(kind: type[Table], table: Mapping[str, Any], error: str) -> Fault:
    """Fault that msgspec's error message describes."""
    text, _, path = error.rpartition(" - at `$") if " - at `$" in error else (error, "", "")
    found = _at(kind, table, [int(at) if at.isdigit() else name or at for name, at in _STEP.findall(path)])
    if (key := _KEY.fullmatch(text)) is None:
        return found
    return found._replace(
        owner=found.wanted or found.owner, key=key[2], problem="unknown" if "unknown" in key[1] else "missing"
    )


def _not_finite(kind: type[Table], table: Mapping[str, Any]) -> Fault | None:
    """Fault for the first number that is not finite or too large for a float; None if there is none."""

    def paths(value: Any, path: list[Step]) -> Iterator[list[Step]]:
        if isinstance(value, dict):
            for key, entry in value.items():
                yield from paths(entry, [*path, key])
        elif isinstance(value, list):
            for k, entry in enumerate(value):
                yield from paths(entry, [*path, k])
        elif isinstance(value, float | int) and not isinstance(value, bool) and not is_number(value):
            yield path

    path = next(paths(table, []), None)
    return None if path is None else _at(kind, table, path)._replace(type=inspect.FloatType())
