"""Films at the ports of a stage: where a journal is, and the tangents of its film by the ports' displacement.

A film acts at the Newton ports of its connection: x and y of the journal's middle, and where it feels tilt those of the
journal's end as well. With u̇ following u as (c_v/c_q) u in a stage, and velocities in space along the frame's axes
u̇ + Ω e_z×u, a film's tangents by place and by velocity make one block.
"""

from __future__ import annotations

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model.slots import COUPLED, FIRST
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, FRICTION


@kernel
def film_block(out, size, ratio, whirl, block):
    """Tangent of a film by the displacement of its ``size`` ports, 2 or 4, into the 4 × 4 ``block``."""
    for r in range(size):
        for pair in range(0, size, 2):
            i = 4 * r + pair
            d_x = out[BY_VELOCITY + i]
            d_y = out[BY_VELOCITY + i + 1]
            block[i] = out[BY_PLACE + i] + ratio * d_x + whirl * d_y
            block[i + 1] = out[BY_PLACE + i + 1] + ratio * d_y - whirl * d_x


@kernel
def place_journal(connection, u, ud, whirl, place, velocity):
    """Middle and end displacement of a journal (4,), and their velocity in space along the frame's axes (4,)."""
    for j in range(0, int(connection[COUPLED]), 2):
        k = int(connection[FIRST + j])
        x = u[k]
        y = u[k + 1]
        place[j] = x
        place[j + 1] = y
        velocity[j] = ud[k] - whirl * y
        velocity[j + 1] = ud[k + 1] + whirl * x


@kernel
def journal_forces(connection, out, u, f):
    """Hand a film's forces ``out`` to the ports f (m,) of its journal; returns the journal's torque, with friction.

    u (m,) are the displacements of the ports: forces act where the displaced points are.
    """
    torque = 0.0
    for j in range(0, int(connection[COUPLED]), 2):
        k = int(connection[FIRST + j])
        f[k] = out[j]
        f[k + 1] = out[j + 1]
        torque += u[k] * out[j + 1]
        torque -= u[k + 1] * out[j]
    return torque + out[FRICTION]
