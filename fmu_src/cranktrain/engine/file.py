"""Engine files: TOML in which every value states its unit and its origin.

One table per dataclass of :mod:`cranktrain.engine.model`; an entry reads

    throw = { value = 60, unit = "mm", origin = "derived", note = "half the stroke" }

``value`` may be a list. ``origin`` is *chosen*, *derived*, *calibrated*, *published* or *identified*; the last three
need a note that names the source number or data. Values are converted to SI and checked once, here. Keys and tables
whose field has a default may be left out.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache, reduce
from operator import or_
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, get_args, get_type_hints

from msgspec import Meta

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.typed_file import record
from cranktrain.core.user_file import ending, read_toml, user_path
from cranktrain.engine.additions import TABLES, located
from cranktrain.engine.additions import TEXTS as TEXTS_OF
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.connections import DATA
from cranktrain.engine.entries import ORIGINS as ORIGINS
from cranktrain.engine.entries import keys_of, needed_keys, part_of, said, stated, table_of
from cranktrain.engine.firing import from_first_cylinder
from cranktrain.engine.model import Engine, optional_fields
from cranktrain.engine.oil_grades import graded
from cranktrain.engine.written import document_of

TEXTS = ("name", "title")
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")
"""Pattern of an engine's name, which becomes part of paths and of an FMU's identifiers."""
LONGEST_TITLE = 200
TEXT_KINDS = {
    "name": Annotated[str, Meta(extra_json_schema={"pattern": f"^{NAME.pattern}$"})],
    "title": Annotated[str, Meta(extra_json_schema={"minLength": 1, "maxLength": LONGEST_TITLE})],
}
LIKE = "engine/data/diesel_i6.toml"
"""Example file with an engine's tables, named in messages."""
ADDED_LIKE = "docs/how-to/added_bodies.md"
"""Example file with bodies, frames and connections, named in messages."""


def engine_folder() -> Path:
    """Folder of the engines that ship with the package."""
    return Path(__file__).with_name("data")


def engine_names() -> list[str]:
    """Names of the engines that ship with the package, without their targets files ``*.targets.toml``."""
    return sorted(path.stem for path in engine_folder().glob("*.toml") if "." not in path.stem)


def engine_path(name_or_path: str | Path) -> Path:
    """Path of an engine file, from a path or the name of an engine that ships with the package."""
    text = str(name_or_path)
    if ending(text) == ".toml":
        return user_path(text)
    if text not in engine_names():
        raise InputError(
            f"unknown engine '{text}': {nearest(text, engine_names())} (or give the path of a .toml engine file)"
        )
    return engine_folder() / f"{text}.toml"


def load_engine(name_or_path: str | Path | Engine) -> Engine:
    """Read and check an engine file; an engine built or changed in Python is checked in the same way.

    Raises ``InputError``, one line with file, table and key, for anything unknown, missing, in a wrong unit or
    impossible.

    Parameters
    ----------
    name_or_path : name of an engine that ships with the package (``diesel_i6``), path of a ``.toml`` file, or an engine
    """
    if isinstance(name_or_path, Engine):
        return engine_of(document_of(name_or_path), "engine", None)
    path = engine_path(name_or_path)
    return engine_of(_document(path), path.name, path.parent)


def engine_of(document: dict[str, Any], where: str, folder: Path | None) -> Engine:
    """Checked engine from the document of an engine file; ``InputError`` starts with ``where``.

    ``folder`` is the folder to which paths of added bodies are relative; None if they are absolute.
    """
    read = record(engine_table(), document, where, said)
    check_name(read.name, f"{where}: name")
    check_title(read.title, f"{where}: title")
    given = {name: getattr(read, name) for name in engine_parts() if getattr(read, name) is not None}
    added: dict[str, Any] = {
        name: tuple(_added(name, found, where, folder)) for name in TABLES if (found := getattr(read, name))
    }
    tables = {name: part_of(engine_parts()[name], found, f"{where}: {name}") for name, found in given.items()}
    try:
        tables["oil"] = graded(tables["oil"])
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    turned = from_first_cylinder(tables["crankshaft"], tables["cylinders"], tables["rod"])
    tables["crankshaft"] = replace(tables["crankshaft"], throw_angles=turned)
    engine = Engine(read.name, read.title, **tables, **added)
    try:
        check_engine(engine)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return engine


@cache
def engine_parts() -> dict[str, type]:
    """Classes of the tables of an engine file, by name."""
    hints = {name: hint for name, hint in get_type_hints(Engine).items() if name not in (*TEXTS, *TABLES)}
    return {name: get_args(hint)[0] if isinstance(hint, UnionType) else hint for name, hint in hints.items()}


@cache
def engine_table() -> Any:
    """Struct of an engine file's document, see :mod:`cranktrain.engine.entries`."""
    optional = optional_fields(Engine)
    keys: list[Any] = [(name, TEXT_KINDS[name]) for name in TEXTS]
    for name, part in engine_parts().items():
        kind = stated(part, LIKE)
        keys.append((name, kind | None, None) if name in optional else (name, kind))
    for name, part in TABLES.items():
        own = keys_of(part, TEXTS_OF[name], without=("law", *DATA))
        kinds = [table_of(part.__name__, own, part.__doc__, ADDED_LIKE, needed=needed_keys(part))]
        if name == "connection":
            kinds = [
                table_of(
                    data.__name__,
                    [*own, *keys_of(data)],
                    data.__doc__,
                    ADDED_LIKE,
                    tag_field="law",
                    tag=law,
                    needed=needed_keys(data),
                )
                for law, data in DATA.items()
            ]
        keys.append((name, list[reduce(or_, kinds)] | None, None))  # type: ignore[misc]
    return table_of("Engine", keys, Engine.__doc__, LIKE)


def _added(name: str, found: Sequence[Any], place: str, folder: Path | None) -> Iterator[Any]:
    """Dataclasses of a TOML array of tables, see :mod:`cranktrain.engine.additions`."""
    for table in found:
        where, more = f"{place}: {name} {shown(table.name)}", {}
        if name == "connection":
            law = type(table).__struct_config__.tag
            more = {"law": law, law: part_of(DATA[law], table, where)}
        made = part_of(TABLES[name], table, where, TEXTS_OF[name], **more)
        yield located(made, folder) if name == "body" and folder is not None else made


def check_name(name: str, where: str) -> None:
    """Refuse a name that cannot be part of a path or an identifier; ``InputError``."""
    if not NAME.fullmatch(name):
        raise InputError(
            f"{where}: {shown(name)} is not a valid name; use 1 to 64 letters, digits, _, a letter first, e.g. my_six"
        )


def check_title(title: str, where: str) -> None:
    """Refuse a title that is not one line of printable characters; ``InputError``."""
    if not (title.strip() and title.isprintable() and len(title) <= LONGEST_TITLE):
        raise InputError(f"{where}: must be one line of at most {LONGEST_TITLE} printable characters")


def engine_provenance(name_or_path: str | Path) -> list[tuple[str, Any, str, str, str]]:
    """Every value of an engine file as written: (``table.key``, value, unit, origin, note)."""
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
    """TOML document of an engine file; ``InputError`` if it is not TOML."""
    return read_toml(path, "engine file", f"shipped engines: {', '.join(engine_names())}")
