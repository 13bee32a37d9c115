"""Module files of valve trains: tables of values with units and origins, firing angles from the engine's own file.

Where the intake closes and the exhaust opens stands in the engine file's table ``[combustion]``, as it does for the
combustion module, whose own file holds the other ends; a test holds both modules' valves together.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any

from cranktrain.engine import quantities as q
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import Quantity
from cranktrain.modules.module_file import load_module_file, module_contents
from cranktrain.modules.register import Contents
from cranktrain.modules.valve_train.settings import TrainSettings, check_settings

LIKE = "modules/valve_train/data/valvetrain_i6.toml"

Lift = Annotated[float, Quantity("length", 0.1, 200.0, "mm")]
Radius = Annotated[float, Quantity("length", 0.0, 1000.0, "mm")]
Lash = Annotated[float, Quantity("length", 0.0, 10.0, "mm")]
Ramp = Annotated[float, Quantity("angle", 1.0, 90.0, "deg", "it is an angle of the cam")]
Power = Annotated[float, Quantity("1", 5.0, 60.0, hint="usual cams have 6 to 12")]
Ratio = Annotated[float, Quantity("1", 0.1, 10.0, hint="rockers have 1 to 2")]
DampingSpeed = Annotated[float, Quantity("speed", 1e-4, 1e4, "rad/s")]


@dataclass(frozen=True)
class Valve:
    """One kind's valves: where the ramp of its cam ends or begins (rad), lift (m), mass of valves and bridge (kg)."""

    opens: q.Angle
    lift: Lift
    mass: q.Mass


@dataclass(frozen=True)
class ExhaustValve:
    """As :class:`Valve`, by the other end."""

    closes: q.Angle
    lift: Lift
    mass: q.Mass


@dataclass(frozen=True)
class Cam:
    """Base circle and roller (m; a roller of 0 is a flat follower), width (m), ramp (rad), power, friction, E* (Pa)."""

    base_radius: q.Size
    roller_radius: Radius
    width: q.Length
    ramp: Ramp
    power: Power
    friction: q.Friction
    modulus: q.Modulus


@dataclass(frozen=True)
class Train:
    """Follower, pushrod and rocker at the valve: ratio, mass (kg), stiffness (N/m), damping (m/s), lash (m)."""

    ratio: Ratio
    mass: q.Mass
    stiffness: q.Stiffness
    damping_velocity: q.Velocity
    lash: Lash


@dataclass(frozen=True)
class Spring:
    """Springs of the valves of one cam: rate (N/m), length that is strained on the seat (m), mass (kg), damping."""

    rate: q.Stiffness
    preset: q.Length
    mass: q.Mass
    damping: q.DampingRatio


@dataclass(frozen=True)
class Seat:
    """Seats of the valves of one cam: stiffness (N/m) and damping velocity (m/s)."""

    stiffness: q.Stiffness
    damping_velocity: q.Velocity


@dataclass(frozen=True)
class Drive:
    """From crank to camshaft: stiffness at the camshaft (N m/rad), damping speed (rad/s), radius and backlash (m)."""

    stiffness: q.TorsionalStiffness
    damping_speed: DampingSpeed
    radius: q.Size
    backlash: Lash


@dataclass(frozen=True)
class Camshaft:
    """Inertia with its wheel (kg m²), drag of its bearings (N m s/rad), crank speed that it is made for (rad/s)."""

    inertia: q.Inertia
    drag: q.TorsionalDamping
    rated_speed: q.RatedSpeed


@dataclass(frozen=True)
class ValveTrainFile:
    """The tables of a module file."""

    intake: Valve
    exhaust: ExhaustValve
    cam: Cam
    train: Train
    spring: Spring
    seat: Seat
    drive: Drive
    camshaft: Camshaft


def load(path: str | Path) -> TrainSettings:
    """Read a module file and its engine; ``InputError`` as of :func:`.module_file.load_module_file`."""
    return load_module_file(path, ValveTrainFile, LIKE, train_settings)


def train_settings(tables: ValveTrainFile, engine: Engine, name: str, title: str) -> TrainSettings:
    """Settings from a module file's tables and an engine; ``InputError`` for what does not go together."""
    values: dict[str, Any] = {}
    heads = {
        "intake": "intake_", "exhaust": "exhaust_", "spring": "spring_", "seat": "seat_", "drive": "drive_",
        "camshaft": "camshaft_", "cam": "", "train": "",
    }  # fmt: skip
    for table, head in heads.items():
        part = getattr(tables, table)
        values |= {head + entry.name: getattr(part, entry.name) for entry in fields(part)}
    values["cam_width"], values["train_mass"] = values.pop("width"), values.pop("mass")
    values["backlash"] = values.pop("drive_backlash")
    values["rated_speed"] = values.pop("camshaft_rated_speed")
    values["spring_preload"] = values["spring_rate"] * values.pop("spring_preset")
    settings = TrainSettings(
        name=name,
        title=title,
        firing_angles=engine.firing_angles,
        intake_closes=engine.combustion.intake_closes,
        exhaust_opens=engine.combustion.exhaust_opens,
        **values,
    )
    check_settings(settings)
    return settings


def contents(path: Path) -> Contents:
    """What the FMU of a module file is made of."""
    return module_contents(load(path))
