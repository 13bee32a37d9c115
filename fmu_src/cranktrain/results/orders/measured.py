"""Measured orders from a text file: one line a point, of speed, order, amplitude and its unit.

    speed_rpm, order, amplitude, unit
    2380, 6, 0.21, deg
    1900, 3, 85, um

Amplitudes are zero to peak. A unit of angle belongs to the pulley's torsion, one of length to its axial motion. The
unit may stand in each line, in a row of units or in the header, as ``amplitude [deg]``; a speed without unit is in
rev/min. The table may be written in any dialect of :mod:`cranktrain.core.text_table`, with further columns.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from cranktrain.core.column_names import columns_of
from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.reduced_body import Array
from cranktrain.core.text_table import TextRows, read_rows
from cranktrain.core.units import UNITS, known_factor
from cranktrain.results.run_up.run_up import AXIAL, TORSION

COLUMNS = {"speed": "speed_rpm", "order": "order", "amplitude": "amplitude", "unit": "unit"}
OUTPUTS = {"angle": TORSION, "length": AXIAL}
"""Output that an amplitude of a dimension belongs to."""
REMEDY = "give lines of speed_rpm, order, amplitude, unit under this header"
Measured = Mapping[str, Mapping[float, tuple[Array, Array]]]
"""Output → order → speeds (k,) rad/s and amplitudes (k,) zero to peak, SI; speeds rise or repeat."""


def read_measured_orders(path: str | Path) -> Measured:
    """Measured orders of a file; ``InputError``: one line with file and row."""
    name = Path(path).name
    table = read_rows(path, "file of measured orders", REMEDY)
    columns = _columns(table, name)
    speed_scale = _speed_scale(table.units[columns["speed"]], name)
    points: dict[str, dict[float, list[tuple[float, float]]]] = {}
    for number, cells in table.rows:
        where = f"{name}, line {number}"
        speed, order, amplitude = (
            _number(table, cells[columns[key]], COLUMNS[key], where) for key in ("speed", "order", "amplitude")
        )
        if abs(order) > 1e6 or abs(2.0 * order - round(2.0 * order)) > 1e-6:
            raise InputError(f"{where}: order {order:g} is not a multiple of 0.5")
        unit = cells[columns["unit"]] if "unit" in columns else ""
        unit = unit or table.units[columns["amplitude"]]
        if not unit:
            count = sum(map(bool, cells))
            raise InputError(f"{where}: {count} values in place of {len(cells)}, and no unit; {REMEDY}")
        output, scale = _amplitude_unit(unit, where)
        points.setdefault(output, {}).setdefault(order, []).append((speed * speed_scale, scale * amplitude))
    if not points:
        raise InputError(f"{name}: holds no points; {REMEDY}")
    return {
        output: {order: _sorted(found) for order, found in sorted(by_order.items())}
        for output, by_order in points.items()
    }


def _columns(table: TextRows, name: str) -> dict[str, int]:
    """Columns of speed, order, amplitude and, where there is one, unit."""
    found = columns_of(table.names, tuple(COLUMNS))
    for kind, places in found.items():
        if len(places) > 1:
            said = " and ".join(shown(table.names[k]) for k in places)
            raise InputError(f"{name}: columns {said} are both a {kind}; leave one of them")
    columns = {kind: places[0] for kind, places in found.items() if places}
    missing = [COLUMNS[kind] for kind in ("speed", "order", "amplitude") if kind not in columns]
    if not missing and "unit" not in columns and not table.units[columns["amplitude"]]:
        missing = ["unit"]
    if missing:
        header = ",".join(table.header[-1]) if table.header else ""
        raise InputError(f"{name}: its header is {shown(header)}, without {' and '.join(missing)}; {REMEDY}")
    return columns


def _speed_scale(unit: str, name: str) -> float:
    """The rad/s of a unit of speed, rev/min where none is stated."""
    found = known_factor(unit or "rev/min", "speed")
    if found is None:
        raise InputError(f"{name}: its speeds are in {shown(unit)}; {nearest(unit, UNITS['speed'])}")
    return found.scale


def _amplitude_unit(unit: str, where: str) -> tuple[str, float]:
    """Output that an amplitude belongs to by its unit, and the unit in SI."""
    for dimension, output in OUTPUTS.items():
        if unit and (found := known_factor(unit, dimension)):
            return output, found.scale
    valid = [known for dimension in OUTPUTS for known in UNITS[dimension]]
    raise InputError(f"{where}: unit {shown(unit)} is unknown; {nearest(unit, [*valid, 'mdeg', 'mrad'])}")


def _sorted(found: list[tuple[float, float]]) -> tuple[Array, Array]:
    speeds, amplitudes = np.array(sorted(found)).T
    return speeds, amplitudes


def _number(table: TextRows, text: str, key: str, where: str) -> float:
    """A number of a line that is not negative, or of speed and order positive."""
    try:
        value = table.dialect.number(text)
    except ValueError:
        raise InputError(f"{where}: {key} {shown(text)} is not a number") from None
    if not math.isfinite(value) or value < 0.0 or (value == 0.0 and key != "amplitude"):
        raise InputError(f"{where}: {key} {text or 'is missing, it'} is not positive")
    return value
