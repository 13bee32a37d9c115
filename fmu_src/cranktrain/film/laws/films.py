"""Films that feel the journal's tilt, as the running model sees them: one address, whatever the law behind it.

A journal is described by the displacement of its middle (x, y) and that of its end at ζ = 1 against the middle (a, b),
m, with velocities in space, in the axes of a frame; forces on these four are (F_x, F_y, Q_x, Q_y), N, with Q = ∫ ζ dF.

A law is a kernel ``law(record, action, i, place, velocity, numbers, memory, out) -> status`` whose data and memory lie
in a record of its own. It knows these actions:

* FORCE: force and tangents of film i into ``out``;
* OBSERVE: the same and the figures that are shown;

and laws whose films remember what happened to them also those of a step, in this order: OPEN_STEP takes the memory from
the state; OPEN_STAGE the times of a stage; CLOSE_STAGE solves the films at the stage's last place; CLOSE_STEP leaves
the memory in the state. RATE tells how fast a film closes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.kernel import call_kernel, kernel
from cranktrain.core.reduced_body import Array

IntArray = NDArray[np.int64]

# What a tilted film writes: forces (4), tangents by place and by velocity (4 × 4 each), and figures; the least gap and
# its angle where the bore is not rigid (else the gap is negative).
BY_PLACE, BY_VELOCITY, ECCENTRICITY, FRICTION, PASSES = 4, 20, 36, 37, 38
P_MAX, FLOW, GAP, GAP_ANGLE, SIZE = 39, 40, 41, 42, 43

FORCE, OBSERVE, OPEN_STEP, OPEN_STAGE, CLOSE_STAGE, CLOSE_STEP, RATE = range(7)
# Columns of ``numbers``: the journal's speed (rad/s); cosine and sine of the frame's angle; time from the step's start
# to the stage, step, g of the stage's rule δ̇ = (δ − Δ)/g (s), number of the stage; 1 where tangents are held: a law
# may leave those that it found last; and for a bore that turns as well, where SPEED is the sum of both speeds, their
# difference; the frame's angle, whole turns counted (rad).
SPEED, COS, SIN, ELAPSED, STEP, GAIN, STAGE, HELD, RUBBING, ANGLE, NUMBERS = range(11)


class Films(NamedTuple):
    """Films of all main journals; b journals."""

    entry: IntArray  # (2,) addresses of the law and of its record; zero where films do not feel tilt
    values: Array  # (1,) values that one film keeps in the state
    place: Array  # (b, 4)
    velocity: Array  # (b, 4)
    numbers: Array  # (NUMBERS,)
    plane: Array  # (SIZE,) a film without tilt
    solved: Array  # (1,) films that lay outside the table since the count was last taken


def no_films(bearings: int) -> Films:
    """Films that do not feel tilt."""
    z = np.zeros
    entry = z(2, dtype=np.int64)
    return Films(entry, z(1), z((bearings, 4)), z((bearings, 4)), z(NUMBERS), z(SIZE), z(1))


@kernel
def film_call(films, action, i, memory, out):
    """Let the law act on film i at its ``place``, ``velocity`` and the ``numbers``; 0, or a failure."""
    arguments = (films.entry[1], action, i, films.place[i], films.velocity[i], films.numbers, memory, out)
    return call_kernel(films.entry[0], arguments)  # type: ignore[call-arg]
