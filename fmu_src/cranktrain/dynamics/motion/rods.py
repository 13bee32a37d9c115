"""Rods and pistons between pins and liners: what they do to crank, pistons and block.

Rod and piston are eliminated onto the pin, or onto the big end where that floats. A guided piston's motion across its
cylinder is found here, at each evaluation, from the pin's and the liner's: two unknowns that nothing else feels, so
they need no place in the stage's Newton iteration.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model.slots import (
    AREA,
    BANK,
    COS,
    CRANKCASE,
    DELTA_J,
    FORCES,
    GRAVITY,
    LINERS,
    M_BIG,
    M_OSC,
    M_SMALL,
    OFFSET,
    OMEGA,
    OMEGA_DOT,
    PIN_ROTATIONS,
    PISTONS,
    ROD,
    ROD_LAWS,
    RODS,
    SIN,
    STATE_U,
    STATE_UD,
    STATE_UDD,
    THETA,
    U_FREE,
    U_Q,
    U_V,
    UD,
    UDD,
    U,
)
from cranktrain.dynamics.motion.film_ports import film_block
from cranktrain.film.laws.films import ANGLE as FRAME_ANGLE
from cranktrain.film.laws.films import COS as FRAME_COS
from cranktrain.film.laws.films import FORCE, FRICTION, RUBBING, SPEED, film_call
from cranktrain.film.laws.films import SIN as FRAME_SIN
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

# Motion of a point in a plane, six values from X on; a pin's is followed by how far it moved, and by the share
# (R(φ) − I) X of turning alone.
X, Y, VX, VY, AX, AY, MOVED, ARM = 0, 1, 2, 3, 4, 5, 6, 8
# Where in the scratch memory a pin's motion, a rod's in axes of its cylinder, and its piston lie, clear of rod_force's
# results.
PIN, CROSS, SIDE = 16, 24, 48
# What :func:`piston_forces` writes: force across and moment on the piston, their derivatives by gap and rate of the
# upper and the lower layer, the layers' forces, friction along the cylinder, and what liner and gas do to the piston:
# force across and along the cylinder's axis at rest, and its moment about the crank's axis.
ACROSS, MOMENT, UPPER_BY_GAP, UPPER_BY_RATE, LOWER_BY_GAP, LOWER_BY_RATE = 0, 1, 2, 3, 5, 6
UPPER, LOWER, FRICTION_ALONG, LINER_ACROSS, LINER_ALONG, LINER_MOMENT = range(7, 13)
LAYER = 3
"""Values that a layer's law writes: force, and its derivatives by gap and rate."""
ROW = 4
"""Values in a row of a connection's block."""
OBSERVING = 3
"""Evaluations after which side forces and friction at a known motion agree."""
PISTON_STEPS = 12
PISTON_TOLERANCE = 1.0e-15
"""Newton steps of a guided piston at most, and the motion (m) at which they end."""


class RodLoad(NamedTuple):
    """What a rod and its piston are given besides their motion; axes of the cylinder."""

    cylinder: int
    gas: float  # gauge pressure times piston area, N
    torque: float  # side force that keeps the big end's friction on the rod, N
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
def rod_forces(model, work, frame, pressures, c_q, c_v):
    """Add the rods' forces to pins, big ends, pistons and liners, and fill their tangents at pins and big ends.

    The ports' motion and forces are rows of ``work.port``. Returns 0, or tells that a law failed.
    """
    b = model.bearings.shape[0]
    u = work.port[U]
    ud = work.port[UD]
    udd = work.port[UDD]
    f = work.port[FORCES]
    out = work.scratch
    free = model.layout[RODS] > 0.0
    status = 0
    for c in range(model.cylinders.shape[0]):
        rod = model.cylinders[c]
        cos = math.cos(frame[THETA] - rod[BANK])
        sin = math.sin(frame[THETA] - rod[BANK])
        pin_motion(model, frame, c, u, ud, udd, out)
        moved_x = out[MOVED]
        moved_y = out[MOVED + 1]
        port = 2 * b + 1 + 2 * c
        block = work.blocks[b + c]
        torque = 0.0
        if free:
            port = int(model.layout[RODS]) + 2 * c
            block = work.blocks[int(model.layout[ROD_LAWS]) + c]
            for j in range(MOVED):
                out[PIN + j] = out[j]
            big_end_motion(model, frame, c, u, ud, udd, out)
            torque, failure = big_end_film(model, work, frame, c, cos, sin, c_v / c_q)
            status |= failure
        load = rod_load(rod, model.scalars, c, pressures[c], torque)
        across_cylinder(out, cos, sin, work.scratch[CROSS:])
        if model.layout[PISTONS] > 0.0:
            guided_rod(model, work, load, c_q, c_v)
        else:
            rod_on_axis(rod, load, work.scratch[CROSS:], out)
            # Friction that turns the rod is held by the piston's guide, a couple with the big end.
            out[0] += torque
        fx = cos * out[0] + sin * out[1]
        fy = cos * out[1] - sin * out[0]
        pin_block(out, frame, cos, sin, c_q, c_v, block)
        rotation = int(model.layout[PIN_ROTATIONS]) + c
        lever_x = model.pins[c, 0] + moved_x
        lever_y = model.pins[c, 1] + moved_y
        if rotation < model.scales.shape[0]:
            f[rotation] += lever_x * fy - lever_y * fx
            # The pin goes along its circle, and the force keeps its direction.
            block[0] = lever_y * (lever_y * block[0] - lever_x * block[1])
            block[0] += lever_x * (lever_x * block[ROW + 1] - lever_y * block[ROW]) - lever_x * fx - lever_y * fy
        else:
            f[port] += fx
            f[port + 1] += fy
            if not free:
                f[rotation] += moved_x * fy - moved_y * fx
    return status


@inlined_kernel
def rod_load(rod, scalars, c, pressure, torque):
    """What rod and piston of cylinder c are given."""
    g = scalars[GRAVITY]
    gas = (pressure - scalars[CRANKCASE]) * rod[AREA]
    return RodLoad(c, gas, torque, g * math.sin(rod[BANK]), g * math.cos(rod[BANK]))


@inlined_kernel
def across_cylinder(motion, cos, sin, cross):
    """Turn a motion, six values, into axes of a cylinder that stands at the angle given by cosine and sine."""
    for j in range(X, MOVED, 2):
        cross[j] = cos * motion[j] - sin * motion[j + 1]
        cross[j + 1] = sin * motion[j] + cos * motion[j + 1]


@inlined_kernel
def rod_on_axis(rod, load, cross, out):
    """Rod whose piston runs on the axis of its cylinder; ``out`` as of rod_force."""
    rod_force(
        cross[X], cross[Y], cross[VX], cross[VY], cross[AX], cross[AY], load.gas, rod[ROD], rod[M_BIG], rod[M_OSC],
        rod[DELTA_J], rod[OFFSET], load.g_x, load.g_y, out,
    )  # fmt: skip


@inlined_kernel
def pin_block(out, frame, cos, sin, c_q, c_v, block):
    """Tangent of a rod's force by its pin's displacement in a stage, from rod_force's, in the frame's axes (2 × 2)."""
    ratio = c_v / c_q
    omega = frame[OMEGA]
    alpha = 1.0 / c_q - omega * omega
    beta = 2.0 * omega * ratio + frame[OMEGA_DOT]
    x = BY_X
    v = BY_VX
    a = BY_ACCELERATION
    t_xx = out[x] + out[v] * ratio + out[a] * alpha + out[a + 1] * beta
    t_xy = -out[v] * omega + out[a + 1] * alpha - out[a] * beta
    t_yx = out[x + 1] + out[v + 1] * ratio + out[a + 2] * alpha + out[a + 3] * beta
    t_yy = -out[v + 1] * omega + out[a + 3] * alpha - out[a + 2] * beta
    # Turn the block back: Rᵀ T R.
    block[0] = cos * cos * t_xx + cos * sin * (t_xy + t_yx) + sin * sin * t_yy
    block[1] = cos * cos * t_xy + cos * sin * (t_yy - t_xx) - sin * sin * t_yx
    block[ROW] = cos * cos * t_yx + cos * sin * (t_yy - t_xx) - sin * sin * t_xy
    block[ROW + 1] = cos * cos * t_yy - cos * sin * (t_xy + t_yx) + sin * sin * t_xx


@inlined_kernel
def upper_share(model, c, height):
    """Share of a side force at ``height`` along the cylinder that the liner's upper ring takes."""
    lower = model.block.liners[c, 1]
    return (height - lower) / (model.block.liners[c, 0] - lower)


@kernel
def guided_rod(model, work, load, c_q, c_v):
    """Rod whose piston moves between the guiding springs; ``work.scratch`` as of rod_force, and its CROSS as given.

    Solves M (x, τ)'' = F of the piston at the pin's motion and the liner's; the forces go to the piston's and the
    liner's ports, the motion that was found to the piston's.
    """
    c = load.cylinder
    out = work.scratch
    side = work.scratch[SIDE:]
    cross = work.scratch[CROSS:]
    rod = model.cylinders[c]
    u = work.port[U]
    u_q = work.port[U_Q]
    u_v = work.port[U_V]
    port = int(model.layout[PISTONS]) + 2 * c
    # Side forces and friction go on from the stage's last evaluation.
    for j in range(LAYER):
        side[UPPER + j] = work.guides[c, j]
    for _ in range(PISTON_STEPS):
        x = u[port]
        x_a = (x - u_q[port]) / c_q
        t = u[port + 1]
        t_v = u_v[port + 1] + c_v * (t - u_q[port + 1]) / c_q
        piston = PistonMotion(x, u_v[port] + c_v * x_a, x_a, t, t_v)
        piston_forces(model, load, piston, u, work.port[UD], cross, out, side)
        move_x, move_t = piston_step(model, work, port, piston, c_q, c_v, side)
        u[port] = x + move_x
        u[port + 1] = t + move_t
        if abs(move_x) + abs(move_t) * rod[ROD] < PISTON_TOLERANCE:
            break
    for j in range(LAYER):
        work.guides[c, j] = side[UPPER + j]
    f = work.port[FORCES]
    f[port] = side[ACROSS]
    f[port + 1] = side[MOMENT]
    if model.layout[LINERS] > 0.0:
        # The opposite of what liner and gas do to the piston: same force, same moment about the crank's axis.
        k = int(model.layout[LINERS]) + 3 * c
        upper = model.block.liners[c, 0]
        lower = model.block.liners[c, 1]
        push = (side[LINER_MOMENT] + lower * side[LINER_ACROSS]) / (upper - lower)
        f[k] += push
        f[k + 1] -= side[LINER_ACROSS] + push
        f[k + 2] -= side[LINER_ALONG] + load.gas
    # The pin feels the rod and its big end.
    out[0] += load.torque - rod[M_BIG] * (cross[AX] + load.g_x)
    out[1] -= rod[M_BIG] * (cross[AY] + load.g_y)
    out[BY_ACCELERATION] -= rod[M_BIG]
    out[BY_ACCELERATION + 3] -= rod[M_BIG]


@kernel
def piston_step(model, work, port, piston, c_q, c_v, side):
    """Newton step of a guided piston's x and τ, from its forces in ``side`` and the rod's in ``work.scratch``."""
    out = work.scratch
    law = model.block.guidance
    inverse = model.block.piston_inverse
    u_free = work.port[U_FREE]
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
    """Forces on a guided piston at its motion into ``side``; ``out`` as of rod_force without big end.

    ``side[UPPER:]`` holds the layers' forces and the friction of the last evaluation. Gas and friction act along the
    liner, its springs square to it, wherever it leans: an engine on soft mounts leans by a degree, and 100 kN of gas
    have then 2 kN across.
    """
    c = load.cylinder
    rod = model.cylinders[c]
    law = model.block.guidance
    liner = int(model.layout[LINERS]) + 3 * c
    slope = 0.0
    if model.layout[LINERS] > 0.0:
        slope = (u[liner] - u[liner + 1]) / (model.block.liners[c, 0] - model.block.liners[c, 1])
    # Friction and lean follow the side forces found last; a step of the iteration later they agree.
    push = load.gas - side[FRICTION_ALONG]
    down = push + slope * (side[UPPER] + side[LOWER])
    rod_force(
        cross[X] - piston.x, cross[Y], cross[VX] - piston.x_v, cross[VY], cross[AX] - piston.x_a, cross[AY],
        down, rod[ROD], 0.0, rod[M_OSC], rod[DELTA_J], rod[OFFSET], 0.0, load.g_y, out,
    )  # fmt: skip
    force = -out[0] - load.torque - slope * push
    weight = out[PISTON_ACCELERATION] + load.g_y
    moment = weight * (law[UNBALANCE] * piston.t - rod[OFFSET] * rod[M_SMALL]) - rod[OFFSET] * out[1]
    side[LINER_ACROSS] = -slope * push
    side[LINER_ALONG] = -down
    side[LINER_MOMENT] = out[PISTON] * slope * push - piston.x * down
    for layer in range(2):
        height = law[HEIGHT + layer]
        gap = piston.x - piston.t * height
        rate = piston.x_v - piston.t_v * height
        if model.layout[LINERS] > 0.0:
            share = upper_share(model, c, out[PISTON] + height)
            gap -= share * u[liner] + (1.0 - share) * u[liner + 1]
            rate -= share * ud[liner] + (1.0 - share) * ud[liner + 1] + slope * out[PISTON_VELOCITY]
        # Its force lies where the moment comes, or between both layers' tangents, until it is read.
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


@kernel
def observe_rod(model, work, c):
    """Rod and piston of cylinder c at the state, whose cylinder pressures stand in ``work.pressures[0]``.

    Fills ``work.scratch`` as of rod_force with the big end, but for friction in it; ``[SIDE + UPPER] + [SIDE + LOWER]``
    force of the liner on the piston across the cylinder, ``[SIDE + FRICTION_ALONG]`` along it.
    """
    rod = model.cylinders[c]
    frame = work.frames[0]
    out = work.scratch
    side = work.scratch[SIDE:]
    cross = work.scratch[CROSS:]
    u = work.port[STATE_U]
    ud = work.port[STATE_UD]
    udd = work.port[STATE_UDD]
    load = rod_load(rod, model.scalars, c, work.pressures[0, c], 0.0)
    rod_end(model, frame, c, u, ud, udd, out)
    across_cylinder(out, math.cos(frame[THETA] - rod[BANK]), math.sin(frame[THETA] - rod[BANK]), cross)
    for j in range(LAYER):
        side[UPPER + j] = 0.0
    if model.layout[PISTONS] == 0.0:
        rod_on_axis(rod, load, cross, out)
        side[UPPER] = out[0] + rod[M_BIG] * (cross[AX] + load.g_x) + rod[M_OSC] * load.g_x
        return
    k = int(model.layout[PISTONS]) + 2 * c
    piston = PistonMotion(u[k], ud[k], udd[k], u[k + 1], ud[k + 1])
    for _ in range(OBSERVING):
        piston_forces(model, load, piston, u, ud, cross, out, side)
    out[0] -= rod[M_BIG] * (cross[AX] + load.g_x)
    out[1] -= rod[M_BIG] * (cross[AY] + load.g_y)


@kernel
def big_end_film(model, work, frame, c, cos, sin, ratio):
    """Film between pin and free big end of cylinder c, from the motions in scratch, the pin's from PIN on.

    Adds its forces to pin, rod and pin rotation, and fills its tangent; returns the side force that holds its friction
    on the rod, and 0 or what tells that the law failed.
    """
    rod = work.scratch
    pin = work.scratch[PIN:]
    f = work.port[FORCES]
    out = model.floating.out
    turn = int(model.layout[PIN_ROTATIONS]) + c
    height, rod_speed = rod_swing(model.cylinders[c], rod, cos, sin)
    place_pin(model, c, pin, rod)
    status = float_force(model, frame, c, FORCE, frame[OMEGA] + work.port[UD, turn], rod_speed)
    friction = out[FRICTION]
    k = 2 * model.bearings.shape[0] + 1 + 2 * c
    f[k] += out[0]
    f[k + 1] += out[1]
    k = int(model.layout[RODS]) + 2 * c
    f[k] -= out[0]
    f[k + 1] -= out[1]
    f[turn] += (pin[X] - model.pins[c, 0]) * out[1] - (pin[Y] - model.pins[c, 1]) * out[0] + friction
    block = work.blocks[model.bearings.shape[0] + c]
    film_block(out, ratio, frame[OMEGA], block)
    for row in range(2):
        for column in range(2):
            value = block[4 * row + column]
            block[4 * row + column + 2] = -value
            block[4 * (row + 2) + column] = -value
            block[4 * (row + 2) + column + 2] = value
    place = model.floating.place[c]
    return -(friction + place[X] * out[1] - place[Y] * out[0]) / height, status


@kernel
def rod_swing(rod, motion, cos, sin):
    """Height of a rod's small end over its big end (m), and its speed (rad/s): it turns as the big end moves across."""
    side = cos * motion[X] - sin * motion[Y] - rod[OFFSET]
    height = math.sqrt(rod[ROD] * rod[ROD] - side * side)
    return height, (cos * motion[VX] - sin * motion[VY]) / height


@inlined_kernel
def place_pin(model, c, pin, rod):
    """Place and velocity of the pin in the floating big end of cylinder c, from the motions of both."""
    for k in range(2):
        model.floating.place[c, k] = pin[k] - rod[k]
        model.floating.velocity[c, k] = pin[VX + k] - rod[VX + k]


@inlined_kernel
def float_force(model, frame, c, action, pin_speed, rod_speed):
    """Let the law act on the film of the floating big end of cylinder c, into ``floating.out``; 0, or a failure."""
    films = model.floating
    films.numbers[SPEED] = pin_speed + rod_speed
    films.numbers[RUBBING] = pin_speed - rod_speed
    films.numbers[FRAME_COS] = frame[COS]
    films.numbers[FRAME_SIN] = frame[SIN]
    films.numbers[FRAME_ANGLE] = frame[THETA]
    return film_call(films, action, c, films.out, films.out)


@inlined_kernel
def rod_end(model, frame, c, u, ud, udd, out):
    """Motion of what the rod of cylinder c turns about: its big end where that floats, else the pin."""
    if model.layout[RODS] > 0.0:
        big_end_motion(model, frame, c, u, ud, udd, out)
    else:
        pin_motion(model, frame, c, u, ud, udd, out)


@inlined_kernel
def big_end_motion(model, frame, c, u, ud, udd, out):
    """Position, absolute velocity and acceleration of the free big end of cylinder c, in axes of the frame."""
    k = int(model.layout[RODS]) + 2 * c
    absolute_motion(
        model.pins[c, 0] + u[k], model.pins[c, 1] + u[k + 1], ud[k], ud[k + 1], udd[k], udd[k + 1], frame, out
    )


@inlined_kernel
def absolute_motion(x, y, vx, vy, ax, ay, frame, out):
    """Position, absolute velocity and acceleration in frame axes of a point that moves in the turning frame."""
    omega = frame[OMEGA]
    omega_dot = frame[OMEGA_DOT]
    out[X] = x
    out[Y] = y
    out[VX] = vx - omega * y
    out[VY] = vy + omega * x
    out[AX] = ax - 2.0 * omega * vy - omega_dot * y - omega * omega * x
    out[AY] = ay + 2.0 * omega * vx + omega_dot * x - omega * omega * y


@inlined_kernel
def pin_motion(model, frame, c, u, ud, udd, out):
    """Position, absolute velocity and acceleration of the pin under the rod of cylinder c in frame axes.

    From MOVED on ``out`` holds how far it moved, from ARM on the share (R(φ) − I) X of turning alone.
    """
    i = 2 * model.bearings.shape[0] + 1 + 2 * c
    r = int(model.layout[PIN_ROTATIONS]) + c
    x0 = model.pins[c, 0]
    y0 = model.pins[c, 1]
    phi = u[r]
    cos = math.cos(phi)
    sin = math.sin(phi)
    turned_x = cos * x0 - sin * y0
    turned_y = sin * x0 + cos * y0
    arm_x = turned_x - x0
    arm_y = turned_y - y0
    if r < model.scales.shape[0]:
        absolute_motion(
            turned_x, turned_y, -ud[r] * turned_y, ud[r] * turned_x,
            -udd[r] * turned_y - ud[r] * ud[r] * turned_x, udd[r] * turned_x - ud[r] * ud[r] * turned_y, frame, out,
        )  # fmt: skip
        out[MOVED] = arm_x
        out[MOVED + 1] = arm_y
        out[ARM] = arm_x
        out[ARM + 1] = arm_y
        return
    x = turned_x + u[i] + phi * y0
    y = turned_y + u[i + 1] - phi * x0
    absolute_motion(
        x, y, ud[i] - ud[r] * arm_y, ud[i + 1] + ud[r] * arm_x,
        udd[i] - udd[r] * arm_y - ud[r] * ud[r] * turned_x, udd[i + 1] + udd[r] * arm_x - ud[r] * ud[r] * turned_y,
        frame, out,
    )  # fmt: skip
    out[MOVED] = x - x0
    out[MOVED + 1] = y - y0
    out[ARM] = arm_x
    out[ARM + 1] = arm_y
