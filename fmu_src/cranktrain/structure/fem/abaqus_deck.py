"""Reader of Abaqus and CalculiX decks (nodes, tetrahedra, triangles, sets, surfaces) with line numbers in errors.

meshio reads only a part of this: it keeps only the last *NODE block, knows no *SURFACE and few triangles of second
order, and its errors give no line. This module reads

* ``*NODE``, in any number of blocks, ``*ELEMENT``, ``*NSET`` and ``*ELSET`` (GENERATE, sets of sets),
* ``*SURFACE`` of element faces (S1 to S4), of the free faces of elements, or of nodes; of element sets too,
* ``*INCLUDE``, relative to the file that names it and below the deck's folder, and ``INPUT=`` of the keywords above
  (:mod:`cranktrain.structure.fem.mesh_parts`),
* ``*PART`` and ``*INSTANCE`` (:mod:`cranktrain.structure.fem.abaqus_assembly`).

Keywords that create or move nodes in other ways are refused, all others are skipped.
"""

import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from cranktrain.core.argument_checks import whole_number
from cranktrain.core.errors import InputError, shown
from cranktrain.core.user_file import LONGEST_LINE, text_lines
from cranktrain.structure.fem.mesh_parts import MeshParts, Place, check_depth, included_file

TETRAHEDRON = re.compile(r"(C3D|DC3D|AC3D|F3D)(4|10)([A-Z]*)")
TRIANGLE = re.compile(
    r"(S3|S3R|S3RS|S3RT|STRI3|DS3|R3D3|M3D3|SFM3D3|CPS3|CPE3|CPEG3|CAX3|SURFACE3)[A-Z]*"
    r"|(STRI65|S6|DS6|M3D6|SFM3D6|CPS6|CPE6|CPEG6|CAX6|SURFACE6)[A-Z]*"
)
SOLID = re.compile(r"(C3D|CSS|SC|DC3D|AC3D|COH3D)(5|6|8|13|15|15V|20|27)([A-Z]*)")
"""Element types of solids that are not tetrahedra."""
NODES_OF = {"4": 4, "10": 10}
MAKERS = {
    "NGEN": "nodes", "NFILL": "nodes", "NCOPY": "nodes", "NMAP": "places of nodes", "ELGEN": "elements",
    "ELCOPY": "elements", "SYMMETRIC MODEL GENERATION": "a model", "IMPORT": "a model",
}  # fmt: skip
"""Keywords that generate parts of a mesh, each with the name of the generated parts for an error message."""
DATA = re.compile(r'\*|\s*(?:"[^"]*"|[\w.+\-]*)\s*(?:,\s*(?:"[^"]*"|[\w.+\-]*)\s*)*$')
"""Pattern of keyword lines and of data lines (numbers and names between commas)."""
LISTS = ("NODE", "ELEMENT", "NSET", "ELSET", "SURFACE")
"""Keywords whose data lines may be in another file, named by INPUT=."""
Numbers = Callable[[str], "list[int] | None"]
"""Function that converts a text (number or name of a set) to node or element numbers; None for an unknown set."""


class Card(NamedTuple):
    """Keyword of a deck: parameters (in capitals), data lines, and file and line number of keyword and lines."""

    keyword: str
    parameters: dict[str, str]
    lines: list[tuple[Place, list[str]]]
    place: Place


def deck_cards(path: Path) -> Iterator[Card]:
    """Keywords of a deck and of all files that it includes; ``InputError`` with file and line."""
    return _cards(path, (path,))


def parts_of(cards: Iterable[Card]) -> MeshParts:
    """Mesh defined by a sequence of keywords, with the deck's numbers; ``InputError`` with file and line."""
    parts, later = MeshParts(), list[Card]()
    for card in cards:
        if card.keyword == "NODE":
            _add_nodes(parts, card)
        elif card.keyword == "ELEMENT":
            _add_elements(parts, card)
        elif card.keyword in ("NSET", "ELSET", "SURFACE"):
            later.append(card)
        elif MAKERS.get(card.keyword):
            made = MAKERS[card.keyword]
            raise InputError(
                f"{card.place}: *{card.keyword} makes {made}; give a deck that lists all nodes and elements"
            )
        elif card.keyword == "SYSTEM" and card.lines:
            raise InputError(f"{card.place}: *SYSTEM, a system of coordinates: give the nodes in global coordinates")
    add_sets(parts, later, lambda sets, _: lambda text: named(sets, text))
    return parts


def add_sets(parts: MeshParts, cards: list[Card], numbers: Callable[[dict[str, list[int]], Card], Numbers]) -> None:
    """Add all sets, then all surfaces, which may name sets that are defined later in the deck.

    ``numbers`` maps the sets of one kind and a keyword to the function that turns texts of this keyword into numbers.
    """
    for kind, own in (("ELSET", parts.element_sets), ("NSET", parts.node_sets)):
        for card in cards:
            if card.keyword == kind:
                _add_set(parts, card, kind, numbers(own, card))
    for card in cards:
        if card.keyword == "SURFACE":
            by_nodes = card.parameters.get("TYPE", "ELEMENT").upper() == "NODE"
            own = parts.node_sets if by_nodes else parts.element_sets
            _add_surface(parts, card, by_nodes, numbers(own, card))


def named(sets: dict[str, list[int]], text: str) -> list[int] | None:
    """Numbers for a text, which is a number or the name of a set in any case; None if the set does not exist."""
    plain = text.strip('"')
    if (number := whole_number(plain)) is not None:
        return [number]
    return sets.get(plain) or next((own for name, own in sets.items() if name.lower() == plain.lower()), None)


def included_files(path: Path) -> list[Path]:
    """Files that a deck includes, in order; ``InputError`` if a file is missing or includes itself."""
    places = (place for card in deck_cards(path) for place in (card.place, *(place for place, _ in card.lines[:1])))
    return list(dict.fromkeys(place.path for place in places if place.path != path))


def _cards(path: Path, inside: tuple[Path, ...]) -> Iterator[Card]:
    """Keywords of a file with their data; keywords of included files replace their *INCLUDE."""
    card: Card | None = None
    for place, line in _lines(path):
        if not line.startswith("*"):
            if card is not None and line:
                card.lines.append((place, _texts(line)))
            continue
        if card is not None:
            yield _with_input(card, inside[0])
        keyword, *rest = line[1:].split(",")
        parameters = {}
        for one in rest:
            key, _, value = one.partition("=")
            parameters[key.strip().upper()] = value.strip().strip('"')
        card = Card(" ".join(keyword.upper().split()), parameters, [], place)
        if card.keyword == "INCLUDE":
            target = _named_file(card, inside[0])
            check_depth(card.place, target, inside)
            yield from _cards(target, (*inside, target))
            card = None
    if card is not None:
        yield _with_input(card, inside[0])


def _with_input(card: Card, deck: Path) -> Card:
    """Keyword with the data lines of its INPUT= file. Errors about a file of another kind do not quote its lines."""
    if card.keyword not in LISTS or "INPUT" not in card.parameters:
        return card
    target = _named_file(card, deck)
    rows = [(place, line) for place, line in _lines(target) if line]
    numbers = card.keyword in ("NODE", "ELEMENT")
    for place, line in rows:
        if not DATA.match(line) or (numbers and line[:1] not in "*+-0123456789"):
            raise InputError(f"{place}: no line of *{card.keyword}; name a file with nothing but its data")
    if wrong := next((place for place, line in rows if line.startswith("*")), None):
        raise InputError(f"{wrong}: a keyword in the data of *{card.keyword}; name such a file by *INCLUDE")
    return card._replace(lines=[(place, _texts(line)) for place, line in rows])


def _texts(line: str) -> list[str]:
    return [one.strip() for one in line.rstrip(",").split(",")]


def _named_file(card: Card, deck: Path) -> Path:
    """Path named by INPUT= of a keyword, relative to the file that holds the keyword; ``InputError``."""
    name = card.parameters.get("INPUT", "").strip("\"'")
    if not name:
        raise InputError(f"{card.place}: *{card.keyword} without INPUT=; name the file")
    return included_file(card.place, f"*{card.keyword}", name, deck)


def _lines(path: Path) -> Iterator[tuple[Place, str]]:
    """Lines of a file without comments; a keyword line that ends with a comma continues in the next line."""
    begun, start = "", 0
    for number, raw in text_lines(path, "input deck", "export the deck again"):
        line = raw.strip()
        if line.startswith("**"):
            continue
        if begun:
            line, number = begun + line, start
            begun = ""
        if line.startswith("*") and line.endswith(",") and len(line) < LONGEST_LINE:
            begun, start = line, number
            continue
        yield Place(path, number), line
    if begun:
        yield Place(path, start), begun


def _numbers(place: Place, texts: list[str]) -> list[int]:
    """Integers of a line; ``InputError`` for anything else."""
    found = []
    for text in filter(None, texts):
        if (number := whole_number(text)) is None:
            raise InputError(f"{place}: {shown(text)} is no whole number")
        found.append(number)
    return found


def _add_nodes(parts: MeshParts, card: Card) -> None:
    chosen = card.parameters.get("NSET")
    if card.parameters.get("SYSTEM", "R").upper() not in ("R", ""):
        raise InputError(f"{card.place}: nodes in cylindrical or spherical coordinates; give them as X, Y, Z")
    for place, texts in card.lines:
        try:
            number, *coordinates = texts
            at = tuple(float(text.upper().replace("D", "E")) if text else 0.0 for text in coordinates[:3])
        except ValueError:
            raise InputError(f"{place}: {shown(', '.join(texts))} is no node; expected is NUMBER, X, Y, Z") from None
        (node,) = _numbers(place, [number])
        if len(at) != 3:
            raise InputError(f"{place}: node {node} has {len(at)} coordinates; expected is NUMBER, X, Y, Z")
        parts.add_node(node, at, place)
        if chosen:
            parts.node_sets.setdefault(chosen, []).append(node)


def _add_elements(parts: MeshParts, card: Card) -> None:
    kind = card.parameters.get("TYPE", "").upper()
    tetrahedron, triangle = TETRAHEDRON.fullmatch(kind), TRIANGLE.fullmatch(kind)
    if tetrahedron:
        count = NODES_OF[tetrahedron[2]]
    elif triangle:
        count = 3 if triangle[1] else 6
    else:
        if SOLID.fullmatch(kind) or not kind:
            what = kind or "elements without TYPE="
            parts.others[what] = parts.others.get(what, 0) + len(card.lines)
        return
    chosen, waiting, begun = card.parameters.get("ELSET"), list[int](), card.place
    for place, texts in card.lines:
        begun = begun if waiting else place
        waiting += _numbers(place, texts)
        if len(waiting) > count + 1:
            break
        if len(waiting) == count + 1:
            number, *nodes = waiting
            parts.add_element(number, tuple(nodes), begun)
            if chosen:
                parts.element_sets.setdefault(chosen, []).append(number)
            waiting = []
    if waiting:
        raise InputError(
            f"{begun}: element {waiting[0]} of type {kind} has {len(waiting) - 1} nodes, {count} are expected"
        )


def _add_set(parts: MeshParts, card: Card, kind: str, numbers: Numbers) -> None:
    sets = parts.element_sets if kind == "ELSET" else parts.node_sets
    name = card.parameters.get(kind)
    if not name:
        raise InputError(f"{card.place}: *{kind} without {kind}=; name the set")
    own = sets.setdefault(name, [])
    for place, texts in card.lines:
        if "GENERATE" in card.parameters:
            first, last, *step = _numbers(place, texts) if len([t for t in texts if t]) > 1 else (0, -1)
            if last < first or (step and step[0] < 1):
                raise InputError(f"{place}: GENERATE wants FIRST, LAST, STEP; found {shown(', '.join(texts))}")
            begin = (numbers(str(first)) or [first])[0]
            generated = range(begin, begin + last - first + 1, step[0] if step else 1)
            parts.reserve(len(generated), place, name)
            own += generated
            continue
        for text in filter(None, texts):
            found = numbers(text)
            if found is None:
                told = (
                    "a set that does not exist"
                    if place.path != card.place.path
                    else f"set {shown(text)} does not exist"
                )
                raise InputError(f"{place}: {told}; define it before {name}")
            parts.reserve(len(found), place, name)
            own += found


def _add_surface(parts: MeshParts, card: Card, by_nodes: bool, numbers: Numbers) -> None:
    """Add a surface: sides S1 to S4 or all free faces of solids, shell elements, or nodes."""
    name = card.parameters.get("NAME")
    if not name:
        raise InputError(f"{card.place}: *SURFACE without NAME=; name it")
    if "COMBINE" in card.parameters or card.parameters.get("TYPE", "ELEMENT").upper() not in ("ELEMENT", "NODE"):
        raise InputError(f"{card.place}: surface {name} is not of elements or nodes; give its element faces")
    for place, texts in card.lines:
        side = texts[1].upper() if len(texts) > 1 else ""
        found = numbers(texts[0])
        if found is None:
            told = "a set" if place.path != card.place.path else f"the set {shown(texts[0])}"
            raise InputError(f"{place}: surface {name} names {told}, which does not exist")
        parts.reserve(len(found), place, name)
        if by_nodes:
            parts.node_sets.setdefault(name, []).extend(found)
            continue
        if side in ("S1", "S2", "S3", "S4"):
            faces = [(number, int(side[1])) for number in found]
        elif side in ("", "SPOS", "SNEG"):
            faces = [(number, 0) for number in found]
        else:
            raise InputError(f"{place}: {shown(side)} is no face of a tetrahedron or triangle; valid: S1 to S4")
        parts.faces.setdefault(name, []).extend(faces)
