"""Sixty dialects in which people write one table, drawn from a seed: separators, decimal signs, encodings, headers.

    for dialect in dialects():
        path.write_bytes(dialect.written(columns, rows))

Numbers are written with all their digits, so what is read must be equal to the last one.
"""

import random
from dataclasses import dataclass
from itertools import pairwise

COUNT, SEED = 60, 38
ENCODINGS = ("utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-le", "utf-16-be", "utf-16-be with mark", "utf-32")
SEPARATORS = (";", "\t", ",", "|", " ", "  ", " ; ", ", ", "\t ")
METADATA = (
    "Test bench 3", "Engine: X4, cold", "Date: 2024-03-02 10:15", "Speed: 3000 1/min", "Cycles: 200",
    "Prüfstand Süd; Bediener Müller", "Motor 4", "Version 2.1", "Comment: none",
)  # fmt: skip
COMMENTS = ("#", "%", "//")


@dataclass(frozen=True)
class Column:
    """A column: its names in English and German, its unit, and the unit's other spellings; a unit may be empty."""

    names: tuple[str, ...]
    units: tuple[str, ...] = ("",)


@dataclass(frozen=True)
class TableDialect:
    """One way of writing a table."""

    number: int
    separator: str
    decimal: str
    thousands: str
    quotes: str
    trailing: bool
    encoding: str
    newline: str
    metadata: int
    heading: str
    comment: str
    line_comments: bool
    blank_lines: bool
    exponents: str
    extra: bool
    german: bool

    def written(self, columns, rows, *, heading=True):
        """Bytes of a table; ``rows`` hold floats, texts and None (empty), columns are :class:`Column`."""
        rng = random.Random(1000 + self.number)
        columns, rows = list(columns), [list(row) for row in rows]
        if self.extra:
            at = rng.randrange(1, len(columns) + 1)
            columns.insert(at, Column(("Status", "Status")))
            for row in rows:
                row.insert(at, "ok")
        lines = []
        if self.comment and rng.random() < 0.7:
            lines.append(f"{self.comment} written by bench 7")
        lines += rng.sample(METADATA, self.metadata)
        if heading:
            lines += self._header(columns, rng)
        for k, row in enumerate(rows):
            if self.blank_lines and k % 7 == 3:
                lines.append(rng.choice(("", "   ")))
            if self.comment and k % 11 == 5:
                lines.append(f"{self.comment} gap")
            line = self._line([self._cell(value) for value in row])
            if self.line_comments and k % 5 == 2:
                line += f" {self.comment} note {k}"
            lines.append(line)
        text = self.newline.join(lines) + self.newline
        if self.encoding == "utf-16-be with mark":
            return b"\xfe\xff" + text.encode("utf-16-be")
        return text.encode(self.encoding)

    def _header(self, columns, rng):
        names = [column.names[-1 if self.german else 0] for column in columns]
        units = [rng.choice(column.units) for column in columns]
        if self.encoding == "cp1252":
            units = [unit if _fits(unit, "cp1252") else columns[k].units[0] for k, unit in enumerate(units)]
        if self.separator.isspace() and "\t" not in self.separator:
            names = [name.replace(" ", "_") for name in names]
            units = [unit.replace(" ", "*") for unit in units]
        if self.heading == "brackets":
            cells = [f"{name} [{unit}]" if unit else name for name, unit in zip(names, units, strict=True)]
            return [self._line([self._text(cell) for cell in cells])]
        if self.heading == "round brackets":
            cells = [f"{name} ({unit})" if unit else name for name, unit in zip(names, units, strict=True)]
            return [self._line([self._text(cell) for cell in cells])]
        rows = [self._line([self._text(name) for name in names])]
        return [*rows, self._line([self._text(unit or "-") for unit in units])] if any(units) else rows

    def _cell(self, value):
        if value is None:
            return "-" if self.separator.strip() == "" and "\t" not in self.separator else ""
        if isinstance(value, str):
            return self._text(value)
        text = repr(float(value))
        if self.exponents and "e" not in text and value != 0.0:
            text = f"{value:.17e}" if self.exponents == "e" else f"{value:.17e}".replace("e", self.exponents)
        mantissa, sign, power = _parts(text)
        whole, _, rest = mantissa.partition(".")
        if self.thousands and not sign:
            digits = whole.lstrip("-")
            groups = [digits[max(0, k - 3) : k] for k in range(len(digits), 0, -3)][::-1]
            whole = ("-" if whole.startswith("-") else "") + self.thousands.join(groups)
        text = whole + (self.decimal + rest if rest else "") + sign + power
        return f'"{text}"' if self.quotes == "all" else text

    def _text(self, text):
        return f'"{text}"' if self.quotes in ("all", "texts") else text

    def _line(self, cells):
        return self.separator.join(cells) + (self.separator.rstrip() or self.separator if self.trailing else "")


def _parts(text):
    for sign in "eEdD":
        if sign in text:
            mantissa, _, power = text.partition(sign)
            return mantissa, sign, power
    return text, "", ""


def _fits(text, encoding):
    try:
        text.encode(encoding)
    except UnicodeEncodeError:
        return False
    return True


def dialects(count=COUNT, seed=SEED):
    """Dialects that state a table without doubt: none writes one digit string for two numbers."""
    rng, found = random.Random(seed), []
    while len(found) < count:
        separator = rng.choice(SEPARATORS)
        bare = separator.strip() or separator[0]
        decimal = rng.choice(".,") if bare != "," else rng.choice("..,")
        quotes = rng.choice(("", "", "", "texts", "all")) if not (bare == "," and decimal == ",") else "all"
        comment = rng.choice(("", *COMMENTS))
        thousands = rng.choice(("", "", "", "", {".": ",", ",": "."}[decimal], "'", " "))
        if thousands and (thousands == bare or bare.isspace() or (bare == "," and quotes != "all")):
            thousands = ""
        dialect = TableDialect(
            number=len(found), separator=separator, decimal=decimal, thousands=thousands, quotes=quotes,
            trailing=rng.random() < 0.25 and not separator.isspace(), encoding=rng.choice(ENCODINGS),
            newline=rng.choice(("\n", "\n", "\r\n", "\r\n", "\r")), metadata=rng.choice((0, 0, 0, 1, 3, 7)),
            heading=rng.choice(("brackets", "brackets", "round brackets", "row of units")), comment=comment,
            line_comments=bool(comment) and rng.random() < 0.5, blank_lines=rng.random() < 0.3,
            exponents=rng.choice(("", "", "", "e", "E", "D")), extra=rng.random() < 0.3, german=rng.random() < 0.5,
        )  # fmt: skip
        found.append(dialect)
    assert all(one != other for one, other in pairwise(found))
    return found
