"""Pins on a crank that has turned against its frame: what a Newton step in its rotation moves besides.

A pin's place is X + R(φ) X − X + u − φ e_z×X, with u its port's displacement, φ its rotation against the frame and X
its place in it. The modes hold e_z×X φ, so the port moves along the tangent at X. The pin moves along its circle, by

    a δφ,    a = (R(φ) − I) e_z×X

more, and its force f turns the crank by a·f more. Rod and film feel δu + a δφ. With H the compliance of the ports,
theirs is H + a H_φ· + H_·φ aᵀ + a H_φφ aᵀ. Without it the Newton matrix takes radial for tangential motion by the share
φ. Where the crank turns freely and a big end's film is stiff the iteration then diverges, as that of a low-speed engine
whose crank is 0.8 degrees ahead of its frame. Up to ``LEAST_TURN``, and where big ends are rigid, this is left to the
iteration: rods alone are soft.
"""

from __future__ import annotations

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import has_additions
from cranktrain.dynamics.motion.rod_motion import turn

LEAST_TURN = 2.0e-3
"""Rotation of the crank against its frame (rad) from which the Newton matrix knows of it."""


@inlined_kernel
def turned(work):
    """Whether the Newton matrix knows of turned pins."""
    return work.turned.shape[0] > 0 and (work.turned[0, 0] != 0.0 or work.turned[0, 1] != 0.0)


@kernel
def turn_pins(model, work):
    """Write a of each pin, (c, 2).

    All are 0 where the crank has hardly turned, where big ends are rigid, and beside added bodies, whose connections
    may hold a pin by its port.
    """
    phi = 0.0
    if work.turned.shape[0] > 0 and model.cylinders[0, at.END_PORT] >= 0.0 and not has_additions(model):
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
    """Turn a change of all ports (m,) into what rods and films feel, in place at the pins."""
    for c in range(work.turned.shape[0]):
        pin, rotation = int(model.cylinders[c, at.PIN_PORT]), int(model.cylinders[c, at.PIN_TURN])
        step[pin] += work.turned[c, 0] * step[rotation]
        step[pin + 1] += work.turned[c, 1] * step[rotation]


@kernel
def turned_torque(model, work, change):
    """Add to a change of forces (m,) the torques about the crank's axis that those on turned pins have besides."""
    for c in range(work.turned.shape[0]):
        pin, rotation = int(model.cylinders[c, at.PIN_PORT]), int(model.cylinders[c, at.PIN_TURN])
        change[rotation] += work.turned[c, 0] * change[pin] + work.turned[c, 1] * change[pin + 1]


@kernel
def turned_compliance(model, work, turning, compliance, n, out):
    """Compliance (n, n) that rods and films feel, from that of n Newton ports and all ``turning`` ones, transposed."""
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
