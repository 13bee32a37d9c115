"""A calibrated engine file: the old one's text with other values, their origins and notes."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from cranktrain.core.errors import InputError
from cranktrain.core.units import unit_factor
from cranktrain.core.user_file import ending
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import UNITS
from cranktrain.store.whole_file import Kind, check_place
from cranktrain.studies.calibration import values

DIGITS = 4
NEW = Kind("file to be replaced", lambda path: False)
"""Kind of a new file, which must not exist yet."""


class Written(NamedTuple):
    """A value for a file: SI or a list of whole numbers, origin and note."""

    value: float | tuple[int, ...]
    origin: str
    note: str


def rounded(number: float, scale: float = 1.0) -> float:
    """A number (SI) with as many digits as are written, in a unit of ``scale``."""
    return float(f"{number / scale:.{DIGITS}g}") * scale


def rewritten(text: str, engine: Engine, changes: Mapping[str, Written]) -> str:
    """Text of an engine file with other values by key; each keeps its unit.

    Raises ``InputError``: for an entry that does not stand on a line of its own.
    """
    lines, document = text.splitlines(), tomllib.loads(text)
    for key, change in changes.items():
        table, name, index = re.fullmatch(r"([a-z_]+)\.([a-z0-9_]+)(?:\[(\d+)\])?", key).groups()  # type: ignore[union-attr]
        old = document[table].get(name)
        note = change.note.replace("\\", "\\\\").replace('"', '\\"')
        if isinstance(change.value, tuple):
            entry = f'{name} = {{ value = {list(change.value)}, origin = "{change.origin}", note = "{note}" }}'
            _put(lines, key, table, name, entry)
            continue
        rule = values.quantity(engine, key)
        unit = (old or {}).get("unit", next(iter(UNITS[rule.dimension])))
        scale, zero, _ = unit_factor(unit, rule.dimension)
        number = _number((change.value - zero) / scale)
        if old and isinstance(old["value"], list):
            entries = [_number(entry) for entry in old["value"]]
            entries = [number if index in (None, str(i)) else entry for i, entry in enumerate(entries, 1)]
            old["value"], number = [float(entry) for entry in entries], f"[{', '.join(entries)}]"
        entry = f'{name} = {{ value = {number}, unit = "{unit}", origin = "{change.origin}", note = "{note}" }}'
        _put(lines, key, table, name, entry)
    return "\n".join(lines) + "\n"


def _put(lines: list[str], key: str, table: str, name: str, entry: str) -> None:
    """Put an entry in the place of the old one."""
    at = _line(lines, table, name)
    if at is None:
        raise InputError(f"{key}: does not stand on a line of its own in the engine file; give it its own line")
    lines[at[0] : at[1]] = [entry]


def new_path(path: Path) -> Path:
    """Path of a new engine file; ``InputError`` if the file exists or its name does not end in .toml."""
    if path.exists():
        raise InputError(f"{path}: exists and is not overwritten; give another name with --out")
    if ending(path) != ".toml":
        raise InputError(f"{path}: an engine file ends in .toml; give such a name with --out")
    check_place(path)
    return path


def _number(value: float) -> str:
    """A number as an engine file writes it."""
    if value == int(value) and abs(value) < 1e6:
        return str(int(value))
    digits = f"{value:.{DIGITS}g}"
    return digits if math.isclose(float(digits), value, rel_tol=1e-9) else repr(value)


def _line(lines: list[str], table: str, name: str) -> tuple[int, int] | None:
    """Lines of an entry, or where a new one goes: behind the last entry of its table."""
    start = next((i for i, line in enumerate(lines) if line.strip() == f"[{table}]"), None)
    if start is None:
        return None
    end = next((i for i in range(start + 1, len(lines)) if lines[i].startswith("[")), len(lines))
    for i in range(start + 1, end):
        if re.match(rf"{name}\s*=", lines[i]):
            return (i, i + 1) if re.search(r"\}\s*$", lines[i]) else None
    while not lines[end - 1].strip() or lines[end - 1].startswith("#"):
        end -= 1
    return end, end
