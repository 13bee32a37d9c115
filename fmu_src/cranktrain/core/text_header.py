"""Names and units of a text table's columns, from the rows above its values."""

import re
from collections.abc import Sequence
from string import ascii_lowercase

from cranktrain.core.argument_checks import whole_number
from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.text_dialect import MISSING, split, trimmed

_BRACKET = re.compile(r"^(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\)|\{([^}]*)\})\s*$")
_SLASH = re.compile(r"^(.*\S)\s+(?:/|in)\s+(\S+)$")


_BOTH = frozenset(("ca", "kw", "cad", "cp", "at", "phi", *ascii_lowercase))
"""Plain names of quantities that are also units; any single letter may be a channel name."""


def header_cells(line: str, separator: str, width: int) -> list[str] | None:
    """Cells of a line above the values if there is one for each of ``width`` columns (at least 2), else None.

    With blanks as separator a bracket belongs to the word before it, and two or more blanks may be the separator.
    """
    options = [trimmed(split(line, separator))]
    if separator == " ":
        options.append(words(line, separator))
        options.append([cell.strip() for cell in re.split(r"\t+|\s{2,}", line.strip())])
    for other in (
        one for one in (";", "\t", ",", "|") if (one != separator and len(options[0]) == 1) or separator == " "
    ):
        options.append([cell for cell in trimmed(split(line, other)) if cell])
    return next((cells for cells in options if len(cells) == width), None)


def words(line: str, separator: str) -> list[str]:
    """Cells of a line of names; with blanks as separator a bracket belongs to the word before it."""
    if separator != " " or '"' in line:
        return trimmed(split(line, separator))
    joined = re.sub(r"\s+(?=[\[(])", "\u00a0", line.strip())
    joined = re.sub(r"[\[(][^\])]*[\])]", lambda found: found[0].replace(" ", "\u00a0"), joined)
    return [cell.replace("\u00a0", " ") for cell in re.split(r"[ \t]+", joined)]


def names_and_units(rows: Sequence[Sequence[str]], width: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units of columns from header rows of ``width`` cells; empty texts if the rows give none.

    A row with mostly units gives units. The last other row gives names, whose brackets may contain units. A row such as
    ``CA; V; p`` or ``Fi; Pc; V``, whose letters are both quantities and units, counts as names unless names stand above
    it.
    """
    names, units = [""] * width, [""] * width
    kinds = list[bool]()
    for row in rows:
        clear = any(_is_unit(cell) and plain_name(cell) not in _BOTH for cell in row)
        kinds.append(is_unit_row(row) and (False in kinds or (clear and _all_units(row))))
    last = max((k for k, own in enumerate(kinds) if not own), default=None)
    if last is not None:
        for k, cell in enumerate(rows[last]):
            names[k], units[k] = named(cell)
    for row, own in zip(rows, kinds, strict=True):
        if own:
            for k, cell in enumerate(row):
                units[k] = _bare(cell) if cell.lower() not in MISSING else units[k]
    return tuple(names), tuple(units)


def named(cell: str) -> tuple[str, str]:
    """Name and unit of a header cell: ``p [bar]``, ``p (bar)``, ``p / bar``, ``p in bar``; the unit may be empty.

    A bracket that holds no unit belongs to the name, as in ``p[1]``.
    """
    from cranktrain.core.units import is_unit

    if match := _BRACKET.match(cell):
        unit = next(text for text in match.groups()[1:] if text is not None).strip()
        if unit and not unit.isdigit() and (is_unit(unit) or "[" in cell):
            return match[1].strip(), unit
    if (match := _SLASH.match(cell)) and is_unit(match[2]):
        return match[1].strip(), match[2]
    return cell, ""


def is_unit_row(row: Sequence[str]) -> bool:
    """True if a row may state units: more than half of its non-empty cells are units."""
    stated = [cell for cell in row if cell.lower() not in MISSING]
    if any(re.fullmatch(r"[\d.,eE+-]+", cell) and cell != "1" for cell in stated):
        return False
    return bool(stated) and sum(map(_is_unit, stated)) > 0.5 * len(stated)


def _all_units(row: Sequence[str]) -> bool:
    """True if all non-empty cells of a row are units."""
    return all(_is_unit(cell) for cell in row if cell.lower() not in MISSING)


def _is_unit(cell: str) -> bool:
    """True if a cell is a unit, with or without brackets."""
    from cranktrain.core.units import is_unit

    return cell.lower() not in MISSING and not cell.isdigit() and (is_unit(cell) or is_unit(_bare(cell)))


def _bare(cell: str) -> str:
    """A cell without the brackets around it."""
    match = re.fullmatch(r"[\[({](.*)[\])}]", cell)
    return match[1].strip() if match else cell


def plain_name(name: str) -> str:
    """Form in which names are compared: small letters and digits only."""
    return re.sub(r"[^a-z0-9äöüß°]+", "", name.lower())


def chosen(wanted: str, names: Sequence[str], units: Sequence[str], where: str) -> int:
    """Index of a column from its name or its number (from 1); ``InputError`` if there is none, or several."""
    text = wanted.strip()
    own = [name or f"column {k}" for k, name in enumerate(names, 1)]
    whole = [f"{name} [{unit}]" if unit else name for name, unit in zip(own, units, strict=True)]
    for candidates in (own, whole):
        for match in (
            [k for k, name in enumerate(candidates) if name == text],
            [k for k, name in enumerate(candidates) if plain_name(name) == plain_name(text) != ""],
        ):
            if len(match) == 1:
                return match[0]
            if len(match) > 1:
                numbers = " or ".join(str(k + 1) for k in match)
                raise InputError(f"{where}: several columns are named {shown(text)}; give its number, {numbers}")
    number = whole_number(text.removeprefix("#"))
    if number is not None and 1 <= number <= len(own):
        return number - 1
    raise InputError(f"{where}: no column {shown(text)}; {nearest(text, own)}")
