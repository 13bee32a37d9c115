"""Response of a rigid engine on its mounts to its excitation, by order at constant speeds.

With the excitation a_k of order k at the angular frequency ω = kΩ the centre moves by q_k,

    [K(ω) − ω² M + iωΩ G] q_k = a_k

G has the angular momentum of the rotating parts over the speed. A mount presses on the frame with K_j(ω) x_j in each of
its components x_j.
"""

from typing import NamedTuple

import numpy as np

from cranktrain.core.types import Array
from cranktrain_lab.mounts.body import RigidEngine
from cranktrain_lab.mounts.stiffness import DIRECTIONS, Complex, Support


class Response(NamedTuple):
    """Amplitudes of s speeds and o orders with j mounts.

    Attributes
    ----------
    centre : (s, o, 6) displacement (m) of the centre and rotation (rad) about it
    mounts : (s, o, j, 6) forces (N) and moments (N m) of each mount on the frame
    frame : (s, o, 6) sum of all forces, and their moment about the engine's centre at rest
    """

    centre: Complex
    mounts: Complex
    frame: Complex


def gyroscopic(body: RigidEngine) -> Array:
    """Matrix G (6, 6), kg m²: of the moments that rotating parts add per speed of the crank and rate of rotation."""
    found = np.zeros((DIRECTIONS, DIRECTIONS))
    found[3, 4], found[4, 3] = body.spin, -body.spin
    return found


def response(body: RigidEngine, support: Support, speeds: Array, orders: Array, forces: Complex) -> Response:
    """Response at speeds (s,), rad/s, and orders (o,) to ``forces`` (s, o, 6) on the centre, N and N m."""
    shape = (speeds.size, orders.size)
    centre = np.zeros((*shape, DIRECTIONS), dtype=np.complex128)
    mounts = np.zeros((*shape, len(support.motion)), dtype=np.complex128)
    turning = gyroscopic(body)
    for s, speed in enumerate(speeds):
        for o, order in enumerate(orders):
            omega = float(order * speed)
            matrix = support.whole(omega) - omega**2 * body.mass + 1j * omega * speed * turning
            centre[s, o] = np.linalg.solve(matrix, forces[s, o])
            mounts[s, o] = support.at(omega) * (support.motion @ centre[s, o])
    frame = mounts @ support.motion
    return Response(centre, mounts.reshape(*shape, -1, DIRECTIONS), frame)
