"""Reduced bodies in open formats: HDF5, NumPy's archive, or a folder of Matrix Market files.

A folder contains the body's equations in its modal coordinates: ``mass.mtx``, ``stiffness.mtx``, ``damping.mtx`` and
the terms of rotation, ``shapes.mtx`` of the interfaces (six rows per interface: x, y, z and rotations about them; one
column per mode), and ``body.json`` with names and scalars. All values are SI.
"""

import json
import shutil
import tempfile
import zipfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.io import mmwrite

from cranktrain.core.errors import InputError, StoreError
from cranktrain.core.reduced_body import SCHEMA, ReducedBody
from cranktrain.core.types import Array
from cranktrain.core.user_file import ending, file_exists, user_path
from cranktrain.store.hdf5 import BODY, BODY_FORMAT, BODY_UNITS, OWN_ARRAYS, body_of, load_body, save_body
from cranktrain.store.sound_files import DAMAGED, archive_arrays, check_body, json_of, matrix, real
from cranktrain.store.whole_file import check_place, marked, whole_file

HEADER = "cranktrain reduced body"
FOLDER_HEADER = "body.json"
SPARSE = ("mass", "stiffness", "damping")
"""Diagonal matrices in the folder of a reduced body, with one row and one column per mode."""
ARCHIVE = marked("reduced body of cranktrain", f"{HEADER}.npy")
REMEDY = "write it anew by 'cranktrain reduce ENGINE --output'"


def is_stored_body(path: str | Path) -> bool:
    """True if a path looks like a reduced body: ``.h5``, ``.npz``, or a folder with ``body.json``."""
    place = user_path(path)
    return ending(place) in (".h5", ".npz") or file_exists(place / FOLDER_HEADER)


def check_body_place(path: str | Path) -> None:
    """Raise ``InputError``, before any work, for a path at which no body may be written."""
    target = user_path(path)
    if ending(target) in ("", ".mtx"):
        _check_folder(target)
    elif ending(target) in (".h5", ".npz"):
        check_place(target, BODY if ending(target) == ".h5" else ARCHIVE)
    else:
        raise InputError(f"{path}: a reduced body is a .h5 or .npz file, or a folder; change the name")


def export_body(path: str | Path, body: ReducedBody) -> Path:
    """Write a body completely or not at all, in the format of the path's ending, for :func:`import_body`.

    Raises ``InputError`` for an unknown ending or a path that must not be replaced, ``StoreError`` if it cannot be
    written.
    """
    check_body_place(path)
    target = user_path(path)
    if ending(target) == ".h5":
        return save_body(target, body, kind=BODY)
    arrays = {name: getattr(body, name) for name in OWN_ARRAYS if getattr(body, name) is not None}
    arrays |= {f"record_{name}": array for name, array in sorted(body.records.items())}
    header = {
        "format": BODY_FORMAT, "schema": SCHEMA, "name": body.name, "digest": body.digest, "mass": body.mass,
        "interfaces": list(body.interfaces), "shafts": list(body.shafts), "quality": body.quality, "units": OWN_ARRAYS,
        "record_shapes": {name: array.shape for name, array in body.records.items()},
    }  # fmt: skip
    if ending(target) == ".npz":
        with whole_file(target, ARCHIVE) as temporary:
            write_archive(temporary, [(HEADER, np.array(json.dumps(header))), *arrays.items()])
        return target
    with _whole_folder(target) as folder:
        # Arrays of a body as matrices, with added modal mass, stiffness and damping matrices for other programs.
        # A vector is a column, and shapes (m, 6, n) are (6 m, n).
        found: dict[str, Any] = {
            name: np.asarray(array, dtype=np.float64).reshape(-1, array.shape[-1] if array.ndim > 1 else 1)
            for name, array in arrays.items() if array.size
        }  # fmt: skip
        del found["omega"]
        found["mass"] = sparse.eye_array(body.n_modes).tocoo()
        found["stiffness"] = sparse.diags_array(body.omega**2).tocoo()
        found["damping"] = sparse.diags_array(body.damping if body.damping.size else np.zeros(body.n_modes)).tocoo()
        for name, array in found.items():
            mmwrite(folder / f"{name}.mtx", array, comment=f" {name}, SI", precision=17, symmetry="general")
        (folder / FOLDER_HEADER).write_text(json.dumps(header, indent=1), encoding="utf-8")
    return target


def import_body(path: str | Path) -> ReducedBody:
    """Read a reduced body of :func:`export_body`; ``StoreError`` if missing, incomplete, foreign or outdated."""
    source = user_path(path)
    if ending(source) == ".h5":
        return load_body(source)
    try:
        if source.is_dir():
            header, arrays = _read_folder(source)
        else:
            arrays = archive_arrays(source)
            header = json_of(str(arrays.pop(HEADER)))
        if header["format"] != BODY_FORMAT:
            raise StoreError(f"{path}: not a {BODY_FORMAT}; {REMEDY}")
        if header["schema"] != SCHEMA:
            raise StoreError(f"{path}: schema {header['schema']}, this cranktrain reads schema {SCHEMA}; {REMEDY}")
        shapes = header["record_shapes"]
        records = {name: real(arrays.pop(f"record_{name}")).reshape(shape) for name, shape in shapes.items()}
        body = body_of(header, records, arrays)
    except FileNotFoundError as error:
        raise StoreError(f"{error.filename}: no such file; {REMEDY}") from None
    except DAMAGED:
        raise StoreError(f"{path}: damaged, incomplete, or no reduced body; {REMEDY}") from None
    try:
        check_body(body)
    except StoreError as error:
        raise StoreError(f"{path}: {error}") from None
    return body


def _read_folder(folder: Path) -> tuple[dict[str, Any], dict[str, Array]]:
    header = json_of((folder / FOLDER_HEADER).read_text(encoding="utf-8"))
    wanted = ["mass", "stiffness", *(name for name in BODY_UNITS if name != "omega"), "damping"]
    wanted += [f"record_{name}" for name, shape in header["record_shapes"].items() if 0 not in shape]
    wanted += [name for name in ("basis", "twists", "shaft_laws") if (folder / f"{name}.mtx").exists()]
    arrays: dict[str, Any] = {"shapes": matrix(folder / "shapes.mtx")}
    n = arrays["shapes"].shape[1]
    for name in wanted:
        if name != "shapes":
            arrays[name] = matrix(folder / f"{name}.mtx", (n, n) if name in SPARSE else None)
    arrays |= {f"record_{n}": np.zeros(shape) for n, shape in header["record_shapes"].items() if 0 in shape}
    stiffness = arrays.pop("stiffness")
    for found in (stiffness, arrays["damping"]):
        if np.any(found != np.diag(np.diag(found))):
            raise StoreError(f"{folder}: coordinates are not modal, stiffness or damping is not diagonal; {REMEDY}")
    if not np.array_equal(arrays.pop("mass"), np.eye(n)):
        raise StoreError(f"{folder}: mass.mtx is not the unit matrix, modes have modal mass 1 kg m2; {REMEDY}")
    arrays["omega"] = np.sqrt(np.diag(stiffness))
    damping = np.diag(arrays["damping"])
    arrays["damping"] = damping if damping.any() else np.zeros(0)
    arrays["shapes"] = arrays["shapes"].reshape(len(header["interfaces"]), 6, n)
    for name in ("centre", "centrifugal_load", "euler_load"):
        arrays[name] = arrays[name][:, 0]
    return header, arrays


def _check_folder(target: Path) -> None:
    """Raise ``InputError`` for a folder that contains anything but a reduced body."""
    check_place(target.absolute().parent / f"{target.name}.check")
    if target.is_symlink() or (target.exists() and not target.is_dir()):
        raise InputError(f"{target}: exists and is no folder; choose another name, or end it with .h5 or .npz")
    if not target.is_dir() or not any(target.iterdir()):
        return
    foreign = [one.name for one in target.iterdir() if one.suffix != ".mtx" and one.name != FOLDER_HEADER]
    try:
        ours = json_of((target / FOLDER_HEADER).read_text(encoding="utf-8"))["format"] == BODY_FORMAT
    except (OSError, ValueError, KeyError, TypeError):
        ours = False
    if foreign or not ours:
        raise InputError(f"{target}: exists and holds more than a reduced body; choose another name")


@contextmanager
def _whole_folder(target: Path) -> Iterator[Path]:
    """Temporary folder that replaces ``target`` at the end of the block; after an error the old folder stays."""
    try:
        target.absolute().parent.mkdir(parents=True, exist_ok=True)
        made = Path(tempfile.mkdtemp(prefix=".cranktrain-", dir=target.absolute().parent))
        try:
            new, old = made / "new", made / "old"
            new.mkdir()
            yield new
            _check_folder(target)
            if target.exists():
                target.rename(old)
            try:
                new.rename(target)
            except OSError:
                if old.exists():
                    old.rename(target)
                raise
        finally:
            shutil.rmtree(made, ignore_errors=True)
    except OSError as error:
        raise StoreError(f"{target}: cannot be written ({error.strerror or error}); choose another place") from None


def write_archive(path: Path, arrays: Iterable[tuple[str, NDArray[Any]]]) -> None:
    """Write named arrays in the format of ``numpy.load``, with equal bytes for equal content.

    Only one array need be in memory at a time.
    """
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays:
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as file:
                np.lib.format.write_array(file, np.asarray(array, order="C"), allow_pickle=False)
