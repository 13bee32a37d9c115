"""Force laws at the ports of a stage: input motion of a law, its forces, and its tangents by motion of the ports.

A law acts at the Newton ports of its connection. Components that form pairs rotate with the frame's axes: for a journal
x and y of its middle, and with tilt those of its end as well; for a collar its rotations. In a stage u̇ changes by
(c_v/c_q) times the change of u, and velocities in space along the frame's axes are u̇ + Ω e_z×u. So a law's tangents by
displacement and by velocity make one block.
"""

from __future__ import annotations

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.film.laws.films import (
    ANGLE,
    BY_PLACE,
    BY_VELOCITY,
    COS,
    FRICTION,
    LINE_UP,
    RUBBING,
    SIN,
    SPEED,
    TOGETHER,
    film_call,
)

ROW = 4
"""Values in a row of a law's tangents, and of a connection's block."""


@inlined_kernel
def frame_numbers(frame, numbers):
    """Write the frame's angle into the ``numbers`` of laws."""
    numbers[COS] = frame[at.COS]
    numbers[SIN] = frame[at.SIN]
    numbers[ANGLE] = frame[at.THETA]


@inlined_kernel
def place_law(model, k, u, ud, whirl):
    """Write displacement and velocity in space of connection k, along the frame's axes, to ``model.laws``."""
    row = model.connections[k]
    place = model.laws.place[k]
    velocity = model.laws.velocity[k]
    size = row[at.COUPLED]
    pairs = row[at.PAIRS]
    for r in range(size if pairs < 0 else pairs):
        port = row[at.FIRST + r]
        place[r] = u[port]
        velocity[r] = ud[port]
    if pairs >= 0:
        for r in range(pairs, size, 2):
            place_pair(row[at.FIRST + r], u, ud, whirl, place[r:], velocity[r:])


@inlined_kernel
def place_pair(port, u, ud, whirl, place, velocity):
    """Write displacement and velocity in space of a pair of components, from ``port`` on."""
    x = u[port]
    y = u[port + 1]
    place[0] = x
    place[1] = y
    velocity[0] = ud[port] - whirl * y
    velocity[1] = ud[port + 1] + whirl * x


@inlined_kernel
def tell_law(model, frame, k, u, ud):
    """Pass the speed to the law of connection k, and the torque of the drive line's springs if that law needs it."""
    row = model.connections[k]
    speed = frame[at.OMEGA]
    if row[at.SPIN] >= 0:
        speed += ud[row[at.SPIN]]
    model.laws.numbers[SPEED] = speed
    model.laws.numbers[RUBBING] = speed
    if row[at.TOLD] >= 0:
        windup = u[row[at.TOLD]] + model.scalars[at.WINDUP_LEAD] * frame[at.LEAD]
        model.laws.place[k, row[at.COUPLED]] = model.scalars[at.WINDUP_K] * windup


@kernel
def line_up_laws(model, work, frame):
    """Pass the motion of all journals, RELATIVE and RELATIVE_RATE, to laws that solve several films together.

    For journals in rods :mod:`cranktrain.dynamics.motion.big_end_films` does this.
    """
    laws = model.laws
    for k in range(model.connections.shape[0]):
        if laws.traits[k, TOGETHER] > 0.0 and model.connections[k, at.SHAPE] == at.OF_PORTS:
            place_law(model, k, work.port[at.RELATIVE], work.port[at.RELATIVE_RATE], frame[at.WHIRL])
            tell_law(model, frame, k, work.port[at.U], work.port[at.UD])
            film_call(laws, LINE_UP, k, laws.out, laws.out)


@inlined_kernel
def hand_forces(row, frame, out, u, f):
    """Write forces ``out`` of a law to the ports f (m,) of its connection, and add the moments of these forces.

    u (m,) are the displacements of the ports. Moments are about the crank's axis.
    """
    size = row[at.COUPLED]
    pairs = row[at.PAIRS]
    for r in range(size if pairs < 0 else pairs):
        f[row[at.FIRST + r]] = out[r]
    if pairs < 0:
        return
    torque = 0.0
    x = frame[at.CRANK_X] if pairs == 0 else 0.0
    y = frame[at.CRANK_Y] if pairs == 0 else 0.0
    for r in range(pairs, size, 2):
        torque = hand_pair(row[at.FIRST + r], x, y, out[r:], u, f, torque)
        x = 0.0
        y = 0.0
    if row[at.SPIN] >= 0:
        torque += out[FRICTION]
    f[row[at.TURNED]] += torque


@inlined_kernel
def hand_pair(port, x, y, out, u, f, torque):
    """Write a pair of forces to the ports from ``port`` on. Return ``torque`` plus the pair's moment about (x, y)."""
    f[port] = out[0]
    f[port + 1] = out[1]
    return torque + (u[port] - x) * out[1] - (u[port + 1] - y) * out[0]


@inlined_kernel
def law_block(out, size, pairs, ratio, whirl, block):
    """Tangent of a law's ``size`` forces by the displacement of its ports into the 4 × 4 ``block``.

    ``pairs`` is the first component of those that rotate with the frame's axes, or −1.
    """
    for r in range(size):
        for s in range(size):
            i = ROW * r + s
            block[i] = out[BY_PLACE + i] + ratio * out[BY_VELOCITY + i]
        if pairs >= 0:
            for s in range(pairs, size, 2):
                i = ROW * r + s
                block[i] += whirl * out[BY_VELOCITY + i + 1]
                block[i + 1] -= whirl * out[BY_VELOCITY + i]


@inlined_kernel
def pairs_block(out, ratio, whirl, block):
    """Tangent block of a law with pairs of components only; values of a missing second pair are zero."""
    for r in range(ROW):
        for s in range(0, ROW, 2):
            i = ROW * r + s
            x = out[BY_VELOCITY + i]
            y = out[BY_VELOCITY + i + 1]
            block[i] = out[BY_PLACE + i] + ratio * x + whirl * y
            block[i + 1] = out[BY_PLACE + i + 1] + ratio * y - whirl * x
