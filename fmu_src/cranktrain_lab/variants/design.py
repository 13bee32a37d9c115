"""Designs of a study, which define the values of each variant and are reproducible from seed and variant number.

    latin-hypercube   n variants; each value's range is cut into n equal parts, and each part occurs once
    sobol             n variants of a scrambled Sobol sequence; n a power of 2 keeps its balance
    random            n independent variants
    grid              all combinations of ``levels`` of each value
    sensitivity       for Sobol indices by Saltelli's scheme: matrices A and B of n rows each and, for each of the d
                      values, A with that value's column of B; n (d + 2) variants, n a power of 2

Source: A. Saltelli et al., Variance based sensitivity analysis of model output, Computer Physics Communications 181
(2010), for the last.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain_lab.variants.distributions import Distribution

METHODS = ("latin-hypercube", "sobol", "random", "grid", "sensitivity")
MOST = 10_000_000
"""Largest number of variants of a study."""


@dataclass(frozen=True)
class Design:
    """Design of a study: sampling method, number n of variants, levels of a grid, and seed."""

    method: str = "latin-hypercube"
    n: int = 100
    levels: int = 5
    seed: int = 1

    def count(self, distributions: Sequence[Distribution]) -> int:
        """Return the number of variants of this design for these varied values."""
        if self.method == "grid":
            return math.prod(self._sizes(distributions))
        return self.n * (len(distributions) + 2) if self.method == "sensitivity" else self.n

    def check(self, distributions: Sequence[Distribution]) -> None:
        """Raise ``InputError`` for an impossible design."""
        if not distributions:
            raise InputError("nothing is varied; name at least one value, e.g. 'damper.viscosity', with a distribution")
        if self.method in ("sobol", "sensitivity") and self.n & (self.n - 1):
            near = 2 ** round(math.log2(self.n))
            raise InputError(f"design.n: {self.n} is no power of 2, which method '{self.method}' needs; take {near}")
        if self.count(distributions) > MOST:
            raise InputError(f"the design has {self.count(distributions)} variants, more than {MOST}; take fewer")

    def values(self, distributions: Sequence[Distribution]) -> Array:
        """Return values (variants, d) in SI of each variant and of the d varied values, reproducible for a design."""
        if self.method == "grid":
            axes = [one.levels(size) for one, size in zip(distributions, self._sizes(distributions), strict=True)]
            return np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1)
        points = self._points(len(distributions))
        return np.stack([one.quantile(points[:, k]) for k, one in enumerate(distributions)], axis=1)

    def _sizes(self, distributions: Sequence[Distribution]) -> list[int]:
        return [len(one.values) if one.kind == "values" else self.levels for one in distributions]

    def _points(self, d: int) -> Array:
        """Return points (variants, d) of the open unit cube, one coordinate for each of the d varied values."""
        rng = np.random.default_rng(self.seed)
        if self.method == "random":
            return rng.random((self.n, d))
        if self.method == "latin-hypercube":
            return np.asarray(qmc.LatinHypercube(d, rng=rng).random(self.n))
        if self.method == "sobol":
            return _open(qmc.Sobol(d, rng=rng).random(self.n))
        both = _open(qmc.Sobol(2 * d, rng=rng).random(self.n))
        a, b = both[:, :d], both[:, d:]
        mixed = np.repeat(a[None], d, axis=0)
        for k in range(d):
            mixed[k, :, k] = b[:, k]
        return np.concatenate((a, b, mixed.reshape(-1, d)))


def _open(points: Array) -> Array:
    """Move points of the unit cube away from 0 and 1, where quantiles of a normal distribution are infinite."""
    return np.clip(points, 1e-12, 1.0 - 1e-12)
