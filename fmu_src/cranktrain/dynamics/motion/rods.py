"""Rods and pistons between pins and liners: what they do to crank, pistons and block.

Rod and piston are eliminated onto the pin, or onto the big end where that floats. A guided piston's motion across its
cylinder is found here, at each evaluation, from the pin's and the liner's: two unknowns that nothing else feels, so
they need no place in the stage's Newton iteration.
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model.slots import (
    AREA,
    BANK,
    CRANKCASE,
    DELTA_J,
    GRAVITY,
    LINERS,
    M_BIG,
    M_OSC,
    M_SMALL,
    OFFSET,
    PIN_ROTATIONS,
    PISTONS,
    ROD,
    ROD_LAWS,
    RODS,
    U_FREE,
    U_Q,
    U_V,
)
from cranktrain.dynamics.motion.film_ports import film_block
from cranktrain.film.laws.films import ANGLE as FRAME_ANGLE
from cranktrain.film.laws.films import COS as FRAME_COS
from cranktrain.film.laws.films import FORCE, FRICTION, RUBBING, SPEED, film_call
from cranktrain.film.laws.films import SIN as FRAME_SIN
from cranktrain.loads.piston_guidance import HEIGHT, UNBALANCE, layer_force, liner_friction
from cranktrain.loads.slider_crank import rod_force

# Columns of the frame's numbers, see dynamics.equations_of_motion.
THETA, OMEGA, OMEGA_DOT, COS, SIN = 0, 1, 2, 6, 7
# Where in the scratch memory a rod's motion and its piston lie, clear of rod_force's results and films'.
CROSS, SIDE = 24, 48
PISTON_STEPS = 12
PISTON_TOLERANCE = 1.0e-15
"""Newton steps of a guided piston at most, and the motion (m) at which they end."""


@kernel
def rod_forces(model, frame, pressures, u, ud, udd, c_q, c_v, f, work):
    """Add the rods' forces to pins, big ends, pistons and liners, and their tangents at pins and big ends."""
    b = model.bearings.shape[0]
    rotation = int(model.layout[PIN_ROTATIONS])
    turns = rotation < model.scales.shape[0]
    ratio = c_v / c_q
    out = work.scratch
    free = model.layout[RODS] > 0.0
    omega = frame[OMEGA]
    alpha = 1.0 / c_q - omega * omega
    beta = 2.0 * omega * ratio + frame[OMEGA_DOT]
    status = 0
    for c in range(model.cylinders.shape[0]):
        rod = model.cylinders[c]
        cos = math.cos(frame[THETA] - rod[BANK])
        sin = math.sin(frame[THETA] - rod[BANK])
        gas = (pressures[c] - model.scalars[CRANKCASE]) * rod[AREA]
        pin_motion(model, frame, c, u, ud, udd, out)
        arm_x = out[6]
        arm_y = out[7]
        port = 2 * b + 1 + 2 * c
        block = work.blocks[b + c]
        torque = 0.0
        if free:
            port = int(model.layout[RODS]) + 2 * c
            block = work.blocks[int(model.layout[ROD_LAWS]) + c]
            for j in range(6):
                out[16 + j] = out[j]
            big_end_motion(model, frame, c, port, u, ud, udd, out)
            torque, failure = big_end_film(model, frame, c, port, cos, sin, ud, ratio, f, work)
            status |= failure
        cross = work.scratch[CROSS:]
        for j in range(0, 6, 2):
            cross[j] = cos * out[j] - sin * out[j + 1]
            cross[j + 1] = sin * out[j] + cos * out[j + 1]
        if model.layout[PISTONS] > 0.0:
            guided_rod(model, c, cross, gas, torque, u, ud, c_q, c_v, f, work)
        else:
            g = model.scalars[GRAVITY]
            rod_force(
                cross[0], cross[1], cross[2], cross[3], cross[4], cross[5], gas, rod[ROD], rod[M_BIG], rod[M_OSC],
                rod[DELTA_J], rod[OFFSET], g * math.sin(rod[BANK]), g * math.cos(rod[BANK]), out,
            )  # fmt: skip
            # Friction that turns the rod is held by the piston's guide, a couple with the big end.
            out[0] += torque
        fx = cos * out[0] + sin * out[1]
        fy = cos * out[1] - sin * out[0]
        lever_x = model.pins[c, 0] + arm_x
        lever_y = model.pins[c, 1] + arm_y
        if turns:
            f[rotation + c] += lever_x * fy - lever_y * fx
        else:
            f[port] += fx
            f[port + 1] += fy
            if not free:
                f[rotation + c] += arm_x * fy - arm_y * fx
        t_xx = out[2] + out[4] * ratio + out[6] * alpha + out[7] * beta
        t_xy = -out[4] * omega + out[7] * alpha - out[6] * beta
        t_yx = out[3] + out[5] * ratio + out[8] * alpha + out[9] * beta
        t_yy = -out[5] * omega + out[9] * alpha - out[8] * beta
        # Turn the block back: Rᵀ T R.
        block[0] = cos * cos * t_xx + cos * sin * (t_xy + t_yx) + sin * sin * t_yy
        block[1] = cos * cos * t_xy + cos * sin * (t_yy - t_xx) - sin * sin * t_yx
        block[4] = cos * cos * t_yx + cos * sin * (t_yy - t_xx) - sin * sin * t_xy
        block[5] = cos * cos * t_yy - cos * sin * (t_xy + t_yx) + sin * sin * t_xx
        if turns:
            # The pin goes along its circle, and the force keeps its direction.
            block[0] = lever_y * (lever_y * block[0] - lever_x * block[1])
            block[0] += lever_x * (lever_x * block[5] - lever_y * block[4]) - lever_x * fx - lever_y * fy
    return status


@kernel
def upper_share(model, c, height):
    """Share of a side force at ``height`` along the cylinder that the liner's upper ring takes."""
    lower = model.block.liners[c, 1]
    return (height - lower) / (model.block.liners[c, 0] - lower)


@kernel
def guided_rod(model, c, cross, gas, torque, u, ud, c_q, c_v, f, work):
    """Rod whose piston moves between the guiding springs; ``work.scratch`` as of rod_force.

    Solves M (x, τ)'' = F of the piston at the pin's motion ``cross`` and the liner's; the forces go to the piston's
    and the liner's ports, the motion that was found to the piston's.
    """
    out = work.scratch
    rod = model.cylinders[c]
    law = model.block.guidance
    inverse = model.block.piston_inverse
    port = int(model.layout[PISTONS]) + 2 * c
    ratio = c_v / c_q
    g = model.scalars[GRAVITY]
    g_x = g * math.sin(rod[BANK])
    g_y = g * math.cos(rod[BANK])
    u_q = work.port[U_Q]
    u_v = work.port[U_V]
    u_free = work.port[U_FREE]
    side = work.scratch[SIDE:]
    # Side forces and friction go on from the stage's last evaluation.
    for j in range(3):
        side[7 + j] = work.guides[c, j]
    for _ in range(PISTON_STEPS):
        x = u[port]
        x_a = (x - u_q[port]) / c_q
        x_v = u_v[port] + c_v * x_a
        t = u[port + 1]
        t_v = u_v[port + 1] + c_v * (t - u_q[port + 1]) / c_q
        piston_forces(
            model, c, cross, gas, torque, x, x_v, x_a, t, t_v, u, ud, g_x, g_y, work.scratch, side
        )  # fmt: skip
        d_n = out[2] + ratio * out[4] + out[6] / c_q
        d_u = side[2] + ratio * side[3]
        d_l = side[5] + ratio * side[6]
        y_u = law[HEIGHT]
        y_l = law[HEIGHT + 1]
        xx = d_n + d_u + d_l
        xt = -y_u * d_u - y_l * d_l
        tt = y_u * y_u * d_u + y_l * y_l * d_l
        # r = u_free + c_q M⁻¹ F − u, and I − c_q M⁻¹ ∂F/∂u.
        r_x = u_free[port] + c_q * (inverse[0, 0] * side[0] + inverse[0, 1] * side[1]) - x
        r_t = u_free[port + 1] + c_q * (inverse[1, 0] * side[0] + inverse[1, 1] * side[1]) - t
        a = 1.0 - c_q * (inverse[0, 0] * xx + inverse[0, 1] * xt)
        b = -c_q * (inverse[0, 0] * xt + inverse[0, 1] * tt)
        d = -c_q * (inverse[1, 0] * xx + inverse[1, 1] * xt)
        e = 1.0 - c_q * (inverse[1, 0] * xt + inverse[1, 1] * tt)
        determinant = a * e - b * d
        move_x = (e * r_x - b * r_t) / determinant
        move_t = (a * r_t - d * r_x) / determinant
        u[port] = x + move_x
        u[port + 1] = t + move_t
        if abs(move_x) + abs(move_t) * rod[ROD] < PISTON_TOLERANCE:
            break
    for j in range(3):
        work.guides[c, j] = side[7 + j]
    f[port] = side[0]
    f[port + 1] = side[1]
    if model.layout[LINERS] > 0.0:
        # The opposite of what liner and gas do to the piston: same force, same moment about the crank's axis.
        k = int(model.layout[LINERS]) + 3 * c
        upper = model.block.liners[c, 0]
        lower = model.block.liners[c, 1]
        push = (side[12] + lower * side[10]) / (upper - lower)
        f[k] += push
        f[k + 1] -= side[10] + push
        f[k + 2] -= side[11] + gas
    # The pin feels the rod and its big end.
    out[0] += torque - rod[M_BIG] * (cross[4] + g_x)
    out[1] -= rod[M_BIG] * (cross[5] + g_y)
    out[6] -= rod[M_BIG]
    out[9] -= rod[M_BIG]


@kernel
def piston_forces(model, c, cross, gas, torque, x, x_v, x_a, t, t_v, u, ud, g_x, g_y, out, side):
    """Forces on a guided piston at its motion across, x and τ.

    ``side[0:2]`` force and moment, ``side[2:4]`` and ``side[5:7]`` ∂F/∂gap and ∂F/∂rate of the upper and the lower
    layer, ``side[7:9]`` their forces, ``side[9]`` friction along the cylinder, ``side[10:13]`` what liner and gas do to
    the piston: force across and along the cylinder's axis at rest, and its moment about the crank's axis. ``out`` as of
    rod_force without big end.

    Gas and friction act along the liner, its springs square to it, wherever it leans: an engine on soft mounts leans by
    a degree, and 100 kN of gas have then 2 kN across.
    """
    rod = model.cylinders[c]
    law = model.block.guidance
    liner = int(model.layout[LINERS]) + 3 * c
    slope = 0.0
    if model.layout[LINERS] > 0.0:
        slope = (u[liner] - u[liner + 1]) / (model.block.liners[c, 0] - model.block.liners[c, 1])
    # Friction and lean follow the side forces found last; a step of the iteration later they agree.
    push = gas - side[9]
    down = push + slope * (side[7] + side[8])
    rod_force(
        cross[0] - x, cross[1], cross[2] - x_v, cross[3], cross[4] - x_a, cross[5],
        down, rod[ROD], 0.0, rod[M_OSC], rod[DELTA_J], rod[OFFSET], 0.0, g_y, out,
    )  # fmt: skip
    force = -out[0] - torque - slope * push
    weight = out[12] + g_y
    moment = weight * (law[UNBALANCE] * t - rod[OFFSET] * rod[M_SMALL]) - rod[OFFSET] * out[1]
    side[10] = -slope * push
    side[11] = -down
    side[12] = out[10] * slope * push - x * down
    for layer in range(2):
        height = law[HEIGHT + layer]
        gap = x - t * height
        rate = x_v - t_v * height
        if model.layout[LINERS] > 0.0:
            share = upper_share(model, c, out[10] + height)
            gap -= share * u[liner] + (1.0 - share) * u[liner + 1]
            rate -= share * ud[liner] + (1.0 - share) * ud[liner + 1] + slope * out[11]
        layer_force(law, layer, gap, rate, side[1 + 3 * layer :])
        pressing = side[1 + 3 * layer]
        side[7 + layer] = pressing
        side[10] += pressing
        side[12] -= (out[10] + height) * pressing
        force += pressing
        moment -= height * pressing
    side[9] = liner_friction(law, side[7], side[8], out[11])
    side[0] = force
    side[1] = moment


@kernel
def observe_rod(model, frame, work, c, u, ud, udd, out, side):
    """Rod and piston of cylinder c at the ports' known motion.

    ``out`` as of rod_force with the big end, but for friction in it; ``side[7] + side[8]`` force of the liner on the
    piston across the cylinder, ``side[9]`` along it. Cylinder pressures stand in ``work.pressures[0]``.
    """
    rod = model.cylinders[c]
    g = model.scalars[GRAVITY]
    g_x = g * math.sin(rod[BANK])
    g_y = g * math.cos(rod[BANK])
    cos = math.cos(frame[THETA] - rod[BANK])
    sin = math.sin(frame[THETA] - rod[BANK])
    gas = (work.pressures[0, c] - model.scalars[CRANKCASE]) * rod[AREA]
    if model.layout[RODS] > 0.0:
        big_end_motion(model, frame, c, int(model.layout[RODS]) + 2 * c, u, ud, udd, out)
    else:
        pin_motion(model, frame, c, u, ud, udd, out)
    cross = work.scratch[CROSS:]
    for j in range(0, 6, 2):
        cross[j] = cos * out[j] - sin * out[j + 1]
        cross[j + 1] = sin * out[j] + cos * out[j + 1]
    for j in range(7, 10):
        side[j] = 0.0
    if model.layout[PISTONS] == 0.0:
        rod_force(
            cross[0], cross[1], cross[2], cross[3], cross[4], cross[5],
            gas, rod[ROD], rod[M_BIG], rod[M_OSC], rod[DELTA_J], rod[OFFSET], g_x, g_y, out,
        )  # fmt: skip
        side[7] = out[0] + rod[M_BIG] * (cross[4] + g_x) + rod[M_OSC] * g_x
        return
    k = int(model.layout[PISTONS]) + 2 * c
    for _ in range(3):
        piston_forces(model, c, cross, gas, 0.0, u[k], ud[k], udd[k], u[k + 1], ud[k + 1], u, ud, g_x, g_y, out, side)
    out[0] -= rod[M_BIG] * (cross[4] + g_x)
    out[1] -= rod[M_BIG] * (cross[5] + g_y)


@kernel
def big_end_film(model, frame, c, port, cos, sin, ud, ratio, f, work):
    """Film between pin and free big end of cylinder c, from the pin's motion in scratch[16:22] and the rod's in [0:6].

    Adds its forces to pin, rod and pin rotation; returns the side force that holds its friction on the rod.
    """
    motion = work.scratch
    rod = model.cylinders[c]
    rotation = int(model.layout[PIN_ROTATIONS])
    pin = 2 * model.bearings.shape[0] + 1 + 2 * c
    side = cos * motion[0] - sin * motion[1] - rod[OFFSET]
    height = math.sqrt(rod[ROD] * rod[ROD] - side * side)
    # The rod turns as its big end moves across the cylinder.
    rod_speed = (cos * motion[2] - sin * motion[3]) / height
    pin_speed = frame[OMEGA] + ud[rotation + c]
    x = motion[16] - motion[0]
    y = motion[17] - motion[1]
    out = model.floating.out
    vx = motion[18] - motion[2]
    vy = motion[19] - motion[3]
    status = float_force(model, c, FORCE, x, y, vx, vy, pin_speed, rod_speed, frame, out)
    friction = out[FRICTION]
    f[pin] += out[0]
    f[pin + 1] += out[1]
    f[port] -= out[0]
    f[port + 1] -= out[1]
    x0 = model.pins[c, 0]
    y0 = model.pins[c, 1]
    f[rotation + c] += (motion[16] - x0) * out[1] - (motion[17] - y0) * out[0] + friction
    block = work.blocks[model.bearings.shape[0] + c]
    film_block(out, 2, ratio, frame[OMEGA], block)
    for row in range(2):
        for column in range(2):
            value = block[4 * row + column]
            block[4 * row + column + 2] = -value
            block[4 * (row + 2) + column] = -value
            block[4 * (row + 2) + column + 2] = value
    return -(friction + x * out[1] - y * out[0]) / height, status


@kernel
def float_force(model, c, action, x, y, vx, vy, pin_speed, rod_speed, frame, out):
    """Let the law act on the film of the floating big end of cylinder c; 0, or a failure."""
    films = model.floating
    films.place[c, 0] = x
    films.place[c, 1] = y
    films.velocity[c, 0] = vx
    films.velocity[c, 1] = vy
    films.numbers[SPEED] = pin_speed + rod_speed
    films.numbers[RUBBING] = pin_speed - rod_speed
    films.numbers[FRAME_COS] = frame[COS]
    films.numbers[FRAME_SIN] = frame[SIN]
    films.numbers[FRAME_ANGLE] = frame[THETA]
    return film_call(films, action, c, out, out)


@kernel
def big_end_motion(model, frame, c, port, u, ud, udd, out):
    """Position, absolute velocity and acceleration of the free big end of cylinder c in frame axes, ``out[0:6]``."""
    absolute_motion(
        model.pins[c, 0] + u[port], model.pins[c, 1] + u[port + 1], ud[port], ud[port + 1], udd[port], udd[port + 1],
        frame, out,
    )  # fmt: skip


@kernel
def absolute_motion(x, y, vx, vy, ax, ay, frame, out):
    """Position, absolute velocity and acceleration in frame axes of a point that moves in the turning frame."""
    omega = frame[OMEGA]
    omega_dot = frame[OMEGA_DOT]
    out[0] = x
    out[1] = y
    out[2] = vx - omega * y
    out[3] = vy + omega * x
    out[4] = ax - 2.0 * omega * vy - omega_dot * y - omega * omega * x
    out[5] = ay + 2.0 * omega * vx + omega_dot * x - omega * omega * y


@kernel
def pin_motion(model, frame, c, u, ud, udd, out):
    """Position, absolute velocity and acceleration of the pin under the rod of cylinder c in frame axes.

    ``out[6:8]`` is how far it moved, ``out[8:10]`` the share (R(φ) − I) X of turning alone.
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
        out[6] = arm_x
        out[7] = arm_y
        out[8] = arm_x
        out[9] = arm_y
        return
    x = turned_x + u[i] + phi * y0
    y = turned_y + u[i + 1] - phi * x0
    absolute_motion(
        x, y, ud[i] - ud[r] * arm_y, ud[i + 1] + ud[r] * arm_x,
        udd[i] - udd[r] * arm_y - ud[r] * ud[r] * turned_x, udd[i + 1] + udd[r] * arm_x - ud[r] * ud[r] * turned_y,
        frame, out,
    )  # fmt: skip
    out[6] = x - x0
    out[7] = y - y0
    out[8] = arm_x
    out[9] = arm_y
