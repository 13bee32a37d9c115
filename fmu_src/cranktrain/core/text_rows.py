"""Text tables of numbers and words whose columns are named: drive lines, measured orders, index files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from cranktrain.core.errors import InputError, shown
from cranktrain.core.text_begin import begin_named, blocks, value_lines
from cranktrain.core.text_dialect import Dialect, split, trimmed
from cranktrain.core.text_file import open_text

MOST = 200_000
"""Rows of a table with words: such tables are held whole, and none that a person names the rows of is longer."""


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
    first_line: int


def read_rows(
    path: str | Path,
    what: str,
    remedy: str,
    known: Callable[[str], bool],
    check: Callable[[Sequence[str]], None] = lambda names: None,
) -> TextRows:
    """A table of numbers and words; a cell may hold several numbers with slashes between.

    Parameters
    ----------
    path, what, remedy : as of :func:`cranktrain.core.text_table.read_table`
    known : tells whether a word names a column; the line with such words is that of the names
    check : raises where the names are not those wanted, before the values are read

    Raises
    ------
    InputError
        one line: no such file, no text, no line of names, a line with more values than columns, more than ``MOST`` rows
    """
    name = Path(path).name
    with open_text(path, what, remedy) as file:
        begun = begin_named(file, name, what, remedy, known)
        check(begun.names)
        dialect, rows = begun.dialect, list[tuple[int, list[str]]]()
        for first, block in blocks(file, begun):
            for number, text in value_lines(block, first):
                cells = split(text, dialect.separator)
                kept = trimmed(cells)
                if len(kept) > len(begun.names):
                    raise InputError(
                        f"{name}: line {number}: has more entries than there are columns, {len(kept)} for "
                        f"{len(begun.names)}: {shown(text.strip())}; put names with separators into quotes"
                    )
                if len(rows) == MOST:
                    raise InputError(
                        f"{name}: line {number}: has more than {MOST} rows, too many for a {what}; give those wanted"
                    )
                rows.append((number, kept + [""] * (len(begun.names) - len(kept))))
    return TextRows(begun.names, begun.units, rows, begun.comments, begun.header, dialect, begun.line)
