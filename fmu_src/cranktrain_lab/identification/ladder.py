"""The levels of an identification: the cheap model is fitted, a dear one corrects it.

With the answers y of the linear level and Y of a higher one, the fit of

    y(u) + [Y(u₀) − y(u₀)]

moves u₀ to u; at the fixed point the residuals of Y are orthogonal to the derivatives of y (manifold mapping,
Echeverría and Hemker, Comput. Methods Appl. Math. 5, 2005). Three to five answers of the higher level suffice, where
derivatives of its own would take one for each parameter and round. Where Y is of a crank that bends, y is first moved
to where its resonances are those of Y, and what is added has its derivatives, from one answer for each parameter
(:mod:`cranktrain_lab.identification.mapping`).

Levels above the fitted one answer once, at the estimate, each after the one below it: harmonic balance above the
linear level, films by Reynolds' equation above the map of impedances, and the next crank in time, which bends where the
fitted one only twists. By how much each would move the parameters is added to their covariance: it is what the fitted
level cannot see in its residuals.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import CranktrainError, InputError, SolverError, nearest
from cranktrain.core.types import Array, Progress
from cranktrain.engine.levels import CRANKS
from cranktrain_lab.identification.comparison import Comparison, Correction, Piece
from cranktrain_lab.identification.data import Orbit
from cranktrain_lab.identification.estimate import Estimate, estimate
from cranktrain_lab.identification.mapping import Mapped, imitated
from cranktrain_lab.identification.model import BALANCE, LINEAR, TIME, TorsionalModel
from cranktrain_lab.identification.orbit_runs import ABOVE, OrbitModel
from cranktrain_lab.identification.parameters import outer_values
from cranktrain_lab.identification.progress import BALANCED, SEARCH, Follow, Work
from cranktrain_lab.identification.tables import NEXT, NONE

MOST, MOST_ORBITS = 5, 15
"""Corrections by a level, at most; with orbits, each is a step of Gauss and Newton."""
LONGEST = 0.4
"""Longest step in u by the derivatives of orbits: half as much again, or two fifths of the distance of the bounds."""
BEYOND = "beyond"
"""Part of the work that levels above the fitted one take."""
FOR_SIZE = 1e-2
"""Settling error, at least, of runs in time that say once what a level would move."""
FOLLOWED = 2
"""Answers of a level by which the fitted one is moved; the corrections take up what is left."""
EXPECTED = 3
"""Answers of a level that progress expects."""
SAME = 0.1
"""Change of a parameter, in standard deviations, at which the corrections end."""
SETTLED = 1e-4
"""Settling error, at most, of runs in time whose differences are derivatives."""
ComplexArrays = tuple[NDArray[np.complex128], ...]


@dataclass(frozen=True)
class Level:
    """A level above the fitted one.

    Attributes
    ----------
    name, answer : what it is called, and its orders and orbits for values (p,), SI
    mapped : the fitted model where that is moved to the level's orders, or none
    longest : longest step in u between two answers; an estimate that does not come to rest is then refused
    """

    name: str
    answer: Callable[[Array], ComplexArrays]
    mapped: Mapped | None = None
    longest: float = math.inf


@dataclass(frozen=True)
class Step:
    """What a level found: its name, the estimate (p,) u, and how many of its answers it took."""

    level: str
    inner: Array
    answers: int


@dataclass(frozen=True)
class Climbed:
    """Result of the ladder: the last estimate, the steps to it, and those ``beyond``.

    A step beyond has the u to which a level above, and all below it, would move the estimate.
    """

    estimate: Estimate
    steps: tuple[Step, ...]
    beyond: tuple[Step, ...] = ()

    @property
    def moves(self) -> Array:
        """What each level above would move (n, p) in u, beyond the one below it."""
        places = [self.estimate.inner, *(step.inner for step in self.beyond)]
        return np.diff(places, axis=0)


@dataclass(frozen=True)
class Ask:
    """How far the ladder goes: the last level, the crank and the settling of runs in time, and the seed of starts.

    ``above`` is the crank whose run in time answers once at the estimate: a crank level, ``next`` or ``none``.
    """

    level: str = BALANCE
    crank: str = "torsional"
    settle: float = 1e-3
    seed: int = 1
    above: str = NONE

    @property
    def crank_above(self) -> str:
        """Crank level of the step beyond the fit, empty for none; ``InputError``."""
        own = self.crank if self.level == TIME else "torsional"
        levels = list(CRANKS)
        bending = [name for name in levels[levels.index(own) + 1 :] if CRANKS[name].bends]
        if self.above in (NEXT, NONE):
            return bending[0] if self.above == NEXT and bending else ""
        if self.above not in bending:
            known = (*bending, NEXT, NONE)
            raise InputError(f"'{self.above}' is no crank level above '{own}' that bends; {nearest(self.above, known)}")
        return self.above


def climb(
    model: TorsionalModel, comparison: Comparison, ask: Ask, say: Progress = lambda stage: None,
    follow: Follow = lambda share, cost: None, check: Callable[[Estimate], None] = lambda found: None,
) -> Climbed:  # fmt: skip
    """Identification from the linear level to that of ``ask``; ``SolverError`` where a level has no answer.

    ``check`` is asked of the linear estimate, before dear levels run: it raises for data that are none of the engine.
    """
    work = _work(comparison, ask, say, follow)
    if not comparison.data.of_pieces:
        size = comparison.start.size
        found, steps = Estimate(comparison.start, [], np.zeros((size, size)), 0, False), []
    else:
        work.begin(LINEAR)
        work.say("linear run-up")
        found = estimate(comparison, ask.seed, work.search)
        check(found)
        steps = [Step(LINEAR, found.inner, found.evaluations)]
    orders = bool(comparison.data.strands)
    if orders and ask.level != LINEAR and not found.interrupted:
        work.begin(BALANCE)
        found, step = _corrected(comparison, found, Level(BALANCE, model.balanced), work)
        steps.append(step)
    in_films = None
    if ask.level == TIME and not found.interrupted:
        work.begin(TIME)
        bends = orders and CRANKS[ask.crank].bends
        settle = min(ask.settle, SETTLED) if bends and not comparison.data.orbits else ask.settle
        answer = partial(model.in_time, crank=ask.crank, settle=settle, tell=work.run)
        if not comparison.data.orbits:
            answer = partial(answer, cycles={})
        mapped = Mapped(model, answer) if bends else None
        if comparison.data.orbits:
            in_films = OrbitModel(model, mapped or model, comparison.data.orbits, ask.crank, settle, work.run)
            found, step = _with_orbits(
                comparison, found, Level(TIME, in_films.in_time, mapped, LONGEST), in_films, work
            )
            steps.append(step)
        elif orders:
            comparison.model = mapped or model
            found, step = _corrected(comparison, found, Level(TIME, answer, mapped), work)
            steps.append(step)
    if found.interrupted:
        return Climbed(found, tuple(steps))
    work.begin(BEYOND)
    return Climbed(found, tuple(steps), levels_beyond(model, in_films, comparison, found, ask, say, work.run))


def _work(comparison: Comparison, ask: Ask, say: Progress, follow: Follow) -> Work:
    """Expected work of a ladder, in runs in time."""
    data, parameters = comparison.data, comparison.start.size
    speeds = float(np.unique(np.concatenate([one.speeds for one in data.strands])).size) if data.strands else 0.0
    in_time = EXPECTED + (parameters if CRANKS[ask.crank].bends else 0)
    parts = {
        LINEAR: SEARCH if data.of_pieces else 0.0,
        BALANCE: BALANCED if data.strands and ask.level != LINEAR else 0.0,
        TIME: speeds * in_time + EXPECTED * (1.0 + parameters) * bool(data.orbits) if ask.level == TIME else 0.0,
        BEYOND: speeds if ask.crank_above else 0.0,
    }
    return Work(say, follow, parts)


def levels_beyond(
    model: TorsionalModel, in_films: OrbitModel | None, comparison: Comparison, found: Estimate, ask: Ask,
    say: Progress = lambda stage: None, run: Progress = lambda stage: None,
) -> tuple[Step, ...]:  # fmt: skip
    """What levels above the fitted one would move, each after the one below it; one that has no answer is left out.

    ``run`` is told the speeds of runs in time, ``say`` all else.
    """
    values = outer_values(comparison.sought, found.inner)
    orders, crank = sum(not isinstance(one, Orbit) for one in comparison.data.strands), ask.crank_above
    own = comparison.answers(found.inner).strands

    def balanced() -> Array:
        return found.inner + moved_by(comparison, found, model.balanced(values), own)

    def in_better_films() -> Array:
        assert in_films is not None
        return found.inner + moved_by(comparison, found, (*own[:orders], *in_films.above(values)), own)

    def bending() -> Array:
        high = model.in_time(values, crank, max(ask.settle, FOR_SIZE), run)
        fitted = comparison.model if in_films is None else in_films.orders
        move = found.inner - imitated(fitted, comparison, found.inner, high, ask.seed, beside=True)
        # A run in time contains the step to harmonic balance, but not that to better films.
        return (steps[-1].inner if steps and in_films is not None else found.inner) + move

    steps: list[Step] = []
    for level, asked, moved_to in (
        (BALANCE, orders and ask.level == LINEAR, balanced),
        (f"films by {ABOVE}", in_films is not None, in_better_films),
        (f"{crank} in time", orders and crank, bending),
    ):
        if not asked:
            continue
        say(f"{level}, for what it would move")
        try:
            steps.append(Step(level, moved_to(), 1))
        except (CranktrainError, KeyboardInterrupt) as error:
            say(f"no answer by {level}, whose step the intervals leave out: {error or 'interrupted'}")
            if isinstance(error, KeyboardInterrupt):
                break
    return tuple(steps)


def _with_orbits(
    comparison: Comparison, found: Estimate, level: Level, in_films: OrbitModel, work: Work
) -> tuple[Estimate, Step]:
    """Estimate by runs in time with orbits, which from here on are compared; interrupted before, without them."""
    before = comparison.model, comparison.data, comparison.biases, comparison.correction
    comparison.take(in_films, comparison.data.with_orbits())
    found, step = _corrected(comparison, found, level, work)
    if found.interrupted and not step.answers:
        if not found.pieces:
            raise KeyboardInterrupt  # nothing was found yet
        comparison.take(*before[:2])
        comparison.correction = before[3]
        comparison.weigh(before[2], comparison.own(found.inner))
    return found, step


def _corrected(comparison: Comparison, found: Estimate, level: Level, work: Work) -> tuple[Estimate, Step]:
    """Estimate whose answers are those of a higher level; after an interrupt the last one."""
    answers, mapped, name = 0, level.mapped, level.name
    slopes: ComplexArrays = ()
    spread = _spread(comparison, found)
    for _ in range(MOST if math.isinf(level.longest) else MOST_ORBITS):
        work.say(f"{name}, correction {answers + 1}")
        values = outer_values(comparison.sought, found.inner)
        try:
            high, start = level.answer(values), found.inner
            if mapped is not None and answers < FOLLOWED:
                work.say(f"{name}, correction {answers + 1}: the linear run-up that is nearest to it")
                start = start - mapped.follow(comparison, values, high, 1)
            low = comparison.model.answers(values).strands
            added = tuple(a - b for a, b in zip(high, low, strict=True))
            if mapped is not None and answers == FOLLOWED - 1 and math.isinf(level.longest):  # not beside orbits
                slopes = mapped.slopes(comparison, found.inner, added, spread)
        except KeyboardInterrupt:
            return _interrupted(found), Step(name, found.inner, answers)
        answers += 1
        comparison.correction = Correction(added, found.inner, slopes)
        before, found = found, estimate(comparison, 1, work.search, np.clip(start, comparison.low, comparison.high))
        spread = _spread(comparison, found)
        moved = found.inner - before.inner
        if found.interrupted or np.all(np.abs(moved) < SAME * spread):
            break
        if np.abs(moved).max() > level.longest:
            found = replace(found, inner=before.inner + moved * (level.longest / np.abs(moved).max()))
    else:
        if not math.isinf(level.longest) and np.any(np.abs(moved) > spread):
            k = int(np.argmax(np.abs(moved) / spread))
            raise SolverError(
                f"{name}: {MOST_ORBITS} corrections move {comparison.sought[k].key} on by "
                f"{100.0 * abs(moved[k]):.2g} % each; give it narrower bounds, or a start that is nearer"
            )
    return found, Step(name, found.inner, answers)


def _spread(comparison: Comparison, found: Estimate) -> Array:
    """Standard deviations (p,) of u; those of the bounds where nothing was compared yet."""
    return np.sqrt(np.diag(np.linalg.inv(found.information + comparison.known)))


def _interrupted(found: Estimate) -> Estimate:
    return Estimate(found.inner, found.pieces, found.information, found.evaluations, True)


def moved_by(
    comparison: Comparison, found: Estimate, high: ComplexArrays, low: ComplexArrays
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
