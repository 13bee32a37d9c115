"""Time series of a run as an HDF5 result: every output under its name, with its unit."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from cranktrain.core.errors import InputError
from cranktrain.dynamics.outputs.register import FAMILIES
from cranktrain.engine.quantities import ZERO_CELSIUS
from cranktrain.store.hdf5 import write_result

if TYPE_CHECKING:
    from cranktrain.dynamics.simulation import Result

_SIGNATURE = b"\x89HDF\r\n\x1a\n"

_NAMES = {
    "1": "eccentricity substeps iterations online_films residual side",
    "N": "force side_force friction",
    "N m": "torque friction_torque moment",
    "Pa": "pressure_max",
    "W": "heat",
    "K": "temperature",
    "degC": "film_temperature_c",
    "m": "axial displacement film_thickness_min piston_position lateral position",
    "m/s": "velocity rate",
    "m/s^2": "acceleration",
    "m^3": "volume",
    "m^3/s": "oil_flow",
    "rad": "angle torsion tilt twist rotation",
    "rad/s": "speed",
}
_UNITS = {name: unit for unit, names in _NAMES.items() for name in names.split()}


def output_unit(name: str) -> str:
    """Unit of an output: as its family declares, else by the last part of its name that has one.

    ``bearing[1].force.x`` has N; empty where neither tells.
    """
    declared = {key: unit for family in FAMILIES.values() for key, unit in family.units.items()}
    own = next((unit for key, unit in declared.items() if name == key or name.endswith(f".{key}")), None)
    return own or next((_UNITS[part] for part in reversed(name.split(".")) if part in _UNITS), "")


def check_target(path: Path) -> None:
    """Refuse a target that a result must not replace, before the run; ``InputError``."""
    if path.is_dir():
        raise InputError(f"{path}: is a folder; name a file for the result, e.g. {path / 'result.h5'}")
    if path.is_file():
        with path.open("rb") as file:
            if file.read(len(_SIGNATURE)) != _SIGNATURE:
                raise InputError(f"{path}: exists and is no HDF5 file; choose another name for the result")
    folder = next(place for place in path.absolute().parents if place.exists())
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        raise InputError(f"{path}: {folder} is no folder that can be written to; choose another place for the result")


def save_run(path: Path, run: Result, attributes: Mapping[str, str | int | float]) -> Path:
    """Write all outputs of a run, over time (s) and crank angle (rad), and the temperature of each main bearing's film.

    The file appears whole or not at all.
    """
    datasets = {"time": (run.time, "s"), "angle": (run.angle, "rad")}
    named = {"film_temperature_c": run.film_temperatures - ZERO_CELSIUS, **run.outputs}
    datasets |= {name: (values, output_unit(name)) for name, values in named.items()}
    return write_result(path, datasets, attributes)
