"""Scatter of healthy recordings, by noise of each order and by varying load, encoder zero and cylinders' burn.

At each operating point the orders of a recording, as real vectors y of real and imaginary parts, are

    y = μ + λ g + φ z + Σ_k β_k h_k + e,   λ ~ N(0, σ_λ²),  φ ~ N(0, σ_φ²),  β_k ~ N(0, σ_β²),  e ~ N(0, D),

g being the model's derivative by the load, z = i n y that of an encoder's zero, h_k that by the burn of cylinder k, and
D diagonal with one variance for each order, common to all points. The variances follow from the recordings minus their
means by expectation maximisation (Dempster, Laird and Rubin, J. R. Statist. Soc. B 39, 1977). μ is free, because it
contains all model errors.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.types import Array

ROUNDS = 200
"""Number of iterations of expectation maximisation."""
LEAST = 1e-9
"""Least noise, as a fraction of the RMS of the orders."""


class Scatter(NamedTuple):
    """Variances of one recording about the healthy mean.

    Attributes
    ----------
    noise : (2 o,) variance of real and imaginary part of each order, rad²
    effects : (3,) variances of load, of encoder zero (rad²), and of a cylinder's burn
    degrees : (3,) degrees of freedom of the effects, and those of an order's noise
    """

    noise: Array
    effects: Array
    degrees: Array
    noise_degrees: float

    def covariance(self, directions: Array) -> Array:
        """Return a recording's covariance (s, 2 o, 2 o) at s speeds; ``directions``: changes by load, zero, burn."""
        own = self.effects[groups(directions.shape[2])]
        return np.asarray(np.diag(self.noise) + (directions * own) @ directions.transpose(0, 2, 1))


def groups(count: int) -> NDArray[np.intp]:
    """Return the index of each direction's variance: load, encoder zero, then one variance for all cylinders."""
    return np.minimum(np.arange(count), 2)


def real_rows(orders: NDArray[np.complex128]) -> Array:
    """Convert complex orders (…, o) to real and imaginary parts (…, 2 o)."""
    return np.asarray(np.concatenate((orders.real, orders.imag), axis=-1))


def scatter_of(healthy: Array, directions: Array) -> Scatter:
    """Estimate the scatter of n > 1 healthy recordings of o orders at s speeds, (n, s, 2 o)."""
    n, s, whole = healthy.shape
    away = (healthy - healthy.mean(axis=0)) * np.sqrt(n / (n - 1.0))
    least = (LEAST * float(np.sqrt(np.mean(healthy**2)))) ** 2
    half = whole // 2
    noise = _pooled(np.mean(away**2, axis=(0, 1)), half, least)
    count = directions.shape[2]
    of, each = groups(count), np.bincount(groups(count))
    sizes = np.mean(np.sum(directions**2, axis=1), axis=0)
    effects = np.bincount(of, 0.5 * np.sum(noise) / np.where(sizes > 0.0, sizes, 1.0)) / each / count
    for _ in range(ROUNDS):
        weighted = directions / noise[:, None]
        information = directions.transpose(0, 2, 1) @ weighted
        spread = np.linalg.inv(information + np.diag(1.0 / np.maximum(effects[of], 1e-300)))
        found = np.einsum("sab,swb,nsw->nsa", spread, weighted, away)
        squares = np.mean(found**2, axis=(0, 1)) + np.mean(np.diagonal(spread, axis1=1, axis2=2), axis=0)
        effects = np.bincount(of, squares) / each
        left = away - np.einsum("swa,nsa->nsw", directions, found)
        known = np.mean(np.einsum("swa,sab,swb->sw", directions, spread, directions), axis=0)
        noise = _pooled(np.mean(left**2, axis=(0, 1)) + known, half, least)
    free = (n - 1.0) * s
    taken = min(count / whole, 0.5)
    return Scatter(noise, effects, free * each, max(2.0 * free * (1.0 - taken), 1.0))


def _pooled(variances: Array, half: int, least: float) -> Array:
    """Average the variances of real and imaginary part of each order, at least ``least``."""
    both = np.maximum(0.5 * (variances[:half] + variances[half:]), least)
    return np.concatenate((both, both))
