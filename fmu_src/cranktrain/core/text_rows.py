"""Text tables of numbers and words whose columns are named: drive lines, measured orders, index files."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from cranktrain.core.errors import InputError, shown
from cranktrain.core.text_begin import begin_named, blocks, value_lines
from cranktrain.core.text_dialect import Dialect, split, trimmed
from cranktrain.core.text_file import open_text

MOST = 200_000
"""Largest number of rows of a table with words. Such tables are held in memory, and hand-written ones are shorter."""


class TextRows(NamedTuple):
    """A table whose cells are numbers and words.

    Attributes
    ----------
    names, units, comments, header : see :class:`TextTable`
    rows : line number and cells of each row, one text per column
    dialect : reads the numbers in the cells
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
    """Read a table of numbers and words; a cell may hold several numbers with slashes between them.

    Parameters
    ----------
    path, what, remedy : see :func:`cranktrain.core.text_table.read_table`
    known : True if a word is a column name; the line with such words is the line of names
    check : called with the names before the values are read; raises if they are not the wanted ones

    Raises
    ------
    InputError
        one line: no such file, not text, no line of names, a line with too many values, more than ``MOST`` rows
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
