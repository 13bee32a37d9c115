"""Correction of the Newton matrix for pins on a crank that has rotated relative to its frame.

A pin's position is X + R(φ) X − X + u − φ e_z×X, with u its port's displacement, φ its rotation relative to the frame
and X its undeformed position. The modes hold e_z×X φ, so the port moves along the tangent at X. The pin moves along its
circle, so it moves by an additional

    a δφ,    a = (R(φ) − I) e_z×X

and its force f adds the torque a·f on the crank. Rod and film move by δu + a δφ. With H the compliance of the ports,
that of rod and film is H + a H_φ· + H_·φ aᵀ + a H_φφ aᵀ. Without this the Newton matrix takes the fraction φ of radial
motion for tangential motion. If the crank turns freely and a big end's film is stiff, the iteration then diverges, as
for a low-speed engine whose crank is 0.8 degrees ahead of its frame. Up to ``LEAST_TURN``, and with rigid big ends, the
correction is left out, because rods alone are soft.
"""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.crank_pin import turn

LEAST_TURN = 2.0e-3
"""Least rotation of the crank relative to its frame (rad) for which the Newton matrix is corrected."""


@inlined_kernel
def turned(work):
    """True if the Newton matrix is corrected for pins on a crank that has rotated relative to its frame."""
    return work.turned.shape[0] > 0 and (work.turned[0, 0] != 0.0 or work.turned[0, 1] != 0.0)


@kernel
def turn_pins(model, work):
    """Write the vector a of each pin to ``work.turned`` (c, 2).

    All are 0 if the crank has hardly turned, if big ends are rigid, and with components of terms, which may use the
    port of a pin.
    """
    phi = 0.0
    if work.turned.shape[0] > 0 and model.cylinders[0, at.END_PORT] >= 0.0 and model.links.scales.shape[0] == 0:
        phi = work.port[at.U, int(model.cylinders[0, at.PIN_TURN])]
    for c in range(work.turned.shape[0]):
        work.turned[c, 0] = 0.0
        work.turned[c, 1] = 0.0
        if abs(phi) > LEAST_TURN:
            cos, sin = turn(work.port[at.U, int(model.cylinders[c, at.PIN_TURN])])
            x, y = model.pins[c, 0], model.pins[c, 1]
            work.turned[c, 0] = (1.0 - cos) * y - sin * x
            work.turned[c, 1] = (cos - 1.0) * x - sin * y


@kernel
def turned_step(model, work, step):
    """Convert a ``step`` (m,) of all ports to the motion of rods and films, in place at the pins."""
    for c in range(work.turned.shape[0]):
        pin, rotation = int(model.cylinders[c, at.PIN_PORT]), int(model.cylinders[c, at.PIN_TURN])
        step[pin] += work.turned[c, 0] * step[rotation]
        step[pin + 1] += work.turned[c, 1] * step[rotation]


@kernel
def turned_torque(model, work, change):
    """Add the torques a·f about the crank's axis, by forces on turned pins, to a change of forces (m,)."""
    for c in range(work.turned.shape[0]):
        pin, rotation = int(model.cylinders[c, at.PIN_PORT]), int(model.cylinders[c, at.PIN_TURN])
        change[rotation] += work.turned[c, 0] * change[pin] + work.turned[c, 1] * change[pin + 1]


@kernel
def turned_compliance(model, work, turning, compliance, n, out):
    """Compliance (n, n) of rods and films, transposed, from the compliances of Newton ports and of rotating ports."""
    for k in range(n):
        for i in range(n):
            out[k, i] = compliance[k, i]
    for c in range(work.turned.shape[0]):
        pin, rotation = int(model.cylinders[c, at.PIN_PORT]), int(model.cylinders[c, at.PIN_TURN])
        for j in range(2):
            share = work.turned[c, j]
            for k in range(n):
                out[k, pin + j] += share * turning[k, rotation]
                out[pin + j, k] += share * turning[rotation, k]
            for d in range(work.turned.shape[0]):
                other, own = int(model.cylinders[d, at.PIN_PORT]), int(model.cylinders[d, at.PIN_TURN])
                for i in range(2):
                    out[other + i, pin + j] += share * work.turned[d, i] * turning[own, rotation]
