"""Guided pistons between the springs of their skirts: motion across the cylinder and tilt in an evaluation of a stage.

These two unknowns act on no other connection. They follow from the motion of pin and liner, so they are not part of the
stage's Newton iteration.
"""

from __future__ import annotations

from typing import NamedTuple

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.rod_motion import AX, AY, CROSS, SIDE, VX, VY, X, Y
from cranktrain.loads.piston_guidance import HEIGHT, UNBALANCE, layer_force, liner_friction
from cranktrain.loads.slider_crank import (
    BY_ACCELERATION,
    BY_VX,
    BY_X,
    PISTON,
    PISTON_ACCELERATION,
    PISTON_VELOCITY,
    rod_force,
)

# Positions of the results of :func:`piston_forces`:
# ACROSS, MOMENT: force across the cylinder and moment on the piston.
# UPPER_BY_GAP to LOWER_BY_RATE: derivatives of the forces of the upper and the lower layer by gap and rate.
# UPPER, LOWER, FRICTION_ALONG: forces of both layers, and friction along the cylinder.
# LINER_ACROSS, LINER_ALONG: resultant of liner and gas on the piston across and along the cylinder's axis at rest.
# LINER_MOMENT: moment of this resultant about the crank's axis.
ACROSS, MOMENT, UPPER_BY_GAP, UPPER_BY_RATE, LOWER_BY_GAP, LOWER_BY_RATE = 0, 1, 2, 3, 5, 6
UPPER, LOWER, FRICTION_ALONG, LINER_ACROSS, LINER_ALONG, LINER_MOMENT = range(7, 13)
LAYER = 3
"""Number of values that the force law of a skirt layer writes: force, and its derivatives by gap and rate."""
PISTON_STEPS = 12
PISTON_TOLERANCE = 1.0e-15
"""Most Newton steps of a guided piston, and the change (m) at which the iteration ends."""


class RodLoad(NamedTuple):
    """Loads of a rod and its piston, apart from their motion, in axes of the cylinder."""

    cylinder: int
    gas: float  # gauge pressure times piston area, N
    torque: float  # side force (N) on the piston that balances the big end's friction torque on the rod
    g_x: float  # gravity's reaction, m/s²
    g_y: float


class PistonMotion(NamedTuple):
    """Motion of a guided piston across its cylinder (m) and in tilt (rad)."""

    x: float
    x_v: float
    x_a: float
    t: float
    t_v: float


@inlined_kernel
def upper_share(model, c, height):
    """Fraction of a side force at ``height`` along the cylinder that the liner's upper ring carries."""
    lower = model.block.liners[c, 1]
    return (height - lower) / (model.block.liners[c, 0] - lower)


@kernel
def guided_rod(model, work, frame, load, c_q, c_v):
    """Solve for a piston between its guiding springs, from CROSS in ``work.scratch``; results are as from rod_force.

    Solves M (x, τ)'' = F of the piston at the motion of pin and liner. The forces are written to the ports of piston
    and liner, the motion found to those of the piston.
    """
    c = load.cylinder
    out = work.scratch
    side = work.scratch[SIDE:]
    cross = work.scratch[CROSS:]
    rod = model.cylinders[c]
    u = work.port[at.U]
    u_q = work.port[at.U_Q]
    u_v = work.port[at.U_V]
    port = int(rod[at.PISTON_PORT])
    # Iteration of side forces and friction starts from the last evaluation of the stage.
    for j in range(LAYER):
        side[UPPER + j] = work.guides[c, j]
    for _ in range(PISTON_STEPS):
        x = u[port]
        x_a = (x - u_q[port]) / c_q
        t = u[port + 1]
        t_v = u_v[port + 1] + c_v * (t - u_q[port + 1]) / c_q
        piston = PistonMotion(x, u_v[port] + c_v * x_a, x_a, t, t_v)
        piston_forces(model, load, piston, u, work.port[at.UD], cross, out, side)
        move_x, move_t = piston_step(model, work, port, piston, c_q, c_v, side)
        u[port] = x + move_x
        u[port + 1] = t + move_t
        if abs(move_x) + abs(move_t) * rod[at.ROD] < PISTON_TOLERANCE:
            break
    for j in range(LAYER):
        work.guides[c, j] = side[UPPER + j]
    f = work.port[at.FORCES]
    f[port] = side[ACROSS]
    f[port + 1] = side[MOMENT]
    if rod[at.LINER_PORT] >= 0.0:
        # Reaction on the block of the forces of liner and gas on the piston, with its moment about the block's axis.
        k = int(rod[at.LINER_PORT])
        upper = model.block.liners[c, 0]
        lower = model.block.liners[c, 1]
        x = frame[at.BLOCK_X] * rod[at.COS_BANK] + frame[at.BLOCK_Y] * rod[at.SIN_BANK]
        y = frame[at.BLOCK_Y] * rod[at.COS_BANK] - frame[at.BLOCK_X] * rod[at.SIN_BANK]
        side[LINER_MOMENT] -= x * side[LINER_ALONG] - y * side[LINER_ACROSS]
        push = (side[LINER_MOMENT] + lower * side[LINER_ACROSS]) / (upper - lower)
        f[k] += push
        f[k + 1] -= side[LINER_ACROSS] + push
        f[k + 2] -= side[LINER_ALONG] + load.gas
    # Force on the pin: rod and its big end.
    out[0] += load.torque - rod[at.M_BIG] * (cross[AX] + load.g_x)
    out[1] -= rod[at.M_BIG] * (cross[AY] + load.g_y)
    out[BY_ACCELERATION] -= rod[at.M_BIG]
    out[BY_ACCELERATION + 3] -= rod[at.M_BIG]


@kernel
def piston_step(model, work, port, piston, c_q, c_v, side):
    """Newton step of a guided piston in x and τ, from piston forces in ``side`` and rod forces in ``work.scratch``."""
    out = work.scratch
    law = model.block.guidance
    inverse = model.block.piston_inverse
    u_free = work.port[at.U_FREE]
    ratio = c_v / c_q
    d_n = out[BY_X] + ratio * out[BY_VX] + out[BY_ACCELERATION] / c_q
    d_u = side[UPPER_BY_GAP] + ratio * side[UPPER_BY_RATE]
    d_l = side[LOWER_BY_GAP] + ratio * side[LOWER_BY_RATE]
    y_u = law[HEIGHT]
    y_l = law[HEIGHT + 1]
    xx = d_n + d_u + d_l
    xt = -y_u * d_u - y_l * d_l
    tt = y_u * y_u * d_u + y_l * y_l * d_l
    # r = u_free + c_q M⁻¹ F − u, and I − c_q M⁻¹ ∂F/∂u.
    r_x = u_free[port] + c_q * (inverse[0, 0] * side[ACROSS] + inverse[0, 1] * side[MOMENT]) - piston.x
    r_t = u_free[port + 1] + c_q * (inverse[1, 0] * side[ACROSS] + inverse[1, 1] * side[MOMENT]) - piston.t
    a = 1.0 - c_q * (inverse[0, 0] * xx + inverse[0, 1] * xt)
    b = -c_q * (inverse[0, 0] * xt + inverse[0, 1] * tt)
    d = -c_q * (inverse[1, 0] * xx + inverse[1, 1] * xt)
    e = 1.0 - c_q * (inverse[1, 0] * xt + inverse[1, 1] * tt)
    determinant = a * e - b * d
    return (e * r_x - b * r_t) / determinant, (a * r_t - d * r_x) / determinant


@kernel
def piston_forces(model, load, piston, u, ud, cross, out, side):
    """Write the forces on a guided piston in motion to ``side``; ``out`` is as from rod_force, without big end.

    ``side[UPPER:]`` holds the layers' forces and the friction of the last evaluation. Gas and friction act along the
    liner and its springs normal to it, also if it leans: an engine on soft mounts leans by a degree, and 100 kN of gas
    then have a component of 2 kN across.
    """
    c = load.cylinder
    rod = model.cylinders[c]
    law = model.block.guidance
    liner = int(rod[at.LINER_PORT])
    slope = 0.0
    rise = 0.0
    rise_rate = 0.0
    if liner >= 0:
        rise = u[liner + 2]
        rise_rate = ud[liner + 2]
        slope = (u[liner] - u[liner + 1]) / (model.block.liners[c, 0] - model.block.liners[c, 1])
    # Friction and the liner's lean use the side forces found last, which agree after one more iteration.
    push = load.gas - side[FRICTION_ALONG]
    down = push + slope * (side[UPPER] + side[LOWER])
    rod_force(
        cross[X] - piston.x, cross[Y], cross[VX] - piston.x_v, cross[VY], cross[AX] - piston.x_a, cross[AY],
        down, rod[at.ROD], 0.0, rod[at.M_OSC], rod[at.DELTA_J], rod[at.OFFSET], 0.0, load.g_y, out,
    )  # fmt: skip
    force = -out[0] - load.torque - slope * push
    weight = out[PISTON_ACCELERATION] + load.g_y
    moment = weight * (law[UNBALANCE] * piston.t - rod[at.OFFSET] * rod[at.M_SMALL]) - rod[at.OFFSET] * out[1]
    side[LINER_ACROSS] = -slope * push
    side[LINER_ALONG] = -down
    side[LINER_MOMENT] = out[PISTON] * slope * push - piston.x * down
    for layer in range(2):
        height = law[HEIGHT + layer]
        gap = piston.x - piston.t * height
        rate = piston.x_v - piston.t_v * height
        if liner >= 0:
            # Position of the piston along the liner, which has moved itself.
            share = upper_share(model, c, out[PISTON] + height - rise)
            gap -= share * u[liner] + (1.0 - share) * u[liner + 1]
            rate -= share * ud[liner] + (1.0 - share) * ud[liner + 1] + slope * (out[PISTON_VELOCITY] - rise_rate)
        # The layer's force is stored temporarily in the slot of the moment, or in a free slot between the tangents.
        layer_force(law, layer, gap, rate, side[MOMENT + LAYER * layer :])
        pressing = side[MOMENT + LAYER * layer]
        side[UPPER + layer] = pressing
        side[LINER_ACROSS] += pressing
        side[LINER_MOMENT] -= (out[PISTON] + height) * pressing
        force += pressing
        moment -= height * pressing
    side[FRICTION_ALONG] = liner_friction(law, side[UPPER], side[LOWER], out[PISTON_VELOCITY])
    side[ACROSS] = force
    side[MOMENT] = moment
