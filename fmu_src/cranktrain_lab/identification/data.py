"""Measured sets as arrays: orders over speed, natural frequencies, decays and shapes, with held-out points."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.stated_units import begins_as_number, in_unit, stated
from cranktrain.core.types import Array
from cranktrain.core.units import RPM, UNITS
from cranktrain.core.user_file import beside
from cranktrain.engine.model import Engine
from cranktrain.results.orders.measured import LARGEST, LEAST, OUTPUTS, MeasuredOrders, read_measured_orders
from cranktrain.structure.crank.torsional import shaft_nodes
from cranktrain.studies.torsion.frequency_run_up import HIGHEST_ORDER, shaft_output
from cranktrain_lab.identification.decays import measured_damping_ratio
from cranktrain_lab.identification.tables import (
    DecayTable,
    FrequencyTable,
    MeasuredTable,
    ModeTable,
    OrdersTable,
    TorqueTable,
)
from cranktrain_lab.measured.order_table import check_speeds
from cranktrain_lab.measured.tracking import BAND

FREQUENCY, RATIO, TARGET, MOUNTS = "frequency", "damping ratio", "target", "mount frequency"
"""Kinds of measured numbers: two of torsional modes, two of the bending crank in its block."""
FEWEST = 4
"""Least number of speeds of an order."""


@dataclass(frozen=True)
class Strand:
    """Measured order of a set over speed.

    Attributes
    ----------
    name, output, order : name of the set, measured output, and order
    speeds : (n,) rad/s
    values : (n,) complex amplitudes, rad or N m; real if only amplitudes are compared
    noise : (n,) standard deviation of each component; NaN if unknown
    held : (n,) True for points held out of the fit
    phases : True if phases are compared
    wheel : True if a toothed wheel adds an unknown constant to the order
    """

    name: str
    output: str
    order: float
    speeds: Array
    values: NDArray[np.complex128]
    noise: Array
    held: NDArray[np.bool_]
    phases: bool
    wheel: bool = field(default=False, kw_only=True)


@dataclass(frozen=True)
class Orbit(Strand):
    """Measured orbit, as a strand over crank angles.

    ``speeds`` (n,) are crank angles, rad, ``values`` (n,) displacements x + i y, m.

    Attributes
    ----------
    bearing : number of the main bearing, from 1
    speed : speed, rad/s
    free : True if the mean position is not compared
    """

    bearing: int
    speed: float
    free: bool

    def seen(self, orbit: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Return a computed orbit (n,) as the probes measure it, minus its mean if the measured mean is arbitrary."""
        return np.asarray(orbit - orbit.mean() if self.free else orbit)


@dataclass(frozen=True)
class Scalar:
    """Measured number: a natural frequency (Hz) or the damping ratio of a torsional mode.

    ``deviation`` is the relative standard deviation. ``damper``: mode with the damper's ring, at the damper temperature
    of ``speed``, rad/s (None: the engine's highest).
    """

    name: str
    kind: str
    number: int
    value: float
    deviation: float
    damper: bool
    speed: float | None = None


@dataclass(frozen=True)
class Shape:
    """Measured shape of a torsional mode at interfaces of the crank, of unit length, with its standard deviation."""

    name: str
    number: int
    places: tuple[str, ...]
    values: Array
    deviation: float


@dataclass(frozen=True)
class Data:
    """All data of a measured file."""

    strands: tuple[Strand, ...] = ()
    scalars: tuple[Scalar, ...] = ()
    shapes: tuple[Shape, ...] = ()
    orbits: tuple[Orbit, ...] = ()
    """Orbits of journals. They are compared only after runs in time, see :meth:`with_orbits`."""

    def with_orbits(self) -> "Data":
        """Return the data with orbits appended to the strands, after all orders."""
        return replace(self, strands=(*self.strands, *self.orbits), orbits=())

    @property
    def names(self) -> list[str]:
        """Names of the data sets, in the order of the measured file."""
        return list(dict.fromkeys(self.of_pieces))

    @property
    def of_pieces(self) -> list[str]:
        """Name of the data set to which each order, number and mode shape belongs."""
        strands, numbers = [one.name for one in self.strands], [one.name for one in self.scalars]
        return [*strands, *numbers, *(one.name for one in self.shapes)]

    @property
    def deviations(self) -> list[float]:
        """Standard deviation of each number and shape."""
        return [*(one.deviation for one in self.scalars), *(one.deviation for one in self.shapes)]

    @property
    def order_sets(self) -> list[str]:
        """Names of the sets of orders and orbits."""
        return list(dict.fromkeys(one.name for one in (*self.strands, *self.orbits)))


def read_data(engine: Engine, read: MeasuredTable, path: Path) -> Data:
    """Return the data of a measured file at ``path``; raises ``InputError``."""
    names: list[str] = []
    strands: list[Strand] = []
    tables: list[tuple[OrdersTable | TorqueTable, str]] = [(one, "orders") for one in read.orders]
    tables += [(one, "torque") for one in read.torque]
    for table, kind in tables:
        name = name_of_set(table.name or Path(table.file).stem, names)
        strands += _strands(engine, table, name, f"[[{kind}]] '{name}'", path)
    held = [] if read.hold_out is None else read.hold_out.speeds_rpm
    strands = _held(strands, held) if held else strands
    scalars = [
        _frequency(one, name_of_set(one.name or f"{one.of} frequency {one.number}".removeprefix("torsion "), names))
        for one in read.frequencies
    ]
    scalars += [_decay(one, name_of_set(one.name or f"decay {one.number}", names), path) for one in read.decay]
    shapes = [_shape(engine, one, name_of_set(one.name or f"mode {one.number}", names)) for one in read.modes]
    return Data(tuple(strands), tuple(scalars), tuple(shapes))


def name_of_set(wanted: str, names: list[str]) -> str:
    """Return a data set's name, with a number if another data set has this name, and add the name to ``names``."""
    found, k = wanted, 1
    while found in names:
        k += 1
        found = f"{wanted} {k}"
    names.append(found)
    return found


def _strands(engine: Engine, table: OrdersTable | TorqueTable, name: str, where: str, path: Path) -> list[Strand]:
    """Return the measured orders of a data set; raises ``InputError``."""
    torque = isinstance(table, TorqueTable)
    output, kinds = (_shaft(engine, table.shaft, where), {"torque": "torque"}) if isinstance(table, TorqueTable) else (
        table.output, OUTPUTS)  # fmt: skip
    found = read_measured_orders(beside(path, table.file), kinds)
    assert isinstance(found, MeasuredOrders)
    own = "torque" if torque else output if output in found else OUTPUTS["angle"]
    if own not in found:
        raise InputError(f"{where}: {Path(table.file).name} has no orders of {output}; {nearest(output, found)}")
    wanted = sorted(found[own]) if not table.orders else sorted(set(table.orders))
    wheel = not torque and (found.wheels is None or own in found.wheels)  # as the file states, else true
    if isinstance(table, OrdersTable) and table.wheel is not None:
        wheel = table.wheel
    noise = noise_of(table.noise, "torque" if torque else "angle", f"{where}.noise")
    strands = []
    for order in wanted:
        if order not in found[own]:
            near = nearest(f"{order:g}", [f"{one:g}" for one in found[own]])
            raise InputError(f"{where}: {Path(table.file).name} has no order {order:g}; {near}")
        if not 0.5 <= order <= HIGHEST_ORDER:
            raise InputError(f"{where}: order {order:g} is not within 0.5 to {HIGHEST_ORDER:g}, those of the model")
        speeds, sizes = found[own][order]
        phases, bands = found.phases[own][order], found.bands[own][order]
        keep = np.ones(speeds.size, dtype=bool)
        if (ends := table.speeds) is not None:
            keep = (speeds >= ends.first * RPM * (1 - 1e-9)) & (speeds <= ends.last * RPM * (1 + 1e-9))
        if int(keep.sum()) < FEWEST:
            raise InputError(
                f"{where}: order {order:g} has {int(keep.sum())} speeds; a fit takes {FEWEST} or more of each order"
            )
        check_speeds(engine, speeds[keep], where, "cut them by speeds = {{ from = {low}, to = {high} }}")
        missing = int(np.isnan(phases[keep]).sum())
        if missing and not table.amplitudes_only:
            raise InputError(
                f"{where}: order {order:g} has no phase at {missing} of {int(keep.sum())} speeds; measure it against a "
                "tacho, or write amplitudes_only = true to fit amplitudes alone"
            )
        angle = np.zeros(int(keep.sum())) if table.amplitudes_only else phases[keep]
        spread = bands[keep] / BAND if noise is None else np.full(int(keep.sum()), noise)
        spread = np.where(spread > 0.0, spread, math.nan)
        strands.append(
            Strand(name, output, order, speeds[keep], sizes[keep] * np.exp(1j * angle), spread,
                   np.zeros(int(keep.sum()), dtype=bool), not table.amplitudes_only, wheel=wheel and order % 1.0 == 0.0)
        )  # fmt: skip
    return strands


def _shaft(engine: Engine, shaft: str, where: str) -> str:
    """Return the output of a shaft's torque; raises ``InputError`` for a shaft that the drive line lacks."""
    line = engine.drive_line_chain
    names = [] if line is None else [f"{a} to {b}" for a, b in zip(line.starts, line.ends, strict=True)]
    if not names:
        raise InputError(f"{where}: engine '{engine.name}' has no [drive_line_chain], whose shafts have torques")
    if shaft not in names:
        raise InputError(f"{where}: no shaft is called '{shaft}'; {nearest(shaft, names)}")
    return shaft_output(shaft)


def noise_of(value: Any, dimension: str, where: str, example: str = "0.001 deg") -> float | None:
    """Return the standard deviation of a set's noise, SI, from a number or a text with unit; None if none is stated."""
    if value is None:
        return None
    if begins_as_number(value):
        try:
            value = in_unit(stated(value, example), next(iter(UNITS[dimension])), dimension, True)
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
    if not isinstance(value, int | float) or not LEAST <= value <= LARGEST:
        raise InputError(f"{where}: {shown(value)} is no standard deviation; write '{example}'")
    return float(value)


def _held(strands: list[Strand], speeds_rpm: Sequence[float]) -> list[Strand]:
    """Return strands with the points nearest to each speed held out; raises ``InputError`` for a speed not measured."""
    if not strands:
        raise InputError("hold_out: holds out speeds of [[orders]] or [[torque]], and the file has neither")
    for rpm in speeds_rpm:
        reach = [_reach(one.speeds) for one in strands]
        near = [np.abs(one.speeds - rpm * RPM) <= far for one, far in zip(strands, reach, strict=True)]
        if not any(one.any() for one in near):
            first, last = min(s.speeds.min() for s in strands) / RPM, max(s.speeds.max() for s in strands) / RPM
            raise InputError(
                f"hold_out.speeds_rpm: {rpm:g} was not measured; the data go from {first:.0f} to {last:.0f} rev/min"
            )
        strands = [
            replace(
                one,
                held=one.held | (at & (np.abs(one.speeds - rpm * RPM) <= np.abs(one.speeds - rpm * RPM).min() + 1e-9)),
            )
            for one, at in zip(strands, near, strict=True)
        ]
    for one in strands:
        if (~one.held).sum() < FEWEST:
            raise InputError(
                f"hold_out.speeds_rpm: leaves {int((~one.held).sum())} of {one.held.size} speeds of order "
                f"{one.order:g} of '{one.name}' to be fitted; hold out fewer"
            )
    return strands


def _reach(speeds: Array) -> float:
    """Return half of the mean distance between neighbouring measured speeds, rad/s."""
    different = np.unique(speeds)
    return 0.5 * float(np.diff(different).mean()) + 1e-6 if different.size > 1 else 1.0


def _frequency(table: FrequencyTable, name: str) -> Scalar:
    where, mounts = f"[[frequencies]] '{name}'", table.of == "mounts"
    if mounts and (table.number > 6 or table.damper or table.hz is None):
        raise InputError(f"{where}: of mounts take hz and a number from 1 to 6, counted from the lowest")
    if (table.hz is None) == (table.order is None and table.rpm is None):
        raise InputError(f"{where}: give either hz, or order and rpm of a critical speed")
    hz = table.hz
    if hz is None:
        if table.order is None or table.rpm is None:
            raise InputError(f"{where}: {'order' if table.order is None else 'rpm'} is missing; give both of them")
        hz = table.order * table.rpm / 60.0
    speed = None if table.rpm is None else table.rpm * RPM
    return Scalar(name, MOUNTS if mounts else FREQUENCY, table.number, hz, table.deviation, table.damper, speed)


def _decay(table: DecayTable, name: str, path: Path) -> Scalar:
    where = f"[[decay]] '{name}'"
    given = [table.damping_ratio, table.log_decrement, table.file]
    if sum(one is not None for one in given) != 1:
        raise InputError(f"{where}: give one of damping_ratio, log_decrement and file")
    if table.damping_ratio is not None:
        ratio = table.damping_ratio
    elif table.log_decrement is not None:
        ratio = table.log_decrement / math.hypot(2.0 * math.pi, table.log_decrement)
    else:
        assert table.file is not None
        ratio = measured_damping_ratio(beside(path, table.file), table.channel, where)
    return Scalar(name, RATIO, table.number, ratio, table.deviation, table.damper)


def _shape(engine: Engine, table: ModeTable, name: str) -> Shape:
    where, known = f"[[modes]] '{name}'", shaft_nodes(engine)
    for place in table.shape:
        if place not in known:
            raise InputError(f"{where}: '{place}' is no place of the crank; {nearest(place, known)}")
    values = np.array(list(table.shape.values()))
    if values.size < 2 or not np.any(values):
        raise InputError(f"{where}: a shape has rotations of two places or more, not all zero")
    values = values / np.abs(values).max()  # avoids overflow of the squares
    return Shape(name, table.number, tuple(table.shape), values / np.linalg.norm(values), table.deviation)
