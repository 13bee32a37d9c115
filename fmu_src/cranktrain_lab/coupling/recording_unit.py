"""Measurement as a unit of the virtual engine, with channels as functions of the model's crank angle.

Samples lie at uniform crank angles over whole cycles and repeat after the last one. Like
:class:`cranktrain_lab.coupling.trace_unit.TraceUnit` the unit extrapolates the crank angle over a step by the speed. It
outputs the values at the end with their angle, so model and measurement are compared at equal crank angles.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.loads.gas_pressure import gas_pressure, spline_coefficients
from cranktrain_lab.coupling.by_angle import ByAngle
from cranktrain_lab.coupling.unit import Port

AT = "pressure.angle"
"""Output with the crank angle of the values."""


@dataclass(frozen=True, eq=False)
class Recording:
    """Measured channels over crank angle.

    Attributes
    ----------
    name : name of the file
    cycles : number of whole cycles of 720 degrees
    start : crank angle of the first sample, rad after firing dead centre of the first cylinder
    values : channel → samples (n,) at ``start + 4π cycles i/n``
    ports : channel → unit of measurement
    """

    name: str
    cycles: int
    start: float
    values: Mapping[str, Array]
    ports: Mapping[str, Port]

    def mean(self, channel: str) -> float:
        """Return the mean of a channel."""
        return float(self.values[channel].mean())


class RecordingUnit(ByAngle):
    """Unit that outputs measured channels at the model's crank angle."""

    def __init__(self, name: str, recording: Recording) -> None:
        self.recording = recording
        self._tables = {key: spline_coefficients(values) for key, values in recording.values.items()}
        super().__init__(name, {**recording.ports, AT: Port()})

    def at(self, channel: str, angle: float) -> float:
        """Return the value of a channel at a crank angle, rad."""
        own = self.recording
        return float(gas_pressure((angle - own.start) / own.cycles, self._tables[channel]))

    def read(self) -> Array:
        """Return the values (k,) of the k linked outputs."""
        return np.array([self._angle if name == AT else self.at(name, self._angle) for name in self._read])


def without_zero(angle: Array, values: Array) -> Array:
    """Return k values minus their mean over the preceding cycle. The k crank angles (rad) must increase.

    Within the first cycle the mean of the first cycle is used, or of the whole run if that is shorter.
    """
    cycle = 4.0 * math.pi
    whole = np.concatenate(([0.0], np.cumsum(0.5 * np.diff(angle) * (values[1:] + values[:-1]))))
    end = np.maximum(angle, angle[0] + cycle)
    begin = np.maximum(end - cycle, angle[0])
    end = np.minimum(end, angle[-1])
    span = end - begin
    if not np.all(span > 0.0):
        return np.asarray(values - values.mean())
    return np.asarray(values - (np.interp(end, angle, whole) - np.interp(begin, angle, whole)) / span)
