"""Layout of tables of texts: omission of empty columns, and division into tables that fit a line."""

import math
import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

NOTHING = "–"
"""Text of a cell without value."""
LONGEST_WORD = 40
"""Longest column width that a single word, such as a path, may require; longer words may be broken."""

Rows = Sequence[Sequence[str]]


def cell(value: float | None, form: str) -> str:
    """Text of a number in a format; a dash for None and for numbers that are not finite."""
    return NOTHING if value is None or not math.isfinite(value) else format(value, form)


class Page(NamedTuple):
    """One part of a wide table: indices of its columns, their widths, and the wrapped texts."""

    columns: list[int]
    widths: list[int]
    header: list[str]
    rows: list[list[str]]


def told_columns(header: Sequence[str], rows: Rows) -> list[int]:
    """Indices of the columns with a value in at least one row; all columns if the table has no rows."""
    return [k for k in range(len(header)) if not rows or any(row[k].strip() not in ("", NOTHING) for row in rows)]


def pages(header: Sequence[str], rows: Rows, room: int, beside: int, size: Callable[[str], int] = len) -> list[Page]:
    """Divide a table without its empty columns into parts that fit ``room`` characters.

    Each further part repeats the first column to identify its rows. A column takes ``beside`` characters in addition to
    its text; ``size`` is the displayed width of a text. Two columns always form a part, even if they do not fit.
    """
    left, found = told_columns(header, rows), list[Page]()
    first = left[:1]
    while left:
        for count in range(len(left), 0, -1):
            chosen = [*(first if found else []), *left[:count]]
            parts = [[header[k], *(row[k] for row in rows)] for k in chosen]
            widths, fits = _widths(parts, room - beside * len(chosen), size)
            if fits or len(chosen) <= 2 or count == 1:
                texts = [
                    ["\n".join(one for line in text.split("\n") for one in _lines(line, width, size)) for text in part]
                    for part, width in zip(parts, widths, strict=True)
                ]
                head, *body = ([*row] for row in zip(*texts, strict=True))
                found.append(Page(chosen, widths, head, body))
                left = left[count:]
                break
    return found


def _widths(columns: Rows, room: int, size: Callable[[str], int]) -> tuple[list[int], bool]:
    """Widths of columns, and true if they fit; headings are wrapped first, then lists at commas, sentences last.

    Each column begins with its heading. Lines break only between words, so neither a heading nor a number is cut.
    """

    def longest(texts: Sequence[str]) -> int:
        return max((size(line) for text in texts for line in text.split("\n")), default=0)

    heads = [longest(_pieces(column[0])) for column in columns]
    cells = [column[1:] for column in columns]
    lists = [longest([piece for text in part for piece in _pieces(text)]) for part in cells]
    words = [min(longest([word for text in part for word in text.split()]), LONGEST_WORD) for part in cells]
    widths = [max(longest(column[:1]), longest(part), 1) for column, part in zip(columns, cells, strict=True)]
    for floors in (map(longest, cells), lists, words):
        least = [max(head, floor, 1) for head, floor in zip(heads, floors, strict=True)]
        while sum(widths) > room:
            spare = [k for k, width in enumerate(widths) if width > least[k]]
            if not spare:
                break
            widths[max(spare, key=lambda k: widths[k])] -= 1
    return widths, sum(widths) <= room


def _pieces(text: str) -> list[str]:
    """Unbreakable parts of a text: entries of a list, a unit with its slash, words."""
    return [
        piece
        for line in text.split("\n")
        for piece in (re.split(r"(?<=,) ", line) if ", " in line else re.split(r"(?<!/) +", line))
    ]


def _lines(line: str, width: int, size: Callable[[str], int]) -> list[str]:
    """Wrap one line of text into lines."""
    pieces = _pieces(line)
    if size(line) <= width or max(map(size, pieces)) > width:
        return [line]
    lines = [pieces[0]]
    for piece in pieces[1:]:
        if size(lines[-1]) + 1 + size(piece) <= width:
            lines[-1] += f" {piece}"
        else:
            lines.append(piece)
    return lines
