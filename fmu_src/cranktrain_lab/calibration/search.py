"""Search for free values within bounds, by least squares from several starts.

Frequencies matched with modes jump, so calibration finds its starts by differential evolution (Storn and Price, J.
Global Optim. 11 (1997) 341). Orders are smooth with local minima, one for each resonance that a peak may be mistaken
for, so identification finds its starts by a Sobol sequence. Least squares use SciPy's bounded trust region (Branch,
Coleman and Li 1999). Values are scaled to their bounds. An interrupted search returns the best values so far.
"""

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from scipy.optimize import differential_evolution, least_squares
from scipy.stats import qmc

from cranktrain.core.reduced_body import Array

POPULATION = 5
"""Members of a generation per free value."""
STARTS = 6
"""Number of least-squares starts: the best values found, and random values around them."""
SPREAD = 0.1
"""Standard deviation of the random starts, as a fraction of the range between bounds."""
STEP = 2e-3
"""Step of differences in least squares, as a fraction of the range. It exceeds jumps of residuals by mode matching."""
MET = 1e-10
"""Cost (sum of squared residuals in tolerances) at which a search stops."""
GLOBAL_SHARE = 0.7
"""Largest fraction of the evaluations for differential evolution."""


SMOOTH_STEP = 1e-4
"""Step of differences of residuals without jumps, as a fraction of the range between bounds."""
Follow = Callable[[float, float], None]


class Residuals(Protocol):
    """Problem of a search: bounds (p,) of p free values, and m residuals whose sum of squares is minimised."""

    @property
    def low(self) -> Array:
        """Lower bounds of the free values."""

    @property
    def high(self) -> Array:
        """Upper bounds of the free values."""

    def residuals(self, free: Array) -> Array:
        """Return all residuals (m,) at free values (p,)."""


class Found(NamedTuple):
    """Result of a search: free values (p,) SI, cost (sum of squares in tolerances), evaluations, interrupted or not."""

    free: Array
    cost: float
    evaluations: int
    interrupted: bool


class _Search:
    """Evaluation of the problem at scaled values; stores the best values so far."""

    def __init__(self, problem: Residuals, limit: int, follow: Follow) -> None:
        self.problem, self.limit, self.follow = problem, limit, follow
        self.best, self.cost, self.evaluations = np.full(problem.low.size, 0.5), np.inf, 0

    def residuals(self, scaled: Array) -> Array:
        """Return residuals, in tolerances, and store the best values."""
        p = self.problem
        found = p.residuals(p.low + np.clip(scaled, 0.0, 1.0) * (p.high - p.low))
        self.evaluations += 1
        if (cost := float(found @ found)) < self.cost:
            self.best, self.cost = np.clip(scaled, 0.0, 1.0), cost
        if self.evaluations % 50 == 0:
            self.follow(min(1.0, self.evaluations / self.limit), self.cost)
        return found

    def slopes(self, scaled: Array) -> Array:
        """Return derivatives (m, p) of m residuals by p values, by differences away from the nearer bound."""
        at, columns = self.residuals(scaled), []
        for k in range(scaled.size):
            step = SMOOTH_STEP if scaled[k] < 0.5 else -SMOOTH_STEP
            moved = scaled.copy()
            moved[k] += step
            columns.append((self.residuals(moved) - at) / step)
        return np.stack(columns, axis=1)

    def total(self, scaled: Array) -> float:
        """Return the sum of squared residuals at scaled values."""
        found = self.residuals(scaled)
        return float(found @ found)


def search(
    problem: Residuals,
    start: Array | None = None,
    seed: int = 1,
    evaluations: int = 20000,
    follow: Follow = lambda share, cost: None,
) -> Found:
    """Search the best free values of a problem.

    Parameters
    ----------
    start : (p,) values to include in the first generation; values outside their bounds are clipped
    evaluations : approximate limit of both parts together
    follow : called with the completed fraction and the cost so far
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
    """Search the best free values of a smooth problem by least squares from its start and the best Sobol points.

    Parameters
    ----------
    start : (p,) first start; values outside their bounds are clipped
    points : number of Sobol points, a power of two; 0 for no other starts
    starts : number of the best points from which least squares start in addition to ``start``
    rounds : limit of evaluations of a search by least squares, without derivatives
    follow : called with the completed fraction and the cost so far
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
