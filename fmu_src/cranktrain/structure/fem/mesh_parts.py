"""Mesh data common to all readers: numbered nodes, tetrahedra, named surfaces of triangles, and included files.

A surface is defined by triangles, by nodes or by faces of tetrahedra. Readers collect the numbers of the file.
:func:`assembled` converts them to indices and refuses numbers that do not exist, with the line.
"""

import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError, shown
from cranktrain.core.types import Array, Integers
from cranktrain.core.user_file import check_file, file_exists, user_path

MOST_MEMBERS = 4_000_000
"""Largest number of members of all sets and surfaces of a mesh, which take 160 MB."""
FACES = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))
"""Corners of the faces 1 to 4 of a tetrahedron, as Abaqus numbers them."""


class Place(NamedTuple):
    """File and line number (from 1) for messages."""

    path: Path
    line: int

    def __str__(self) -> str:
        return f"{self.path}, line {self.line}"


@dataclass
class MeshParts:
    """Parts of a mesh by the numbers of its file.

    Attributes
    ----------
    nodes : number → (x, y, z)
    elements : number → nodes, for tetrahedra and triangles
    places : number → file and line of each element
    others : kind → count of solids that are not tetrahedra
    surfaces : name → triangles given by their nodes
    node_sets, element_sets : name → numbers
    faces : name → (element, face 1 to 4; 0 for a triangle, or for all free faces of a tetrahedron)
    members : number of members of all sets and surfaces read so far
    base, instances : numbers from k ``base`` on belong to instance k of an assembly; ``base`` is 0 without an assembly
    """

    nodes: dict[int, tuple[float, ...]] = field(default_factory=dict)
    elements: dict[int, tuple[int, ...]] = field(default_factory=dict)
    places: dict[int, Place] = field(default_factory=dict)
    others: dict[str, int] = field(default_factory=dict)
    node_sets: dict[str, list[int]] = field(default_factory=dict)
    element_sets: dict[str, list[int]] = field(default_factory=dict)
    faces: dict[str, list[tuple[int, int]]] = field(default_factory=dict)
    base: int = 0
    members: int = 0
    instances: tuple[str, ...] = ()

    def shown(self, number: int) -> str:
        """Number of a node or element as text, as in its file; the name of an Abaqus instance stands in front."""
        if not self.base or number < self.base:
            return f"{number}"
        return f"{self.instances[number // self.base]}.{number % self.base}"

    def reserve(self, count: int, place: Place, name: str) -> None:
        """Count members before they are added to a set or surface; ``InputError`` above ``MOST_MEMBERS`` in total."""
        self.members += count
        if self.members > MOST_MEMBERS:
            raise InputError(
                f"{place}: set {shown(name)} gets {count} members, with which the sets of this deck have more than "
                f"{MOST_MEMBERS}; a set lists nodes or elements that are there"
            )

    def add_element(self, number: int, nodes: tuple[int, ...], place: Place) -> None:
        """Add a tetrahedron or triangle; ``InputError`` if the number belongs to another element."""
        if self.elements.get(number, nodes) != nodes:
            raise InputError(
                f"{place}: element {number} stands at {self.places[number]} already, with other nodes; give each its "
                "own number"
            )
        self.elements[number], self.places[number] = nodes, place

    def add_node(self, number: int, place: tuple[float, ...], where: Place) -> None:
        """Add a node; ``InputError`` if the number belongs to another node."""
        if self.nodes.get(number, place) != place:
            raise InputError(f"{where}: node {number} is there already, at another place; give each its own number")
        self.nodes[number] = place


class Assembled(NamedTuple):
    """Nodes (n, 3), tetrahedra (m, 4 or 10), and triangles (k, 3) of each named surface, as indices into the nodes."""

    points: Array
    tets: Integers
    surfaces: dict[str, Integers]


def assembled(path: Path, parts: MeshParts) -> Assembled:
    """Arrays of a mesh from its numbered parts; ``InputError``: other solids, nodes that do not exist."""
    by_count: dict[int, list[int]] = {}
    for number, nodes in parts.elements.items():
        by_count.setdefault(len(nodes), []).append(number)
    kinds = [f"{len(by_count[n])} {n}-node tetrahedra" for n in (4, 10) if n in by_count]
    kinds += [f"{count} {kind}" for kind, count in sorted(parts.others.items())]
    if len(kinds) != 1 or parts.others:
        held = ", ".join(kinds) or "no solids"
        raise InputError(f"{path}: holds {held}: mesh the solid with tetrahedra of one kind, quadratic ones best")
    count = 4 if 4 in by_count else 10
    index = {number: k for k, number in enumerate(parts.nodes)}
    for number, nodes in parts.elements.items():
        missing = [node for node in nodes if node not in index]
        if missing:
            what = f"element {parts.shown(number)} has node {parts.shown(missing[0])}"
            raise InputError(f"{parts.places[number]}: {what}, which does not exist")
    points = np.array(list(parts.nodes.values()), dtype=np.float64).reshape(len(index), -1)
    if points.shape[1] != 3 or not np.isfinite(points).all():
        wrong = next((n for n, place in parts.nodes.items() if len(place) != 3 or not np.isfinite(place).all()), 0)
        raise InputError(f"{path}: node {parts.shown(wrong)} has no finite place in space")
    tets = np.array([[index[node] for node in parts.elements[number]] for number in by_count[count]])
    return Assembled(points, tets, _surfaces(parts, index, tets, set(by_count[count])))


def _surfaces(parts: MeshParts, index: dict[int, int], tets: Integers, solid: set[int]) -> dict[str, Integers]:
    """Triangles of each named surface; a set of tetrahedra defines no surface."""
    found: dict[str, list[Integers]] = {}

    def add(name: str, triangles: Iterable[tuple[int, ...]]) -> None:
        rows = np.array([[index[node] for node in nodes[:3]] for nodes in triangles], dtype=np.int64).reshape(-1, 3)
        if len(rows):
            found.setdefault(name, []).append(rows)

    for name, numbers in parts.element_sets.items():
        add(name, (parts.elements[k] for k in numbers if k in parts.elements and k not in solid))
    free = any(face == 0 and k in solid for faces in parts.faces.values() for k, face in faces)
    skin = outer_faces(tets) if parts.node_sets or free else np.zeros((0, 3), dtype=np.int64)
    outside = {tuple(sorted(row)) for row in skin.tolist()} if free else set()
    for name, faces in parts.faces.items():
        corners = ((parts.elements[k], FACES[face - 1]) for k, face in faces if face and k in solid)
        add(name, (tuple(nodes[c] for c in face) for nodes, face in corners))
        add(name, (parts.elements[k] for k, face in faces if face == 0 and k in parts.elements and k not in solid))
        whole = (parts.elements[k] for k, face in faces if face == 0 and k in solid)
        sides = (tuple(nodes[c] for c in corners) for nodes in whole for corners in FACES)
        add(name, (side for side in sides if tuple(sorted(index[node] for node in side)) in outside))
    for name, numbers in parts.node_sets.items():
        inside = np.zeros(len(index), dtype=bool)
        inside[[index[node] for node in numbers if node in index]] = True
        chosen = skin[inside[skin].all(axis=1)]
        if len(chosen):
            found.setdefault(name, []).append(chosen)
    return {name: np.concatenate(pieces) for name, pieces in found.items()}


def outer_faces(tets: Integers) -> Integers:
    """Corner triangles (k, 3) that belong to one tetrahedron only."""
    faces = np.concatenate([tets[:, list(corners)] for corners in ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(faces[first[count == 1]])


VARIABLE = "CRANKTRAIN_INCLUDES"
DEEPEST = 100
"""Largest number of nested inclusions."""


def included_file(place: Place, keyword: str, name: str, deck: Path) -> Path:
    """Path of a file named by a keyword, relative to the deck; ``InputError`` if it is not permitted or not there.

    A deck may come from an untrusted source. Its included files must therefore lie below the folder of ``deck``, the
    main file that the user gave, or below a folder that the user names in the environment variable
    ``CRANKTRAIN_INCLUDES`` (several with the system's separator of paths).
    """
    target = place.path.parent / name
    found = target.resolve()
    folders = [deck.parent, *(user_path(text) for text in os.environ.get(VARIABLE, "").split(os.pathsep) if text)]
    if not any(found.is_relative_to(folder.resolve()) for folder in folders):
        raise InputError(
            f"{place}: {keyword} names {shown(name)}, which is not below the deck's folder {deck.parent}; put it "
            f"there, or name its folder in the environment variable {VARIABLE}"
        )
    check_file(found, f"{place}: {keyword} names {shown(name)}, which", "put a file there")
    if not name or not file_exists(found):
        raise InputError(f"{place}: {keyword} names {shown(name)}, which is not in {place.path.parent}; put it there")
    return target


def check_depth(place: Place, target: Path, inside: tuple[Path, ...]) -> None:
    """Refuse a file that includes itself or is nested deeper than ``DEEPEST``; ``inside`` are the including files."""
    if target.resolve() in [one.resolve() for one in inside]:
        raise InputError(f"{place}: {target.name} includes itself, by {' -> '.join(one.name for one in inside)}")
    if len(inside) > DEEPEST:
        raise InputError(f"{place}: {DEEPEST} files include each other; join some of them")
