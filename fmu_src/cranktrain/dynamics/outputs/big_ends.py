"""What the running model shows of the big ends: load of each crank pin and, where it floats, its film.

Rods lie behind one another on a pin, each with a film of its own; pin and bore both turn, the bore as the rod swings.
Vectors in axes at rest: x across the engine, y upwards. A rigid big end has a load as well; all else of it is 0.
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model.slots import BANK, OFFSET, PIN_ROTATIONS, ROD, RODS, STATE_UDD
from cranktrain.dynamics.motion.rods import (
    COS,
    OMEGA,
    SIDE,
    SIN,
    THETA,
    big_end_motion,
    float_force,
    observe_rod,
    pin_motion,
)
from cranktrain.film.laws.films import ECCENTRICITY, FLOW, FRICTION, OBSERVE, P_MAX
from cranktrain.film.laws.parameters import CLEARANCE

BIG_END = (
    "force.x",
    "force.y",
    "position.x",
    "position.y",
    "eccentricity",
    "film_thickness_min",
    "pressure_max",
    "friction_torque",
    "oil_flow",
)
BIG_END_OUTPUTS = len(BIG_END)


@kernel
def observe_big_end(model, work, frame, c, u, ud, out, k):
    """Write the outputs of the big end of cylinder c from k on: force on the pin, place of the pin in the bore, film.

    u and u̇ are those of the state; its cylinder pressures stand in ``work.pressures[0]``.
    """
    rod = model.cylinders[c]
    r = work.scratch
    for i in range(BIG_END_OUTPUTS):
        out[k + i] = 0.0
    cos = frame[COS]
    sin = frame[SIN]
    if model.layout[RODS] == 0.0:
        observe_rod(model, frame, work, c, u, ud, work.port[STATE_UDD], r, r[SIDE:])
        cos = math.cos(rod[BANK])
        sin = math.sin(rod[BANK])
        out[k] = cos * r[0] - sin * r[1]
        out[k + 1] = sin * r[0] + cos * r[1]
        return
    turn_cos = math.cos(frame[THETA] - rod[BANK])
    turn_sin = math.sin(frame[THETA] - rod[BANK])
    pin_motion(model, frame, c, u, ud, work.port[STATE_UDD], r)
    x = r[0]
    y = r[1]
    vx = r[2]
    vy = r[3]
    big_end_motion(model, frame, c, int(model.layout[RODS]) + 2 * c, u, ud, work.port[STATE_UDD], r)
    x -= r[0]
    y -= r[1]
    vx -= r[2]
    vy -= r[3]
    side = turn_cos * r[0] - turn_sin * r[1] - rod[OFFSET]
    rod_speed = (turn_cos * r[2] - turn_sin * r[3]) / math.sqrt(rod[ROD] * rod[ROD] - side * side)
    pin_speed = frame[OMEGA] + ud[int(model.layout[PIN_ROTATIONS]) + c]
    film = model.floating.out
    float_force(model, c, OBSERVE, x, y, vx, vy, pin_speed, rod_speed, frame, film)
    out[k] = cos * film[0] - sin * film[1]
    out[k + 1] = sin * film[0] + cos * film[1]
    out[k + 2] = cos * x - sin * y
    out[k + 3] = sin * x + cos * y
    out[k + 4] = film[ECCENTRICITY]
    out[k + 5] = max(model.big_ends[c, CLEARANCE] * (1.0 - film[ECCENTRICITY]), 0.0)
    out[k + 6] = film[P_MAX]
    out[k + 7] = -film[FRICTION]
    out[k + 8] = film[FLOW]
