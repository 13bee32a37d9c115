"""Reader of bulk data of Nastran and OptiStruct (nodes, tetrahedra, triangles, properties) with lines in errors.

meshio reads only a part of this: it follows no INCLUDE, takes nodes of any coordinate system as global, leaves out
elements in wide fields, and its errors give no line. This module reads

* ``GRID`` in basic coordinates, ``CTETRA`` of 4 or 10 nodes, ``CTRIA3``, ``CTRIAR`` and ``CTRIA6``, in narrow, wide and
  free fields with any continuation,
* ``INCLUDE``, relative to the file that names it and below the deck's folder
  (:mod:`cranktrain.structure.fem.mesh_parts`),
* names of properties as HyperMesh writes them into comments, ``$HMNAME PROP 3 "MAIN_1"``; else the property's number.

Other cards are skipped.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from cranktrain.core.argument_checks import whole_number
from cranktrain.core.errors import InputError, shown
from cranktrain.core.user_file import LONGEST_LINE, text_lines
from cranktrain.structure.fem.mesh_parts import MeshParts, Place, check_depth, included_file

NAMED_PROPERTY = re.compile(r'\$HMNAME\s+(?:PROP|COMP)\S*\s+([0-9]{1,18})\s*"([^"]+)"')
TRIANGLES = {"CTRIA3": 3, "CTRIAR": 3, "CTRIA6": 6}
OTHERS = ("CHEXA", "CPENTA", "CPYRA", "CPYRAM")
NARROW, WIDE = 8, 16
"""Width of a field in characters."""
_PART = re.compile(r"\s*BEGIN\s+(BULK|SUPER)", re.IGNORECASE)
_INCLUDE = re.compile(r"\s*INCLUDE\b", re.IGNORECASE)
_EXPONENT = re.compile(r"(?<=[\d.])([+-]\d+)$")

Lines = Iterator[tuple[Place, str]]


class _Card(NamedTuple):
    """Card of a Nastran file: its name in capitals, the fields after the name, and the place of its first line."""

    word: str
    fields: list[str]
    place: Place


def read_bulk(path: Path) -> MeshParts:
    """Mesh of a Nastran file by the numbers of the file; ``InputError`` with file and line."""
    parts, names = MeshParts(), dict[int, str]()
    surfaces: dict[int, list[int]] = {}
    for card in _cards(_bulk(path, names)):
        if card.word == "GRID":
            _add_node(parts, card)
        elif card.word == "CTETRA" or card.word in TRIANGLES:
            number, prop = _add_element(parts, card)
            if card.word in TRIANGLES:
                surfaces.setdefault(prop, []).append(number)
        elif card.word in OTHERS:
            parts.others[card.word] = parts.others.get(card.word, 0) + 1
        elif card.word == "GRDSET" and card.fields[1:2] not in ([], [""], ["0"]):
            raise InputError(f"{card.place}: nodes in coordinate system {card.fields[1]}; export them in basic ones")
    for prop, numbers in surfaces.items():
        parts.element_sets.setdefault(names.get(prop, f"{prop}"), []).extend(numbers)
    return parts


def included_files(path: Path) -> list[Path]:
    """Files that a Nastran file includes, in order; ``InputError`` if a file is missing or includes itself."""
    return list(dict.fromkeys(place.path for place, _ in _lines(path, (path,)) if place.path != path))


def _bulk(path: Path, names: dict[int, str]) -> Lines:
    """Lines of the bulk data without comments; names of properties in the comments are added to ``names``."""
    lines = list(_lines(path, (path,)))
    begins = [k for k, (_, line) in enumerate(lines) if _PART.match(line)]
    if len(begins) > 1:
        raise InputError(f"{lines[begins[1]][0]}: a second section of bulk data; give one part")
    # Comments with names may be anywhere in the file.
    names.update({int(match[1]): match[2] for _, line in lines if (match := NAMED_PROPERTY.match(line.lstrip()))})
    ended = False
    for place, line in lines[begins[0] + 1 if begins else 0 :]:
        plain = line.partition("$")[0].rstrip()
        if plain.strip().upper() == "ENDDATA":
            ended = True
            break
        if plain:
            yield place, plain
    if begins and not ended:
        raise InputError(f"{lines[-1][0]}: cut short: a Nastran file ends with ENDDATA; copy it again")


def _lines(path: Path, inside: tuple[Path, ...]) -> Lines:
    """Lines of a file; the lines of an included file replace its INCLUDE, whose name may continue in further lines."""
    begun, at = "", Place(path, 0)
    for number, line in text_lines(path, "Nastran file", "export the mesh again"):
        if begun:
            begun += line.strip()
        elif _INCLUDE.match(line):
            begun, at = line.strip(), Place(path, number)
        else:
            yield Place(path, number), line
            continue
        if any(begun.count(quote) == 1 for quote in "'\"") and len(begun) < LONGEST_LINE:
            continue
        name = begun[len("INCLUDE") :].lstrip(" =\t").partition("$")[0].strip().strip("'\"").strip()
        target = included_file(at, "INCLUDE", name, inside[0])
        check_depth(at, target, inside)
        yield from (row for row in _lines(target, (*inside, target)) if row[1].strip().upper() != "ENDDATA")
        begun = ""
    if begun:
        raise InputError(f"{at}: INCLUDE whose name has no closing quote")


def _cards(lines: Lines) -> Iterator[_Card]:
    """Cards in the lines of a Nastran file, each with its continuation lines."""
    card: _Card | None = None
    for place, line in lines:
        first, fields, width = _fields(line)
        goes_on = not first or first[0] in "+*"
        if goes_on and card is not None:
            if place.path != card.place.path:
                raise InputError(
                    f"{place}: a continuation of a card that stands in {card.place}; give each file whole cards"
                )
            # The missing fields of a short line before a continuation are blank.
            card.fields.extend([""] * (-len(card.fields) % width))
            card.fields.extend(fields)
            continue
        if card is not None:
            yield card
        # meshio writes CTETRA_ for tetrahedra of second order.
        card = None if goes_on else _Card(first.rstrip("*_").upper(), fields, place)
    if card is not None:
        yield card


def _fields(line: str) -> tuple[str, list[str], int]:
    """First field of a line, its data fields, and the number of data fields in its format."""
    if "," in line:
        first, *fields = (text.strip() for text in line.split(","))
        count = 4 if first.endswith("*") or first.startswith("*") else 8
        return first, fields[:count], count
    line = line.expandtabs(NARROW)
    first = line[:NARROW].strip()
    wide = first.endswith("*") or first.startswith("*")
    width, count = (WIDE, 4) if wide else (NARROW, 8)
    texts = [line[NARROW + width * k : NARROW + width * (k + 1)].strip() for k in range(count)]
    while texts and not texts[-1]:
        texts.pop()
    return first, texts, count


def _number(card: _Card, text: str) -> int:
    if (number := whole_number(text)) is None:
        raise InputError(f"{card.place}: {card.word} with {shown(text)} in place of a whole number")
    return number


def _add_node(parts: MeshParts, card: _Card) -> None:
    number, system, *place = [*card.fields, "", "", "", "", ""][:5]
    node = _number(card, number)
    if system not in ("", "0"):
        raise InputError(
            f"{card.place}: GRID {node} is in coordinate system {system}; export nodes in basic coordinates"
        )
    try:
        # In Nastran's notation 1.5-3 and 1.5D-3 are 0.0015.
        at = tuple(float(_EXPONENT.sub(r"E\1", text.upper().replace("D", "E"))) if text else 0.0 for text in place)
    except ValueError:
        raise InputError(
            f"{card.place}: GRID {node} at {shown(', '.join(place))}, which are no three numbers"
        ) from None
    parts.add_node(node, at, card.place)


def _add_element(parts: MeshParts, card: _Card) -> tuple[int, int]:
    """Add a tetrahedron or triangle and return its number and its property."""
    number, prop, *nodes = [*card.fields, "", ""]
    element = _number(card, number)
    own = _number(card, prop) if prop else element
    if card.word == "CTETRA":
        while nodes and not nodes[-1]:
            nodes.pop()
        valid: tuple[int, ...] = (4, 10)
    else:
        nodes = nodes[: TRIANGLES[card.word]]
        valid = (TRIANGLES[card.word],)
    if len(nodes) not in valid or not all(nodes):
        some = len([node for node in nodes if node])
        expected = " or ".join(map(str, valid))
        raise InputError(f"{card.place}: {card.word} {element} has {some} nodes; {expected} are expected")
    parts.add_element(element, tuple(_number(card, node) for node in nodes), card.place)
    return element, own
