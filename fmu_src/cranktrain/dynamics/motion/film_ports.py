"""Films at the ports of a stage: where a journal is, and the tangents of its film by the ports' displacement.

A film acts at the Newton ports of its connection: x and y of the journal's middle, and where it feels tilt those of the
journal's end as well. With u̇ following u as (c_v/c_q) u in a stage, and velocities in space along the frame's axes
u̇ + Ω e_z×u, a film's tangents by place and by velocity make one block.
"""

from __future__ import annotations

from cranktrain.core.kernel import inlined_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.film.laws.axial_joint import SLIP, WINDUP_TORQUE
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, END_X, END_Y, FRICTION, X, Y


@inlined_kernel
def film_block(out, ratio, whirl, block):
    """Tangent of a film by the displacement of its ports into the 4 × 4 ``block``; zero where it feels no tilt."""
    for r in range(4):
        for pair in range(0, 4, 2):
            i = 4 * r + pair
            d_x = out[BY_VELOCITY + i]
            d_y = out[BY_VELOCITY + i + 1]
            block[i] = out[BY_PLACE + i] + ratio * d_x + whirl * d_y
            block[i + 1] = out[BY_PLACE + i + 1] + ratio * d_y - whirl * d_x


@inlined_kernel
def place_journal(connection, u, ud, whirl, place, velocity):
    """Middle and end displacement of a journal (4,), and their velocity in space along the frame's axes (4,)."""
    k = int(connection[at.FIRST])
    place_pair(u[k], u[k + 1], ud[k], ud[k + 1], whirl, place, velocity)
    if connection[at.COUPLED] > END_X:
        k = int(connection[at.FIRST + END_X])
        place_pair(u[k], u[k + 1], ud[k], ud[k + 1], whirl, place[END_X:], velocity[END_X:])


@inlined_kernel
def place_pair(x, y, vx, vy, whirl, place, velocity):
    """One displacement, and its velocity in space."""
    place[X] = x
    place[Y] = y
    velocity[X] = vx - whirl * y
    velocity[Y] = vy + whirl * x


@inlined_kernel
def journal_forces(connection, frame, out, u, f):
    """Hand a film's forces ``out`` to the ports f (m,) of its journal; returns the journal's torque, with friction.

    u (m,) are the displacements of the ports: forces act where the displaced points are. The torque is about the
    crank's axis.
    """
    k = int(connection[at.FIRST])
    f[k] = out[X]
    f[k + 1] = out[Y]
    torque = (u[k] - frame[at.CRANK_X]) * out[Y] - (u[k + 1] - frame[at.CRANK_Y]) * out[X]
    if connection[at.COUPLED] > END_X:
        k = int(connection[at.FIRST + END_X])
        f[k] = out[END_X]
        f[k + 1] = out[END_Y]
        torque = torque + u[k] * out[END_Y] - u[k + 1] * out[END_X]
    return torque + out[FRICTION]


@inlined_kernel
def place_joint(model, frame, u, ud):
    """Slip of the axial joint, its velocity, and the torque of the drive line's springs at the ports' motion."""
    joint = model.axial_joint
    k = int(model.connections[int(model.layout[at.AXIAL_JOINT]), at.FIRST])
    windup = u[int(model.layout[at.WINDUP])] + model.scalars[at.WINDUP_LEAD] * frame[at.LEAD]
    joint.place[0, SLIP] = u[k]
    joint.place[0, WINDUP_TORQUE] = model.scalars[at.WINDUP_K] * windup
    joint.velocity[0, SLIP] = ud[k]
