"""Text tables of any dialect by the one reader of tables, part by part; large ones go through a file of binary numbers.

The first column is the time if its name or unit says so. A table without a time states its rate in a comment or in the
header (``rate = 10000 Hz``, ``fs: 1e4``), or has none.
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.text_table import TextTable, table_chunks
from cranktrain.core.units import is_unit
from cranktrain.measured.channels import Channel
from cranktrain.measured.formats.arrays import TIME_UNITS, Named, as_channels, is_time

WHAT, REMEDY = "table of measured signals", "export it again with one column a channel under a line of names"
LARGE = 50_000_000
"""Values of a table that are held in memory; of larger ones a temporary file of float64."""
RATE = re.compile(
    r"(?i)\b(?:fs|rate|sampl\w*(?:[ _]?rate|[ _]?freq\w*)?|abtastrate)\b\s*[:=]?\s*([0-9.eE+]+)\s*(k?hz|1/s)?"
)
STEP = re.compile(r"(?i)\b(?:dt|delta[ _]?t|increment)\b\s*[:=]?\s*([0-9.eE+-]+)\s*(s|ms|us)?\b")
SPEEDS = ("rpm", "1/min", "rev/min", "min-1", "u/min", "min^-1")


def channels(path: Path) -> tuple[list[Channel], list[str]]:
    """List the columns of numbers of a table, and remarks."""
    table, values = _values(path)
    remarks = []
    said = " ; ".join((*table.comments, *(cell for row in table.header for cell in row)))
    arrays, named = [], _names(table)
    for k, (name, unit) in enumerate(named):
        missing = int(np.count_nonzero(np.isnan(values[:, k]))) if values.shape[0] < LARGE else 0
        if missing == values.shape[0]:
            remarks.append(f"{path.name}, channel {name}: holds no numbers and is left out")
            continue
        if missing:
            first = int(table.first_line + np.flatnonzero(np.isnan(values[:, k]))[0])
            remarks.append(
                f"{path.name}, channel {name}: {missing} of {values.shape[0]} values are missing, from line {first}"
            )
        if k == 0 and is_time_unit(unit) and not is_time(name):
            name = "time"
        arrays.append(Named(name, unit, values.shape[0], 1, _reader(values, k)))
    speed = next((one for one in arrays[:1] if one.unit.lower().replace(" ", "") in SPEEDS), None)
    if speed is not None and len(arrays) > 1 and not any(is_time(one.name) for one in arrays):
        return _over_speed(arrays, speed, path.name), remarks
    found, told = as_channels(arrays, _sampling(said), path.name)
    return found, remarks + told


def is_time_unit(unit: str) -> bool:
    """Whether a unit is one of time."""
    return unit.strip().lower() in TIME_UNITS


def name_and_unit(text: str) -> tuple[str, str]:
    """Name and unit of ``name [unit]`` or ``name (unit)``."""
    match = re.fullmatch(r"\s*(.*?)\s*[\[(]([^\])]*)[\])]\s*", text)
    if match and match[1] and (is_unit(match[2]) or not match[2]):
        return match[1], match[2]
    return text.strip(), ""


def _values(path: Path) -> tuple[TextTable, np.ndarray]:
    """Words of the table and its values (rows, columns), in memory or mapped from a temporary file."""
    parts: list[np.ndarray] = []
    held, first, spill = 0, None, None
    for part in table_chunks(path, WHAT, REMEDY):
        first = part if first is None else first
        held += part.values.size
        if spill is None and held > LARGE:
            spill = tempfile.TemporaryFile(prefix="cranktrain-")  # noqa: SIM115 - the channels read it later
            for kept in parts:
                spill.write(np.ascontiguousarray(kept).tobytes())
            parts = []
        if spill is None:
            parts.append(part.values)
        else:
            spill.write(np.ascontiguousarray(part.values).tobytes())
    assert first is not None  # the reader refuses a table without rows
    width = first.values.shape[1]
    if spill is None:
        return first, np.concatenate(parts)
    spill.flush()
    return first, np.memmap(spill, dtype=np.float64, mode="r", shape=(held // width, width))


def _names(table: TextTable) -> list[tuple[str, str]]:
    """Name and unit of each column; columns without a name are numbered."""
    result = []
    for k, (name, unit) in enumerate(zip(table.names, table.units, strict=True)):
        if name and not unit:
            name, unit = name_and_unit(name)
        result.append((name or f"column {k + 1}", unit))
    return result


def _sampling(text: str) -> dict[str, float]:
    """Rate or step that the comments and the header state."""
    found = {}
    if (match := RATE.search(text)) and (value := _number(match[1])):
        found["fs"] = value * (1e3 if (match[2] or "").lower() == "khz" else 1.0)
    if (match := STEP.search(text)) and (value := _number(match[1])):
        found["dt"] = value * TIME_UNITS.get((match[2] or "s").lower(), 1.0)
    return found


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0


def _over_speed(arrays: list[Named], speed: Named, source: str) -> list[Channel]:
    """Columns over a first column of speeds."""
    return [
        Channel(one.name, one.unit, one.size, source, _of(one), float(speed.read(0, 1, 0)[0]), places=_of(speed),
                abscissa="speed", abscissa_unit="rev/min")
        for one in arrays[1:]
    ]  # fmt: skip


def _of(one: Named) -> Any:
    return lambda first, last: one.read(first, last, 0)


def _reader(values: np.ndarray, k: int) -> Any:
    return lambda first, last, _: np.asarray(values[first:last, k], dtype=np.float64)
