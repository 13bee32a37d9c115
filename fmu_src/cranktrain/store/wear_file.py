"""HDF5 files of wear histories, rewritten after each increment of wear; a file of another history is refused."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.store.hdf5 import kind_of, opened, put, put_attributes, written

FORMAT, SCHEMA = "cranktrain wear history", 1
WEAR = kind_of(FORMAT)
REMEDY = "delete it, or name another file, and run 'cranktrain run-in' again"


def write_wear(
    path: str | Path, datasets: Mapping[str, tuple[NDArray[Any], str]], attributes: Mapping[str, str | int | float]
) -> Path:
    """Write named arrays with units, and attributes; replaces only a file of this kind, otherwise ``InputError``."""
    with written(path, WEAR) as file:
        file.attrs.update({"format": FORMAT, "schema": SCHEMA})
        put_attributes(file, "run", attributes)
        for name, (array, unit) in datasets.items():
            put(file, f"data/{name}", array, unit)
    return Path(path)


def read_wear(path: str | Path) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Arrays and attributes from a file of :func:`write_wear`; ``StoreError`` for another or a damaged file."""
    with opened(path, FORMAT, SCHEMA, REMEDY) as file:
        data = {name: np.asarray(dataset[()]) for name, dataset in file["data"].items()}
        named = {key.removeprefix("run."): value for key, value in file.attrs.items() if key.startswith("run.")}
        return data, {key: value.item() if isinstance(value, np.generic) else value for key, value in named.items()}
