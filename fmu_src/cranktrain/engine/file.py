"""Engine files: TOML in which every value states its unit and where it comes from.

One table per dataclass of :mod:`cranktrain.engine.model`; an entry reads

    throw = { value = 60, unit = "mm", origin = "derived", note = "half the stroke" }

``value`` may be a list. ``origin`` is *chosen*, *derived*, *calibrated* or *published*; the last two need a note that
says to which number. Everything is converted to SI here, once, and checked. Keys and tables whose field has a
default may be left out.
"""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path
from types import UnionType
from typing import Any, get_args, get_type_hints

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.user_file import is_number, read_toml
from cranktrain.engine.additions import NEEDED, TABLES, check_text, law_class, located
from cranktrain.engine.additions import TEXTS as TEXTS_OF
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.model import Engine, optional_fields
from cranktrain.engine.quantities import OFFSETS, UNITS, Quantity, kinds

ORIGINS = ("chosen", "derived", "calibrated", "published")
ENTRY = ("value", "unit", "origin", "note")
TEXTS = ("name", "title")
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")
"""A name is part of paths and of an FMU's identifiers."""
LONGEST_TITLE = 200
ADDED_LIKE = "examples/four_with_balancers.toml"
"""File in which to see bodies, frames and connections."""


def engine_folder() -> Path:
    """Folder of the engines that ship with the package."""
    return Path(__file__).with_name("data")


def engine_names() -> list[str]:
    """Names of the engines that ship with the package; their targets files ``*.targets.toml`` lie beside them."""
    return sorted(path.stem for path in engine_folder().glob("*.toml") if "." not in path.stem)


def engine_path(name_or_path: str | Path) -> Path:
    """Path of an engine file, by path or by the name of one that ships with the package."""
    text = str(name_or_path)
    if text.endswith(".toml"):
        return Path(text)
    if text not in engine_names():
        raise InputError(
            f"unknown engine '{text}': {nearest(text, engine_names())} (or give the path of a .toml engine file)"
        )
    return engine_folder() / f"{text}.toml"


def load_engine(name_or_path: str | Path) -> Engine:
    """Read and check an engine file.

    Raises ``InputError``: one line with file, table and key, for anything unknown, missing, in a wrong unit or
    impossible.

    Parameters
    ----------
    name_or_path : name of an engine that ships with the package (``diesel_i6``) or path of a ``.toml`` file
    """
    path = engine_path(name_or_path)
    document = _document(path)
    tables: dict[str, Any] = {}
    hints = get_type_hints(Engine)
    same_names(set(hints), optional_fields(Engine), set(document), path.name, "table")
    for name, hint in hints.items():
        if name not in document:
            continue
        where = f"{path.name}: {name}"
        if name in TABLES:
            tables[name] = _added(name, document[name], where, path.parent)
            continue
        kind = get_args(hint)[0] if isinstance(hint, UnionType) else hint
        if name in TEXTS:
            if not isinstance(document[name], str):
                raise InputError(f'{where}: must be plain text, e.g. {name} = "diesel_i6"')
            (check_name if name == "name" else check_title)(document[name], where)
            tables[name] = document[name]
            continue
        tables[name] = read_table(kind, document[name], where)
    engine = Engine(**tables)
    try:
        check_engine(engine)
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None
    return engine


def _added(name: str, found: Any, where: str, folder: Path) -> tuple[Any, ...]:
    """Tables of an array of tables, see :mod:`cranktrain.engine.additions`."""
    if not (isinstance(found, list) and all(isinstance(table, dict) for table in found)):
        raise InputError(f"{where}: must be an array of tables, [[{name}]]")
    made = []
    for number, table in enumerate(found, start=1):
        own = f"{where}[{number}]"
        for key in NEEDED[name]:
            if key not in table:
                raise InputError(f"{own}: key '{key}' is missing; add it as in {ADDED_LIKE}")
        texts = {key: check_text(name, key, table[key], own) for key in TEXTS_OF[name] if key in table}
        rest = {key: value for key, value in table.items() if key not in texts}
        if name != "connection":
            made.append(_with_texts(TABLES[name], rest, texts, own, folder))
            continue
        law = law_class(texts.get("law"), own)
        place = {key: rest.pop(key) for key in ("place",) if key in rest}
        data = read_table(law, rest, own, ADDED_LIKE)
        made.append(_with_texts(TABLES[name], place, {**texts, texts["law"]: data}, own, folder))
    return tuple(made)


def _with_texts(kind: Any, table: dict[str, Any], texts: dict[str, Any], where: str, folder: Path) -> Any:
    """A table whose texts are read already."""
    entries = {key: entry for key, entry in kinds(kind).items() if key not in texts}
    same_names(set(entries), optional_fields(kind), set(table), where, "key", ADDED_LIKE)
    made = kind(**texts, **{key: _si(value, entries[key], f"{where}.{key}") for key, value in table.items()})
    return located(made, folder) if kind is TABLES["body"] else made


def read_table(kind: Any, table: Any, where: str, like: str = "engine/data/diesel_i6.toml") -> Any:
    """A part of class ``kind`` from a table of a file, in SI; ``InputError`` names ``where`` and a file ``like`` it."""
    if not isinstance(table, dict):
        raise InputError(f"{where}: must be a table [{where.rpartition(' ')[2]}]")
    entries = kinds(kind)
    same_names(set(entries), optional_fields(kind), set(table), where, "key", like)
    keys = [entry.name for entry in fields(kind) if entry.name in table]
    return kind(**{key: _si(table[key], entries[key], f"{where}.{key}") for key in keys})


def check_name(name: str, where: str) -> None:
    """Refuse a name that cannot be part of a path or an identifier; ``InputError``."""
    if not NAME.fullmatch(name):
        raise InputError(
            f"{where}: {shown(name)} is no name; take 1 to 64 letters, digits and _, a letter first, e.g. my_six"
        )


def check_title(title: str, where: str) -> None:
    """Refuse a title that is not one line of printable characters; ``InputError``."""
    if not (title.strip() and title.isprintable() and len(title) <= LONGEST_TITLE):
        raise InputError(f"{where}: must be one line of at most {LONGEST_TITLE} printable characters")


def engine_provenance(name_or_path: str | Path) -> list[tuple[str, Any, str, str, str]]:
    """Every value of an engine file as it is written: (``table.key``, value, unit, origin, note)."""
    path = engine_path(name_or_path)
    load_engine(path)
    return [
        (f"{table}.{key}", entry["value"], entry.get("unit", "1"), entry["origin"], entry.get("note", ""))
        for table, entries in _document(path).items()
        if table not in TEXTS and table not in TABLES
        for key, entry in entries.items()
    ] + [
        (f"{table}[{number}].{key}", entry["value"], entry.get("unit", "1"), entry["origin"], entry.get("note", ""))
        for table in TABLES
        for number, entries in enumerate(_document(path).get(table, []), start=1)
        for key, entry in entries.items()
        if isinstance(entry, dict)
    ]


def _document(path: Path) -> dict[str, Any]:
    """TOML document of an engine file; ``InputError`` where it is none."""
    return read_toml(path, "engine file", f"shipped engines: {', '.join(engine_names())}")


def same_names(
    known: set[str],
    optional: set[str],
    found: set[str],
    where: str,
    noun: str,
    like: str = "engine/data/diesel_i6.toml",
) -> None:
    """Refuse names that are unknown or missing; a file in which to see them is ``like``."""
    if unknown := sorted(found - known):
        raise InputError(f"{where}: unknown {noun} '{unknown[0]}'; {nearest(unknown[0], sorted(known))}")
    if missing := sorted(known - optional - found):
        raise InputError(f"{where}: {noun} '{missing[0]}' is missing; add it as in {like}")


def _si(entry: Any, kind: tuple[type, bool, Any], where: str) -> Any:
    """Value of one entry in SI, of the kind its field wants."""
    plain, many, rule = kind
    if not isinstance(entry, dict) or "value" not in entry:
        raise InputError(f'{where}: write it as {{ value = ..., unit = "...", origin = "chosen" }}')
    if unknown := sorted(set(entry) - set(ENTRY)):
        raise InputError(f"{where}: unknown entry '{unknown[0]}'; {nearest(unknown[0], ENTRY)}")
    origin = entry.get("origin")
    if origin not in ORIGINS:
        raise InputError(f"{where}: origin '{origin}' is not known; {nearest(str(origin), ORIGINS)}")
    if origin in ("calibrated", "published") and not entry.get("note"):
        raise InputError(f"{where}: a value of origin '{origin}' needs a note that says to or from which number")
    dimension = rule.dimension if isinstance(rule, Quantity) else "1"
    unit, valid = entry.get("unit", "1"), UNITS[dimension]
    if not isinstance(unit, str) or unit not in valid:
        raise InputError(f"{where}: unit '{unit}' does not measure its {dimension}; use one of: {', '.join(valid)}")
    values = entry["value"]
    if isinstance(values, list) != many:
        raise InputError(f"{where}: {'a list of values' if many else 'a single value'} is wanted, got {shown(values)}")
    if not many:
        return _value(values, plain, valid[unit], OFFSETS.get(unit, 0.0), where)
    shift = OFFSETS.get(unit, 0.0)
    return tuple(_value(v, plain, valid[unit], shift, f"{where}[{i}]") for i, v in enumerate(values, start=1))


def _value(value: Any, kind: type, scale: float, shift: float, where: str) -> Any:
    """One value of its type, numbers in SI."""
    if kind is not float:
        if type(value) is not kind:
            wanted = {bool: "true or false", int: "a whole number", str: "a text"}[kind]
            raise InputError(f"{where}: {shown(value)} is not {wanted}")
        return value
    if not is_number(value):
        raise InputError(f"{where}: {shown(value)} is not a finite number")
    return float(value) * scale + shift
