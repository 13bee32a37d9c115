"""Parsing of the FMUs (units) of a harness file: each is a file or a product to build, and has start values."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cranktrain.core.errors import InputError, shown
from cranktrain.core.typed_file import record
from cranktrain.core.user_file import beside, ending, file_exists
from cranktrain.engine.file import load_engine
from cranktrain.modules.register import module_path, shipped_for_engines
from cranktrain_lab.coupling.modules import COMBUSTION, CRANKTRAIN, VALVETRAIN, combustion_of
from cranktrain_lab.harness.entries import UnitEntry
from cranktrain_lab.harness.measures import named
from cranktrain_lab.harness.tables import HarnessTable, Measured, UnitTable

RESERVED = ("measured", "misfit")
"""Reserved names of the units that a measurement adds, see :mod:`cranktrain_lab.harness.recording`."""
_NAME = re.compile(r"[A-Za-z]\w*")


def units_of(path: Path, document: HarnessTable) -> dict[str, UnitEntry]:
    """Return the units of a file, including those of its engine."""
    tables, own = document.units, document.connections is not None
    if document.recording is not None:
        for name in (COMBUSTION, VALVETRAIN, *RESERVED):
            if name in tables:
                raise InputError(f"units.{name}: [measured] takes the place of it; leave one of them out")
    for name in tables:
        if not _NAME.fullmatch(name):
            raise InputError(f"units.{name}: a unit's name is a word of letters and digits; rename it")
    defaults = _defaults(path, document)
    found = {}
    for name in dict.fromkeys((*defaults, *tables)):
        table = tables.get(name, UnitTable())
        where = f"units.{name}"
        if table.fmu is not None and table.build is not None:
            raise InputError(f"{where}: fmu and build exclude each other; leave one out")
        build = defaults.get(name) if table.build is None and table.fmu is None else table.build
        if build is None and table.fmu is None:
            raise InputError(f'{where}: fmu or build is missing; name a file, fmu = "my.fmu", or what to build')
        fmu = None if table.fmu is None else beside(path, table.fmu)
        if fmu is not None and not file_exists(fmu):
            raise InputError(f"{where}.fmu: {fmu} does not exist; paths start at the harness file's folder")
        if table.build is not None:
            build = _built(path, table.build, f"{where}.build")
        found[name] = UnitEntry(fmu, build, start_values(table.start, f"{where}.start"), table.record)
    if not found:
        raise InputError('no units; name an engine, engine = "diesel_i6", or give [units.NAME]')
    needed = {CRANKTRAIN} if document.recording is not None else {CRANKTRAIN, COMBUSTION}
    if not own and not needed <= set(found):
        missing = ", ".join(sorted(needed - set(found)))
        raise InputError(f"the virtual engine needs unit {missing}; give it, or your own [connections]")
    return found


def _defaults(path: Path, document: HarnessTable) -> dict[str, str]:
    """Return what to build for units of the engine without an own entry, as ``cranktrain couple`` does."""
    tables = document.units
    if document.engine is None:
        if document.valvetrain is not None:
            raise InputError("valvetrain applies only to the units of an engine; name an engine, or leave it out")
        return {}
    if document.connections is not None:
        raise InputError("engine does not go with [connections]; name every unit with [units.NAME]")
    engine = _built(path, document.engine, "engine")
    loaded = load_engine(engine)
    found = {CRANKTRAIN: engine}
    if document.recording is not None:
        return found
    own = tables.get(COMBUSTION, UnitTable())
    if own.fmu is None and own.build is None:
        found = {COMBUSTION: combustion_of(loaded, engine)} | found
    if document.valvetrain is False:
        if VALVETRAIN in tables:
            raise InputError("valvetrain = false leaves out what [units.valvetrain] gives; leave one of them out")
    elif loaded.name in (shipped := shipped_for_engines(VALVETRAIN)):
        found = {VALVETRAIN: shipped[loaded.name]} | found
    return found


def _built(path: Path, name: str, where: str) -> str:
    """Return the engine or module to build an FMU from, with a path independent of the folder; ``InputError``."""
    name = str(beside(path, name)) if ending(name) == ".toml" else name
    try:
        if module_path(name) is None:
            load_engine(name)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return name


def start_values(table: Mapping[str, Any], where: str) -> dict[str, tuple[Any, str]]:
    """Return start values with their units of measurement."""
    found: dict[str, tuple[Any, str]] = {}
    for name, given in table.items():
        value, unit = given, ""
        if isinstance(given, dict):
            read = record(Measured, given, f"{where}.{name}")
            value, unit = read.value, named(read.unit, f"{where}.{name}")
        if not isinstance(value, int | float | str | bool):
            raise InputError(f"{where}.{name}: {shown(value)} is not a number, a text, true or false")
        found[name] = value, unit
    return found
