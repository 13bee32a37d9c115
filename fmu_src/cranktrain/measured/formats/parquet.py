"""Parquet by pyarrow, row group by row group; units stand in a field's metadata or in brackets behind its name."""

from __future__ import annotations

from bisect import bisect_right
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.types import Array
from cranktrain.measured.channels import Channel
from cranktrain.measured.formats.arrays import Named, as_channels, is_time
from cranktrain.measured.formats.text import name_and_unit


def channels(path: Path) -> tuple[list[Channel], list[str]]:
    """List the channels of numbers of a file, and remarks."""
    import pyarrow.parquet as pq
    import pyarrow.types as kinds

    file = pq.ParquetFile(str(path))
    size = int(file.metadata.num_rows)
    remarks: list[str] = []
    arrays: list[Named] = []
    # Columns are read by their place: names may stand there twice.
    places: dict[str, list[int]] = {}
    seen: dict[str, int] = {}
    for k in range(len(file.schema)):
        places.setdefault(file.schema.column(k).path, []).append(k)
    for field in file.schema_arrow:
        of_time = is_time(field.name) and (kinds.is_timestamp(field.type) or kinds.is_duration(field.type))
        number = kinds.is_integer(field.type) or kinds.is_floating(field.type) or kinds.is_decimal(field.type)
        if not (number or kinds.is_boolean(field.type) or of_time):
            remarks.append(f"{path.name}, channel {field.name}: holds no plain numbers and is left out")
            continue
        held = {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}
        name, unit = name_and_unit(field.name)
        unit = next((held[key] for key in ("unit", "units") if key in held), unit)
        if not size:
            remarks.append(f"{path.name}, channel {name}: is empty and left out")
            continue
        leaf = leaves[seen.get(field.name, 0)] if len(leaves := places.get(field.name, [])) > 1 else leaves[0]
        seen[field.name] = seen.get(field.name, 0) + 1
        arrays.append(Named(name, "s" if of_time else unit, size, 1, _reader(file, leaf, of_time)))
    scalars = {}
    for key, value in (file.schema_arrow.metadata or {}).items():
        try:
            scalars[key.decode()] = float(value)
        except (UnicodeDecodeError, ValueError):
            continue
    found, told = as_channels(arrays, scalars, path.name)
    return found, remarks + told


def _reader(file: Any, leaf: int, of_time: bool) -> Any:
    """Read rows of a column; the row group read last is kept. Dates are seconds from the first one on."""
    counts = [file.metadata.row_group(k).num_rows for k in range(file.metadata.num_row_groups)]
    ends = np.concatenate(([0], np.cumsum(counts))).tolist()
    last_read: dict[int, Array] = {}
    begin: list[float] = []

    def group(k: int) -> Array:
        if k not in last_read:
            last_read.clear()
            values = file.reader.read_row_group(k, column_indices=[leaf]).column(0)
            last_read[k] = _seconds(values) if of_time else _floats(values)
        return last_read[k]

    def read(first: int, last: int, _: int) -> Array:
        if of_time and not begin:
            begin.append(float(group(0)[0]))
        parts = []
        k = bisect_right(ends, first) - 1
        while first < last:
            take = min(last, ends[k + 1])
            parts.append(group(k)[first - ends[k] : take - ends[k]])
            first, k = take, k + 1
        found = np.concatenate(parts) if parts else np.zeros(0)
        return found - begin[0] if of_time else found

    return read


def _floats(values: Any) -> Array:
    """Values of a column as float64; null is not a number."""
    return np.asarray(values.to_pandas().to_numpy(dtype=np.float64, na_value=np.nan))


def _seconds(values: Any) -> Array:
    """Dates or durations in s."""
    import pyarrow as pa

    per = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}[values.type.unit]
    return _floats(values.cast(pa.int64())) / per
