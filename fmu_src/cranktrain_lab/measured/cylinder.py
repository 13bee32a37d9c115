"""Geometry of a cylinder for measured pressures: volume, wall area and mean piston speed over the crank angle."""

import math
from dataclasses import dataclass

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.engine.model import Engine


@dataclass(frozen=True)
class Cylinder:
    """Cylinder, SI: bore, stroke, rod length, compression ratio, pin offset, cycle (rad), name of the engine."""

    bore: float
    stroke: float
    rod: float
    compression_ratio: float
    offset: float = 0.0
    cycle: float = 4.0 * math.pi
    name: str = "the cylinder"

    def __post_init__(self) -> None:
        if not (self.bore > 0.0 and 0.0 < self.stroke < 2.0 * self.rod and self.compression_ratio > 1.0):
            raise InputError(
                f"{self.name}: bore {self.bore:g} m, stroke {self.stroke:g} m, rod {self.rod:g} m, compression ratio "
                f"{self.compression_ratio:g} are no cylinder; check their units"
            )

    @classmethod
    def of(cls, engine: Engine, number: int = 1) -> "Cylinder":
        """Return a cylinder of an engine by its number from 1."""
        offsets = engine.offsets
        if not 1 <= number <= engine.n_cylinders:
            raise InputError(f"{engine.name} has no cylinder {number}; it has 1 to {engine.n_cylinders}")
        throws = engine.throws
        throw = throws[(number - 1) % len(throws)]
        return cls(
            engine.cylinders.bore, 2.0 * throw, engine.rod.length, engine.cylinders.compression_ratio,
            offsets[(number - 1) % len(offsets)], engine.cylinders.cycle, engine.name,
        )  # fmt: skip

    @property
    def area(self) -> float:
        """Piston area, m²."""
        return 0.25 * math.pi * self.bore**2

    def volume(self, angle: Array) -> tuple[Array, Array]:
        """Return volume (n,) m³ and its derivative (n,) m³/rad at angles (n,) rad after firing dead centre."""
        r, length = 0.5 * self.stroke, self.rod
        top = math.sqrt((length + r) ** 2 - self.offset**2)
        swept = top - math.sqrt((length - r) ** 2 - self.offset**2)
        # With a pin offset, dead centre is not where the throw points along the cylinder axis.
        turned = angle - math.asin(self.offset / (length + r))
        x = -r * np.sin(turned) - self.offset
        s = np.sqrt(length**2 - x**2)
        clearance = self.area * swept / (self.compression_ratio - 1.0)
        volume = clearance + self.area * (top - r * np.cos(turned) - s)
        return volume, self.area * (r * np.sin(turned) - x * r * np.cos(turned) / s)

    def walls(self, volume: Array) -> Array:
        """Return the wall area (n,) m² of head, piston and liner."""
        return np.asarray(2.0 * self.area + 4.0 * volume / self.bore)
