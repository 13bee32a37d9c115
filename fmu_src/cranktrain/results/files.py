"""Result files (HDF5) with the time series of a run: every output under its name, with its unit."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np

from cranktrain.core.errors import InputError, StoreError
from cranktrain.core.reduced_body import Array
from cranktrain.core.user_file import ending
from cranktrain.dynamics.outputs.register import FAMILIES
from cranktrain.engine.quantities import ZERO_CELSIUS
from cranktrain.store.hdf5 import RESULT, read_result, write_result
from cranktrain.store.result_stream import ResultStream, result_stream
from cranktrain.store.sound_files import rising
from cranktrain.store.whole_file import check_place

if TYPE_CHECKING:
    from cranktrain.dynamics.cycle_run import Result

_NAMES = {
    "1": "eccentricity substeps iterations online_films limited residual side",
    "N": "force side_force friction tension",
    "N m": "torque friction_torque moment",
    "Pa": "pressure_max",
    "W": "heat",
    "K": "temperature",
    "degC": "film_temperature_c",
    "m": "axial deflection displacement film_thickness_min piston_position lateral position slip",
    "m/s": "velocity rate slip_velocity",
    "m/s^2": "acceleration",
    "m^3": "volume",
    "m^3/s": "oil_flow",
    "rad": "angle torsion tilt twist rotation",
    "rad/s": "speed twist_rate",
}
_UNITS = {name: unit for unit, names in _NAMES.items() for name in names.split()}


def output_unit(name: str) -> str:
    """Unit of an output, as declared by its output family, or else by the last part of its name that has a unit.

    For example ``bearing[1].force.x`` has N. The unit is empty if neither gives one.
    """
    return _unit(name, tuple(FAMILIES))


@cache
def _unit(name: str, families: tuple[str, ...]) -> str:
    """Unit of an output by the output families of these names, cached."""
    declared = {key: unit for family in families for key, unit in FAMILIES[family].units.items()}
    own = next((unit for key, unit in declared.items() if name == key or name.endswith(f".{key}")), None)
    return own or next((_UNITS[part] for part in reversed(name.split(".")) if part in _UNITS), "")


def check_target(path: Path) -> None:
    """Refuse a target with another ending than .h5, or an existing file that is not a result; ``InputError``."""
    if ending(path) in (".csv", ".npz", ".parquet"):
        raise InputError(f"{path}: a result is HDF5; name it {path.stem}.h5, then cranktrain export it")
    check_place(path, RESULT)


class ResultFile:
    """Result file of a running simulation, which writes its samples here; implements ``Sink`` of the simulation.

    Attributes
    ----------
    seconds : simulated time in the file, s; None before the first sample
    """

    def __init__(self, stream: ResultStream) -> None:
        self._stream = stream
        self.seconds: float | None = None

    def begin(self, names: tuple[str, ...], samples: int) -> None:
        """Prepare the file for a number of samples of these outputs."""
        self.seconds = None
        self._stream.begin({"time": "s", "angle": "rad", **{name: output_unit(name) for name in names}}, samples)

    @property
    def count(self) -> int:
        """Number of samples in the file."""
        return self._stream.count

    def keep(self, time: Array, angle: Array, values: Array) -> None:
        """Write samples: times (k,), s, crank angles (k,), rad, and outputs (k, names), SI."""
        whole = self.count + len(time)
        try:
            self._stream.append(np.column_stack((time, angle, values)))
        finally:  # after an interrupt, too, the time is updated if all samples of this call were written
            if time.size and self.count == whole:
                self.seconds = float(time[-1])

    def finish(self, attributes: Mapping[str, str | int | float], film_temperatures: Array | None = None) -> None:
        """Write attributes and, if known, the temperature of each main bearing's film, K."""
        kept = {} if film_temperatures is None else {"film_temperature_c": film_temperatures - ZERO_CELSIUS}
        self._stream.finish(attributes, {name: (values, output_unit(name)) for name, values in kept.items()})


@contextmanager
def result_file(path: Path) -> Iterator[ResultFile]:
    """Context of a result file, which appears completely when the block ends without an error."""
    with result_stream(path) as stream:
        yield ResultFile(stream)


@dataclass(frozen=True)
class StoredRun:
    """A run read from its result file: ``time`` (n,) s, ``angle`` (n,) rad, ``outputs`` by name (n,) SI."""

    time: Array
    angle: Array
    outputs: Mapping[str, Array]
    attributes: Mapping[str, str | int | float]

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a result file; ``StoreError`` if it is missing, incomplete, damaged, empty, or of another kind."""
        data, attributes = read_result(path)
        outputs = {name: array for name, (array, _) in data.items()}
        axes = [outputs[name] for name in ("time", "angle") if name in outputs]
        if len(axes) < 2 or any(axis.size < 2 for axis in axes):
            raise StoreError(f"{path}: holds no samples; run 'cranktrain simulate' again")
        sound = all(axis.ndim == 1 and axis.dtype.kind in "iuf" and np.isfinite(axis).all() for axis in axes)
        if not sound or axes[0].size != axes[1].size or not rising(axes[0]):
            raise StoreError(f"{path}: its time and angle are damaged; run 'cranktrain simulate' again")
        time, angle = outputs.pop("time"), outputs.pop("angle")
        kept = {name: own for name, own in outputs.items() if _over(time, own) or name.endswith(OF_BEARINGS)}
        return cls(time, angle, _Outputs(path, kept), attributes)


OF_BEARINGS = "film_temperature_c"
"""Name of the dataset in a result file with one value per main bearing."""


def _over(time: Array, values: Array) -> bool:
    """True if an array of a result file holds one number for each time."""
    return values.shape == time.shape and values.dtype.kind in "biuf"


class _Outputs(dict[str, Array]):
    """Outputs of a file by name; access to a missing output raises ``StoreError`` with its name."""

    def __init__(self, path: str | Path, outputs: Mapping[str, Array]) -> None:
        super().__init__(outputs)
        self._path = path

    def __missing__(self, name: str) -> Array:
        raise StoreError(f"{self._path}: has no output '{name}' over its time; run 'cranktrain simulate' again")


def save_run(path: Path, run: "Result", attributes: Mapping[str, str | int | float]) -> Path:
    """Write a result file: all outputs over time (s) and crank angle (rad), and temperatures of the mains' films.

    The file appears completely or not at all.
    """
    datasets = {"time": (run.time, "s"), "angle": (run.angle, "rad")}
    named = {"film_temperature_c": run.film_temperatures - ZERO_CELSIUS, **run.outputs}
    datasets |= {name: (values, output_unit(name)) for name, values in named.items()}
    return write_result(path, datasets, attributes)
