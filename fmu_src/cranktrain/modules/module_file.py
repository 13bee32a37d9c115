"""Reading a module file: its texts, its tables of values with units and origins, and the engine that it names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from cranktrain.core.errors import InputError
from cranktrain.core.typed_file import record
from cranktrain.core.user_file import read_toml
from cranktrain.engine.entries import part_of, said, stated, table_of
from cranktrain.engine.file import TEXT_KINDS, check_name, check_title, load_engine
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import check_values
from cranktrain.modules.module_settings import to_bytes
from cranktrain.modules.register import Contents

Settings = TypeVar("Settings", bound=Any)


def load_module_file(
    path: str | Path, tables: Any, like: str, settings: Callable[[Any, Engine, str, str], Settings]
) -> Settings:
    """Read a module file and its engine.

    Parameters
    ----------
    tables : record whose fields are the file's tables
    like : path of a shipped file to look at
    settings : makes and checks the module's settings from tables, engine, name and title

    Raises
    ------
    InputError
        one line with file, table and key, for what is unknown, missing or impossible
    """
    path = Path(path)
    document = read_toml(path, "module file", f"an example is {like}")
    read = record(module_table(tables, like), document, path.name, said)
    check_name(read.name, f"{path.name}: name")
    check_title(read.title, f"{path.name}: title")
    found = {
        name: part_of(kind, getattr(read, name), f"{path.name}: {name}")
        for name, kind in get_type_hints(tables).items()
    }
    engine = load_engine(path.parent / read.engine if read.engine.endswith(".toml") else read.engine)
    try:
        for name, table in found.items():
            check_values(table, name)
        return settings(tables(**found), engine, read.name, read.title)
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None


@cache
def module_table(tables: Any, like: str) -> Any:
    """The document of a module file as it is read, see :mod:`cranktrain.engine.entries`."""
    keys: list[Any] = [("module", str), *TEXT_KINDS.items(), ("engine", str)]
    keys += [(name, stated(kind, like)) for name, kind in get_type_hints(tables).items()]
    return table_of(tables.__name__, keys, tables.__doc__, like)


def module_contents(settings: Any) -> Contents:
    """What the FMU of a module with these settings is made of."""
    starts = {entry.name: getattr(settings, entry.name) for entry in fields(settings)}
    counts = {"cylinders": len(settings.firing_angles)}
    return Contents(settings.name, settings.title, counts, starts, to_bytes(settings))
