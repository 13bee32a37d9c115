"""Measured pressures as a unit of the virtual engine, in place of a combustion.

Like a combustion, the unit extrapolates the crank angle over a step by the speed, and outputs the pressures at the end
with their angle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.slots import AMBIENT
from cranktrain.engine.model import Engine
from cranktrain.loads.cylinder_volume import cylinder_volume
from cranktrain.loads.gas_pressure import GasTrace, gas_pressure, spline_coefficients
from cranktrain_lab.coupling.by_angle import ByAngle
from cranktrain_lab.coupling.unit import Port


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
