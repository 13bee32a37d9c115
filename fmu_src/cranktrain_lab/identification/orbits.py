"""Measured orbits of journals: displacement of a main journal in its bore over the crank angle of whole cycles.

    crank_angle [deg], x [um], y [um]
    0,   -3.1, -24.2
    4,   -2.7, -24.9

x is across the engine, y upwards along the cylinders, the crank turns from x to y, and angle 0 is firing dead centre of
cylinder 1. For probes in other directions, x and y are rotated by ``probe_angle``. Samples of all cycles are averaged
in up to :data:`MOST` intervals of crank angle.

Probes do not measure the middle of the bore, because it moves with temperature and their zero drifts. The means of
measured and computed orbit are therefore removed unless ``centre`` is ``bore``.

The fit treats an orbit as a complex function z = x + i y of the crank angle, as it treats an order as a function of the
speed. Its bias is correlated over the crank angle (:mod:`cranktrain_lab.identification.bias`).
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.column_names import kind_of
from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.stated_units import begins_as_number, in_unit, stated
from cranktrain.core.text_header import chosen, plain_name
from cranktrain.core.text_table import TextTable, read_table
from cranktrain.core.types import Array
from cranktrain.core.units import RPM, UNITS, known_factor
from cranktrain.core.user_file import beside
from cranktrain.engine.model import Engine
from cranktrain_lab.identification.data import Orbit, name_of_set, noise_of
from cranktrain_lab.identification.parameters import Sought
from cranktrain_lab.identification.tables import OrbitTable
from cranktrain_lab.measured.order_table import BEYOND

MOST = 180
"""Largest number of points of an orbit that are fitted."""
WIDEST = math.radians(10.0)
"""Largest step of the crank angle, because films close and open within some ten degrees."""
NEVER = 1.5
"""Ratio of orbit width to diametral clearance above which an orbit is refused. Elastic bores deform less than this."""
STILL = 1e-6
"""Ratio of orbit width to clearance below which an orbit counts as no motion."""
CLEARANCE = "main_bearing.clearance"
FREE, BORE = "free", "bore"
_REMEDY = "give lines of crank_angle [deg], x [um], y [um] under this header"


class _Cycle(NamedTuple):
    """Averaged cycle of n samples over increasing crank angle (rad), and number of samples averaged in each."""

    angles: Array
    values: NDArray[np.complex128]
    counts: Array


def read_orbits(engine: Engine, tables: Sequence[OrbitTable], path: Path, names: Sequence[str]) -> tuple[Orbit, ...]:
    """Return orbits of a measured file at ``path``; ``names``: of its other data sets; raises ``InputError``."""
    taken, found = list(names), []
    for table in tables:
        name = name_of_set(table.name or Path(table.file).stem, taken)
        found.append(_orbit(engine, table, name, path))
    return tuple(found)


def _orbit(engine: Engine, table: OrbitTable, name: str, path: Path) -> Orbit:
    where = f"[[orbit]] '{name}'"
    bearing, speed = _bearing(engine, table.bearing, where), table.rpm * RPM
    low, high = engine.speeds
    if not low * (1.0 - BEYOND) <= speed <= high * (1.0 + BEYOND):
        raise InputError(
            f"{where}: {table.rpm:g} rev/min lies outside the speeds of '{engine.name}', {low / RPM:.0f} to "
            f"{high / RPM:.0f} rev/min"
        )
    cycle = _cycle(engine, table, where, path)
    noise = noise_of(table.noise, "length", f"{where}.noise", "0.5 um") or math.nan
    values = cycle.values * np.exp(1j * _turn(table.probe_angle, f"{where}.probe_angle"))
    values = values - values.mean() if table.centre == FREE else values
    still = np.zeros(cycle.angles.size, dtype=bool)
    return Orbit(
        name, f"bearing[{bearing}].position", 0.0, cycle.angles, np.asarray(values), noise / np.sqrt(cycle.counts),
        still, True, bearing, speed, table.centre == FREE,
    )  # fmt: skip


def _bearing(engine: Engine, name: str, where: str) -> int:
    """Return the number of a main bearing with a film, from 1; raises ``InputError``."""
    names = [f"main[{i + 1}]" for i in range(len(engine.crankshaft.main_widths))]
    if name not in names:
        raise InputError(f"{where}: no main bearing is called {shown(name)}; {nearest(name, names)}")
    number = names.index(name)
    if number not in engine.plain_numbers:
        plain = ", ".join(names[i] for i in engine.plain_numbers)
        raise InputError(
            f"{where}: {name} of '{engine.name}' runs on rollers, whose orbit no oil film determines; "
            + (f"valid: {plain}" if plain else "none of its mains has a film")
        )
    return number + 1


def _cycle(engine: Engine, table: OrbitTable, where: str, path: Path) -> _Cycle:
    """Return the averaged cycle of an orbit's file; raises ``InputError``."""
    name = Path(table.file).name
    read = read_table(beside(path, table.file), "file of a journal's orbit", _REMEDY)
    columns = _columns(read, table, f"{where}: {name}")
    scale = []
    for k, dimension, usual in zip(columns, ("angle", "length", "length"), ("deg", "", ""), strict=True):
        unit = read.units[k] or usual
        own = known_factor(unit, dimension) if unit else None
        if own is None:
            said = f"is in {shown(unit)}" if unit else "states no unit"
            near = nearest(unit, UNITS[dimension]) if unit else f"write '{read.names[k]} [um]' in its header"
            raise InputError(f"{where}: {name}, column '{read.names[k]}' {said}, no {dimension}; {near}")
        scale.append(own.scale)
    rows = read.values[:, columns] * scale
    if rows.shape[0] < 2 or not np.isfinite(rows).all():
        lacking = int((~np.isfinite(rows)).any(axis=1).sum())
        raise InputError(f"{where}: {name} has {rows.shape[0]} lines, {lacking} of them without a number; {_REMEDY}")
    return _laid_over(rows[:, 0], rows[:, 1] + 1j * rows[:, 2], engine.cylinders.cycle, f"{where}: {name}")


def _columns(read: TextTable, table: OrbitTable, where: str) -> list[int]:
    """Return columns of angle, x and y, from the table or by their usual names; raises ``InputError``."""
    if table.columns:
        if len(table.columns) != 3:
            raise InputError(f"{where}: columns names {len(table.columns)}; name three, of angle, x and y")
        return [chosen(one, read.names, read.units, where) for one in table.columns]
    angles = [k for k, name in enumerate(read.names) if kind_of(name, ("angle",))]
    found = [angles, *([k for k, name in enumerate(read.names) if plain_name(name) == axis] for axis in "xy")]
    for places, what in zip(found, ("crank_angle", "x", "y"), strict=True):
        if len(places) != 1:
            said = "several columns" if places else "no column"
            named = ", ".join(read.names)
            raise InputError(f"{where} has {said} {what} among {named}; name angle, x and y in columns")
    return [places[0] for places in found]


def _laid_over(angle: Array, values: NDArray[np.complex128], cycle: float, where: str) -> _Cycle:
    """Average n samples of whole cycles over one cycle; ``InputError`` for incomplete cycles or wide steps."""
    # Angles that restart with each cycle or revolution are made continuous.
    turn = 2.0 * math.pi
    steps = np.diff(angle)
    steps = np.where(steps < -0.5 * turn, np.mod(steps, turn), steps)
    if np.any(steps <= 0.0):
        k = int(np.argmax(steps <= 0.0)) + 1
        raise InputError(f"{where}: the crank angle does not rise at sample {k + 1}; sort the samples by their time")
    angle = angle[0] + np.concatenate(([0.0], np.cumsum(steps)))
    step, degrees = float(np.median(steps)), math.degrees(cycle)
    if steps.max() > WIDEST:
        raise InputError(
            f"{where}: its crank angles are up to {math.degrees(steps.max()):.3g} deg apart; an orbit takes steps of "
            f"{math.degrees(WIDEST):.0f} deg or less"
        )
    covered = (angle[-1] - angle[0] + step) / cycle
    whole = round(covered - 0.5 * step / cycle)  # a last sample that repeats the first sample adds no cycle
    if whole < 1 or abs(covered - whole) * cycle > 1.5 * step:
        raise InputError(
            f"{where}: its crank angles cover {covered:.3g} cycles of {degrees:.0f} deg; an orbit is measured over "
            "whole cycles"
        )
    phase = np.mod(angle, cycle)
    count = min(MOST, max(8, round(cycle / step)))
    bins = (phase * (count / cycle) + 1e-6).astype(int) % count
    counts = np.bincount(bins, minlength=count)
    full = counts > 0

    def mean(own: Array) -> Array:
        return np.asarray(np.bincount(bins, own, count)[full] / counts[full])

    return _Cycle(mean(phase), np.asarray(mean(values.real) + 1j * mean(values.imag)), counts[full].astype(float))


def _turn(value: float | str, where: str) -> float:
    """Return an angle, rad; numbers without unit are degrees; raises ``InputError``."""
    if begins_as_number(value) and isinstance(value, str):
        try:
            return in_unit(stated(value, "45 deg"), "rad", "angle")
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
    if isinstance(value, str) or not math.isfinite(value):
        raise InputError(f"{where}: {shown(value)} is no angle; write '45 deg'")
    return math.radians(value)


def check_orbits(engine: Engine, orbits: Sequence[Orbit], sought: Sequence[Sought]) -> None:
    """Raise ``InputError`` for orbits that do not fit into their bearing at the largest sought clearance."""
    for one in orbits:
        assert engine.main_bearing is not None
        own = [s.high for s in sought if s.key == CLEARANCE] or [engine.main_bearing.clearance]
        across = one.values[:, None] - one.values if one.free else 2.0 * one.values
        width = float(np.abs(across).max())
        if width < STILL * own[0]:
            raise InputError(
                f"[[orbit]] '{one.name}': the journal does not move: its orbit is {1e6 * width:.2g} um wide; check "
                "that the file holds displacements, and their unit"
            )
        if width > NEVER * 2.0 * own[0]:
            what = "width" if one.free else "twice its largest distance from the bore's middle"
            raise InputError(
                f"[[orbit]] '{one.name}': {what} is {1e6 * width:.4g} um, {width / (2.0 * own[0]):.3g} times the "
                f"{'largest sought ' if len(own) and own[0] != engine.main_bearing.clearance else ''}diametral "
                f"clearance of main[{one.bearing}], {2e6 * own[0]:.4g} um; check the unit and the gain of the probes, "
                f"or that they do not measure against a moving block"
            )
