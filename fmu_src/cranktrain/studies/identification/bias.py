"""Covariance of residuals: noise, and model bias that is correlated over speed.

A model of a lower level errs by more than the noise, and its errors at neighbouring speeds are alike. Residuals of an
order are therefore taken as noise and a random function of the speed Ω (Kennedy and O'Hagan 2001),

    C(Ω, Ω') = σ² 1(Ω = Ω') + δ² (s(Ω) s(Ω') + (S/10)²) (1 + ρ(|Ω − Ω'|/ℓ)),   ρ(d) = (1 + √3 d) exp(−√3 d),

with the model's own amplitude s, their root mean square S, the relative bias δ, a length ℓ, and ρ of Matérn. A relative
bias turns with the phase of the model's order, so residuals are taken in phase with it and a quarter ahead; both have
this covariance. The bias is relative because at a resonance, where parameters take it up, it can only be judged by what
is left beside the resonance; an additive bias of its own size would explain that away. As much of it as changes over
the speed is common to all speeds of an order: no number of speeds averages a wrong torque away.

The numbers of a set follow from the restricted likelihood (Patterson and
Thompson, Biometrika 58, 1971), which accounts for the part of the bias that the parameters have taken up:

    −2 L = Σ log|C| + rᵀ C⁻¹ r − gᵀ A⁻¹ g + log|A|,     A = Jᵀ C⁻¹ J + P,   g = Jᵀ C⁻¹ r.

Each set has its own parameters in this, so that sets that contradict each other do not hide it as bias.

Sources: M. C. Kennedy, A. O'Hagan, J. R. Statist. Soc. B 63 (2001) 425; C. E. Rasmussen, C. K. I. Williams, *Gaussian
Processes for Machine Learning* (2006).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from cranktrain.core.types import Array

LEAST, MOST = 1e-4, 1.0
"""Bounds of the relative bias."""
LOW = 0.1
"""Part of the bias that does not fall with the amplitude, over that at the root mean square of amplitudes."""
_QUIET = 1e-5
"""Least noise of a set, over the root mean square of its amplitudes."""


class Bias(NamedTuple):
    """Numbers of a set: noise σ in its unit, relative bias δ, length ℓ in rad/s, root mean square S of amplitudes."""

    noise: float
    relative: float
    length: float
    size: float


class Residue(NamedTuple):
    """Residuals of one order.

    Attributes
    ----------
    speeds, sizes : (n,) rad/s, and the model's amplitudes s
    noise : (n,) known noise, or not a number
    residuals, slopes : (n, c) of its c components, and derivatives (n, c, p) of the model by the parameters
    """

    speeds: Array
    sizes: Array
    noise: Array
    residuals: Array
    slopes: Array


def covariance(speeds: Array, sizes: Array, noise: Array, bias: Bias) -> Array:
    """Covariance (n, n) of one component of an order."""
    apart = np.abs(speeds[:, None] - speeds) * (math.sqrt(3.0) / bias.length)
    alike = (1.0 + apart) * np.exp(-apart)
    own = np.where(np.isfinite(noise), noise, bias.noise)
    size = bias.relative**2 * (np.outer(sizes, sizes) + (LOW * bias.size) ** 2)
    return np.asarray(size * (1.0 + alike) + np.diag(own**2))


def first_bias(parts: Sequence[Residue], relative: float = 0.1) -> Bias:
    """Bias from which a search starts: a fraction of the amplitudes, over a tenth of the speeds."""
    rms = _rms(parts)
    span = max(float(np.ptp(one.speeds)) for one in parts)
    known = np.concatenate([one.noise[np.isfinite(one.noise)] for one in parts])
    noise = float(np.sqrt(np.mean(known**2))) if known.size else 0.02 * rms
    return Bias(noise, relative, max(0.1 * span, 1e-3), rms)


def noise_of_differences(parts: Sequence[Residue]) -> float:
    """Noise by second differences over the speed, to which a smooth bias adds little.

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
    """Numbers of a set by the restricted likelihood.

    Parameters
    ----------
    parts : its orders
    prior : (p, p) information on the parameters that other sources give
    before : numbers from which the search starts
    """
    rms, first = _rms(parts), before or first_bias(parts)
    span = max(float(np.ptp(one.speeds)) for one in parts)
    steps = [np.diff(np.unique(one.speeds)) for one in parts]
    step = min(float(np.median(one)) for one in steps if one.size) if any(one.size for one in steps) else span
    known = all(np.isfinite(one.noise).all() for one in parts)
    low = np.log([_QUIET * rms, LEAST, max(step, 1e-6)])
    high = np.log([rms, MOST, max(0.5 * span, 1.5 * step, 2e-6)])
    start = np.clip(np.log([max(noise_of_differences(parts), _QUIET * rms), first.relative, first.length]), low, high)

    free = np.array([not known, True, True])

    def whole(values: Array) -> Array:
        found = start.copy()
        found[free] = values
        return found

    def cost(values: Array) -> float:
        return _unlikely(parts, prior, _bias(whole(values), rms))

    best, least = start, cost(start[free])
    # Once found, the numbers hardly change; the first time a small bias and a large one are tried.
    for relative in (first.relative, 0.02) if before is None else (max(first.relative, 0.02),):
        begin = start.copy()
        begin[1] = np.clip(math.log(relative), low[1], high[1])
        bounds = list(zip(low[free], high[free], strict=True))
        found = minimize(
            cost, begin[free], method="L-BFGS-B", bounds=bounds, options={"maxiter": 25, "eps": 1e-3, "ftol": 1e-6}
        )
        if found.fun < least:
            best, least = np.clip(whole(found.x), low, high), float(found.fun)
    return _bias(best, rms)


def _bias(values: Array, rms: float) -> Bias:
    """The bias of logarithms (3,) of noise, relative bias and length."""
    noise, relative, length = np.exp(values).tolist()
    return Bias(noise, relative, length, rms)


def _unlikely(parts: Sequence[Residue], prior: Array, bias: Bias) -> float:
    """Minus twice the logarithm of the restricted likelihood."""
    total, slope, information = 0.0, np.zeros(prior.shape[0]), prior.copy()
    for one in parts:
        try:
            factor = cho_factor(covariance(one.speeds, one.sizes, one.noise, bias), lower=True)
        except np.linalg.LinAlgError:
            return 1e12
        count = one.residuals.shape[1]
        total += 2.0 * count * float(np.log(np.diag(factor[0])).sum())
        weighted = cho_solve(factor, one.residuals)
        total += float(np.sum(one.residuals * weighted))
        n, _, p = one.slopes.shape
        by = cho_solve(factor, one.slopes.reshape(n, -1)).reshape(n, count, p)
        slope += np.einsum("ncp,nc->p", by, one.residuals)
        information += np.einsum("ncp,ncq->pq", one.slopes, by)
    sign, size = np.linalg.slogdet(information)
    if sign <= 0.0:
        return 1e12
    return total - float(slope @ np.linalg.solve(information, slope)) + float(size)


def effective_count(matrix: Array) -> float:
    """Number of independent values that a covariance (n, n) has: (tr R)²/tr R² of its correlation R."""
    scale = np.sqrt(np.diag(matrix))
    alike = matrix / np.outer(scale, scale)
    return float(matrix.shape[0] ** 2 / np.sum(alike**2))


def _rms(parts: Sequence[Residue]) -> float:
    return math.sqrt(float(np.mean(np.concatenate([one.sizes for one in parts]) ** 2))) or 1.0
