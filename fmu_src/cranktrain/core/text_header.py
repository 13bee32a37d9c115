"""Names and units of a text table's columns, from the rows above its values."""

from __future__ import annotations

import re
from collections.abc import Sequence

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.text_dialect import MISSING, split, trimmed

_BRACKET = re.compile(r"^(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\)|\{([^}]*)\})\s*$")
_SLASH = re.compile(r"^(.*\S)\s+(?:/|in)\s+(\S+)$")


def header_cells(line: str, separator: str, width: int) -> list[str] | None:
    """Cells of a line above the values if it has one for each of ``width`` columns (2 at least), else None.

    Where blanks separate, a bracket belongs to the word before it, and two blanks or more may separate instead.
    """
    options = [trimmed(split(line, separator))]
    if separator == " ":
        joined = re.sub(r"\s+(?=[\[(])", "\u00a0", line.strip())
        joined = re.sub(r"[\[(][^\])]*[\])]", lambda found: found[0].replace(" ", "\u00a0"), joined)
        options.append([cell.replace("\u00a0", " ") for cell in re.split(r"[ \t]+", joined)])
        options.append([cell.strip() for cell in re.split(r"\t+|\s{2,}", line.strip())])
    for other in (";", "\t", ",", "|") if separator == " " else ():
        options.append([cell for cell in trimmed(split(line, other)) if cell])
    return next((cells for cells in options if len(cells) == width), None)


def names_and_units(rows: Sequence[Sequence[str]], width: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units of columns from header rows of ``width`` cells; empty texts where the rows do not say.

    A row of which most cells are units gives units; the last other row gives names, whose brackets may state units.
    """
    from cranktrain.core.units import is_unit

    names, units = [""] * width, [""] * width
    of_units = [_of_units(row) for row in rows]
    last = max((k for k, own in enumerate(of_units) if not own), default=None)
    if last is not None:
        for k, cell in enumerate(rows[last]):
            names[k], units[k] = named(cell)
    for row, own in zip(rows, of_units, strict=True):
        if own:
            for k, cell in enumerate(row):
                text = cell.strip("[](){}").strip() if not is_unit(cell) else cell
                units[k] = text if text.lower() not in MISSING else units[k]
    return tuple(names), tuple(units)


def named(cell: str) -> tuple[str, str]:
    """Name and unit of a header's cell: ``p [bar]``, ``p (bar)``, ``p / bar``, ``p in bar``; a unit may be empty.

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


def _of_units(row: Sequence[str]) -> bool:
    """Whether a row states units: at least half of its cells, and the others are empty or a dash."""
    from cranktrain.core.units import is_unit

    stated = [cell for cell in row if cell.lower() not in MISSING]
    found = sum(1 for cell in stated if is_unit(cell) or re.fullmatch(r"[\[(]([^\])]*)[\])]", cell))
    return bool(stated) and found > 0.5 * len(stated)


def plain_name(name: str) -> str:
    """A name as names are compared: small letters and digits."""
    return re.sub(r"[^a-z0-9äöüß°]+", "", name.lower())


def chosen(wanted: str, names: Sequence[str], units: Sequence[str], where: str) -> int:
    """Index of a column by its name or its number from 1; ``InputError`` where there is none or several."""
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
    if re.fullmatch(r"#?\d+", text) and 1 <= int(text.lstrip("#")) <= len(own):
        return int(text.lstrip("#")) - 1
    raise InputError(f"{where}: no column {shown(text)}; {nearest(text, own)}")
