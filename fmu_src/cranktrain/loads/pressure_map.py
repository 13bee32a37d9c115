"""Measured pressures over speed and load, with traces of several files interpolated linearly at equal angle.

A map is a folder with files named by speed in rev/min, or an index file with speed, load and file of each trace. A
trace is interpolated between the two nearest speeds at each load, then between the two nearest loads. Outside the range
of the map the nearest trace is used.

    1000.csv  1500rpm.csv  2000_full.csv  2000_50%.csv            names in a folder; without a load: full load

    speed_rpm, load, file                                         an index file (.csv); load may be left out
    1000, 1.0, idle/full_1000.csv
"""

import math
import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.column_names import kind_of
from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.text_header import named
from cranktrain.core.text_rows import read_rows
from cranktrain.core.text_table import first_words, split_columns
from cranktrain.core.units import RPM
from cranktrain.core.user_file import TABLES, beside, ending, file_exists, folder_exists, user_path
from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import Gas, GasTrace
from cranktrain.loads.pressure_points import REMEDY, WHAT

COLUMNS = ("speed_rpm", "load", "file")
KINDS = ("speed", "load", "file")
_NAME = re.compile(r"(\d+(?:\.\d+)?)(?:rpm)?(?:_(full|\d+(?:\.\d+)?%))?", re.IGNORECASE)
FULL = 1.0
LOWEST_RPM, HIGHEST_RPM, HIGHEST_LOAD = 1.0, 30000.0, 2.0


class Point(NamedTuple):
    """Trace of a map with its speed (rad/s) and its fraction of full load."""

    speed: float
    load: float
    trace: GasTrace


@dataclass(frozen=True, eq=False)
class PressureMap(Gas):
    """Traces over speed and load, ordered by load and then by speed."""

    name: str
    points: tuple[Point, ...]

    @property
    def speeds(self) -> tuple[float, float]:
        """Lowest and highest speed, rad/s."""
        speeds = [point.speed for point in self.points]
        return min(speeds), max(speeds)

    @property
    def loads(self) -> tuple[float, ...]:
        """Loads in increasing order."""
        return tuple(sorted({point.load for point in self.points}))

    @property
    def values(self) -> list[Any]:
        """Return the values of the map that determine a run, for its digest."""
        return [[point.speed, point.load, point.trace.values] for point in self.points]

    def at(self, speed: float, load: float) -> GasTrace:
        """Return the trace at ``speed`` (rad/s) and ``load``.

        A map with several loads already includes the load, so its trace has no rise by combustion, which a model would
        scale by the load again.
        """
        parts = []
        for level, weight in _between(self.loads, load):
            row = [point for point in self.points if point.load == level]
            for at, share in _between([point.speed for point in row], speed):
                (trace,) = (point.trace for point in row if point.speed == at)
                parts.append((trace, weight * share))
        traces, weights = zip(*parts, strict=True)
        if len(parts) == 1:
            found: GasTrace = replace(traces[0], source=f"{self.name}: {traces[0].source}")
        else:
            found = GasTrace.mean(traces, weights, f"{self.name}: between {len(parts)} of {len(self.points)} traces")
        return _without_rise(found) if len(self.loads) > 1 else found

    def tell_ends(self, speeds: Sequence[float], load: float) -> None:
        """Warn, one line each, of speeds (rad/s) and a load outside the range of the map."""
        low, high = self.speeds
        beyond = [speed for speed in speeds if not low * (1.0 - 1e-9) <= speed <= high * (1.0 + 1e-9)]
        if beyond:
            far = max(beyond, key=lambda speed: max(low - speed, speed - high))
            warnings.warn(
                f"{self.name}: {far / RPM:.5g} rev/min lies beyond its speeds, {low / RPM:.5g} to {high / RPM:.5g} "
                "rev/min; the trace of the nearest one is kept, give one measured there",
                stacklevel=2,
            )
        loads = self.loads
        if len(loads) > 1 and not loads[0] <= load <= loads[-1]:
            warnings.warn(
                f"{self.name}: load {load:g} lies beyond its loads, {loads[0]:g} to {loads[-1]:g}; the trace of the "
                "nearest one is kept",
                stacklevel=2,
            )


def read_gas(path: Any, engine: Engine, unit: str | None = None, dead_centre_deg: float | None = None) -> Gas:
    """Read pressures from a trace file, an index file or a folder of traces, or take pressures given by a script.

    A ``path`` that is no path is an array or a function, see :mod:`cranktrain.loads.given_pressure`.

    Other arguments are those of :meth:`GasTrace.from_csv`. Raises ``InputError`` with one line that names file and row.
    """
    if not isinstance(path, str | Path):
        from cranktrain.loads.given_pressure import given_gas

        return given_gas(path, engine, unit, dead_centre_deg)
    place = user_path(path)
    rows = _folder(place) if folder_exists(place) else _index(place)
    if rows is None:
        return GasTrace.from_csv(place, engine, unit, dead_centre_deg)
    seen: dict[tuple[float, float], Path] = {}
    for rpm, load, file in rows:
        if (rpm, load) in seen:
            raise InputError(
                f"{place.name}: {seen[rpm, load].name} and {file.name} are both of {rpm:g} rev/min at load {load:g}; "
                "leave one of them out"
            )
        seen[rpm, load] = file
    points = [
        Point(rpm * RPM, load, GasTrace.from_csv(file, engine, unit, dead_centre_deg))
        for rpm, load, file in sorted(rows)
    ]
    kinds = {len(point.trace.own) for point in points}
    if len(kinds) > 1:
        raise InputError(f"{place.name}: some files have one trace and others one for each cylinder; give one kind")
    return PressureMap(place.name, tuple(sorted(points, key=lambda point: point[:2][::-1])))


def _folder(place: Path) -> list[tuple[float, float, Path]]:
    """Return speed (rev/min), load and file of each trace in a folder."""
    rows = []
    for file in sorted(place.iterdir()):
        if ending(file) not in TABLES or file.name.startswith("."):
            continue
        found = _NAME.fullmatch(file.stem)
        if found is None:
            raise InputError(
                f"{place.name}/{file.name}: the name is no speed; name traces by rev/min and load, as 1500.csv, "
                "1500rpm.csv, 1500_full.csv or 1500_50%.csv, or give an index file"
            )
        load = found[2] or "full"
        rows.append(
            _checked(file.name, found[1], "1" if load.lower() == "full" else f"{float(load[:-1]) / 100.0}", file)
        )
    if not rows:
        raise InputError(f"{place}: no trace in this folder; name traces by rev/min, as 1500.csv")
    return rows


def _index(place: Path) -> list[tuple[float, float, Path]] | None:
    """Return the rows of an index file; None if the file is not an index."""
    place, _ = split_columns(place)
    if "file" not in first_words(place, WHAT, REMEDY):
        return None
    remedy = "give lines of speed_rpm, load and file under this header"
    table = read_rows(place, "index of pressure files", remedy, lambda word: bool(kind_of(named(word)[0], KINDS)))
    kinds = ["speed_rpm" if (kind := kind_of(name, KINDS)) == "speed" else kind for name in table.names]
    for name, kind in zip(table.names, kinds, strict=True):
        if not kind:
            raise InputError(f"{place.name}: unknown column {shown(name)}; {nearest(name, COLUMNS)}")
    if "speed_rpm" not in kinds or len(set(kinds)) != len(kinds):
        names = ", ".join(table.names)
        raise InputError(f"{place.name}: columns are {names}; give speed_rpm, load (or none) and file, once")
    rows = []
    for number, row in table.rows:
        where = f"{place.name}: line {number}"
        own = dict(zip(kinds, row, strict=True))
        if not all(row):
            raise InputError(f"{where}: {sum(map(bool, row))} values for {len(row)} columns; give one for each")
        numbers = (own["speed_rpm"], own.get("load", "1"))
        rows.append(_checked(where, *numbers, beside(place, own["file"]), table.dialect.number))
    if not rows:
        raise InputError(f"{place.name}: names no trace; give a line of speed_rpm, load and file for each")
    return rows


def _checked(
    where: str, speed: str, load: str, file: Path, number: Callable[[str], float] = float
) -> tuple[float, float, Path]:
    """Convert a row of a map to numbers; ``InputError`` for text, or an impossible speed or load."""
    values = []
    for text, what, least, most in (
        (speed, "a speed in rev/min", LOWEST_RPM, HIGHEST_RPM),
        (load, "a fraction of full load", 0.0, HIGHEST_LOAD),
    ):
        try:
            values.append(number(text))
        except ValueError:
            values.append(math.nan)
        if not least <= values[-1] <= most:
            raise InputError(f"{where}: {shown(text)} is not {what}, {least:g} to {most:g}")
    if not file_exists(split_columns(file)[0]):
        raise InputError(f"{where}: {shown(str(file))} does not exist; paths start at the index file's folder")
    return values[0], values[1], file


def _between(places: Sequence[float], value: float) -> list[tuple[float, float]]:
    """Return the one or two entries of increasing ``places`` next to a value, with interpolation weights."""
    k = int(np.searchsorted(places, value))
    if k == 0 or k == len(places) or places[k] == value:
        return [(places[min(k, len(places) - 1)], 1.0)]
    share = (value - places[k - 1]) / (places[k] - places[k - 1])
    return [(places[k - 1], 1.0 - share), (places[k], share)]


def _without_rise(trace: GasTrace) -> GasTrace:
    """Return a trace whose motored pressure equals its fired pressure, so that the load does not scale it."""
    return replace(trace, motored=trace.fired, own=tuple(_without_rise(own) for own in trace.own))
