"""Search for free values within bounds: differential evolution, then least squares from several starts.

Storn and Price, J. Global Optim. 11 (1997) 341, and a bounded trust region (Branch, Coleman and Li 1999), as SciPy has
them; both on values scaled to their bounds. What was best is kept when the search is interrupted.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import differential_evolution, least_squares

from cranktrain.core.reduced_body import Array
from cranktrain.studies.calibration.problem import Problem

POPULATION = 5
"""Members of a generation for each free value."""
STARTS = 6
"""Starts of least squares: the best values found, and others around them."""
SPREAD = 0.1
"""Standard deviation of those others, over the bounds' distance."""
STEP = 2e-3
"""Step of the differences in least squares, over the bounds' distance: wider than the jumps of matched modes."""
MET = 1e-10
"""Cost (sum of squares in tolerances) at which a search ends."""
GLOBAL_SHARE = 0.7
"""Part of the evaluations that the evolution may take."""


class Found(NamedTuple):
    """Free values (p,) SI, their cost (sum of squares, tolerances), evaluations, whether the search was interrupted."""

    free: Array
    cost: float
    evaluations: int
    interrupted: bool


class _Search:
    """Cost of scaled values, with the best ones so far."""

    def __init__(self, problem: Problem, limit: int, follow: Callable[[float, float], None]) -> None:
        self.problem, self.limit, self.follow = problem, limit, follow
        self.best, self.cost, self.evaluations = np.full(problem.low.size, 0.5), np.inf, 0

    def residuals(self, scaled: Array) -> Array:
        """Residuals, in tolerances; stores the best values."""
        p = self.problem
        found = p.residuals(p.low + np.clip(scaled, 0.0, 1.0) * (p.high - p.low))
        self.evaluations += 1
        if (cost := float(found @ found)) < self.cost:
            self.best, self.cost = np.clip(scaled, 0.0, 1.0), cost
        if self.evaluations % 50 == 0:
            self.follow(min(1.0, self.evaluations / self.limit), self.cost)
        return found

    def total(self, scaled: Array) -> float:
        """Sum of squares."""
        found = self.residuals(scaled)
        return float(found @ found)


def search(
    problem: Problem,
    start: Array | None = None,
    seed: int = 1,
    evaluations: int = 20000,
    follow: Callable[[float, float], None] = lambda share, cost: None,
) -> Found:
    """Best free values of a problem.

    Parameters
    ----------
    start : (p,) values that the first generation holds; values outside their bounds are moved to them
    evaluations : limit of both parts together, roughly
    follow : gets the completed fraction and the cost so far
    """
    run, rng = _Search(problem, evaluations, follow), np.random.default_rng(seed)
    n, interrupted = problem.low.size, False
    first = np.clip((start - problem.low) / (problem.high - problem.low), 0.0, 1.0) if start is not None else None
    try:
        members = max(POPULATION * n, 5)
        differential_evolution(
            run.total, n * [(0.0, 1.0)], rng=rng, popsize=POPULATION, init="sobol", x0=first, polish=False, tol=1e-6,
            mutation=(0.4, 0.9), recombination=0.8, maxiter=max(1, int(GLOBAL_SHARE * evaluations / members) - 1),
        )  # fmt: skip
        for k in range(STARTS):
            if run.evaluations > evaluations or run.cost < MET:
                break
            around = run.best + (SPREAD * rng.normal(size=n) if k else 0.0)
            least_squares(run.residuals, np.clip(around, STEP, 1.0 - STEP), bounds=(0.0, 1.0), diff_step=STEP,
                          max_nfev=30)  # fmt: skip
    except KeyboardInterrupt:
        interrupted = True
    free = problem.low + run.best * (problem.high - problem.low)
    return Found(free, run.cost, run.evaluations, interrupted)
