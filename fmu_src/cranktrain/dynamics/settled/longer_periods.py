"""Motions with a period of several cycles, or without a period, found from successive plain cycles.

If a motion settles, the difference of two similar cycles is smaller after the next cycle, for any period. If it is
chaotic, the difference grows by the factor e^λ per cycle on average, with the largest Lyapunov exponent λ. Twelve
cycles, each compared with the most similar one, show this (after Rosenstein, Collins and De Luca, Physica D 65, 1993).
"""

import math

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.settled.judging import Judge

LONGEST_PERIOD = 6
"""Longest period, in cycles, that is searched for."""
PLAINLY = 2 * LONGEST_PERIOD
"""Number of cycles without correction in which a period is searched for."""
NEAR = 0.1
"""Largest relative difference of cycles one period apart at which corrections of the motion begin again."""
SURELY = 0.01
"""Value of ``NEAR`` if similar cycles diverge, because aperiodic motion may nearly repeat by chance.

It is also the largest difference at which the period counts as known.
"""
GAIN = 0.5
"""The shortest period is chosen whose difference is at most the least difference of all periods divided by GAIN."""
FADING = 0.9
"""Cycles of a block become alike if their difference is below this fraction of the previous block's difference."""
SETTLES = 0.9
"""A motion counts as settling if the difference of similar cycles changes by less than this factor per cycle."""


def same(judge: Judge, rows: Array, before: Array, tolerance: float) -> bool:
    """True if the outputs of a cycle, (samples, outputs), agree with the outputs ``before`` within the tolerance."""
    return max(judge.left(rows, before).values(), default=0.0) <= tolerance


def comes_again(judge: Judge, samples: Array, tolerance: float) -> int:
    """Period of cycles (cycles, samples, outputs) in cycles, 2 to 6; 0 if the motion is not periodic."""
    last = min(LONGEST_PERIOD, len(samples) - 1)
    return next((p for p in range(2, last + 1) if same(judge, samples[-1], samples[-1 - p], tolerance)), 0)


def fading(judge: Judge, samples: Array, block: int, before: float, tolerance: float) -> tuple[bool, float]:
    """Return whether the cycles of a block become alike, and the difference of its last two cycles."""
    if block == 1:
        return False, before
    count = len(samples) // block
    apart = max(judge.left(samples[-count:], samples[-2 * count : -count]).values(), default=0.0)
    return tolerance < apart < FADING * before, apart


def repeats_every(judge: Judge, samples: Array, block: int, tolerance: float) -> int:
    """Period, in cycles, of the outputs within a block of cycles; ``samples`` are the outputs of the whole block."""
    for every in range(1, block):
        count = len(samples) * every // block
        if block % every == 0 and same(judge, samples[count:], samples[:-count], tolerance):
            return every
    return block


def nearest_period(judge: Judge, cycles: Array, tolerance: float, shortest: int = 2) -> tuple[int, float]:
    """Period (in cycles) at which uncorrected cycles, (cycles, samples, outputs), repeat most closely.

    It is at least ``shortest``. For 2 and 3 it is 6, a multiple of both, until the cycles are near enough to
    distinguish them. It is 0 if the motion has no period, and negative if more cycles are needed to decide. Also
    returns :func:`parting`.
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
    """Factor (geometric mean) by which the difference between two similar cycles grows in one cycle."""
    weighted = (cycles * judge.weights(cycles[-1])).reshape(len(cycles), -1)
    weighted = weighted - weighted.mean(axis=0)
    products = weighted @ weighted.T
    squares = np.diag(products)[:, None] + np.diag(products) - 2.0 * products
    squares = np.maximum(squares, np.finfo(float).tiny)
    one = np.arange(len(cycles) - 1)
    other = (squares + np.diag(np.full(len(cycles), math.inf)))[:-1, :-1].argmin(axis=1)
    return math.exp(0.5 * float(np.mean(np.log(squares[one + 1, other + 1] / squares[one, other]))))
