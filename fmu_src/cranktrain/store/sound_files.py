"""Checks of files of unknown origin before memory is allocated: sizes, links, types of numbers, nesting.

A file states the shapes of its arrays, and a damaged or hostile file may state any shape. An array may take at most
:data:`EXPANSION` times the bytes of its file, which is the best compression of zeros, and at most half of the machine's
memory. All checks raise ``ValueError``; the reader turns this into a message with the file's name.
"""

import json
import math
import os
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray
from scipy import sparse
from scipy.io import mminfo, mmread

from cranktrain.core.errors import StoreError
from cranktrain.core.reduced_body import ReducedBody, check, rigid_coordinates
from cranktrain.core.rigid_slices import rigid_motion, skew

EXPANSION = 1100
"""Largest expansion of a compressed file, in bytes per byte; deflate reaches 1032."""
FREE = 1 << 20
"""Number of bytes of memory that the content of a file of any size may take."""
NUMBERS = "biufc"
"""NumPy's one-letter codes of the types of numbers."""
LEAST_INERTIA = -1e-3
"""Lower bound of the least principal moment of inertia over the largest. It is below 0 because a line of masses has no
moment about its axis, and matrices of a superelement are rounded."""
ROUNDING = 1e-3
"""Relative tolerance for equal values in a body, since a superelement's matrices have only their file's digits."""
MOST = 1e15
"""Largest number in a body, SI; squares of such numbers and their sums are finite."""
DAMAGED = (
    KeyError, OSError, ValueError, TypeError, AttributeError, EOFError, IndexError, RuntimeError, OverflowError,
    MemoryError, NotImplementedError, zipfile.BadZipFile,
)  # fmt: skip
"""Errors that libraries raise for damaged files; RecursionError is a RuntimeError."""


def memory() -> int:
    """Bytes of this machine's memory; 8 GiB if the system does not state it."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return 8 << 30


def check_size(asked: int, size: int, what: str) -> None:
    """Raise ``ValueError`` if ``what``, in a file of ``size`` bytes, states more bytes (``asked``) than possible."""
    if asked > min(EXPANSION * size + FREE, memory() // 2):
        raise ValueError(f"{what} states {asked:.3g} bytes, the file has {size:.3g}")


def json_of(text: str | bytes) -> Any:
    """Value of a JSON text; ``ValueError`` also if it is nested too deeply."""
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("brackets are nested too deeply") from None


def check_tree(file: Any, size: int) -> None:
    """Check all groups and arrays of an open HDF5 file of ``size`` bytes, which may contain hard links only.

    A soft or external link could lead to another file, or nowhere. Arrays must be numbers, or texts that name numbers.
    """
    asked = 0
    for name, item in _items(file):
        if hasattr(item, "keys"):
            continue
        if item.is_virtual or item.external:
            raise ValueError(f"{name} lies in another file")
        if item.shape is None or not (item.dtype.kind in NUMBERS or "unit" not in item.attrs):
            raise ValueError(f"{name} holds no numbers")
        asked += math.prod(item.shape) * item.dtype.itemsize
        check_size(asked, size, name)


def rising(values: NDArray[Any], last: float = -math.inf) -> bool:
    """True if numbers (n,) are finite and increase, starting above ``last``."""
    return bool(np.isfinite(values).all() and np.all(np.diff(values, prepend=last) > 0.0))


def _items(group: Any, above: str = "", seen: frozenset[Any] = frozenset()) -> Iterator[tuple[str, Any]]:
    """Names and objects below a group; ``ValueError`` for a link that is not part of a tree."""
    for name in group:
        place = f"{above}{name}"
        if type(group.get(name, getlink=True)).__name__ != "HardLink":
            raise ValueError(f"{place} is a link to somewhere else")
        item = group[name]
        yield place, item
        if hasattr(item, "keys"):
            if item.id in seen or len(seen) > 20:
                raise ValueError(f"{place} is nested in itself, or too deeply")
            yield from _items(item, f"{place}/", seen | {item.id})


def archive_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Arrays of a NumPy archive by name; none may be larger than its entry."""
    size = path.stat().st_size
    with zipfile.ZipFile(path) as archive:
        check_size(sum(entry.file_size for entry in archive.infolist()), size, "the archive")
        for entry in archive.infolist():
            with archive.open(entry) as file:
                version = npy.read_magic(file)
                read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
                shape, _, kind = read(file)
            if kind.hasobject or math.prod(shape) * kind.itemsize > entry.file_size:
                raise ValueError(f"{entry.filename} is no array, or less than it states")
    with np.load(path, allow_pickle=False) as data:
        return {name: data[name] for name in data.files}


def matrix(path: Path, shape: tuple[int, int] | None = None) -> NDArray[Any]:
    """Full matrix from a Matrix Market file, with a given shape; without a shape the file must contain every entry."""
    rows, columns, entries, kind, field, _ = mminfo(path)
    stated, size = (int(rows), int(columns)), path.stat().st_size
    if shape is not None and stated != shape:
        raise ValueError(f"{path.name} is {stated}, needs {shape}")
    if field not in ("real", "integer", "double") or min(stated) < 1 or 2 * int(entries) > size:
        raise ValueError(f"{path.name} holds no numbers, or fewer than it states")
    if shape is None and kind != "array":
        raise ValueError(f"{path.name} is not full")
    check_size(8 * stated[0] * stated[1], memory(), path.name)
    found = mmread(path)
    return found.toarray() if sparse.issparse(found) else np.asarray(found)


def real(array: Any) -> NDArray[np.float64]:
    """Real numbers of a file's array; ``ValueError`` for complex numbers and texts, which NumPy would convert."""
    found = np.asarray(array)
    if found.dtype.kind not in "iuf":
        raise ValueError(f"real numbers are needed, found {found.dtype}")
    return np.ascontiguousarray(found, dtype=np.float64)


def check_body(body: ReducedBody) -> None:
    """Raise ``StoreError`` if the numbers of a stored body cannot belong to a body with mass."""
    check(body)

    def refuse(text: str) -> None:
        raise StoreError(f"body '{body.name}': {text}; make it anew")

    if not 0.0 < body.mass < math.inf:
        refuse(f"its mass is {body.mass:g} kg, needs one above zero")
    if len(set(body.interfaces)) < len(body.interfaces):
        refuse("two interfaces have one name")
    moments = np.linalg.eigvalsh(0.5 * (body.inertia + body.inertia.T))
    scale = float(np.abs(body.inertia).max())
    if moments[0] < LEAST_INERTIA * scale or np.abs(body.inertia - body.inertia.T).max() > -LEAST_INERTIA * scale:
        refuse("its inertia is not that of a body, symmetric with moments above zero")
    if np.any(body.damping < 0.0):
        refuse("its damping is below zero")
    if body.basis is not None and not np.isfinite(body.basis).all():
        refuse("'basis' holds values that are not finite")
    for name, value in vars(body).items():
        if isinstance(value, np.ndarray) and np.abs(value).max(initial=0.0) > MOST:
            refuse(f"'{name}' holds values beyond {MOST:g}")
    for name, sign in (("gyroscopic", 1.0), ("centrifugal", -1.0), ("stress_stiffness", -1.0)):
        matrix = getattr(body, name)
        if np.abs(matrix + sign * matrix.T).max() > ROUNDING * np.abs(matrix).max():
            refuse(f"'{name}' is not {'anti' if sign > 0.0 else ''}symmetric")
    if not _rigid_terms_fit(body):
        refuse("its rigid modes do not belong to its mass, centre, inertia and places of interfaces")


def _rigid_terms_fit(body: ReducedBody) -> bool:
    """True if mass, centre, inertia, translation and rigid shapes agree with the six rigid modes.

    The modes are orthonormal with respect to mass. So unit motions F = R⁻¹ of the frame's origin have the rigid mass
    FᵀF, and a unit acceleration field does not excite elastic modes.
    """
    rigid = rigid_coordinates(body)
    if np.linalg.cond(rigid) > 1.0 / np.finfo(float).eps:
        return False
    motions = np.linalg.inv(rigid)
    mass = np.eye(6) * body.mass
    mass[:3, 3:], mass[3:, :3] = -body.mass * skew(body.centre), body.mass * skew(body.centre)
    mass[3:, 3:] = body.inertia
    size = np.sqrt(np.diag(motions.T @ motions))
    translation = np.zeros_like(body.translation)
    translation[:, :6] = motions[:, :3].T
    moved = rigid_motion(body.positions) @ rigid
    differences = (
        (motions.T @ motions - mass) / np.outer(size, size),
        (body.translation - translation) / size[:3, None],
        (body.shapes[:, :, :6] - moved) / np.abs(moved).max(axis=(0, 2))[:, None],
    )
    return all(np.abs(one).max() <= ROUNDING for one in differences)
