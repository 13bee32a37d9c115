"""Points of a measured pressure in a text file: columns of angle and pressure, checked line by line.

Files of any size are read in parts. Up to ``KEPT`` lines stay in memory; a longer file is read again when its
points are folded into a cycle.
"""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.column_names import kind_of
from cranktrain.core.errors import InputError, shown
from cranktrain.core.text_header import chosen
from cranktrain.core.text_table import TextHead, TextTable, line_text, table_chunks, table_head
from cranktrain.core.units import known_factor

Array = NDArray[np.float64]
WHAT, REMEDY = "pressure file", "give a text file of angle in degrees and pressure"
LARGEST = 1e12
"""Largest number that can be an angle or a pressure in any unit."""
FEWEST = 20
KEPT = 1_000_000
"""Number of lines of a file that stay in memory."""
_INDEX = re.compile(r"(?<=\w)\[\s*(\d+)\s*\]")
_BRACKETS = re.compile(r"\[[^\]]*\]|\([^)]*\)")


class Points:
    """Points of traces: angles (n,) deg and pressures (n, k) as given, part by part.

    Attributes
    ----------
    noun, column : in messages, what a point is called, and after a comma the name of the first column of pressures
    peaks, peak_angles : (k,) largest pressure of each column, and its angle (deg)
    low : least pressure
    negative : number and pressure of the first point with a pressure below zero; None without such a point
    count : number of points
    """

    noun, column = "value", ""

    def __init__(self, read: Callable[[], Iterable[tuple[NDArray[Any], Array, Array]]]) -> None:
        """Points from ``read()``, which gives numbers, angles and pressures of all points, part by part."""
        self._read = read
        self.peaks, self.peak_angles = np.array(-np.inf), np.array(0.0)
        self.low, self.count = math.inf, 0
        self.negative: tuple[int, float] | None = None
        for numbers, angle, pressures in read():
            at = pressures.argmax(axis=0)
            largest, least = pressures[at, np.arange(at.size)], pressures.min(axis=1)
            self.peak_angles = np.where(largest > self.peaks, angle[at], self.peak_angles)
            self.peaks = np.maximum(self.peaks, largest)
            self.low = min(self.low, float(least.min()))
            self.count += angle.size
            if self.negative is None and least.min() < 0.0:
                first = int(np.argmax(least < 0.0))
                self.negative = int(numbers[first]), float(least[first])

    def parts(self) -> Iterator[tuple[Array, Array]]:
        """Yield angles and pressures, part by part."""
        for _, angle, pressures in self._read():
            yield angle, pressures


class PressurePoints(Points):
    """Checked points of a file.

    Attributes
    ----------
    head : names, units and dialect of the columns
    columns : numbers (from 0) of the column of angle and of those of pressure, by cylinder
    names, units : of the columns of pressure; empty texts if the file states none
    """

    noun = "line"

    def __init__(self, path: Path, head: TextHead, columns: tuple[int, ...]) -> None:
        self.head, self.columns = head, columns
        self.names, self.units = ([own[k] for k in columns[1:]] for own in (head.names, head.units))
        self.column = f", column {self.names[0]}" if self.names[0] else ""
        kept = list[TextTable]()

        def read() -> Iterator[tuple[NDArray[Any], Array, Array]]:
            whole = bool(kept)
            for part in kept or table_chunks(path, WHAT, REMEDY, columns=[f"#{k + 1}" for k in columns]):
                within = np.abs(part.values) <= LARGEST
                if not within.all():
                    number = int(part.lines[np.flatnonzero(~within.all(axis=1))[0]])
                    raise InputError(
                        f"{path.name}: line {number}: {shown(line_text(path, number))} holds a value that is not "
                        "finite; remove the line"
                    )
                if not whole:
                    kept.append(part)
                yield part.lines, part.values[:, 0], part.values[:, 1:]
                if self.count > KEPT:
                    kept.clear()

        super().__init__(read)


def read_points(path: Path, columns: Sequence[str] | None, cylinders: int) -> PressurePoints:
    """Read the points of a file; ``columns`` are names or numbers of the columns, optionally without the angle column.

    Raises ``InputError`` with one line that names file, line and text, or the existing columns.
    """
    head = table_head(path, WHAT, REMEDY)
    for cell in (cell for cells in head.header for cell in cells):
        if "rad" in re.findall(r"[a-z]+", cell.lower()):
            raise InputError(f"{path.name}: the header says rad; angles are wanted in degrees")
    return PressurePoints(path, head, _columns(path.name, head, columns, cylinders))


def _columns(name: str, head: TextHead, wanted: Sequence[str] | None, cylinders: int) -> tuple[int, ...]:
    """Return the column of angle and the columns of pressure in the order of cylinders."""
    usable = [k for k, numeric in enumerate(head.dialect.numeric) if numeric]
    kinds = {k: _kind(head, k) for k in usable}
    angles = [k for k in usable if kinds[k] == "angle"] or [k for k in usable if kinds[k] == "angle by unit"]
    angle = angles[0] if angles else usable[0]
    if wanted is not None:
        picked = [chosen(column, head.names, head.units, name) for column in wanted]
        named = [k for k in picked if kinds.get(k, "").startswith("angle")]
        angle = named[0] if named else angle
        pressures = [k for k in picked if k != angle]
    else:
        pressures = [k for k in usable if kinds[k] == "pressure"] or [k for k in usable if kinds[k] == "by unit"]
        if not (angles and len(pressures) in (1, cylinders)) and len(usable) in (2, 1 + cylinders):
            pressures = [k for k in usable if k != angle]
    if len(usable) < 2 or len(pressures) not in (1, cylinders):
        each = f", or a pressure for each of the {cylinders} cylinders" if cylinders > 1 else ""
        own = [head.names[k] or f"#{k + 1}" for k in usable]
        example = own[-1] if len(own) > 1 else "#2"
        raise InputError(
            f"{name}: line {head.first_line}: {head.dialect.width} columns; give two, angle in degrees and pressure"
            f"{each}, or name that of the pressure behind the file, {name}:{example}; numbers are in {', '.join(own)}"
        )
    return angle, *(pressures[k] for k in _by_cylinder([head.names[k] for k in pressures]))


def _kind(head: TextHead, column: int) -> str:
    """Return the kind of a column by its name, otherwise by its unit; empty if unknown."""
    name, unit = head.names[column], head.units[column]
    kind = kind_of(name, ("angle", "pressure", "volume", "speed"))
    if not kind and unit:
        if known_factor(unit, "angle"):
            return "angle by unit"
        return "by unit" if known_factor(unit, "absolute pressure") else ""
    return kind


def _by_cylinder(names: Sequence[str]) -> list[int]:
    """Return the order of the columns of pressure: by numbers 1, 2, … in their names, otherwise as in the file."""
    plain = [_BRACKETS.sub(" ", _INDEX.sub(r"\1", name)) for name in names]
    found = [re.findall(r"\d+", name) for name in plain]
    numbers = [int(one[0]) for one in found if len(one) == 1 and len(one[0]) < 4]
    if sorted(numbers) == list(range(1, len(names) + 1)):
        return [numbers.index(k) for k in range(1, len(names) + 1)]
    return list(range(len(names)))
