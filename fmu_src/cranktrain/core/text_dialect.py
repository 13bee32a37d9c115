"""Dialect of a text table, found from its first lines: separator, decimal sign, thousands sign, start of the values.

Each separator (tab, ``;``, ``|``, ``,``, blanks) is tried with each way of writing numbers. The combination with the
most lines of one width whose cells are numbers is taken. A table is refused if two ways read the same cells as
different numbers, such as ``1,600`` for 1600 or 1.6, because a guess may be wrong.
"""

import csv
import re
from collections import Counter
from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from typing import NamedTuple

from cranktrain.core.errors import InputError, shown
from cranktrain.core.text_clock import is_clock

SEPARATORS = ("\t", ";", "|", ",", " ")
NUMBERS = ((".", ""), (",", ""), (".", ","), (",", "."), (".", "'"), (",", "'"), (".", " "), (",", " "))
"""Pairs of decimal sign and thousands separator, the most usual pairs first."""
LINES = 1000
"""Number of lines of values from which a dialect is found."""
MISSING = frozenset(("", "-", "--", "---", "nan", "n.a.", "na", "n/a", "#n/a", "#nv", "null", "none"))
"""Spellings of a missing value, in small letters."""
# A % sign alone is a unit. A # sign before a digit is part of a name, as in cylinder #1.
_COMMENT = re.compile(r"(?:^|(?<=[\s;,|]))(?:#(?!\d)|//|%(?=\s*[^\s;,|%]))")
_LEADING = ("#", "%", "//")
_WIDE = re.compile(r"\d[,;|\t]\d")


class Dialect(NamedTuple):
    """Dialect in which a text table is written.

    Attributes
    ----------
    separator : one character; a blank stands for any number of blanks and tabs
    decimal, thousands : signs within numbers; ``thousands`` may be empty
    width : number of columns of values
    numeric : for each column True if its values are numbers
    lists : True if numbers with slashes between them, 2e4/3e4, are values too
    """

    separator: str
    decimal: str
    thousands: str
    width: int
    numeric: tuple[bool, ...]
    lists: bool = False

    def number(self, text: str) -> float:
        """Number in a cell; NaN if the value is missing, ``ValueError`` if the cell is not a number."""
        if text.lower() in MISSING:
            return float("nan")
        if not _number(self.decimal, self.thousands).fullmatch(text):
            raise ValueError(text)
        if self.thousands:
            text = text.replace(self.thousands, "")
        return float(re.sub("[dD]", "e", text.replace(self.decimal, ".").replace("−", "-")))

    def is_row(self, cells: Sequence[str]) -> bool:
        """True if cells are a row of values: numeric columns have numbers or missing values, at least one a number."""
        pattern, found = _number(self.decimal, self.thousands, self.lists), 0
        if len(cells) < min(2, self.width):
            return False
        for cell, numeric in zip(cells, self.numeric, strict=False):
            if numeric and cell.lower() not in MISSING:
                if not pattern.fullmatch(cell):
                    return False
                found += 1
        return found > 0


def without_comment(line: str) -> tuple[str, str]:
    """A line without its comment (``#``, ``%`` or ``//`` to its end), and the comment; signs in quotes do not count."""
    text = line.strip(" \r\n\x1a\f\v") if "\x1a" in line or "\f" in line else line
    lead = text.lstrip()
    if lead.startswith(_LEADING):
        return "", lead.lstrip("#%/").strip()
    if "#" not in text and "%" not in text and "//" not in text:
        return text, ""
    for match in _COMMENT.finditer(text):
        if text.count('"', 0, match.start()) % 2 == 0:
            return text[: match.start()], text[match.end() :].strip()
    return text, ""


def split(line: str, separator: str) -> list[str]:
    """Cells of a line, without blanks and quotes around them."""
    text = line.strip(" \n\r")
    if separator == "|":
        text = text.strip().removeprefix("|")
    if separator == " ":
        if '"' not in text:
            return text.split()
        text = re.sub(r"\s+", " ", text)
    if '"' not in text:
        return [cell.strip() for cell in text.split(separator)]
    return [cell.strip() for cell in next(csv.reader([text], delimiter=separator, skipinitialspace=True))]


def trimmed(cells: list[str]) -> list[str]:
    """Cells without empty ones at the end."""
    count = len(cells)
    while count and not cells[count - 1]:
        count -= 1
    return cells[:count]


def sniff(
    lines: Sequence[tuple[int, str]],
    name: str,
    what: str,
    remedy: str,
    given: Dialect | None = None,
    single: bool = False,
) -> Dialect:
    """Dialect of lines (number and text), among which are no comments and no empty lines.

    With a ``given`` dialect, whose columns are named, only the way of writing numbers is determined. ``single`` allows
    a table of one column.

    Raises
    ------
    InputError
        one line: nothing but text, or numbers that can be read in two ways
    """
    best, score = given, 0.0
    for separator in SEPARATORS if given is None else (given.separator,):
        if not any(separator in text or (separator == " " and "\t" in text) for _, text in lines):
            continue
        rows = [trimmed(split(text, separator)) for _, text in lines]
        for decimal, thousands in NUMBERS:
            if separator in (decimal, thousands) and not (separator == decimal and any('"' in t for _, t in lines)):
                continue
            start = Dialect(separator, decimal, thousands, 0, ()) if given is None else given
            own, dialect = _score(rows, start._replace(decimal=decimal, thousands=thousands))
            if own > score * (1.0 + 1e-9):
                best, score = dialect, own
    if single and given is None:
        best = _single(lines, best, score)
    if best is None:
        raise InputError(no_values(lines, name, what, remedy))
    _refuse_two_meanings(best, lines, name)
    return best


def _single(lines: Sequence[tuple[int, str]], other: Dialect | None, score: float) -> Dialect | None:
    """Dialect of one column of numbers, if it reads more lines than the ``other`` dialect with its ``score``.

    Lines such as ``1,25`` are one column if these numbers rise and the line above has no comma.
    """
    rows = [[text.strip()] for _, text in lines]
    best, most = max((_score(rows, Dialect("\t", sign, "", 1, ()), least=1)[::-1] for sign in ".,"), key=lambda f: f[1])
    if most < score or not most:
        return other
    if other is None or most > score or best.decimal == ".":
        return best
    numbers = [best.number(row[0]) for row in rows if best.is_row(row)]
    rising = len(numbers) > 2 and all(a < b for a, b in pairwise(numbers))
    return best if rising and ("," not in rows[0][0] or best.is_row(rows[0])) else other


def with_later_mark(dialect: Dialect, lines: Sequence[tuple[int, str]], name: str) -> Dialect:
    """Dialect changed to a decimal comma if commas appear after whole numbers; unchanged if points appear there too."""
    if dialect.decimal == "," or dialect.thousands or dialect.separator == ",":
        return dialect
    commas = [(number, text) for number, text in lines if re.search(r"\d,\d", text)]
    if not commas or any(re.search(r"\d\.\d", text) for _, text in lines):
        return dialect
    later = dialect._replace(decimal=",")
    _refuse_two_meanings(later, commas[:LINES], name)
    return later


def no_values(lines: Sequence[tuple[int, str]], name: str, what: str, remedy: str) -> str:
    """Message for a file without a line of values."""
    return f"{name}: no points or values of a {what} from line {lines[0][0]} on; {remedy}"


def _score(rows: list[list[str]], dialect: Dialect, least: int = 2) -> tuple[float, Dialect]:
    """Number of lines of one width that a dialect reads, each weighted by its fraction of numbers; and the dialect."""
    pattern = _number(dialect.decimal, dialect.thousands, dialect.lists)
    found = [tuple(bool(pattern.fullmatch(cell)) for cell in row) for row in rows]
    widths = Counter(len(row) for row, own in zip(rows, found, strict=True) if len(row) >= least and any(own))
    if not widths:
        return 0.0, dialect
    width = dialect.width or max(widths, key=lambda count: (widths[count], count))
    total = 0.0
    numbers, filled = [0] * width, [0] * width
    for row, own in zip(rows, found, strict=True):
        if not least <= len(row) <= width or not any(own):
            continue
        used = [k for k, cell in enumerate(row) if cell.lower() not in MISSING]
        if any(not own[k] and _WIDE.search(row[k]) and not is_clock(row[k]) for k in used):
            continue
        total += sum(own[k] for k in used) / len(used) * (1.0 if len(row) == width else 0.5)
        for k in used:
            filled[k] += 1
            numbers[k] += own[k]
    numeric = tuple(2 * n >= f for n, f in zip(numbers, filled, strict=True))
    return total, dialect._replace(width=width, numeric=numeric)


def _refuse_two_meanings(dialect: Dialect, lines: Sequence[tuple[int, str]], name: str) -> None:
    """Refuse commas that may be decimal or thousands signs if no cell decides which."""
    if dialect.decimal != "," and dialect.thousands != ",":
        return
    doubtful: tuple[int, str, str] | None = None
    both = {"point": False, "other": False}
    groups = re.compile(r"[+\-−]?[1-9]\d{0,2}(?:,\d{3})+")
    for number, text in lines:
        cells = trimmed(split(text, dialect.separator))
        if not dialect.is_row(cells):
            continue
        for cell, numeric in zip(cells, dialect.numeric, strict=False):
            if not numeric:
                continue
            both["point"] |= "." in cell
            if "," in cell:
                if not groups.fullmatch(cell) or cell.count(",") > 1:
                    both["other"] = True
                doubtful = doubtful or (number, cell, text)
            elif "." in cell and not re.fullmatch(r"[+\-−]?[1-9]\d{0,2}(?:\.\d{3})+", cell):
                both["other"] = True
    if doubtful is not None and not both["other"]:
        number, cell, _ = doubtful
        plain = cell.replace(",", "")
        raise InputError(
            f"{name}: line {number}: {shown(cell)} may be {plain} or {cell.replace(',', '.')}; write numbers without "
            "thousands separators"
        )


@cache
def _number(decimal: str, thousands: str, lists: bool = False) -> re.Pattern[str]:
    """Pattern of a number, or of several numbers with slashes between them."""
    whole = r"\d+"
    if thousands:
        whole = rf"(?:\d{{1,3}}(?:{re.escape(thousands)}\d{{3}})+|\d+)"
    point = re.escape(decimal)
    number = rf"[+\-−]?(?:{whole}(?:{point}\d*)?|{point}\d+)(?:[eEdD][+\-]?\d+)?"
    return re.compile(rf"{number}(?:\s*/\s*{number})*" if lists else number)
