"""Units of harness files: their FMUs, or what to build, and their start values."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cranktrain.core.errors import InputError, shown
from cranktrain.coupling.modules import COMBUSTION, CRANKTRAIN, VALVETRAIN
from cranktrain.engine.file import load_engine
from cranktrain.modules.register import module_of_engine, module_path, shipped_for_engines
from cranktrain.studies.harness.entries import UnitEntry
from cranktrain.studies.harness.measures import named
from cranktrain.studies.harness.places import table_of
from cranktrain.studies.typed_table import NUMBER, TABLE, TEXT, TEXTS

_UNIT = {"fmu": TEXT, "build": TEXT, "start": TABLE, "record": TEXTS}
_NAME = re.compile(r"[A-Za-z]\w*")


def units_of(path: Path, document: Mapping[str, Any], own: bool) -> dict[str, UnitEntry]:
    """Units of a file, those of its engine among them."""
    tables = document.get("units", {})
    for name, table in tables.items():
        if not _NAME.fullmatch(name):
            raise InputError(f"units.{name}: a unit's name is a word of letters and digits; rename it")
        table_of(table, _UNIT, f"units.{name}")
    defaults = _defaults(path, document, tables, own)
    found = {}
    for name in dict.fromkeys((*defaults, *tables)):
        table = tables.get(name, {})
        where = f"units.{name}"
        if "fmu" in table and "build" in table:
            raise InputError(f"{where}: fmu and build exclude each other; leave one out")
        build = table.get("build", None if "fmu" in table else defaults.get(name))
        if build is None and "fmu" not in table:
            raise InputError(f'{where}: neither fmu nor build; name a file, fmu = "my.fmu", or what to build')
        fmu = path.parent / table["fmu"] if "fmu" in table else None
        if fmu is not None and not fmu.is_file():
            raise InputError(f"{where}.fmu: {fmu} does not exist; paths start at the harness file's folder")
        if "build" in table:
            build = _built(path, table["build"], f"{where}.build")
        start = start_values(table.get("start", {}), f"{where}.start")
        found[name] = UnitEntry(fmu, build, start, tuple(table.get("record", ())))
    if not found:
        raise InputError('no units; name an engine, engine = "diesel_i6", or give [units.NAME]')
    if not own and not {CRANKTRAIN, COMBUSTION} <= set(found):
        missing = ", ".join(sorted({CRANKTRAIN, COMBUSTION} - set(found)))
        raise InputError(f"unit {missing} is missing, which the virtual engine has; give it, or [connections]")
    return found


def _defaults(
    path: Path, document: Mapping[str, Any], tables: Mapping[str, Mapping[str, Any]], own: bool
) -> dict[str, str]:
    """What is built for units of a file's engine that it names nothing for: as ``cranktrain couple`` does."""
    if "engine" not in document:
        if "valvetrain" in document:
            raise InputError("valvetrain says whether units of the engine have one; name an engine, or leave it out")
        return {}
    if own:
        raise InputError("engine and [connections] exclude each other; name every unit with [units.NAME]")
    engine = _built(path, document["engine"], "engine")
    name = load_engine(engine).name
    found = {CRANKTRAIN: engine}
    if not {"fmu", "build"} & set(tables.get(COMBUSTION, {})):
        found = {COMBUSTION: module_of_engine(COMBUSTION, name)} | found
    if not document.get("valvetrain", True):
        if VALVETRAIN in tables:
            raise InputError("valvetrain = false leaves out what [units.valvetrain] gives; leave one of them out")
    elif name in (shipped := shipped_for_engines(VALVETRAIN)):
        found = {VALVETRAIN: shipped[name]} | found
    return found


def _built(path: Path, name: str, where: str) -> str:
    """Engine or module to build an FMU of, by a name that holds wherever it is read; ``InputError``."""
    name = str(path.parent / name) if name.endswith(".toml") else name
    try:
        if module_path(name) is None:
            load_engine(name)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return name


def start_values(table: Mapping[str, Any], where: str) -> dict[str, tuple[Any, str]]:
    """Start values with their units of measurement."""
    found: dict[str, tuple[Any, str]] = {}
    for name, given in table.items():
        value, unit = given, ""
        if isinstance(given, dict):
            table_of(given, {"value": NUMBER, "unit": TEXT}, f"{where}.{name}")
            if len(given) < 2:
                raise InputError(f"{where}.{name}: a table holds value and unit, {{ value = 20, unit = 'degC' }}")
            value, unit = given["value"], named(given["unit"], f"{where}.{name}")
        if not isinstance(value, int | float | str | bool) or (isinstance(value, float) and not math.isfinite(value)):
            raise InputError(f"{where}.{name}: {shown(value)} is no number, text, true or false")
        found[name] = value, unit
    return found
