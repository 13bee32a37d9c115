"""Interface of films and other bearings to the running model: one address per bearing, for any law.

A journal is described by the displacement (x, y) of its middle and the displacement (a, b) of its end at ζ = 1 against
the middle, m, with velocities in space, in the axes of a frame. The forces on these four are (F_x, F_y, Q_x, Q_y), N,
with Q = ∫ ζ dF. A law without tilt has zero moments.

A law is a kernel ``law(record, action, i, place, velocity, numbers, memory, out) -> status``. Its data and memory are
in a record of its own. These actions exist for every law:

* FORCE: force and tangents of film i, and its friction torque, into ``out``;
* OBSERVE: the same, and the figures for outputs;

and laws whose films remember what happened to them also those of a step, in this order: OPEN_STEP takes the memory from
the state; OPEN_STAGE the times of a stage; CLOSE_STAGE solves the films at the stage's last place; CLOSE_STEP leaves
the memory in the state. RATE gives the relative rate at which a film closes: ``out[0]``, 1/s. The status is 0, or a
failure.

Some records hold more data of the oil than the bearings' parameters (trait VISCOUS). The action OIL sets another
viscosity in these records: film i then has the viscosity in ``numbers``. The action WARM tells laws of added
connections whose data follow the engine's speed, by a table of temperatures, that speed (SPEED).

Laws with the trait TOGETHER solve films side by side: before FORCE or CLOSE_STAGE is asked of any, LINE_UP tells each
where its journal is. What FORCE and CLOSE_STAGE then give is that of the motion told.
"""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.kernel import call_kernel, inlined_kernel
from cranktrain.core.reduced_body import Array

IntArray = NDArray[np.int64]

# Places, velocities and forces of a journal: of its middle, of its end against the middle.
X, Y, END_X, END_Y = range(4)

# What a law writes: forces (4), tangents by place and by velocity (4 × 4 each, row-major), and figures: eccentricity,
# friction torque on the journal, N m; passes of a solver; largest pressure, Pa, and side flow, m³/s; the least gap, m,
# and its angle, rad, where the bore is not a rigid circle (else the gap is negative).
BY_PLACE, BY_VELOCITY, ECCENTRICITY, FRICTION, PASSES = 4, 20, 36, 37, 38
P_MAX, FLOW, GAP, GAP_ANGLE, SIZE = 39, 40, 41, 42, 43

# What a law of the plane writes before :func:`widen`: forces (2), tangents by place and velocity (2 × 2 each).
PLANE_BY_PLACE, PLANE_BY_VELOCITY, PLANE_ECCENTRICITY = 2, 6, 10

PAIR = 2
"""Values that a law remembers which keeps one quantity and its rate by time, and may be interpolated within a step."""
FORCE, OBSERVE, OPEN_STEP, OPEN_STAGE, CLOSE_STAGE, CLOSE_STEP, RATE, OIL, WARM, LINE_UP = range(10)
# Columns of ``numbers``: the sum of the speeds of journal and bore (rad/s); cosine and sine of the frame's angle; time
# from the step's start to the stage, step, g of the stage's rule δ̇ = (δ − Δ)/g (s), number of the stage; 1 where
# tangents are kept: a law may leave those that it found last; the difference of the speeds of journal and bore (rad/s);
# the frame's angle, whole turns counted (rad); the viscosity at ambient pressure (Pa s), for OIL;
# to what the ports are iterated (clearances), for OIL as well; what the gas has over the crankcase's pressure (Pa), for
# laws of a cylinder; the speed (rad/s) of the bore's axes, where cosine and sine are those of the frame's angle against
# a bore that turns (of a big end that remembers its film), else 0.
SPEED, COS, SIN, ELAPSED, STEP, GAIN, STAGE, FROZEN, RUBBING, ANGLE, VISCOSITY, TOLERANCE, PRESSURE, TURN = range(14)
NUMBERS = 15

# Traits of a law: values that one film keeps in the state; 1 where its least gap limits the step; 1 where its force has
# a kink at the contact height; 1 where it is told of the oil; 1 where it solves films together.
MEMORY, CLOSES, CONTACT, VISCOUS, TOGETHER, TRAITS = range(6)


class Films(NamedTuple):
    """Laws of b connections, each behind its address; those of an engine's mains come first."""

    entry: IntArray  # (b, 3) addresses of a film's law and of its record, and its number there; 0 where there are none
    traits: Array  # (b, TRAITS)
    remembered: IntArray  # (b + 1,) where the memory of each begins behind that of the first; at last the size of all
    place: Array  # (b, 4)
    velocity: Array  # (b, 4)
    numbers: Array  # (NUMBERS,)
    out: Array  # (SIZE,)
    solved: Array  # (1,) films that lay outside their table so far


def no_films(bearings: int) -> Films:
    """Films without a law."""
    z = np.zeros
    entry, remembered = z((bearings, 3), dtype=np.int64), z(bearings + 1, dtype=np.int64)
    places, velocities = z((bearings, 4)), z((bearings, 4))
    return Films(entry, z((bearings, TRAITS)), remembered, places, velocities, z(NUMBERS), z(SIZE), z(1))


def join_films(count: int, parts: Sequence[tuple[Films, Sequence[int]]]) -> Films:
    """Laws of ``count`` connections: those of each part at its rows. The parts live as long as they do.

    Films outside their table are counted with those of the first part.
    """
    films = no_films(count)
    for part, rows in parts:
        films.entry[list(rows)], films.traits[list(rows)] = part.entry, part.traits
    films.remembered[1:] = np.cumsum(films.traits[:, MEMORY])
    weakref.finalize(films.entry, len, parts)  # a finalizer's arguments live until then
    return films._replace(solved=parts[0][0].solved)


@inlined_kernel
def film_call(films, action, i, memory, out):
    """Let the law act on film i at its ``place``, ``velocity`` and the ``numbers``; 0, or a failure."""
    row = films.entry[i]
    arguments = (row[1], action, row[2], films.place[i], films.velocity[i], films.numbers, memory, out)
    return call_kernel(row[0], arguments)


@inlined_kernel
def widen(plane, out):
    """Force and tangents of a film of the plane, with zero moments, into ``out[0:36]``; its eccentricity too."""
    for k in range(ECCENTRICITY):
        out[k] = 0.0
    for r in range(2):
        out[r] = plane[r]
        for s in range(2):
            out[BY_PLACE + 4 * r + s] = plane[PLANE_BY_PLACE + 2 * r + s]
            out[BY_VELOCITY + 4 * r + s] = plane[PLANE_BY_VELOCITY + 2 * r + s]
    out[ECCENTRICITY] = plane[PLANE_ECCENTRICITY]
