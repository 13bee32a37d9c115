"""Search for the variant with the least value of one output, within limits of other outputs.

Differential evolution (:func:`scipy.optimize.differential_evolution`) searches the box of the varied values without
derivatives, because the largest value over speeds is not differentiable where two peaks are equal, and the optimum
often lies there. Then Powell's linear approximation (COBYLA), which handles limits, and the Nelder-Mead simplex refine
the best variant. Variants that meet all limits rank first, by the output. Then follow the others, by the relative
excess over limits, and last those that failed. Values over more than a decade are searched in their logarithm.

Each evaluation is stored like a variant. The search depends only on its seed, so a repeated study continues where it
ended.
"""

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import Bounds, differential_evolution, minimize
from threadpoolctl import threadpool_limits

from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.types import Array
from cranktrain.store.variant_files import Row, VariantFiles, parquet
from cranktrain_lab.variants.models import Output, answered, model_of
from cranktrain_lab.variants.running import Means, answers, files_of, study_digest, variant_workers
from cranktrain_lab.variants.study import Aim, Study

REFINED = 0.25
"""Fraction of a search's evaluations that is reserved for refinement of the best variant."""
DECADE = 10.0
MEMBERS = 8
"""Members of the population per varied value. The population has at least twice this number."""
AT_BOUND = 1e-3
"""Distance of an optimum from an end of a value's range, as a fraction of the range, below which it is reported."""


@dataclass(frozen=True)
class Optimum:
    """Result of an optimisation, in SI, with the worst value of each output over the speeds.

    Attributes
    ----------
    values, outputs : values and outputs of the best variant
    before : outputs of the engine's own values; empty if there are none, or on failure
    feasible : True if the best variant meets all limits
    evaluations, resumed : number of computed variants, and of those computed by an earlier run
    at_bound : values at an end of their range
    """

    values: dict[str, float]
    outputs: dict[str, float]
    before: dict[str, float]
    feasible: bool
    evaluations: int
    resumed: int
    at_bound: tuple[str, ...]
    seconds: float


class Ended(Exception):
    """Exception that ends a search when its evaluations are used up."""


class Box:
    """Map between varied values and points of the unit cube."""

    def __init__(self, study: Study) -> None:
        self._ends = []
        for one in study.varied:
            low, high = one.distribution.ends
            if not (math.isfinite(low) and math.isfinite(high) and low < high) or one.distribution.kind == "values":
                raise InputError(f"vary.'{one.key}': a search needs low and high, e.g. {{ low = 0.1, high = 0.5 }}")
            self._ends.append((low, high, low > 0.0 and high / low > DECADE))

    def values(self, point: Array) -> Array:
        """Return the d varied values, (d,), at a point of the unit cube."""
        found = [
            low * (high / low) ** x if geometric else low + x * (high - low)
            for x, (low, high, geometric) in zip(np.clip(point, 0.0, 1.0).tolist(), self._ends, strict=True)
        ]
        return np.array(found)

    def point(self, values: Sequence[float]) -> Array:
        """Return the point of the unit cube of varied values (d,), which are clipped to their ranges."""
        found = []
        for value, (low, high, geometric) in zip(values, self._ends, strict=True):
            inside = min(max(value, low), high)
            found.append(math.log(inside / low) / math.log(high / low) if geometric else (inside - low) / (high - low))
        return np.array(found)


class Search:
    """Evaluations of one optimum search. Each variant is computed once, stored and ranked."""

    def __init__(self, aim: Aim, box: Box, files: VariantFiles, outputs: tuple[Output, ...]) -> None:
        self._aim, self._box, self._files, self._outputs = aim, box, files, outputs
        self._known: dict[bytes, dict[str, float]] = {}
        self._count, self.resumed, self.best = 0, 0, (math.inf, np.zeros(0))
        self.left = aim.evaluations
        self.submit: Callable[[Array], Future[Any]] | None = None
        self.workers = 1
        self.tell: Callable[[str, float], None] = lambda text, share: None

    def read(self) -> None:
        """Read the variants that an earlier run computed."""
        numbers = self._files.column("variant")
        if not numbers.size:
            return
        values = np.stack([self._files.column(name) for name in self._files.names], axis=1)
        outputs = {output.name: self._files.column(output.name) for output in self._outputs}
        for k, one in enumerate(values):
            self._known[one.tobytes()] = {name: float(column[k]) for name, column in outputs.items()}
        self._count = self.resumed = int(numbers.size)

    def ranks(self, points: Iterable[Array]) -> list[float]:
        """Return the rank of each point (lowest is best); raises :class:`Ended` when evaluations are used up."""
        values = [self._box.values(np.asarray(point)) for point in points]
        new = list({one.tobytes(): one for one in values if one.tobytes() not in self._known}.values())
        self.left -= len(values)
        if self.left < 0:
            raise Ended
        assert self.submit is not None
        for k, found in answers(self.submit, np.array(new), list(range(len(new))), self.workers) if new else ():
            failed = found if isinstance(found, str) else ""
            self._files.keep(Row(self._count, new[k], {} if failed else found, failed))
            self._count += 1
            self._known[new[k].tobytes()] = {} if failed else self.worst(found)
        found_ranks = []
        for one in values:
            rank = self.rank(self._known[one.tobytes()])
            found_ranks.append(rank)
            if rank < self.best[0]:
                self.best = (rank, one)
        self.tell(f"{self._count} evaluations", 1.0 - self.left / self._aim.evaluations)
        return found_ranks

    def outputs_at(self, point: Array) -> dict[str, float]:
        """Return the worst values of outputs at a point; empty if the variant failed."""
        self.ranks([point])
        return self._known[self._box.values(np.asarray(point)).tobytes()]

    def worst(self, found: Mapping[str, Array]) -> dict[str, float]:
        """Return the worst value of each output over the speeds."""
        return {o.name: float(np.min(found[o.name]) if o.worst == "least" else np.max(found[o.name]))
                for o in self._outputs}  # fmt: skip

    def excess(self, outputs: Mapping[str, float]) -> Array:
        """Return the excess (limits,) of each limited output, relative to its limit; negative within the limit."""
        found = [-1.0]
        for limit in self._aim.limits:
            value = outputs[limit.output]
            for end, sign in ((limit.at_most, 1.0), (limit.at_least, -1.0)):
                if math.isfinite(end):
                    found.append(sign * (value - end) / (abs(end) or 1.0))
        return np.array(found)

    def rank(self, outputs: Mapping[str, float]) -> float:
        """Return the rank of a variant's outputs: −1 … 1 within all limits, 2 … 3 beyond a limit, 4 for a failure."""
        if not outputs or not all(math.isfinite(value) for value in outputs.values()):
            return 4.0
        beyond = float(np.maximum(self.excess(outputs), 0.0).sum())
        if beyond > 0.0:
            return 2.0 + beyond / (1.0 + beyond)
        value = outputs[self._aim.minimize]
        return value / (self.scale + abs(value))

    scale = 1.0
    """Scale of the minimised output in ranks."""


def find_optimum(
    study: Study,
    folder: Path,
    means: Means,
    say: Callable[[str], None] = lambda text: None,
    tell: Callable[[str, float], None] = lambda text, share: None,
) -> Optimum:
    """Search the optimum of a study; evaluations are stored in ``folder`` as by :func:`.running.run_variants`.

    Raises
    ------
    InputError
        a study without [optimize], unbounded values, a folder with other contents
    SolverError
        all variants failed
    """
    if study.aim is None:
        raise InputError("[optimize] is missing; it has minimize, the output that is to be least, and limits")
    parquet()  # a missing package is reported before the model is made
    box, began = Box(study), time.perf_counter()
    with threadpool_limits(limits=1, user_api="blas"):
        model = model_of(study, say)
    about = {"method": "optimize", "n": study.aim.evaluations, "pareto": []}
    files = files_of(study, model, folder, about)
    files.begin(study_digest(replace(study, aim=None)) + repr(study.aim.seed), means.anew)
    files.write()  # makes all results of an earlier run readable
    search = Search(study.aim, box, files, model.outputs)
    search.tell = tell
    search.read()
    try:
        with variant_workers(study, model, means, study.aim.evaluations) as (search.submit, search.workers):
            # Outputs at the engine's own values, if all varied values are in the engine.
            own = {one.key: one.own for one in study.varied if one.own is not None}
            first = answered(model, own) if len(own) == len(study.varied) else ""
            before = {} if isinstance(first, str) else search.worst(first)
            search.scale = abs(before.get(study.aim.minimize, 1.0)) or 1.0
            _search(study, search)
            rank, values = search.best
            if rank >= 4.0:
                raise SolverError("no variant has a result; check the values' ranges by 'cranktrain vary'")
    finally:
        files.close()
    outputs = search._known[values.tobytes()]
    found = []
    for one, value in zip(study.varied, values.tolist(), strict=True):
        low, high = one.distribution.ends
        if min(value - low, high - value) <= AT_BOUND * (high - low):
            found.append(one.key)
    return Optimum(
        dict(zip(files.names, values.tolist(), strict=True)), outputs, before, rank < 2.0, search._count,
        search.resumed, tuple(found), time.perf_counter() - began,
    )  # fmt: skip


def _search(study: Study, search: Search) -> None:
    """Run differential evolution, then refine the best variant."""
    aim, d = study.aim, len(study.varied)
    assert aim is not None
    # The first generation must fit into the remaining evaluations, of which there are at least ten.
    refined = min(max(int(REFINED * aim.evaluations), 4 * d), aim.evaluations // 2)
    members = min(max(MEMBERS * d, 2 * MEMBERS), aim.evaluations - refined)
    search.left -= refined
    rng = np.random.default_rng(aim.seed)
    start = rng.random((members, d))
    if len(own := [one.own for one in study.varied if one.own is not None]) == d:
        start[0] = search._box.point(own)
    with suppress(Ended):
        differential_evolution(
            lambda point: search.ranks([point])[0], Bounds(np.zeros(d), np.ones(d)), init=start, polish=False,
            maxiter=max(1, aim.evaluations // members), tol=1e-10, rng=rng, updating="deferred",
            workers=lambda _, points: search.ranks(points),
        )  # fmt: skip
    search.left = max(search.left, 0) + refined
    for rule in ("COBYLA", "Nelder-Mead", "Nelder-Mead"):
        _refine(search, rule, d)


def _refine(search: Search, rule: str, d: int) -> None:
    """Refine the best variant by one optimisation method (``rule``) within the remaining evaluations."""
    point = search._box.point(search.best[1].tolist())
    limit = max(search.left // 2, d + 2)
    try:
        if rule == "COBYLA":
            rules = {"type": "ineq", "fun": lambda x: _within(search, x)}
            minimize(
                lambda x: search.outputs_at(x).get(search._aim.minimize, math.inf) / search.scale, point,
                method="COBYLA", constraints=[rules], options={"rhobeg": 0.02, "tol": 1e-6, "maxiter": limit},
            )  # fmt: skip
        else:
            simplex = np.vstack((point, np.clip(point + 0.01 * (np.eye(d) - 2.0 * np.diag(point > 0.98)), 0.0, 1.0)))
            minimize(
                lambda x: search.ranks([x])[0] + float(np.abs(x - np.clip(x, 0.0, 1.0)).sum()), point, method=rule,
                options={"initial_simplex": simplex, "xatol": 1e-6, "fatol": 1e-10, "maxfev": limit},
            )  # fmt: skip
    except Ended:
        pass


def _within(search: Search, point: Array) -> Array:
    """Return the constraint values that COBYLA keeps above 0: margins of limits and of the box."""
    outputs = search.outputs_at(point)
    margins = -search.excess(outputs) if outputs else np.full(1, -1.0)
    return np.concatenate((margins[1:], point, 1.0 - point))
