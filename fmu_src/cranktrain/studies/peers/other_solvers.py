"""Solvers that know nothing of the model's structure, on its first-order equations.

``runge-kutta-4``, ``central-differences`` and ``radau-5`` take fixed steps; ``scipy:Radau``, ``scipy:BDF`` and
``scipy:LSODA`` choose theirs by a tolerance per unknown: the case's tolerance times the unknown's own alternating
amplitude (scaling ``each``), or that with a tenth of its kind's largest as the least (``floored``): high modes need not
be followed. Their Jacobian is dense, by compiled differences whose increments are scaled alike.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp

from cranktrain.core.errors import InputError, SolverError, nearest
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.simulation import Simulation
from cranktrain.studies.peers.first_order import FirstOrder
from cranktrain.studies.peers.fixed_step import METHODS, OK, UNBOUNDED, Equations, FixedStep
from cranktrain.studies.tradeoff.case import COMMUNICATION_DEG, Case

SCIPY = ("scipy:Radau", "scipy:BDF", "scipy:LSODA")
FLOOR = 0.1
AMPLITUDE_CYCLES, AMPLITUDE_STEP_DEG = 2, 1.0
INCREMENT = 1.0e-7
"""Of the Jacobian's differences, in amplitudes of the unknowns."""
BOUND = 1.0e6
"""Modal coordinates (m kg½) and velocities beyond it are those of an unstable run; they stay below 100."""


class Unstable(SolverError):
    """A run that left all bounds."""


def other_run(case: Case, started: Callable[[Case], Simulation]) -> tuple[Array, float, dict[str, int]]:
    """Run a case by one of these solvers.

    Parameters
    ----------
    started : makes the case's simulation at its start

    Returns
    -------
    values (2 + b, samples) of pulley torsion, axial motion and least films, processor seconds, counts

    Raises
    ------
    Unstable, SolverError
        a run that leaves all bounds, one whose iterations fail
    InputError
        a method that does not exist, a model that the equations do not hold
    """
    if case.method not in METHODS + SCIPY:
        raise InputError(f"solver '{case.method}' does not exist; {nearest(case.method, METHODS + SCIPY)}")
    simulation = started(case)
    equations = FirstOrder(simulation)
    size = amplitudes(case, started)
    equations.increments[:] = INCREMENT * size
    y0 = equations.start(simulation.state)
    if case.method in SCIPY:
        return _scipy(case, equations, y0, floored(size, equations.modes) if case.scaling == "floored" else size)
    return _fixed(case, equations, y0, size)


def amplitudes(case: Case, started: Callable[[Case], Simulation]) -> Array:
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


def largest_rate(case: Case, started: Callable[[Case], Simulation], samples: int = 24) -> float:
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


def _scipy(case: Case, equations: FirstOrder, y0: Array, size: Array) -> tuple[Array, float, dict[str, int]]:
    """Run SciPy's solver: outputs, processor seconds, counts."""
    if case.tolerance is None:
        raise InputError(f"{case.method} needs a tolerance")
    equations(0.0, y0)
    equations.jacobian(0.0, y0)  # compiled before the clock starts
    equations.evaluations = 0
    count = round(720.0 / case.kept_deg) * case.cycles
    kept = case.simulated * np.arange(1, count + 1) / count
    begin = time.process_time()
    solution = solve_ivp(
        equations, (0.0, kept[-1]), y0, method=case.method.removeprefix("scipy:"), t_eval=kept, rtol=case.tolerance,
        atol=case.tolerance * size, jac=equations.jacobian,
    )  # fmt: skip
    used = time.process_time() - begin
    if not solution.success:
        raise SolverError(f"{case.method} at tolerance {case.tolerance:g}: {' '.join(str(solution.message).split())}")
    counts = {"evaluations": equations.evaluations, "jacobians": int(solution.njev)}
    return equations.quantities(solution.y), used, counts


def _fixed(case: Case, equations: FirstOrder, y0: Array, size: Array) -> tuple[Array, float, dict[str, int]]:
    """Run a solver of fixed steps: outputs, processor seconds, counts."""

    def solver() -> FixedStep:
        kernels = Equations(equations.rate_address, equations.data, equations.jacobian_address)
        return FixedStep(case.method, kernels, y0, equations.modes, floored(size, equations.modes))

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
            raise Unstable(f"{case.method} at {case.step_deg:.3g} deg is unstable after {run.time:.3g} s")
        if status != OK:
            raise SolverError(f"{case.method} at {case.step_deg:.3g} deg: iterations diverge at {run.time:.3g} s")
        samples[k] = run.y
    used = time.process_time() - begin
    counts = {"steps": count * steps, "jacobians": run.jacobians}
    return equations.quantities(samples.T), used, counts
