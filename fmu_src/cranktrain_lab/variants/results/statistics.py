"""Statistics of variants: Sobol indices, rank regression, Pareto fronts.

With f_A, f_B the outputs at the rows of Saltelli's matrices A and B, and f_k at those of A with column k of B,

    first-order index   S_k = ⟨f_B (f_k − f_A)⟩ / V,        the fraction of the variance V that value k explains alone
    total index         T_k = ½ ⟨(f_A − f_k)²⟩ / V,         the fraction that remains if all values but k are known

Means are subtracted before. Rows with a failed variant are left out. Intervals follow from resampled rows.

Sources: A. Saltelli et al., Computer Physics Communications 181 (2010), equations (b) and (f) of table 2; M. J. W.
Jansen, Computer Physics Communications 117 (1999); for ranks A. Saltelli et al., Sensitivity
Analysis (2000), section 2.3.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from cranktrain.core.types import Array

RESAMPLES = 200


class Indices(NamedTuple):
    """Sobol indices (d,) of an output, half-widths of their 95 % intervals, and number of rows used."""

    first: Array
    total: Array
    first_error: Array
    total_error: Array
    rows: int


def sobol_indices(values: Array, n: int, d: int) -> Indices:
    """Return Sobol indices of outputs (n (d + 2),) of a design ``sensitivity``; NaN if the output does not vary."""
    a, b, mixed = values[:n], values[n : 2 * n], values[2 * n :].reshape(d, n)
    good = np.isfinite(a) & np.isfinite(b) & np.isfinite(mixed).all(axis=0)
    a, b, mixed = a[good], b[good], mixed[:, good]
    if a.size < 2:
        nothing = np.full(d, np.nan)
        return Indices(nothing, nothing, nothing, nothing, int(a.size))
    first, total = _estimate(a, b, mixed)
    rng = np.random.default_rng(0)
    again = np.array([_estimate(a[p], b[p], mixed[:, p]) for p in
                      (rng.integers(0, a.size, a.size) for _ in range(RESAMPLES))])  # fmt: skip
    errors = 1.96 * again.std(axis=0)
    return Indices(first, total, errors[0], errors[1], int(a.size))


def _estimate(a: Array, b: Array, mixed: Array) -> tuple[Array, Array]:
    mean = 0.5 * (a.mean() + b.mean())
    a, b, mixed = a - mean, b - mean, mixed - mean
    variance = np.concatenate((a, b)).var()
    if not variance > 0.0:
        return np.full(len(mixed), np.nan), np.full(len(mixed), np.nan)
    return np.mean(b * (mixed - a), axis=1) / variance, 0.5 * np.mean((a - mixed) ** 2, axis=1) / variance


def rank_coefficients(values: Array, outputs: Array) -> Array:
    """Return standardised rank regression coefficients (d,), −1 … 1, of values (n, d) for an output (n,).

    Ranks of the output are fitted by the ranks of all values together, so a chance correlation of two values counts for
    neither. The result is 0 if a value or the output does not vary, and NaN for fewer than d + 2 variants.
    """
    good = np.isfinite(outputs)
    if good.sum() < values.shape[1] + 2:
        return np.full(values.shape[1], np.nan)
    ranks = np.stack([_standard(rankdata(column)) for column in values[good].T], axis=1)
    return np.asarray(np.linalg.lstsq(ranks, _standard(rankdata(outputs[good])), rcond=None)[0])


def _standard(ranks: Array) -> Array:
    centred = ranks - ranks.mean()
    size = float(np.sqrt((centred**2).sum()))
    return np.asarray(centred / size if size > 0.0 else centred)


def pareto_front(costs: Array) -> NDArray[Any]:
    """Return indices of non-dominated rows of ``costs`` (n, m), ordered by the first cost, without non-finite rows.

    A row is dominated by another that is no worse in all costs and better in one; of equal rows the first stays.
    """
    finite = np.flatnonzero(np.isfinite(costs).all(axis=1))
    order = finite[np.lexsort((finite, *costs[finite].T[::-1]))]
    front: list[int] = []
    kept = np.zeros((0, costs.shape[1]))
    for k in order.tolist():
        # Earlier rows are no worse in the first cost, so a row is dominated by a row of the front or joins the front.
        if not np.any(np.all(kept <= costs[k], axis=1)):
            front.append(k)
            kept = np.vstack((kept, costs[k]))
    return np.array(front, dtype=np.intp)
