"""Reader of MATLAB files up to version 7 by scipy; version 7.3 is HDF5.

A numeric field of a structure is a channel named ``structure.field``. A field called ``unit`` gives the unit of the
other fields of the structure. Only one variable at a time is in memory, which the format limits to 2 GB, so a variable
is read again after samples of another one.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.types import Array
from cranktrain_lab.measured.channels import Channel, last_kept
from cranktrain_lab.measured.formats import hdf
from cranktrain_lab.measured.formats.arrays import Named, as_channels

HELD = 100_000
"""Largest number of values of an array that stays in memory."""


def channels(path: Path) -> tuple[list[Channel], list[str]]:
    """List the channels of a file, and remarks."""
    with path.open("rb") as file:
        if file.read(10) == b"MATLAB 7.3":
            return hdf.channels(path)
    from scipy.io import whosmat

    arrays: list[Named] = []
    scalars: dict[str, float] = {}
    remarks: list[str] = []
    again = last_kept(partial(_arrays, path, {}, []))
    for name, _, _ in whosmat(str(path)):
        for k, one in enumerate(_arrays(path, scalars, remarks, name)):
            large = one.size * one.columns > HELD
            arrays.append(one._replace(read=_later(again, name, k)) if large else one)
    found, told = as_channels(arrays, scalars, path.name)
    return found, remarks + told


def _arrays(path: Path, scalars: dict[str, float], remarks: list[str], name: str) -> list[Named]:
    """Return the arrays of one variable of a file, and add its single numbers and remarks."""
    from scipy.io import loadmat

    whole = loadmat(str(path), squeeze_me=True, struct_as_record=True, variable_names=[name])
    found: list[Named] = []
    _add(name, whole[name], "", (found, scalars, remarks), path.name)
    return found


def _later(again: Callable[[str], list[Named]], name: str, k: int) -> Callable[[int, int, int], Array]:
    """Return a reader of the k-th array of a variable, which loads it when needed."""
    return lambda first, last, column: again(name)[k].read(first, last, column)


def _add(name: str, value: Any, unit: str, into: tuple[list[Named], dict[str, float], list[str]], source: str) -> None:
    """Add a variable, or the fields of a structure, to ``into`` (arrays, scalars, remarks)."""
    arrays, scalars, remarks = into
    value = np.asarray(value)
    if value.dtype.names:
        for k, one in enumerate(np.atleast_1d(value)):
            begin = name if value.ndim == 0 else f"{name}({k + 1})"
            own = {key: np.asarray(one[key]) for key in value.dtype.names}
            said = next((str(own[key]) for key in own if key.lower() in ("unit", "units")), "")
            for key, held in own.items():
                if held.dtype.kind not in "US":
                    _add(f"{begin}/{key}", held[()], said, into, source)
        return
    if value.dtype == object and value.size == 1 and value.ndim:
        _add(name, value.ravel()[0], unit, into, source)
        return
    if value.dtype.kind not in "biuf":
        if value.dtype.kind not in "US" or value.size > 1:
            remarks.append(f"{source}, channel {name}: holds no plain numbers and is left out")
        return
    if value.size == 1:
        scalars[name] = float(value.ravel()[0])
        return
    if not value.size:
        remarks.append(f"{source}, channel {name}: is empty and left out")
        return
    if value.ndim > 2:
        remarks.append(f"{source}, channel {name}: is an array of {value.shape}, no signal, and left out")
        return
    columns = value if value.ndim == 2 else value[:, None]
    columns = columns.T if columns.shape[1] > columns.shape[0] else columns
    arrays.append(Named(name, unit, columns.shape[0], columns.shape[1], _reader(columns)))


def _reader(columns: np.ndarray) -> Any:
    return lambda first, last, k: np.asarray(columns[first:last, k], dtype=np.float64)
