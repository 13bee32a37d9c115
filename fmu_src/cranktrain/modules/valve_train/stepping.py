"""Steps of the whole valve train: a singly diagonally implicit Runge–Kutta method of two stages, with step control.

With γ = 1 − 1/√2 it is of second order, L-stable and stiffly accurate. Contacts are continuous at first touch, so steps
need not end there; the error estimate includes them. The estimate is that of the velocities, 0.0404 h³ d³v/dt³, with
the derivative from the accelerations at the start of the step and in both stages. Stages follow the crank angle within
the step. Work and losses are integrated with the same weights.

Source: R. Alexander, Diagonally implicit Runge–Kutta methods for stiff O.D.E.'s, SIAM J. Numer. Anal. 14 (1977) 1006.
"""

import math

from cranktrain.core.kernel import kernel
from cranktrain.modules.valve_train import slots as at
from cranktrain.modules.valve_train.stage import OK, close_stage, open_stage, solve_stage

GAMMA = 1.0 - math.sqrt(0.5)
LEADING = 4.0 * GAMMA**3 + 3.0 * GAMMA**2 * (1.0 - 2.0 * GAMMA) - 1.0 / 6.0
"""Coefficient of h³ in a step's error, 0.0404."""
LONGEST_TURN = math.radians(2.0)
"""Longest step as crank angle, rad."""
LONGEST, SHORTEST = 1.0e-3, 1.0e-11
"""Longest and shortest step, s; if the shortest is still rejected, the step has failed."""
GROW = 3.0
"""Largest growth factor of a step."""
_SAFETY, _SHRINK = 0.9, 0.2


@kernel
def load_rows(model, work, state):
    """Load positions and velocities from the state into the workspace."""
    for i in range(work.rows.shape[0]):
        row, base = work.rows[i], at.N_HEAD + i * at.N_LINE
        for k in range(6):
            row[at.R_X0 + k] = state[base + at.X + k]
        row[at.R_A] = state[base + at.ACCELERATION]
        row[at.R_NOSE] = model.noses[i]
    shaft = work.shaft
    shaft[at.S_ANGLE0] = state[at.CAM_ANGLE]
    shaft[at.S_SPEED0] = state[at.CAM_SPEED]
    shaft[at.S_ALPHA] = state[at.CAM_ACCELERATION]


@kernel
def attempt(model, work, state, crank, speed, h):
    """Try a step of h, s, from half the crank angle (rad) at half the crank speed. Return error over tolerance.

    The end of the step is in the rows and the shaft of the workspace. Returns −1 if a stage has no solution.
    """
    load_rows(model, work, state)
    shaft, gh = work.shaft, GAMMA * h
    for k in (at.S_IMPULSE, at.S_FRICTION_WORK, at.S_DAMPED_WORK):
        shaft[k] = 0.0
    for i in range(work.rows.shape[0]):
        row = work.rows[i]
        for k in range(6):
            row[at.R_X + k] = row[at.R_X0 + k]
    shaft[at.S_ANGLE], shaft[at.S_SPEED] = shaft[at.S_ANGLE0], shaft[at.S_SPEED0]
    shaft[at.S_CRANK_SPEED] = speed
    shaft[at.S_CRANK_ANGLE] = crank + speed * gh
    open_stage(model, work, gh)
    if solve_stage(model, work, gh) != OK:
        return -1.0
    close_stage(model, work, gh)
    take_powers(model, work, h * (1.0 - GAMMA))
    second_start(work, h * (1.0 - GAMMA))
    shaft[at.S_CRANK_ANGLE] = crank + speed * h
    open_stage(model, work, gh)
    if solve_stage(model, work, gh) != OK:
        return -1.0
    close_stage(model, work, gh)
    take_powers(model, work, gh)
    return step_error(model, work, state, h)


@kernel
def second_start(work, part):
    """Set the start of the second stage: the step's start plus the first stage's rates times ``part``, s."""
    for i in range(work.rows.shape[0]):
        row = work.rows[i]
        row[at.R_A1] = row[at.R_A]
        row[at.R_X] = row[at.R_X0] + part * row[at.R_V]
        row[at.R_V] = row[at.R_V0] + part * row[at.R_A]
        for k in range(at.MODES):
            row[at.R_Q + k] = row[at.R_Q0 + k] + part * row[at.R_W + k]
            row[at.R_W + k] = row[at.R_W0 + k] + part * row[at.R_B + k]
    shaft = work.shaft
    shaft[at.S_ALPHA1] = shaft[at.S_ALPHA]
    shaft[at.S_ANGLE] = shaft[at.S_ANGLE0] + part * shaft[at.S_SPEED]
    shaft[at.S_SPEED] = shaft[at.S_SPEED0] + part * shaft[at.S_ALPHA]


@kernel
def take_powers(model, work, weight):
    """Add the work of drive, friction and dampers in a stage, with its weight, s."""
    n, shaft = model.numbers, work.shaft
    lead, rate = shaft[at.S_CRANK_ANGLE] - shaft[at.S_ANGLE], shaft[at.S_CRANK_SPEED] - shaft[at.S_SPEED]
    if lead < 0.0:
        lead, rate = -lead, -rate
    lost = damped_power(lead - n[at.HALF_GAP], rate, n[at.DRIVE], abs(shaft[at.S_TORQUE]))
    rubbed = n[at.DRAG] * shaft[at.S_SPEED] ** 2
    for i in range(work.rows.shape[0]):
        row = work.rows[i]
        for k in range(at.MODES):
            lost += n[at.MODAL_DAMPING + k] * row[at.R_W + k] ** 2
        lost += damped_power(-row[at.R_X], -row[at.R_V], n[at.SEAT], row[at.R_SEAT])
        depth = n[at.RATIO] * row[at.R_LIFT] - n[at.LASH] - row[at.R_X]
        rate = n[at.RATIO] * row[at.R_SLOPE] * shaft[at.S_SPEED] - row[at.R_V]
        lost += damped_power(depth, rate, n[at.STIFFNESS], row[at.R_FORCE])
        rubbed += row[at.R_FORCE] * row[at.R_ARM] * shaft[at.S_SPEED]
    shaft[at.S_IMPULSE] += weight * shaft[at.S_TORQUE]
    shaft[at.S_FRICTION_WORK] += weight * rubbed
    shaft[at.S_DAMPED_WORK] += weight * lost


@kernel
def damped_power(depth, rate, stiffness, force):
    """Power that a contact dissipates, W; also if the mass leaves faster than the contact force could follow."""
    return (force - stiffness * depth) * rate if depth > 0.0 else 0.0


@kernel
def step_error(model, work, state, h):
    """Largest error of a velocity in a step, over the tolerance."""
    n, shaft = model.numbers, work.shaft
    worst = abs(third(state[at.CAM_ACCELERATION], shaft[at.S_ALPHA1], shaft[at.S_ALPHA])) * n[at.DRIVE_RADIUS]
    for i in range(work.rows.shape[0]):
        row = work.rows[i]
        old = state[at.N_HEAD + i * at.N_LINE + at.ACCELERATION]
        worst = max(worst, abs(third(old, row[at.R_A1], row[at.R_A])))
    return worst * h * LEADING / (n[at.TOLERANCE] * n[at.VELOCITY])


@kernel
def third(a, b, c):
    """Second derivative times h² of a quantity with values a at the start, b at γh and c at h."""
    return 2.0 * ((c - b) / (1.0 - GAMMA) - (b - a) / GAMMA)


@kernel
def keep_step(work, state):
    """Store the end of a step in the state."""
    shaft = work.shaft
    for i in range(work.rows.shape[0]):
        row, base = work.rows[i], at.N_HEAD + i * at.N_LINE
        for k in range(6):
            state[base + at.X + k] = row[at.R_X + k]
        state[base + at.ACCELERATION] = row[at.R_A]
    state[at.CAM_ANGLE] = shaft[at.S_ANGLE]
    state[at.CAM_SPEED] = shaft[at.S_SPEED]
    state[at.CAM_ACCELERATION] = shaft[at.S_ALPHA]
    state[at.WORK] += shaft[at.S_IMPULSE] * shaft[at.S_CRANK_SPEED]
    state[at.FRICTION_WORK] += shaft[at.S_FRICTION_WORK]
    state[at.DAMPED] += shaft[at.S_DAMPED_WORK]
    state[at.STEPS] += 1.0


@kernel
def next_size(error, h):
    """Length of the next step, s, after a step of h with the ``error`` over tolerance."""
    factor = GROW if error <= 0.0 else min(max(_SAFETY * error ** (-1.0 / 3.0), _SHRINK), GROW)
    return h * factor
