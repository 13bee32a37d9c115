"""Modal velocities of the flexible block over a settled period of a run at constant speed."""

import math
from dataclasses import dataclass, replace

import numpy as np

from cranktrain.core.types import Array, Progress
from cranktrain.dynamics.model.layout import turning_modes
from cranktrain.dynamics.model.state import VELOCITY, offset
from cranktrain.dynamics.simulation import Simulation, fitted_engine
from cranktrain.loads.gas_pressure import Gas
from cranktrain.results.strength.recorded_cycle import recorded_cycle
from cranktrain.structure.assembly import Assembly
from cranktrain.studies.constant_speed import Request


@dataclass(frozen=True, eq=False)
class Recorded:
    """Modal velocities of a block over one period.

    Attributes
    ----------
    speed_rpm : rev/min
    period : s
    velocity : (n, m) modal velocities at n instants uniform in time, kg^0.5 m/s
    steady : true if the cycles repeat
    """

    speed_rpm: float
    period: float
    velocity: Array
    steady: bool = True

    @property
    def frequency(self) -> Array:
        """Frequencies (l,) of the lines, Hz, from the first harmonic to below half the sampling rate."""
        return np.arange(1, (len(self.velocity) + 1) // 2) / self.period

    @property
    def lines(self) -> Array:
        """Complex amplitudes (l, m) of the lines: q̇(t) = Re Σ c_k e^{2πi f_k t}, without the mean."""
        count = len(self.velocity)
        return np.asarray(2.0 / count * np.fft.rfft(self.velocity, axis=0)[1 : (count + 1) // 2])


def recorded(made: Assembly, request: Request, gas: Gas | None, step_deg: float, say: Progress) -> Recorded:
    """Run at the request's speed with steps of ``step_deg`` until the cycles repeat, and record one period.

    Raises ``SolverError`` if a step fails.
    """
    request.tell_doubts(made.engine, gas)
    settings = replace(made.settings, step=math.radians(step_deg))
    simulation = Simulation(made.engine, made.body, settings, gas, made.parts)
    simulation.inputs[0] = request.speed
    assert made.parts.block is not None
    modes, rows = made.parts.block.n_modes, list[Array]()

    def look() -> None:
        first = offset(VELOCITY, simulation.model.omega2.size) + int(turning_modes(simulation.model))
        rows.append(simulation.state[first : first + modes].copy())

    cycle = recorded_cycle(simulation, fitted_engine(made.engine, settings), request.settle, say=say, look=look)
    repeats = max(cycle.settling.repeats, 1)
    return Recorded(request.speed_rpm, 4.0 * math.pi * repeats / request.speed, np.array(rows), cycle.settling.steady)
