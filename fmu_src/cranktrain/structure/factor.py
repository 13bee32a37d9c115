"""Sparse direct factorisation of symmetric positive definite matrices.

SuperLU in symmetric mode (no pivoting off the diagonal) with a minimum-degree ordering; PARDISO where it is installed.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

Array = NDArray[np.float64]


class Factor(Protocol):
    """A factorised matrix."""

    def solve(self, rhs: Array) -> Array:
        """Solution for one right-hand side (n,) or several (n, m)."""


def factorise(matrix: sparse.spmatrix) -> Factor:
    """Factors of a symmetric positive definite matrix (n, n), for many solutions."""
    return splu(
        sparse.csc_matrix(matrix),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
