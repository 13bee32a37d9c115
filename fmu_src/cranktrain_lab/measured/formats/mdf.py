"""Reader of ASAM MDF 3 and 4 by asammdf.

asammdf reads a channel of a large group as a whole, even if only a part is needed. The samples of one channel at a time
are therefore kept in memory, in the type of the file: 0.4 GB for 10⁸ samples of 32 bits.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain_lab.measured.channels import MANY, Channel, last_kept, long_time_base, sampled, time_base


def channels(path: Path) -> tuple[list[Channel], list[str]]:
    """List the numeric channels of a file, and remarks."""
    from asammdf import MDF

    file = MDF(str(path))
    found: list[Channel] = []
    remarks: list[str] = []
    samples = last_kept(partial(_samples, file))
    groups: Any = file.groups
    began = _instant(file)
    for group, entry in enumerate(groups):
        size = int(entry.channel_group.cycles_nr)
        master = file.masters_db.get(group)
        about = str(getattr(entry.channel_group, "acq_name", "") or "")
        for index, channel in enumerate(entry.channels):
            if index == master:
                continue
            name, conversion = str(channel.name), getattr(channel, "conversion", None)
            unit = str(channel.unit or getattr(conversion, "unit", "") or "")
            if not size:
                remarks.append(f"{path.name}, channel {name}: is empty and left out")
                continue
            probe = np.asarray(file.get(name, group, index, record_count=1, ignore_invalidation_bits=True).samples)
            if probe.ndim != 1 or probe.dtype.kind not in "biuf":
                remarks.append(f"{path.name}, channel {name}: holds no plain numbers and is left out")
                continue
            made, told = _channel(file, (group, index, size), (name, unit, path.name, about), samples)
            found.append(replace(made, began=began))
            remarks += [text for text in told if text not in remarks]
    return found, remarks


def _instant(file: Any) -> int | None:
    """Return the start time of a file, ns since 1970 UTC; None if not stated."""
    try:
        seconds = file.header.start_time.replace(microsecond=0).timestamp()
        return int(seconds) * 10**9 + 1000 * int(file.header.start_time.microsecond)
    except (AttributeError, OverflowError, ValueError, OSError):
        return None


def _samples(file: Any, place: tuple[str, int, int]) -> np.ndarray:
    """Return all samples of a channel by name, group and index; samples that the file marks as invalid are NaN."""
    values, invalid = file.get(*place, samples_only=True, ignore_invalidation_bits=True)
    values = np.asarray(values)
    if invalid is None or not np.any(invalid):
        return values
    values = values.astype(np.float64)
    values[np.asarray(invalid, dtype=bool)] = np.nan
    return values


def _channel(
    file: Any,
    place: tuple[int, int, int],
    words: tuple[str, str, str, str],
    samples: Callable[[tuple[str, int, int]], np.ndarray],
) -> tuple[Channel, list[str]]:
    """Return one channel, with a step if its times are equidistant, else with its own time base; and remarks."""
    (group, index, size), (name, unit, source, about) = place, words

    def read(first: int, last: int) -> np.ndarray:
        return np.asarray(samples((name, group, index))[first:last], dtype=np.float64)

    def times(first: int, last: int) -> np.ndarray:
        return np.asarray(file.get_master(group, record_offset=first, record_count=last - first), dtype=np.float64)

    if size <= MANY:
        return sampled(name, unit, times(0, size), _samples(file, (name, group, index)), source, about)
    if (even := long_time_base(times, size)) is not None:
        return Channel(name, unit, size, source, read, *even, about=about), []
    whole = times(0, size)
    if not np.isfinite(whole.sum()):
        return sampled(name, unit, whole, read(0, size), source, about)
    start, step, own, remarks = time_base(whole, f"{source}, channel {name}")
    if own is not None and np.any(np.diff(own) < 0.0):
        return sampled(name, unit, whole, read(0, size), source, about)
    places_of = None if own is None else times
    return Channel(name, unit, size, source, read, start, step, places_of, about=about), remarks
