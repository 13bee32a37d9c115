"""One cycle of a run for display: speed, bearings with loads, orbits and films, and the crank's surface.

A cycle is recorded by a run, or read from a result file of ``simulate``, which has only loads and orbits. Its file is a
result file with the additional attribute ``look``.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError, StoreError
from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.engine.limits import BIG_END
from cranktrain.engine.model import Engine
from cranktrain.results.bearings.cycle import BearingCycle, Sampled, bearing_report
from cranktrain.results.files import StoredRun
from cranktrain.results.orders.harmonics import ComplexArray
from cranktrain.store.hdf5 import read_result, write_result
from cranktrain_lab.explore.inside.crank_surface import STRESSES, CrankSurface
from cranktrain_lab.explore.inside.film_record import FilmPressure

FRAME_DEG = 5
"""Crank angle between frames, degrees."""
LOOK = "cycle"
"""Value of the attribute ``look`` that identifies files written by this module."""
AGAIN = "make it anew: 'Look inside', then 'Save this cycle'"
_SIZES = ("diameter", "width", "clearance")
_CURVES = ("shell", "journal", "orbit")


@dataclass(frozen=True, eq=False)
class BearingLook:
    """One bearing over a cycle of n samples, with f frames of a film (SI).

    Attributes
    ----------
    name : ``main[1]``, ``big_end[1]``
    angle : (n,) crank angle, rad, ascending from 0
    shell : (n,) load of the journal on its shell, N, for a main in axes at rest, for a big end in the rod's axes
    journal : (n,) load of the shell on the journal, N, in axes that rotate with the crank
    orbit : (n,) journal centre in its bore over the radial clearance, axes at rest; empty without a film
    diameter, width, clearance : m; 0 if the bearing has none
    film : pressure at the frames; None if the level solves no film
    """

    name: str
    angle: Array
    shell: ComplexArray
    journal: ComplexArray
    orbit: ComplexArray
    diameter: float
    width: float
    clearance: float
    film: FilmPressure | None = None

    def sample(self, frame: int) -> int:
        """Return the index of the sample nearest to a frame's crank angle."""
        wanted = math.radians(frame * FRAME_DEG)
        apart = (self.angle - wanted + 2.0 * math.pi) % (4.0 * math.pi) - 2.0 * math.pi
        return int(np.abs(apart).argmin())

    @property
    def title(self) -> str:
        """Name of the bearing in titles."""
        return self.name.replace("_", " ").replace("[", " ").rstrip("]")


@dataclass(frozen=True, eq=False)
class InsideCycle:
    """Cycle of a run for display.

    Attributes
    ----------
    engine : name of the engine
    speed : speed, rad/s
    levels : fidelity levels, ``crank``, ``bearings``, ``big_ends``
    bearings : mains from the pulley on, then big ends
    surface : surface of the crank; None if the run has no stresses
    note : one line on missing parts of the source, empty if complete
    """

    engine: str
    speed: float
    levels: Mapping[str, str]
    bearings: tuple[BearingLook, ...]
    surface: CrankSurface | None = None
    note: str = ""
    attributes: Mapping[str, Any] = field(default_factory=dict)

    @property
    def rpm(self) -> float:
        """Speed, rev/min."""
        return self.speed / RPM

    def level_of(self, bearing: BearingLook) -> str:
        """Return the fidelity level of a bearing."""
        return self.levels["big_ends" if bearing.name.startswith(BIG_END) else "bearings"]

    def save(self, path: str | Path) -> Path:
        """Write the cycle; raises ``InputError`` for an existing file."""
        target = Path(path)
        if target.exists():
            raise InputError(f"{target}: exists already and is not overwritten; give another name")
        attributes = {
            **self.attributes, "look": LOOK, "engine": self.engine, "speed": self.speed, "note": self.note,
            "frame_deg": FRAME_DEG, "bearings_in_file": " ".join(one.name for one in self.bearings), **self.levels,
        }  # fmt: skip
        return write_result(target, dict(self._datasets()), attributes)

    def _datasets(self) -> Any:
        for one in self.bearings:
            yield f"{one.name}/angle", (one.angle, "rad")
            yield f"{one.name}/sizes", (np.array([getattr(one, size) for size in _SIZES]), "m")
            for name, unit in zip(_CURVES, ("N", "N", "1"), strict=True):
                curve = getattr(one, name)
                yield f"{one.name}/{name}", (np.column_stack((curve.real, curve.imag)), unit)
            if one.film is not None:
                yield f"{one.name}/film/pressure", (one.film.pressure, "Pa")
                yield f"{one.name}/film/faces", (one.film.faces, "rad")
                yield f"{one.name}/film/sides", (one.film.sides, "1")
        if self.surface is not None:
            own = self.surface
            for name, unit in (("points", "m"), ("triangles", "1"), ("shapes", "m"), ("coordinates", "1"),
                               ("turn", "rad")):  # fmt: skip
                yield f"surface/{name}", (getattr(own, name), unit)
            for name in STRESSES:
                yield f"surface/{name}", (own.stresses[name], "Pa")

    @classmethod
    def load(cls, path: str | Path, engine: Engine) -> "InsideCycle":
        """Read a cycle of an engine, or the last cycle of a result of ``simulate``.

        Raises ``StoreError``, ``InputError`` for a file that is missing, damaged, or of another kind or engine.
        """
        data, attributes = read_result(path)
        found = attributes.get("engine")
        if found != engine.name:
            raise InputError(f"{path}: of engine '{found}', not '{engine.name}'; explore that engine")
        if attributes.get("look") == LOOK:
            try:
                return _stored(data, attributes)
            except (KeyError, ValueError, TypeError, IndexError) as error:
                raise StoreError(f"{path}: lacks a part of its cycle ({error}); {AGAIN}") from None
        if "angle" not in data or not any(name.startswith("big_end[") for name in data):
            raise InputError(f"{path}: holds no cycle with bearings; give a result of 'simulate', or {AGAIN}")
        run = StoredRun.load(path)
        levels = {name: str(attributes.get(name, "")) for name in ("crank", "bearings", "big_ends")}
        speed = float(attributes.get("speed", 0.0))
        return cls(
            engine.name, speed, levels, bearing_looks(run, engine),
            note="A result of simulate holds loads and orbits; stresses and film pressure take 'Look inside'.",
        )  # fmt: skip


def _stored(data: Mapping[str, Any], attributes: Mapping[str, Any]) -> InsideCycle:
    """Return the cycle from the contents of its file."""
    if attributes["frame_deg"] != FRAME_DEG:
        raise ValueError(f"frames of {attributes['frame_deg']} deg")

    def get(name: str) -> Any:
        return np.asarray(data[name][0])

    looks = []
    for name in str(attributes["bearings_in_file"]).split():
        shell, journal, orbit = (get(f"{name}/{key}") @ (1.0, 1j) for key in _CURVES)
        film = None
        if f"{name}/film/pressure" in data:
            film = FilmPressure(*(get(f"{name}/film/{key}") for key in ("pressure", "faces", "sides")))
        diameter, width, clearance = get(f"{name}/sizes").tolist()
        looks.append(BearingLook(name, get(f"{name}/angle"), shell, journal, orbit, diameter, width, clearance, film))
    surface = None
    if "surface/points" in data:
        parts = {key: get(f"surface/{key}") for key in ("points", "triangles", "shapes", "coordinates", "turn")}
        surface = CrankSurface(**parts, stresses={name: get(f"surface/{name}") for name in STRESSES})
    levels = {name: str(attributes[name]) for name in ("crank", "bearings", "big_ends")}
    return InsideCycle(
        str(attributes["engine"]), float(attributes["speed"]), levels, tuple(looks), surface, str(attributes["note"])
    )


def bearing_looks(run: Sampled, engine: Engine) -> tuple[BearingLook, ...]:
    """Return all bearings over the last cycle of a run, without films; raises ``InputError``."""
    return tuple(_look(one, engine) for one in bearing_report(run, engine).bearings)


def _look(found: BearingCycle, engine: Engine) -> BearingLook:
    order = np.argsort(found.angle)
    of_rod = found.family == BIG_END
    bearing = engine.big_end_bearing if of_rod else engine.main_bearing
    if found.specific_load is None:  # rollers and knuckle pins have no specific load
        bearing = None
    sizes = (0.0, 0.0, 0.0) if bearing is None else (bearing.diameter, bearing.width, bearing.clearance)
    shell = found.on_rod if found.on_rod is not None else found.on_shell
    orbit = np.zeros(0, dtype=complex) if found.orbit is None else found.orbit[order]
    return BearingLook(found.name, found.angle[order], shell[order], found.on_journal[order], orbit, *sizes)


@dataclass(frozen=True)
class Repeated:
    """Run for reports, made of one periodic recorded cycle and some samples of the cycle before it."""

    time: Array
    angle: Array
    outputs: Mapping[str, Array]

    @classmethod
    def of(cls, outputs: Mapping[str, Array], chosen: NDArray[np.intp], speed: float) -> "Repeated":
        """Make the run from ``chosen`` samples of one cycle, in order of crank angle, at a mean speed, rad/s."""
        before = 9
        samples = np.concatenate((chosen[-before:], chosen))
        angle = outputs["crank.angle"][samples] % (4.0 * math.pi)
        angle[:before] -= 4.0 * math.pi
        step = 4.0 * math.pi / speed / chosen.size
        time = step * (np.arange(samples.size, dtype=float) - before)
        taken = {name: values[samples] for name, values in outputs.items()}
        return cls(time, angle, taken | {"crank.angle": angle})
