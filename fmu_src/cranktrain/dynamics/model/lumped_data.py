"""Table of the lumped data of an engine that an FMU's parameters may change, with their names and slots.

A row is a value of the engine file by its name there, with its slot among the numbers of a run. The reduced bodies and
the film tables stay those of the engine file; :mod:`cranktrain.dynamics.model.trimming` writes the consequences of new
values into a model. Bounds are those of the engine file's checks.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from types import UnionType
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.types import Array
from cranktrain.core.units import OFFSETS, UNITS
from cranktrain.dynamics.model import numbers as at
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import Quantity


def _rods_alone(engine: Engine) -> bool:
    """True if the engine has no articulated rods, whose masses differ from rod to rod."""
    return not any(engine.articulations)


def _films(engine: Engine) -> bool:
    return engine.main_bearing is not None or engine.big_end_bearing is not None


def _vogel(engine: Engine) -> bool:
    return engine.oil.law == "vogel" and _films(engine)


def _damper(*kinds: str) -> Callable[[Engine], bool]:
    def fits(engine: Engine) -> bool:
        return engine.damper is not None and engine.damper.kind in kinds and not engine.damper.frequencies

    return fits


@dataclass(frozen=True)
class Lumped:
    """One row of the table of lumped data: one value, or one value for each mount if ``each`` is set.

    Attributes
    ----------
    table, key : table and key in the engine file
    slot : slot among the numbers of a run; for mounts that of the first one
    unit, display_unit : units of the FMU's variable, as named in units.toml
    title : one line for users
    fits : whether an engine that has the table has this value
    each : whether the value is a list with one number for each mount
    """

    table: str
    key: str
    slot: int
    unit: str
    title: str
    display_unit: str | None = None
    fits: Callable[[Engine], bool] = lambda engine: True
    each: bool = False


def _part(table: str, slot: int, what: str) -> tuple[Lumped, ...]:
    """Rows of the table for a rigid part fixed to the crankshaft."""
    inertia = "about its centre of mass"
    return (
        Lumped(table, "mass", slot + at.PART_MASS, "kg", f"Mass of the {what}"),
        Lumped(table, "polar_inertia", slot + at.PART_POLAR, "kg.m2", f"Inertia of the {what} about the crank's axis"),
        Lumped(
            table, "diametral_inertia", slot + at.PART_DIAMETRAL, "kg.m2",
            f"Inertia of the {what} about a diameter, {inertia}; at least half the polar one",
        ),
        Lumped(
            table, "offset", slot + at.PART_OFFSET, "m",
            f"Place of the centre of mass of the {what} along the axis from where it is fixed", "mm",
        ),
    )  # fmt: skip


def _mounts() -> tuple[Lumped, ...]:
    """Rows of the table for stiffness and damping of the mounts."""
    units = {"stiffness": ("N/m", "N.m/rad"), "damping": ("N.s/m", "N.m.s/rad")}
    return tuple(
        Lumped(
            "mounts", f"{key}_{axis}", at.SET_MOUNTS + 6 * first + k, units[key][k > 2],
            f"{key.capitalize()} of the mount {'about' if k > 2 else 'along'} {axis[-1]}",
            fits=lambda engine: engine.block is not None, each=True,
        )
        for first, key in enumerate(units)
        for k, axis in enumerate(("x", "y", "z", "rx", "ry", "rz"))
    )  # fmt: skip


TABLE: tuple[Lumped, ...] = (
    *_part("flywheel", at.SET_FLYWHEEL, "flywheel"),
    *_part("clutch", at.SET_CLUTCH, "clutch"),
    *_part("pulley", at.SET_PULLEY, "pulley, without damper"),
    Lumped("damper", "mass", at.SET_DAMPER_MASS, "kg", "Mass of the damper, which the pulley carries"),
    Lumped(
        "damper", "housing_inertia", at.SET_HOUSING, "kg.m2",
        "Inertia of the damper's part that turns as one with the pulley",
    ),
    Lumped("damper", "ring_inertia", at.SET_RING, "kg.m2", "Inertia of the damper's ring"),
    Lumped(
        "damper", "viscosity", at.SET_FLUID, "Pa.s",
        "Viscosity of the damper's fluid at 25 degC without shear", fits=_damper("viscous"),
    ),
    Lumped(
        "damper", "stiffness", at.SET_SPRING, "N.m/rad",
        "Stiffness between the damper's ring and its hub", fits=_damper("rubber", "linear"),
    ),
    Lumped(
        "damper", "loss_factor", at.SET_SPRING_LOSS, "1",
        "Loss factor of the damper's rubber", fits=_damper("rubber"),
    ),
    Lumped(
        "damper", "damping", at.SET_SPRING_LOSS, "N.m.s/rad",
        "Damping between the damper's ring and its hub", fits=_damper("linear"),
    ),
    Lumped("rod", "big_end_mass", at.SET_BIG_END, "kg", "Mass of each rod at its big end", fits=_rods_alone),
    Lumped("rod", "small_end_mass", at.SET_SMALL_END, "kg", "Mass of each rod at its small end", fits=_rods_alone),
    Lumped(
        "rod", "inertia", at.SET_ROD_INERTIA, "kg.m2",
        "Inertia of each rod about its centre of mass", fits=_rods_alone,
    ),
    Lumped("cylinders", "piston_mass", at.SET_PISTON, "kg", "Mass of each piston with pin and rings", fits=_rods_alone),
    Lumped(
        "drive_line", "stiffness", at.SET_LINE_STIFFNESS, "N.m/rad",
        "Stiffness of the connecting shaft", fits=lambda engine: engine.drive_line_chain is None,
    ),
    Lumped(
        "drive_line", "damping", at.SET_LINE_DAMPING, "N.m.s/rad",
        "Damping of the connecting shaft", fits=lambda engine: engine.drive_line_chain is None,
    ),
    Lumped(
        "drive_line", "dynamometer_inertia", at.SET_DYNAMOMETER, "kg.m2",
        "Inertia of the dynamometer, which counts at shaft.boundary torque",
    ),
    Lumped("axial_path", "mass", at.SET_PATH_MASS, "kg", "Mass of the connecting shaft that moves along the axis"),
    Lumped(
        "axial_path", "stiffness", at.SET_PATH_STIFFNESS, "N/m",
        "Stiffness along the axis between connecting shaft and dynamometer",
    ),
    Lumped(
        "axial_path", "damping", at.SET_PATH_DAMPING, "N.s/m",
        "Damping along the axis between connecting shaft and dynamometer",
    ),
    Lumped(
        "main_bearing", "clearance", at.SET_MAIN_CLEARANCE, "m",
        "Radial clearance of the plain main bearings; bearing.level table, reynolds and ehd refuse another", "um",
    ),
    Lumped(
        "big_end_bearing", "clearance", at.SET_PIN_CLEARANCE, "m",
        "Radial clearance of the big ends; at big_end.level table and ehd another is refused", "um",
    ),
    Lumped(
        "oil", "vogel_a", at.SET_VOGEL_A, "Pa.s",
        "Viscosity A of the oil's law A exp(B/(T - C))", "mPa.s", fits=_vogel,
    ),
    Lumped("oil", "vogel_b", at.SET_VOGEL_B, "K", "Temperature B of the oil's law A exp(B/(T - C))", fits=_vogel),
    Lumped("oil", "vogel_c", at.SET_VOGEL_C, "K", "Temperature C of the oil's law A exp(B/(T - C))", fits=_vogel),
    *_mounts(),
)  # fmt: skip


class LumpedValue(NamedTuple):
    """One value of an engine: its name, slot and value (SI), the bounds of the engine file's checks, and its row."""

    name: str
    slot: int
    value: float
    low: float
    high: float
    row: Lumped


def lumped_values(engine: Engine) -> Iterator[LumpedValue]:
    """Values of an engine that parameters may change, in the order of the table."""
    for row in TABLE:
        part = getattr(engine, row.table)
        if part is None or not row.fits(engine):
            continue
        low, high = _bounds(row.table, row.key)
        if not row.each:
            value = float(getattr(part, row.key))
            # The default of a value that an engine file leaves out may lie below the lower bound for stated values.
            yield LumpedValue(f"{row.table}.{row.key}", row.slot, value, min(low, value), high, row)
            continue
        for k, value in enumerate(getattr(part, row.key)):
            name = f"{row.table}.{row.key}[{k + 1}]"
            yield LumpedValue(name, row.slot + at.MOUNT_NUMBERS * k, float(value), low, high, row)


@cache
def _bounds(table: str, key: str) -> tuple[float, float]:
    """Lower and upper bound (SI) of a value under ``key`` in a TOML table of an engine file."""
    kind = get_type_hints(Engine)[table]
    part = get_args(kind)[0] if isinstance(kind, UnionType) else kind
    hint = get_type_hints(part, include_extras=True)[key]
    hint = get_args(hint)[0] if get_origin(hint) is tuple else hint
    assert get_origin(hint) is Annotated
    [quantity] = (entry for entry in get_args(hint) if isinstance(entry, Quantity))
    units = UNITS[quantity.dimension]
    unit = quantity.unit or next(iter(units))
    scale, shift = units[unit], OFFSETS.get(unit, 0.0)
    return quantity.low * scale + shift, quantity.high * scale + shift


def lumped_numbers(engine: Engine, data: Mapping[str, float] | None = None) -> Array:
    """Numbers (numbers,) of a run: lumped values of ``engine``, replaced by ``data`` where given; all others are 0.

    Raises
    ------
    InputError
        a name that the engine lacks, or a value outside its range
    """
    found = {value.name: value for value in lumped_values(engine)}
    mounts = len(engine.mounts.x) if engine.mounts is not None else 0
    numbers = np.zeros(at.NUMBERS + at.MOUNT_NUMBERS * mounts)
    for one in found.values():
        numbers[one.slot] = one.value
    for name, value in (data or {}).items():
        if name not in found:
            raise InputError(f"engine '{engine.name}' has no value '{name}' to change; {nearest(name, found)}")
        one = found[name]
        if not one.low <= value <= one.high:
            raise InputError(f"'{name}' is {value:g}; it must be a finite number, between {one.low:g} and {one.high:g}")
        numbers[one.slot] = value
    return numbers


def split_data(engine: Engine, chosen: Mapping[str, Any]) -> tuple[dict[str, float], dict[str, Any]]:
    """Split chosen values by name into lumped values of an engine and all other values."""
    names = {value.name for value in lumped_values(engine)}
    data = {name: float(value) for name, value in chosen.items() if name in names}
    return data, {name: value for name, value in chosen.items() if name not in names}
