"""Virtual engines whose cranktrain, of FMI 3.0, calls its master inside a step."""

from __future__ import annotations

import math
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain_lab.coupling.modules import CRANKTRAIN
from cranktrain_lab.coupling.recording_unit import MeasuredPressures
from cranktrain_lab.coupling.run import Steps, run
from cranktrain_lab.coupling.virtual_engine import Partners, VirtualEngine, virtual_engine

COARSE_DEG = 1.5
PARTNERS = {"diesel_i6": ("combustion_i6", "valvetrain_i6"), "diesel_v8": ("combustion_v8", "valvetrain_v8")}


class Engine(NamedTuple):
    """FMUs, or measured pressures in place of a combustion."""

    cranktrain: Path
    combustion: Path | MeasuredPressures
    valvetrain: Path | None = None

    @property
    def without_valves(self) -> Engine:
        """Cranktrain and combustion alone."""
        return Engine(self.cranktrain, self.combustion)


def radians_per_second(rpm: float) -> float:
    """Speed, rad/s."""
    return rpm * math.pi / 30.0


def step_of(step_deg: float = COARSE_DEG, rpm: float = 2000.0) -> float:
    """Communication step, s."""
    return math.radians(step_deg) / radians_per_second(rpm)


def system_of(
    engine: Engine, scheme: str, step_deg: float = COARSE_DEG, rpm: float = 2000.0, reconstruction: str = "own",
    **values: object,
) -> VirtualEngine:  # fmt: skip
    """The virtual engine; ``values`` are start values of the cranktrain."""
    partners = Partners(engine.cranktrain, engine.combustion, {CRANKTRAIN: values}, engine.valvetrain)
    return virtual_engine(partners, radians_per_second(rpm), scheme, reconstruction, step_of(step_deg, rpm))


def torsion(system: VirtualEngine, step: float, stop: float, every: float) -> Array:
    """Torsion of the pulley, rad, by steps (s) up to a time (s), ``every`` so many seconds."""
    with closing(system.master()) as master:
        master.initialize()
        found = run(master, stop, Steps(step), system.bonds)
    return found.of(f"{CRANKTRAIN}.pulley.torsion")[:: round(every / step)]


def error(found: Array, exact: Array, last: int) -> float:
    """RMS of the difference over the last points, over the RMS of the alternating part."""
    return float(np.sqrt(np.mean((found[-last:] - exact[-last:]) ** 2)) / exact[-last:].std())


class Made:
    """Makes the coupled engine, in a process of its own too."""

    def __init__(self, engine: Engine, scheme: str) -> None:
        self.engine, self.scheme = engine, scheme

    def __call__(self) -> VirtualEngine:
        return system_of(self.engine, self.scheme)
