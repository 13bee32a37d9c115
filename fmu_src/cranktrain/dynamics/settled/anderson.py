"""Anderson's method: correction of all modes of a motion together, from the changes over the last cycles.

Let x_j be the starts of the last cycles and f_j their residuals, G(x_j) − x_j plus the slow modes' correction. The next
start is

    x + f − Σ γ_j (Δx_j + Δf_j),    γ the least squares of f ≈ Σ γ_j Δf_j

with differences Δ between one cycle and the next, measured by the energies in
:meth:`slow_modes.SlowModes.coordinates`. No multiplier has to be known, and the result is the same cycle as by plain
running.

Source: D. G. Anderson, Iterative procedures for nonlinear integral equations, J. ACM 12, 1965.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.settled.motion import Motion
from cranktrain.dynamics.settled.slow_modes import SlowModes

DISTINCT = 0.02
"""Relative singular value of normalised differences below which the differences count as linearly dependent."""


def anderson_step(modes: SlowModes, known: Sequence[tuple[Motion, Motion]]) -> Motion:
    """Motion −Σ γ_j (Δx_j + Δf_j) to add to x + f; ``known`` has start x_j and change f_j of each cycle."""
    missed = known[-1][1]
    total = missed.minus(missed)
    pairs = list(pairwise(known))
    if not pairs:
        return total
    starts, changes = ([later[k].minus(sooner[k]) for sooner, later in pairs] for k in range(2))

    def measure(motion: Motion) -> Array:
        return np.concatenate(modes.coordinates(motion))

    weights = shares([measure(change) for change in changes], measure(missed), DISTINCT)
    for weight, start, change in zip(weights, starts, changes, strict=True):
        total = total.plus(start.plus(change), -weight)
    return total


def shares(parts: Sequence[Array], whole: Array, distinct: float) -> Array:
    """Factors (k,) with which the sum of k ``parts`` (n,) is nearest to ``whole`` (n,).

    ``distinct`` is the relative singular value of normalised parts below which they count as linearly dependent.
    """
    columns = np.array(parts).T
    size = np.linalg.norm(columns, axis=0)
    size[size == 0.0] = 1.0
    return np.asarray(np.linalg.lstsq(columns / size, whole, rcond=distinct)[0] / size)
