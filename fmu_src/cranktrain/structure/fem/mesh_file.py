"""Reader of mesh files of other programs: tetrahedra and named surfaces.

Gmsh files are read by meshio. Decks of Abaqus, bulk data of Nastran and universal files have their own readers, whose
errors give the line (:mod:`cranktrain.structure.fem.abaqus_assembly`, :mod:`cranktrain.structure.fem.nastran_deck`,
:mod:`cranktrain.structure.fem.universal_file`).
"""

import re
import warnings
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import IO, Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array, Integers
from cranktrain.core.user_file import check_file, file_exists
from cranktrain.structure.fem.abaqus_assembly import read_deck
from cranktrain.structure.fem.mesh_parts import Assembled, MeshParts, assembled, outer_faces
from cranktrain.structure.fem.named_matrices import held_in
from cranktrain.structure.fem.nastran_deck import read_bulk
from cranktrain.structure.fem.universal_file import read_universal

FORMATS = {
    ".msh": "gmsh", ".inp": "abaqus", ".unv": "universal", ".bdf": "nastran", ".nas": "nastran", ".fem": "nastran",
}  # fmt: skip
OWN: dict[str, Callable[[Path], MeshParts]] = {
    "abaqus": read_deck, "nastran": read_bulk, "universal": read_universal,
}  # fmt: skip
MESHIO = "meshio.gmsh.main"
"""Module of meshio with the function ``read_buffer``, which reads Gmsh files."""
MATRICES = {
    ".pch": "a Nastran punch", ".op4": "a Nastran OUTPUT4", ".mtx": "a matrix", ".sub": "an Ansys superelement",
    ".full": "an Ansys matrix",
}  # fmt: skip
"""Endings of matrix files, each with the kind of matrix; they belong to a superelement and not to a mesh."""
TETRAHEDRA = ("tetra10", "tetra")
TRIANGLES = ("triangle6", "triangle")
FLAT = {"vertex", "line", "line3", *TRIANGLES}
NUMBERED = re.compile(r"(main|pin|bore|liner|head|mount)[\s_.-]*\[?(\d+)\]?(?:[\s_.-]*(upper|lower))?")


def interface_name(name: str) -> str:
    """Interface name of a mesh's surface: ``MAIN_1`` → ``main[1]``, ``LINER_1_UPPER`` → ``liner[1].upper``.

    Other names are converted to lower case.
    """
    plain = name.strip().strip("\"'").lower()
    numbered = NUMBERED.fullmatch(plain)
    if not numbered:
        return plain
    return f"{numbered[1]}[{int(numbered[2])}]" + (f".{numbered[3]}" if numbered[3] else "")


def read_surfaces_and_tetrahedra(path: Path) -> tuple[Array, Integers, dict[str, Integers]]:
    """Nodes (n, 3), tetrahedra (m, 10) or (m, 4) in VTK's order, and triangles (k, 3) of each named surface.

    Raises ``InputError`` with the reason, and the line if known: the file is missing or broken, its format is unknown,
    or its solids are not tetrahedra of one kind.
    """
    ending = path.suffix.lower()
    if ending in MATRICES:
        raise InputError(
            f"{path}: {MATRICES[ending]} file holds {held_in(path)}, no mesh: name it in a superelement's .toml "
            "and give that by --body (docs/how-to/own_elements.md)"
        )
    if ending in (".step", ".stp"):
        raise InputError(f"{path}: CAD, no mesh: 'cranktrain new NAME --cad {path.name}' meshes it")
    if ending not in FORMATS:
        raise InputError(f"{path}: mesh format '{path.suffix}' is not known: use {', '.join(FORMATS)}")
    form = FORMATS[ending]
    check_file(path, f"{path}", "give a mesh file")
    if not file_exists(path):
        raise InputError(f"{path}: no such mesh file: give the path of a {', '.join(FORMATS)} file")
    try:
        found = assembled(path, OWN[form](path)) if form in OWN else _by_meshio(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check its permissions") from None
    if found.tets.shape[1] == 4:
        warnings.warn(f"{path}: linear tetrahedra become quadratic with straight sides; export tet10", stacklevel=3)
    pieces: dict[str, list[Integers]] = {}
    for name, triangles in found.surfaces.items():
        pieces.setdefault(interface_name(name), []).append(triangles[:, :3])
    return found.points, found.tets, {name: np.concatenate(parts) for name, parts in pieces.items()}


def _by_meshio(path: Path) -> Assembled:
    """Mesh of a file read by meshio; ``InputError`` with meshio's reason and the position in the file."""
    with _opened(path) as file:
        try:
            found = import_module(MESHIO).read_buffer(file)
        # A broken file can end meshio's readers with any exception, or with an exit of the process.
        except (Exception, SystemExit) as reason:
            said = " ".join(str(reason).split())
            text = f"{type(reason).__name__}: {said}" if said else type(reason).__name__
            raise InputError(f"{path}{_where(file)}: not readable as gmsh ({text})") from None
    kinds = {block.type for block in found.cells} - FLAT
    if len(kinds) != 1 or kinds.isdisjoint(TETRAHEDRA):
        counts: dict[str, int] = {}
        for block in found.cells:
            if block.type in kinds:
                counts[block.type] = counts.get(block.type, 0) + len(block.data)
        text = ", ".join(f"{count} {kind}" for kind, count in sorted(counts.items())) or "no solids"
        raise InputError(f"{path}: holds {text}: mesh the solid with tetrahedra of one kind, quadratic ones best")
    kind = kinds.pop()
    tets = np.concatenate([block.data for block in found.cells if block.type == kind])
    points = np.asarray(found.points, dtype=float)
    used = np.concatenate([np.ravel(block.data) for block in found.cells if block.type in (kind, *FLAT)])
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"{path}: its {len(points)} nodes have no three coordinates each")
    if used.min() < 0 or used.max() >= len(points):
        raise InputError(
            f"{path}: an element has a node that is not among the {len(points)} nodes; export the mesh again"
        )
    if not np.isfinite(points).all():
        wrong = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
        raise InputError(f"{path}: node {wrong + 1} of {len(points)} has no finite place: {points[wrong].tolist()}")
    return Assembled(points, tets, _surfaces(found, tets))


def _opened(path: Path) -> IO[Any]:
    """Open a mesh file for meshio; ``InputError`` for a wrong first line, which meshio does not report."""
    file = path.open("rb")
    begin = file.readline(1000).strip()
    file.seek(0)
    if begin not in (b"$MeshFormat", b"$Comments"):
        file.close()
        raise InputError(f"{path}, line 1: not readable as gmsh, whose files begin with $MeshFormat")
    return file


def _where(file: IO[Any]) -> str:
    """Text for an error: the line, or byte, up to which a file was read."""
    try:
        offset = file.tell()
        file.seek(0)
        before = file.read(offset)
    except (OSError, ValueError):
        return ""
    if isinstance(before, bytes):
        if b"\0" in before:
            return f", byte {offset}"
        before = before.decode(errors="replace")
    return f", line {max(1, before.count(chr(10)))}"


def _surfaces(found: Any, tets: Integers) -> dict[str, Integers]:
    """Triangles (k, 3) of each named surface, which a mesh file may name by cell sets, point sets or tags."""
    pieces: dict[str, list[Integers]] = {}

    def add(name: str, triangles: Integers) -> None:
        if len(triangles):
            pieces.setdefault(name, []).append(triangles[:, :3])

    groups = {int(tag): name for name, (tag, dimension) in found.field_data.items() if dimension == 2}
    for block, tags in zip(found.cells, found.cell_data.get("gmsh:physical", ()), strict=False):
        if block.type in TRIANGLES:
            for tag in np.unique(tags):
                add(groups.get(int(tag), str(tag)), block.data[tags == tag])
    for name, members in found.cell_sets.items():
        for block, chosen in zip(found.cells, members, strict=True):
            if block.type in TRIANGLES and chosen is not None:
                add(name, block.data[np.asarray(chosen, dtype=int)])
    if found.point_sets:
        skin = outer_faces(tets)
        for name, members in found.point_sets.items():
            inside = np.zeros(len(found.points), dtype=bool)
            inside[np.asarray(members, dtype=int)] = True
            add(name, skin[inside[skin].all(axis=1)])
    return {name: np.concatenate(parts) for name, parts in pieces.items()}
