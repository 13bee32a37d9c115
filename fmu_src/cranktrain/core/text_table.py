"""The reader of text tables of numbers: pressures, orders, drive lines, couplings, signals.

Separator, decimal sign and the start of the values (:mod:`cranktrain.core.text_dialect`) and the encoding
(:mod:`cranktrain.core.text_file`) are found automatically. Pandas parses the numbers without loss of digits, in blocks,
so a file of any size is read in bounded memory. An error names the number and the text of the line that does not fit.
"""

import io
import re
import warnings
from collections.abc import Iterator, Sequence
from itertools import chain, islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError, shown
from cranktrain.core.text_begin import begin, blocks, plain, value_lines
from cranktrain.core.text_clock import Clocks
from cranktrain.core.text_dialect import Dialect, split, trimmed, with_later_mark, without_comment
from cranktrain.core.text_file import open_text
from cranktrain.core.text_header import chosen
from cranktrain.core.types import Array
from cranktrain.core.user_file import file_exists, folder_exists, user_path

FEW = 200
"""Largest number of lines before the values of a table, comments not counted."""


_COUNTS = {2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}


_EMPTY_LINE = re.compile(r"^[ \t\r\f\v]*\n", re.MULTILINE)


_ABSENT = ["", "-", "--", "---", "n.a.", "nan", "NaN", "NA", "n/a", "N/A", "NAN", "null"]
"""Spellings of a missing value passed to pandas; lines with other spellings are read one by one."""


class TextHead(NamedTuple):
    """Header of a text table, with the members of :class:`TextTable` and the dialect of its numbers."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    header: tuple[tuple[str, ...], ...]
    first_line: int
    dialect: Dialect


class TextTable(NamedTuple):
    """A text table of numbers, or a block of such a table.

    Attributes
    ----------
    names, units : of each column; empty texts if the file gives none
    values : (rows, columns) float; NaN for missing values and in columns of text
    comments : comments above the values
    first_line : line number of the first row
    lines : (rows,) int, line number of each row
    header : cells of the lines above the values, unchanged
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    comments: tuple[str, ...]
    first_line: int
    lines: NDArray[np.int64]
    header: tuple[tuple[str, ...], ...]


def read_table(path: str | Path, what: str, remedy: str, *, columns: Sequence[str] | None = None) -> TextTable:
    """Read a whole table of numbers.

    Parameters
    ----------
    path : a text file in any encoding
    what, remedy : words for messages: what the file should be, and what to do
    columns : names or numbers (from 1) of the wanted columns, in this order; None for all

    Raises
    ------
    InputError
        one line: no such file, not text, no table, a line that does not fit (with number and text), no such column
    """
    parts = list(table_chunks(path, what, remedy, columns=columns))
    first = parts[0]
    return first._replace(
        values=np.concatenate([part.values for part in parts]), lines=np.concatenate([part.lines for part in parts])
    )


def table_chunks(
    path: str | Path,
    what: str,
    remedy: str,
    *,
    columns: Sequence[str] | None = None,
    rows: int = 200_000,
    clocks: Clocks | None = None,
) -> Iterator[TextTable]:
    """Read a table of numbers in blocks of at most ``rows`` rows, in bounded memory; otherwise as :func:`read_table`.

    With ``clocks`` columns of dates and times of day become seconds, and a table of one column is allowed.
    """
    name = Path(path).name
    with open_text(path, what, remedy) as file:
        begun = begin(file, name, what, remedy, single=clocks is not None)
        dialect = begun.dialect
        picked = list(range(dialect.width))
        if columns is not None:
            picked = [chosen(column, begun.names, begun.units, name) for column in columns]
        names, units = (tuple(texts[k] for k in picked) for texts in (begun.names, begun.units))
        any_rows = False
        whole = dialect.decimal == "." and not re.search(r"\d\.\d", begun.text)
        for first, block in blocks(file, begun):
            if whole:
                dialect = with_later_mark(dialect, value_lines(block, first), name)
                whole = dialect.decimal == "." and not re.search(r"\d\.\d", block)
            values, lines = _without_empty(*parsed_block(block, first, dialect, name, clocks), block, first)
            for start in range(0, len(lines), rows):
                part = values[start : start + rows, picked]
                at = lines[start : start + rows]
                any_rows = True
                yield TextTable(names, units, part, begun.comments, int(at[0]), at, begun.header)
        if not any_rows:
            raise InputError(f"{name}: holds no values; {remedy}")


def table_head(path: str | Path, what: str, remedy: str) -> TextHead:
    """Names, units and dialect of a text table of any size; arguments and errors as for :func:`read_table`."""
    with open_text(path, what, remedy) as file:
        begun = begin(file, Path(path).name, what, remedy)
    return TextHead(begun.names, begun.units, begun.header, begun.line, begun.dialect)


def first_words(path: str | Path, what: str, remedy: str) -> list[str]:
    """Words of the first line of a text file that is neither empty nor a comment, in small letters.

    They show what kind of table the file is before it is read. Arguments as in :func:`read_table`.
    """
    with open_text(path, what, remedy) as file:
        for line in islice(file, FEW):
            if text := without_comment(line)[0].strip():
                return re.findall(r"[^\W\d]+", text.lower())
    return []


def split_columns(path: str | Path) -> tuple[Path, list[str] | None]:
    """File and columns of a path such as ``bench.csv:PCYL1`` or ``bench.csv:1,3``; None for a path without columns."""
    place = user_path(path)
    head, sign, tail = str(place).rpartition(":")
    if not sign or not tail or file_exists(place) or folder_exists(place) or not file_exists(head):
        return place, None
    return Path(head), [column.strip() for column in tail.split(",")]


def line_text(path: str | Path, number: int) -> str:
    """One line of a text file, for messages."""
    with open_text(path, "text file", "") as file:
        return next(islice(file, number - 1, None), "").strip()


def _without_empty(values: Array, lines: NDArray[np.int64], block: str, first: int) -> tuple[Array, NDArray[np.int64]]:
    """Values and line numbers without the lines that contain only separators."""
    nothing = np.isnan(values).all(axis=1)
    if not nothing.any():
        return values, lines
    texts = block.split("\n")
    bare = [not texts[number - first].strip(' \t;,|"\r') for number in lines[nothing].tolist()]
    kept = np.ones(len(lines), dtype=bool)
    kept[np.flatnonzero(nothing)[bare]] = False
    return values[kept], lines[kept]


def parsed_block(
    block: str, first: int, dialect: Dialect, name: str, clocks: Clocks | None
) -> tuple[Array, NDArray[np.int64]]:
    """Values (rows, columns) and line numbers of a block; its first line has number ``first``. ``InputError``."""
    if not any(sign in block for sign in ("#", "%", "//", "\x1a")) and not _EMPTY_LINE.search(block):
        count = block.count("\n") + (not block.endswith("\n"))
        values = _by_pandas(plain(block), dialect, clocks)
        if values is not None and len(values) == count:
            return values, np.arange(first, first + count, dtype=np.int64)
    kept = value_lines(block, first)
    numbers = np.array([number for number, _ in kept], dtype=np.int64)
    if not kept:
        return np.empty((0, dialect.width)), numbers
    text = "\n".join(line for _, line in kept)
    values = _by_pandas(text, dialect, clocks)
    if values is None or len(values) != len(kept):
        values = np.array([_row(number, line, dialect, name, clocks) for number, line in kept])
    return values, numbers


def _by_pandas(text: str, dialect: Dialect, clocks: Clocks | None) -> Array | None:
    """Values of lines of text; None if pandas does not read the lines as the dialect says."""
    import pandas

    separator = dialect.separator
    if separator == "|":
        text = re.sub(r"^\s*\|", "", text, flags=re.MULTILINE)
    if dialect.thousands:
        text = re.sub(rf"(?<=\d){re.escape(dialect.thousands)}(?=\d{{3}})", "", text)
    if ("d" in text or "D" in text) and re.search(r"\d[dD][+-]?\d", text):
        text = re.sub(r"(?<=[\d.,])[dD](?=[+\-]?\d)", "e", text)
    own = len(trimmed(split(text[: text.find("\n") + 1] or text, separator)))
    if own > dialect.width:
        return None
    names = list(range(dialect.width + 1))
    kinds = {k: np.float64 if numeric else object for k, numeric in enumerate((*dialect.numeric, True))}
    # Later versions of pandas read every number exactly and deprecate the option.
    exact: Any = {"float_precision": "round_trip"} if _version(pandas.__version__) < (3, 1) else {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pandas.errors.ParserWarning)
            frame = pandas.read_csv(
                io.StringIO(text), sep=r"\s+" if separator == " " else separator, header=None, names=names, dtype=kinds,
                decimal=dialect.decimal, **exact,
                keep_default_na=False, na_values=_ABSENT,
                skipinitialspace=True, skip_blank_lines=False, engine="c", index_col=None,
            )  # fmt: skip
    except (ValueError, pandas.errors.ParserWarning):  # the caller then finds the first line that does not fit
        return None
    if not isinstance(frame.index, pandas.RangeIndex) or not frame[dialect.width].isna().all():
        return None
    values = np.empty((len(frame), dialect.width))
    for k, numeric in enumerate(dialect.numeric):
        if numeric:
            values[:, k] = frame[k].to_numpy()
        else:
            values[:, k] = np.nan if clocks is None else clocks.seconds(k, frame[k].tolist())
    if np.isinf(values).any():
        return None
    return values


def _version(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", text)[:2])


def _row(number: int, line: str, dialect: Dialect, name: str, clocks: Clocks | None) -> list[float]:
    """Values of one line of text; ``InputError`` if the line does not fit the table."""
    cells = trimmed(split(line, dialect.separator))
    said, several = f"{name}: line {number}: {shown(line.strip())}", _COUNTS.get(dialect.width, str(dialect.width))
    if len(cells) > dialect.width:
        raise InputError(f"{said} has {len(cells)} columns in place of {dialect.width}; correct or remove the line")
    values = []
    for k, (cell, numeric) in enumerate(zip(chain(cells, [""] * dialect.width), dialect.numeric, strict=False), 1):
        try:
            if numeric or clocks is None:
                values.append(dialect.number(cell) if numeric else float("nan"))
            else:
                values.append(float(clocks.seconds(k - 1, [cell])[0]))
        except ValueError:
            raise InputError(
                f"{said} is not {several} numbers, for {shown(cell)} in column {k}; correct or remove the line"
            ) from None
    return values
