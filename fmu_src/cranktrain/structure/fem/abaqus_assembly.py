"""Reader of Abaqus decks with parts and an assembly: positions of instances, and unique numbers of their nodes.

``*INSTANCE`` moves its part by a vector, then rotates it about an axis through two points by an angle in degrees. Sets
and surfaces are defined in a part or an instance, or in the assembly, where they name an instance (``INSTANCE=``,
``web-1.5``). If the deck ties surfaces (``*TIE``), coincident nodes of two instances are merged; meshes that do not
match at their tie stay two pieces.
"""

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.types import Array
from cranktrain.structure.fem.abaqus_deck import Card, Numbers, add_sets, deck_cards, named, parts_of
from cranktrain.structure.fem.mesh_parts import MeshParts

CLOSE = 1e-6
"""Tolerance of coincident nodes of tied instances, over the size of the assembly."""


@dataclass
class _Instance:
    """Instance of a part: name, keyword, own keywords; after reading also its mesh and the offset of its numbers."""

    name: str
    card: Card
    cards: list[Card] = field(default_factory=list)
    mesh: MeshParts = field(default_factory=MeshParts)
    offset: int = 0


def read_deck(path: Path) -> MeshParts:
    """Mesh of an input deck, in global coordinates; ``InputError`` with file and line."""
    parts: dict[str, list[Card]] = {}
    instances: list[_Instance] = []
    outside: list[Card] = []
    inside, tied = outside, False
    for card in deck_cards(path):
        if card.keyword == "PART":
            inside = parts.setdefault(_name(card), [])
            if inside:
                raise InputError(f"{card.place}: part {shown(_name(card))} is there already; give each its own name")
        elif card.keyword == "INSTANCE":
            instances.append(_Instance(_name(card), card))
            inside = instances[-1].cards
        elif card.keyword in ("END PART", "END INSTANCE", "ASSEMBLY", "END ASSEMBLY"):
            inside = outside
        else:
            tied = tied or card.keyword == "TIE"
            inside.append(card)
    if not instances:
        if len(parts) > 1:
            raise InputError(
                f"{path}: holds {len(parts)} parts, and no *INSTANCE that places them; export the assembly"
            )
        return parts_of([card for cards in (*parts.values(), outside) for card in cards])
    return _assembly(parts, instances, outside, tied)


def _name(card: Card) -> str:
    return card.parameters.get("NAME", "").strip('"')


def _assembly(parts: dict[str, list[Card]], instances: list[_Instance], outside: list[Card], tied: bool) -> MeshParts:
    """One mesh of all instances and of the assembly's own nodes, elements and sets."""
    lower = {name.lower(): cards for name, cards in parts.items()}
    for instance in instances:
        wanted = instance.card.parameters.get("PART", "").strip('"')
        if wanted.lower() not in lower:
            raise InputError(
                f"{instance.card.place}: instance {instance.name} is of part {shown(wanted)}, which the deck has not; "
                f"{nearest(wanted, parts) if parts else 'export the parts too'}"
            )
        instance.mesh = parts_of([*lower[wanted.lower()], *instance.cards])
    own = parts_of([card for card in outside if card.keyword in ("NODE", "ELEMENT")])
    meshes = [own, *(instance.mesh for instance in instances)]
    largest = max((max((*mesh.nodes, *mesh.elements), default=0) for mesh in meshes), default=0)
    total = own
    total.base = 10 ** len(str(largest))
    total.instances = ("", *(instance.name for instance in instances))
    for k, instance in enumerate(instances, 1):
        instance.offset = k * total.base
        _add(total, instance)
    by_name = {instance.name.lower(): instance for instance in instances}

    def numbers(sets: dict[str, list[int]], card: Card) -> Numbers:
        kind = "node_sets" if sets is total.node_sets else "element_sets"
        return lambda text: _found(text, card, by_name, kind, sets)

    add_sets(total, [card for card in outside if card.keyword in ("NSET", "ELSET", "SURFACE")], numbers)
    if tied:
        _join(total)
    return total


def _found(
    text: str, card: Card, instances: dict[str, _Instance], kind: str, sets: dict[str, list[int]]
) -> list[int] | None:
    """Numbers in the assembly for a text in its keywords, such as ``5``, ``name`` or ``instance.5``."""
    of, dot, what = text.strip('"').rpartition(".")
    of = of.strip('"')
    if dot and of.lower() not in instances and (found := named(sets, text)) is not None:
        return found  # the name of a set may contain a dot
    of = of or card.parameters.get("INSTANCE", "").strip('"')
    if not of:
        return named(sets, text)
    if of.lower() not in instances:
        names = [instance.name for instance in instances.values()]
        raise InputError(f"{card.place}: instance {shown(of)} does not exist; {nearest(of, names)}")
    instance = instances[of.lower()]
    found = named(getattr(instance.mesh, kind), what)
    return None if found is None else [number + instance.offset for number in found]


def _add(total: MeshParts, instance: _Instance) -> None:
    """Add the mesh of an instance at its position, with its numbers converted to those of the assembly."""
    mesh, by = instance.mesh, instance.offset
    places = np.array(list(mesh.nodes.values()), dtype=np.float64).reshape(-1, 3)
    moved = _placed(places, instance.card)
    total.nodes |= {number + by: tuple(place) for number, place in zip(mesh.nodes, moved.tolist(), strict=True)}
    total.elements |= {number + by: tuple(n + by for n in nodes) for number, nodes in mesh.elements.items()}
    total.places |= {number + by: place for number, place in mesh.places.items()}
    for kind, count in mesh.others.items():
        total.others[kind] = total.others.get(kind, 0) + count
    for sets, own in ((total.node_sets, mesh.node_sets), (total.element_sets, mesh.element_sets)):
        for name, numbers in own.items():
            sets.setdefault(name, []).extend(number + by for number in numbers)
    for name, faces in mesh.faces.items():
        total.faces.setdefault(name, []).extend((number + by, face) for number, face in faces)


def _placed(points: Array, card: Card) -> Array:
    """Points (n, 3) of a part in its instance: translated, then rotated about a line through two points."""
    values = []
    for place, texts in card.lines[:2]:
        try:
            values.append([float(text or 0.0) for text in texts])
        except ValueError:
            raise InputError(f"{place}: {shown(', '.join(texts))}; an instance is placed by numbers") from None
    if values:
        shift = (values[0] + [0.0, 0.0, 0.0])[:3]
        points = points + np.array(shift)
    if len(values) < 2:
        return points
    if len(values[1]) != 7:
        raise InputError(f"{card.lines[1][0]}: a rotation is two points and an angle, 7 numbers, not {len(values[1])}")
    first, second = np.array(values[1][:3]), np.array(values[1][3:6])
    length = float(np.linalg.norm(second - first))
    if length == 0.0:
        raise InputError(f"{card.lines[1][0]}: the two points of the rotation's axis are one; give two")
    axis, angle = (second - first) / length, math.radians(values[1][6])
    arm = points - first
    along = np.outer(arm @ axis, axis)
    return first + along + math.cos(angle) * (arm - along) + math.sin(angle) * np.cross(axis, arm)


def _join(total: MeshParts) -> None:
    """Merge coincident nodes of different instances."""
    from scipy.spatial import cKDTree

    numbers = np.array(list(total.nodes))
    points = np.array(list(total.nodes.values()), dtype=np.float64).reshape(-1, 3)
    pairs = cKDTree(points).query_pairs(CLOSE * float(np.ptp(points, axis=0).max()), output_type="ndarray")
    pairs = numbers[pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]]
    one: dict[int, int] = {}
    for a, b in pairs[pairs[:, 0] // total.base != pairs[:, 1] // total.base].tolist():
        one[max(a, b)] = one.get(min(a, b), min(a, b))
    total.elements = {number: tuple(one.get(n, n) for n in nodes) for number, nodes in total.elements.items()}
    total.node_sets = {name: [one.get(n, n) for n in nodes] for name, nodes in total.node_sets.items()}
    total.nodes = {number: place for number, place in total.nodes.items() if number not in one}
