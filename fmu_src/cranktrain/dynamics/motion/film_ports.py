"""Films at the ports of a stage: where a journal stands, and the tangents of its film by the ports' displacement.

With u̇ following u as (c_v/c_q) u in a stage, and velocities in space along the frame's axes u̇ + Ω e_z×u, a film's
tangents by place and by velocity make one block.
"""

from __future__ import annotations

from cranktrain.core.kernel import kernel
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY


@kernel
def plane_block(out, ratio, whirl, block):
    """Tangent of a film in the plane by its ports' displacement, (2, 2) into the 4 × 4 block."""
    block[0] = out[2] + ratio * out[6] + whirl * out[7]
    block[1] = out[3] + ratio * out[7] - whirl * out[6]
    block[4] = out[4] + ratio * out[8] + whirl * out[9]
    block[5] = out[5] + ratio * out[9] - whirl * out[8]


@kernel
def space_block(out, ratio, whirl, block):
    """Tangent of a film that feels tilt by its ports' displacement, (4, 4)."""
    for r in range(4):
        for pair in range(0, 4, 2):
            i = 4 * r + pair
            d_x = out[BY_VELOCITY + i]
            d_y = out[BY_VELOCITY + i + 1]
            block[i] = out[BY_PLACE + i] + ratio * d_x + whirl * d_y
            block[i + 1] = out[BY_PLACE + i + 1] + ratio * d_y - whirl * d_x


@kernel
def place_journal(u, ud, port, tilt, whirl, place, velocity):
    """Middle and end displacement of a journal (4,), and their velocity in space along the frame's axes (4,)."""
    for pair in range(2):
        k = port if pair == 0 else tilt
        x = u[k]
        y = u[k + 1]
        place[2 * pair] = x
        place[2 * pair + 1] = y
        velocity[2 * pair] = ud[k] - whirl * y
        velocity[2 * pair + 1] = ud[k + 1] + whirl * x
