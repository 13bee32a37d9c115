"""Piston and liner: a rigid piston carried across the cylinder by two layers of springs on its skirt.

The piston moves across by x (its axis at the height of the pin) and tilts by τ about the crank's direction. A layer at
the height y_j above the pin meets the liner's wall, whose position there is w_j, with

    gap_j = x − τ y_j − w_j,     F_j = −k_j s(gap_j) − c_j gap_j'

where s is the gap itself, or, with skirt clearance, the part of the gap beyond the clearance (a parabola of width
``SMOOTH`` clearances joins both). The rod pushes the pin across with N and lifts it by L; gas and inertia along the
cylinder press on the piston's axis, so a pin offset e tilts it:

    (m_p + m_s) x'' − m_p y_c τ''         = N + F_1 + F_2
    −m_p y_c x'' + (J + m_p y_c²) τ''     = −y_1 F_1 − y_2 F_2 + e (L − m_s a_P) + m_p y_c τ a_P

with m_s the rod's small end and y_c the height of the piston's centre of mass. Friction along the liner is
μ (|F_1| + |F_2|) tanh(v/v_0) against the piston's velocity. Terms of second order in the tilt are left out. Without
springs (a piston locked on its axis) the liner takes N where the pin is.
"""

from __future__ import annotations

import math

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.core.reduced_body import Array
from cranktrain.engine.parts import PistonGuidance, Skirt

# Columns of the parameters.
STIFFNESS, HEIGHT, DAMPING, CLEARANCE, FRICTION, SLIDING, UNBALANCE = 0, 2, 4, 6, 7, 8, 9
SMOOTH = 0.1
"""Width of the parabola between free play and contact, in clearances."""
SMALL_FORCE = 10.0
"""Force (N) below which the friction's |F| is round."""


def skirt_parameters(skirt: Skirt) -> Array:
    """Pack a piston's skirt for the kernels, (9,): the upper layer first."""
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
    """Pack a piston's guidance for the kernels, (10,): its skirt, then its mass times the height of that."""
    return np.append(skirt_parameters(guidance), piston_mass * guidance.mass_height)


def piston_mass_matrix(guidance: PistonGuidance, piston_mass: float, small_end_mass: float) -> Array:
    """Mass of a piston with the rod's small end in x and τ, (2, 2)."""
    arm = guidance.mass_height
    coupling = -piston_mass * arm
    return np.array(
        [[piston_mass + small_end_mass, coupling], [coupling, guidance.tilt_inertia + piston_mass * arm * arm]]
    )


def piston_modes(mass: Array) -> Array:
    """Shapes (2, 2) of x and τ in modes of unit mass, from the mass in x and τ."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(mass)).T)


@kernel
def layer_force(p, layer, gap, rate, out):
    """Force F_j on the piston, ``out[0]``, with ∂F/∂gap and ∂F/∂rate in ``out[1:3]``."""
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
    """Friction on the piston along the cylinder (N), upwards positive, at side forces of both layers and its speed."""
    if p[FRICTION] == 0.0:
        return 0.0
    normal = math.sqrt(upper * upper + SMALL_FORCE * SMALL_FORCE) - SMALL_FORCE
    normal += math.sqrt(lower * lower + SMALL_FORCE * SMALL_FORCE) - SMALL_FORCE
    return -p[FRICTION] * normal * math.tanh(velocity / p[SLIDING])
