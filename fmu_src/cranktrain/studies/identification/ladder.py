"""The levels of an identification: the cheap model is fitted, a dear one corrects it.

With the answers y of the linear level and Y of a higher one, the fit of

    y(u) + [Y(u₀) − y(u₀)]

moves u₀ to u; at the fixed point the residuals of Y are orthogonal to the derivatives of y (manifold mapping,
Echeverría and Hemker, Comput. Methods Appl. Math. 5, 2005). Three to five answers of the higher level suffice, where
derivatives of its own would take one for each parameter and round.

Without the correction the answers of the next level, once, say by how much they would move the parameters. This is
added to their covariance: it is what the fitted level cannot see in its residuals.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import SolverError
from cranktrain.core.types import Array, Progress
from cranktrain.studies.identification.comparison import Comparison, Piece
from cranktrain.studies.identification.estimate import Estimate, estimate
from cranktrain.studies.identification.model import BALANCE, LINEAR, TIME, TorsionalModel
from cranktrain.studies.identification.orbit_runs import OrbitModel
from cranktrain.studies.identification.parameters import outer_values

MOST, MOST_ORBITS = 5, 15
"""Corrections by a level, at most; with orbits, each is a step of Gauss and Newton."""
LONGEST = 0.4
"""Longest step in u by the derivatives of orbits: half as much again, or two fifths of the distance of the bounds."""
SAME = 0.1
"""Change of a parameter, in standard deviations, at which the corrections end."""
Follow = Callable[[float, float], None]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class Step:
    """What a level found: its name, the estimate (p,) u, and how many of its answers it took."""

    level: str
    inner: Array
    answers: int


@dataclass(frozen=True)
class Climbed:
    """Result of the ladder: the last estimate, all steps, and what the next level would move (p,) in u."""

    estimate: Estimate
    steps: tuple[Step, ...]
    shift: Array


@dataclass(frozen=True)
class Ask:
    """How far the ladder goes: the last level, the crank and the settling of runs in time, and the seed of starts."""

    level: str = BALANCE
    crank: str = "torsional"
    settle: float = 1e-3
    seed: int = 1


def climb(
    model: TorsionalModel, comparison: Comparison, ask: Ask, say: Progress = lambda stage: None,
    follow: Follow = lambda share, cost: None, check: Callable[[Estimate], None] = lambda found: None,
) -> Climbed:  # fmt: skip
    """Identification from the linear level to that of ``ask``; ``SolverError`` where a level has no answer.

    ``check`` is asked of the linear estimate, before dear levels run: it raises for data that are none of the engine.
    """
    none = np.zeros(comparison.start.size)
    if not comparison.data.of_pieces:
        found, steps = Estimate(comparison.start, [], np.zeros((none.size, none.size)), 0, False), []
    else:
        say("linear run-up")
        found = estimate(comparison, ask.seed, follow)
        check(found)
        steps = [Step(LINEAR, found.inner, found.evaluations)]
    if not (comparison.data.strands or comparison.data.orbits) or found.interrupted:
        return Climbed(found, tuple(steps), none)
    if ask.level == LINEAR:
        say("harmonic balance, for what it would move")
        try:
            high = model.balanced(outer_values(comparison.sought, found.inner))
        except (SolverError, KeyboardInterrupt) as error:
            say(f"no harmonic balance, whose step the intervals leave out: {error or 'interrupted'}")
            return Climbed(found, tuple(steps), none)
        low = comparison.answers(found.inner).strands
        return Climbed(found, tuple(steps), moved_by(comparison, found, high, low))
    levels: list[tuple[str, Callable[[Array], tuple[ComplexArray, ...]]]] = []
    if comparison.data.strands:
        levels.append((BALANCE, model.balanced))
    if ask.level == TIME and not comparison.data.orbits:
        levels.append((TIME, lambda values: model.in_time(values, ask.crank, ask.settle, say)))
    for level, answer in levels:
        found, step = _corrected(comparison, found, level, answer, say, follow)
        steps.append(step)
        if found.interrupted:
            break
    if comparison.data.orbits and not found.interrupted:
        found, step, shift = _with_orbits(model, comparison, found, ask, say, follow)
        return Climbed(found, (*steps, step), shift)
    return Climbed(found, tuple(steps), none)


def _with_orbits(
    model: TorsionalModel, comparison: Comparison, found: Estimate, ask: Ask, say: Progress, follow: Follow
) -> tuple[Estimate, Step, Array]:  # fmt: skip
    """Estimate by runs in time with orbits, which from here on are compared; interrupted before, without them.

    With it comes what a better film would move (p,) in u.
    """
    in_films = OrbitModel(model, comparison.data.orbits, ask.crank, ask.settle, say)
    before = comparison.model, comparison.data, comparison.biases, comparison.correction
    comparison.take(in_films, comparison.data.with_orbits())
    found, step = _corrected(comparison, found, TIME, in_films.in_time, say, follow, LONGEST)
    if found.interrupted and not step.answers:
        if not found.pieces:
            raise KeyboardInterrupt  # nothing was found yet
        comparison.take(*before[:2])
        comparison.correction = before[3]
        comparison.weigh(before[2], comparison.own(found.inner))
    shift = np.zeros(found.inner.size)
    if not found.interrupted:
        try:
            high = in_films.above(outer_values(comparison.sought, found.inner))
            shift = moved_by(comparison, found, high, comparison.answers(found.inner).strands)
        except (SolverError, KeyboardInterrupt) as error:
            say(f"no run on better films, whose step the intervals leave out: {error or 'interrupted'}")
    return found, step, shift


def _corrected(
    comparison: Comparison, found: Estimate, level: str, answer: Callable[[Array], tuple[ComplexArray, ...]],
    say: Progress, follow: Follow, longest: float = math.inf,
) -> tuple[Estimate, Step]:  # fmt: skip
    """Estimate whose answers are those of a higher level; after an interrupt the last one.

    ``longest`` step in u between two answers: where there is one, an estimate that does not come to rest is refused.
    """
    answers = 0
    for _ in range(MOST if math.isinf(longest) else MOST_ORBITS):
        say(f"{level}, correction {answers + 1}")
        values = outer_values(comparison.sought, found.inner)
        try:
            high, low = answer(values), comparison.model.answers(values).strands
        except KeyboardInterrupt:
            return _interrupted(found), Step(level, found.inner, answers)
        answers += 1
        comparison.correction = tuple(a - b for a, b in zip(high, low, strict=True))
        before, found = found, estimate(comparison, 1, follow, found.inner)
        spread = np.sqrt(np.diag(np.linalg.inv(found.information + comparison.known)))
        moved = found.inner - before.inner
        if found.interrupted or np.all(np.abs(moved) < SAME * spread):
            break
        if np.abs(moved).max() > longest:
            found = replace(found, inner=before.inner + moved * (longest / np.abs(moved).max()))
    else:
        if not math.isinf(longest) and np.any(np.abs(moved) > spread):
            k = int(np.argmax(np.abs(moved) / spread))
            raise SolverError(
                f"{level}: {MOST_ORBITS} corrections move {comparison.sought[k].key} on by "
                f"{100.0 * abs(moved[k]):.2g} % each; give it narrower bounds, or a start that is nearer"
            )
    return found, Step(level, found.inner, answers)


def _interrupted(found: Estimate) -> Estimate:
    return Estimate(found.inner, found.pieces, found.information, found.evaluations, True)


def moved_by(
    comparison: Comparison, found: Estimate, high: tuple[ComplexArray, ...], low: tuple[ComplexArray, ...]
) -> Array:  # fmt: skip
    """Change of u (p,) that other answers (s,) for the orders bring, by the linear estimate."""
    blocks = []
    for one, above, own in zip(comparison.data.strands, high, low, strict=True):
        away = own - above
        blocks.append(
            np.stack((away.real, away.imag), axis=1) if one.phases else (np.abs(own) - np.abs(above))[:, None]
        )
    blocks += [np.zeros_like(piece.rows) for piece in found.pieces[len(blocks) :]]
    return linear_move(comparison, found.pieces, found.information, blocks)


def linear_move(comparison: Comparison, pieces: list[Piece], information: Array, blocks: list[Array]) -> Array:
    """Change of u (p,) by residuals (n, c): A⁻¹ Jᵀ C⁻¹ r."""
    slopes = np.concatenate(comparison.whitened([piece.slopes for piece in pieces]))
    rows = np.concatenate(comparison.whitened(blocks))
    return np.asarray(np.linalg.solve(information + comparison.known, slopes.T @ rows))
