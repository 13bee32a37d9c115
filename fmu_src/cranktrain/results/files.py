"""Time series of a run as an HDF5 result: every output under its name, with its unit."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from cranktrain.core.errors import InputError
from cranktrain.engine.quantities import ZERO_CELSIUS
from cranktrain.results.summary import Run
from cranktrain.store.hdf5 import write_result

_SIGNATURE = b"\x89HDF\r\n\x1a\n"

# unit by the last part of an output's name, or by its last two where the part alone does not tell
_UNITS = {
    "angle": "rad",
    "speed": "rad/s",
    "torsion": "rad",
    "tilt": "rad",
    "axial": "m",
    "displacement": "m",
    "film_thickness_min": "m",
    "piston_position": "m",
    "torque": "N m",
    "friction_torque": "N m",
    "force": "N",
    "force.x": "N",
    "force.y": "N",
    "force.z": "N",
    "side_force": "N",
    "friction": "N",
    "lateral": "m",
    "acceleration": "m/s^2",
    "heat": "W",
    "twist": "rad",
    "temperature": "K",
    "moment.x": "N m",
    "moment.y": "N m",
    "moment.z": "N m",
    "position.x": "m",
    "position.y": "m",
    "position.z": "m",
    "rotation.x": "rad",
    "rotation.y": "rad",
    "rotation.z": "rad",
    "velocity.x": "m/s",
    "velocity.y": "m/s",
    "velocity.effective": "m/s",
    "speed.relative": "rad/s",
    "speed.gap": "rad/s",
    "speed.effective": "rad/s",
    "gap.angle": "rad",
    "gap.side": "1",
    "gap.rate": "m/s",
    "pressure_max": "Pa",
    "oil_flow": "m^3/s",
    "volume": "m^3",
    "eccentricity": "1",
    "substeps": "1",
    "iterations": "1",
    "online_films": "1",
    "residual": "1",
    "film_temperature_c": "degC",
}


def output_unit(name: str) -> str:
    """Unit of an output by its name, e.g. ``bearing[1].force.x`` → N."""
    return _UNITS.get(".".join(name.rsplit(".", 2)[-2:])) or _UNITS[name.rsplit(".", 1)[-1]]


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


def save_run(path: Path, run: Run, attributes: Mapping[str, str | int | float]) -> Path:
    """Write all outputs of a run, over time (s) and crank angle (rad), and the temperature of each main bearing's film.

    The file appears whole or not at all.
    """
    datasets = {"time": (run.time, "s"), "angle": (run.angle, "rad")}
    named = {"film_temperature_c": run.film_temperatures - ZERO_CELSIUS, **run.outputs}
    datasets |= {name: (values, output_unit(name)) for name, values in named.items()}
    return write_result(path, datasets, attributes)
