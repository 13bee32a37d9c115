"""Text of a calibrated engine file: the text of the old file with changed values, origins and notes."""

import math
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from cranktrain.core.errors import InputError
from cranktrain.core.units import unit_factor
from cranktrain.core.user_file import ending
from cranktrain.engine import values
from cranktrain.engine.file import engine_path, load_engine
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import UNITS
from cranktrain.engine.written import entry_text, toml_text
from cranktrain.store.whole_file import Kind, check_place, whole_file

DIGITS = 4
NEW = Kind("file to be replaced", lambda path: False)
"""File kind that matches no existing file, so that a new engine file replaces none."""


class Written(NamedTuple):
    """A value for an engine file: a number in SI or a list of whole numbers, its origin and its note."""

    value: float | tuple[int, ...]
    origin: str
    note: str


def rounded(number: float, scale: float = 1.0) -> float:
    """Number (SI) rounded to the digits that an engine file has in a unit of size ``scale`` (SI)."""
    return float(f"{number / scale:.{DIGITS}g}") * scale


class EngineText(NamedTuple):
    """An engine file: its text, its name in messages, and the folder at which its paths start."""

    text: str
    name: str
    folder: Path


def engine_text(engine: str | Path | Engine) -> EngineText:
    """The file of an engine by name or path; of one in memory the file that it would be."""
    if isinstance(engine, Engine):
        return EngineText(engine.to_toml(), f"{engine.name}.toml", Path())
    path = engine_path(engine)
    return EngineText(path.read_text("utf-8"), path.name, path.parent)


def rewritten(text: str, engine: Engine, changes: Mapping[str, Written]) -> str:
    """Text of an engine file with values replaced by ``changes`` (by key); each value keeps its unit.

    Raises ``InputError`` for an entry that is not written as ``name = ...`` under its ``[table]``.
    """
    lines, document = text.splitlines(), tomllib.loads(text)
    for key, change in changes.items():
        table, name, index = re.fullmatch(r"([a-z_]+)\.([a-z0-9_]+)(?:\[(\d+)\])?", key).groups()  # type: ignore[union-attr]
        old = document.get(table, {}).get(name)
        if isinstance(change.value, tuple):
            put(lines, key, toml_text(list(change.value)), "", change)
            continue
        rule = values.quantity(engine, key)
        unit = (old or {}).get("unit", next(iter(UNITS[rule.dimension])))
        scale, zero, _ = unit_factor(unit, rule.dimension)
        number = _number((change.value - zero) / scale)
        if old and isinstance(old["value"], list):
            entries = [_number(entry) for entry in old["value"]]
            entries = [number if index in (None, str(i)) else entry for i, entry in enumerate(entries, 1)]
            old["value"], number = [float(entry) for entry in entries], f"[{', '.join(entries)}]"
        put(lines, key, number, unit, change)
    return "\n".join(lines) + "\n"


def write_new(path: Path, text: str) -> None:
    """Write a new engine file, and read it back; on ``InputError`` nothing is written."""
    with whole_file(path, NEW) as temporary:
        temporary.write_text(text, encoding="utf-8")
        load_engine(temporary)


def put(lines: list[str], key: str, value: str, unit: str, change: Written) -> None:
    """Put a value, given as TOML text, into the lines of an engine file: for the old one, or at the end of its table.

    The old entry's indentation and a comment behind it are kept. A table that the file does not have is added.
    (tomlkit would move tables of a file whose [[body]] and [[frame]] alternate, so the lines are edited here.)

    Raises ``InputError`` for an entry that is not written as ``name = ...`` under ``[table]``.
    """
    table, name = key.partition("[")[0].split(".")
    entry = entry_text(name, value, unit, change.origin, change.note)
    document = tomllib.loads("\n".join(lines))
    start = next((i for i, line in enumerate(lines) if re.fullmatch(rf"\s*\[\s*{table}\s*\]\s*(#.*)?", line)), None)
    if start is None:
        if table in document:
            raise InputError(f"{key}: the engine file has no line [{table}]; write the table under such a line")
        lines += ["", f"[{table}]", entry]
        return
    last = at = start + 1
    while at < len(lines) and not re.match(r"\s*\[", lines[at]):
        if not lines[at].strip() or lines[at].lstrip().startswith("#"):
            at += 1
            continue
        end = _end(lines, at)
        if old := re.match(rf"(\s*){name}\s*=", lines[at]):
            remark = _remark(lines[at:end])
            lines[at:end] = [old[1] + entry + ("  " + remark if remark else "")]
            return
        last = at = end
    if name in document[table]:
        raise InputError(f"{key}: is not written as {name} = {{ ... }} under [{table}] in the engine file; write it so")
    lines.insert(last, entry)


def new_path(path: Path) -> Path:
    """Path of a new engine file; ``InputError`` if the file exists or its name does not end in .toml."""
    if path.exists():
        raise InputError(f"{path}: exists and is not overwritten; give another name with --output")
    if ending(path) != ".toml":
        raise InputError(f"{path}: an engine file ends in .toml; give such a name with --output")
    check_place(path)
    return path


def _number(value: float) -> str:
    """Text of a number for an engine file."""
    if value == int(value) and abs(value) < 1e6:
        return str(int(value))
    digits = f"{value:.{DIGITS}g}"
    return digits if math.isclose(float(digits), value, rel_tol=1e-9) else repr(value)


def _end(lines: list[str], start: int) -> int:
    """Index of the line after an entry, whose lists may extend over several lines."""
    for end in range(start + 1, len(lines) + 1):
        if _parsed("\n".join(lines[start:end])) is not None:
            return end
    return start + 1


def _remark(lines: list[str]) -> str:
    """Comment behind an entry of an engine file; empty if there is none."""
    text = "\n".join(lines)
    whole, last = _parsed(text), text.rfind("\n") + 1
    for place in re.finditer("#", text):
        if place.start() >= last and _parsed(text[: place.start()]) == whole:
            return text[place.start() :].rstrip()
    return ""


def _parsed(text: str) -> dict[str, Any] | None:
    """Content of a TOML text as dictionary; None if the text is not TOML."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return None
