"""Covariance of residuals, from noise and model bias that is correlated over speed.

The error of a lower-level model exceeds the noise and is similar at neighbouring speeds. Residuals of an order are
therefore taken as noise plus a random function of the speed Ω (Kennedy and O'Hagan 2001),

    C(Ω, Ω') = σ² 1(Ω = Ω') + δ² (s(Ω) s(Ω') + (S/10)²) (1 + ρ(|Ω − Ω'|/ℓ)),   ρ(d) = (1 + √3 d) exp(−√3 d),

with the model's own amplitude s of the order, its root mean square S over the speeds, the relative bias δ of the order,
a length ℓ, and the Matérn correlation ρ. Residuals are split into components in phase with the model's order and a
quarter period ahead; both have this covariance. The bias is relative because parameters absorb bias at a resonance,
so its size must follow from residuals away from the resonance, which an additive bias would explain completely. One
half of the bias varies over the speed. The other half is common to all speeds of an order, because more speeds do not
average out an error of the exciting torque.

Noise and length are common to a set. Each order has its own relative bias, because a small order that large orders
excite by the rods' inertia may be wrong by a third where the large ones are right to a per cent. The biases of a set
scatter about a common value by a factor of :data:`APART` if the likelihood distinguishes them, else by :data:`ALIKE`,
because a common parameter may absorb the bias of one order, which then seems correct next to wrong others. These
values maximise the restricted likelihood (Patterson and Thompson 1971), which accounts for the part of the bias that
the parameters have absorbed:

    −2 L = Σ log|C| + rᵀ C⁻¹ r − gᵀ A⁻¹ g + log|A| + Σ (ln δ_o/δ)²/ln²(APART),   A = Jᵀ C⁻¹ J + P,   g = Jᵀ C⁻¹ r.

Each set is fitted with its own parameters here, so a contradiction between sets is not hidden as bias.

Sources: M. C. Kennedy, A. O'Hagan, J. R. Statist. Soc. B 63 (2001) 425; C. E. Rasmussen, C. K. I. Williams, *Gaussian
Processes for Machine Learning* (2006); H. D. Patterson, R. Thompson, Biometrika 58 (1971) 545.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize
from scipy.stats import chi2

from cranktrain.core.types import Array

LEAST, MOST = 1e-4, 1.0
"""Bounds of the relative bias."""
LONGEST, LONGEST_ALONE = 3.0, 0.5
"""Limits of the bias length as a fraction of the speed range: for several orders, and for one order or an orbit.

A bias that varies more slowly than the speed range shows only part of its size. A tight limit of the length would
underestimate it. A single order cannot distinguish size and length, and an orbit is periodic, so their limit is low."""
LOW = 0.1
"""Amplitude-independent part of the bias, as a fraction of the bias at the RMS amplitude."""
APART = 3.0
"""Scatter factor of the relative biases of a set's orders (one standard deviation of their logarithms)."""
ALIKE, TOLD = 1.2, 0.01
"""Scatter factor if a likelihood-ratio test does not distinguish the biases of orders, and the test's level."""
_QUIET = 1e-5
"""Least noise of a set, as a fraction of the RMS of its amplitudes."""


class Bias(NamedTuple):
    """Covariance parameters of a data set: noise σ, relative bias δ, length ℓ in rad/s, and bias of each order."""

    noise: float
    relative: float
    length: float
    orders: tuple[float, ...] = ()

    def of(self, k: int) -> "Bias":
        """Return the covariance parameters of the ``k``-th order of the set."""
        return self._replace(relative=self.orders[k], orders=()) if self.orders else self


class Residue(NamedTuple):
    """Residuals of one measured order over speed.

    Attributes
    ----------
    speeds, sizes : (n,) rad/s, and the model's amplitudes s
    noise : (n,) known noise, or NaN
    residuals, slopes : residuals (n, c) of c components, and derivatives (n, c, p) of the model by the parameters
    """

    speeds: Array
    sizes: Array
    noise: Array
    residuals: Array
    slopes: Array


def covariance(speeds: Array, sizes: Array, noise: Array, bias: Bias) -> Array:
    """Return the covariance (n, n) of one component of an order at n speeds, for the order's ``bias``."""
    own = np.where(np.isfinite(noise), noise, bias.noise)
    return np.asarray(bias.relative**2 * _shape(sizes) * (1.0 + _alike(speeds, bias.length)[0]) + np.diag(own**2))


def _shape(sizes: Array) -> Array:
    """Return the covariance (n, n), at n speeds, of a relative bias of 1 that is fully correlated over the speed."""
    return np.asarray(np.outer(sizes, sizes) + LOW**2 * float(np.mean(sizes**2)))


def _alike(speeds: Array, length: float) -> tuple[Array, Array]:
    """Return the correlation ρ (n, n) of the bias between n speeds, and the derivative of ρ by ln ℓ."""
    apart = np.abs(speeds[:, None] - speeds) * (math.sqrt(3.0) / length)
    fall = np.exp(-apart)
    return (1.0 + apart) * fall, apart**2 * fall


def first_bias(parts: Sequence[Residue]) -> Bias:
    """Return the initial guess of the bias: a tenth of the amplitudes, with a tenth of the speed range as length."""
    span = max(float(np.ptp(one.speeds)) for one in parts)
    known = np.concatenate([one.noise[np.isfinite(one.noise)] for one in parts])
    noise = float(np.sqrt(np.mean(known**2))) if known.size else 0.02 * _rms(parts)
    return Bias(noise, 0.1, max(0.1 * span, 1e-3), len(parts) * (0.1,))


def noise_of_differences(parts: Sequence[Residue]) -> float:
    """Estimate noise by second differences over the speed, which a smooth bias hardly affects.

    Gasser, Sroka, Jennen-Steinmetz, Biometrika 73 (1986) 625.
    """
    squares, count = 0.0, 0
    for one in parts:
        x, r = one.speeds, one.residuals
        if x.size < 3:
            continue
        span = x[2:] - x[:-2]
        share = np.where(span > 0.0, (x[1:-1] - x[:-2]) / np.where(span > 0.0, span, 1.0), 0.5)[:, None]
        away = r[1:-1] - (1.0 - share) * r[:-2] - share * r[2:]
        squares += float(np.sum(away**2 / (1.0 + share**2 + (1.0 - share) ** 2)))
        count += away.size
    return math.sqrt(squares / count) if count else 0.0


def estimated_bias(parts: Sequence[Residue], prior: Array, before: Bias | None = None) -> Bias:
    """Estimate the covariance parameters of a set by the restricted likelihood.

    Parameters
    ----------
    parts : residuals of the set's orders
    prior : (p, p) information on the parameters that other sources give
    before : initial guess
    """
    rms, first = _rms(parts), before or first_bias(parts)
    span = max(float(np.ptp(one.speeds)) for one in parts)
    steps = [np.diff(np.unique(one.speeds)) for one in parts]
    step = min(float(np.median(one)) for one in steps if one.size) if any(one.size for one in steps) else span
    count = len(parts) + 1
    low = np.log([_QUIET * rms, max(step, 1e-6), *(count * [LEAST])])
    longest = LONGEST if len(parts) > 1 else LONGEST_ALONE
    high = np.log([rms, max(longest * span, 1.5 * step, 2e-6), *(count * [MOST])])
    noise = max(noise_of_differences(parts), _QUIET * rms)
    bounds = list(zip(low, high, strict=True))
    if all(np.isfinite(one.noise).all() for one in parts):
        noise, bounds[0] = first.noise, (math.log(first.noise), math.log(first.noise))
    # The first search starts from a small and a large bias. Later searches change little, so they have one start.
    starts = [
        np.clip(np.log([noise, first.length, *(count * [relative])]), low, high)
        for relative in ((first.relative, 0.02) if before is None else (max(first.relative, 0.02),))
    ]

    def likeliest(apart: float) -> tuple[Array, float]:
        """Return logarithms of the most likely covariance parameters for a scatter factor, and −2 × log-likelihood."""
        best, least = starts[0], math.inf
        for begin in starts:
            found = minimize(
                _unlikely, begin, (parts, prior, apart), method="L-BFGS-B", jac=True, bounds=bounds,
                options={"maxiter": 60, "ftol": 1e-7},
            )  # fmt: skip
            if found.fun < least:
                best, least = found.x, float(found.fun)
        return best, least

    best, least = likeliest(ALIKE if len(parts) > 1 else APART)
    if len(parts) > 1:
        other, likelier = likeliest(APART)
        if least - likelier > float(chi2.isf(TOLD, len(parts) - 1)):
            best = other
    noise, length, relative, *orders = np.exp(best).tolist()
    return Bias(noise, relative, length, tuple(orders))


def _unlikely(values: Array, parts: Sequence[Residue], prior: Array, far: float = APART) -> tuple[float, Array]:
    """Return minus twice the logarithm of the restricted likelihood, and its derivatives (m,).

    ``values`` (m,) are logarithms of noise, length, common relative bias, and relative bias of each order. With e = r −
    J A⁻¹ g, w = C⁻¹ e and Z = C⁻¹ J, the derivative by a parameter of C is Σ dC ∘ (C⁻¹ − w wᵀ − Z A⁻¹ Zᵀ), summed over
    the components.
    """
    noise, length = np.exp(values[:2]).tolist()
    scatter = math.log(far)
    apart = (values[3:] - values[2]) / scatter
    total = float(apart @ apart)
    slopes = np.zeros_like(values)
    slopes[3:] = 2.0 * apart / scatter
    slopes[2] = -slopes[3:].sum()
    slope, information, kept = np.zeros(prior.shape[0]), prior.copy(), []
    for one, relative in zip(parts, np.exp(values[3:]).tolist(), strict=True):
        alike, change = _alike(one.speeds, length)
        shape = relative**2 * _shape(one.sizes)
        known = np.isfinite(one.noise)
        matrix = shape * (1.0 + alike) + np.diag(np.where(known, one.noise, noise) ** 2)
        try:
            factor = cho_factor(matrix, lower=True)
        except np.linalg.LinAlgError:
            return 1e12, np.zeros_like(values)
        n, count, p = one.slopes.shape
        total += 2.0 * count * float(np.log(np.diag(factor[0])).sum())
        inverse = cho_solve(factor, np.eye(n))
        weighted = inverse @ one.residuals
        total += float(np.sum(one.residuals * weighted))
        by = (inverse @ one.slopes.reshape(n, -1)).reshape(n, count, p)
        flat = by.reshape(-1, p)
        slope += one.residuals.ravel() @ flat
        information += one.slopes.reshape(-1, p).T @ flat
        kept.append((inverse, weighted, by, shape, alike, change, known))
    sign, size = np.linalg.slogdet(information)
    if sign <= 0.0:
        return 1e12, np.zeros_like(values)
    spread = np.linalg.inv(information)
    moved = spread @ slope
    total += float(size) - float(slope @ moved)
    for k, (inverse, weighted, by, shape, alike, change, known) in enumerate(kept):
        left, flat = weighted - by @ moved, by.reshape(by.shape[0], -1)
        parted = by.shape[1] * inverse - left @ left.T - (by @ spread).reshape(flat.shape) @ flat.T
        slopes[0] += 2.0 * noise**2 * float(np.diag(parted)[~known].sum())
        slopes[1] += float(np.sum(parted * shape * change))
        slopes[3 + k] += 2.0 * float(np.sum(parted * shape * (1.0 + alike)))
    return total, slopes


def effective_count(matrix: Array) -> float:
    """Return the effective number of independent values of a covariance (n, n): (tr R)²/tr R² of its correlation R."""
    scale = np.sqrt(np.diag(matrix))
    alike = matrix / np.outer(scale, scale)
    return float(matrix.shape[0] ** 2 / np.sum(alike**2))


def _rms(parts: Sequence[Residue]) -> float:
    return math.sqrt(float(np.mean(np.concatenate([one.sizes for one in parts]) ** 2))) or 1.0
