"""Record of elastic films over the last cycle of a run, stage by stage, from which the next cycle extrapolates.

If a cycle nearly repeats the previous cycle, a film's force is extrapolated by its tangents from the same stage of the
previous cycle,

    F = F₁ + K (x − x₁) + C (v − v₁) + D (Δ − Δ₁) + e,

with position x and velocity v of the journal, the known part Δ of the bore's shapes from the past, and the error e of
the same formula at the previous stage. A stage then needs one solution of the film, at its end position. The solution
starts from that of the previous cycle and becomes the record for the next cycle. When cycles become periodic, x → x₁
and e → 0. The force is then that of the film itself, and the periodic cycle equals that with films solved at every
stage.

Stages correspond if their steps begin at the same shaft angle within the cycle and have the same length. The film is
solved as usual if there is no corresponding stage, or if the journal moved by more than a fraction of the film.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.reduced_body import Array
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, END_X, END_Y, X, Y

CYCLE = 4.0 * math.pi
SAME_ANGLE = 1.0e-6
"""rad by which the starts of two steps may differ that belong together."""
SAME_STEP = 1.0e-6
"""The same of their lengths, over themselves."""
NEAR = 0.1
"""Change of place over the least film up to which a film's force is carried on by its tangents; chosen by run-ups of
the six from 1000 to 2060 rev/min."""
STILL = 1.0e-3
"""The same up to which tangents stay; chosen."""
FARTHEST = 2.0
"""Steps of the speed, over the one before, up to which a cycle is expected on a line through two."""
MOST_STAGES = 2400
"""Largest number of recorded stages of a cycle; further stages are not recorded."""

# Which record is written; stages of the other one, and of this; where the present step is in the other one, and the
# angle at which it begins; the present stage in this one, and in the other one, or −1; up to which change of place over
# the least film forces are carried on.
SIDE, KNOWN_STAGES, WRITTEN, AT, BEGIN, ENTRY, FOUND, REACH, MARKS = range(9)
KEY_BEGIN, KEY_STEP, KEY_STAGE, KEYS = range(4)
# Of one film at a stage: place, velocity, force with its tangents by both, friction torque, least film, then Δ, D,
# shapes and node unknowns.
PLACE, VELOCITY, RESULT, FRICTION, LEAST, REST = 0, 4, 8, 44, 45, 46
RESULTS = 36


class PastCycle(NamedTuple):
    """Records of two cycles, the last one and the one under way, of b films; empty where nothing is kept."""

    marks: Array  # (MARKS,) where in the cycle the run is
    keys: Array  # (2, stages, KEYS) start (rad) and length (s) of the step, number of the stage
    values: Array  # (2, stages, b, ·)


class Kept(NamedTuple):
    """Last cycle at a speed (rad/s), with lengths of steps as angles (rad)."""

    speed: float
    keys: Array
    values: Array


class PastCycles:
    """Keeps the records of a simulation's films, whose models may change under it."""

    def __init__(self) -> None:
        self._past = no_past(0, 0)
        self._before: Kept | None = None
        self._shapes = 0

    def room(self, films: int, shapes: int, nodes: int) -> PastCycle:
        """Records of films with so many shapes and nodes each; those that are there where they fit."""
        size = REST + 6 * shapes + nodes
        if self._past.values.shape[2:] != (films, size):
            self._past = no_past(films, size, MOST_STAGES)
        self._shapes = shapes
        return self._past

    def forget(self) -> None:
        """Begin anew."""
        self._past.marks[:] = _marks()
        self._before = None

    def stop(self) -> bool:
        """Let all films be solved as ever until :meth:`forget` or :meth:`go_on_at`; whether any followed the past."""
        followed = self._past.keys.size > 0 and self._past.marks[REACH] > 0.0
        self._past.marks[REACH] = 0.0
        return bool(followed)

    def go_on_at(self, speed: float, last: float) -> None:
        """Expect a cycle at a speed (rad/s) from those at the ``last`` speed and the one before.

        It lies on the line through both where stages belong together, else it is the last one, turned faster.
        """
        marks = self._past.marks
        side, count = int(marks[SIDE]), int(marks[WRITTEN])
        marks[REACH] = NEAR
        keys, values = self._past.keys[side, :count], self._past.values[side, :count]
        keys[:, KEY_STEP] *= last
        before, self._before = self._before, Kept(last, keys.copy(), values.copy())
        values[:, :, VELOCITY:RESULT] *= speed / last
        if before is not None and abs(speed - last) <= FARTHEST * abs(last - before.speed):
            _, here, there = np.intersect1d(_codes(keys), _codes(before.keys), return_indices=True)
            now, then = self._before.values[here], before.values[there]
            values[here] = _beyond(now, then, (speed - last) / (last - before.speed), REST + 6 * self._shapes)
        keys[:, KEY_STEP] /= speed
        marks[BEGIN] = CYCLE  # the next step begins another cycle


def _codes(keys: Array) -> NDArray[np.int64]:
    """One number for each stage, equal where two belong together."""
    begin, step, stage = np.rint(keys / (SAME_ANGLE * 10.0, SAME_ANGLE * 10.0, 1.0)).astype(np.int64).T
    return np.asarray((begin * 10_000 + step) * 10 + stage)


def _beyond(now: Array, then: Array, share: float, nodes: int) -> Array:
    """Records beyond those of ``now`` by a share of their difference from ``then``; ``nodes``: where unknowns begin."""
    found = now + share * (now - then)
    found[..., LEAST] = now[..., LEAST]
    # Full nodes have pressures, others voids: only among one kind there are differences.
    u, was, will = now[..., nodes:], then[..., nodes:], found[..., nodes:]
    will[(u < 0.0) != (was < 0.0)] = u[(u < 0.0) != (was < 0.0)]
    will[(u < 0.0) != (will < 0.0)] = u[(u < 0.0) != (will < 0.0)]
    return np.asarray(found)


def no_past(films: int, size: int, stages: int = 0) -> PastCycle:
    """Records without content."""
    return PastCycle(_marks(), np.zeros((2, stages, KEYS)), np.zeros((2, stages, films, size)))


def _marks() -> Array:
    """At no place of a cycle."""
    marks = np.zeros(MARKS)
    marks[ENTRY] = marks[FOUND] = -1.0
    marks[REACH] = NEAR
    return marks


@kernel
def begin_step(past, angle):
    """Find the place in the records of a step that begins at an angle of the shaft, rad."""
    marks = past.marks
    if past.keys.shape[1] == 0:
        return
    within = angle - CYCLE * math.floor((angle + SAME_ANGLE) / CYCLE)
    if within < marks[BEGIN] - 0.5 * CYCLE:
        marks[SIDE] = 1.0 - marks[SIDE]
        marks[KNOWN_STAGES] = marks[WRITTEN]
        marks[WRITTEN] = 0.0
        marks[AT] = 0.0
    marks[BEGIN] = within
    # A repeated step replaces the failed one.
    written = past.keys[int(marks[SIDE])]
    while marks[WRITTEN] > 0.0 and written[int(marks[WRITTEN]) - 1, KEY_BEGIN] > within - SAME_ANGLE:
        marks[WRITTEN] -= 1.0
    known = past.keys[1 - int(marks[SIDE])]
    while marks[AT] > 0.0 and known[int(marks[AT]) - 1, KEY_BEGIN] > within - SAME_ANGLE:
        marks[AT] -= 1.0
    while marks[AT] < marks[KNOWN_STAGES] and known[int(marks[AT]), KEY_BEGIN] < within - SAME_ANGLE:
        marks[AT] += 1.0


@kernel
def begin_stage(past, stage, step):
    """Find a stage of the present step, whose length is ``step`` (s), in the records, and its own place there."""
    marks = past.marks
    marks[FOUND] = -1.0
    marks[ENTRY] = -1.0
    if marks[WRITTEN] >= past.keys.shape[1]:
        return
    key = past.keys[int(marks[SIDE]), int(marks[WRITTEN])]
    key[KEY_BEGIN] = marks[BEGIN]
    key[KEY_STEP] = step
    key[KEY_STAGE] = stage
    marks[ENTRY] = marks[WRITTEN]
    marks[WRITTEN] += 1.0
    known = past.keys[1 - int(marks[SIDE])]
    for k in range(int(marks[AT]), int(marks[KNOWN_STAGES])):
        if abs(known[k, KEY_BEGIN] - marks[BEGIN]) > SAME_ANGLE:
            break
        if known[k, KEY_STAGE] == stage and abs(known[k, KEY_STEP] - step) <= SAME_STEP * step:
            marks[FOUND] = k
            break


@inlined_kernel
def end_step(past):
    """Outside a step nothing is known."""
    past.marks[FOUND] = -1.0
    past.marks[ENTRY] = -1.0


@inlined_kernel
def found_at(past):
    """Where ``values`` hold the stage found: side and stage."""
    return 1 - int(past.marks[SIDE]), int(past.marks[FOUND])


@inlined_kernel
def distance(known, place, least):
    """Change of a journal's position (4,) from the record, over the larger of the film there and ``least`` (m)."""
    x = place[X] - known[PLACE + X]
    y = place[Y] - known[PLACE + Y]
    a = place[END_X] - known[PLACE + END_X]
    b = place[END_Y] - known[PLACE + END_Y]
    return (math.sqrt(x * x + y * y) + math.sqrt(a * a + b * b)) / max(known[LEAST], least)


@kernel
def carried_on(known, motion, shapes, defect, out):
    """Force with its tangents, ``out[0:36]``, at a motion (2, 4) and a past of the ``shapes`` (k,), from the known.

    ``defect`` (4,) is the error of this extrapolation at the previous stage.
    """
    count = shapes.shape[0]
    place = motion[0]
    velocity = motion[1]
    for k in range(RESULTS):
        out[k] = known[RESULT + k]
    for r in range(4):
        total = out[r] + defect[r]
        for k in range(4):
            total += out[BY_PLACE + 4 * r + k] * (place[k] - known[PLACE + k])
            total += out[BY_VELOCITY + 4 * r + k] * (velocity[k] - known[VELOCITY + k])
        for k in range(count):
            total += known[REST + count * (1 + r) + k] * (shapes[k] - known[REST + k])
        out[r] = total


@kernel
def begin_as_known(known, unknowns, shapes):
    """Start a film's solution from the solution of the previous cycle."""
    first = REST + 5 * shapes.shape[0]
    for k in range(shapes.shape[0]):
        shapes[k] = known[first + k]
    first += shapes.shape[0]
    for k in range(unknowns.shape[0]):
        unknowns[k] = known[first + k]


@kernel
def begin_beside(known, before, unknowns, shapes):
    """The same, plus the deviation of the stage ``before``, still in ``unknowns`` and ``shapes``, from its record."""
    first = REST + 5 * shapes.shape[0]
    for k in range(shapes.shape[0]):
        shapes[k] += known[first + k] - before[first + k]
    first += shapes.shape[0]
    for k in range(unknowns.shape[0]):
        then = known[first + k]
        beside = unknowns[k] + then - before[first + k]
        # Full nodes have pressures, others voids: only among one kind there are differences.
        same = then < 0.0 and before[first + k] < 0.0 and unknowns[k] < 0.0 and beside < 0.0
        same = same or (then >= 0.0 and before[first + k] >= 0.0 and unknowns[k] >= 0.0 and beside >= 0.0)
        unknowns[k] = beside if same else then


@kernel
def keep_tangents(known, out, by_past):
    """Let a film have the tangents of a cycle ago."""
    count = by_past.shape[1]
    for k in range(BY_PLACE, RESULTS):
        out[k] = known[RESULT + k]
    for r in range(4):
        for k in range(count):
            by_past[r, k] = known[REST + count * (1 + r) + k]


@kernel
def keep_film(kept, motion, out, friction, least, film):
    """Keep a film at a stage; ``film`` holds Δ (k,), D (4, k), shapes (k,) and node unknowns (n,)."""
    past, by_past, shapes, unknowns = film
    count = shapes.shape[0]
    for k in range(4):
        kept[PLACE + k] = motion[0, k]
        kept[VELOCITY + k] = motion[1, k]
    for k in range(RESULTS):
        kept[RESULT + k] = out[k]
    kept[FRICTION] = friction
    kept[LEAST] = least
    first = REST + 5 * count
    for k in range(count):
        kept[REST + k] = past[k]
        for r in range(4):
            kept[REST + count * (1 + r) + k] = by_past[r, k]
        kept[first + k] = shapes[k]
    for k in range(unknowns.shape[0]):
        kept[first + count + k] = unknowns[k]
