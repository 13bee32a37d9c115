"""Motions that repeat less often than the engine, or never: what plain cycles, one after the other, tell of them.

Where a motion settles, two of its cycles that are alike are more alike after the next one, whatever its period. Where
it is chaotic they part, by the factor e^λ a cycle on average, λ the largest Lyapunov exponent: of twelve cycles each
and the one most like it show it (after Rosenstein, Collins and De Luca, Physica D 65, 1993).
"""

from __future__ import annotations

import math

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.settled.judging import Judge

LONGEST_PERIOD = 6
"""Most cycles after which a motion is looked for that repeats less often than the engine."""
PLAINLY = 2 * LONGEST_PERIOD
"""Cycles without correction in which that is looked for."""
NEAR = 0.1
"""What such cycles may miss of themselves for corrections to begin again."""
SURELY = 0.01
"""The same where cycles that are alike part: a motion without a period comes near itself by chance.

Also what they may miss for their period to be known.
"""
GAIN = 0.5
"""Of several periods the shortest is taken that leaves less than the least over this share."""
FADING = 0.9
"""Cycles of a block that differ by less than this share of what those of the block before did come to be alike."""
SETTLES = 0.9
"""A motion counts as one that settles where cycles that are alike come together by less than this factor."""


def same(judge: Judge, rows: Array, before: Array, tolerance: float) -> bool:
    """Whether outputs (samples, outputs) are those before."""
    return max(judge.left(rows, before).values(), default=0.0) <= tolerance


def comes_again(judge: Judge, samples: Array, tolerance: float) -> int:
    """After how many cycles, 2 to 6, the last of these (cycles, samples, outputs) is what it was; 0 if it is not."""
    last = min(LONGEST_PERIOD, len(samples) - 1)
    return next((p for p in range(2, last + 1) if same(judge, samples[-1], samples[-1 - p], tolerance)), 0)


def fading(judge: Judge, samples: Array, block: int, before: float, tolerance: float) -> tuple[bool, float]:
    """Whether the cycles of a block come to be alike, and by how much the last two differ."""
    if block == 1:
        return False, before
    count = len(samples) // block
    apart = max(judge.left(samples[-count:], samples[-2 * count : -count]).values(), default=0.0)
    return tolerance < apart < FADING * before, apart


def repeats_every(judge: Judge, samples: Array, block: int, tolerance: float) -> int:
    """After how many of a block of cycles, samples of all, the outputs repeat."""
    for every in range(1, block):
        count = len(samples) * every // block
        if block % every == 0 and same(judge, samples[count:], samples[:-count], tolerance):
            return every
    return block


def nearest_period(judge: Judge, cycles: Array, tolerance: float, shortest: int = 2) -> tuple[int, float]:
    """How many cycles to take at once, after which plain ones (cycles, samples, outputs) come nearest to themselves.

    It is ``shortest`` or more. In place of 2 and 3 it is 6, which holds both, until the cycles are near enough to tell
    which of them it is. 0 where the motion has no period, less than 0 where only more cycles tell. Also returns
    :func:`parting`.
    """
    apart = {}
    for every in range(shortest, LONGEST_PERIOD + 1):
        now, before = np.concatenate(cycles[-every:]), np.concatenate(cycles[-2 * every : -every])
        apart[every] = max(tolerance, *judge.left(now, before).values())
    nearest = next(every for every, far in apart.items() if far <= min(apart.values()) / GAIN)
    told = nearest not in (2, 3) or apart[nearest] <= SURELY
    block, factor = (nearest if told else LONGEST_PERIOD), parting(judge, cycles)
    least = min(apart.values())
    if least <= (NEAR if factor < 1.0 else SURELY):
        return block, factor
    return (-block if factor < SETTLES or least <= NEAR else 0), factor


def parting(judge: Judge, cycles: Array) -> float:
    """Factor (geometric mean) by which each cycle and the one most like it are farther apart after the next one."""
    weighted = (cycles * judge.weights(cycles[-1])).reshape(len(cycles), -1)
    weighted = weighted - weighted.mean(axis=0)
    products = weighted @ weighted.T
    squares = np.diag(products)[:, None] + np.diag(products) - 2.0 * products
    squares = np.maximum(squares, np.finfo(float).tiny)
    one = np.arange(len(cycles) - 1)
    other = (squares + np.diag(np.full(len(cycles), math.inf)))[:-1, :-1].argmin(axis=1)
    return math.exp(0.5 * float(np.mean(np.log(squares[one + 1, other + 1] / squares[one, other]))))
