"""Measurements as units of the virtual engine: channels, or pressures in place of a combustion, over crank angle.

Samples of a recording lie at uniform crank angles over whole cycles and repeat after the last one. Like a combustion,
the units extrapolate the crank angle over a step by the speed, and output the values at the end with their angle, so
model and measurement are compared at equal crank angles.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.slots import AMBIENT
from cranktrain.engine.model import Engine
from cranktrain.loads.cylinder_volume import cylinder_volume
from cranktrain.loads.gas_pressure import GasTrace, gas_pressure, spline_coefficients
from cranktrain_lab.coupling.unit import Port, Unit

AT = "pressure.angle"
"""Output with the crank angle of the values."""
ANGLE, SPEED = "crank.angle", "crank.speed"


class ByAngle(Unit):
    """Unit with crank angle and speed as inputs; subclasses add ``read`` (:class:`cranktrain_lab.coupling.unit.Unit`).

    The angle at the end of a step, ``_angle``, is extrapolated from the angle at its start by the speed.
    """

    restorable = True

    def __init__(self, name: str, outputs: Mapping[str, Port]) -> None:
        self.name = name
        self.inputs: Mapping[str, Port] = dict.fromkeys((ANGLE, SPEED), Port())
        self.outputs = outputs
        self._given, self._angle = np.zeros(2), 0.0
        self.link((ANGLE, SPEED), list(outputs))

    def link(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Choose the inputs that ``write`` sets and the outputs that ``read`` returns."""
        self._in = [(ANGLE, SPEED).index(name) for name in inputs]
        self._read = list(outputs)

    def initialize(self, time: float) -> None:
        """Prepare the unit for steps from ``time`` (s) on."""
        self._angle = float(self._given[0])

    def write(self, values: Array) -> None:
        """Set the values (k,) of the k linked inputs."""
        self._given[self._in] = values

    def step(self, time: float, size: float) -> None:
        """Advance the unit from ``time`` (s) by one step of ``size`` (s)."""
        self._angle = float(self._given[0] + self._given[1] * size)

    def keep(self, held: Any = None) -> Any:
        """Return the unit's state; memory of the earlier state ``held`` may be reused."""
        return self._angle, self._given.copy()

    def restore(self, state: Any) -> None:
        """Restore a state of the unit that ``keep`` returned."""
        self._angle, given = state
        self._given[:] = given


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


@dataclass(frozen=True, eq=False)
class MeasuredPressures:
    """Engine with the measured pressures of a run at one speed."""

    engine: Engine
    trace: GasTrace


class TraceUnit(ByAngle):
    """Unit that outputs measured pressures at the crank angle."""

    def __init__(self, name: str, measured: MeasuredPressures) -> None:
        engine, trace = measured.engine, measured.trace
        self._engine = engine
        self._phases = engine.firing_angles
        tables = [spline_coefficients(own.fired) for own in trace.own or (trace,)]
        self._tables = tables if trace.own else tables * len(self._phases)
        self._mean = trace.imep
        pressures = [f"cylinder[{c + 1}].pressure" for c in range(len(self._phases))]
        outputs = (*pressures, "pressure.angle", "indicated.pressure_mean", "indicated.torque")
        super().__init__(name, dict.fromkeys(outputs, Port()))

    def read(self) -> Array:
        """Return the values (k,) of the k linked outputs."""
        own = np.array([self._angle - phase for phase in self._phases])
        pressures = [float(gas_pressure(angle, table)) for angle, table in zip(own, self._tables, strict=True)]
        rise = np.array([cylinder_volume(self._engine, own[c : c + 1], c)[1][0] for c in range(own.size)])
        torque = float((np.array(pressures) - AMBIENT) @ rise)
        found = dict(zip(self.outputs, (*pressures, self._angle, self._mean, torque), strict=True))
        return np.array([found[name] for name in self._read])
