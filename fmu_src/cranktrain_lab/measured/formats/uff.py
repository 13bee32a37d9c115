"""Reader of UFF data sets 58 and 58b by pyuff: time series, and functions of frequency, speed or order.

pyuff skips unknown data sets. A truncated data set gives a remark, and those before it are kept. pyuff loads the whole
file into memory to find data sets, so the file size is limited to ``LARGEST``. Afterwards one data set at a time is in
memory, and is read again when its samples are needed.
"""

import math
import re
import warnings
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain_lab.measured.channels import TIME, Channel, last_kept, of_array, sampled

ABSCISSAE = {17: (TIME, "s"), 18: ("frequency", "Hz"), 19: ("speed", "rev/min"), 16: ("order", "1")}
"""Specific data types of an abscissa (I-deas universal file, data set 58, record 8) and their units."""
FUNCTIONS = {
    1: "time response", 2: "auto spectrum", 3: "cross spectrum", 4: "frequency response", 6: "coherence",
    9: "power spectral density", 12: "spectrum", 13: "order",
}  # fmt: skip
NOTHING = ("", "none")
LARGEST = 2_000_000_000
"""Largest size of a file, bytes."""
HEAD = 13
"""Number of header lines of a data set."""
MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
HELD = 100_000
"""Largest number of values of a data set that stays in memory."""


def channels(path: Path) -> tuple[list[Channel], list[str]]:
    """List the channels of a file, and remarks."""
    import pyuff

    if (size := path.stat().st_size) > LARGEST:
        raise InputError(
            f"{path.name}: has {size / 1e9:.3g} GB, UFF files are read up to {LARGEST / 1e9:g} GB; export fewer "
            "channels a file, or MDF4, TDMS or HDF5, which are read in blocks"
        )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        file = pyuff.UFF(str(path))
        again = last_kept(partial(_loaded, file, path.name))
        kinds = [int(kind) for kind in file.get_set_types()]
        found: list[Channel] = []
        remarks: list[str] = []
        for k, kind in enumerate(kinds):
            if kind != 58:
                continue
            try:
                one = _data_set(file, k)
                data = _stated(one)
                if data.size != int(one["num_pts"]):
                    remarks.append(
                        f"{path.name}, data set {k + 1}: {data.size} of {int(one['num_pts'])} values are there; "
                        f"it is cut short"
                    )
                channel, told = _channel(one, data, path.name)
            except Exception as error:  # pyuff raises errors of many types
                reason = str(error).splitlines()[0] if str(error) else type(error).__name__
                remarks.append(f"{path.name}, data set {k + 1}: cannot be read ({reason}); it is left out")
                continue
            found.append(_later(channel, again, k) if channel.size > HELD else channel)
            remarks += told
    if not kinds:
        raise InputError(f"{path.name}: holds no complete data set between lines of -1; it is cut short")
    if others := sorted(set(kinds) - {58, 151, 164}):
        remarks.append(f"{path.name}: data sets {', '.join(map(str, others))} hold no signals and are left out")
    with path.open("rb") as text:
        text.seek(max(0, size - 4096))
        if not text.read().rstrip().endswith(b"-1"):
            remarks.append(
                f"{path.name}: the last data set has no end and is left out; {len(kinds)} complete ones were read"
            )
    return found, remarks


def _later(channel: Channel, again: Callable[[int], Channel], k: int) -> Channel:
    """Return the channel of data set k with readers that load its samples ``again`` when needed."""
    places = None if channel.places is None else (lambda first, last: again(k).abscissae(first, last))
    return replace(channel, read=lambda first, last: again(k).read(first, last), places=places)


def _loaded(file: Any, source: str, k: int) -> Channel:
    """Return the channel of data set k with its samples."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        one = _data_set(file, k)
    return _channel(one, _stated(one), source)[0]


def _data_set(file: Any, k: int) -> dict[str, Any]:
    """Read data set k; if pyuff fails, trailing blanks, which it takes for numbers, are removed first."""
    try:
        return dict(file.read_sets(k))
    except Exception:
        from pyuff.datasets.dataset_58 import _extract58

        first, last = (int(place) for place in file._block_ind[k])
        with open(file._filename, "rb") as text:
            text.seek(first)
            lines = text.read(last - first + 1).splitlines()
        if lines[1][6:7].lower() == b"b":
            raise
        kept = lines[:HEAD] + [line.rstrip() for line in lines[HEAD:] if line.strip()]
        return dict(_extract58(b"\n".join(kept)))


def _instant(text: str) -> int | None:
    """Return the time of an identification line with fractions of a second, ns since 1970, else None.

    Times to the second are ignored, because they state when the program wrote the file and are too coarse for signals.
    """
    match = re.search(r"(\d{1,2})-([A-Za-z]{3})-(\d{2,4})\s+(\d{1,2}):(\d\d):(\d\d)[.,](\d{1,9})", text)
    if match is None or match[2].title() not in MONTHS:
        return None
    day, year = int(match[1]), int(match[3]) + (2000 if len(match[3]) == 2 else 0)
    try:
        whole = datetime(year, MONTHS.index(match[2].title()) + 1, day, int(match[4]), int(match[5]), int(match[6]),
                         tzinfo=UTC)  # fmt: skip
    except ValueError:
        return None
    return int(whole.timestamp()) * 10**9 + int(match[7].ljust(9, "0"))


def _stated(one: dict[str, Any]) -> np.ndarray:
    """Return the values of a data set without filling values of the last line beyond the stated number."""
    return np.asarray(one["data"])[: int(one["num_pts"])]


def _channel(one: dict[str, Any], data: np.ndarray, source: str) -> tuple[Channel, list[str]]:
    """Return the channel of one data set, and remarks."""
    code = int(one.get("abscissa_spec_data_type", 17))
    label, unit = (str(one.get(key) or "").strip() for key in ("abscissa_axis_lab", "abscissa_axis_units_lab"))
    abscissa, own_unit = ABSCISSAE.get(code, (_named(label, unit), unit))
    function = FUNCTIONS.get(int(one.get("func_type", 0)), "")
    titles = [str(one.get(f"id{k}") or "").strip() for k in (1, 2, 4, 5)]
    about = "; ".join(text for text in [*titles, function] if text.lower() not in NOTHING)
    entity = str(one.get("rsp_ent_name") or "").strip()
    ordinate = str(one.get("ordinate_axis_units_lab") or "").strip()
    node, direction = int(one.get("rsp_node") or 0), int(one.get("rsp_dir") or 0)
    name = entity if entity.lower() not in NOTHING else (titles[0] if titles[0].lower() not in NOTHING else "channel")
    name += f":{node}" * (node > 0) + (
        f":{'+' if direction > 0 else '-'}{'xyz'[abs(direction) - 1]}" if 0 < abs(direction) < 4 else ""
    )
    if abscissa == "speed" and (order := re.search(r"[Oo]rder\D{0,3}(\d+(?:\.\d+)?)", about)):
        name += f" order {float(order[1]):g}"
    ordinate = "" if ordinate.lower() in NOTHING else ordinate
    x = np.asarray(one["x"], dtype=np.float64)
    if abscissa == TIME and not np.iscomplexobj(data):
        scale = 1e-3 if unit.lower() == "ms" else 1.0
        return sampled(name, ordinate, scale * x, data, source, about, _instant(str(one.get("id3") or "")))
    values: Any = data.astype(np.complex128 if np.iscomplexobj(data) else np.float64)
    return Channel(name, ordinate, data.size, source, lambda first, last: values[first:last],
                   float(x[0]) if x.size else 0.0, math.nan, of_array(x), abscissa, own_unit or unit,
                   about), []  # fmt: skip


def _named(label: str, unit: str) -> str:
    """Return the abscissa from its label and unit, for an unspecific code."""
    text = f"{label} {unit}".lower()
    for name, words in {"speed": ("rpm", "speed", "1/min"), "frequency": ("hz", "freq"), "order": ("order",)}.items():
        if any(word in text for word in words):
            return name
    return TIME if not text.strip() or "time" in text or unit.lower() in ("s", "sec", "ms") else label or "abscissa"
