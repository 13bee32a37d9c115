"""Measured pressures as a unit of the virtual engine, in place of a combustion.

It extrapolates the crank's angle by its speed over a step, as a combustion does, and outputs the pressures at the end
with the angle that they belong to.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.coupling.unit import Port
from cranktrain.dynamics.model.slots import AMBIENT
from cranktrain.engine.model import Engine
from cranktrain.loads.cylinder_volume import cylinder_volume
from cranktrain.loads.gas_pressure import GasTrace, gas_pressure, spline_coefficients

ANGLE, SPEED = "crank.angle", "crank.speed"


@dataclass(frozen=True, eq=False)
class MeasuredPressures:
    """An engine with the measured pressures of a run, at its speed."""

    engine: Engine
    trace: GasTrace


class TraceUnit:
    """Pressures by crank angle; see the protocol of :mod:`cranktrain.coupling.unit`."""

    restorable = True

    def __init__(self, name: str, measured: MeasuredPressures) -> None:
        engine, trace = measured.engine, measured.trace
        self.name, self._engine = name, engine
        self._phases = engine.firing_angles
        tables = [spline_coefficients(own.fired) for own in trace.own or (trace,)]
        self._tables = tables if trace.own else tables * len(self._phases)
        self._mean = trace.imep
        pressures = [f"cylinder[{c + 1}].pressure" for c in range(len(self._phases))]
        self.inputs: Mapping[str, Port] = dict.fromkeys((ANGLE, SPEED), Port())
        outputs = (*pressures, "pressure.angle", "indicated.pressure_mean", "indicated.torque")
        self.outputs: Mapping[str, Port] = dict.fromkeys(outputs, Port())
        self._given, self._angle = np.zeros(2), 0.0
        self.link((ANGLE, SPEED), outputs)

    def link(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """See the protocol."""
        self._in = [(ANGLE, SPEED).index(name) for name in inputs]
        self._out = [list(self.outputs).index(name) for name in outputs]

    def initialize(self, time: float) -> None:
        """See the protocol."""
        self._angle = float(self._given[0])

    def write(self, values: Array) -> None:
        """See the protocol."""
        self._given[self._in] = values

    def read(self) -> Array:
        """See the protocol."""
        own = np.array([self._angle - phase for phase in self._phases])
        pressures = [gas_pressure(angle, table) for angle, table in zip(own.tolist(), self._tables, strict=True)]
        rise = np.array([cylinder_volume(self._engine, own[c : c + 1], c)[1][0] for c in range(own.size)])
        torque = float((np.array(pressures) - AMBIENT) @ rise)
        return np.array([*pressures, self._angle, self._mean, torque])[self._out]

    def step(self, time: float, size: float) -> None:
        """See the protocol."""
        self._angle = float(self._given[0] + self._given[1] * size)

    def keep(self, held: Any = None) -> Any:
        """See the protocol."""
        return self._angle, self._given.copy()

    def restore(self, state: Any) -> None:
        """See the protocol."""
        self._angle, given = state
        self._given[:] = given

    def close(self) -> None:
        """See the protocol."""
