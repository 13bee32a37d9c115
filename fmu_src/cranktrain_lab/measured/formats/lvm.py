"""Reader of LabVIEW measurement files (LVM), which are text with a file header and a header for each segment.

A segment's header states for each channel its unit, first abscissa (X0) and step (Delta_X), date and time. Its values
are in columns, with one column of the abscissa before them, one before each, or none (X_Columns One, Multi, No). A last
column of comments is ignored. Segments of the same channels are parts of one recording.
(NI, *Specification for the LabVIEW Measurement File*, 2020.)
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.text_clock import Clocks
from cranktrain.core.text_dialect import Dialect
from cranktrain.core.text_file import open_text
from cranktrain.core.text_table import TextTable, parsed_block
from cranktrain_lab.measured.channels import Channel
from cranktrain_lab.measured.formats.arrays import Named, as_channels
from cranktrain_lab.measured.formats.text import Values, collected

END = "***End_of_Header***"
ROWS, MOST_LINES, LONGEST = 100_000, 200, 1 << 20
"""Lines of values parsed at once, and limits of the lines of a header and of the characters of a line."""


class Segment(NamedTuple):
    """Contents of the header of a LabVIEW file's segment.

    Attributes
    ----------
    names, units : (c,) names and units of the channels
    starts, steps : (c,) starts and steps of the abscissae; steps are NaN if not stated
    began : (c,) date and time of each channel, ns since 1970; None if not stated
    abscissa : kind of abscissa columns: ``One``, ``Multi`` or ``No``
    """

    names: list[str]
    units: list[str]
    starts: list[float]
    steps: list[float]
    began: list[int | None]
    abscissa: str


def channels(path: Path) -> tuple[list[Channel], list[str]]:
    """List the channels of a file, and remarks."""
    with open_text(path, "LabVIEW measurement file", "export it again") as file:
        about, ended = _entries(_lines(file), "\t")
        if not ended:
            raise InputError(f"{path.name}: its header has no end ({END}) within {MOST_LINES} lines; export it again")
        sign = {"tab": "\t", "comma": ",", "semicolon": ";"}.get(about.get("separator", ["tab"])[0].lower(), "\t")
        first = _segment(file, sign, about, path.name)
        values = collected(_parts(file, first, sign, about, path.name))
    arrays = []
    for k, name in enumerate(first.names):
        column = 2 * k + 1 if first.abscissa == "Multi" else k + 1
        there = _last(values, column)
        if not there:
            continue
        own = Named(
            f"{k}/{name}", first.units[k], there, 1, values.column(column), first.steps[k], first.starts[k],
            first.began[k],
        )  # fmt: skip
        arrays.append(own)
        if not math.isfinite(own.step) and first.abscissa != "No":
            base = values.column(column - 1 if first.abscissa == "Multi" else 0)
            arrays.append(Named(f"{k}/time", "s", there, 1, base))
    found, remarks = as_channels(arrays, {}, path.name)
    return [replace(one, name=one.name.partition("/")[2]) for one in found], remarks


def _lines(file: TextIO) -> Iterator[str]:
    """Yield the next lines of a file, cut to ``LONGEST`` characters."""
    return iter(lambda: file.readline(LONGEST), "")


def _entries(lines: Iterator[str], sign: str) -> tuple[dict[str, list[str]], bool]:
    """Return the entries of a header by name in lower case, and True if its end was found."""
    found: dict[str, list[str]] = {}
    for line in islice(lines, MOST_LINES):
        if line.startswith(END):
            return found, True
        text = line.rstrip("\r\n")
        if text.lower().startswith("separator"):
            sign = text[len("separator") :][:1] or sign
        key, *rest = text.split(sign)
        if key.strip():
            found[key.strip().lower()] = [cell.strip() for cell in rest]
    return found, False


def _segment(file: TextIO, sign: str, about: dict[str, list[str]], name: str) -> Segment:
    """Read a segment's header up to the column names, which leaves the file at the first line of values."""
    while (line := file.readline(LONGEST)) and not line.strip():
        pass
    held, _ = _entries(chain((line,), _lines(file)), sign)
    columns = [cell.strip() for cell in file.readline(LONGEST).rstrip("\r\n").split(sign)]
    count = int(_number((held.get("channels") or ["0"])[0], "."))
    if not 0 < count < len(columns) + 1:
        raise InputError(f"{name}: a segment states {count} channels over {len(columns)} columns; export it again")
    abscissa = (about.get("x_columns") or ["One"])[0].title()
    names = [text for text in columns[1:] if text.lower() != "x_value"][:count]
    point = (about.get("decimal_separator") or ["."])[0] or "."

    def texts(key: str) -> list[str]:
        cells = held.get(key, [])
        return [cells[k] if k < len(cells) else "" for k in range(count)]

    steps, starts = ([_number(text, point) for text in texts(key)] for key in ("delta_x", "x0"))
    steps = [step if step > 0.0 else math.nan for step in steps]
    starts = [start if math.isfinite(start) else 0.0 for start in starts]
    file_date, file_time = ((about.get(key) or [""])[0] for key in ("date", "time"))
    began = [
        _instant(day or file_date, time or file_time) for day, time in zip(texts("date"), texts("time"), strict=True)
    ]
    absolute = (about.get("time_pref") or [""])[0].lower() == "absolute"
    return Segment(
        names, texts("y_unit_label"), [0.0 if absolute else start for start in starts], steps, began, abscissa
    )


def _parts(file: TextIO, first: Segment, sign: str, about: dict[str, list[str]], name: str) -> Iterator[TextTable]:
    """Yield parts of the values (rows, abscissae and channels), skipping headers of later segments."""
    point = (about.get("decimal_separator") or ["."])[0] or "."
    count = len(first.names)
    width = 2 * count if first.abscissa == "Multi" else count + 1
    dialect = Dialect(sign, point, "", width, (True,) * width)
    line, lines = 0, list[str]()
    while True:
        text = file.readline(LONGEST)
        line += 1
        ends = not text or text.startswith(END) or text.lower().startswith("channels" + sign)
        if text.strip() and not ends:
            cells = text.rstrip("\r\n").split(sign)[:width]
            lines.append(sign.join(cells + [""] * (width - len(cells))))
        if lines and (ends or len(lines) == ROWS):
            values, at = parsed_block("\n".join(lines) + "\n", line - len(lines), dialect, name, None)
            yield TextTable(("",) * width, ("",) * width, values, (), 1, at, ())
            lines = []
        if not text:
            return
        if ends:
            while text and not text.startswith(END):
                text = file.readline(LONGEST)
            names = [cell.strip() for cell in file.readline(LONGEST).rstrip("\r\n").split(sign)]
            own = [cell for cell in names[1:] if cell.lower() != "x_value"][:count]
            if own != first.names:
                raise InputError(
                    f"{name}: has segments of different channels, {first.names} and {own}; export each alone"
                )


def _last(values: Values, column: int) -> int:
    """Return the number of rows up to the last row that has a value in this column."""
    absent = int(values.missing[column])
    if not absent:
        return values.size
    there = np.flatnonzero(np.isfinite(values.read(0, values.size, column)))
    return int(there[-1]) + 1 if there.size else 0


def _instant(day: str, time: str) -> int | None:
    """Return date and time of a header, ns since 1970; None if either is missing."""
    clocks = Clocks()
    known = bool(day and time) and math.isfinite(float(clocks.seconds(0, [f"{day} {time.replace(',', '.')}"])[0]))
    return clocks.first[0] if known and clocks.dated else None


def _number(text: str, point: str) -> float:
    try:
        return float(text.replace(point, "."))
    except ValueError:
        return math.nan
