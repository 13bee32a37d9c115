"""Input decks of Abaqus and CalculiX: nodes, tetrahedra, triangles, sets and surfaces, with the line of each error.

meshio reads a part of this: it keeps the last *NODE block only, knows no *SURFACE and few triangles of second order,
and tells no line. Read are

* ``*NODE``, in any number of blocks, ``*ELEMENT``, ``*NSET`` and ``*ELSET`` (GENERATE, sets of sets),
* ``*SURFACE`` of element faces (S1 to S4) or nodes, of element sets too,
* ``*INCLUDE``, relative to the file that names it, to any depth without cycles.

Other keywords are passed over. Nodes of several parts, or of an instance that is moved, would lie elsewhere and are
refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from cranktrain.core.errors import InputError, shown
from cranktrain.structure.fem.mesh_parts import MeshParts, Place

TETRAHEDRON = re.compile(r"(C3D|DC3D|AC3D|F3D)(4|10)([A-Z]*)")
TRIANGLE = re.compile(
    r"(S3|S3R|S3RS|S3RT|STRI3|DS3|R3D3|M3D3|SFM3D3|CPS3|CPE3|CPEG3|CAX3|SURFACE3)[A-Z]*"
    r"|(STRI65|S6|DS6|M3D6|SFM3D6|CPS6|CPE6|CPEG6|CAX6|SURFACE6)[A-Z]*"
)
SOLID = re.compile(r"(C3D|CSS|SC|DC3D|AC3D|COH3D)(5|6|8|13|15|15V|20|27)([A-Z]*)")
"""Solids that are no tetrahedra."""
NODES_OF = {"4": 4, "10": 10}
DEEPEST = 20
"""Files that include each other."""


class Card(NamedTuple):
    """A keyword with its parameters (in capitals) and its lines of data, each with its place."""

    keyword: str
    parameters: dict[str, str]
    lines: list[tuple[Place, list[str]]]
    place: Place


def read_deck(path: Path) -> MeshParts:
    """Parts of the mesh of an input deck; ``InputError`` with file and line."""
    parts, part_names = MeshParts(), set[str]()
    surfaces: list[Card] = []
    sets: dict[str, list[Card]] = {"ELSET": [], "NSET": []}
    for card in _cards(path, (path,)):
        if card.keyword == "NODE":
            _add_nodes(parts, card)
        elif card.keyword == "ELEMENT":
            _add_elements(parts, card)
        elif card.keyword in sets:
            sets[card.keyword].append(card)
        elif card.keyword == "SURFACE":
            surfaces.append(card)
        elif card.keyword == "PART":
            part_names.add(card.parameters.get("NAME", ""))
            if len(part_names) > 1:
                raise InputError(f"{card.place}: a second part, '{card.parameters.get('NAME', '')}': export one part")
        elif card.keyword in ("INSTANCE", "SYSTEM") and card.lines:
            moved = "an instance that is moved" if card.keyword == "INSTANCE" else "*SYSTEM, a system of coordinates"
            raise InputError(f"{card.place}: {moved}: give the nodes at their places in global coordinates")
    for kind, own in (("ELSET", parts.element_sets), ("NSET", parts.node_sets)):
        for card in sets[kind]:
            _add_set(own, card, kind)
    for card in surfaces:
        _add_surface(parts, card)
    return parts


def included_files(path: Path) -> list[Path]:
    """Files that a deck includes, in their order; ``InputError`` where one is missing or includes itself."""
    return list(dict.fromkeys(card.place.path for card in _cards(path, (path,)) if card.place.path != path))


def _cards(path: Path, inside: tuple[Path, ...]) -> Iterator[Card]:
    """Keywords of a file with their data, those of included files in their place."""
    card: Card | None = None
    for place, line in _lines(path):
        if not line.startswith("*"):
            if card is not None and line:
                card.lines.append((place, [one.strip() for one in line.rstrip(",").split(",")]))
            continue
        if card is not None:
            yield card
        card = _card(place, line)
        if card.keyword == "INCLUDE":
            yield from _included(card, path, inside)
            card = None
    if card is not None:
        yield card


def _included(card: Card, path: Path, inside: tuple[Path, ...]) -> Iterator[Card]:
    name = card.parameters.get("INPUT", "").strip("\"'")
    if not name:
        raise InputError(f"{card.place}: *INCLUDE without INPUT=; name the file")
    target = path.parent / name
    if not target.is_file():
        raise InputError(f"{card.place}: *INCLUDE names {name}, which is not in {path.parent}; put it there")
    if target.resolve() in [one.resolve() for one in inside] or len(inside) > DEEPEST:
        raise InputError(f"{card.place}: {name} includes itself, by {' -> '.join(one.name for one in inside)}")
    yield from _cards(target, (*inside, target))


def _lines(path: Path) -> Iterator[tuple[Place, str]]:
    """Lines of a file without comments; a keyword line that ends with a comma goes on in the next one."""
    begun, start = "", 0
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        for number, raw in enumerate(file, 1):
            line = raw.strip()
            if line.startswith("**"):
                continue
            if begun:
                line, number = begun + line, start
                begun = ""
            if line.startswith("*") and line.endswith(","):
                begun, start = line, number
                continue
            yield Place(path, number), line
    if begun:
        yield Place(path, start), begun


def _card(place: Place, line: str) -> Card:
    keyword, *rest = line[1:].split(",")
    parameters = {}
    for one in rest:
        key, _, value = one.partition("=")
        parameters[key.strip().upper()] = value.strip().strip('"')
    return Card(" ".join(keyword.upper().split()), parameters, [], place)


def _numbers(place: Place, texts: list[str]) -> list[int]:
    """Whole numbers of a line; ``InputError``."""
    try:
        return [int(text) for text in texts if text]
    except ValueError:
        wrong = next(text for text in texts if text and not text.lstrip("+-").isdigit())
        raise InputError(f"{place}: {shown(wrong)} is no whole number") from None


def _add_nodes(parts: MeshParts, card: Card) -> None:
    chosen = card.parameters.get("NSET")
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


def _add_set(sets: dict[str, list[int]], card: Card, kind: str) -> None:
    name = card.parameters.get(kind)
    if not name:
        raise InputError(f"{card.place}: *{kind} without {kind}=; name the set")
    own = sets.setdefault(name, [])
    lower = {key.lower(): key for key in sets}
    for place, texts in card.lines:
        if "GENERATE" in card.parameters:
            first, last, *step = _numbers(place, texts) if len([t for t in texts if t]) > 1 else (0, -1)
            if last < first or (step and step[0] < 1):
                raise InputError(f"{place}: GENERATE wants FIRST, LAST, STEP; found {shown(', '.join(texts))}")
            own += range(first, last + 1, step[0] if step else 1)
            continue
        for text in filter(None, texts):
            if text.isdigit():
                own.append(int(text))
            elif text.strip('"').lower() in lower:
                own += sets[lower[text.strip('"').lower()]]
            else:
                raise InputError(f"{place}: set {shown(text)} does not exist; define it before {name}")


def _add_surface(parts: MeshParts, card: Card) -> None:
    """Faces of a surface: of a solid's side S1 to S4, of shells whole; or its nodes."""
    name = card.parameters.get("NAME")
    if not name:
        raise InputError(f"{card.place}: *SURFACE without NAME=; name it")
    by_nodes = card.parameters.get("TYPE", "ELEMENT").upper() == "NODE"
    sets = parts.node_sets if by_nodes else parts.element_sets
    lower = {key.lower(): key for key in sets}
    for place, texts in card.lines:
        what, side = texts[0].strip('"'), (texts[1].upper() if len(texts) > 1 else "")
        if what.isdigit():
            numbers = [int(what)]
        elif what.lower() in lower:
            numbers = sets[lower[what.lower()]]
        else:
            raise InputError(f"{place}: surface {name} names the set {shown(what)}, which does not exist")
        if by_nodes:
            parts.node_sets.setdefault(name, []).extend(numbers)
            continue
        if side in ("S1", "S2", "S3", "S4"):
            faces = [(number, int(side[1])) for number in numbers]
        elif side in ("", "SPOS", "SNEG"):
            faces = [(number, 0) for number in numbers]
        else:
            raise InputError(f"{place}: {shown(side)} is no face of a tetrahedron or triangle; valid: S1 to S4")
        parts.faces.setdefault(name, []).extend(faces)
