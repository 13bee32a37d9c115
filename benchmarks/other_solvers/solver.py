"""Solvers that know nothing of the model's structure, on its first-order equations.

``runge-kutta-4``, ``central-differences`` and ``radau-5`` take fixed steps; ``scipy:Radau``, ``scipy:BDF`` and
``scipy:LSODA`` choose theirs by a tolerance per unknown: the solver's tolerance times the unknown's own alternating
amplitude (scaling ``each``), or that with a tenth of its kind's largest as the least (``floored``): high modes need not
be followed. Their Jacobian is dense, by compiled differences whose increments are scaled alike.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.other_solvers.first_order import FirstOrder
from benchmarks.other_solvers.fixed_step import LIMITS, METHODS, OK, UNBOUNDED, Equations, FixedStep
from scipy.integrate import solve_ivp

from cranktrain.core.errors import InputError, SolverError, nearest
from cranktrain.core.reduced_body import Array
from cranktrain_lab.tradeoff.case import COMMUNICATION_DEG, Case, Started, Unstable

SCIPY = ("scipy:Radau", "scipy:BDF", "scipy:LSODA")
FLOOR = 0.1
AMPLITUDE_CYCLES, AMPLITUDE_STEP_DEG = 2, 1.0
INCREMENT = 1.0e-7
"""Of the Jacobian's differences, in amplitudes of the unknowns."""
BOUND = 1.0e6
"""Modal coordinates (m kg½) and velocities beyond it are those of an unstable run; they stay below 100."""


@dataclass(frozen=True)
class OtherSolver:
    """One of these solvers with its choices, as the trade-off study takes it.

    Attributes
    ----------
    method : one of ``METHODS`` or ``SCIPY``
    tolerance : relative to the unknowns' amplitudes, of SciPy's solvers
    scaling : of the amplitudes, ``each`` or ``floored``

    Raises
    ------
    InputError
        a method that does not exist, one of SciPy's without a tolerance
    """

    method: str
    tolerance: float | None = None
    scaling: str = "each"

    def __post_init__(self) -> None:
        if self.method not in METHODS + SCIPY:
            raise InputError(f"solver '{self.method}' does not exist; {nearest(self.method, METHODS + SCIPY)}")
        if self.method in SCIPY and self.tolerance is None:
            raise InputError(f"{self.method} needs a tolerance")

    @property
    def name(self) -> str:
        """Its name in charts."""
        suffix = "" if self.scaling == "each" else ", floored"
        return self.method.replace("scipy:", "SciPy ") + suffix

    @property
    def key(self) -> str:
        """All that decides its runs besides the case: its choices and the sources of this folder."""
        sources = b"".join(file.read_bytes() for file in sorted(Path(__file__).parent.glob("*.py")))
        return f"{self!r} {sha256(sources).hexdigest()}"

    def run(self, case: Case, started: Started) -> tuple[Array, float, dict[str, int]]:
        """Run a case: values (2 + b, samples), processor seconds and counts.

        Values are of pulley torsion, axial motion and least films. Raises ``Unstable`` for a run beyond all bounds,
        ``SolverError`` where its iterations fail, ``InputError`` for a model that the equations do not hold.
        """
        simulation = started(case)
        equations = FirstOrder(simulation)
        size = amplitudes(case, started)
        equations.increments[:] = INCREMENT * size
        y0 = equations.start(simulation.state)
        if self.method in SCIPY:
            size = floored(size, equations.modes) if self.scaling == "floored" else size
            return _scipy(self, case, equations, y0, size)
        return _fixed(self.method, case, equations, y0, size)

    def judged(self, case: Case, started: Started) -> tuple[str, dict[str, Any]]:
        """Status of a run that came to its end; of explicit methods with the step times the model's largest rate.

        Bearings that touch keep an unstable run within bounds: the step tells, not the size of the answer.
        """
        if self.method not in LIMITS:
            return "ok", {}
        product = largest_rate(case, started) * math.radians(case.step_deg) / case.speed
        return "ok" if product < LIMITS[self.method] else "unstable", {"step_times_rate": product}


def amplitudes(case: Case, started: Started) -> Array:
    """Standard deviation of each unknown over the second cycle of a run of the stage solver, (size,)."""
    settings = replace(case.settings, integrator="auto", step=math.radians(AMPLITUDE_STEP_DEG))
    simulation = started(replace(case, settings=settings))
    equations = FirstOrder(simulation)
    per_cycle = round(720.0 / COMMUNICATION_DEG)
    samples = []
    for k in range(1, AMPLITUDE_CYCLES * per_cycle + 1):
        simulation.step(k * case.period / per_cycle)
        samples.append(equations.start(simulation.state))
    size = np.std(samples[-per_cycle:], axis=0)
    return np.asarray(np.maximum(size, 1e-9 * size.max()))


def floored(size: Array, n: int) -> Array:
    """Amplitudes (size,) of which none of the ``n`` modes' is below ``FLOOR`` of the largest place, or velocity."""
    result = size.copy()
    for block in (slice(0, n), slice(n, 2 * n)):
        result[block] = np.maximum(size[block], FLOOR * size[block].max())
    return result


def largest_rate(case: Case, started: Started, samples: int = 24) -> float:
    """Largest modulus (1/s) of the eigenvalues of the Jacobian along the second cycle: what explicit steps obey."""
    size = amplitudes(case, started)
    simulation = started(replace(case, settings=replace(case.settings, step=math.radians(AMPLITUDE_STEP_DEG))))
    equations = FirstOrder(simulation)
    equations.increments[:] = INCREMENT * size
    largest = 0.0
    for k in range(1, 2 * samples + 1):
        simulation.step(k * case.period / samples)
        values = np.linalg.eigvals(equations.jacobian(simulation.time, equations.start(simulation.state)))
        largest = max(largest, float(np.abs(values).max()))
    return largest


def _scipy(
    solver: OtherSolver, case: Case, equations: FirstOrder, y0: Array, size: Array
) -> tuple[Array, float, dict[str, int]]:
    """Run SciPy's solver: outputs, processor seconds, counts."""
    method, tolerance = solver.method, solver.tolerance or 0.0
    equations(0.0, y0)
    equations.jacobian(0.0, y0)  # compiled before the clock starts
    equations.evaluations = 0
    count = round(720.0 / case.kept_deg) * case.cycles
    kept = case.simulated * np.arange(1, count + 1) / count
    begin = time.process_time()
    solution = solve_ivp(
        equations, (0.0, kept[-1]), y0, method=method.removeprefix("scipy:"), t_eval=kept, rtol=tolerance,
        atol=tolerance * size, jac=equations.jacobian,
    )  # fmt: skip
    used = time.process_time() - begin
    if not solution.success:
        raise SolverError(f"{method} at tolerance {tolerance:g}: {' '.join(str(solution.message).split())}")
    counts = {"evaluations": equations.evaluations, "jacobians": int(solution.njev)}
    return equations.quantities(solution.y), used, counts


def _fixed(
    method: str, case: Case, equations: FirstOrder, y0: Array, size: Array
) -> tuple[Array, float, dict[str, int]]:
    """Run a solver of fixed steps: outputs, processor seconds, counts."""

    def solver() -> FixedStep:
        kernels = Equations(equations.rate_address, equations.data, equations.jacobian_address)
        return FixedStep(method, kernels, y0, equations.modes, floored(size, equations.modes))

    steps = round(case.kept_deg / case.step_deg)
    h = math.radians(case.kept_deg) / case.speed / steps
    solver().advance(1.0e-3 * h, 1, BOUND)  # compiled before the clock starts
    run = solver()
    count = round(720.0 / case.kept_deg) * case.cycles
    samples = np.empty((count, y0.size))
    begin = time.process_time()
    for k in range(count):
        status = run.advance(h, steps, BOUND)
        if status == UNBOUNDED:
            raise Unstable(f"{method} at {case.step_deg:.3g} deg is unstable after {run.time:.3g} s")
        if status != OK:
            raise SolverError(f"{method} at {case.step_deg:.3g} deg: iterations diverge at {run.time:.3g} s")
        samples[k] = run.y
    used = time.process_time() - begin
    counts = {"steps": count * steps, "jacobians": run.jacobians}
    return equations.quantities(samples.T), used, counts
