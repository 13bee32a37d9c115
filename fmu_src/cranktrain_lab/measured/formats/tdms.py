"""Reader of TDMS by npTDMS, with samples read in blocks."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain_lab.measured.channels import Channel, sampled

TIMES = ("time", "zeit", "t", "x", "time [s]")
"""Names of a channel with the times of its group."""
EARLIEST = 315_532_800_000_000_000
"""Earliest valid start time (1980), ns since 1970. Programs write the clock's zero, 1904 or 1970, if it was not set."""


def channels(path: Path) -> tuple[list[Channel], list[str]]:
    """List the numeric channels of a file, and remarks."""
    from nptdms import TdmsFile

    file = TdmsFile.open(str(path))
    found: list[Channel] = []
    remarks: list[str] = []
    for group in file.groups():
        own = group.channels()
        bases = (one for one in own if one.name.strip().lower() in TIMES and "wf_increment" not in one.properties)
        base = next(bases, None)
        for channel in own:
            if channel is base and len(own) > 1:
                continue
            if not len(channel):
                remarks.append(f"{path.name}, channel {channel.name}: is empty and left out")
                continue
            if np.dtype(channel.dtype or object).kind not in "biuf":
                remarks.append(f"{path.name}, channel {channel.name}: holds no plain numbers and is left out")
                continue
            made, told = _channel(channel, base, path.name, group.name)
            found.append(made)
            remarks += told
    # The last segment has less data than its header states.
    if getattr(getattr(file, "file_status", None), "incomplete_final_segment", False):
        remarks.append(f"{path.name}: is cut short; the samples up to the cut were read")
    return found, remarks


def _channel(channel: Any, base: Any, source: str, group: str) -> tuple[Channel, list[str]]:
    """Return one channel with its waveform's step, the time channel of its group, or neither; and remarks."""
    held = channel.properties
    unit = str(held.get("unit_string") or held.get("NI_UnitDescription") or "")

    def read(first: int, last: int) -> np.ndarray:
        return np.asarray(channel.read_data(first, last - first), dtype=np.float64)

    step, start = (_number(held.get(key)) for key in ("wf_increment", "wf_start_offset"))
    began = _instant(held.get("wf_start_time"))
    if step > 0.0:
        return Channel(channel.name, unit, len(channel), source, read, start, step, about=group, began=began), []
    if base is not None and len(base):
        told = []
        if len(base) != len(channel):
            told = [
                f"{source}, channel {channel.name}: {len(channel)} samples and {len(base)} times; the shorter counts"
            ]
        n = min(len(base), len(channel))
        times, own = np.asarray(base[:n]), None
        if times.dtype.kind == "M":
            own = _instant(times[0])
            times = (times - times[0]) / np.timedelta64(1, "s")
        made, more = sampled(channel.name, unit, times, read(0, n), source, group, began if own is None else own)
        return made, told + more
    stated = f"a step of {held['wf_increment']}" if "wf_increment" in held else "no sampling"
    told = [f"{source}, channel {channel.name}: states {stated}; its samples are counted from 0, one a second"]
    made = Channel(
        channel.name, unit, len(channel), source, read, 0.0, 1.0, abscissa="sample", abscissa_unit="1", about=group
    )
    return made, told if math.isfinite(made.step) else []


def _instant(value: Any) -> int | None:
    """Return a stated time, ns since 1970 UTC; None if there is no time, or a time before ``EARLIEST``."""
    if not isinstance(value, np.datetime64) or np.isnat(value):
        return None
    found = int(value.astype("datetime64[ns]").astype(np.int64))
    return found if found > EARLIEST else None


def _number(value: Any) -> float:
    """Return a property as a number, 0 if it is not a number."""
    try:
        number = float(value or 0.0)
    except (TypeError, ValueError):
        return 0.0
    return number if math.isfinite(number) else 0.0
