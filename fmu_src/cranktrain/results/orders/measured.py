"""Measured orders from a text file: one line a point, of speed, order, amplitude and its unit.

    speed_rpm, order, amplitude, unit
    2380, 6, 0.21, deg
    1900, 3, 85, um

Amplitudes are zero to peak. A unit of angle belongs to the pulley's torsion, one of length to its axial motion.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.reduced_body import Array
from cranktrain.core.user_file import read_text
from cranktrain.results.run_up.run_up import AXIAL, TORSION

COLUMNS = ("speed_rpm", "order", "amplitude", "unit")
UNITS = {
    "deg": (TORSION, math.pi / 180.0), "mdeg": (TORSION, math.pi / 180e3), "rad": (TORSION, 1.0),
    "mrad": (TORSION, 1e-3), "um": (AXIAL, 1e-6), "mm": (AXIAL, 1e-3), "m": (AXIAL, 1.0),
}  # fmt: skip
"""Unit → output, and how much of its own unit it is."""
REMEDY = "give lines of speed_rpm, order, amplitude, unit under this header"
Measured = Mapping[str, Mapping[float, tuple[Array, Array]]]
"""Output → order → speeds (k,) rad/s and amplitudes (k,) zero to peak, SI; speeds rise or repeat."""


def read_measured_orders(path: str | Path) -> Measured:
    """Measured orders of a file; ``InputError``: one line with file and row."""
    name = Path(path).name
    lines = read_text(path, "file of measured orders", REMEDY).splitlines()
    separator = ";" if lines and ";" in lines[0] else ","
    rows = list(csv.reader(lines, delimiter=separator, skipinitialspace=True))
    header = tuple(cell.strip().lower() for cell in rows[0]) if rows else ()
    if set(header) != set(COLUMNS) or len(header) != len(COLUMNS):
        raise InputError(f"{name}: its header is {shown(','.join(header))}; {REMEDY}")
    points: dict[str, dict[float, list[tuple[float, float]]]] = {}
    for number, row in enumerate(rows[1:], start=2):
        if not any(cell.strip() for cell in row):
            continue
        if len(row) != len(COLUMNS):
            raise InputError(f"{name}, line {number}: {len(row)} values in place of {len(COLUMNS)}; {REMEDY}")
        cells = dict(zip(header, (cell.strip() for cell in row), strict=True))
        speed, order, amplitude = (_number(cells[key], key, name, number) for key in COLUMNS[:3])
        if abs(order) > 1e6 or abs(2.0 * order - round(2.0 * order)) > 1e-6:
            raise InputError(f"{name}, line {number}: order {order:g} is not a multiple of 0.5")
        unit = cells["unit"].replace("µ", "u").replace("μ", "u")
        if unit not in UNITS:
            raise InputError(f"{name}, line {number}: unit {shown(unit)} is unknown; {nearest(unit, UNITS)}")
        output, scale = UNITS[unit]
        points.setdefault(output, {}).setdefault(order, []).append((speed * math.pi / 30.0, scale * amplitude))
    if not points:
        raise InputError(f"{name}: holds no points; {REMEDY}")
    return {
        output: {order: _columns(found) for order, found in sorted(by_order.items())}
        for output, by_order in points.items()
    }


def _columns(found: list[tuple[float, float]]) -> tuple[Array, Array]:
    speeds, amplitudes = np.array(sorted(found)).T
    return speeds, amplitudes


def _number(text: str, key: str, name: str, line: int) -> float:
    """A number of a line that is not negative, or of speed and order positive."""
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"{name}, line {line}: {key} {shown(text)} is not a number") from None
    if not math.isfinite(value) or value < 0.0 or (value == 0.0 and key != "amplitude"):
        raise InputError(f"{name}, line {line}: {key} {text} is not positive")
    return value
