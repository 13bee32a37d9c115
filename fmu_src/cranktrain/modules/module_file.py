"""Reading a module file: its texts, its tables of values with units and origins, and the engine that it names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from cranktrain.core.errors import InputError
from cranktrain.core.user_file import read_toml
from cranktrain.engine.file import check_name, check_title, load_engine, read_table, same_names
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import check_values
from cranktrain.modules.module_settings import to_bytes
from cranktrain.modules.register import Contents

TEXTS = ("module", "name", "title", "engine")
Settings = TypeVar("Settings", bound=Any)


def load_module_file(
    path: str | Path, tables: type[Any], like: str, settings: Callable[[Any, Engine, str, str], Settings]
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
    hints = get_type_hints(tables)
    same_names({*TEXTS, *hints}, set(), set(document), path.name, "table", like)
    for key in TEXTS:
        if not isinstance(document[key], str):
            raise InputError(f'{path.name}: {key}: must be plain text, e.g. {key} = "{Path(like).stem}"')
    check_name(document["name"], f"{path.name}: name")
    check_title(document["title"], f"{path.name}: title")
    read = {name: read_table(kind, document[name], f"{path.name}: {name}", like) for name, kind in hints.items()}
    named = document["engine"]
    engine = load_engine(path.parent / named if named.endswith(".toml") else named)
    try:
        for name, table in read.items():
            check_values(table, name)
        return settings(tables(**read), engine, document["name"], document["title"])
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None


def module_contents(settings: Any) -> Contents:
    """What the FMU of a module with these settings is made of."""
    starts = {entry.name: getattr(settings, entry.name) for entry in fields(settings)}
    counts = {"cylinders": len(settings.firing_angles)}
    return Contents(settings.name, settings.title, counts, starts, to_bytes(settings))
