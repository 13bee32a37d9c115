"""Case of the study: all settings that determine one run, so that equal cases run only once; and who may run it.

Other methods than the stage solver have an interface here, by which ``benchmarks/tradeoff.py`` of the repository
measures explicit methods, Radau and SciPy's solvers.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from cranktrain.core.errors import SolverError
from cranktrain.core.reduced_body import Array
from cranktrain.core.units import RPM
from cranktrain.dynamics.model.settings import Settings, resolved
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.model import Engine

CYCLES = 6
"""Number of cycles of a run, after which the transient due to the run's method and step has decayed."""
GRID_DEG = 1.0
COMMUNICATION_DEG = 3.0
"""Interval of stored outputs, degrees (or the next multiple of the step), so that output costs are equal."""


@dataclass(frozen=True)
class Case:
    """Settings of one run; angles in rad.

    Attributes
    ----------
    settings : levels, integrator and step
    cutoff_hz : cut-off frequency of the crank's elastic modes; None for that of the engine file
    interval_deg : degrees between stored outputs; None: see ``COMMUNICATION_DEG``
    coupled_deg : communication step of a master that gives the pressures; None: built-in trace
    scheme, exchange : of a master that couples the cranktrain with the combustion, and who reconstructs pressures
        (:data:`cranktrain_lab.coupling.modules.RECONSTRUCTIONS`); None: the master's pressures are those of the trace
    trace_deg, trace_rule : spacing of the pressure trace's samples, and between them a ``spline`` or ``linear``
    table : resolution of the film table
    film_grid : intervals around and across of films solved in the loop; None as they are
    """

    engine: Engine
    speed: float
    settings: Settings
    cycles: int = CYCLES
    cutoff_hz: float | None = None
    interval_deg: float | None = None
    coupled_deg: float | None = None
    scheme: str | None = None
    exchange: str | None = None
    trace_deg: float | None = None
    trace_rule: str = "spline"
    table: str = "default"
    film_grid: tuple[int, int] | None = None

    @property
    def levels(self) -> Settings:
        """Settings with all defaults resolved."""
        return resolved(self.settings, self.engine)

    @property
    def step_deg(self) -> float:
        """Step of the integrator, degrees of crank angle."""
        return round(math.degrees(self.levels.step), 9)

    @property
    def kept_deg(self) -> float:
        """Crank angle between stored outputs, degrees."""
        if self.interval_deg is not None:
            return self.interval_deg
        if self.coupled_deg is not None:
            return self.coupled_deg * math.ceil(COMMUNICATION_DEG / self.coupled_deg - 1e-9)
        return self.step_deg * math.ceil(COMMUNICATION_DEG / self.step_deg - 1e-9)

    @property
    def period(self) -> float:
        """Length of a cycle, s."""
        return 4.0 * math.pi / self.speed

    @property
    def simulated(self) -> float:
        """Simulated time of the run, s."""
        return self.cycles * self.period

    def parameters(self) -> dict[str, Any]:
        """Return the case's settings as numbers and names, as stored in points of the study."""
        levels = self.levels
        found: dict[str, Any] = {
            "speed_rpm": round(self.speed / RPM, 6),
            "crank": levels.crank,
            "bearings": levels.bearings,
            "block": levels.block,
            "big_ends": levels.big_ends,
            "damper": levels.damper,
            "cutoff_hz": self.cutoff_hz or self.engine.reduction.running_cutoff_hz,
            "integrator": levels.integrator,
            "step_deg": self.step_deg,
            "cycles": self.cycles,
        }
        if self.coupled_deg is not None:
            found |= {"communication_deg": self.coupled_deg, "reconstruction": self.exchange or levels.reconstruction}
        if self.scheme is not None:
            found["scheme"] = self.scheme
        if self.trace_deg is not None:
            found |= {"trace_deg": self.trace_deg, "trace_rule": self.trace_rule}
        if levels.bearings == "table":
            found["table"] = self.table
        if self.film_grid is not None:
            found["film_grid"] = list(self.film_grid)
        return found


Started = Callable[[Case], Simulation]
"""Function that makes the simulation of a case at its start."""


class Unstable(SolverError):
    """Error of a run that diverged."""


class OtherMethod(Protocol):
    """Method other than the stage solver, which runs cases on the model of their simulation."""

    @property
    def key(self) -> str:
        """Text that identifies the method in the store, from its settings and source files."""

    def run(self, case: Case, started: Started) -> tuple[Array, float, dict[str, int]]:
        """Run a case.

        Returns
        -------
        values (2 + b, samples) of pulley torsion, axial motion and least films at the ends of the case's intervals,
        processor seconds, counts

        Raises
        ------
        Unstable, SolverError, InputError
            a run that diverged, a run that failed, a model that the method does not support
        """

    def judged(self, case: Case, started: Started) -> tuple[str, dict[str, Any]]:
        """Return the status of a completed run (``ok`` or ``unstable``), and further parameters of its point."""
