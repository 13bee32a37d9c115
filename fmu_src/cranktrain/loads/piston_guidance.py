"""Guidance of a rigid piston in its liner by two layers of springs on the skirt.

The piston moves across the cylinder by x (its axis at the height of the pin) and tilts by τ about the direction of the
crank. A layer at the height y_j above the pin acts on the liner's wall, whose position at this height is w_j, with

    gap_j = x − τ y_j − w_j,     F_j = −k_j s(gap_j) − c_j gap_j'

where s is the gap itself or, with skirt clearance, the part of the gap beyond the clearance (with a parabolic
transition of width ``SMOOTH`` clearances). The rod acts on the pin with N across and L along the cylinder; gas and
inertia along the cylinder act on the piston's axis, so a pin offset e gives a tilting moment:

    (m_p + m_s) x'' − m_p y_c τ''         = N + F_1 + F_2
    −m_p y_c x'' + (J + m_p y_c²) τ''     = −y_1 F_1 − y_2 F_2 + e (L − m_s a_P) + m_p y_c τ a_P

with the mass m_s of the rod's small end and the height y_c of the piston's centre of mass. Friction along the liner is
μ (|F_1| + |F_2|) tanh(v/v_0) against the piston's velocity. Terms of second order in the tilt are neglected. Without
springs (a piston locked on its axis) N acts on the liner at the height of the pin.
"""

import math

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.core.reduced_body import Array
from cranktrain.engine.parts import PistonGuidance, Skirt

# Indices of the parameters of a piston's guidance, in the order of :func:`guidance_parameters`.
STIFFNESS, HEIGHT, DAMPING, CLEARANCE, FRICTION, SLIDING, UNBALANCE = 0, 2, 4, 6, 7, 8, 9
SMOOTH = 0.1
"""Width of the parabolic transition from free clearance to contact, in clearances."""
SMALL_FORCE = 10.0
"""Force (N) below which |F| in the friction is smoothed."""


def skirt_parameters(skirt: Skirt) -> Array:
    """Return the parameters of a piston's skirt as kernels read them, (9,), upper layer first."""
    return np.array(
        [
            skirt.upper_stiffness,
            skirt.lower_stiffness,
            skirt.upper_height,
            skirt.lower_height,
            skirt.upper_damping,
            skirt.lower_damping,
            skirt.clearance,
            skirt.friction,
            skirt.sliding_speed,
        ]
    )


def guidance_parameters(guidance: PistonGuidance, piston_mass: float) -> Array:
    """Return the parameters of a piston's guidance, (10,): the skirt, then mass times height of the centre of mass."""
    return np.append(skirt_parameters(guidance), piston_mass * guidance.mass_height)


@kernel
def layer_force(p, layer, gap, rate, out):
    """Compute the force of one spring layer on the piston, ``out[0]``, with ∂F/∂gap and ∂F/∂rate in ``out[1:3]``."""
    k = p[STIFFNESS + layer]
    c = p[DAMPING + layer]
    free = p[CLEARANCE]
    pressed = gap
    slope = 1.0
    if free > 0.0:
        width = SMOOTH * free
        over = abs(gap) - free
        if over <= -width:
            pressed = 0.0
            slope = 0.0
        elif over < width:
            slope = (over + width) / (2.0 * width)
            pressed = 0.5 * slope * (over + width)
        else:
            pressed = over
        if gap < 0.0:
            pressed = -pressed
    out[0] = -k * pressed - c * rate
    out[1] = -k * slope
    out[2] = -c


@kernel
def liner_friction(p, upper, lower, velocity):
    """Return the friction on the piston along the cylinder (N, upwards positive) from side forces and velocity."""
    if p[FRICTION] == 0.0:
        return 0.0
    normal = math.sqrt(upper * upper + SMALL_FORCE * SMALL_FORCE) - SMALL_FORCE
    normal += math.sqrt(lower * lower + SMALL_FORCE * SMALL_FORCE) - SMALL_FORCE
    return -p[FRICTION] * normal * math.tanh(velocity / p[SLIDING])
