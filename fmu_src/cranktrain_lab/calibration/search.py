"""Search for free values within bounds, by least squares from several starts.

Frequencies matched with modes jump, so calibration looks for its starts by differential evolution. Orders are smooth
and have local minima, one for each resonance that a peak may be taken for; identification looks for its starts by a
Sobol sequence. Storn and Price, J. Global Optim. 11 (1997) 341; a bounded trust region (Branch, Coleman and Li 1999),
as SciPy has it; all on values scaled to their bounds. What was best is kept when the search is interrupted.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from scipy.optimize import differential_evolution, least_squares
from scipy.stats import qmc

from cranktrain.core.reduced_body import Array

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


SMOOTH_STEP = 1e-4
"""Step of the differences of residuals without jumps, over the bounds' distance."""
Follow = Callable[[float, float], None]


class Residuals(Protocol):
    """Problem of a search: bounds (p,) of its free values, and residuals (m,), whose sum of squares is to be least."""

    @property
    def low(self) -> Array:
        """Lower bounds."""

    @property
    def high(self) -> Array:
        """Upper bounds."""

    def residuals(self, free: Array) -> Array:
        """All residuals at free values."""


class Found(NamedTuple):
    """Free values (p,) SI, their cost (sum of squares, tolerances), evaluations, whether the search was interrupted."""

    free: Array
    cost: float
    evaluations: int
    interrupted: bool


class _Search:
    """Cost of scaled values, with the best ones so far."""

    def __init__(self, problem: Residuals, limit: int, follow: Follow) -> None:
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

    def slopes(self, scaled: Array) -> Array:
        """Derivatives (m, p) of the residuals by differences of :data:`SMOOTH_STEP`, away from the nearer bound."""
        at, columns = self.residuals(scaled), []
        for k in range(scaled.size):
            step = SMOOTH_STEP if scaled[k] < 0.5 else -SMOOTH_STEP
            moved = scaled.copy()
            moved[k] += step
            columns.append((self.residuals(moved) - at) / step)
        return np.stack(columns, axis=1)

    def total(self, scaled: Array) -> float:
        """Sum of squares."""
        found = self.residuals(scaled)
        return float(found @ found)


def search(
    problem: Residuals,
    start: Array | None = None,
    seed: int = 1,
    evaluations: int = 20000,
    follow: Follow = lambda share, cost: None,
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


def smooth_search(
    problem: Residuals,
    start: Array,
    seed: int = 1,
    points: int = 0,
    starts: int = 1,
    rounds: int = 30,
    follow: Follow = lambda share, cost: None,
) -> Found:
    """Best free values of a problem without jumps: least squares from its start and the best of a Sobol sequence.

    Parameters
    ----------
    start : (p,) first start; values outside their bounds are moved to them
    points : of the sequence, a power of two; 0: no other starts
    starts : the best of these points from which least squares start, besides ``start``
    rounds : most evaluations of a search by least squares, derivatives not counted
    follow : gets the completed fraction and the cost so far
    """
    n, interrupted, width = problem.low.size, False, problem.high - problem.low
    run = _Search(problem, points + (starts + 1) * rounds, follow)
    first = np.clip((start - problem.low) / width, 0.0, 1.0)
    try:
        cost = {0: run.total(first)}
        tried = [first]
        if points:
            for point in qmc.Sobol(n, rng=np.random.default_rng(seed)).random(points):
                cost[len(tried)] = run.total(point)
                tried.append(point)
        best = sorted(cost, key=lambda k: cost[k])[: starts + 1]
        for k in dict.fromkeys([0, *best]):
            least_squares(
                run.residuals, np.clip(tried[k], 1e-6, 1.0 - 1e-6), jac=run.slopes, bounds=(0.0, 1.0),
                max_nfev=rounds, xtol=1e-8, ftol=1e-8, gtol=1e-10,
            )  # fmt: skip
    except KeyboardInterrupt:
        interrupted = True
    return Found(problem.low + run.best * width, run.cost, run.evaluations, interrupted)
