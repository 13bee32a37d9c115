"""The LU on vectors against the plain loops that it replaced: ratio of time, largest difference.

``python benchmarks/vector_kernels.py [n]``; for another processor set ``NUMBA_CPU_NAME`` (such as x86-64-v2).
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from cranktrain.dynamics.motion import linear_algebra


@numba.njit(error_model="numpy")
def scalar_factor(a, n):
    """LU by rows, four pivots at once from one row."""
    for i in range(n):
        k = 0
        while k + 3 < i:
            f0 = a[i, k] * a[k, k]
            f1 = (a[i, k + 1] - f0 * a[k, k + 1]) * a[k + 1, k + 1]
            f2 = (a[i, k + 2] - f0 * a[k, k + 2] - f1 * a[k + 1, k + 2]) * a[k + 2, k + 2]
            f3 = (a[i, k + 3] - f0 * a[k, k + 3] - f1 * a[k + 1, k + 3] - f2 * a[k + 2, k + 3]) * a[k + 3, k + 3]
            a[i, k], a[i, k + 1], a[i, k + 2], a[i, k + 3] = f0, f1, f2, f3
            for j in range(k + 4, n):
                a[i, j] -= f0 * a[k, j] + f1 * a[k + 1, j] + f2 * a[k + 2, j] + f3 * a[k + 3, j]
            k += 4
        while k < i:
            f0 = a[i, k] * a[k, k]
            a[i, k] = f0
            for j in range(k + 1, n):
                a[i, j] -= f0 * a[k, j]
            k += 1
        if not abs(a[i, i]) > 1.0e-9:
            return 1
        a[i, i] = 1.0 / a[i, i]
    return 0


@numba.njit(error_model="numpy")
def factor_many(factor, source, a, n, times):
    """Copy and factorise ``times`` times."""
    for _ in range(times):
        a[:, :] = source
        factor(a, n)


def seconds(run: Callable[[], Any]) -> float:
    """Time of one call."""
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def compare(name: str, run: Callable[[Any], Any], old: Any, new: Any, times: int) -> None:
    """Print medians of interleaved calls."""
    before, after = [], []
    for _ in range(31):
        before.append(seconds(lambda: run(old)))
        after.append(seconds(lambda: run(new)))
    first, second = (1e6 * statistics.median(t[1:]) / times for t in (before, after))
    print(f"{name}: plain {first:.3f} µs, vectors {second:.3f} µs, ratio {first / second:.2f}")


def main() -> None:
    """Compare LU (with its copy)."""
    n, times = int(sys.argv[1]) if len(sys.argv) > 1 else 43, 500
    rng = np.random.default_rng(1)
    q = rng.normal(size=(n, n))
    matrix = q @ q.T / n + np.eye(n) + 0.3 * (q - q.T)
    a = np.empty((n, n))
    factor = linear_algebra.factor_rows.dispatcher
    print(f"n = {n}, processor {numba.config.CPU_NAME or 'host'}")
    compare("LU", lambda f: factor_many(f, matrix, a, n, times), scalar_factor, factor, times)
    one, two = matrix.copy(), matrix.copy()
    scalar_factor(one, n)
    factor(two, n)
    print(f"LU: largest difference {np.max(np.abs(one - two)) / np.max(np.abs(one)):.1e} of the largest entry")


if __name__ == "__main__":
    main()
