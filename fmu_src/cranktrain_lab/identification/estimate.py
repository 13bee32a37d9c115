"""Estimation of the sought parameters: alternately search the parameters and estimate the residuals' covariance."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cranktrain.core.types import Array
from cranktrain_lab.calibration.search import smooth_search
from cranktrain_lab.identification.comparison import Comparison, Piece

POINTS, STARTS = 16, 2
"""Number of Sobol points per parameter (up to 128), and number of the best of them that start least squares."""
ROUNDS = 4
"""Largest number of estimates of the residuals' covariance."""
SAME = 0.05
"""Change of the parameters, in standard deviations, at which the estimate has converged."""


@dataclass(frozen=True)
class Estimate:
    """Estimate of the sought parameters.

    Attributes
    ----------
    inner : (p,) coordinates u
    pieces : residuals and derivatives at u, minus the constants of wheels
    information : information (p, p) of the data, without priors
    evaluations : number of evaluations of the model
    interrupted : True if the search was ended early
    """

    inner: Array
    pieces: list[Piece]
    information: Array
    evaluations: int
    interrupted: bool


def estimate(
    comparison: Comparison, seed: int = 1, follow: Callable[[float, float], None] = lambda share, cost: None,
    start: Array | None = None,
) -> Estimate:  # fmt: skip
    """Estimate the parameters of a comparison; the covariance of its residuals is stored in the comparison.

    Parameters
    ----------
    seed : seed of the starts
    start : (p,) u of an earlier estimate, as the only start of the search
    """
    inner, evaluations, interrupted = comparison.start if start is None else start, 0, False
    if not comparison.biases:
        measured = [one.values for one in comparison.data.strands]
        comparison.weigh(comparison.first_biases(measured), measured)
    points = 0 if start is not None else min(128, 2 ** int(np.ceil(np.log2(POINTS * inner.size))))
    for turn in range(ROUNDS):
        found = smooth_search(
            comparison, inner, seed, points if turn == 0 else 0, STARTS, rounds=25 if turn == 0 else 10, follow=follow
        )
        evaluations += found.evaluations
        before, inner = inner, found.free
        pieces = comparison.pieces(inner)
        evaluations += 2 * inner.size + 1
        interrupted = found.interrupted
        own = comparison.own(inner)
        comparison.weigh(comparison.found_biases(pieces, own), own)
        information = information_of(comparison, pieces)
        spread = np.sqrt(np.diag(np.linalg.inv(information + comparison.known)))
        if interrupted or (turn > 0 and np.all(np.abs(inner - before) < SAME * spread)):
            break
    return Estimate(inner, comparison.cleared(pieces), information, evaluations, interrupted)


def information_of(comparison: Comparison, pieces: list[Piece], name: str | None = None) -> Array:
    """Return the information Jᵀ C⁻¹ J (p, p) on p parameters of all data sets, or of one data set by name."""
    slopes = comparison.whitened([one.slopes for one in pieces])
    chosen = [s for s, one in zip(slopes, pieces, strict=True) if name is None or one.name == name]
    whole = np.concatenate(chosen)
    return np.asarray(whole.T @ whole)
