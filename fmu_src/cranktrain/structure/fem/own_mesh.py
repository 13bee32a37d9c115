"""A user's own mesh: unit, connectivity, positions against the engine file; digest of the inputs of a body."""

import json
import math
from collections.abc import Iterable, Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.cache import cache_folder
from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import SCHEMA
from cranktrain.core.types import Array, Integers
from cranktrain.core.user_file import file_exists

UNITS = {"m": 1.0, "mm": 1e-3, "in": 0.0254}
"""Length in m of each unit of coordinates."""
SHOWN_PLACES = 3
"""Largest number of positions that a message lists."""


class MeshFile(str):
    """Path of a user's own mesh with the unit of its coordinates; plain paths mean metres."""

    unit: str

    def __new__(cls, path: str | Path, unit: str = "m") -> "MeshFile":
        """Make a path with a unit; ``InputError`` for an unknown unit."""
        if unit not in UNITS:
            raise InputError(f"mesh unit '{unit}' does not exist; valid: {', '.join(UNITS)}")
        found = super().__new__(cls, path)
        found.unit = unit
        return found


def mesh_unit(path: str | Path) -> str:
    """Unit of the coordinates in a mesh file; metres unless the path is a :class:`MeshFile`."""
    return path.unit if isinstance(path, MeshFile) else "m"


def check_one_piece(nodes: Array, tets: Integers, path: str | Path) -> None:
    """Refuse solids of several pieces, or with overlapping elements; ``InputError`` gives a position.

    Parameters
    ----------
    nodes : (n, 3) m
    tets : (m, 4 or more) nodes of the elements, corners first
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    corners = tets[:, :4]
    n = len(nodes)
    ones = np.ones(3 * len(corners), dtype=bool)
    links = coo_array((ones, (np.repeat(corners[:, 0], 3), corners[:, 1:].ravel())), shape=(n, n))
    _, piece = connected_components(links, directed=False)
    pieces, count = np.unique(piece[corners[:, 0]], return_counts=True)
    if len(pieces) > 1:
        second = pieces[np.argsort(-count)[1]]
        x, y, z = 1e3 * nodes[corners[piece[corners[:, 0]] == second].ravel()].mean(axis=0)
        raise InputError(
            f"{path}: the solid is {len(pieces)} pieces, the largest with {count.max()} of {count.sum()} elements, "
            f"another around ({x:.1f}, {y:.1f}, {z:.1f}) mm; expected is one: merge equal nodes, leave other pieces out"
        )
    faces = np.sort(np.concatenate([np.delete(corners, k, axis=1) for k in range(4)]), axis=1)
    shared, number = np.unique(faces, axis=0, return_counts=True)
    if (number > 2).any():
        x, y, z = 1e3 * nodes[shared[number.argmax()]].mean(axis=0)
        raise InputError(
            f"{path}: {np.sum(number > 2)} faces belong to more than two elements, one at ({x:.1f}, {y:.1f}, {z:.1f}) "
            "mm; leave out duplicate elements"
        )


def check_names(path: str | Path, wanted: Iterable[str], found: Iterable[str], what: str, remedy: str) -> None:
    """Raise ``InputError`` for a body or mesh without all ``wanted`` names; ``remedy`` ends the message."""
    if missing := [name for name in wanted if name not in found]:
        named = ", ".join(sorted(found)) or "none"
        raise InputError(f"{path}: no {what} named {', '.join(missing)}; found {named}{remedy}")


def check_places(path: str | Path, found: Mapping[str, Array], expected: Mapping[str, Array], tolerance: float) -> None:
    """Refuse surfaces at other positions than in the engine file: ``InputError`` with both positions and a remedy.

    Parameters
    ----------
    found, expected : position (3,) of each surface, m; only the surfaces of ``expected`` are compared
    tolerance : largest distance, m
    """
    names = list(expected)
    have, want = np.array([found[name] for name in names]), np.array([expected[name] for name in names])
    off = np.linalg.norm(have - want, axis=1)
    wrong = np.argsort(-off)[: np.count_nonzero(off > tolerance)]
    if wrong.size:
        listed = [
            f"{names[k]} lies at {_mm(have[k])}, the engine file has it at {_mm(want[k])}" for k in wrong[:SHOWN_PLACES]
        ]
        rest = f", and {wrong.size - SHOWN_PLACES} more" if wrong.size > SHOWN_PLACES else ""
        raise InputError(f"{path}: {'; '.join(listed)} mm{rest}: {_remedy(names, have, want, tolerance)}")


def _remedy(names: list[str], have: Array, want: Array, tolerance: float) -> str:
    """Text of a remedy, such as a change of unit, that would bring the surfaces to their positions."""

    def fits(moved: Array) -> bool:
        return bool(np.linalg.norm(moved - want, axis=1).max() <= tolerance)

    scale = float((have * want).sum() / max((have * have).sum(), 1e-300))
    if fits(scale * have) and not 0.5 < scale < 2.0:
        return f"coordinates {1.0 / scale:.4g} times as large as expected; state the unit with --mesh-unit"
    shift = (want - have).mean(axis=0)
    if fits(have + shift):
        return f"shift the mesh by {_mm(shift)} mm"
    turn = float(np.angle(np.sum((have[:, 0] - 1j * have[:, 1]) * (want[:, 0] + 1j * want[:, 1]))))
    c, s = math.cos(turn), math.sin(turn)
    if fits(np.column_stack((c * have[:, 0] - s * have[:, 1], s * have[:, 0] + c * have[:, 1], have[:, 2]))):
        return f"turn the mesh by {math.degrees(turn):.0f} deg about z"
    nearby = np.linalg.norm(have[:, None] - want[None], axis=2).argmin(axis=1)
    if sorted(nearby) == list(range(len(names))) and fits(want + have - want[nearby]):
        pairs = [f"{names[k]} is where {names[other]} belongs" for k, other in enumerate(nearby) if k != other]
        return f"name the surfaces anew: {', '.join(pairs[:SHOWN_PLACES])}"
    return "use the engine file that it belongs to, or change its dimensions"


def _mm(place: Array) -> str:
    return "({:.1f}, {:.1f}, {:.1f})".format(*(np.round(1e3 * place, 1) + 0.0))


def kept_path(kind: str, digest: str) -> Path:
    """Path in the user's cache of a body with this digest of its inputs.

    Names of files of earlier versions began with the engine's name; such a file with this digest is used if it exists.
    """
    folder, ending = cache_folder(), f"-{digest[:16]}.h5"
    place = folder / f"{kind}{ending}"
    return place if place.exists() else min(folder.glob(f"*{ending}"), default=place)


def content_digest(content: dict[str, Any], mesh_file: str | Path | None) -> str:
    """Digest of a body's input data, and of the user's mesh if there is one."""
    content = {"schema": SCHEMA, **content}
    if mesh_file is not None and file_exists(mesh_file):
        from cranktrain.structure.fem import abaqus_deck, nastran_deck
        from cranktrain.structure.fem.mesh_file import FORMATS

        file = Path(mesh_file)
        content["mesh"] = sha256(file.read_bytes()).hexdigest()
        deck = {"abaqus": abaqus_deck, "nastran": nastran_deck}.get(FORMATS.get(file.suffix.lower(), ""))
        if included := [] if deck is None else deck.included_files(file):
            content["mesh_included"] = [sha256(path.read_bytes()).hexdigest() for path in included]
        if mesh_unit(mesh_file) != "m":
            content["mesh_unit"] = mesh_unit(mesh_file)
    return sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
