"""Forces of rods and pistons on crank, pistons and block.

Rod and piston are eliminated onto the pin, or onto the big end if it floats.
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.big_end_films import big_end_film, line_up_big_ends
from cranktrain.dynamics.motion.film_ports import ROW
from cranktrain.dynamics.motion.gas import cylinder_pressure, gas_force, own_angle, volume_over
from cranktrain.dynamics.motion.guided_pistons import (
    LAYER,
    UPPER,
    PistonMotion,
    RodLoad,
    guided_rod,
    piston_forces,
    upper_share,
)
from cranktrain.dynamics.motion.rod_motion import (
    AX,
    AY,
    CROSS,
    MASTERS_PIN,
    MOVED,
    PIN,
    PUSH,
    SIDE,
    VX,
    VY,
    X,
    Y,
    across_cylinder,
    axes_of_pin,
    big_end_motion,
    cylinder_axes,
    pin_motion,
    rod_end_across,
)
from cranktrain.loads.articulated_rod import force_change, force_on_pin, hang
from cranktrain.loads.slider_crank import pin_tangent, rod_force, turn_back

OBSERVING = 3
"""Number of evaluations after which side forces and friction at a known motion agree."""


@inlined_kernel
def rod_forces(model, work, frame, pressures, c_q, c_v):
    """Add the rods' forces to pins, big ends, pistons and liners, and fill their tangents at pins and big ends.

    The ports' motion and forces are rows of ``work.port``. The first half of ``pressures`` (2c,) is set to those at the
    cylinders' own angles; the second half has pressures given over time. Returns 0, or the status of a law that failed.
    """
    u = work.port[at.U]
    ud = work.port[at.UD]
    udd = work.port[at.UDD]
    f = work.port[at.FORCES]
    out = work.scratch
    status = 0
    given = frame[at.BURN] < 0.0
    frame[at.GIVEN_POWER] = 0.0
    line_up_big_ends(model, work, frame)
    cylinders = model.cylinders.shape[0]
    for c in range(cylinders):
        rod = model.cylinders[c]
        cos, sin = cylinder_axes(model.cylinders[axes_of_pin(model, c)], frame)
        pin_motion(model, frame, c, u, ud, udd, out)
        moved_x = out[MOVED]
        moved_y = out[MOVED + 1]
        port = int(rod[at.PIN_PORT])
        block = work.blocks[int(rod[at.END_ROW])]
        torque = 0.0
        free = rod[at.END_PORT] >= 0.0
        if free:
            port = int(rod[at.END_PORT])
            for j in range(MOVED):
                out[PIN + j] = out[j]
            big_end_motion(model, frame, c, u, ud, udd, out)
            torque, failure = big_end_film(model, work, frame, c, cos, sin, c_v / c_q)
            status |= failure
        end_x = out[X]
        end_y = out[Y]
        across_cylinder(out, cos, sin, work.scratch[CROSS:])
        hung = rod[at.MASTER] >= 0.0
        if hung:
            hang(rod[at.JOINT :], work.scratch[CROSS:], work.scratch[MASTERS_PIN:])
        volume = 0.0
        rising = 0.0
        if given:
            _, _, height, rising = piston_rise(model, c, u, ud, work.scratch[CROSS:])
            volume = volume_over(rod, height - work.rises[c, 0])
        angle = own_angle(model, frame, u, end_x, end_y, c)
        pressures[c], slope = cylinder_pressure(model, work, frame, c, angle, volume, pressures[cylinders + c])
        load = rod_load(rod, model.scalars, c, pressures[c], torque)
        if given:
            frame[at.GIVEN_POWER] -= load.gas * (rising - work.rises[c, 1])
        if rod[at.PISTON_PORT] >= 0.0:
            guided_rod(model, work, frame, load, c_q, c_v)
        else:
            rod_on_axis(rod, load, work.scratch[CROSS:], out)
            # The friction torque on the rod is balanced by forces at the piston's guide and the big end.
            out[0] += torque
        if hung:
            knuckle_to_pin(rod[at.JOINT :], frame, cos, sin, c_q, c_v, out, block)
        else:
            pin_tangent(out, c_v / c_q, 1.0 / c_q, frame[at.OMEGA], frame[at.OMEGA_DOT], cos, sin, block)
        # With a block on mounts the gas has no tangent: head and liner have none, and the pin's force must match.
        if slope != 0.0 and rod[at.LINER_PORT] < 0.0:
            gas_block(rod, work, slope, end_x, end_y, cos, sin, block)
        fx = cos * out[0] + sin * out[1]
        fy = cos * out[1] - sin * out[0]
        rotation = int(rod[at.PIN_TURN])
        moved_x -= frame[at.CRANK_X]
        moved_y -= frame[at.CRANK_Y]
        lever_x = model.pins[c, 0] + moved_x
        lever_y = model.pins[c, 1] + moved_y
        if port < 0:
            f[rotation] += lever_x * fy - lever_y * fx
            # The pin moves along its circle, while the force keeps its direction.
            block[0] = lever_y * (lever_y * block[0] - lever_x * block[1])
            block[0] += lever_x * (lever_x * block[ROW + 1] - lever_y * block[ROW]) - lever_x * fx - lever_y * fy
        else:
            f[port] += fx
            f[port + 1] += fy
            if not free:
                f[rotation] += moved_x * fy - moved_y * fx
    return status


@kernel
def piston_rise(model, c, u, ud, cross):
    """Height (m) and rate (m/s) of the pin of piston c above the crank's axis, then both along its leaning liner.

    ``cross`` is the motion of its rod's end. The liner's own rise is not subtracted.
    """
    rod = model.cylinders[c]
    side = cross[X] - rod[at.OFFSET]
    side_rate = cross[VX]
    piston = int(rod[at.PISTON_PORT])
    if piston >= 0:
        side -= u[piston]
        side_rate -= ud[piston]
    reach = math.sqrt(rod[at.ROD] * rod[at.ROD] - side * side)
    height = cross[Y] + reach
    rate = cross[VY] - side * side_rate / reach
    liner = int(rod[at.LINER_PORT])
    if liner < 0:
        return height, rate, height, rate
    length = model.block.liners[c, 0] - model.block.liners[c, 1]
    slope = (u[liner] - u[liner + 1]) / length
    turning = (ud[liner] - ud[liner + 1]) / length
    share = upper_share(model, c, 0.0)
    off = u[piston] - share * u[liner] - (1.0 - share) * u[liner + 1]
    off_rate = ud[piston] - share * ud[liner] - (1.0 - share) * ud[liner + 1]
    along = height + slope * (off - 0.5 * slope * height)
    return height, rate, along, rate + slope * (off_rate - turning * height) + turning * off


@inlined_kernel
def rod_load(rod, scalars, c, pressure, torque):
    """Loads of rod and piston of cylinder c."""
    g = scalars[at.GRAVITY]
    return RodLoad(c, gas_force(rod, scalars, pressure), torque, g * rod[at.SIN_BANK], g * rod[at.COS_BANK])


@inlined_kernel
def rod_on_axis(rod, load, cross, out):
    """Force of a rod whose piston runs on the axis of its cylinder; results in ``out`` as from rod_force."""
    rod_force(
        cross[X], cross[Y], cross[VX], cross[VY], cross[AX], cross[AY], load.gas, rod[at.ROD], rod[at.M_BIG],
        rod[at.M_OSC], rod[at.DELTA_J], rod[at.OFFSET], load.g_x, load.g_y, out,
    )  # fmt: skip


@kernel
def knuckle_to_pin(joint, frame, cos, sin, c_q, c_v, out, block):
    """Replace an articulated rod's force on its knuckle pin, in ``out``, by the force on the crank pin.

    The force is in axes of the master's cylinder. ``block`` (2 × 2) gets its tangent by the crank pin's displacement in
    a stage, in the frame's axes (by ``cos`` and ``sin``). ``out[MASTERS_PIN:]`` holds that pin's motion.
    """
    pin = out[MASTERS_PIN:]
    ratio = c_v / c_q
    omega = frame[at.OMEGA]
    alpha = 1.0 / c_q - omega * omega
    beta = 2.0 * omega * ratio + frame[at.OMEGA_DOT]
    for j in range(2):
        x = 1.0 - j
        y = 1.0 * j
        block[j], block[ROW + j] = force_change(
            joint, pin, out, x, y, ratio * x - omega * y, ratio * y + omega * x, alpha * x - beta * y,
            alpha * y + beta * x,
        )  # fmt: skip
    turn_back(block[0], block[1], block[ROW], block[ROW + 1], cos, sin, block)
    out[0], out[1], _ = force_on_pin(joint, pin, out)


@kernel
def gas_block(rod, work, slope, x, y, cos, sin, block):
    """Add to a rod's tangent the change of gas force; ``slope`` (Pa/rad) is over the angle of its end at x and y."""
    side = work.scratch[CROSS + X] - rod[at.OFFSET]
    if rod[at.PISTON_PORT] >= 0.0:
        side -= work.port[at.U, int(rod[at.PISTON_PORT])]
    # Direction: force on the rod's end by unit force on the piston.
    push = work.scratch[PUSH:]
    push[0] = side / math.sqrt(rod[at.ROD] * rod[at.ROD] - side * side)
    push[1] = -1.0
    push_x = push[0]
    push_y = -1.0
    if rod[at.MASTER] >= 0.0:
        push_x, push_y, _ = force_on_pin(rod[at.JOINT :], work.scratch[MASTERS_PIN:], push)
    gain = slope * rod[at.AREA] * rod[at.OWN_ROD] / (x * x + y * y)
    force_x = gain * (cos * push_x + sin * push_y)
    force_y = gain * (cos * push_y - sin * push_x)
    block[0] -= force_x * y
    block[1] += force_x * x
    block[ROW] -= force_y * y
    block[ROW + 1] += force_y * x


@kernel
def observe_rod(model, work, c):
    """Forces of rod and piston of cylinder c at the state, with cylinder pressures in ``work.pressures[0]``.

    Fills ``work.scratch`` as of rod_force with the big end, without friction in it. ``[SIDE + UPPER] + [SIDE + LOWER]``
    is the force of the liner on the piston across the cylinder, ``[SIDE + FRICTION_ALONG]`` along it. The force of an
    articulated rod acts on its knuckle pin; forces on crank pin and master piston do not include it.
    """
    rod = model.cylinders[c]
    frame = work.frames[0]
    out = work.scratch
    side = work.scratch[SIDE:]
    cross = work.scratch[CROSS:]
    u = work.port[at.STATE_U]
    ud = work.port[at.STATE_UD]
    udd = work.port[at.STATE_UDD]
    load = rod_load(rod, model.scalars, c, work.pressures[0, c], 0.0)
    rod_end_across(model, frame, c, u, ud, udd, out)
    for j in range(LAYER):
        side[UPPER + j] = 0.0
    if rod[at.PISTON_PORT] < 0.0:
        rod_on_axis(rod, load, cross, out)
        side[UPPER] = out[0] + rod[at.M_BIG] * (cross[AX] + load.g_x) + rod[at.M_OSC] * load.g_x
        return
    k = int(rod[at.PISTON_PORT])
    piston = PistonMotion(u[k], ud[k], udd[k], u[k + 1], ud[k + 1])
    for _ in range(OBSERVING):
        piston_forces(model, load, piston, u, ud, cross, out, side)
    out[0] -= rod[at.M_BIG] * (cross[AX] + load.g_x)
    out[1] -= rod[at.M_BIG] * (cross[AY] + load.g_y)
