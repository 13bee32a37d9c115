"""Engine with some values changed, checked in the same way as an engine file."""

import re
from collections.abc import Mapping
from typing import Any

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.engine.additions import TABLES
from cranktrain.engine.additions import TEXTS as TEXTS_OF
from cranktrain.engine.connections import DATA
from cranktrain.engine.file import TEXTS, engine_of, engine_parts
from cranktrain.engine.model import Engine
from cranktrain.engine.written import document_of, entry_of, plain, table_of_part

_ADDED = re.compile(r"(\w+)\[([0-9]{1,18})\]")


def changed_engine(engine: Engine, changes: Mapping[str, Any]) -> Engine:
    """Engine with other values, given as ``changes``; see :meth:`cranktrain.engine.model.Engine.with_`."""
    document = document_of(engine)
    for path, value in changes.items():
        if not isinstance(path, str):
            raise InputError(f"with_: {shown(path)} is no name of a value; give a text such as 'flywheel.mass'")
        table, _, key = path.replace("__", ".", 1).partition(".")
        if _ADDED.fullmatch(table) and key:
            _change_added(document, table, key, value)
        elif table not in (*TEXTS, *engine_parts(), *TABLES):
            names = (*TEXTS, *engine_parts(), *TABLES)
            raise InputError(f"with_: an engine has no '{table}'; {nearest(table, names)}")
        elif table in TEXTS or table in TABLES or not key:
            # Set a text or a whole table of an engine file's document; None removes the table.
            if value is None:
                document.pop(table, None)
            elif table in TABLES:
                raise InputError(f"with_: name the table and its value, as in '{table}[1].name'")
            else:
                document[table] = table_of_part(value, table)
        else:
            # Set one value of a TOML table of the document; None restores the default of the value.
            own = document.setdefault(table, {})
            if not isinstance(own, dict):
                raise InputError(f"with_: {table} is {shown(own)}, not a table, so it has no {key}")
            if value is None:
                own.pop(key, None)
            else:
                own[key] = entry_of(engine_parts()[table], key, value, f"{table}.{key}")
    return engine_of(document, engine.name, None)


def connected_engine(engine: Engine, name: str, law: Any, ends: Any, place: Any, values: Mapping[str, Any]) -> Engine:
    """Engine with one more connection; see :meth:`cranktrain.engine.model.Engine.connected`."""
    where = f"connection '{name}'"
    if hasattr(law, "stated"):
        law, own = "own", table_of_part(law.stated(values, where), where)
    elif isinstance(law, str) and law in DATA:
        own = {key: entry_of(DATA[law], key, value, f"{where}: {key}") for key, value in values.items()}
    else:
        text = f"{nearest(law, DATA)}" if isinstance(law, str) else "give a name, or a function with @ct.law"
        raise InputError(f"{where}: no law {shown(law)}; {text}")
    table = {"name": plain(name, "connection: name"), "law": law, "ends": plain(ends, f"{where}: ends"), **own}
    if len(place):
        table["place"] = entry_of(TABLES["connection"], "place", place, f"{where}: place")
    document = document_of(engine)
    document["connection"] = [*document.get("connection", []), table]
    return engine_of(document, engine.name, None)


def _change_added(document: dict[str, Any], place: str, key: str, value: Any) -> None:
    """Set one value of an added body, frame or connection, numbered from 1."""
    match = _ADDED.fullmatch(place)
    assert match is not None
    table, number = match[1], int(match[2])
    if table not in TABLES:
        raise InputError(f"with_: an engine has no '{place}'; {nearest(table, TABLES)}")
    tables = document.get(table, [])
    if not 1 <= number <= len(tables):
        raise InputError(f"with_: the engine has {len(tables)} [[{table}]], so there is no {place}")
    own, part = tables[number - 1], TABLES[table]
    if table == "connection" and key not in ("name", "law", "ends", "place"):
        part = DATA.get(own["law"], part)
    if value is None:
        own.pop(key, None)
    elif key in ("law", *TEXTS_OF[table]):
        own[key] = plain(value, f"{place}.{key}")
    else:
        own[key] = entry_of(part, key, value, f"{place}.{key}")
