"""Reader of text tables of any dialect, in parts; large tables are converted to a temporary binary file.

The first column is the time if its name or unit shows this. A table without time may state its rate in a comment or in
the header (``rate = 10000 Hz``, ``fs: 1e4``).
"""

import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.text_clock import Clocks
from cranktrain.core.text_table import TextTable, table_chunks
from cranktrain.core.types import Array
from cranktrain.core.units import is_unit
from cranktrain_lab.measured.channels import Channel, Held
from cranktrain_lab.measured.counters import clock_of
from cranktrain_lab.measured.formats.arrays import TIME_UNITS, Named, as_channels, is_time

WHAT, REMEDY = "table of measured signals", "export it again with one column a channel under a line of names"
LARGE = 4_000_000
"""Largest number of values of a table in memory; a larger table is stored in a temporary file of float64."""
PIECE = 1_000_000
"""Number of values read from the temporary file at once."""
RATE = re.compile(
    r"(?i)\b(?:fs|rate|sampl\w*(?:[ _]?rate|[ _]?freq\w*)?|abtastrate)\b\s*[:=]?\s*([0-9.eE+]+)\s*(k?hz|1/s)?"
)
STEP = re.compile(r"(?i)\b(?:dt|delta[ _]?t|increment)\b\s*[:=]?\s*([0-9.eE+-]+)\s*(s|ms|us)?\b")
SPEEDS = ("rpm", "1/min", "rev/min", "min-1", "u/min", "min^-1")


class Values(NamedTuple):
    """Values of a table, in memory or in a temporary file.

    Attributes
    ----------
    table : first part of the table, with names, units and comments
    size : number of rows
    read : function (first, past the last, column) → values
    missing : (columns,) number of missing values
    first_missing : (columns,) line number of the first missing value
    """

    table: TextTable
    size: int
    read: Callable[[int, int, int], Array]
    missing: NDArray[np.int64]
    first_missing: NDArray[np.int64]

    def column(self, k: int) -> Callable[[int, int, int], Array]:
        """Return the reader of one column, for :class:`Named`."""
        return lambda first, last, _: self.read(first, last, k)


def channels(path: Path) -> tuple[list[Channel], list[str]]:
    """List the numeric columns of a table as channels, and remarks."""
    clocks = Clocks()
    values = collected(table_chunks(path, WHAT, REMEDY, clocks=clocks))
    table, remarks = values.table, []
    said = " ; ".join((*table.comments, *(cell for row in table.header for cell in row)))
    arrays, named = [], _names(table)
    stated = clock_of(said) if len(named) == 1 else None
    if stated and not named[0][1]:
        named = [(named[0][0], f"ticks of {stated:g} Hz")]
    time = min(clocks.first, default=None)
    all_times = all(is_time_unit(unit) for _, unit in named)
    for k, (name, unit) in enumerate(named):
        missing = int(values.missing[k])
        if missing == values.size:
            remarks.append(f"{path.name}, channel {name}: holds no numbers and is left out")
            continue
        if missing:
            remarks.append(
                f"{path.name}, channel {name}: {missing} of {values.size} values are missing, from line "
                f"{values.first_missing[k]}"
            )
        if k in clocks.first and k != time:
            remarks.append(f"{path.name}, channel {name}: is a second column of times and is left out")
            continue
        if k == time or (k == 0 and time is None and is_time_unit(unit) and not is_time(name) and not all_times):
            name, unit = "time", "s" if k == time else unit
        elif time is not None and is_time(name):
            name = f"column {name}"
        arrays.append(Named(name, unit, values.size, 1, values.column(k)))
    if time in clocks.dated:
        arrays = [one._replace(began=clocks.first[time]) for one in arrays]
    speed = next((one for one in arrays[:1] if one.unit.lower().replace(" ", "") in SPEEDS), None)
    if speed is not None and len(arrays) > 1 and not any(is_time(one.name) for one in arrays):
        return _over_speed(arrays, speed, path.name), remarks
    found, told = as_channels(arrays, _sampling(said), path.name)
    return found, remarks + told


def is_time_unit(unit: str) -> bool:
    """True if the unit is a unit of time."""
    return unit.strip().lower() in TIME_UNITS


def name_and_unit(text: str) -> tuple[str, str]:
    """Split ``name [unit]`` or ``name (unit)`` into name and unit."""
    match = re.fullmatch(r"\s*(.*?)\s*[\[(]([^\])]*)[\])]\s*", text)
    if match and match[1] and (is_unit(match[2]) or not match[2] or clock_of(match[2])):
        return match[1], match[2]
    return text.strip(), ""


def collected(table: Iterable[TextTable]) -> Values:
    """Collect the values of a table's parts, each of which is read once."""
    held, first = Held(LARGE), None
    missing = first_missing = np.zeros(0, dtype=np.int64)
    for part in table:
        if first is None:
            first = part._replace(values=part.values[:1], lines=part.lines[:1])
            missing, first_missing = np.zeros((2, part.values.shape[1]), dtype=np.int64)
        absent = np.isnan(part.values)
        begin = (missing == 0) & absent.any(axis=0)
        first_missing[begin] = part.lines[absent.argmax(axis=0)[begin]]
        missing += absent.sum(axis=0)
        held.add(part.values)
    assert first is not None  # the reader raises an error for a table without rows

    def read(begin: int, end: int, k: int) -> Array:
        # In pieces, because all columns of a large table would fill the memory.
        step = max(1, PIECE // held.width)
        pieces = [held.read(row, min(row + step, end))[:, k] for row in range(begin, end, step)]
        return np.concatenate(pieces) if pieces else np.zeros(0)

    return Values(first, held.count, read, missing, first_missing)


def _names(table: TextTable) -> list[tuple[str, str]]:
    """Return name and unit of each column; columns without a name are numbered."""
    result = []
    for k, (name, unit) in enumerate(zip(table.names, table.units, strict=True)):
        if name and not unit:
            name, unit = name_and_unit(name)
        result.append((name or f"column {k + 1}", unit))
    return result


def _sampling(text: str) -> dict[str, float]:
    """Return the rate or step stated in comments and header."""
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
    """Return columns as channels over a first column of speeds."""
    return [
        Channel(one.name, one.unit, one.size, source, _of(one), float(speed.read(0, 1, 0)[0]), places=_of(speed),
                abscissa="speed", abscissa_unit="rev/min")
        for one in arrays[1:]
    ]  # fmt: skip


def _of(one: Named) -> Any:
    return lambda first, last: one.read(first, last, 0)
