"""ASAM MDF 3 and 4 by asammdf: samples are read from the file in blocks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.measured.channels import UNEVEN, Channel, sampled

MASTER_TIME = 2
LARGEST = 2_000_000
"""Samples up to which times are compared one by one; of longer groups, both ends and places between."""


def channels(path: Path) -> tuple[list[Channel], list[str]]:
    """List the channels of numbers of a file, and remarks."""
    from asammdf import MDF

    file = MDF(str(path))
    found: list[Channel] = []
    remarks: list[str] = []
    groups: Any = file.groups
    for group, entry in enumerate(groups):
        size = int(entry.channel_group.cycles_nr)
        master = file.masters_db.get(group)
        about = str(getattr(entry.channel_group, "acq_name", "") or "")
        for index, channel in enumerate(entry.channels):
            if index == master:
                continue
            name, unit = str(channel.name), str(_unit(channel))
            if not size:
                remarks.append(f"{path.name}, channel {name}: is empty and left out")
                continue
            probe = np.asarray(file.get(name, group, index, record_count=1, samples_only=True)[0])
            if probe.ndim != 1 or probe.dtype.kind not in "biuf":
                remarks.append(f"{path.name}, channel {name}: holds no plain numbers and is left out")
                continue
            made, told = _channel(file, (group, index, size), (name, unit, path.name, about))
            found.append(made)
            remarks += [text for text in told if text not in remarks]
    return found, remarks


def _unit(channel: Any) -> str:
    """Unit of a channel, or of its conversion."""
    return channel.unit or getattr(getattr(channel, "conversion", None), "unit", "") or ""


def _channel(file: Any, place: tuple[int, int, int], words: tuple[str, str, str, str]) -> tuple[Channel, list[str]]:
    """One channel: read in blocks where its times are equidistant, else with a time base of its own."""
    (group, index, size), (name, unit, source, about) = place, words

    def read(first: int, last: int) -> np.ndarray:
        got = file.get(name, group, index, record_offset=first, record_count=last - first, samples_only=True)
        return np.asarray(got[0], dtype=np.float64)

    def times(first: int, last: int) -> np.ndarray:
        return np.asarray(file.get_master(group, record_offset=first, record_count=last - first), dtype=np.float64)

    if size <= LARGEST:
        return sampled(name, unit, times(0, size), read(0, size), source, about)
    begin, end = times(0, 2), times(size - 1, size)
    step = float(end[0] - begin[0]) / (size - 1)
    places = np.linspace(0, size - 2, 50).astype(int)
    off = max(abs(float(times(k, k + 1)[0]) - begin[0] - k * step) for k in places)
    if step > 0.0 and off <= max(UNEVEN, 1e-9 * size) * step:
        return Channel(name, unit, size, source, read, float(begin[0]), step, about=about), []
    return Channel(name, unit, size, source, read, float(begin[0]), places=times, about=about), []
