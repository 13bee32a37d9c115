"""The one reader of text tables: pressures, orders, drive lines, couplings, signals.

Separators, decimal signs and the beginning of the values are found (:mod:`cranktrain.core.text_dialect`), encodings too
(:mod:`cranktrain.core.text_file`). Numbers are parsed by pandas to the last digit, in blocks, so a file of any size is
read in bounded memory. A line that does not fit is named with its number and text.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError, shown
from cranktrain.core.text_dialect import LINES, Dialect, no_values, sniff, split, trimmed, without_comment
from cranktrain.core.text_file import open_text
from cranktrain.core.text_header import chosen, header_cells, names_and_units

Array = NDArray[np.float64]
BLOCK = 1 << 22
"""Characters that are parsed at once."""
LONGEST = 1 << 20
"""Characters of the longest line."""
FEW = 200
"""Lines before the values of a table at most, comments not counted."""


class TextTable(NamedTuple):
    """A table of numbers, or a part of one.

    Attributes
    ----------
    names, units : of each column; empty texts where the file does not say
    values : (rows, columns) float; NaN where a value is missing, and in columns of text
    comments : texts of comments above the values
    first_line : number of the line of the first row
    lines : (rows,) int, number of each row's line
    header : cells of the lines above the values, as they stand
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    comments: tuple[str, ...]
    first_line: int
    lines: NDArray[np.int64]
    header: tuple[tuple[str, ...], ...]


class TextRows(NamedTuple):
    """A table whose cells are numbers and words.

    Attributes
    ----------
    names, units, comments, header : as of :class:`TextTable`
    rows : number of the line and cells, one text a column
    dialect : reads numbers of cells
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    rows: list[tuple[int, list[str]]]
    comments: tuple[str, ...]
    header: tuple[tuple[str, ...], ...]
    dialect: Dialect


class _Begun(NamedTuple):
    """A file up to its values."""

    dialect: Dialect
    names: tuple[str, ...]
    units: tuple[str, ...]
    header: tuple[tuple[str, ...], ...]
    comments: tuple[str, ...]
    line: int
    text: str
    """Lines from the first of the values on that were read already; their first one has number ``line``."""


def read_table(path: str | Path, what: str, remedy: str, *, columns: Sequence[str] | None = None) -> TextTable:
    """A table of numbers, whole.

    Parameters
    ----------
    path : a text file in any encoding
    what, remedy : words of messages: what the file is to be, and what to do
    columns : names or numbers (from 1) of the columns wanted, in this order; None for all

    Raises
    ------
    InputError
        one line: no such file, no text, no table, a line that does not fit with its number and text, no such column
    """
    parts = list(table_chunks(path, what, remedy, columns=columns))
    first = parts[0]
    return first._replace(
        values=np.concatenate([part.values for part in parts]), lines=np.concatenate([part.lines for part in parts])
    )


def table_chunks(
    path: str | Path, what: str, remedy: str, *, columns: Sequence[str] | None = None, rows: int = 200_000
) -> Iterator[TextTable]:
    """Parts of a table of numbers, ``rows`` at most in each, in bounded memory; otherwise as :func:`read_table`."""
    name = Path(path).name
    with open_text(path, what, remedy) as file:
        begun = _begin(file, name, what, remedy)
        dialect = begun.dialect
        picked = list(range(dialect.width))
        if columns is not None:
            picked = [chosen(column, begun.names, begun.units, name) for column in columns]
        names, units = (tuple(texts[k] for k in picked) for texts in (begun.names, begun.units))
        any_rows = False
        for first, block in _blocks(file, begun):
            values, lines = _parsed(block, first, dialect, name)
            for start in range(0, len(lines), rows):
                part = values[start : start + rows, picked]
                at = lines[start : start + rows]
                any_rows = True
                yield TextTable(names, units, part, begun.comments, int(at[0]), at, begun.header)
        if not any_rows:
            raise InputError(f"{name}: holds no values; {remedy}")


def read_rows(path: str | Path, what: str, remedy: str) -> TextRows:
    """A table of numbers and words whose first rows name the columns; arguments and errors as of :func:`read_table`."""
    name = Path(path).name
    with open_text(path, what, remedy) as file:
        begun = _begin(file, name, what, remedy)
        dialect, rows = begun.dialect, list[tuple[int, list[str]]]()
        for first, block in _blocks(file, begun):
            for number, text in _lines(block, first):
                cells = split(text, dialect.separator)
                kept = trimmed(cells)
                if len(kept) > len(begun.names):
                    raise InputError(
                        f"{name}: line {number}: {shown(text.strip())} has {len(kept)} values for "
                        f"{len(begun.names)} columns; give one for each"
                    )
                rows.append((number, (kept + [""] * len(begun.names))[: len(begun.names)]))
    return TextRows(begun.names, begun.units, rows, begun.comments, begun.header, dialect)


def _begin(file: TextIO, name: str, what: str, remedy: str) -> _Begun:
    """Dialect and header of a file, which is read as far as these need."""
    raw, kept, comments = list[str](), list[tuple[int, str]](), list[tuple[int, str]]()
    for number, line in enumerate(iter(lambda: file.readline(LONGEST), ""), start=1):
        if len(line) == LONGEST:
            raise InputError(f"{name}: line {number} has more than {LONGEST} characters, {shown(line[:40])}; {remedy}")
        raw.append(line)
        text, comment = without_comment(line)
        if comment:
            comments.append((number, comment))
        if text.strip():
            kept.append((number, _plain(text)))
        if len(kept) >= LINES:
            break
    if not kept:
        raise InputError(f"{name}: is empty, no {what}; {remedy}")
    dialect = sniff(kept, name, what, remedy)
    first = next((k for k, (_, text) in enumerate(kept) if dialect.is_row(split(text, dialect.separator))), None)
    if first is None:
        raise InputError(no_values(kept, name, what, remedy))
    line = kept[first][0]
    above = [cells for _, text in kept[:first] if (cells := trimmed(split(text, dialect.separator)))]
    dialect, rows = _with_header(dialect, kept[:first])
    if not rows:
        told = [text for number, text in comments if number < line]
        rows = [cells for text in told[-1:] if (cells := header_cells(text, dialect.separator, dialect.width))]
        above += [list(cells) for cells in rows]
    names, units = names_and_units(rows, dialect.width)
    notes = tuple(text for number, text in comments if number <= line)
    return _Begun(dialect, names, units, tuple(map(tuple, above)), notes, line, "".join(raw[line - 1 :]))


def _with_header(dialect: Dialect, above: list[tuple[int, str]]) -> tuple[Dialect, list[list[str]]]:
    """Header rows of the table's width; a header of more columns than the values' first ones have widens it."""
    separator, width = dialect.separator, dialect.width
    if separator != " " and above:
        last = [trimmed(split(text, separator)) for _, text in above[-2:]]
        widest = max(map(len, last))
        if widest > width and all(len(cells) in (1, widest) or len(cells) <= widest for cells in last):
            dialect = dialect._replace(width=widest, numeric=(*dialect.numeric, *[True] * (widest - width)))
            width = widest
    rows = []
    for _, text in above:
        cells = header_cells(text, separator, width)
        if cells is None and separator != " ":
            own = trimmed(split(text, separator))
            if 1 < len(own) < width and 2 * len(own) >= width:
                cells = own + [""] * (width - len(own))
        if cells is not None:
            rows.append(cells)
    return dialect, rows


def _plain(text: str) -> str:
    """A line with the minus sign and the blanks of typesetting as those of ASCII."""
    if text.isascii():
        return text
    return text.replace("−", "-").replace("\u00a0", " ").replace("\u202f", " ").replace("\u2009", " ").replace("’", "'")


def _blocks(file: TextIO, begun: _Begun) -> Iterator[tuple[int, str]]:
    """Number of the first line, and text, of pieces of whole lines from the first value on."""
    line, text = begun.line, begun.text
    while text:
        yield line, text
        line += text.count("\n")
        text = file.read(BLOCK)
        if text and not text.endswith("\n"):
            text += file.readline(LONGEST)


def _lines(block: str, first: int) -> list[tuple[int, str]]:
    """Numbers and texts of the lines of a block that are neither empty nor comments."""
    block = _plain(block)
    lines = block.split("\n")
    if "#" in block or "%" in block or "//" in block:
        lines = [without_comment(line)[0] for line in lines]
    return [
        (number, line) for number, line in enumerate(lines, first) if line and not line.isspace() and line != "\x1a"
    ]


def _parsed(block: str, first: int, dialect: Dialect, name: str) -> tuple[Array, NDArray[np.int64]]:
    """Values (rows, columns) and numbers of lines of a block."""
    kept = _lines(block, first)
    numbers = np.array([number for number, _ in kept], dtype=np.int64)
    if not kept:
        return np.empty((0, dialect.width)), numbers
    text = "\n".join(line for _, line in kept)
    values = None if dialect.thousands in ("'", " ") else _by_pandas(text, dialect)
    if values is None or len(values) != len(kept):
        values = np.array([_row(number, line, dialect, name) for number, line in kept])
    return values, numbers


def _by_pandas(text: str, dialect: Dialect) -> Array | None:
    """Values of lines; None where pandas does not read them as they were sniffed."""
    import pandas

    separator = dialect.separator
    if separator == "|":
        text = re.sub(r"^\s*\|", "", text, flags=re.MULTILINE)
    if re.search(r"\d[dD][+-]?\d", text):
        text = re.sub(r"(?<=[\d.,])[dD](?=[+\-]?\d)", "e", text)
    own = len(trimmed(split(text[: text.find("\n") + 1] or text, separator)))
    if own > dialect.width:
        return None
    names = list(range(dialect.width + 1))
    kinds = {k: np.float64 if numeric else object for k, numeric in enumerate((*dialect.numeric, True))}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            frame = pandas.read_csv(
                io.StringIO(text), sep=r"\s+" if separator == " " else separator, header=None, names=names, dtype=kinds,
                decimal=dialect.decimal, thousands=dialect.thousands or None, float_precision="round_trip",
                keep_default_na=False, na_values=["", "-", "--", "nan", "NaN", "NA", "n/a", "N/A", "NAN", "null"],
                skipinitialspace=True, skip_blank_lines=False, engine="c", index_col=None,
            )  # fmt: skip
    except (ValueError, Warning):  # of pandas' parser: the first line that does not fit is looked for one by one
        return None
    if not isinstance(frame.index, pandas.RangeIndex) or not frame[dialect.width].isna().all():
        return None
    values = np.empty((len(frame), dialect.width))
    for k, numeric in enumerate(dialect.numeric):
        values[:, k] = frame[k].to_numpy() if numeric else np.nan
    if np.isinf(values).any():
        return None
    return values


def _row(number: int, line: str, dialect: Dialect, name: str) -> list[float]:
    """Values of one line; ``InputError`` where it does not fit."""
    cells = trimmed(split(line, dialect.separator))
    said = f"{name}: line {number}: {shown(line.strip())}"
    if len(cells) > dialect.width:
        raise InputError(f"{said} has {len(cells)} columns in place of {dialect.width}; correct or remove the line")
    values = []
    for k, (cell, numeric) in enumerate(zip(chain(cells, [""] * dialect.width), dialect.numeric, strict=False), 1):
        try:
            values.append(dialect.number(cell) if numeric else float("nan"))
        except ValueError:
            raise InputError(
                f"{said} has {shown(cell)} in column {k}, which is not a number; correct or remove the line"
            ) from None
    return values
