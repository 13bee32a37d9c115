"""The engine as data: frozen dataclasses in SI, read from an engine file.

Angles are radians here; an engine file gives each value with its unit and its origin. The annotation of a field
carries its dimension and its sign, from which the reader of engine files takes its checks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, asdict, dataclass, fields, is_dataclass
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

from cranktrain.errors import InputError


class Quantity(NamedTuple):
    """What a field measures: its dimension, and whether it must be positive, may be zero, or has either sign."""

    dimension: str
    sign: str = "positive"


Number = Annotated[float, Quantity("1", "zero")]
Length = Annotated[float, Quantity("length")]
Offset = Annotated[float, Quantity("length", "either")]
Angle = Annotated[float, Quantity("angle", "either")]
Mass = Annotated[float, Quantity("mass")]
Inertia = Annotated[float, Quantity("inertia")]
Density = Annotated[float, Quantity("density")]
Pressure = Annotated[float, Quantity("pressure")]
GaugePressure = Annotated[float, Quantity("pressure", "zero")]
Stiffness = Annotated[float, Quantity("stiffness")]
Damping = Annotated[float, Quantity("damping", "zero")]
TorsionalStiffness = Annotated[float, Quantity("torsional stiffness")]
TorsionalDamping = Annotated[float, Quantity("torsional damping", "zero")]
Viscosity = Annotated[float, Quantity("viscosity")]
Temperature = Annotated[float, Quantity("temperature")]
TemperatureDifference = Annotated[float, Quantity("temperature difference")]
Speed = Annotated[float, Quantity("speed", "zero")]
Frequency = Annotated[float, Quantity("frequency", "zero")]
Rate = Annotated[float, Quantity("rate", "zero")]
Time = Annotated[float, Quantity("time", "zero")]
Energy = Annotated[float, Quantity("energy")]
KinematicViscosity = Annotated[float, Quantity("kinematic viscosity")]
PressureCoefficient = Annotated[float, Quantity("pressure coefficient", "zero")]
HeatCapacity = Annotated[float, Quantity("heat capacity")]
Share = Annotated[float, Quantity("1")]


@dataclass(frozen=True)
class Material:
    """Linear isotropic material (Pa, 1, kg/m³)."""

    youngs_modulus: Pressure
    poisson_ratio: Number
    density: Density


@dataclass(frozen=True)
class Crankshaft:
    """Parametric crankshaft geometry, m and rad; one main journal more than there are throws."""

    throw: Length
    throw_angles: tuple[Angle, ...]
    main_diameter: Length
    main_widths: tuple[Length, ...]
    pin_diameter: Length
    pin_width: Length
    web_thickness: Length
    web_main_radius: Length
    web_pin_radius: Length
    counterweight_radius: Length
    counterweight_half_width: Length
    counterweights: tuple[bool, ...]
    nose_diameter: Length
    nose_length: Length
    flange_diameter: Length
    flange_length: Length
    fillet: Length
    oil_hole_diameter: Length
    oil_holes: bool
    mesh_size: Length


@dataclass(frozen=True)
class LumpedInertia:
    """A rigid part fixed to an interface (kg, kg m², m); offset is along z from the interface to its centre of mass."""

    mass: Mass
    polar_inertia: Inertia
    diametral_inertia: Inertia
    offset: Offset


@dataclass(frozen=True)
class Rod:
    """Connecting rod: length, masses at big and small end, and the true inertia about its centre of mass."""

    length: Length
    big_end_mass: Mass
    small_end_mass: Mass
    inertia: Inertia


@dataclass(frozen=True)
class Cylinders:
    """Cylinders in the order of their numbers; angles rad, lengths m."""

    bore: Length
    firing_order: tuple[int, ...]
    pins: tuple[int, ...]
    bank_angles: tuple[Angle, ...]
    piston_mass: Mass
    pin_offset: Offset
    compression_ratio: Number


@dataclass(frozen=True, kw_only=True)
class PlainBearing:
    """Plain bearing: film geometry, and contact of its rough surfaces.

    Level ``impedance`` takes ``contact_height`` and ``contact_pressure``; the levels above it take the surfaces as
    Greenwood and Tripp do: ``roughness`` σ of both together, ``asperity_factor`` ηβσ, ``asperity_ratio`` σ/β,
    ``contact_modulus`` E' and boundary friction (coefficient on the contact pressure, stress on the real contact).
    ``groove`` is ``none`` or ``circumferential``. Level ``ehd`` follows the oil from a supply at ``supply_pressure``:
    the groove, or one in mid-bore that is ``supply_arc`` long and ``supply_width`` wide about ``supply_angle`` (from
    the x axis in the sense of rotation); as it comes, the upper half.
    """

    diameter: Length
    width: Length
    clearance: Length
    contact_height: Length
    contact_pressure: Pressure
    groove: str = "none"
    roughness: Length = 0.4e-6
    asperity_factor: Share = 0.05
    asperity_ratio: Share = 0.01
    contact_modulus: Pressure = 58.6e9
    boundary_friction: Number = 0.1
    boundary_shear: GaugePressure = 0.0
    supply_pressure: GaugePressure = 4.0e5
    supply_angle: Angle = 0.5 * math.pi
    supply_arc: Angle = math.pi
    supply_width: Length = 4.0e-3


@dataclass(frozen=True, kw_only=True)
class JournalBearing(PlainBearing):
    """Main bearing: a plain bearing and its linear stand-in (N/m, N s/m)."""

    stiffness_x: Stiffness
    stiffness_y: Stiffness
    damping_x: Damping
    damping_y: Damping


@dataclass(frozen=True)
class ThrustBearing:
    """Axial bearing at one main journal; ``clearance`` is the total axial play.

    ``contact_stiffness`` is the closed bearing's collar and shells, ``block_stiffness`` the block's share in series.
    """

    main: int
    clearance: Length
    inner_diameter: Length
    outer_diameter: Length
    pads: int
    pad_fraction: Number
    taper: Length
    contact_height: Length
    contact_stiffness: Stiffness
    block_stiffness: Stiffness
    damping: Damping


@dataclass(frozen=True, kw_only=True)
class Oil:
    """Lubricant: viscosity against temperature and pressure, and the oil temperature against engine speed (K, rad/s).

    ``law`` is ``vogel``, η = a exp(b / (T − c)), or ``walther`` through two points of kinematic viscosity.
    ``pressure_law`` is ``none``, ``barus`` or ``roelands``, with the slope of ln η at ambient pressure
    ``pressure_viscosity``. ``heat_share`` is the part of a film's friction that its oil carries away.
    """

    density: Density
    temperature_speeds: tuple[Speed, ...]
    temperatures: tuple[Temperature, ...]
    supply_pressure: GaugePressure
    law: str = "vogel"
    vogel_a: Viscosity = 0.0
    vogel_b: TemperatureDifference = 0.0
    vogel_c: Temperature = 0.0
    walther_temperatures: tuple[Temperature, ...] = ()
    walther_viscosities: tuple[KinematicViscosity, ...] = ()
    pressure_law: str = "none"
    pressure_viscosity: PressureCoefficient = 0.0
    heat_capacity: HeatCapacity = 2000.0
    heat_share: Share = 0.8


@dataclass(frozen=True)
class DriveLine:
    """Connecting shaft from the flywheel to the dynamometer, whose speed is given."""

    stiffness: TorsionalStiffness
    damping: TorsionalDamping
    speed_filter_time: Time


@dataclass(frozen=True)
class StructuralDamping:
    """Damping of the elastic modes: one ratio for all (``modal``) or D = α M + β K (``rayleigh``; 1/s, s)."""

    kind: str
    ratio: Number
    alpha: Rate
    beta: Time


@dataclass(frozen=True)
class Combustion:
    """Single-zone closed cycle with a Wiebe burn; angles rad after firing top dead centre, pressures Pa, energy J."""

    start: Angle
    duration: Angle
    wiebe_a: Number
    wiebe_m: Number
    heat: Energy
    intake_pressure: Pressure
    intake_temperature: Temperature
    exhaust_pressure: Pressure
    intake_closes: Angle
    exhaust_opens: Angle
    wall_temperature: Temperature
    best_speed: Speed
    falloff: Number


@dataclass(frozen=True)
class Reduction:
    """How the finite-element crankshaft is reduced (counts, Hz)."""

    fixed_modes: int
    running_cutoff_hz: Frequency
    consistent_mass: bool


@dataclass(frozen=True)
class Published:
    """The reference's results for this engine, shown beside ours; Hz and rad/s, 0 where nothing was measured.

    Nothing is computed from them.
    """

    free_torsional_hz: tuple[Frequency, ...]
    cranktrain_hz: tuple[Frequency, ...]
    cranktrain_shapes: tuple[str, ...]
    measured_hz: tuple[Frequency, ...]
    second_torsional_hz: Frequency
    critical_orders: tuple[Number, ...]
    critical_speeds: tuple[Speed, ...]
    measured_critical_speeds: tuple[Speed, ...]


@dataclass(frozen=True)
class Engine:
    """One engine, complete; without ``big_end_bearing`` its big ends are rigid."""

    name: str
    title: str
    material: Material
    crankshaft: Crankshaft
    flywheel: LumpedInertia
    pulley: LumpedInertia
    rod: Rod
    cylinders: Cylinders
    main_bearing: JournalBearing
    thrust: ThrustBearing
    oil: Oil
    drive_line: DriveLine
    damping: StructuralDamping
    combustion: Combustion
    reduction: Reduction
    published: Published
    big_end_bearing: PlainBearing | None = None

    @property
    def n_cylinders(self) -> int:
        """Number of cylinders."""
        return len(self.cylinders.firing_order)

    @property
    def firing_angles(self) -> tuple[float, ...]:
        """Crank angle at which each cylinder (in the order of their numbers) passes firing dead centre, rad in [0, 4π).

        A throw at angle α points along the bank at angle β when θ = β − α; the firing order chooses the revolution.

        Raises
        ------
        InputError
            if the throws cannot fire in the stated order within one cycle
        """
        angles = [0.0] * self.n_cylinders
        previous = -1e-9
        for cylinder in self.cylinders.firing_order:
            throw = self.crankshaft.throw_angles[self.cylinders.pins[cylinder - 1] - 1]
            angle = (self.cylinders.bank_angles[cylinder - 1] - throw - previous) % (2.0 * math.pi) + previous
            if angle >= 4.0 * math.pi - 1e-6:
                raise InputError(
                    f"cylinders.firing_order: the throws do not reach dead centre in this order within 720 deg "
                    f"(stopped at cylinder {cylinder}); change firing_order or crankshaft.throw_angles"
                )
            angles[cylinder - 1] = max(angle, 0.0)
            previous = angle + 1e-9
        return tuple(angles)


def load_engine(name_or_path: str | Path) -> Engine:
    """Read and check an engine file.

    Parameters
    ----------
    name_or_path : name of an engine that ships with the package (``diesel_i6``) or path of a ``.toml`` file

    Raises
    ------
    InputError
        one line with file, table and key, for anything unknown, missing, in a wrong unit or impossible
    """
    from cranktrain.engine_file import read_engine  # the running model carries no file reader

    return read_engine(name_or_path)


def engine_provenance(name_or_path: str | Path) -> list[tuple[str, Any, str, str, str]]:
    """Every value of an engine file as it is written: (``table.key``, value, unit, origin, note)."""
    from cranktrain.engine_file import read_provenance

    return read_provenance(name_or_path)


def engine_to_dict(engine: Engine) -> dict[str, Any]:
    """Engine as nested dictionaries of JSON-able values in SI."""
    return _plain(asdict(engine))


def engine_from_dict(data: Mapping[str, Any]) -> Engine:
    """Inverse of :func:`engine_to_dict`; raises ``InputError`` where a key is unknown or missing."""
    engine = _typed(Engine, data, "engine")
    if not isinstance(engine, Engine):
        raise InputError("engine: not a table")
    return engine


def optional_fields(kind: type) -> set[str]:
    """Names of the fields of a dataclass that have a default."""
    return {entry.name for entry in fields(kind) if entry.default is not MISSING}


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    return [_plain(entry) for entry in value] if isinstance(value, tuple | list) else value


def _typed(kind: Any, value: Any, where: str) -> Any:
    if is_dataclass(kind) and isinstance(kind, type):
        if not isinstance(value, Mapping):
            raise InputError(f"{where}: not a table")
        names = {entry.name for entry in fields(kind)}
        if wrong := sorted((names - optional_fields(kind) - set(value)) | (set(value) - names)):
            raise InputError(f"{where}.{wrong[0]}: {'unknown' if wrong[0] in value else 'missing'}")
        hints = get_type_hints(kind)
        return kind(**{name: _typed(hints[name], value[name], f"{where}.{name}") for name in names & set(value)})
    if isinstance(kind, UnionType):
        return None if value is None else _typed(get_args(kind)[0], value, where)
    if get_origin(kind) is tuple:
        return tuple(_typed(get_args(kind)[0], entry, where) for entry in value)
    return float(value) if kind is float else value
