"""Reader of measured orders: a text table with one point per line (speed, order, amplitude, unit).

    speed_rpm, order, amplitude, unit
    2380, 6, 0.21, deg
    1900, 3, 85, um

Amplitudes are zero to peak. A unit of angle belongs to the pulley's torsion, a unit of length to its axial motion. The
unit may be given in each line, in a row of units or in the header, as ``amplitude [deg]``; a speed without unit is in
rev/min. The table may be written in any dialect of :mod:`cranktrain.core.text_table` and have further columns. Read are
``phase_deg``, ``band`` (half width of an amplitude's band in its unit) and ``wheel`` (number of teeth of the wheel
whose rotation was measured). Other files hold curves over speed, such as data sets 58 of a UFF file
(:mod:`cranktrain_lab.measured`).
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cranktrain import lab
from cranktrain.core.column_names import columns_of, kind_of
from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.named import resolve
from cranktrain.core.reduced_body import Array
from cranktrain.core.text_header import named
from cranktrain.core.text_rows import TextRows, read_rows
from cranktrain.core.units import RPM, UNITS, known_factor
from cranktrain.core.user_file import file_exists, user_path
from cranktrain.results.run_up.run_up import AXIAL, FLYWHEEL, TORSION

KINDS = ("speed", "order", "amplitude", "unit")
COLUMNS = {"speed": "speed_rpm", "order": "order", "amplitude": "amplitude", "unit": "unit"}
LAID_OVER = (TORSION, AXIAL, FLYWHEEL, "twist")
FURTHER = {"phase": ("phase_deg", "phase", "phase [deg]"), "band": ("band", "band_95", "uncertainty")}
"""Optional columns of a table of measured orders, each with its possible names in lower case."""
OWN = ("output", "signal", "wheel")
"""Columns that only tables of measured orders written by this program have."""
OUTPUTS = {"angle": TORSION, "length": AXIAL}
"""Output to which a measured amplitude belongs, by the dimension of the amplitude's unit."""
LARGEST, LEAST = 1e9, 1e-15
"""Largest permitted amplitude, speed, phase and band, and smallest nonzero band, in SI."""
REMEDY = "give lines of speed_rpm, order, amplitude, unit under this header"
Measured = Mapping[str, Mapping[float, tuple[Array, Array]]]
"""Output → order → speeds (k,) rad/s and amplitudes (k,) zero to peak, SI; speeds do not decrease."""


class OrderCurve(NamedTuple):
    """One measured order: speeds (k,) rad/s, amplitudes (k,) zero to peak in ``unit``, phases (k,) rad or NaN."""

    order: float
    speeds: Array
    amplitudes: Array
    phases: Array
    unit: str
    name: str


class MeasuredOrders(dict[str, dict[float, tuple[Array, Array]]]):
    """Measured orders in the form of :data:`Measured`, with their phases, bands and wheels.

    Attributes
    ----------
    phases, bands : output → order → phases (k,) rad and half widths of bands (k,), SI; NaN if not known
    wheels : output → number of teeth of the measured wheel as stated in the file; None without such a column
    """

    def __init__(self) -> None:
        super().__init__()
        self.phases: dict[str, dict[float, Array]] = {}
        self.bands: dict[str, dict[float, Array]] = {}
        self.wheels: dict[str, str] | None = None

    def put(self, output: str, order: float, points: list[tuple[float, float, float, float]]) -> None:
        """Add points of an order, each with speed, amplitude, phase and band, SI."""
        speeds, amplitudes, phases, bands = np.array(sorted(points)).T
        self.setdefault(output, {})[order] = speeds, amplitudes
        self.phases.setdefault(output, {})[order] = phases
        self.bands.setdefault(output, {})[order] = bands


def band_of(measured: Measured | None, output: str, order: float) -> Array | None:
    """Half widths (k,) of the bands of a measured order, SI; None if they are not known."""
    found = measured.bands.get(output, {}).get(order) if isinstance(measured, MeasuredOrders) else None
    return None if found is None or not np.isfinite(found).any() else found


def phases_of(measured: Measured, output: str, order: float) -> Array | None:
    """Phases (k,) of a measured order, rad; None if they are not known."""
    found = measured.phases.get(output, {}).get(order) if isinstance(measured, MeasuredOrders) else None
    return None if found is None or not np.isfinite(found).any() else found


def read_measured_orders(path: str | Path, kinds: Mapping[str, str] = OUTPUTS) -> MeasuredOrders:
    """Read measured orders from a file; ``InputError`` with file and line.

    ``kinds`` gives the output for each dimension of an amplitude.
    """
    name = Path(path).name
    place = user_path(path)
    curves = resolve(lab.ORDER_CURVES)(path) if file_exists(place) else None
    if curves is not None:
        return _of_curves(curves, name, kinds)
    table = read_rows(path, "file of measured orders", REMEDY, _is_column)
    columns = _columns(table, name)
    names = [name.strip().lower() for name in table.names]
    further = {key: names.index(name) for key, known in FURTHER.items() for name in known if name in names}
    outputs, wheel = (
        next((k for k, title in enumerate(table.names) if title.strip().lower() == name), None)
        for name in ("output", "wheel")
    )
    wheels: dict[str, str] = {}
    speed_unit = table.units[columns["speed"]]
    if (speed_factor := known_factor(speed_unit or "rev/min", "speed")) is None:
        raise InputError(f"{name}: its speeds are in {shown(speed_unit)}; {nearest(speed_unit, UNITS['speed'])}")
    points: dict[str, dict[float, list[tuple[float, float, float, float]]]] = {}
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
        output, scale = _amplitude_unit(unit, where, kinds)
        if outputs is not None and (own := cells[outputs].strip()):
            if own not in LAID_OVER:
                raise InputError(f"{where}: output {shown(own)} takes no measured orders; {nearest(own, LAID_OVER)}")
            output = own
        if wheel is not None and (teeth := cells[wheel].strip()):
            wheels[output] = teeth
        phase, band = (_optional(table, cells, further.get(key)) for key in FURTHER)
        point = speed * speed_factor.scale, scale * amplitude, math.radians(phase), scale * band
        points.setdefault(output, {}).setdefault(order, []).append(point)
    if not points:
        raise InputError(f"{name}: holds no points; {REMEDY}")
    found = _measured(points, name)
    found.wheels = None if wheel is None else wheels
    return found


def _is_column(word: str) -> bool:
    """True if a word of a header is the name of a column of measured orders."""
    name = word.strip().lower()
    return bool(kind_of(named(word)[0], KINDS)) or name in OWN or any(name in known for known in FURTHER.values())


def _of_curves(curves: Sequence[OrderCurve], name: str, kinds: Mapping[str, str]) -> MeasuredOrders:
    """Measured orders from ``curves``, each with the amplitudes of one order over speed."""
    points: dict[str, dict[float, list[tuple[float, float, float, float]]]] = {}
    for curve in curves:
        output, scale = _amplitude_unit(curve.unit, f"{name}, {curve.name}", kinds)
        rows = zip(curve.speeds.tolist(), (scale * curve.amplitudes).tolist(), curve.phases.tolist(), strict=True)
        points.setdefault(output, {}).setdefault(curve.order, []).extend((*row, math.nan) for row in rows)
    return _measured(points, name)


def _measured(
    points: Mapping[str, Mapping[float, list[tuple[float, float, float, float]]]], name: str
) -> MeasuredOrders:  # fmt: skip
    found = MeasuredOrders()
    for output, by_order in points.items():
        for order, rows in sorted(by_order.items()):
            for speed, *values in rows:
                _check_sizes(speed, values, f"{name}: order {order:g} of {output}")
            found.put(output, order, rows)
    return found


def _check_sizes(speed: float, values: Sequence[float], where: str) -> None:
    """Refuse impossible values of a point with ``InputError``, so that squares of values and their sums are finite.

    ``values`` are amplitude (SI), phase (rad) and half width of the band (SI); the last two are NaN if not known.
    """
    if not 0.0 < speed <= LARGEST:
        raise InputError(f"{where}: speed {speed:g} rad/s is not one of an engine; correct its row")
    for what, value in zip(("amplitude", "phase", "band"), values, strict=True):
        known = what == "amplitude" or not math.isnan(value)
        narrow = what == "band" and 0.0 < value < LEAST
        if known and (narrow or not (abs(value) <= LARGEST and (value >= 0.0 or what == "phase"))):
            raise InputError(
                f"{where}: its {what} at {speed / RPM:.6g} rev/min is {value:.3g} (SI), which is not one "
                "of an engine; correct its row"
            )


def _optional(table: TextRows, cells: list[str], column: int | None) -> float:
    """Number of an optional cell, NaN if it is missing or not a number."""
    if column is None or not cells[column].strip():
        return math.nan
    try:
        return float(table.dialect.number(cells[column]))
    except ValueError:
        return math.nan


def _columns(table: TextRows, name: str) -> dict[str, int]:
    """Indices of the columns of speed, order, amplitude and, if present, unit."""
    found = columns_of(table.names, KINDS)
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


def _amplitude_unit(unit: str, where: str, kinds: Mapping[str, str]) -> tuple[str, float]:
    """Output to which an amplitude belongs by its unit, and the factor of this unit to SI."""
    for dimension, output in kinds.items():
        if unit and (found := known_factor(unit, dimension)):
            return output, found.scale
    valid = [known for dimension in kinds for known in UNITS[dimension]]
    valid += ["mdeg", "mrad"] if "angle" in kinds else []
    raise InputError(f"{where}: unit {shown(unit)} is unknown; {nearest(unit, valid)}")


def _number(table: TextRows, text: str, key: str, where: str) -> float:
    """Number in a cell of the table; ``InputError`` for negative numbers, and for a speed or order of zero."""
    try:
        value = table.dialect.number(text)
    except ValueError:
        raise InputError(f"{where}: {key} {shown(text)} is not a number") from None
    if not math.isfinite(value) or value < 0.0 or (value == 0.0 and key != "amplitude"):
        raise InputError(f"{where}: {key} {text or 'is missing, it'} is not positive")
    return value
