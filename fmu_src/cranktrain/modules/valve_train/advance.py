"""Valve train over one communication step: advance, static start, and outputs.

The crank rotates uniformly within a communication step. ``valvetrain.torque`` is the torque at the end of the step, for
partners that extrapolate it. ``valvetrain.torque_step`` is the mean over the step, for partners that hold it, and does
the same work as the drive.

Values stored over a cycle: seating, bounce, loss of contact, separation of the drive, work of the crank. A
line's cycle ends half a turn after its cam's nose; the cycle of drive and work ends with the crank's cycle.
"""

import math

from cranktrain.core.kernel import kernel
from cranktrain.modules import crank_angle as crank
from cranktrain.modules.crank_angle import cycle_angle, keep_received, turned
from cranktrain.modules.valve_train import slots as at
from cranktrain.modules.valve_train.cam import cam_radius, line_pressure, wrapped
from cranktrain.modules.valve_train.line import (
    drive_torque,
    follow_cam,
    friction_arm,
    line_energy,
    seat_force,
    train_force,
)
from cranktrain.modules.valve_train.stage import OK
from cranktrain.modules.valve_train.stepping import (
    GROW,
    LONGEST,
    LONGEST_TURN,
    SHORTEST,
    attempt,
    keep_step,
    load_rows,
    next_size,
)


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


FAILED = 1
MOST_PASSES = 5_000_000
"""Largest number of steps in a communication step (seconds of work); more count as a failure."""
_AT_END = 1.0e-12
"""Crank angle, rad, before the end of a cycle that counts as the end."""
_STILL = 100
"""Iterations of the static start; each reduces the residual by a factor of a thousand or more."""


@kernel
def advance(model, work, state, inputs, interval):
    """Advance the valve train by an interval, s. Return a status."""
    turn = turned(state, inputs, interval, model.choices[at.GIVEN_ANGLE], model.choices[at.ENDS])
    speed = turn / interval
    state[at.CRANK_SPEED] = speed
    friction, impulse, done = state[at.FRICTION_WORK], 0.0, 0.0
    for _ in range(MOST_PASSES):
        if done >= interval:
            break
        if 2.0 * math.pi - state[crank.OWN_ANGLE] <= _AT_END:
            end_crank_cycle(state)
        # A step ends at the end of the cycle.
        left, to_end = interval - done, 2.0 * math.pi - state[crank.OWN_ANGLE]
        ends = speed * left > to_end
        if ends:
            left = to_end / speed
        taken = one_step(model, work, state, speed, left)
        if taken < 0.0:
            return FAILED
        done = interval if taken == left and not ends else done + taken
        impulse += work.shaft[at.S_IMPULSE]
        state[crank.OWN_ANGLE] += speed * taken
    if done < interval:
        return FAILED
    state[at.TORQUE] = 0.5 * impulse / interval
    state[at.FRICTION_POWER] = (state[at.FRICTION_WORK] - friction) / interval
    keep_received(state, inputs, interval)
    return OK


@kernel
def one_step(model, work, state, speed, left):
    """Take one step at a crank speed, rad/s, within the time left, s. Return its length, or −1 on failure."""
    wanted = min(state[at.STEP], LONGEST)
    if speed * wanted > LONGEST_TURN:
        wanted = LONGEST_TURN / speed
    while wanted > SHORTEST or wanted >= left:
        h = left / math.ceil(left / wanted - 1.0e-9) if left > wanted else left
        error = attempt(model, work, state, 0.5 * state[crank.OWN_ANGLE], 0.5 * speed, h)
        if 0.0 <= error <= 1.0:
            remember(model, work, state, h)
            keep_step(work, state)
            # A step that was cut short does not tell how long the next step may be.
            longer = next_size(error, h)
            state[at.STEP] = max(longer, state[at.STEP]) if longer >= GROW * h else longer
            return h
        state[at.REJECTED] += 1.0
        wanted = next_size(error, h) if error > 1.0 else 0.25 * h
    return -1.0


@kernel
def rest_place(model, row):
    """Static lift, m, of a valve line on its present cam position, and its derivative by the train's lift."""
    n = model.numbers
    z = n[at.RATIO] * row[at.R_LIFT] - n[at.LASH]
    closed = -n[at.PRELOAD] / (n[at.SEAT] + n[at.RATE])
    if z <= closed:
        return closed, 0.0
    push, hold = n[at.STIFFNESS] * z - n[at.PRELOAD], n[at.STIFFNESS] + n[at.RATE]
    if push < 0.0:
        hold += n[at.SEAT]
    return push / hold, n[at.STIFFNESS] / hold


@kernel
def stand(model, work, state, inputs):
    """Put camshaft and valves in static balance at the crank's angle, with velocities that follow from its speed."""
    n = model.numbers
    state[crank.OWN_ANGLE] = cycle_angle(inputs[crank.ANGLE])
    state[crank.PARTNER_ANGLE] = inputs[crank.ANGLE]
    state[at.STEP] = LONGEST
    speed = 0.5 * inputs[crank.SPEED]
    lead = 0.0
    for _ in range(_STILL):
        state[at.CAM_ANGLE] = 0.5 * state[crank.OWN_ANGLE] - lead
        load_rows(model, work, state)
        torque = n[at.DRAG] * speed
        for i in range(work.rows.shape[0]):
            row, base = work.rows[i], at.N_HEAD + i * at.N_LINE
            follow_cam(model.cams[i % 2], row, state[at.CAM_ANGLE])
            x, by_lift = rest_place(model, row)
            state[base + at.X] = x
            state[base + at.V] = by_lift * n[at.RATIO] * row[at.R_SLOPE] * speed
            force = n[at.STIFFNESS] * max(n[at.RATIO] * row[at.R_LIFT] - n[at.LASH] - x, 0.0)
            torque += force * (n[at.RATIO] * row[at.R_SLOPE] + friction_arm(n, row[at.R_LIFT], speed)[0])
        lead = torque / n[at.DRIVE] + (n[at.HALF_GAP] if torque >= 0.0 else -n[at.HALF_GAP])
    state[at.CAM_SPEED] = speed
    state[at.CRANK_SPEED] = inputs[crank.SPEED]
    state[at.TORQUE] = 0.5 * torque
    return OK


@kernel
def energy(model, work, state):
    """Kinetic and elastic energy of the valve train, J."""
    n = model.numbers
    place(model, work, state)
    depth = max(abs(0.5 * state[crank.OWN_ANGLE] - state[at.CAM_ANGLE]) - n[at.HALF_GAP], 0.0)
    total = 0.5 * n[at.INERTIA] * state[at.CAM_SPEED] ** 2 + 0.5 * n[at.DRIVE] * depth * depth
    for i in range(work.rows.shape[0]):
        total += line_energy(n, model.cams[i % 2, at.MASS], work.rows[i])
    return total


@kernel
def place(model, work, state):
    """Set the workspace's rows to the state: positions, velocities and the cams' lifts."""
    load_rows(model, work, state)
    for i in range(work.rows.shape[0]):
        row = work.rows[i]
        for k in range(6):
            row[at.R_X + k] = row[at.R_X0 + k]
        follow_cam(model.cams[i % 2], row, state[at.CAM_ANGLE])


@kernel
def observe(model, work, state, out):
    """Write the outputs in the order of ``OUTPUTS``, then of ``LINE_OUTPUTS`` for each line, into ``out``."""
    n = model.numbers
    gained = energy(model, work, state) - state[at.FIRST_ENERGY]
    lag = 0.5 * state[crank.OWN_ANGLE] - state[at.CAM_ANGLE]
    rate = 0.5 * state[at.CRANK_SPEED] - state[at.CAM_SPEED]
    torque, _, _ = drive_torque(n, lag, rate)
    out[at.OUT_TORQUE] = 0.5 * torque
    out[at.OUT_TORQUE_STEP] = state[at.TORQUE]
    out[at.OUT_TORQUE_MEAN] = state[at.TORQUE_MEAN]
    out[at.OUT_LAG] = lag
    out[at.OUT_SPEED] = state[at.CAM_SPEED]
    out[at.OUT_DRIVE_TORQUE] = torque
    out[at.OUT_DRIVE_FORCE] = torque / n[at.DRIVE_RADIUS]
    out[at.OUT_APART] = state[at.APART]
    out[at.OUT_FRICTION] = state[at.FRICTION_POWER]
    out[at.OUT_BALANCE] = gained - state[at.WORK] + state[at.FRICTION_WORK] + state[at.DAMPED]
    out[at.OUT_STEPS] = state[at.STEPS]
    out[at.OUT_REJECTED] = state[at.REJECTED]
    out[at.OUT_LOSS] = 0.0
    for i in range(work.rows.shape[0]):
        first = at.N_OUTPUTS + i * at.N_LINE_OUTPUTS
        observe_line(n, work.rows[i], state, at.N_HEAD + i * at.N_LINE, out[first : first + at.N_LINE_OUTPUTS])
        out[at.OUT_LOSS] = max(out[at.OUT_LOSS], out[first + at.OUT_LINE_LOSS])
    return OK


@kernel
def observe_line(n, row, state, base, out):
    """Write the outputs of a line whose row is set to the state."""
    force, _, _, _, _ = train_force(n, row, state[at.CAM_SPEED])
    on_cam = n[at.RATIO] * force
    out[at.OUT_LIFT] = max(row[at.R_X], 0.0)
    out[at.OUT_CAM_FORCE] = on_cam
    radius = cam_radius(n[at.BASE_RADIUS], n[at.ROLLER_RADIUS], row[at.R_LIFT], row[at.R_SLOPE], row[at.R_CURVE])
    if n[at.ROLLER_RADIUS] > 0.0:
        pitch = n[at.BASE_RADIUS] + n[at.ROLLER_RADIUS] + row[at.R_LIFT]
        on_cam *= math.sqrt(1.0 + (row[at.R_SLOPE] / pitch) ** 2)
    out[at.OUT_PRESSURE] = line_pressure(on_cam, n[at.CAM_WIDTH], n[at.CONTACT_MODULUS], radius, n[at.ROLLER_RADIUS])
    spring = n[at.PRELOAD] + n[at.RATE] * row[at.R_X]
    for k in range(at.MODES):
        spring += n[at.RATE] * (k + 1) * math.pi * row[at.R_Q + k]
    out[at.OUT_SPRING] = spring
    out[at.OUT_SEAT] = seat_force(n, row)[0]
    out[at.OUT_VELOCITY] = state[base + at.IMPACT]
    out[at.OUT_LINE_LOSS] = state[base + at.LOSS]
    out[at.OUT_BOUNCE] = state[base + at.BOUNCE]
