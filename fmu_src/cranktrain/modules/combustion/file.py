"""Module files of combustion: tables of values with units and origins, geometry from the engine's own file.

Bore, stroke, rod, compression ratio and firing angles are those of the engine file, its table ``[combustion]`` gives
intake and wall temperature, the angles at which the intake closes and the exhaust opens, and the manifold pressures
where the module file has none.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any

from cranktrain.engine import quantities as q
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import Quantity
from cranktrain.modules.combustion.settings import CycleSettings, check_settings
from cranktrain.modules.module_file import load_module_file, module_contents
from cranktrain.modules.register import Contents

LIKE = "modules/combustion/data/combustion_i6.toml"

FuelMass = Annotated[float, Quantity("mass", 0.0, 1e5, "mg")]
HeatingValue = Annotated[float, Quantity("specific energy", 5.0, 150.0, "MJ/kg", "diesel fuel has 42.5 to 43")]
HydrogenRatio = Annotated[float, Quantity("1", 0.0, 4.0, hint="diesel fuel has 1.8 to 1.9")]
DelayFactor = Annotated[float, Quantity("time", 1e-9, 1.0, "s")]
Exponent = Annotated[float, Quantity("1", 0.0, 20.0)]
Ratio = Annotated[float, Quantity("1", 0.01, 10.0)]
Part = Annotated[float, Quantity("1", 0.0, 1.0)]
Factor = Annotated[float, Quantity("1", 0.0, 10.0)]
Valves = Annotated[int, Quantity("1", 1, 8)]
Lift = Annotated[float, Quantity("length", 0.0, 200.0, "mm")]


@dataclass(frozen=True)
class Fuel:
    """Fuel CH_y: lower heating value, J/kg, and y."""

    heating_value: HeatingValue
    hydrogen_per_carbon: HydrogenRatio


@dataclass(frozen=True)
class Injection:
    """What the inputs start from: fuel of a cylinder and cycle, kg, and start of injection, rad after dead centre."""

    mass: FuelMass
    start: q.Angle


@dataclass(frozen=True)
class Ignition:
    """Delay A φ^−k p^−n exp(T_A/T), p in bar: A in s, T_A in K; see :mod:`.burn`."""

    factor: DelayFactor
    exponent: Exponent
    temperature: q.TemperatureDifference
    by_ratio: Exponent


@dataclass(frozen=True)
class Premixed:
    """Watson's share 1 − a φ^b/τ^c, and the Wiebe function of the premixed burn."""

    factor: Exponent
    by_ratio: Exponent
    by_delay: Exponent
    duration: q.Duration
    exponent: q.WiebeExponent


@dataclass(frozen=True)
class Diffusion:
    """Wiebe function of the diffusion burn at its reference equivalence ratio and speed."""

    duration: q.Duration
    exponent: q.WiebeExponent
    reference_ratio: Ratio
    reference_speed: q.RatedSpeed


@dataclass(frozen=True)
class ValveGear:
    """Valves of one cylinder: sizes (m), coefficients of curtain and port, and the built-in lifts' other ends."""

    intake_diameter: q.Size
    intake_count: Valves
    intake_opens: q.Angle
    intake_lift: Lift
    exhaust_diameter: q.Size
    exhaust_count: Valves
    exhaust_closes: q.Angle
    exhaust_lift: Lift
    curtain: q.Share
    port: q.Share


@dataclass(frozen=True)
class Manifolds:
    """Exhaust temperature, K, fraction of products in the intake, and pressures, Pa; 0 is that of the engine file."""

    exhaust_temperature: q.Temperature
    intake_share: Part
    intake_pressure: q.GasPressure = 0.0
    exhaust_pressure: q.GasPressure = 0.0


@dataclass(frozen=True)
class Walls:
    """Factor on Woschni's coefficient, and swirl c_u/c_m."""

    factor: Factor
    swirl: Factor


@dataclass(frozen=True)
class CombustionFile:
    """The tables of a module file."""

    fuel: Fuel
    injection: Injection
    ignition: Ignition
    premixed: Premixed
    diffusion: Diffusion
    valves: ValveGear
    manifolds: Manifolds
    walls: Walls


def load(path: str | Path) -> CycleSettings:
    """Read a module file and its engine; ``InputError`` as of :func:`.module_file.load_module_file`."""
    return load_module_file(path, CombustionFile, LIKE, cycle_settings)


def cycle_settings(tables: CombustionFile, engine: Engine, name: str, title: str) -> CycleSettings:
    """Settings from a module file's tables and an engine; ``InputError`` for what does not go together."""
    values: dict[str, Any] = {}
    for table, prefix in (("ignition", "ignition_"), ("premixed", "premixed_"), ("valves", ""), ("manifolds", "")):
        part = getattr(tables, table)
        values |= {prefix + entry.name: getattr(part, entry.name) for entry in fields(part)}
    for name_of in ("intake_pressure", "exhaust_pressure"):
        values[name_of] = values[name_of] or getattr(engine.combustion, name_of)
    burn, cylinders = engine.combustion, engine.cylinders
    settings = CycleSettings(
        name=name,
        title=title,
        bore=cylinders.bore,
        stroke=2.0 * engine.crankshaft.throw,
        rod_length=engine.rod.length,
        pin_offset=cylinders.pin_offset,
        compression_ratio=cylinders.compression_ratio,
        firing_angles=engine.firing_angles,
        intake_temperature=burn.intake_temperature,
        wall_temperature=burn.wall_temperature,
        intake_closes=burn.intake_closes,
        exhaust_opens=burn.exhaust_opens,
        fuel_mass=tables.injection.mass,
        injection_angle=tables.injection.start,
        heating_value=tables.fuel.heating_value,
        hydrogen_per_carbon=tables.fuel.hydrogen_per_carbon,
        diffusion_duration=tables.diffusion.duration,
        diffusion_exponent=tables.diffusion.exponent,
        reference_ratio=tables.diffusion.reference_ratio,
        reference_speed=tables.diffusion.reference_speed,
        wall_factor=tables.walls.factor,
        swirl=tables.walls.swirl,
        **values,
    )
    check_settings(settings)
    return settings


def contents(path: Path) -> Contents:
    """What the FMU of a module file is made of."""
    return module_contents(load(path))
