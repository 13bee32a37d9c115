"""Values stored over a cycle: seating, bounce, loss of contact, separation of the drive, work of the crank.

A line's cycle ends half a turn after its cam's nose; the cycle of drive and work ends with the crank's cycle.
"""

import math

from cranktrain.core.kernel import kernel
from cranktrain.modules import crank_angle as crank
from cranktrain.modules.valve_train import slots as at
from cranktrain.modules.valve_train.cam import wrapped


@kernel
def remember(model, work, state, h):
    """Update the stored values for a step of h, s, whose end is in the workspace and not yet in the state."""
    n, shaft = model.numbers, work.shaft
    turn = abs(shaft[at.S_ANGLE] - shaft[at.S_ANGLE0])
    for i in range(work.rows.shape[0]):
        row, base = work.rows[i], at.N_HEAD + i * at.N_LINE
        before = wrapped(shaft[at.S_ANGLE0] - row[at.R_NOSE])
        after = wrapped(shaft[at.S_ANGLE] - row[at.R_NOSE])
        if after < before - math.pi:
            end_cycle(state, base)
        if row[at.R_FORCE] <= 0.0 and n[at.RATIO] * row[at.R_LIFT] > n[at.LASH]:
            state[base + at.LOSS_NOW] += turn / (2.0 * math.pi)
        x, v = row[at.R_X0], row[at.R_V0]
        if after > 0.0 and x > 0.0 >= row[at.R_X]:
            state[base + at.LANDED] = 1.0
            fall = v + state[base + at.ACCELERATION] * min(x / max(-v, x / h), h)
            state[base + at.IMPACT_NOW] = max(state[base + at.IMPACT_NOW], -fall)
        if state[base + at.LANDED] > 0.0:
            state[base + at.BOUNCE_NOW] = max(state[base + at.BOUNCE_NOW], row[at.R_X])
    if shaft[at.S_TORQUE] == 0.0:
        state[at.APART_NOW] += turn / (2.0 * math.pi)
    state[at.CYCLE_WORK] += shaft[at.S_IMPULSE] * shaft[at.S_CRANK_SPEED]


@kernel
def end_cycle(state, base):
    """Store the results of a line's cycle that has ended, and begin the next one."""
    state[base + at.IMPACT] = state[base + at.IMPACT_NOW]
    state[base + at.LOSS] = state[base + at.LOSS_NOW]
    state[base + at.BOUNCE] = state[base + at.BOUNCE_NOW]
    for k in (at.IMPACT_NOW, at.LOSS_NOW, at.BOUNCE_NOW, at.LANDED):
        state[base + k] = 0.0


@kernel
def end_crank_cycle(state):
    """Store the drive's results of a crank cycle that has ended; angles of crank and camshaft are wrapped together."""
    state[at.APART] = state[at.APART_NOW]
    state[at.TORQUE_MEAN] = state[at.CYCLE_WORK] / (4.0 * math.pi)
    state[at.APART_NOW] = 0.0
    state[at.CYCLE_WORK] = 0.0
    state[crank.OWN_ANGLE] -= 4.0 * math.pi
    state[at.CAM_ANGLE] -= 2.0 * math.pi
