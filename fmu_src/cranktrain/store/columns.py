"""Columns of a result file, read in blocks because a file may be larger than the memory."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError, StoreError, nearest
from cranktrain.core.types import Array
from cranktrain.store.hdf5 import RESULT_FORMAT, RESULT_SCHEMA, opened
from cranktrain.store.sound_files import rising

REMEDY = "run 'cranktrain simulate' again"
BLOCK = 1 << 16
"""Number of time values that are read and checked at once."""


@dataclass(frozen=True)
class ResultColumns:
    """Columns over time in a result file, or in one group of it.

    Attributes
    ----------
    path, group : path of the file; group in a scene's file with several speeds, else empty
    units : name → unit, time and angle first
    rows : number of samples
    left_out : names of data that are not over time
    attributes : attributes of the file
    """

    path: Path
    group: str
    units: dict[str, str]
    rows: int
    left_out: tuple[str, ...]
    attributes: dict[str, Any]

    @classmethod
    def of(cls, path: str | Path, group: str = "") -> "ResultColumns":
        """Columns of a file; ``StoreError``: missing, damaged or of another kind; ``InputError``: no such group."""
        with opened(path, RESULT_FORMAT, RESULT_SCHEMA, REMEDY) as file:
            data = file["data"]
            # An empty name stands for the top of the file.
            groups = [""] if "time" in data else []
            data.visititems(
                lambda name, item: groups.append(name) if hasattr(item, "keys") and "time" in item else None
            )
            if not groups:
                raise InputError(f"{path}: holds no samples over time; give a file of simulate, run or runup")
            if group not in groups:
                named = ", ".join(name for name in groups if name) or "none"
                told = f"no group '{group}' over time; {nearest(group, groups)}" if group else f"groups: {named}"
                raise InputError(f"{path}: {told}; name one with --group")
            data = data[group] if group else data
            rows = data["time"].shape
            if len(rows) != 1 or not rows[0] or data["time"].dtype.kind not in "iuf" or not _rises(data["time"]):
                raise StoreError(f"{path}: its time is damaged; {REMEDY}")
            all_of = _arrays(data, [name.removeprefix(f"{group}/") for name in groups if name != group])
            names = ["time", "angle", *(name for name in all_of if name not in ("time", "angle"))]
            units = {n: str(all_of[n].attrs["unit"]) for n in names if n in all_of and all_of[n].shape == rows}
            attributes = {k.removeprefix("run."): v for k, v in file.attrs.items() if k.startswith("run.")}
        left = tuple(name for name in all_of if name not in units)
        return cls(Path(path), group, units, int(rows[0]), left, attributes)

    def blocks(self, names: Sequence[str], size: int) -> Iterator[Array]:
        """Iterate over blocks (k, names) of k ≤ ``size`` rows of the named columns; ``StoreError``: a damaged file."""
        with opened(self.path, RESULT_FORMAT, RESULT_SCHEMA, REMEDY) as file:
            data = file[f"data/{self.group}"] if self.group else file["data"]
            for first in range(0, self.rows, size):
                block = np.stack([data[name][first : first + size] for name in names], axis=1)
                yield np.asarray(block, dtype=np.float64)


def _rises(time: Any) -> bool:
    """True if times in a file are finite and increase."""
    last = -math.inf
    for first in range(0, time.size, BLOCK):
        block = time[first : first + BLOCK]
        if not rising(block, last):
            return False
        last = block[-1]
    return True


def _arrays(data: Any, others: Sequence[str]) -> dict[str, Any]:
    """Arrays with a unit in an HDF5 group and its subgroups, without subgroups ``others``, which have their own time.

    A run of coupled units has a subgroup for each unit.
    """
    found: dict[str, Any] = {}

    def visit(name: str, item: Any) -> None:
        if "unit" in item.attrs and not hasattr(item, "keys") and not any(name.startswith(f"{o}/") for o in others):
            found[name] = item

    data.visititems(visit)
    return found
