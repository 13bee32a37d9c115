"""Arrays in HDF5 files of any program: names, units and rows, read in blocks.

MATLAB 7.3 files are HDF5 with transposed matrices; their texts and cells are left out.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.store.hdf5 import CUT_SHORT, File, cut_short
from cranktrain.store.sound_files import EXPANSION, FREE

MOST_COLUMNS = 256
UNIT_NAMES = ("unit", "units", "Unit", "Units", "UNIT", "y_unit", "unit_string")
STEP_NAMES = ("dt", "increment", "wf_increment", "step", "delta_t")
RATE_NAMES = ("fs", "rate", "sample_rate", "sampling_rate", "SampleRate")


class PlainArray(NamedTuple):
    """Array in an HDF5 file: name, unit, rows, columns, function that reads rows of one column, time step (s)."""

    name: str
    unit: str
    size: int
    columns: int
    read: Callable[[int, int, int], Array]
    step: float


def plain_arrays(path: Path) -> tuple[list[PlainArray], dict[str, float], list[str]]:
    """Numeric arrays of an HDF5 file, its single numbers by name, and remarks on data that were left out.

    Raises ``InputError`` for a damaged file, ``ValueError`` if an array states more than the file can hold.
    """
    try:
        file = File(path, "r")
    except OSError:
        told = CUT_SHORT if cut_short(path) else "not an HDF5 file, or a damaged one; export it again"
        raise InputError(f"{path.name}: {told}") from None
    found: list[PlainArray] = []
    scalars: dict[str, float] = {}
    remarks: list[str] = []
    most = EXPANSION * path.stat().st_size + FREE

    def visit(name: str, item: Any) -> None:
        scalars.update({f"{name}/{key}": value for key, value in _numbers(item).items()})
        if not hasattr(item, "shape"):
            return
        if item.shape is None or item.dtype.kind not in "biuf" or name.startswith("#") or "MATLAB_empty" in item.attrs:
            scale = item.attrs.get("CLASS") == b"DIMENSION_SCALE"
            if name.startswith("#") or scale:
                return
            remarks.append(f"{path.name}, channel {name}: holds no plain numbers and is left out")
            return
        if item.is_virtual or item.external:
            remarks.append(f"{path.name}, channel {name}: lies in another file and is left out")
            return
        if item.size * item.dtype.itemsize > most:
            raise ValueError(f"{name} states {item.size:.3g} values, more than the file can hold")
        if item.size == 1:
            scalars[name] = float(np.asarray(item[()]).ravel()[0])
            return
        shape = [n for n in item.shape if n != 1] or [item.size]
        if len(shape) > 2 or (min(shape) > MOST_COLUMNS and len(shape) == 2):
            remarks.append(f"{path.name}, channel {name}: is an array of {item.shape}, no signal, and left out")
            return
        found.append(_array(name, item, shape))

    scalars.update(_numbers(file))
    file.visititems(visit)
    return found, scalars, remarks


def _numbers(item: Any) -> dict[str, float]:
    """Attributes of a group or dataset that are single numbers, by name."""
    return {
        str(key): float(np.asarray(value).ravel()[0])
        for key, value in item.attrs.items()
        if isinstance(value, int | float | np.generic | np.ndarray)
        and np.asarray(value).size == 1
        and np.asarray(value).dtype.kind in "iuf"
    }


def _array(name: str, item: Any, shape: list[int]) -> PlainArray:
    """Description of an array; samples are counted along its longer side."""
    size, columns = max(shape), (min(shape) if len(shape) == 2 else 1)
    long = int(np.argmax(item.shape))
    wide = next((k for k, n in enumerate(item.shape) if k != long and n == columns and columns > 1), None)
    unit = next((item.attrs[key] for key in UNIT_NAMES if key in item.attrs), "")
    unit = unit.decode("utf-8", "replace") if isinstance(unit, bytes) else str(unit)
    held = _numbers(item)
    step = next((held[key] for key in STEP_NAMES if held.get(key, 0.0) > 0.0), math.nan)
    rate = next((held[key] for key in RATE_NAMES if held.get(key, 0.0) > 0.0), math.nan)

    def read(first: int, last: int, column: int) -> Array:
        place: list[Any] = [0] * len(item.shape)
        place[long] = slice(first, last)
        if wide is not None:
            place[wide] = column
        return np.asarray(item[tuple(place)], dtype=np.float64)

    return PlainArray(name, unit, size, columns, read, step if math.isfinite(step) else 1.0 / rate)
