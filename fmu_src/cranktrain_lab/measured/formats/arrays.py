"""Conversion of named arrays of a file to channels, with search for time arrays and sampling rates."""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.types import Array
from cranktrain_lab.measured.channels import (
    MANY,
    Channel,
    Reader,
    long_time_base,
    rising_base,
    rising_times,
)
from cranktrain_lab.measured.counters import second_of

TIME_NAMES = ("time", "zeit", "t", "time_s", "timestamps", "timestamp", "x_time", "t_s")
RATE_NAMES = ("fs", "rate", "sample_rate", "sampling_rate", "samplerate", "samplingrate", "f_s", "fsample")
STEP_NAMES = ("dt", "delta_t", "step", "increment", "xincrement", "x_increment", "ts", "wf_increment")
START_NAMES = (
    "t0", "start", "start_time", "t_start", "tstart", "x0", "xstart", "x_start", "wf_start_offset", "offset_s",
)  # fmt: skip
TIME_UNITS = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0, "h": 3600.0, "ns": 1e-9}


class Named(NamedTuple):
    """Array of a file: name, unit, samples, columns, and reader (first, last, column) → (rows,)."""

    name: str
    unit: str
    size: int
    columns: int
    read: Callable[[int, int, int], Array]
    step: float = math.nan
    start: float = 0.0
    began: int | None = None


def as_channels(arrays: Sequence[Named], scalars: Mapping[str, float], source: str) -> tuple[list[Channel], list[str]]:
    """Return channels of arrays, each with the time array or stated rate that belongs to it.

    Candidates in order are the time array of equal length in its group, the step of the array itself, the rate or step
    of its group, the only time array of equal length in the file, and the rate or step of enclosing groups. ``scalars``
    are single numbers by ``group/name``. A time array that belongs to no channel counts as times of pulses.
    """
    remarks: list[str] = []
    found: list[Channel] = []
    bases = {(_group(one.name), one.size): one for one in arrays if one.columns == 1 and is_time(one.name)}
    sizes = Counter(one.size for one in arrays if one not in bases.values())
    bases = {key: one for key, one in bases.items() if sizes[one.size]}
    clocks = {key: _clock(base, source, remarks) for key, base in bases.items()}
    for one in arrays:
        if one in bases.values():
            continue
        group = _group(one.name)
        alone = [known for known in bases if known[1] == one.size]
        own = one.step if math.isfinite(one.step) else _step(group, scalars)
        clock = clocks.get((group, one.size))
        if clock is None and not math.isfinite(own):
            clock = clocks[alone[0]] if len(alone) == 1 else None
            parts = group.split("/") if group else []
            above = ("/".join(parts[:k]) for k in reversed(range(len(parts))))  # enclosing groups, the nearest first
            own = next((step for one_above in above if math.isfinite(step := _step(one_above, scalars))), math.nan)
        start, step, places, order = clock or (_start(one, scalars), own, None, None)
        over = "time"
        if places is None and not math.isfinite(step):
            start, step, over = 0.0, 1.0, "sample"
            if not (one.columns == 1 and second_of(one.unit)):
                told = "states no time and no rate; its samples are counted from 0"
                remarks.append(f"{source}, channel {one.name}: {told}")
        for k in range(one.columns):
            name = one.name if one.columns == 1 else f"{one.name}:{k + 1}"
            size = one.size if order is None else order.size
            found.append(
                Channel(name, one.unit, size, source, _column(one, k, order), start,
                        math.nan if places is not None else step, places,
                        over, "s" if over == "time" else "1", began=one.began)
            )  # fmt: skip
    return found, remarks


def _step(group: str, scalars: Mapping[str, float]) -> float:
    """Return the step, s, from the single numbers of a group; NaN if there is none."""
    own = {name.rpartition("/")[2].lower(): value for name, value in scalars.items() if _group(name) == group}
    step = next((own[name] for name in STEP_NAMES if own.get(name, 0.0) > 0.0), math.nan)
    rate = next((own[name] for name in RATE_NAMES if own.get(name, 0.0) > 0.0), math.nan)
    return step if math.isfinite(step) else 1.0 / rate


def _start(one: Named, scalars: Mapping[str, float]) -> float:
    """Return the time (s) of an array's first sample, from single numbers of its group, else the array's own start."""
    groups = (one.name, _group(one.name))
    own = {name.rpartition("/")[2].lower(): value for name, value in scalars.items() if _group(name) in groups}
    return next((own[name] for name in START_NAMES if math.isfinite(own.get(name, math.nan))), one.start)


def is_time(name: str) -> bool:
    """True if the name is that of a time base."""
    return name.rpartition("/")[2].partition("[")[0].partition("(")[0].strip().lower() in TIME_NAMES


def _clock(
    base: Named, source: str, remarks: list[str]
) -> tuple[float, float, Reader | None, NDArray[np.int64] | None]:
    """Return start, step, a reader of the times if uneven, and the sorting order if unsorted, of a time array."""
    scale, where = TIME_UNITS.get(base.unit.strip().lower(), 1.0), f"{source}, channel {base.name}"

    def read(first: int, last: int) -> Array:
        return base.read(first, last, 0) * scale

    if base.size > MANY:
        if (even := long_time_base(read, base.size)) is not None:
            return *even, None, None
        if (told := rising_times(read, base.size, where)) is not None:
            remarks += told
            return float(read(0, 1)[0]), math.nan, read, None
    start, step, places, order, told = rising_base(read(0, base.size), where)
    remarks += told
    return start, step, places, order


def _group(name: str) -> str:
    return name.rpartition("/")[0]


def _column(one: Named, k: int, order: NDArray[np.int64] | None) -> Callable[[int, int], Array]:
    """Return the reader of one column, with rows in ``order`` if given."""
    if order is None:
        return lambda first, last: one.read(first, last, k)
    held = one.read(0, one.size, k)[order]
    return lambda first, last: held[first:last]
