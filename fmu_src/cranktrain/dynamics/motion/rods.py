"""Rods and pistons between pins and liners: what they do to crank, pistons and block.

Rod and piston are eliminated onto the pin, or onto the big end where that floats.
"""

from __future__ import annotations

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.film_ports import film_block
from cranktrain.dynamics.motion.gas import gas_force
from cranktrain.dynamics.motion.guided_pistons import LAYER, UPPER, PistonMotion, RodLoad, guided_rod, piston_forces
from cranktrain.dynamics.motion.rod_motion import (
    AX,
    AY,
    CROSS,
    MOVED,
    PIN,
    SIDE,
    VX,
    VY,
    X,
    Y,
    across_cylinder,
    big_end_motion,
    cylinder_axes,
    pin_motion,
    rod_end,
    rod_swing,
)
from cranktrain.film.laws.films import ANGLE as FRAME_ANGLE
from cranktrain.film.laws.films import COS as FRAME_COS
from cranktrain.film.laws.films import FORCE, FRICTION, RUBBING, SPEED, film_call
from cranktrain.film.laws.films import SIN as FRAME_SIN
from cranktrain.loads.slider_crank import (
    BY_ACCELERATION,
    BY_VX,
    BY_X,
    rod_force,
)

ROW = 4
"""Values in a row of a connection's block."""
OBSERVING = 3
"""Evaluations after which side forces and friction at a known motion agree."""


@inlined_kernel
def rod_forces(model, work, frame, pressures, c_q, c_v):
    """Add the rods' forces to pins, big ends, pistons and liners, and fill their tangents at pins and big ends.

    The ports' motion and forces are rows of ``work.port``. Returns 0, or tells that a law failed.
    """
    b = model.bearings.shape[0]
    u = work.port[at.U]
    ud = work.port[at.UD]
    udd = work.port[at.UDD]
    f = work.port[at.FORCES]
    out = work.scratch
    free = model.layout[at.RODS] > 0.0
    status = 0
    for c in range(model.cylinders.shape[0]):
        rod = model.cylinders[c]
        cos, sin = cylinder_axes(rod, frame)
        pin_motion(model, frame, c, u, ud, udd, out)
        moved_x = out[MOVED]
        moved_y = out[MOVED + 1]
        port = 2 * b + 1 + 2 * c
        block = work.blocks[b + c]
        torque = 0.0
        if free:
            port = int(model.layout[at.RODS]) + 2 * c
            block = work.blocks[int(model.layout[at.ROD_LAWS]) + c]
            for j in range(MOVED):
                out[PIN + j] = out[j]
            big_end_motion(model, frame, c, u, ud, udd, out)
            torque, failure = big_end_film(model, work, frame, c, cos, sin, c_v / c_q)
            status |= failure
        load = rod_load(rod, model.scalars, c, pressures[c], torque)
        across_cylinder(out, cos, sin, work.scratch[CROSS:])
        if model.layout[at.PISTONS] > 0.0:
            guided_rod(model, work, frame, load, c_q, c_v)
        else:
            rod_on_axis(rod, load, work.scratch[CROSS:], out)
            # Friction that turns the rod is held by the piston's guide, a couple with the big end.
            out[0] += torque
        fx = cos * out[0] + sin * out[1]
        fy = cos * out[1] - sin * out[0]
        pin_block(out, frame, cos, sin, c_q, c_v, block)
        rotation = int(model.layout[at.PIN_ROTATIONS]) + c
        moved_x -= frame[at.CRANK_X]
        moved_y -= frame[at.CRANK_Y]
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
    g = scalars[at.GRAVITY]
    return RodLoad(c, gas_force(rod, scalars, pressure), torque, g * rod[at.SIN_BANK], g * rod[at.COS_BANK])


@inlined_kernel
def rod_on_axis(rod, load, cross, out):
    """Rod whose piston runs on the axis of its cylinder; ``out`` as of rod_force."""
    rod_force(
        cross[X], cross[Y], cross[VX], cross[VY], cross[AX], cross[AY], load.gas, rod[at.ROD], rod[at.M_BIG],
        rod[at.M_OSC], rod[at.DELTA_J], rod[at.OFFSET], load.g_x, load.g_y, out,
    )  # fmt: skip


@inlined_kernel
def pin_block(out, frame, cos, sin, c_q, c_v, block):
    """Tangent of a rod's force by its pin's displacement in a stage, from rod_force's, in the frame's axes (2 × 2)."""
    ratio = c_v / c_q
    omega = frame[at.OMEGA]
    alpha = 1.0 / c_q - omega * omega
    beta = 2.0 * omega * ratio + frame[at.OMEGA_DOT]
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
    u = work.port[at.STATE_U]
    ud = work.port[at.STATE_UD]
    udd = work.port[at.STATE_UDD]
    load = rod_load(rod, model.scalars, c, work.pressures[0, c], 0.0)
    rod_end(model, frame, c, u, ud, udd, out)
    cos, sin = cylinder_axes(rod, frame)
    across_cylinder(out, cos, sin, cross)
    for j in range(LAYER):
        side[UPPER + j] = 0.0
    if model.layout[at.PISTONS] == 0.0:
        rod_on_axis(rod, load, cross, out)
        side[UPPER] = out[0] + rod[at.M_BIG] * (cross[AX] + load.g_x) + rod[at.M_OSC] * load.g_x
        return
    k = int(model.layout[at.PISTONS]) + 2 * c
    piston = PistonMotion(u[k], ud[k], udd[k], u[k + 1], ud[k + 1])
    for _ in range(OBSERVING):
        piston_forces(model, load, piston, u, ud, cross, out, side)
    out[0] -= rod[at.M_BIG] * (cross[AX] + load.g_x)
    out[1] -= rod[at.M_BIG] * (cross[AY] + load.g_y)


@kernel
def big_end_film(model, work, frame, c, cos, sin, ratio):
    """Film between pin and free big end of cylinder c, from the motions in scratch, the pin's from PIN on.

    Adds its forces to pin, rod and pin rotation, and fills its tangent; returns the side force that holds its friction
    on the rod, and 0 or what tells that the law failed.
    """
    rod = work.scratch
    pin = work.scratch[PIN:]
    f = work.port[at.FORCES]
    out = model.floating.out
    turn = int(model.layout[at.PIN_ROTATIONS]) + c
    height, rod_speed = rod_swing(model.cylinders[c], rod, cos, sin)
    place_pin(model, c, pin, rod)
    status = float_force(model, frame, c, FORCE, frame[at.OMEGA] + work.port[at.UD, turn], rod_speed)
    friction = out[FRICTION]
    k = 2 * model.bearings.shape[0] + 1 + 2 * c
    f[k] += out[0]
    f[k + 1] += out[1]
    k = int(model.layout[at.RODS]) + 2 * c
    f[k] -= out[0]
    f[k + 1] -= out[1]
    moved_x = pin[X] - model.pins[c, 0] - frame[at.CRANK_X]
    moved_y = pin[Y] - model.pins[c, 1] - frame[at.CRANK_Y]
    f[turn] += moved_x * out[1] - moved_y * out[0] + friction
    block = work.blocks[model.bearings.shape[0] + c]
    film_block(out, ratio, frame[at.OMEGA], block)
    for row in range(2):
        for column in range(2):
            value = block[4 * row + column]
            block[4 * row + column + 2] = -value
            block[4 * (row + 2) + column] = -value
            block[4 * (row + 2) + column + 2] = value
    place = model.floating.place[c]
    return -(friction + place[X] * out[1] - place[Y] * out[0]) / height, status


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
    films.numbers[FRAME_COS] = frame[at.COS]
    films.numbers[FRAME_SIN] = frame[at.SIN]
    films.numbers[FRAME_ANGLE] = frame[at.THETA]
    return film_call(films, action, c, films.out, films.out)
