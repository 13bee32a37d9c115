"""HDF5 files of reduced bodies, film tables and results, with units, schema version and digest of the inputs.

A file is written completely or not at all. A file that is corrupt, foreign, of another schema or made from other inputs
is refused. A checksum stands behind the end of the HDF5 data, because a damaged file may crash the HDF5 library or make
it loop for ever. Other programs ignore the checksum. A program that changes the file removes the checksum; a file
without checksum is read without a check.
"""

import io
import sys
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import StoreError
from cranktrain.core.reduced_body import SCHEMA, ReducedBody
from cranktrain.core.user_file import check_file, file_exists
from cranktrain.store.axes import Labels, attach_axes, of_result, of_run_up
from cranktrain.store.sound_files import DAMAGED, check_body, check_tree, real
from cranktrain.store.whole_file import Kind, whole_file

File = h5py.File
Dataset = tuple[NDArray[Any], str]

BODY_FORMAT = "cranktrain reduced body"
RESULT_FORMAT = "cranktrain result"
RESULT_SCHEMA = 1
RESULT_HEADER = {"format": RESULT_FORMAT, "schema": RESULT_SCHEMA}
RUN_UP_FORMAT = "cranktrain run-up"
RUN_UP_SCHEMA = 1
TABLE_FORMAT = "cranktrain film table"
WEAR_FORMAT, WEAR_SCHEMA = "cranktrain wear history", 1
WEAR_REMEDY = "delete it, or name another file, and run 'cranktrain run-in' again"
SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""First bytes of an HDF5 file."""
SUPERBLOCK = 48
"""Number of bytes at the start of an HDF5 file that include its length."""
LARGE_ROW = 65536
"""Size of an array's row, bytes, from which each row becomes a separate HDF5 chunk."""
CUT_SHORT = "damaged, an HDF5 file that was cut short and cannot be read; copy it again from a complete one"
PART_FORMAT = "cranktrain film table, unfinished"

BODY_UNITS = {
    "omega": "rad/s",
    "positions": "m",
    "shapes": "m/(m kg^0.5), rad/(m kg^0.5)",
    "gyroscopic": "1",
    "centrifugal": "1",
    "stress_stiffness": "1",
    "centrifugal_load": "m kg^0.5",
    "euler_load": "m kg^0.5",
    "translation": "kg^0.5",
    "centre": "m",
    "inertia": "kg m^2",
}
"""Units of the arrays that every reduced body has, by name."""
OWN_ARRAYS = {**BODY_UNITS, "basis": "1", "damping": "1/s", "twists": "rad", "shaft_laws": "SI"}
"""Units of all arrays of a reduced body; a body may lack the last four."""


def save_body(
    path: str | Path, body: ReducedBody, extras: Mapping[str, Dataset] | None = None, kind: Kind | None = None
) -> Path:
    """Write a reduced body; ``extras`` are further arrays with units (surface geometry for pictures).

    ``kind`` is the kind of files that it may replace; None allows any file, for our own folders. Equal content gives
    equal bytes.
    """
    with written(path, kind) as file:
        file.attrs.update({"format": BODY_FORMAT, "schema": SCHEMA, "digest": body.digest, "name": body.name})
        file.attrs["interfaces"] = list(body.interfaces)
        file.attrs["mass"] = body.mass
        for name, unit in OWN_ARRAYS.items():
            array = getattr(body, name)
            if name in BODY_UNITS or (array is not None and array.size):
                put(file, f"body/{name}", array, unit)
        if body.shafts:
            file.attrs["shafts"] = list(body.shafts)
        for name in sorted(body.quality):
            put(file, f"quality/{name}", np.asarray(body.quality[name]), "")
        for name in sorted(body.records):
            put(file, f"records/{name}", body.records[name], "SI")
        for name, (array, unit) in sorted((extras or {}).items()):
            put(file, f"extras/{name}", array, unit)
    return Path(path)


def load_body(path: str | Path, digest: str | None = None) -> ReducedBody:
    """Read a reduced body from an HDF5 file.

    Raises ``StoreError`` if it is missing, corrupt, foreign, of another schema, or made from other inputs. ``digest``:
    required digest of the inputs from which the body was made; None allows any.
    """
    with opened(path, BODY_FORMAT, SCHEMA, "delete it and run 'cranktrain reduce'") as file:
        found = str(file.attrs["digest"])
        if digest is not None and found != digest:
            raise StoreError(
                f"{path}: made from other inputs (digest {found[:12]}, wanted {digest[:12]}); "
                "delete it and run 'cranktrain reduce'"
            )
        quality, records, arrays = (
            {name: item[()] for name, item in file.get(group, {}).items()} for group in ("quality", "records", "body")
        )
        body = body_of({**file.attrs, "quality": quality}, records, arrays)
    try:
        check_body(body)
    except StoreError as error:
        raise StoreError(f"{path}: {error}; delete it and run 'cranktrain reduce'") from None
    return body


def body_of(header: Mapping[str, Any], records: Mapping[str, Any], arrays: Mapping[str, Any]) -> ReducedBody:
    """Reduced body from its names and scalars, its records, and its own arrays; ``KeyError`` if one is missing."""
    return ReducedBody(
        name=str(header["name"]),
        interfaces=tuple(str(name) for name in header["interfaces"]),
        mass=float(header["mass"]),
        digest=str(header["digest"]),
        quality={str(name): float(value) for name, value in header["quality"].items()},
        records={name: real(array) for name, array in records.items()},
        shafts=tuple(str(name) for name in header.get("shafts", ())),
        **{name: real(arrays[name]) for name in OWN_ARRAYS if name in BODY_UNITS or name in arrays},
    )


def load_extras(path: str | Path) -> dict[str, NDArray[Any]]:
    """Further arrays stored in a reduced body's file, by name; ``StoreError`` as in :func:`load_body`."""
    with opened(path, BODY_FORMAT, SCHEMA, "delete it and run 'cranktrain reduce'") as file:
        return {name: file[f"extras/{name}"][()] for name in file.get("extras", {})}


def write_result(
    path: str | Path, datasets: Mapping[str, Dataset], attributes: Mapping[str, str | int | float] | None = None
) -> Path:
    """Write a simulation result.

    Parameters
    ----------
    datasets : name → (array, unit); a name may hold ``/`` for groups
    attributes : description of the run (engine, speed in rad/s, integrator …)
    """
    return write_data(
        path, RESULT_HEADER, "run", datasets, attributes or {}, RESULT, partial(attach_axes, axes=of_result)
    )


def read_result(path: str | Path) -> tuple[dict[str, Dataset], dict[str, Any]]:
    """Read a simulation result: (name → (array, unit), attributes); ``StoreError`` as :func:`load_body`."""
    with opened(path, RESULT_FORMAT, RESULT_SCHEMA, "run 'cranktrain simulate' again") as file:
        return read_data(file, "run")


def write_run_up(
    path: str | Path,
    datasets: Mapping[str, Dataset],
    attributes: Mapping[str, str | int | float],
    labels: Labels | None = None,
) -> Path:
    """Write orders over speed: ``datasets`` with units, attributes, and ``labels`` along axes for other readers."""
    header = {"format": RUN_UP_FORMAT, "schema": RUN_UP_SCHEMA}
    return write_data(
        path, header, "run", datasets, attributes, RUN_UP, partial(attach_axes, axes=of_run_up, labels=labels)
    )


def read_run_up(path: str | Path) -> tuple[dict[str, Dataset], dict[str, Any]]:
    """Read orders over speed: (name → (array, unit), attributes); ``StoreError`` as :func:`load_body`."""
    with opened(path, RUN_UP_FORMAT, RUN_UP_SCHEMA, "delete it and run 'cranktrain runup' again") as file:
        return read_data(file, "run")


def write_wear(path: str | Path, datasets: Mapping[str, Dataset], attributes: Mapping[str, str | int | float]) -> Path:
    """Write a wear history: ``datasets`` with units, and attributes; replaces only a file of this kind."""
    return write_data(path, {"format": WEAR_FORMAT, "schema": WEAR_SCHEMA}, "run", datasets, attributes, WEAR)


def read_wear(path: str | Path) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Read a wear history: (name → array, attributes); ``StoreError`` as :func:`load_body`."""
    with opened(path, WEAR_FORMAT, WEAR_SCHEMA, WEAR_REMEDY) as file:
        datasets, attributes = read_data(file, "run")
    return {name: array for name, (array, _) in datasets.items()}, attributes


def is_run_up(path: str | Path) -> bool:
    """True if an HDF5 file is a run-up; False for other or damaged files."""
    try:
        return RUN_UP.includes(Path(path))
    except OSError:
        return False


def write_data(
    path: str | Path,
    header: Mapping[str, Any],
    prefix: str,
    datasets: Mapping[str, Dataset],
    attributes: Mapping[str, Any],
    kind: Kind | None,
    attach: Callable[[h5py.Group], None] | None = None,
) -> Path:
    """Write a header, attributes with a prefix, and datasets in the group ``data``."""
    with written(path, kind) as file:
        file.attrs.update(header)
        put_attributes(file, prefix, attributes)
        for name, (array, unit) in datasets.items():
            put(file, f"data/{name}", array, unit)
        if attach is not None and "data" in file:
            attach(file["data"])
            file["data"].attrs.update(attributes)
    return Path(path)


def put_attributes(file: h5py.File, prefix: str, attributes: Mapping[str, Any]) -> None:
    """Write attributes of an HDF5 file, each name with a prefix."""
    for key, value in sorted(attributes.items()):
        file.attrs[f"{prefix}.{key}"] = value


def read_data(file: h5py.File, prefix: str, may_be_empty: bool = False) -> tuple[dict[str, Dataset], dict[str, Any]]:
    """Datasets with units, and attributes, from a file written by :func:`write_data`."""
    datasets: dict[str, Dataset] = {}

    def visit(name: str, item: h5py.Dataset | h5py.Group) -> None:
        if isinstance(item, h5py.Dataset) and "unit" in item.attrs:
            datasets[name] = (item[()], str(item.attrs["unit"]))

    if "data" in file or not may_be_empty:
        file["data"].visititems(visit)
    # NumPy numbers become Python numbers.
    plain = {key: value.item() if isinstance(value, np.generic) else value for key, value in file.attrs.items()}
    return datasets, {key.removeprefix(f"{prefix}."): value for key, value in plain.items() if "." in key}


def put(file: h5py.File, name: str, array: Any, unit: str) -> None:
    """Write one dataset with its unit and a checksum."""
    array = np.asarray(array)
    # A checksum is stored because without it HDF5 detects a file that was cut short, but no changed values.
    # Large arrays get one chunk per row. Default chunks extend beyond the array and waste a sixth of a film table.
    in_rows = array.ndim > 2 and array.nbytes >= LARGE_ROW * max(1, len(array))
    chunks = (1, *array.shape[1:]) if in_rows else None
    checked = array.size > 1 or None
    dataset = file.create_dataset(name, data=array, chunks=chunks, track_times=False, fletcher32=checked)
    put_unit(dataset, unit)


def put_unit(dataset: h5py.Dataset, unit: str) -> None:
    """Set the unit of a dataset under two attribute names: that of this program and that of netCDF's conventions."""
    dataset.attrs["unit"] = dataset.attrs["units"] = unit


@contextmanager
def written(path: str | Path, kind: Kind | None = None) -> Iterator[h5py.File]:
    """HDF5 file that replaces ``path`` once it is complete; raises the errors of :func:`whole_file`."""
    with whole_file(path, kind) as temporary, _FullDiskFile(temporary, "r+b") as disk:
        try:
            with h5py.File(disk, "w", rdcc_nbytes=0) as file:
                yield file
        finally:
            if disk.error is not None:
                raise disk.error
        seal(temporary)


class _FullDiskFile(io.FileIO):
    """File that stores the first disk error instead of raising it, because HDF5 crashes if closing a file fails.

    After an error nothing more is written, although every write reports success; the file is then useless.
    """

    error: OSError | None = None

    def write(self, data: Any) -> int:
        """Write all of ``data``. Store a disk error instead of raising it."""
        left = memoryview(data).cast("B")
        size = left.nbytes
        try:
            while self.error is None and left.nbytes:
                left = left[super().write(left) or 0 :]
        except OSError as error:
            self.error = error
        return size

    def truncate(self, size: int | None = None) -> int:
        """Set the file's size. Store a disk error instead of raising it."""
        try:
            if self.error is None:
                super().truncate(size)
        except OSError as error:
            self.error = error
        return self.tell() if size is None else size


def cut_short(path: str | Path) -> bool:
    """True if a file begins like HDF5 but is shorter than its header states."""
    if not file_exists(path):
        return False
    try:
        check_seal(Path(path))
        h5py.File(path, "r").close()
    except OSError as error:
        if "truncated file" in str(error):
            return True
    else:
        return False
    with suppress(OSError), Path(path).open("rb") as file:
        begin = file.read(SUPERBLOCK)
        return 0 < len(begin) < SUPERBLOCK and SIGNATURE.startswith(begin[: len(SIGNATURE)])
    return False


def kind_of(mark: str) -> Kind:
    """File kind of HDF5 files whose attribute ``format`` is ``mark``."""

    def includes(path: Path) -> bool:
        check_seal(path)
        try:
            with h5py.File(path, "r") as file:
                return str(file.attrs.get("format", "")) == mark
        except DAMAGED:
            return False

    return Kind(f"{mark} file", includes)


RESULT = kind_of(RESULT_FORMAT)
RUN_UP = kind_of(RUN_UP_FORMAT)
BODY = kind_of(BODY_FORMAT)
WEAR = kind_of(WEAR_FORMAT)
TABLE, PART = kind_of(TABLE_FORMAT), kind_of(PART_FORMAT)


@contextmanager
def opened(path: str | Path, kind: str, schema: int, remedy: str) -> Iterator[h5py.File]:
    """Open a file of a given kind and schema for reading; otherwise ``StoreError`` with the remedy."""
    check_file(path, f"{path}", remedy, most=sys.maxsize)
    if not file_exists(path):
        raise StoreError(f"{path}: no such file; {remedy}")
    try:
        check_seal(Path(path))
        file = h5py.File(path, "r")
    except (OSError, RuntimeError):
        if cut_short(path):
            raise StoreError(f"{path}: {CUT_SHORT}, or {remedy}") from None
        raise StoreError(f"{path}: not an HDF5 file, or a damaged one; {remedy}") from None
    with file:
        try:
            if str(file.attrs.get("format", "")) != kind:
                raise StoreError(f"{path}: not a {kind}; {remedy}")
            found = int(file.attrs.get("schema", -1))
            if found != schema:
                raise StoreError(f"{path}: schema {found}, this cranktrain reads schema {schema}; {remedy}")
            check_tree(file, Path(path).stat().st_size)
            yield file
        except DAMAGED:
            raise StoreError(f"{path}: damaged or incomplete; {remedy}") from None


MARK = b"\ncranktrain checksum "
SIZE = len(MARK) + 9
"""Size of a seal, bytes: a mark, the CRC-32 of the file before the seal (8 hexadecimal digits), and a newline."""
BLOCK = 1 << 20


def seal(path: Path) -> None:
    """Append the seal, which contains the file's checksum, to a file."""
    with path.open("r+b") as file:
        size = file.seek(0, 2)
        checksum = _checksum(file, size)
        file.seek(size)
        file.write(MARK + b"%08x\n" % checksum)


def check_seal(path: Path) -> None:
    """Raise ``OSError`` if a sealed file does not match its checksum."""
    with path.open("rb") as file:
        size = file.seek(0, 2) - SIZE
        if size < 0:
            return
        file.seek(size)
        found = file.read()
        if found.startswith(MARK) and found != MARK + b"%08x\n" % _checksum(file, size):
            raise OSError("checksum of the file does not match its content")


def _checksum(file: BinaryIO, size: int) -> int:
    """CRC-32 of the first ``size`` bytes of a file."""
    file.seek(0)
    checksum = 0
    while size > 0 and (block := file.read(min(size, BLOCK))):
        checksum, size = zlib.crc32(block, checksum), size - len(block)
    return checksum
