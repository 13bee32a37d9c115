"""Interface quasi-Newton method for fixed points x = H(x), from differences of former evaluations.

Least squares over the last evaluations give the combination with the least residual, and from it the next x. Degroote,
Bathe, Vierendeels (2009), *Performance of a new partitioned procedure versus a monolithic procedure in fluid–structure
interaction*, Computers & Structures 87, 793–801.
"""

from __future__ import annotations

import numpy as np

from cranktrain.core.reduced_body import Array

MOST = 8
"""Number of differences kept within a step."""
DISTINCT = 1.0e-10
"""Singular values of the differences are ignored below this fraction of the largest singular value."""


class QuasiNewton:
    """Quasi-Newton iteration for the interface values of one communication step."""

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        """Discard the data of the last step."""
        self._results: list[Array] = []
        self._changes: list[Array] = []

    def next(self, result: Array, change: Array) -> Array:
        """Return the next x from H(x) and H(x) − x, each (n,)."""
        self._results = [*self._results[-MOST:], result]
        self._changes = [*self._changes[-MOST:], change]
        if len(self._changes) == 1:
            return result
        changes = np.array([c - change for c in self._changes[:-1]]).T
        results = np.array([r - result for r in self._results[:-1]]).T
        share = np.linalg.lstsq(changes, -change, rcond=DISTINCT)[0]
        return np.asarray(result + results @ share)
