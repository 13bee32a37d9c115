"""Reader of universal files (.unv): nodes (dataset 2411), elements (2412), permanent groups (2467 and predecessors).

Elements of second order list corners and mid-side nodes alternately. pyuff, which reads measured data of such files,
reads at most eight nodes of an element, so ten-node tetrahedra would be lost.
"""

from pathlib import Path
from typing import NamedTuple

from cranktrain.core.argument_checks import whole_number
from cranktrain.core.errors import InputError, shown
from cranktrain.core.user_file import text_lines
from cranktrain.structure.fem.mesh_parts import MeshParts, Place

NODES, ELEMENTS = (2411, 781, 15), (2412, 780)
GROUPS = (2467, 2477, 2452, 2435, 2432, 2430, 2429)
TETRAHEDRA = {111: (0, 1, 2, 3), 118: (0, 2, 4, 9, 1, 3, 5, 6, 7, 8)}
"""Order of the nodes of four- and ten-node tetrahedra: corners, then mid-side nodes in VTK's order."""
TRIANGLES: dict[int, tuple[int, ...]] = {41: (0, 1, 2), 51: (0, 1, 2), 61: (0, 1, 2), 74: (0, 1, 2), 91: (0, 1, 2)}
TRIANGLES |= dict.fromkeys((42, 52, 62, 72, 92), (0, 2, 4, 1, 3, 5))
OTHER_SOLIDS = {112: "wedges", 113: "wedges", 115: "bricks", 116: "bricks", 101: "wedges", 104: "bricks", 105: "bricks"}
BEAMS = (11, 21, 22, 23, 24, 31, 32)
"""Kinds of beam elements, which have an additional line between their head line and their nodes."""
NODE, ELEMENT = 7, 8
"""Type codes of members of a group."""


class _Lines:
    """Lines of a file with their numbers; reading beyond the end raises ``InputError``."""

    def __init__(self, path: Path) -> None:
        self.path, self.at = path, 0
        self.lines = list[str]()
        for number, line in text_lines(path, "universal file", "export the mesh again"):
            if not self.lines and line.strip() not in ("", "-1"):
                raise InputError(
                    f"{Place(path, number)}: universal files begin with a line of -1; export the mesh again"
                )
            self.lines.append(line)

    @property
    def place(self) -> Place:
        return Place(self.path, self.at)

    @property
    def more(self) -> bool:
        return self.at < len(self.lines)

    def peek(self) -> str:
        return self.lines[self.at].strip() if self.more else ""

    def line(self) -> str:
        if not self.more:
            raise InputError(f"{self.place}: the file ends within a dataset; it is cut short, export or copy it again")
        self.at += 1
        return self.lines[self.at - 1]

    def integers(self) -> list[int]:
        text = self.line()
        try:
            return [int(one) for one in text.split()]
        except ValueError:
            raise InputError(f"{self.place}: {shown(text.strip())}; whole numbers are expected here") from None

    def many(self, count: int) -> list[int]:
        """Read the next ``count`` numbers, from as many lines as needed."""
        found: list[int] = []
        while len(found) < count:
            if self.peek() == "-1":
                raise InputError(f"{self.place}: the dataset ends after {len(found)} of {count} numbers")
            found += self.integers()
        return found


class _Head(NamedTuple):
    number: int
    kind: int
    nodes: int


def read_universal(path: Path) -> MeshParts:
    """Mesh of a universal file by the numbers of the file; ``InputError`` with the line."""
    parts, lines, seen = MeshParts(), _Lines(path), set[int]()
    while lines.more:
        if lines.line().strip() != "-1":
            continue
        if not lines.more:
            break
        number = whole_number(lines.peek().rstrip("b"))
        if number is None:
            continue
        seen.add(number)
        lines.line()
        if number in NODES:
            _nodes(parts, lines, number)
        elif number in ELEMENTS:
            _elements(parts, lines, number)
        elif number in GROUPS:
            _groups(parts, lines, number)
        else:
            while lines.more and lines.peek() != "-1":
                lines.line()
        lines.line()  # skip the line of -1 that ends the dataset
    if not seen.intersection(NODES) or not seen.intersection(ELEMENTS):
        held = ", ".join(map(str, sorted(seen))) or "no dataset"
        raise InputError(f"{path}: no mesh: it holds {held}; nodes are dataset 2411, elements 2412, groups 2467")
    return parts


def _nodes(parts: MeshParts, lines: _Lines, dataset: int) -> None:
    while lines.peek() != "-1":
        head = lines.line().split()
        where = lines.place
        texts = head[4:] if dataset == 15 else lines.line().split()
        try:
            at = tuple(float(text.upper().replace("D", "E")) for text in texts)
            number, system = int(head[0]), int(head[1])
        except (ValueError, IndexError):
            raise InputError(f"{lines.place}: {shown(' '.join((*head, *texts)))} is no node") from None
        if len(at) != 3:
            raise InputError(f"{lines.place}: node {number} has {len(at)} coordinates, 3 are expected")
        if system > 1:
            raise InputError(f"{where}: node {number} is in coordinate system {system}; export global coordinates")
        parts.add_node(number, at, where)


def _elements(parts: MeshParts, lines: _Lines, dataset: int) -> None:
    while lines.peek() != "-1":
        values = lines.integers()
        where = lines.place
        if len(values) < 6:
            raise InputError(f"{where}: an element begins with number, kind, tables, colour and number of nodes")
        head = _Head(values[0], values[1], values[5] if dataset == 2412 else values[-1])
        if not 0 < head.nodes < 100:
            raise InputError(f"{where}: element {head.number} has {head.nodes} nodes")
        if head.kind in BEAMS:
            lines.line()
        nodes = lines.many(head.nodes)
        order = TETRAHEDRA.get(head.kind) or TRIANGLES.get(head.kind)
        if order is None:
            if head.kind in OTHER_SOLIDS:
                kind = OTHER_SOLIDS[head.kind]
                parts.others[kind] = parts.others.get(kind, 0) + 1
            continue
        if len(nodes) != len(order):
            raise InputError(
                f"{where}: element {head.number} of kind {head.kind} has {len(nodes)} nodes, {len(order)} are expected"
            )
        parts.add_element(head.number, tuple(nodes[k] for k in order), where)


def _groups(parts: MeshParts, lines: _Lines, dataset: int) -> None:
    """Read groups of nodes and elements; later datasets have four numbers per member, earlier ones two."""
    width = 4 if dataset in (2467, 2477, 2452, 2435) else 2
    while lines.peek() != "-1":
        values = lines.integers()
        where = lines.place
        if len(values) < 7:
            raise InputError(f"{where}: a group begins with its number and, last, the number of its members")
        name = lines.line().strip()
        members = lines.many(width * values[-1])
        for kind, number in zip(members[::width], members[1::width], strict=True):
            if kind == NODE:
                parts.node_sets.setdefault(name, []).append(number)
            elif kind == ELEMENT:
                parts.element_sets.setdefault(name, []).append(number)
