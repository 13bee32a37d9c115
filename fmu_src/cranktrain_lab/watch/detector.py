"""Detector of changes of an engine's orders, and identification of the defect that explains a change.

A measured change r is the mean of m watched recordings minus that of n healthy ones, so common model errors cancel.
Each defect has a path of signatures Δ(s) over its severity, which are changes of the model's orders, linear between
computed severities. After whitening with the covariance C (1/m + 1/n) of r, the generalised likelihood ratio of a
defect is

    T = |r|² − min_s |r − Δ(s)|²

and the detector's statistic is the largest T of all paths. A second statistic, |r|², finds changes that no path
explains. Both are compared with random draws of r without a change. The variances of the draws follow the uncertainty
of the variances from healthy recordings, so the false-alarm rate is met with few recordings too. The alarm uses the
smaller of the two probabilities, compared with the same quantity of the draws, so the rate holds for both together.

To identify the defect, residuals of path i get the covariance C + E(Δ), because signatures have errors too, with

    E = δ² (|Δ_o|² + (R/5)²)/2   for each part of order o,   R the root mean square of |Δ_o| at the point,

δ being the model's relative error for the healthy engine. With equal prior probabilities, posterior probabilities are
proportional to the likelihood of the best severity.

Source: S. M. Kay, *Fundamentals of Statistical Signal Processing: Detection Theory* (1998), ch. 6.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.stats import chi2, norm

from cranktrain.core.types import Array
from cranktrain_lab.watch.scatter import Scatter, groups

DRAWS = 20_000
"""Number of random draws of recordings of an unchanged engine."""
LOW = 0.2
"""Amplitude-independent part of a signature's error, because rods couple orders that differ by two."""
LEFT = 1e-3
"""Least probability of the residual for which a defect explains a measured change."""
SHARE = 0.9
"""Detection rate of a defect for which the smallest detectable severity is reported."""


class Path(NamedTuple):
    """Signatures of a defect (changes of the orders) at increasing severity.

    Attributes
    ----------
    key : key of the defect
    severities : (k,) increasing from 0
    changes : (k, s, 2 o) changes of the orders, rad; the first is zero
    """

    key: str
    severities: Array
    changes: Array


class Finding(NamedTuple):
    """Result of testing whether one defect explains a measured change.

    Attributes
    ----------
    key : key of the defect
    statistic : generalised likelihood ratio T
    severity : best severity
    probability : probability of this defect if one of them is the cause
    left : probability that scatter and signature error give a residual as large as this defect's
    """

    key: str
    statistic: float
    severity: float
    probability: float
    left: float


@dataclass(frozen=True)
class Verdict:
    """Judgement of watched recordings: ``alarm`` if they have changed, and findings, the most likely first.

    ``probability`` is that of an equally large change without a cause.
    """

    alarm: bool
    probability: float
    findings: tuple[Finding, ...]

    @property
    def explained(self) -> bool:
        """True if scatter explains the residual that the most likely defect leaves."""
        return self.findings[0].left >= LEFT


class Detector:
    """Detector for one engine at given operating points.

    Parameters
    ----------
    paths : signatures of the defects
    healthy : (s, 2 o) mean of healthy recordings, rad
    scatter, directions : scatter of one recording, and directions (s, 2 o, 2 + c) of its effects
    counts : numbers of watched and of healthy recordings
    model_error : relative error of the model's signatures
    rate : rate of false alarms
    seed : seed of the draws
    """

    def __init__(
        self, paths: Sequence[Path], healthy: Array, scatter: Scatter, directions: Array, counts: tuple[int, int],
        model_error: float, rate: float, seed: int = 1,
    ) -> None:  # fmt: skip
        self.paths, self.rate, self._healthy, self._error = tuple(paths), rate, healthy, model_error
        self.scatter, self._directions = scatter, directions
        self._factor = 1.0 / counts[0] + 1.0 / counts[1]
        self._covariance = self._factor * scatter.covariance(directions)
        self._roots = np.linalg.cholesky(self._covariance)
        self._white = [self._whitened(path.changes) for path in self.paths]
        rows = self._drawn(np.random.default_rng(seed))
        largest, whole = self.ratios(rows).max(axis=1), np.sum(rows**2, axis=1)
        self._largest, self._whole = np.sort(largest), np.sort(whole)
        self._smaller = np.sort(np.minimum(_rarity(self._largest, largest), _rarity(self._whole, whole)))
        self.threshold = float(np.quantile(self._largest, 1.0 - rate))

    def _whitened(self, changes: Array) -> Array:
        """Whiten k changes of o complex orders at s speeds, (k, s, 2 o), to rows (k, s · 2 o)."""
        return np.stack(
            [solve_triangular(root, changes[:, j].T, lower=True).T for j, root in enumerate(self._roots)], axis=1
        ).reshape(changes.shape[0], -1)

    def _drawn(self, rng: np.random.Generator) -> Array:
        """Draw b whitened changes (b, N) of a healthy engine, with variances as uncertain as estimated variances."""
        scatter, (s, whole, count) = self.scatter, self._directions.shape
        degrees, half = scatter.noise_degrees, whole // 2
        noise = scatter.noise[:half] * (degrees / rng.chisquare(degrees, (DRAWS, half)))
        effects = scatter.effects * (scatter.degrees / rng.chisquare(scatter.degrees, (DRAWS, scatter.effects.size)))
        effects = effects[:, groups(count)]
        own = np.sqrt(np.concatenate((noise, noise), axis=1))[:, None] * rng.normal(size=(DRAWS, s, whole))
        moved = np.sqrt(effects)[:, None] * rng.normal(size=(DRAWS, s, count))
        rows = math.sqrt(self._factor) * (own + np.einsum("swa,bsa->bsw", self._directions, moved))
        return self._whitened(rows)

    def ratios(self, rows: Array) -> Array:
        """Return generalised likelihood ratios (b, paths) of b whitened changes (b, N) for each defect's path."""
        return np.stack([_along(white, rows)[0] for white in self._white], axis=1)

    def judge(self, watched: Array) -> Verdict:
        """Return the verdict on the mean orders of watched recordings, rad, (s, 2 o) for s speeds and o orders."""
        change = (watched - self._healthy)[None]
        row = self._whitened(change)
        statistics, places = zip(*(_along(white, row) for white in self._white), strict=True)
        largest, whole = max(float(one[0]) for one in statistics), float(np.sum(row**2))
        rare = min(float(_rarity(self._largest, largest)), float(_rarity(self._whole, whole)))
        probability = float(np.searchsorted(self._smaller, rare, side="right")) / self._smaller.size
        scores, left, severities = [], [], []
        for path, place in zip(self.paths, places, strict=True):
            at = float(place[0])
            severities.append(float(np.interp(at, np.arange(path.severities.size), path.severities)))
            score, rest = self._score(change[0], _at(path.changes, at))
            scores.append(score)
            left.append(rest)
        weights = np.exp(np.array(scores) - max(scores))
        findings = [
            Finding(path.key, float(statistics[k][0]), severities[k], float(weights[k] / weights.sum()), left[k])
            for k, path in enumerate(self.paths)
        ]
        order = sorted(findings, key=lambda one: (-one.probability, -one.statistic))
        return Verdict(probability <= self.rate, probability, tuple(order))

    def _score(self, change: Array, signature: Array) -> tuple[float, float]:
        """Return log-likelihood of a change's residual after a signature, and probability of so large a residual."""
        root = self._wider(signature)
        left = np.linalg.solve(root, (change - signature)[:, :, None])[..., 0]
        square = float(np.sum(left**2))
        score = -0.5 * square - float(np.sum(np.log(np.diagonal(root, axis1=1, axis2=2))))
        return score, float(chi2.sf(square, left.size))

    def _wider(self, signature: Array) -> Array:
        """Return Cholesky factors (s, 2 o, 2 o) of the covariance including the error of a signature (s, 2 o)."""
        half = signature.shape[1] // 2
        size = signature[:, :half] ** 2 + signature[:, half:] ** 2
        error = 0.5 * self._error**2 * (size + LOW**2 * size.mean(axis=1, keepdims=True))
        whole = self._covariance + np.concatenate((error, error), axis=1)[:, :, None] * np.eye(2 * half)
        return np.asarray(np.linalg.cholesky(whole))

    def smallest(self, k: int) -> float:
        """Return the smallest severity of defect path ``k`` that is detected at the rate ``SHARE``, or NaN."""
        path, white = self.paths[k], self._white[k]
        need = math.sqrt(self.threshold) + float(norm.ppf(SHARE))
        sizes = np.linalg.norm(white, axis=1)
        for i in range(1, sizes.size):
            if sizes[i] >= need:
                share = (need - sizes[i - 1]) / (sizes[i] - sizes[i - 1])
                return float(path.severities[i - 1] + share * (path.severities[i] - path.severities[i - 1]))
        return math.nan

    def apart(self, k: int, severity: float) -> list[tuple[str, float]]:
        """Return, for each other defect's path, the probability that path ``k`` at a severity is mistaken for it.

        If the nearest points of two signatures are d standard deviations apart, the measured change is nearer to the
        wrong signature with probability Φ(−d/2).
        """
        path = self.paths[k]
        own = _at(path.changes, float(np.interp(severity, path.severities, np.arange(path.severities.size))))
        root, row, found = self._wider(own), self._whitened(own[None]), []
        for i, other in enumerate(self.paths):
            if i != k:
                _, place = _along(self._white[i], row)
                away = own - _at(other.changes, float(place[0]))
                distance = float(np.linalg.norm(np.linalg.solve(root, away[:, :, None])))
                found.append((other.key, float(norm.cdf(-0.5 * distance))))
        return sorted(found, key=lambda one: -one[1])


def _at(changes: Array, place: float) -> Array:
    """Interpolate a path's ``changes`` (k, …) at a position between 0 and k − 1."""
    first = min(int(place), changes.shape[0] - 2)
    return np.asarray(changes[first] + (place - first) * (changes[first + 1] - changes[first]))


def _along(white: Array, rows: Array) -> tuple[Array, Array]:
    """Return likelihood ratios (b,) of a whitened path (k, N) for ``rows`` (b, N), and positions (b,) of the best."""
    best, place = np.zeros(rows.shape[0]), np.zeros(rows.shape[0])
    squares = np.sum(white**2, axis=1)
    products = rows @ white.T
    for i in range(white.shape[0] - 1):
        # |r|² − |r − a − t d|² = 2 r·a − |a|² + 2 t (r·d − a·d) − t² |d|²
        along = squares[i + 1] - 2.0 * float(white[i] @ white[i + 1]) + squares[i]
        across = products[:, i + 1] - products[:, i] - float(white[i] @ white[i + 1]) + squares[i]
        t = np.clip(across / along if along > 0.0 else np.zeros_like(across), 0.0, 1.0)
        found = 2.0 * products[:, i] - squares[i] + 2.0 * t * across - t**2 * along
        better = found > best
        best, place = np.where(better, found, best), np.where(better, i + t, place)
    return best, place


def _rarity(drawn: Array, values: Array | float) -> Array:
    """Return the fraction of sorted draws (b,) that are at least as large as ``values``."""
    return 1.0 - np.searchsorted(drawn, values, side="left") / drawn.size
