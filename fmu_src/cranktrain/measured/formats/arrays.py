"""Named arrays of a file as channels: which of them is the time, and which are matrices of columns."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.types import Array
from cranktrain.measured.channels import (
    MANY,
    Channel,
    Reader,
    long_time_base,
    of_array,
    rising_times,
    time_base,
    timed,
)

TIME_NAMES = ("time", "zeit", "t", "time_s", "timestamps", "timestamp", "x_time", "t_s")
RATE_NAMES = ("fs", "rate", "sample_rate", "sampling_rate", "samplerate", "samplingrate", "f_s", "fsample")
STEP_NAMES = ("dt", "delta_t", "step", "increment", "xincrement", "x_increment", "ts", "wf_increment")
TIME_UNITS = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0, "h": 3600.0, "ns": 1e-9}


class Named(NamedTuple):
    """An array of a file: name, unit, samples, columns, and how rows are read, (first, last) → (rows,) of a column."""

    name: str
    unit: str
    size: int
    columns: int
    read: Callable[[int, int, int], Array]
    step: float = math.nan


def as_channels(arrays: Sequence[Named], scalars: Mapping[str, float], source: str) -> tuple[list[Channel], list[str]]:
    """Channels of arrays, with the time array of the same length and group, or a stated rate."""
    remarks: list[str] = []
    found: list[Channel] = []
    bases = {(_group(one.name), one.size): one for one in arrays if one.columns == 1 and is_time(one.name)}
    lower = {name.rpartition("/")[2].lower(): value for name, value in scalars.items()}
    rate = next((lower[name] for name in RATE_NAMES if lower.get(name, 0.0) > 0.0), math.nan)
    stated = next((lower[name] for name in STEP_NAMES if lower.get(name, 0.0) > 0.0), 1.0 / rate)
    clocks = {key: _clock(base, source, remarks) for key, base in bases.items()}
    for one in arrays:
        if one in bases.values():
            continue
        key = (_group(one.name), one.size)
        alone = [known for known in bases if known[1] == one.size]
        clock = clocks.get(key) or (clocks[alone[0]] if len(alone) == 1 else None)
        start, step, places, order = clock or (0.0, one.step if math.isfinite(one.step) else stated, None, None)
        if places is None and not math.isfinite(step):
            step, over = 1.0, "sample"
            remarks.append(f"{source}, channel {one.name}: states no time and no rate; its samples are counted from 0")
        else:
            over = "time"
        for k in range(one.columns):
            name = one.name if one.columns == 1 else f"{one.name}:{k + 1}"
            size = one.size if order is None else order.size
            found.append(
                Channel(name, one.unit, size, source, _column(one, k, order), start,
                        math.nan if places is not None else step, places,
                        over, "s" if over == "time" else "1")
            )  # fmt: skip
    return found, remarks


def is_time(name: str) -> bool:
    """Whether a name is that of a time base."""
    return name.rpartition("/")[2].partition("[")[0].partition("(")[0].strip().lower() in TIME_NAMES


def _clock(
    base: Named, source: str, remarks: list[str]
) -> tuple[float, float, Reader | None, NDArray[np.int64] | None]:
    """Start, step, times where they are uneven, and their order where they are not sorted."""
    scale, where = TIME_UNITS.get(base.unit.strip().lower(), 1.0), f"{source}, channel {base.name}"

    def read(first: int, last: int) -> Array:
        return base.read(first, last, 0) * scale

    if base.size > MANY:
        if (even := long_time_base(read, base.size)) is not None:
            return *even, None, None
        if (told := rising_times(read, base.size, where)) is not None:
            remarks += told
            return float(read(0, 1)[0]), math.nan, read, None
    times = read(0, base.size)
    order, told = timed(times, where)
    remarks += told
    times = times if order is None else times[order]
    start, step, own, told = time_base(times, where)
    remarks += told
    if own is not None and own.size > 1 and np.any(np.diff(own) < 0.0):
        rising = np.argsort(own, kind="stable")
        order = rising if order is None else order[rising]
        own = own[rising]
        start = float(own[0])
    return start, step, None if own is None else of_array(own), order


def _group(name: str) -> str:
    return name.rpartition("/")[0]


def _column(one: Named, k: int, order: NDArray[np.int64] | None) -> Callable[[int, int], Array]:
    """Reader of one column; sorted by time where the file is not."""
    if order is None:
        return lambda first, last: one.read(first, last, k)
    held = one.read(0, one.size, k)[order]
    return lambda first, last: held[first:last]
