"""Fidelity levels of an identification: a cheap model is fitted, and an expensive model corrects the results.

With the results y of the linear level and Y of a higher level, the fit of

    y(u) + [Y(u₀) − y(u₀)]

moves u₀ to u; at the fixed point the residuals of Y are orthogonal to the derivatives of y (manifold mapping,
Echeverría and Hemker, Comput. Methods Appl. Math. 5, 2005). Three to five evaluations of the higher level suffice; its
own derivatives would take one evaluation per parameter and iteration. If Y is of a bending crank, y is first shifted in
u until its resonances match those of Y, and the correction has derivatives, from one evaluation per parameter
(:mod:`cranktrain_lab.identification.mapping`).

Levels above the fitted one are evaluated once, at the estimate, in ascending order: harmonic balance above the linear
level, films by Reynolds' equation above the map of impedances, and the next bending crank in time. The change of the
parameters by each level is added to their covariance, because the residuals of the fitted level do not show it.
"""

import math
from collections.abc import Callable, Mapping
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
from cranktrain_lab.identification.tables import NEXT, NONE

SEARCH, BALANCED = 10.0, 10.0
"""Work of the linear search, and of all evaluations by harmonic balance, in units of one run in time."""
Follow = Callable[[float, float], None]


MOST, MOST_ORBITS = 5, 15
"""Largest number of corrections by a higher level, without orbits, and with orbits (Gauss-Newton steps)."""
LONGEST = 0.4
"""Longest step of a parameter's coordinate u with orbits: a factor of 1.5, or two fifths of the bounds' range."""
BEYOND = "beyond"
"""Name, in progress reports, of the work at fidelity levels above the fitted level."""
FOR_SIZE = 1e-2
"""Least settling error of the runs in time that estimate the change of the parameters by a higher level."""
FOLLOWED = 2
"""Number of evaluations of a higher level for which the fitted model is shifted. Later ones only add corrections."""
EXPECTED = 3
"""Number of evaluations of a higher level that progress reports assume."""
SAME = 0.1
"""Change of the parameters, in standard deviations, at which the corrections have converged."""
SETTLED = 1e-4
"""Largest settling error of runs in time whose differences give derivatives."""
ComplexArrays = tuple[NDArray[np.complex128], ...]


class Work:
    """Ordered parts of an identification's work, with the completed fraction of the expected work for progress reports.

    Work is counted in runs in time at one speed, because these take most of the time if there are any. If a level needs
    fewer evaluations than expected, progress jumps to the end of its part; if it needs more, progress slows down within
    its part.

    Parameters
    ----------
    say, follow : called with the stage, and with the completed fraction and the cost of a search
    parts : name → expected work, in runs
    """

    def __init__(self, say: Progress, follow: Follow, parts: Mapping[str, float]) -> None:
        self._say, self._follow = say, follow
        self._parts, self._whole = dict(parts), max(sum(parts.values()), 1e-9)
        self._before, self._own, self._done, self._cost, self._shown = 0.0, 0.0, 0.0, 0.0, 0.0

    def begin(self, part: str) -> None:
        """Begin a part of the work; all earlier parts count as done."""
        names = list(self._parts)
        self._before = sum(self._parts[name] for name in names[: names.index(part)])
        self._own, self._done = self._parts[part], 0.0
        self._show(0.0)

    def say(self, stage: str) -> None:
        """Report a stage of the work that is not a run in time."""
        self._say(stage)

    def run(self, stage: str) -> None:
        """Report the begin of a run; earlier runs count as done."""
        share = self._done / max(self._own, 1.0)
        # The last fifth of a part is reserved for more runs than expected.
        self._show(share if share < 0.8 else 1.0 - 0.2 * 0.8 / share)
        self._done += 1.0
        self._say(stage)

    def search(self, share: float, cost: float) -> None:
        """Report the cost of a search of the cheap model, and its progress if the present part is this search."""
        self._cost = cost
        self._show(share if self._done == 0.0 else 0.0)

    def _show(self, share: float) -> None:
        """Report the completed fraction of the whole work. The reported fraction never decreases."""
        self._shown = max(self._shown, min(1.0, (self._before + share * self._own) / self._whole))
        self._follow(self._shown, self._cost)


@dataclass(frozen=True)
class Level:
    """Fidelity level above the level of the fitted model.

    Attributes
    ----------
    name, answer : name, and function that returns orders and orbits for values (p,), SI
    mapped : fitted model if it is shifted to match the level's orders, else None
    longest : longest step in u between two evaluations; if finite, an estimate that does not converge is refused
    """

    name: str
    answer: Callable[[Array], ComplexArrays]
    mapped: Mapped | None = None
    longest: float = math.inf


@dataclass(frozen=True)
class Step:
    """Result of a fidelity level: name, estimated coordinates u (p,) of the parameters, and number of evaluations."""

    level: str
    inner: Array
    answers: int


@dataclass(frozen=True)
class Climbed:
    """Result of all fidelity levels: last estimate, steps to this estimate, and steps ``beyond`` it.

    A step beyond has the u that a higher level, together with all levels below it, would give.
    """

    estimate: Estimate
    steps: tuple[Step, ...]
    beyond: tuple[Step, ...] = ()

    @property
    def moves(self) -> Array:
        """Change (n, p) of the p coordinates u by each of n higher levels, compared with the level below."""
        places = [self.estimate.inner, *(step.inner for step in self.beyond)]
        return np.diff(places, axis=0)


@dataclass(frozen=True)
class Ask:
    """Settings of the fidelity levels: last level, crank and settling error of runs in time, and seed of the starts.

    ``above`` is the crank level of the single run in time at the estimate: a crank level, ``next`` or ``none``.
    """

    level: str = BALANCE
    crank: str = "torsional"
    settle: float = 1e-3
    seed: int = 1
    above: str = NONE

    @property
    def crank_above(self) -> str:
        """Crank level of the run above the fitted level, or empty; raises ``InputError``."""
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
    """Identify from the linear level up to the level of ``ask``; raises ``SolverError`` if a level cannot be evaluated.

    ``check`` is called with the linear estimate before expensive levels run, and raises for data of another engine.
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
    """Return the expected work of all fidelity levels, in numbers of runs in time."""
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
    """Estimate the coordinates u that each higher level would give, in ascending order; failed levels are left out.

    ``run`` is called with the stages of runs in time, ``say`` with all others.
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
        # A run in time includes the change by harmonic balance, but not the change by better films.
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
    """Estimate by runs in time with orbits; if interrupted before the first run, return the estimate without orbits."""
    before = comparison.model, comparison.data, comparison.biases, comparison.correction
    comparison.take(in_films, comparison.data.with_orbits())
    found, step = _corrected(comparison, found, level, work)
    if found.interrupted and not step.answers:
        if not found.pieces:
            raise KeyboardInterrupt  # no estimate exists yet, so the interrupt ends the run
        comparison.take(*before[:2])
        comparison.correction = before[3]
        comparison.weigh(before[2], comparison.own(found.inner))
    return found, step


def _corrected(comparison: Comparison, found: Estimate, level: Level, work: Work) -> tuple[Estimate, Step]:
    """Return the estimate corrected to a higher level; after an interrupt the last estimate."""
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
            if mapped is not None and answers == FOLLOWED - 1 and math.isinf(level.longest):  # only without orbits
                slopes = mapped.slopes(comparison, found.inner, added, spread)
        except KeyboardInterrupt:
            return replace(found, interrupted=True), Step(name, found.inner, answers)
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
    """Return standard deviations (p,) of the parameters' coordinates u from data and bounds."""
    return np.sqrt(np.diag(np.linalg.inv(found.information + comparison.known)))


def moved_by(
    comparison: Comparison, found: Estimate, high: ComplexArrays, low: ComplexArrays
) -> Array:  # fmt: skip
    """Return the change of u (p,), by the linear estimate, if orders ``high`` replace the orders ``low``."""
    blocks = []
    for one, above, own in zip(comparison.data.strands, high, low, strict=True):
        away = own - above
        blocks.append(
            np.stack((away.real, away.imag), axis=1) if one.phases else (np.abs(own) - np.abs(above))[:, None]
        )
    blocks += [np.zeros_like(piece.rows) for piece in found.pieces[len(blocks) :]]
    return linear_move(comparison, found.pieces, found.information, blocks)


def linear_move(comparison: Comparison, pieces: list[Piece], information: Array, blocks: list[Array]) -> Array:
    """Return the change of u (p,) by residuals (n, c): (A + P)⁻¹ Jᵀ C⁻¹ r."""
    slopes = np.concatenate(comparison.whitened([piece.slopes for piece in pieces]))
    rows = np.concatenate(comparison.whitened(blocks))
    return np.asarray(np.linalg.solve(information + comparison.known, slopes.T @ rows))
