"""Advice for wide confidence intervals: the further signal, or the fit by a higher level, that narrows them most.

With the information A of the data, priors and bounds, and B of a further signal
(:mod:`cranktrain_lab.identification.further_signals`), the covariance of u becomes

    S = (A + B)⁻¹ + Σ d' d'ᵀ,

in which d is the change of u by a higher level. All levels give equal decays, frequencies and shapes of the crank at
rest, so these signals reduce the change, d' = (A + B)⁻¹ A d. Orders do not, d' = d. A fit by a higher level removes the
d of this level and of the levels below it. The first term is the Cramér-Rao bound (V. V. Fedorov, *Theory of Optimal
Experiments*, 1972).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cranktrain.core.types import Array
from cranktrain_lab.identification.comparison import Comparison
from cranktrain_lab.identification.confidence import Confidence
from cranktrain_lab.identification.estimate import Estimate
from cranktrain_lab.identification.further_signals import Signal, further_signals
from cranktrain_lab.identification.ladder import Ask, Climbed
from cranktrain_lab.identification.model import BALANCE, TorsionalModel
from cranktrain_lab.identification.parameters import RATIOS, Sought

WIDE = 0.1
"""Relative half width of a confidence interval above which further signals are proposed."""
HELPS = 0.8
"""Largest ratio of the half widths with and without a signal at which the signal is proposed."""
TWO = 1.96
"""Half width of a 95 % interval in standard deviations, for many degrees of freedom."""
MOST = 2
"""Largest number of signals proposed for a parameter."""


@dataclass(frozen=True)
class _Fit(Signal):
    """Proposed fit by a higher level. It removes the model error that the first ``levels`` higher levels have shown."""

    levels: int


def advised(
    model: TorsionalModel, comparison: Comparison, climbed: Climbed, confidence: Confidence, ask: Ask
) -> list[dict[str, Any]]:
    """Return advice for each parameter whose relative half width exceeds :data:`WIDE`.

    Returns
    -------
    Rows with ``key``, ``half_percent`` of the present interval, ``add`` (up to two signals, the most useful first, each
    with ``signal`` in words, ``states``, the table or option to give it by, and ``half_percent`` with this signal and
    those before), and ``text``, a sentence
    """
    found = climbed.estimate
    halves = half_intervals(comparison.sought, found.inner, confidence.covariance, confidence.reach)
    wide = [k for k, half in enumerate(halves) if half > WIDE]
    if found.interrupted or not wide:
        return []
    signals = [*further_signals(model, comparison, found.inner), *_fits(climbed, comparison.sought, ask)]
    rows = []
    for k in wide:
        named, half = list[tuple[Signal, float]](), halves[k]
        for _ in range(MOST):
            added = [one for one, _ in named]
            left = [one for one in signals if not any(one is other for other in added)]
            reached = [_half(comparison, climbed, confidence, [*added, one], k) for one in left]
            if half <= WIDE or not left or min(reached) > HELPS * half:
                break
            best = int(np.argmin(reached))
            half = reached[best]
            named.append((left[best], half))
        add = [{"signal": one.words, "states": one.states, "half_percent": 100.0 * there} for one, there in named]
        key = comparison.sought[k].key
        text = _text(key, halves[k], named)
        rows.append({"key": key, "half_percent": 100.0 * halves[k], "add": add, "text": text})
    return rows


def remedy_for(model: TorsionalModel, comparison: Comparison, found: Estimate, k: int) -> str:
    """Return the best signal to add for a parameter without influence on the data, as end of a message; or empty."""
    signals = further_signals(model, comparison, found.inner)
    whole = found.information + comparison.known
    spread = [float(np.linalg.inv(whole + one.information)[k, k]) ** 0.5 for one in signals]
    own = comparison.sought[k]
    if not own.log or not signals or min(spread) > HELPS * float(np.linalg.inv(whole)[k, k]) ** 0.5:
        return ""
    best = signals[int(np.argmin(spread))]
    return f", or add {best.words} ({best.states}), which would tell it to {_percent(TWO * min(spread))}"


def half_intervals(sought: Sequence[Sought], inner: Array, covariance: Array, reach: float) -> list[float]:
    """Return the relative half width of each confidence interval; 0 for a parameter whose value is about zero."""
    spread, found = reach * np.sqrt(np.diag(covariance)), []
    for one, u, own in zip(sought, inner.tolist(), spread.tolist(), strict=True):
        known = one.log or abs(u) > own
        found.append(own * (1.0 if one.log else 1.0 / abs(u)) if known else 0.0)
    return found


def _half(
    comparison: Comparison, climbed: Climbed, confidence: Confidence, added: Sequence[Signal], k: int
) -> float:  # fmt: skip
    """Return the relative half width of the confidence interval of parameter ``k`` with signals added."""
    moved = climbed.estimate.information + comparison.known + sum(one.information for one in added if not one.agreed)
    whole = moved + sum(one.information for one in added if one.agreed)
    left = climbed.moves[max([0, *(one.levels for one in added if isinstance(one, _Fit))]) :]
    moves = np.linalg.solve(whole, moved @ left.T).T
    covariance = np.asarray(np.linalg.inv(whole) + moves.T @ moves, dtype=float)
    return half_intervals(comparison.sought, climbed.estimate.inner, covariance, confidence.reach)[k]


def _fits(climbed: Climbed, sought: Sequence[Sought], ask: Ask) -> list[_Fit]:
    """Return proposed fits by higher levels. Each fit also removes the model errors that the levels below it remove."""
    found, none = [], np.zeros((len(sought), len(sought)))
    ratios = any(one.key.startswith(RATIOS) for one in sought)
    for number, step in enumerate(climbed.beyond, 1):
        if step.level == BALANCE:
            states = f"--method {BALANCE}"
        elif ask.crank_above and step.level.startswith(ask.crank_above):
            states = f"--method time --crank {ask.crank_above}"
            states += ", with damping.ratio in place of torsional ratios" * ratios
        else:
            continue
        found.append(_Fit(f"a fit by {step.level}", states, none, False, number))
    return found


def _text(key: str, half: float, named: Sequence[tuple[Signal, float]]) -> str:
    """Return the advice on a parameter, given by its key, as a sentence."""
    said = f"{key} is known to {_percent(half)}"
    if not named:
        return f"{said}; no single signal that a measured file can state would narrow this by a fifth"
    (first, there), *more = named
    text = f"{said}; {first.words} ({first.states}) would narrow this to {_percent(there)}"
    return text + "".join(f", and {one.words} ({one.states}) besides to {_percent(half)}" for one, half in more)


def _percent(half: float) -> str:
    return f"±{100.0 * half:.2g} %" if half < 0.995 else f"±{100.0 * half:.0f} %"
