"""Interface of methods other than the stage solver, which entries of the study may contain.

``benchmarks/tradeoff.py`` of the repository does so with explicit methods, Radau and SciPy's solvers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from cranktrain.core.errors import SolverError
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.simulation import Simulation
from cranktrain_lab.tradeoff.case import Case

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
