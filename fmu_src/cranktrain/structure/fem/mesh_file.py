"""Tetrahedra and named surfaces as meshing programs write them."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array

Integers = NDArray[np.integer[Any]]

FORMATS = {".msh": "gmsh", ".inp": "abaqus", ".bdf": "nastran", ".nas": "nastran", ".fem": "nastran"}
TETRAHEDRA = ("tetra10", "tetra")
TRIANGLES = ("triangle6", "triangle")
FLAT = {"vertex", "line", "line3", *TRIANGLES}
NUMBERED = re.compile(r"(main|pin|bore|liner|head|mount)[\s_.-]*\[?(\d+)\]?(?:[\s_.-]*(upper|lower))?")
NAMED_PROPERTY = re.compile(r'^\$HMNAME\s+(?:PROP|COMP)\S*\s+(\d+)\s*"([^"]+)"', re.MULTILINE)


def interface_name(name: str) -> str:
    """Spell a surface's name as the interfaces are: ``MAIN_1`` is ``main[1]``, ``LINER_1_UPPER`` ``liner[1].upper``.

    Others come in small letters.
    """
    plain = name.strip().strip("\"'").lower()
    numbered = NUMBERED.fullmatch(plain)
    if not numbered:
        return plain
    return f"{numbered[1]}[{int(numbered[2])}]" + (f".{numbered[3]}" if numbered[3] else "")


def read_surfaces_and_tetrahedra(path: Path) -> tuple[Array, Integers, dict[str, Integers]]:
    """Nodes (n, 3), tetrahedra (m, 10) or (m, 4) in VTK's order, and triangles (k, 3) of each named surface.

    Raises ``InputError``: if the file is missing or broken, its format unknown, or its solids are not tetrahedra of one
    kind.
    """
    import meshio

    if path.suffix.lower() not in FORMATS:
        raise InputError(f"{path}: mesh format '{path.suffix}' is not known: use {', '.join(FORMATS)}")
    if not path.is_file():
        raise InputError(f"{path}: no such mesh file: give the path of a {', '.join(FORMATS)} file")
    try:
        found = meshio.read(path, file_format=FORMATS[path.suffix.lower()])
    # A broken file ends meshio's readers in any way, an exit of the process included.
    except (Exception, SystemExit) as reason:
        text = " ".join(str(reason).split()) or type(reason).__name__
        raise InputError(f"{path}: not readable as {FORMATS[path.suffix.lower()]} ({text}): export it again") from None
    kinds = {block.type for block in found.cells} - FLAT
    if len(kinds) != 1 or kinds.isdisjoint(TETRAHEDRA):
        text = ", ".join(sorted(kinds)) or "no solids"
        raise InputError(f"{path}: holds {text}: mesh the solid with tetrahedra of one kind, quadratic ones best")
    kind = kinds.pop()
    if kind == "tetra":
        warnings.warn(f"{path}: linear tetrahedra become quadratic with straight sides; export tet10", stacklevel=3)
    tets = np.concatenate([block.data for block in found.cells if block.type == kind])
    points = np.asarray(found.points, dtype=float)
    used = np.concatenate([np.ravel(block.data) for block in found.cells if block.type in (kind, *FLAT)])
    if points.ndim != 2 or points.shape[1] != 3 or used.min() < 0 or used.max() >= len(points):
        raise InputError(f"{path}: elements refer to nodes that do not exist: export it again")
    if not np.isfinite(points).all():
        raise InputError(f"{path}: nodes have no finite place: export it again")
    return points, tets, _surfaces(found, tets, path)


def _surfaces(found: Any, tets: Integers, path: Path) -> dict[str, Integers]:
    """Triangles (k, 3) of each named surface, whatever way it was named."""
    pieces: dict[str, list[Integers]] = {}

    def add(name: str, triangles: Integers) -> None:
        if len(triangles):
            pieces.setdefault(interface_name(name), []).append(triangles[:, :3])

    groups = {int(tag): name for name, (tag, dimension) in found.field_data.items() if dimension == 2}
    if FORMATS[path.suffix.lower()] == "nastran":
        text = path.read_text(errors="replace")
        groups = {int(number): name for number, name in NAMED_PROPERTY.findall(text)}
    for key in ("gmsh:physical", "nastran:ref"):
        for block, tags in zip(found.cells, found.cell_data.get(key, ()), strict=False):
            if block.type in TRIANGLES:
                for tag in np.unique(tags):
                    add(groups.get(int(tag), str(tag)), block.data[tags == tag])
    for name, members in found.cell_sets.items():
        for block, chosen in zip(found.cells, members, strict=True):
            if block.type in TRIANGLES and chosen is not None:
                add(name, block.data[np.asarray(chosen, dtype=int)])
    if found.point_sets:
        skin = _skin(tets)
        for name, members in found.point_sets.items():
            inside = np.zeros(len(found.points), dtype=bool)
            inside[np.asarray(members, dtype=int)] = True
            add(name, skin[inside[skin].all(axis=1)])
    return {name: np.concatenate(parts) for name, parts in pieces.items()}


def _skin(tets: Integers) -> Integers:
    """Corner triangles (k, 3) that belong to one tetrahedron only."""
    faces = np.concatenate([tets[:, list(corners)] for corners in ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(faces[first[count == 1]])
