"""Reader of Parquet by pyarrow, by row groups; units are in a field's metadata or in brackets after its name."""

from bisect import bisect_right
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.text_clock import DAY, Clocks, is_clock
from cranktrain.core.types import Array
from cranktrain_lab.measured.channels import Channel, last_kept
from cranktrain_lab.measured.formats.arrays import Named, as_channels, is_time
from cranktrain_lab.measured.formats.text import name_and_unit


def channels(path: Path) -> tuple[list[Channel], list[str]]:
    """List the numeric channels of a file, and remarks."""
    import pyarrow.parquet as pq
    import pyarrow.types as kinds

    file = pq.ParquetFile(str(path))
    size = int(file.metadata.num_rows)
    remarks: list[str] = []
    arrays: list[Named] = []
    # Columns are read by index, because names may occur twice.
    places: dict[str, list[int]] = {}
    seen: dict[str, int] = {}
    for k in range(len(file.schema)):
        places.setdefault(file.schema.column(k).path, []).append(k)
    times = _time_column(file)
    for field in file.schema_arrow:
        of_time = field.name == times
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
        if of_time:
            name, unit = "time", "s"
        elif times and is_time(name):
            name = f"column {name}"
        arrays.append(Named(name, unit, size, 1, _reader(file, leaf, of_time)))
    began = _began(file, times) if times else None
    arrays = [one._replace(began=began) for one in arrays]
    scalars = {}
    for key, value in (file.schema_arrow.metadata or {}).items():
        try:
            scalars[key.decode()] = float(value)
        except (UnicodeDecodeError, ValueError):
            continue
    found, told = as_channels(arrays, scalars, path.name)
    return found, remarks + told


def _time_column(file: Any) -> str:
    """Return the name of the first column of dates, times of day or durations (also as text), or empty."""
    import pyarrow.types as kinds

    names = [field.name for field in file.schema_arrow]
    of_time = [
        field.name
        for field in file.schema_arrow
        if (kinds.is_timestamp(field.type) or kinds.is_duration(field.type) or kinds.is_time(field.type))
        or ((kinds.is_string(field.type) or kinds.is_large_string(field.type)) and _is_clocks(file, field.name))
    ]
    of_time = [name for name in of_time if names.count(name) == 1]
    return next((name for name in of_time if is_time(name)), of_time[0] if of_time else "")


def _is_clocks(file: Any, name: str) -> bool:
    """True if the first texts of a column are times."""
    part = next(file.iter_batches(batch_size=8, columns=[name]), None)
    texts = [] if part is None else [text for text in part.column(0).to_pylist() if text is not None]
    return bool(texts) and all(is_clock(text) for text in texts)


def _began(file: Any, name: str) -> int | None:
    """Return the date of the first value of a column, ns since 1970 UTC; None without a date."""
    import pyarrow.types as kinds

    part = next(file.iter_batches(batch_size=1, columns=[name]), None)
    if part is None or not part.num_rows or part.column(0)[0].as_py() is None:
        return None
    if kinds.is_timestamp(part.column(0).type):
        return int(_nanoseconds(part.column(0))[0])
    clocks = Clocks()
    if not isinstance(part.column(0)[0].as_py(), str) or not np.isfinite(
        clocks.seconds(0, part.column(0).to_pylist())[0]
    ):
        return None
    return clocks.first[0] if clocks.dated else None


def _reader(file: Any, leaf: int, of_time: bool) -> Any:
    """Return a reader of a column's rows, which caches the last row group; dates are seconds after the first date."""
    counts = [file.metadata.row_group(k).num_rows for k in range(file.metadata.num_row_groups)]
    ends = np.concatenate(([0], np.cumsum(counts))).tolist()
    seconds = _Seconds()

    @last_kept
    def group(k: int) -> Array:
        values = file.reader.read_row_group(k, column_indices=[leaf]).column(0)
        if of_time:
            return seconds.of(values)
        return np.asarray(values.to_pandas().to_numpy(dtype=np.float64, na_value=np.nan))

    def read(first: int, last: int, _: int) -> Array:
        if of_time and seconds.zero is None:
            group(0)
        parts = []
        k = bisect_right(ends, first) - 1
        while first < last:
            take = min(last, ends[k + 1])
            parts.append(group(k)[first - ends[k] : take - ends[k]])
            first, k = take, k + 1
        return np.concatenate(parts) if parts else np.zeros(0)

    return read


class _Seconds:
    """Converter of dates, times of day, durations or their texts to seconds after the first value."""

    zero: int | None = None
    last: int | None = None
    days: int = 0

    def of(self, values: Any) -> Array:
        """Return seconds (n,) of a column, NaN for null."""
        if values.type in ("string", "large_string"):
            texts = Clocks()
            found = texts.seconds(0, values.to_pylist())
            first = texts.first.get(0, 0)
            self.zero = first if self.zero is None else self.zero
            return found + (first - self.zero) / 1e9
        import pyarrow.types as kinds

        whole = _nanoseconds(values)
        there = ~np.asarray(values.is_null())
        if kinds.is_time(values.type):
            own = whole[there]
            days = self.days + np.cumsum(np.diff(own, prepend=own[:1] if self.last is None else self.last) < -DAY // 2)
            if own.size:
                self.last, self.days = int(own[-1]), int(days[-1])
            whole[there] = own + days * DAY
        if self.zero is None and there.any():
            self.zero = int(whole[there][0])
        return np.where(there, (whole - (self.zero or 0)) / 1e9, np.nan)


def _nanoseconds(values: Any) -> np.ndarray:
    """Return dates, times of day or durations in ns, int64, 0 for null."""
    import pyarrow as pa

    size = {"s": 10**9, "ms": 10**6, "us": 10**3, "ns": 1}[values.type.unit]
    whole = values.cast(pa.int32()).cast(pa.int64()) if values.type.bit_width == 32 else values.cast(pa.int64())
    return np.array(whole.fill_null(0)) * size
