"""Confidence of identified parameters: covariance, profiles, bootstrap, and combinations that data do not determine.

With the information A = Jᵀ C⁻¹ J of the data and P of prior knowledge (priors, and bounds as uniform distributions),
the covariance of u is

    S = (A + P)⁻¹ + Σ d dᵀ,

d being the change of u by each level above the fitted one, compared with the level below it
(:mod:`cranktrain_lab.identification.ladder`). Intervals use Student's t; the degrees of freedom are the number of
independent residuals minus the number of parameters. A profile fixes one parameter, fits all others and ends where the
sum of squares has risen by t². The bootstrap resamples residuals in blocks of neighbouring speeds, or among repeated
runs of a speed, draws from the priors, and maps each draw to u by the linear estimate.

Sources: G. A. F. Seber, C. J. Wild, *Nonlinear Regression* (1989), ch. 5; H. R. Künsch, Ann. Statist. 17 (1989) 1217,
blocks.

With the sensitivities J = ∂ ln f/∂ ln p of a calibration's report, tolerances τ of its targets as standard deviations
and bounds as a uniform prior, its free values have

    A = Jᵀ diag(1/τ²) J,     S = (A + diag(12/ln²(high/low)))⁻¹.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import chi2, t

from cranktrain.core.types import Array, Integers
from cranktrain_lab.identification.bias import effective_count
from cranktrain_lab.identification.comparison import Comparison, Piece
from cranktrain_lab.identification.estimate import Estimate, information_of
from cranktrain_lab.identification.ladder import linear_move

LEVEL = 0.95
"""Probability of all confidence intervals."""
WEAK = 0.3
"""Relative deviation above which a combination of parameters counts as not determined by the data."""
PART = 0.3
"""Component of a combination (of unit length) above which its parameter is listed."""
ENTANGLED = 3.0
"""Ratio of a parameter's deviation to the deviation with all other parameters known, for a correlated parameter."""
UNLIKELY = 1e-4
"""Probability below which two data sets count as contradicting each other."""
FEWEST = 3.0
"""Least number of degrees of freedom of a confidence interval."""
_STEPS = 5


@dataclass(frozen=True)
class Confidence:
    """Confidence of an estimate: covariance (p, p) of the parameters' coordinates u, and degrees of freedom."""

    covariance: Array
    freedom: float

    @property
    def reach(self) -> float:
        """Half width of a confidence interval in standard deviations."""
        return float(t.ppf(0.5 + 0.5 * LEVEL, self.freedom))

    @property
    def deviations(self) -> Array:
        """Standard deviations (p,) of the p parameters' coordinates u."""
        return np.sqrt(np.diag(self.covariance))


class Direction(NamedTuple):
    """Combination of p parameters: relative deviation by the data alone, and components (p,) of unit length."""

    deviation: float
    parts: Array


class Contradiction(NamedTuple):
    """Result of the test whether two data sets contradict each other.

    ``distance`` is the squared distance of their estimates (chi-square with ``freedom`` degrees and ``probability``).
    ``parameter`` is the index of the parameter on which they differ most, ``wants`` its u by each set.
    """

    first: str
    second: str
    distance: float
    freedom: int
    probability: float
    parameter: int
    wants: tuple[float, float]


def confidence_of(comparison: Comparison, found: Estimate, moves: Array) -> Confidence:
    """Return the confidence of an estimate, widened by the ``moves`` (n, p) of u that higher levels would cause."""
    own = np.linalg.inv(found.information + comparison.known)
    count = float(len(comparison.data.scalars) + sum(one.values.size for one in comparison.data.shapes))
    sizes = [np.abs(own) for own in comparison.own(found.inner)]
    for k, one in enumerate(comparison.data.strands):
        keep = np.flatnonzero(~one.held)
        count += effective_count(comparison.covariance_of(k, sizes[k])[np.ix_(keep, keep)]) * (2 if one.phases else 1)
    free = count - comparison.constants - found.inner.size + int((np.diag(comparison.prior) > 0.0).sum())
    # Deviations of numbers and shapes are given and not estimated from residuals, so they have no degrees of freedom.
    freedom = max(free, FEWEST) if comparison.data.strands else 1e6
    return Confidence(own + moves.T @ moves, freedom)


def directions(information: Array) -> list[Direction]:
    """Return eigenvectors of ``information`` (p, p) as combinations of parameters, the least determined first."""
    values, vectors = np.linalg.eigh(information)
    least = 1e-12 * max(float(values[-1]), 1e-300)
    return [
        Direction(1.0 / math.sqrt(value) if value > least else math.inf, vector)
        for value, vector in zip(values.tolist(), vectors.T, strict=True)
    ]


def unexcited(comparison: Comparison, found: Estimate) -> list[int]:
    """Return parameters that change the data by less than a standard deviation over the range of their bounds."""
    moved = np.sqrt(np.diag(found.information)) * (comparison.high - comparison.low)
    return [int(k) for k in np.flatnonzero(moved < 1.0)]


def told_apart(information: Array, known: Array, keys: Sequence[str]) -> list[str]:
    """Describe the parameters (p,) and combinations that the data do not determine.

    Parameters
    ----------
    information, known : information (p, p) in u of the data, and of priors and bounds
    keys : keys of the parameters
    """
    weak = [one for one in directions(information) if one.deviation >= WEAK]
    if not weak:
        return []
    # Several undetermined directions span a space in which every combination is undetermined.
    share = np.sqrt(np.sum([one.parts**2 for one in weak], axis=0))
    alone = np.sqrt(np.diag(np.linalg.inv(information + known)) * np.diag(information))
    named = [int(k) for k in np.argsort(-share, kind="stable") if share[k] >= PART or alone[k] >= ENTANGLED]
    least = min(one.deviation for one in weak)
    far = f"{100.0 * least:.0f} %" if least < 10.0 else "any factor"
    if len(named) <= len(weak):
        return [f"{keys[k]} is not determined: known to {far} from the data alone" for k in named]
    listed = f"{', '.join(keys[k] for k in named[:-1])} and {keys[named[-1]]}"
    # Describe the count combinations of some parameters that the data determine best.
    count = len(named) - len(weak)
    values, vectors = np.linalg.eigh(information[np.ix_(named, named)])
    texts = []
    for value, parts in list(zip(values.tolist(), vectors.T, strict=True))[: -count - 1 : -1]:
        parts = parts / parts[np.argmax(np.abs(parts))]
        text = " · ".join(f"{keys[k]}^{part:.2g}" for k, part in zip(named, parts, strict=True) if abs(part) > 0.05)
        texts.append(f"{text}, to {100.0 / math.sqrt(max(value, 1e-300)):.2g} %")
    better = "; ".join(texts)
    return [f"{listed} cannot be told apart: changed together they keep the data up to {far}; known is {better}"]


def profiles(comparison: Comparison, found: Estimate, confidence: Confidence) -> list[tuple[float, float]]:
    """Return each parameter's profile interval in u, widened like the covariance and clipped to the bounds."""
    slopes = np.concatenate(comparison.whitened([piece.slopes for piece in found.pieces]))
    weak = np.sqrt(np.diag(comparison.prior))
    jacobian = np.vstack((-slopes, np.diag(weak)[weak > 0.0]))
    least = float(np.sum(comparison.residuals(found.inner) ** 2))
    own = np.sqrt(np.diag(np.linalg.inv(found.information + comparison.known)))
    wide = confidence.deviations / own
    rise = confidence.reach**2
    result = []
    for k in range(found.inner.size):
        ends = []
        for side in (-1.0, 1.0):
            far = _end(comparison, found.inner, jacobian, (k, side * own[k] * confidence.reach), least, rise)
            far = found.inner[k] + (far - found.inner[k]) * max(1.0, wide[k])
            ends.append(float(np.clip(far, comparison.low[k], comparison.high[k])))
        result.append((ends[0], ends[1]))
    return result


def _end(
    comparison: Comparison, inner: Array, jacobian: Array, ahead: tuple[int, float], least: float, rise: float
) -> float:  # fmt: skip
    """Return the coordinate u of parameter ``ahead[0]`` at which the sum of squares has risen by ``rise``."""
    k, step = ahead
    others = np.delete(np.arange(inner.size), k)
    by = jacobian[:, others]
    # Information from the bounds keeps parameters in place that the data do not determine.
    factor = np.linalg.solve(by.T @ by + comparison.known[np.ix_(others, others)], by.T)
    along = -factor @ jacobian[:, k]  # change of the other parameters per change of parameter k
    share = 1.0
    bound = comparison.high[k] if step > 0.0 else comparison.low[k]
    for _ in range(_STEPS):
        point = inner.copy()
        point[k] += share * step
        if (point[k] - bound) * np.sign(step) >= 0.0:
            point[k] = bound
        point[others] = np.clip(
            inner[others] + along * (point[k] - inner[k]), comparison.low[others], comparison.high[others]
        )
        rows = comparison.residuals(point)
        if others.size:
            point[others] = np.clip(point[others] - factor @ rows, comparison.low[others], comparison.high[others])
            rows = comparison.residuals(point)
        risen = max(float(rows @ rows) - least, 1e-12)
        ratio = math.sqrt(rise / risen)
        if abs(ratio - 1.0) < 0.03 or (point[k] == bound and ratio > 1.0):
            return float(point[k])
        share = (point[k] - inner[k]) / step * min(max(ratio, 0.3), 3.0)
    return float(inner[k] + share * step)


def bootstrap(comparison: Comparison, found: Estimate, draws: int, seed: int) -> Array:
    """Return bootstrap draws (b, p) of u, with residuals resampled in blocks of speeds or among runs of one speed.

    The prior of each parameter is drawn too, as one more measurement. Draws of the data alone would scatter less than
    the covariance if a prior has an influence.
    """
    rng, before = np.random.default_rng(seed), np.random.default_rng([seed, 1])
    known = np.sqrt(np.diag(comparison.known))
    spread = np.linalg.inv(found.information + comparison.known)
    result = np.zeros((draws, found.inner.size))
    blocks = [_block(comparison, piece, k) for k, piece in enumerate(found.pieces)]
    scale = math.sqrt(comparison.count / max(comparison.count - comparison.constants - found.inner.size, 1))
    for b in range(draws):
        drawn = []
        for k, piece in enumerate(found.pieces):
            rows = piece.rows.copy()
            if k < len(comparison.data.strands):
                keep = np.flatnonzero(~piece.held)
                rows[keep] = scale * rows[keep[_drawn(comparison, k, keep, blocks[k], rng)]]
            else:
                own = comparison.data.deviations[k - len(comparison.data.strands)]
                rows = own * rng.normal(size=rows.shape)
            drawn.append(rows)
        result[b] = linear_move(comparison, found.pieces, found.information, drawn)
        result[b] += spread @ (known * before.normal(size=known.size))
    return found.inner + result - result.mean(axis=0)


def _block(comparison: Comparison, piece: Piece, k: int) -> int:
    """Return the number of points of a block: twice the length of the bias over the step of the speeds."""
    if k >= len(comparison.data.strands):
        return 1
    one = comparison.data.strands[k]
    steps = np.diff(np.unique(one.speeds))
    length = comparison.biases[one.name].length
    return int(np.clip(round(2.0 * length / float(np.median(steps))), 1, max(1, int((~piece.held).sum()) // 3)))


def _drawn(comparison: Comparison, k: int, keep: Integers, block: int, rng: np.random.Generator) -> Integers:
    """Return indices into ``keep`` of randomly drawn residuals that replace all residuals of the ``k``-th order."""
    speeds = comparison.data.strands[k].speeds[keep]
    repeated = [np.flatnonzero(speeds == one) for one in np.unique(speeds)]
    if all(places.size > 1 for places in repeated):
        result = np.empty(keep.size, dtype=np.intp)
        for places in repeated:
            result[places] = rng.choice(places, places.size)
        return result
    starts = rng.integers(0, keep.size, -(-keep.size // block))
    return np.asarray((starts[:, None] + np.arange(block)).ravel()[: keep.size] % keep.size)


def contradictions(comparison: Comparison, found: Estimate) -> list[Contradiction]:
    """Return pairs of data sets that contradict each other, the least likely pair first."""
    names, result = comparison.data.names, []
    wanted = {name: _wanted(comparison, found, name) for name in names}
    for i, first in enumerate(names):
        for second in names[i + 1 :]:
            one = _test(found, first, second, wanted[first], wanted[second])
            if one is not None and one.probability < UNLIKELY:
                result.append(one)
    return sorted(result, key=lambda one: one.probability)


def _wanted(comparison: Comparison, found: Estimate, name: str) -> tuple[Array, Array]:
    """Return a data set's information (p, p) on p parameters, and the gradient Jᵀ C⁻¹ r (p,) at the estimate."""
    slopes, rows = (comparison.whitened([getattr(one, part) for one in found.pieces]) for part in ("slopes", "rows"))
    chosen = [k for k, one in enumerate(found.pieces) if one.name == name]
    by, own = np.concatenate([slopes[k] for k in chosen]), np.concatenate([rows[k] for k in chosen])
    return information_of(comparison, found.pieces, name), np.asarray(by.T @ own)


def _test(
    found: Estimate, first: str, second: str, one: tuple[Array, Array], other: tuple[Array, Array]
) -> Contradiction | None:  # fmt: skip
    """Test two data sets in the combinations of parameters that both determine. Return None if there are none."""
    # In coordinates in which both sets together have unit information, one set's eigenvalues lie between 0 and 1. In
    # directions that both sets determine, the eigenvalues are neither 0 nor 1.
    values, vectors = np.linalg.eigh(one[0] + other[0])
    good = values > 1e-9 * values[-1]
    if not good.any():
        return None
    scale = vectors[:, good] / np.sqrt(values[good])
    parts, turned = np.linalg.eigh(scale.T @ one[0] @ scale)
    both = (parts > 1e-6) & (parts < 1.0 - 1e-6)
    if not both.any():
        return None
    ways = scale @ turned[:, both]
    share = parts[both]
    apart = (ways.T @ one[1]) / share - (ways.T @ other[1]) / (1.0 - share)
    square = apart**2 / (1.0 / share + 1.0 / (1.0 - share))
    most = ways[:, np.argmax(square)]
    k = int(np.argmax(np.abs(most) * np.sqrt(np.diag(one[0] + other[0]))))
    wants = tuple(
        float(found.inner[k] + (ways @ (ways.T @ slope / part))[k])
        for slope, part in ((one[1], share), (other[1], 1 - share))
    )
    return Contradiction(
        first, second, float(square.sum()), int(both.sum()), float(chi2.sf(square.sum(), both.sum())), k,
        (wants[0], wants[1]),
    )  # fmt: skip


def with_confidence(report: Mapping[str, Any]) -> dict[str, Any]:
    """Return a calibration's report with ``deviation_percent`` of its parameters, and ``told_apart`` in words.

    Parameters that may be zero or negative have no relative deviation.
    """
    parameters = [p for p in report["parameters"] if p["low"] * p["high"] > 0.0 and p["value"]]
    keys = [p["key"] for p in parameters]
    if not keys:
        return {**report, "told_apart": []}
    rows = [
        [target["sensitivities"][key] / (0.01 * target["tolerance_percent"]) for key in keys]
        for target in report["targets"]
    ]
    slopes = np.array(rows)
    information = slopes.T @ slopes
    bounds = np.diag([12.0 / math.log(p["high"] / p["low"]) ** 2 for p in parameters])
    spread = np.sqrt(np.diag(np.linalg.inv(information + bounds)))
    known = dict(zip(keys, (100.0 * spread).tolist(), strict=True))
    own = [{**p, "deviation_percent": known.get(p["key"])} for p in report["parameters"]]
    return {**report, "parameters": own, "told_apart": told_apart(information, bounds, keys)}
