"""Beginning of a text table (dialect, names, units), and its lines of values in blocks."""

from collections.abc import Callable, Iterator
from typing import NamedTuple, TextIO

from cranktrain.core.column_names import kind_of
from cranktrain.core.errors import InputError, shown
from cranktrain.core.text_dialect import LINES, SEPARATORS, Dialect, no_values, sniff, split, trimmed, without_comment
from cranktrain.core.text_header import header_cells, is_unit_row, names_and_units, words

BLOCK = 1 << 22
"""Number of characters that are parsed at once."""
LONGEST = 1 << 20
"""Largest number of characters of a line."""


class Begun(NamedTuple):
    """A file read up to its values."""

    dialect: Dialect
    names: tuple[str, ...]
    units: tuple[str, ...]
    header: tuple[tuple[str, ...], ...]
    comments: tuple[str, ...]
    line: int
    text: str
    """Text that was already read, from the first line of values (number ``line``) on."""


def begin(file: TextIO, name: str, what: str, remedy: str, single: bool = False) -> Begun:
    """Dialect and header of a file, which is read no further; ``single`` allows a table of one column."""
    raw, kept, comments = _sample(file, name, what, remedy)
    dialect = sniff(kept, name, what, remedy, single=single)
    first = next((k for k, (_, text) in enumerate(kept) if dialect.is_row(split(text, dialect.separator))), None)
    if first is None:
        raise InputError(no_values(kept, name, what, remedy))
    first = _after_numbering(kept, first, dialect)
    _refuse_broken(kept, first, dialect, name)
    line = kept[first][0]
    above = [cells for _, text in kept[:first] if (cells := trimmed(split(text, dialect.separator)))]
    dialect, rows = _with_header(dialect, kept[:first])
    if not rows and dialect.width > 1:
        told = [text for number, text in comments if number < line]
        rows = [own for text in told[-3:] if (own := header_cells(text, dialect.separator, dialect.width))]
        above += [list(own) for own in rows]
    names, units = names_and_units(rows, dialect.width)
    notes = tuple(text for number, text in comments if number <= line)
    return Begun(dialect, names, units, tuple(map(tuple, above)), notes, line, "".join(raw[line - 1 :]))


def begin_named(file: TextIO, name: str, what: str, remedy: str, known: Callable[[str], bool]) -> Begun:
    """Dialect and header of a table whose columns have names, most of which are ``known``.

    Its values begin after the line of names and any rows of units, and may be lists of numbers.
    """
    raw, kept, comments = _sample(file, name, what, remedy)
    best, place, cells = 0, -1, list[str]()
    separator = ""
    for k, (_, text) in enumerate(kept):
        for own in SEPARATORS:
            found = words(text, own)
            count = sum(map(known, found))
            if count > best and count >= min(2, len(found)) and 2 * count >= len(found):
                best, place, cells, separator = count, k, found, own
        if best > 1:
            break
    if place < 0:
        raise InputError(f"{name}: line {kept[0][0]} names no columns of a {what}; {remedy}")
    first = place + 1
    while first < len(kept) and is_unit_row(split(kept[first][1], separator)):
        first += 1
    above = [trimmed(split(text, separator)) for _, text in kept[:first]]
    width, below = len(cells), kept[first:]
    dialect = Dialect(separator, ".", "", width, (False,) * width, True)
    if below:
        dialect = sniff(below, name, what, remedy, dialect)
    units = [(split(text, separator) + [""] * width)[:width] for _, text in kept[place + 1 : first]]
    names, stated = names_and_units([cells, *units], width)
    line = below[0][0] if below else len(raw) + 1
    notes = tuple(text for number, text in comments if number <= line)
    return Begun(dialect, names, stated, tuple(map(tuple, above)), notes, line, "".join(raw[line - 1 :]))


def _sample(
    file: TextIO, name: str, what: str, remedy: str
) -> tuple[list[str], list[tuple[int, str]], list[tuple[int, str]]]:
    """First lines of a file: all lines, lines with text and their numbers, and comments with line numbers."""
    raw, kept, comments = list[str](), list[tuple[int, str]](), list[tuple[int, str]]()
    for number, line in enumerate(iter(lambda: file.readline(LONGEST), ""), start=1):
        if len(line) == LONGEST:
            raise InputError(f"{name}: line {number} has more than {LONGEST} characters; {remedy}")
        raw.append(line)
        text, comment = without_comment(line)
        if comment:
            comments.append((number, comment))
        if text.strip():
            kept.append((number, plain(text)))
        if len(kept) >= LINES:
            break
    if not kept:
        raise InputError(f"{name}: no points or values of a {what}, it is empty; {remedy}")
    return raw, kept, comments


def _after_numbering(kept: list[tuple[int, str]], first: int, dialect: Dialect) -> int:
    """Index of the first row of values; a row of column numbers above a row of names belongs to the header."""
    cells = split(kept[first][1], dialect.separator)
    if [cell for cell in cells if cell] not in ([str(k + start) for k in range(dialect.width)] for start in (0, 1)):
        return first
    at = first + 1
    while at < min(first + 4, len(kept)) and not dialect.is_row(split(kept[at][1], dialect.separator)):
        at += 1
    below = [split(text, dialect.separator) for _, text in kept[first + 1 : at]]
    named = any(is_unit_row(row) or all(kind_of(cell) for cell in trimmed(row)) for row in below)
    return at if named and at < len(kept) else first


def _refuse_broken(kept: list[tuple[int, str]], first: int, dialect: Dialect, name: str) -> None:
    """Refuse a misspelled first row of values, which would otherwise be taken for a row of names.

    Such a row begins with a number, and a cell in another numeric column has digits but is neither number nor unit.
    """
    number, text = kept[first - 1] if first else (0, "")
    cells = trimmed(split(text, dialect.separator))
    if len(cells) != dialect.width or not all(dialect.numeric[:1]) or is_unit_row(cells):
        return
    broken = [
        cell for cell, numeric in zip(cells, dialect.numeric, strict=True) if numeric and not _reads(dialect, cell)
    ]
    if _reads(dialect, cells[0]) and any(character.isdigit() for cell in broken for character in cell):
        wrong = next(cell for cell in broken if any(character.isdigit() for character in cell))
        raise InputError(
            f"{name}: line {number}: {shown(text.strip())} begins with a number, and {shown(wrong)} is none; correct "
            "or remove the line"
        )


def _reads(dialect: Dialect, cell: str) -> bool:
    try:
        dialect.number(cell)
    except ValueError:
        return False
    return True


def _with_header(dialect: Dialect, above: list[tuple[int, str]]) -> tuple[Dialect, list[list[str]]]:
    """Header rows with the table's width; a header with more columns than the first rows of values widens the table."""
    separator, width = dialect.separator, dialect.width
    if separator != " " and above:
        last = [trimmed(split(text, separator)) for _, text in above[-2:]]
        widest = max(map(len, last))
        if widest > width and all(len(cells) in (1, widest) or len(cells) <= widest for cells in last):
            dialect = dialect._replace(width=widest, numeric=(*dialect.numeric, *[True] * (widest - width)))
            width = widest
    rows = []
    for _, text in above:
        if not text.strip("-=_:+*| \t\r\n"):
            continue  # the line is a ruler between header and values
        cells = header_cells(text, separator, width)
        if cells is None and separator != " ":
            own = split(text, separator)
            if len(own) >= width and len(trimmed(own)) > 1 and not any(own[width:]):
                cells = own[:width]
        if cells is not None:
            rows.append(cells)
    return dialect, rows


def plain(text: str) -> str:
    """A line with typographic minus signs and blanks replaced by ASCII characters."""
    if text.isascii():
        return text
    return text.replace("−", "-").replace("\u00a0", " ").replace("\u202f", " ").replace("\u2009", " ").replace("’", "'")


def blocks(file: TextIO, begun: Begun) -> Iterator[tuple[int, str]]:
    """Blocks of whole lines from the first value on, each with the number of its first line."""
    line, text = begun.line, begun.text + file.read(BLOCK)
    if not text.endswith("\n"):
        text += file.readline(LONGEST)
    while text:
        yield line, text
        line += text.count("\n")
        text = file.read(BLOCK)
        if text and not text.endswith("\n"):
            text += file.readline(LONGEST)


def value_lines(block: str, first: int) -> list[tuple[int, str]]:
    """Numbers and texts of the lines of a block that are neither empty nor comments."""
    block = plain(block)
    lines = block.split("\n")
    if "#" in block or "%" in block or "//" in block:
        lines = [without_comment(line)[0] for line in lines]
    return [
        (number, line) for number, line in enumerate(lines, first) if line and not line.isspace() and line != "\x1a"
    ]
