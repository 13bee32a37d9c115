"""Checks that refuse data of another engine, parameters without influence on the data, and contradicting data sets."""

import math
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress

import numpy as np
from scipy.stats import qmc

from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.core.types import Array
from cranktrain.engine.levels import CRANKS
from cranktrain.engine.model import Engine
from cranktrain.results.orders.measured import LEAST
from cranktrain_lab.identification.comparison import Comparison
from cranktrain_lab.identification.confidence import contradictions, unexcited
from cranktrain_lab.identification.data import RATIO, Orbit, Strand
from cranktrain_lab.identification.estimate import Estimate
from cranktrain_lab.identification.model import TorsionalModel
from cranktrain_lab.identification.parameters import RATIOS, outer_values

Remedy = Callable[[Estimate, int], str]
SAMPLES = 16
"""Number of points within the bounds at which model frequencies are evaluated, in addition to the bounds."""
REACH = 0.05
"""Relative distance of a measured frequency from the model's range above which the data are refused."""
EXPLAINED = 0.5
"""Least fraction of the squared amplitudes that a fit must explain."""
FACTOR, MISSED = 3.0, 5.0
"""Limits of a measured damping ratio's deviation from the best fit: a factor, and standard deviations."""
SAME_MODE = 0.5
"""Least modal assurance criterion (MAC) between a measured mode shape and the shape of the best fit."""
CLEAR = 3.0
"""Least ratio of an order's peak to the order's median over speed for which the peak counts as a resonance."""


def check_crank(engine: Engine, keys: Iterable[str], crank: str) -> None:
    """Raise ``InputError`` for parameters ``keys`` that the crank of runs in time does not have."""
    own = "damping.ratio" if engine.damping.kind == "modal" else "damping.beta"
    for key in keys:
        if CRANKS[crank].bends and key.startswith(RATIOS):
            raise InputError(
                f"parameters.'{key}': crank level '{crank}' bends and has '{own}' for all its modes; seek that, "
                "or take --crank torsional"
            )


def check_estimate(comparison: Comparison, found: Estimate, remedy: Remedy = lambda found, k: "") -> None:
    """Raise ``InputError`` for an estimate from data of another engine.

    ``remedy`` returns the advice on a parameter, by its index, that has no influence on the data.
    """
    if found.interrupted:
        return
    check_explained(comparison, found)
    check_excited(comparison, found, remedy)
    check_sets(comparison, found)
    check_numbers(comparison, found)


def check_excited(comparison: Comparison, found: Estimate, remedy: Remedy) -> None:
    """Raise ``InputError`` for parameters without influence on the data."""
    for k in unexcited(comparison, found):
        one = comparison.sought[k]
        moved = math.sqrt(found.information[k, k]) * (comparison.high[k] - comparison.low[k])
        raise InputError(
            f"parameters.'{one.key}': nothing in the data depends on it; from {one.text(one.low)} to "
            f"{one.text(one.high)} it moves them by {moved:.2g} of their deviation; leave it out{remedy(found, k)}"
        )


def check_numbers(comparison: Comparison, found: Estimate) -> None:
    """Raise ``InputError`` for decays and shapes far from the best fit, which belong to another mode.

    A parameter that is not sought may be the cause too. Frequencies are compared before the search.
    """
    pieces = found.pieces[len(comparison.data.strands) :]
    for one, piece in zip(comparison.data.scalars, pieces, strict=False):
        away = float(piece.rows[0, 0])
        if one.kind == RATIO and abs(away) > max(math.log(FACTOR), MISSED * one.deviation):
            key = "damper.viscosity" if one.damper else f"{RATIOS}[{one.number}]"
            sought = any(key.startswith(other.key) for other in comparison.sought)
            remedy = f"widen the bounds of '{key}'" if sought else f"seek '{key}' as well"
            raise InputError(
                f"'{one.name}': its damping ratio, {one.value:.3g}, is {math.exp(away):.2g} times that of the best "
                f"fit; it is of another mode, or {remedy}"
            )
    for shape, piece in zip(comparison.data.shapes, pieces[len(comparison.data.scalars) :], strict=True):
        own = shape.values - piece.rows[:, 0]
        mac = float((own @ shape.values) ** 2 / (own @ own))
        if mac < SAME_MODE:
            raise InputError(
                f"'{shape.name}': its shape has a MAC of {mac:.2f} with mode {shape.number} of the best fit; it is of "
                "another mode, or its places are exchanged"
            )


def check_sets(comparison: Comparison, found: Estimate) -> None:
    """Raise ``InputError`` if two data sets contradict each other."""
    against = contradictions(comparison, found)
    if not against:
        return
    one = against[0]
    sought = comparison.sought[one.parameter]
    wants = [
        sought.text(
            sought.value(float(np.clip(u, comparison.low[one.parameter] - 5.0, comparison.high[one.parameter] + 5.0)))
        )
        for u in one.wants
    ]
    raise InputError(
        f"'{one.first}' and '{one.second}' contradict each other: chi-square {one.distance:.0f} for {one.freedom} "
        f"degrees of freedom, probability {one.probability:.1g}; of {sought.key} the first wants {wants[0]}, the "
        f"second {wants[1]}; correct or leave out one of them, or state a larger deviation"
    )


def check_explained(comparison: Comparison, found: Estimate) -> None:
    """Raise ``InputError`` for orders of which the best fit explains less than half."""
    for name in comparison.data.order_sets:
        of = [k for k, one in enumerate(comparison.data.strands) if one.name == name]
        rows = [(comparison.data.strands[k], found.pieces[k]) for k in of]
        left = sum(float(np.sum(piece.rows[~one.held] ** 2)) for one, piece in rows)
        # A toothed wheel's errors add a constant, which is no part of the measured values.
        added = [0.0 if piece.constant is None else piece.constant.number for _, piece in rows]
        varying = [one.values - constant for (one, _), constant in zip(rows, added, strict=True)]
        whole = sum(float(np.sum(np.abs(v[~one.held]) ** 2)) for (one, _), v in zip(rows, varying, strict=True))
        if left > (1.0 - EXPLAINED) * whole:
            worst = max(rows, key=lambda row: float(np.sum(row[1].rows[~row[0].held] ** 2)))[0]
            part = 100.0 * max(0.0, 1.0 - left / whole) if whole > 0.0 else 0.0
            least = "" if isinstance(worst, Orbit) else f", least of order {worst.order:g}"
            raise InputError(
                f"'{name}': the best parameters within their bounds explain {part:.0f} % of its squared amplitudes"
                f"{least}; the data are of another engine, load or "
                f'reference of phase (sought by "zero.{name}")'
            )


def check_frequencies(model: TorsionalModel, comparison: Comparison, seed: int) -> None:
    """Raise ``InputError`` for resonances and frequencies that no parameters within their bounds give."""
    points = _points(comparison, seed)
    numbers = []
    for point in points if model.data.scalars else ():
        with suppress(CranktrainError, ArithmeticError, np.linalg.LinAlgError):
            numbers.append(model.numbers(point))
    for k, scalar in enumerate(model.data.scalars if numbers else ()):
        if scalar.kind != RATIO:
            own = [float(found[k]) for found in numbers]
            reach = max(REACH, 3.0 * scalar.deviation)
            _check(f"'{scalar.name}'", scalar.value, min(own), max(own), comparison, reach)
    peaks = [(one, hz) for one in model.data.strands if (hz := peak_hz(one.speeds, np.abs(one.values), one.order))]
    if not peaks:
        return
    answers = []
    for point in points:
        with suppress(CranktrainError, ArithmeticError, np.linalg.LinAlgError):
            answers.append(model.answers(point).strands)
    for one, hz in peaks:
        k = model.data.strands.index(one)
        own = [found for found in (peak_hz(one.speeds, np.abs(a[k]), one.order) for a in answers) if found]
        if len(own) == len(answers) and own:  # the range is known only if all peaks lie within the measured speeds
            where = f"'{one.name}': the peak of order {one.order:g} at {60.0 * hz / one.order:.0f} rev/min,"
            step = float(np.median(np.diff(np.unique(one.speeds))) / np.mean(one.speeds))
            _check(where, hz, min(own), max(own), comparison, REACH + step)


def _check(where: str, hz: float, low: float, high: float, comparison: Comparison, reach: float) -> None:
    if low * (1.0 - reach) <= hz <= high * (1.0 + reach):
        return
    keys = ", ".join(one.key for one in comparison.sought)
    raise InputError(
        f"{where} {hz:.1f} Hz, is not the engine's: with {keys} within their bounds it has {low:.1f} to {high:.1f} Hz; "
        "the data are of another engine or mode, or widen the bounds"
    )


def _points(comparison: Comparison, seed: int) -> list[Array]:
    """Return points, each with p parameter values (SI), spread over the bounds, and both bounds of each parameter."""
    p = comparison.low.size
    shares = list(qmc.Sobol(p, rng=np.random.default_rng(seed)).random(SAMPLES))
    for k in range(p):
        for end in (0.0, 1.0):
            share = np.full(p, 0.5)
            share[k] = end
            shares.append(share)
    width = comparison.high - comparison.low
    return [outer_values(comparison.sought, comparison.low + share * width) for share in shares]


def peak_hz(speeds: Array, sizes: Sequence[float] | Array, order: float) -> float | None:
    """Return the frequency (Hz) of an order's clear resonance within the speeds (n,) rad/s, or None."""
    by_speed = np.argsort(speeds, kind="stable")
    own, at = np.asarray(sizes)[by_speed], speeds[by_speed]
    k = int(np.argmax(own))
    if k in (0, own.size - 1) or own[k] < CLEAR * float(np.median(own)):
        return None
    return float(order * at[k] / (2.0 * math.pi))


def check_data(strands: Sequence[Strand]) -> None:
    """Raise ``InputError`` for orders that are zero at all speeds, or so small that their squares are zero."""
    for one in strands:
        largest = float(np.abs(one.values).max())
        if largest < LEAST:
            said = "0" if largest == 0.0 else f"{largest:.2g} (SI) or less"
            raise InputError(f"'{one.name}': order {one.order:g} is {said} at all speeds; leave it out of orders")
