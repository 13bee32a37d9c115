"""Columns of dates and times of day in text tables, as seconds since their first value.

Seconds since 1970 in float64 resolve 0.2 µs only, which is not small compared with a sampling interval. So times are
kept in whole nanoseconds until the first one is subtracted. Times of day without a date continue after midnight.
"""

import re
from collections.abc import Sequence
from datetime import UTC, date, datetime

import numpy as np
from numpy.typing import NDArray

DAY = 86_400 * 10**9
"""Nanoseconds per day."""
_TIME = r"(?P<h>\d{1,2}):(?P<m>\d{2})(?::(?P<s>\d{2})(?:[.,:](?P<f>\d{1,24}))?)?\s*(?P<half>[AaPp]\.?[Mm]\.?)?"
_CLOCK = re.compile(
    r"\s*(?:(?:(?P<Y>\d{4})[-/.](?P<M>\d{1,2})[-/.](?P<D>\d{1,2})|(?P<a>\d{1,2})(?P<sep>[./-])(?P<b>\d{1,2})[./-]"
    rf"(?P<y>\d{{4}}|\d{{2}}))(?:[T_]|\s+))?{_TIME}\s*(?P<zone>Z|UTC|[+-]\d{{2}}:?\d{{2}})?\s*"
)
_MINUTES = re.compile(r"\s*(?P<m>\d{1,3}):(?P<s>\d{2})[.,](?P<f>\d{1,24})\s*")


def is_clock(cell: str) -> bool:
    """True if a cell is a time of day, with or without a date."""
    return ":" in cell and (_CLOCK.fullmatch(cell) or _MINUTES.fullmatch(cell)) is not None


class Clocks:
    """Reader of a table's time columns, block by block.

    Attributes
    ----------
    first : first value of each column, ns since 1970 UTC, or since midnight if there is no date
    dated : columns with dates
    """

    def __init__(self) -> None:
        self.first: dict[int, int] = {}
        self.dated: set[int] = set()
        self._last: dict[int, int] = {}
        self._days: dict[int, int] = {}
        self._date: tuple[str, int] = ("", 0)

    def seconds(self, column: int, cells: Sequence[object]) -> NDArray[np.float64]:
        """Seconds (n,) since the column's first value; NaN for a cell that is not a time."""
        return np.array([self._second(column, cell) for cell in cells], dtype=np.float64)

    def _second(self, column: int, cell: object) -> float:
        ns = self._nanoseconds(column, cell) if isinstance(cell, str) and ":" in cell else None
        if ns is None:
            return float("nan")
        if column not in self.dated:
            days = self._days.get(column, 0)
            if ns + days * DAY < self._last.get(column, 0) - DAY // 2:
                self._days[column] = days = days + 1
            ns += days * DAY
        self._last[column] = ns
        return (ns - self.first.setdefault(column, ns)) / 1e9

    def _nanoseconds(self, column: int, cell: str) -> int | None:
        if (short := _MINUTES.fullmatch(cell)) is not None:
            return (int(short["m"]) * 60 + int(short["s"])) * 10**9 + _fraction(short["f"])
        match = _CLOCK.fullmatch(cell)
        if match is None:
            return None
        hour = int(match["h"])
        if match["half"]:
            hour = hour % 12 + 12 * (match["half"][0] in "pP")
        ns = ((hour * 60 + int(match["m"])) * 60 + int(match["s"] or 0)) * 10**9 + _fraction(match["f"] or "0")
        day = cell[: match.start("h")].strip(" T_")
        if not day:
            return ns
        self.dated.add(column)
        if day != self._date[0]:
            try:
                self._date = day, _day(match) * DAY
            except ValueError:
                return None
        zone = match["zone"] or "Z"
        minutes = 0 if zone in ("Z", "UTC") else int(zone[1:3]) * 60 + int(zone[-2:])
        return self._date[1] + ns - (-1 if zone[0] == "-" else 1) * minutes * 60 * 10**9


def _fraction(digits: str) -> int:
    """Nanoseconds of the digits after the decimal sign of a second."""
    return int(digits[:9].ljust(9, "0"))


def _day(match: re.Match[str]) -> int:
    """Days since 1970. The month is first in 3/4/2026, the day in 3.4.2026 and 13/4/2026. ``ValueError``: no date."""
    if match["Y"]:
        found = date(int(match["Y"]), int(match["M"]), int(match["D"]))
    else:
        a, b, year = int(match["a"]), int(match["b"]), int(match["y"])
        month, day = (a, b) if match["sep"] == "/" and a <= 12 else (b, a)
        found = date(year + 2000 if year < 100 else year, month, day)
    return int(datetime(found.year, found.month, found.day, tzinfo=UTC).timestamp()) // 86_400
