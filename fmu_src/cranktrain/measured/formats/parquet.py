"""Parquet by pyarrow, row group by row group; units stand in a field's metadata or in brackets behind its name."""

from __future__ import annotations

from bisect import bisect_right
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.types import Array
from cranktrain.measured.channels import Channel
from cranktrain.measured.formats.arrays import Named, as_channels
from cranktrain.measured.formats.text import name_and_unit


def channels(path: Path) -> tuple[list[Channel], list[str]]:
    """List the channels of numbers of a file, and remarks."""
    import pyarrow.parquet as pq
    import pyarrow.types as kinds

    file = pq.ParquetFile(str(path))
    size = int(file.metadata.num_rows)
    remarks: list[str] = []
    arrays: list[Named] = []
    for field in file.schema_arrow:
        if not (kinds.is_integer(field.type) or kinds.is_floating(field.type) or kinds.is_boolean(field.type)):
            remarks.append(f"{path.name}, channel {field.name}: holds no plain numbers and is left out")
            continue
        held = {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}
        name, unit = name_and_unit(field.name)
        unit = next((held[key] for key in ("unit", "units") if key in held), unit)
        if not size:
            remarks.append(f"{path.name}, channel {name}: is empty and left out")
            continue
        arrays.append(Named(name, unit, size, 1, _reader(file, field.name)))
    scalars = {}
    for key, value in (file.schema_arrow.metadata or {}).items():
        try:
            scalars[key.decode()] = float(value)
        except (UnicodeDecodeError, ValueError):
            continue
    found, told = as_channels(arrays, scalars, path.name)
    return found, remarks + told


def _reader(file: Any, column: str) -> Any:
    """Read rows of a column; the row group read last is kept."""
    counts = [file.metadata.row_group(k).num_rows for k in range(file.metadata.num_row_groups)]
    ends = np.concatenate(([0], np.cumsum(counts))).tolist()
    last_read: dict[int, Array] = {}

    def group(k: int) -> Array:
        if k not in last_read:
            last_read.clear()
            values = file.read_row_group(k, columns=[column])[column]
            last_read[k] = values.to_pandas().to_numpy(dtype=np.float64, na_value=np.nan)
        return last_read[k]

    def read(first: int, last: int, _: int) -> Array:
        parts = []
        k = bisect_right(ends, first) - 1
        while first < last:
            take = min(last, ends[k + 1])
            parts.append(group(k)[first - ends[k] : take - ends[k]])
            first, k = take, k + 1
        return np.concatenate(parts) if parts else np.zeros(0)

    return read
