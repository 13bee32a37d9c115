"""Schedule of running in, as a sequence of hours at speeds and loads from a text table.

    hours, speed_rpm, load          a line each; load, a fraction of the full-load burn, may be left out
    0.5, 1000, 0.25
    2, 1600, 1.0

A schedule that is shorter than the requested time is repeated.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from cranktrain.core.column_names import kind_of
from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.text_header import named
from cranktrain.core.text_rows import TextRows, read_rows
from cranktrain.core.units import RPM
from cranktrain.engine.quantities import FASTEST_RPM, SLOWEST_RPM

HOUR = 3600.0
COLUMNS = ("hours", "speed_rpm", "load")
KINDS = ("duration", "speed", "load")
LONGEST_HOURS, HIGHEST_LOAD = 1.0e6, 2.0
REMEDY = "give lines of hours, speed_rpm and load under this header"


class Block(NamedTuple):
    """Block of a schedule: duration (s), speed (rad/s) and load as a fraction of the full-load burn."""

    duration: float
    speed: float
    load: float = 1.0


def read_schedule(path: str | Path) -> tuple[Block, ...]:
    """Read the blocks of a schedule file; ``InputError`` is one line with file and line number."""
    name = Path(path).name
    table = read_rows(path, "schedule of running in", REMEDY, lambda word: bool(kind_of(named(word)[0], KINDS)))
    kinds = [kind_of(column, KINDS) for column in table.names]
    for column, kind in zip(table.names, kinds, strict=True):
        if not kind:
            raise InputError(f"{name}: unknown column {shown(column)}; {nearest(column, COLUMNS)}")
    if len(set(kinds)) != len(kinds) or not {"duration", "speed"} <= set(kinds):
        raise InputError(
            f"{name}: columns are {', '.join(table.names)}; give hours, speed_rpm and load (or none), once"
        )
    blocks = [
        _block(f"{name}: line {number}", dict(zip(kinds, row, strict=False)), table) for number, row in table.rows
    ]
    if not blocks:
        raise InputError(f"{name}: has no line of values; {REMEDY}")
    return tuple(blocks)


def _block(where: str, cells: dict[str, str], table: TextRows) -> Block:
    """Return the block of one line of a schedule table; raises ``InputError`` for a missing or invalid value."""
    limits = {
        "duration": (1e-6, LONGEST_HOURS, "hours"),
        "speed": (SLOWEST_RPM, FASTEST_RPM, "rev/min"),
        "load": (0.0, HIGHEST_LOAD, "of the full-load burn"),
    }
    values = {}
    for kind, (low, high, unit) in limits.items():
        text = cells.get(kind, "1" if kind == "load" else "")
        try:
            value = table.dialect.number(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise InputError(
                f"{where}: {kind} {shown(text)} is not a number within {low:g} to {high:g} {unit}; {REMEDY}"
            )
        values[kind] = value
    return Block(values["duration"] * HOUR, values["speed"] * RPM, values["load"])


def block_at(blocks: Sequence[Block], time: float) -> tuple[int, float]:
    """Return the index of the block at a ``time`` (s) of a repeating schedule, and the end time of the block.

    A time at the boundary of two blocks, to rounding, belongs to the later block.
    """
    whole = sum(block.duration for block in blocks)
    begin = whole * math.floor(time / whole * (1.0 + 1e-12))
    while True:
        for k, block in enumerate(blocks):
            end = begin + block.duration
            if time < end * (1.0 - 1e-12):
                return k, end
            begin = end


def same_until(one: Sequence[Block], other: Sequence[Block], time: float) -> bool:
    """True if two schedules have equal speeds and loads up to a time, s."""
    at = 0.0
    while at < time * (1.0 - 1e-9):
        (k, end), (j, stop) = block_at(one, at), block_at(other, at)
        if one[k][1:] != other[j][1:]:
            return False
        at = min(end, stop)
    return True
