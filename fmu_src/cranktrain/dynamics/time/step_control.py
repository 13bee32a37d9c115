"""Step control: sub-steps of a communication step and their halving.

A communication step H has n = ceil(Ω H/Δθ − 1e-9) sub-steps h = H/n. If h is within 1e-9 of the last one, value and
factors of the last one are used, so masters that compute H by subtraction change nothing.

Steps are halves, quarters, … of a sub-step, each at a multiple of its own length, so factors are made once for each
length. A step is halved if films close fast, after a failure, and with adaptive control if its estimated error exceeds
the tolerance or an event lies within it. It grows again when the error allows.
"""

import math

from cranktrain.core.kernel import call_kernel, inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model import state as st
from cranktrain.dynamics.model.layout import block_port_count, port_count, turning_modes
from cranktrain.dynamics.model.state import defect_offset, offset
from cranktrain.dynamics.motion.bodies import factor_stage, to_ports
from cranktrain.dynamics.motion.crank_pin import tell_twist
from cranktrain.dynamics.motion.film_memory import close_step, fastest_closing, motion_size, open_step
from cranktrain.dynamics.motion.gas import (
    built_in,
    burn_share,
    crank_rotation,
    encoder_end,
    find_pressure,
    given_pressure,
)
from cranktrain.dynamics.motion.linear_algebra import dot
from cranktrain.dynamics.motion.relative import move_axis, relative_motion
from cranktrain.dynamics.time.error_estimate import event_within, remember_outputs, step_error
from cranktrain.dynamics.time.reconstruction import take_stage
from cranktrain.dynamics.time.stage import FIRST_CONTRACTION
from cranktrain.dynamics.time.status import OK, SINGULAR, STALLED, WORK_SPENT
from cranktrain.dynamics.time.table import C_V, EXPLICIT_FIRST, FAMILY, FIRST_STAGE, HEAD, NODE, STAGES, coefficients
from cranktrain.dynamics.time.work_limit import cut_short, spent
from cranktrain.loads.drive_line import following_motion, frame_lead, shaft_motion
from cranktrain.loads.gas_pressure import CYCLE

MAX_HALVINGS = 6
PARTS = 1 << MAX_HALVINGS
"""Number of the shortest parts in a sub-step."""
MOST_STEPS = 1.0e6
"""Most internal steps of a communication step, so that an impossible state cannot keep a caller waiting for ever."""
FILM_HALVINGS = 3
"""Most halvings of a step because a film changes fast."""
EVENT_HALVINGS = 1
"""Additional halvings of a step if an event lies within it."""
REJECTED = 2.0
"""Error, in tolerances, above which a step is repeated; an error between 1 and REJECTED halves the next step."""
MARGIN = 0.5
"""Largest predicted error, in units of the tolerance, at which the next step is doubled."""
REFACTOR = 0.01
"""S is factorised again if the shaft's speed differs from Ω₀ by this fraction; stages iterate smaller differences."""
ROUNDED = 1.0e-9
"""Rounding: angle (rad) by which a cycle's end may be missed, and relative difference of two equal steps."""
STEPPING_SPEED = 60.0
"""Speed (rad/s) below which sub-steps no longer get longer, because the structure also vibrates at standstill."""


@inlined_kernel
def base_motion(model, work, state, begin, tau):
    """Angle, speed and acceleration of the shaft of given speed, at a time ``tau`` (s) into a sub-step.

    If a torque loads the shaft instead, they are those of a frame that follows the crank. The fourth value is the one
    that the state keeps as the shaft's acceleration.
    """
    if model.scalars[at.DRIVEN] == 0.0:
        rotation, rate, change = crank_rotation(model, state)
        return following_motion(
            state[st.SHAFT_ANGLE], state[st.SHAFT_SPEED], state[st.SHAFT_ACCELERATION], rotation, rate, change, tau
        )
    target = work.inputs[at.VALUE, 0] + work.inputs[at.RATE, 0] * begin
    angle, speed, acceleration = shaft_motion(
        state[st.SHAFT_ANGLE], state[st.SHAFT_SPEED], state[st.SHAFT_ACCELERATION], target, work.inputs[at.RATE, 0],
        model.scalars[at.FILTER], tau,
    )  # fmt: skip
    return angle, speed, acceleration, acceleration


@inlined_kernel
def frame_at(model, work, state, begin, tau, frame, pressures):
    """Frame motion and given pressures at ``tau`` (s) into a sub-step that starts ``begin`` (s) into the interval.

    Pressures that depend on the angle follow the pins in the stage. The rotation of an encoder at another position than
    the pins is an initial guess by Taylor's series.
    """
    angle, speed, acceleration, _ = base_motion(model, work, state, begin, tau)
    n = model.omega2.shape[0]
    rotation, rate, change = crank_rotation(model, state)
    frame[at.LEAD], frame[at.LEAD_RATE], lead_acceleration = frame_lead(
        state[st.LEAD_ANGLE], state[st.LEAD_SPEED], rotation, rate, change, state[st.SHAFT_SPEED], tau
    )
    frame[at.THETA] = angle + frame[at.LEAD]
    frame[at.OMEGA] = speed + frame[at.LEAD_RATE]
    frame[at.OMEGA_DOT] = acceleration + lead_acceleration
    frame[at.WHIRL] = frame[at.OMEGA]
    frame[at.COS] = math.cos(frame[at.THETA])
    frame[at.SIN] = math.sin(frame[at.THETA])
    load = model.cylinders.shape[0] + at.LOAD_INPUT
    frame[at.LOAD] = work.inputs[at.VALUE, load] + work.inputs[at.RATE, load] * (begin + tau)
    valves = model.cylinders.shape[0] + at.VALVE_INPUT
    frame[at.VALVE_GIVEN] = work.inputs[at.VALUE, valves] + work.inputs[at.RATE, valves] * (begin + tau)
    frame[at.VALVE_TORQUE] = model.layout[at.VALVE_HERE] * frame[at.VALVE_GIVEN]
    axial = model.cylinders.shape[0] + at.AXIAL_INPUT
    frame[at.AXIAL_GIVEN] = work.inputs[at.VALUE, axial] + work.inputs[at.RATE, axial] * (begin + tau)
    frame[at.AXIAL_FORCE] = model.layout[at.AXIAL_HERE] * frame[at.AXIAL_GIVEN]
    frame[at.FIRING] = frame[at.THETA]
    if block_port_count(model) > 0:
        # Dead centre refers to the cylinders, so the angle is relative to the block, which may roll on its mounts.
        t = turning_modes(model)
        for i in range(6):
            frame[at.FIRING] -= model.block.motion[at.ROTATION, i] * (
                state[offset(st.POSITION, n) + t + i]
                + tau * (state[offset(st.VELOCITY, n) + t + i] + 0.5 * tau * state[offset(st.ACCELERATION, n) + t + i])
            )
    frame[at.CRANK] = frame[at.THETA] + rotation + tau * (rate + 0.5 * tau * change)
    frame[at.BURN] = -1.0
    if built_in(model, state):
        frame[at.BURN] = burn_share(model, frame[at.OMEGA] - frame[at.LEAD_RATE])
        frame[at.ENCODED] = encoder_rotation(model, state, tau)
        return
    cylinders = model.cylinders.shape[0]
    for c in range(cylinders):
        if work.inputs[at.EXPONENT, 1 + c] <= 0.0:
            pressures[c] = given_pressure(model, work, c, 0.0, begin + tau)
            pressures[cylinders + c] = pressures[c]


@inlined_kernel
def encoder_rotation(model, state, tau):
    """Rotation (rad) at the encoder relative to the frame, ``tau`` (s) after the state; 0 for encoders at the pins."""
    if model.choices[at.ENCODER] == at.PIN:
        return 0.0
    n = model.omega2.shape[0]
    t = turning_modes(model)
    row = model.ends[encoder_end(model)]
    rotation = dot(row, state[offset(st.POSITION, n) :], t)
    rotation += tau * dot(row, state[offset(st.VELOCITY, n) :], t)
    return rotation + 0.5 * tau * tau * dot(row, state[offset(st.ACCELERATION, n) :], t)


@inlined_kernel
def ports_at_state(model, work, state):
    """Displacement, velocity and acceleration of the ports at the state, and their relative motion."""
    n = model.omega2.shape[0]
    for block in range(3):
        o = offset(block, n)
        to_ports(model, state[o : o + n], work.port[at.STATE_U + block])
    angle = state[st.SHAFT_ANGLE] + state[st.LEAD_ANGLE]
    relative_motion(
        model, math.cos(angle), math.sin(angle), state[st.SHAFT_SPEED] + state[st.LEAD_SPEED],
        work.port[at.STATE_U], work.port[at.STATE_UD], work.port[at.RELATIVE], work.port[at.RELATIVE_RATE],
    )  # fmt: skip


@inlined_kernel
def pressures_at_state(model, work, state):
    """Write cylinder pressures at the state to ``work.pressures[0]``, from frame ``work.frames[0]`` and ports.

    Also fills ``work.gas``.
    """
    frame = work.frames[0]
    u = work.port[at.STATE_U]
    move_axis(model, frame, u)
    for c in range(model.cylinders.shape[0]):
        rod = int(model.cylinders[c, at.END_ROW])
        spin = model.connections[rod, at.SPIN]
        tell_twist(u[spin] if spin >= 0 else 0.0, 0.0, 0.0, model.laws.numbers)
        find_pressure(model, work, frame, u, work.pressures[0], rod, True)


@inlined_kernel
def sub_step(model, work, state, begin, h, level):
    """Advance the state by one step h that starts ``begin`` (s) into the interval. Return a status (0: success).

    ``level``, the number of halvings of the sub-step that give h, chooses the factor cache slot.
    The ports at the state must be in ``work.port[STATE_U]`` and the two rows after it, their relative motion in
    ``work.port[RELATIVE]`` and the row after it.
    """
    n = model.omega2.shape[0]
    m = port_count(model)
    table = model.stages
    stages = int(table[HEAD, STAGES])
    for s in range(stages):
        if work.staged[0, at.STAGES_GIVEN] > 0.0:
            take_stage(work, (begin + table[FIRST_STAGE + s, NODE] * h) / state[st.LAST_INTERVAL])
        frame_at(model, work, state, begin, table[FIRST_STAGE + s, NODE] * h, work.frames[s], work.pressures[s])
    end = work.frames[stages - 1]
    omega = end[at.OMEGA] - end[at.LEAD_RATE]
    if abs(omega - state[st.OMEGA_REFERENCE]) > REFACTOR * abs(state[st.OMEGA_REFERENCE]):
        state[st.OMEGA_REFERENCE] = omega
    if h != state[st.STEP_LAST]:
        # The error of a Taylor series grows with the step's third power, so after a far shorter step it is rounding.
        share = h / state[st.STEP_LAST] if h <= (1 << MAX_HALVINGS) * state[st.STEP_LAST] else 0.0
        o = defect_offset(n)
        for k in range(st.MAX_STAGES * m):
            state[o + k] *= share * share * share
    slot = min(level, at.FACTOR_SLOTS - 1)
    if work.key[slot, at.KEY_STEP] != h or work.key[slot, at.KEY_SPEED] != state[st.OMEGA_REFERENCE]:
        c_q, c_v = coefficients(table, h)
        work.key[slot, at.KEY_STEP] = -1.0  # a matrix that turns out to be singular leaves no factors in the slot
        if factor_stage(model, work, slot, c_q, c_v, state[st.OMEGA_REFERENCE], 0.0, 0.0) != 0:
            return SINGULAR
        work.key[slot, at.KEY_STEP] = h
        work.key[slot, at.KEY_SPEED] = state[st.OMEGA_REFERENCE]
    open_step(model, work, state)
    angle, speed, _, acceleration = base_motion(model, work, state, begin, h)
    status: int = call_kernel(work.family[int(table[HEAD, FAMILY]), at.STEP_KERNEL], (model, work, state, slot, h))
    if status != OK:
        return status
    state[st.STEP_LAST] = h
    count_gas(work, table, state, h)
    close_step(model, work, state)
    if cycle_of(angle) != cycle_of(state[st.SHAFT_ANGLE]):
        # The estimate of the contraction fades with a period of its own, which would keep cycles from repeating.
        state[st.CONTRACTION] = FIRST_CONTRACTION
    state[st.SHAFT_ANGLE] = angle
    state[st.SHAFT_SPEED] = speed
    state[st.SHAFT_ACCELERATION] = acceleration
    state[st.LEAD_ANGLE] = end[at.LEAD]
    state[st.LEAD_SPEED] = end[at.LEAD_RATE]
    work.counters[at.N_STEPS] += 1.0
    return OK


@inlined_kernel
def count_gas(work, table, state, h):
    """Add the work of given pressures in a step h to the state, integrated with the weights of the method."""
    stages = int(table[HEAD, STAGES])
    last = work.frames[stages - 1]
    if last[at.BURN] >= 0.0:
        return
    if table[HEAD, EXPLICIT_FIRST] > 0.0:
        work.frames[0, at.GIVEN_POWER] = state[st.GAS_RATE]
    weight = table[HEAD, C_V] if stages > 1 else 1.0
    for s in range(stages - 1):
        state[st.GAS_DONE] += h * table[FIRST_STAGE + stages - 1, s] * work.frames[s, at.GIVEN_POWER]
    state[st.GAS_DONE] += h * weight * last[at.GIVEN_POWER]
    state[st.GAS_RATE] = last[at.GIVEN_POWER]


@inlined_kernel
def cycle_of(angle):
    """Number of the cycle that contains a shaft's angle (rad), safe against rounding at the end of a cycle."""
    return math.floor((angle + ROUNDED) / CYCLE)


@inlined_kernel
def chosen_halvings(model, work, state, begin, h, least):
    """Halvings of a sub-step h for its next part: at least ``least``, more for fast closing films or at events."""
    ports_at_state(model, work, state)
    adaptive = model.choices[at.STEP_TOLERANCE] > 0.0
    halvings = max(least, int(min(state[st.HALVINGS], MAX_HALVINGS))) if adaptive else least
    piece = h / (1 << halvings)
    rate = fastest_closing(model, work, state)
    while halvings < FILM_HALVINGS and rate * piece > model.choices[at.FILM_CHANGE]:
        halvings += 1
        piece *= 0.5
    if adaptive:
        rotation, rate, _ = crank_rotation(model, state)
        angle = state[st.SHAFT_ANGLE] + state[st.LEAD_ANGLE] + rotation
        speed = state[st.SHAFT_SPEED] + state[st.LEAD_SPEED] + rate
        for _ in range(EVENT_HALVINGS):
            if halvings == MAX_HALVINGS:
                break
            if event_within(model, work, state, built_in(model, state), angle, speed * piece, piece):
                halvings += 1
                piece *= 0.5
    return least if halvings > least and cut_short(model, work) else halvings


@kernel
def accept(model, work, state, h, halvings):
    """True if the step just taken meets the tolerance; also chooses the halvings of the next step."""
    error = step_error(model, work, state, h)
    growth = 1.0
    for _ in range(int(model.choices[at.EMBEDDED_ORDER]) + 1):
        growth *= 2.0
    if error > 1.0 and halvings < MAX_HALVINGS:
        state[st.HALVINGS] = halvings + 1
        if error > REJECTED and not cut_short(model, work):
            return False
    elif error * growth < MARGIN and halvings > 0:
        state[st.HALVINGS] = halvings - 1
    else:
        state[st.HALVINGS] = halvings
    if error > REJECTED:
        # No shorter step is possible, so the present step counts as missing its tolerance.
        work.counters[at.N_MISSED] += 1.0
    state[st.STEP_ERROR] = error
    remember_outputs(model, state, h)
    return True


@inlined_kernel
def turning_speed(state, inputs):
    """Speed (rad/s) that determines the length of sub-steps."""
    return max(abs(state[st.SHAFT_SPEED]), max(abs(inputs[0]), STEPPING_SPEED))


@kernel
def take_part(model, work, state, begin, h, done, halved, shift):
    """Take the next part of a sub-step h, of which ``done`` / PARTS is done; it starts ``begin`` into the interval.

    A part is halved, up to MAX_HALVINGS times, if a film would change by more than the allowed fraction in it, after a
    failure, and for adaptive control; at least ``halved`` times. ``shift``, a whole number, is added to the halvings to
    choose the factor cache slot. Returns a stage status, the new ``done``, and the least halvings of the next part.
    After a failure the state is that at the part's begin.
    """
    size = motion_size(model)
    while True:
        start = begin + h * (done / PARTS)
        halvings = chosen_halvings(model, work, state, start, h, halved)
        # Parts of a sub-step stay aligned: a half part begins at a multiple of a half.
        while done % (PARTS >> halvings) != 0:
            halvings += 1
        part = h / (1 << halvings)
        for i in range(size):
            work.backup[1, i] = state[i]
        status = sub_step(model, work, state, start, part, halvings + int(shift))
        if status == OK and (model.choices[at.STEP_TOLERANCE] == 0.0 or accept(model, work, state, part, halvings)):
            return OK, done + (PARTS >> halvings), halved if model.choices[at.STEP_TOLERANCE] == 0.0 else 0
        work.counters[at.N_REJECTED] += 1.0
        halved = halvings + 1
        if spent(model, work):
            halved = MAX_HALVINGS + 1
            status = WORK_SPENT
        for i in range(size):
            state[i] = work.backup[1, i]
        if halved > MAX_HALVINGS:
            return status, done, halved


@kernel
def take_sub_step(model, work, state, begin, h, shift):
    """Take all parts of a sub-step h that starts ``begin`` into the interval. Return a status and the number of parts.

    After a failure the state is that at the failed part's begin.
    """
    done = 0
    halved = 0
    taken = 0
    while done < PARTS:
        status, done, halved = take_part(model, work, state, begin, h, done, halved, float(shift))
        if status != OK:
            return status, taken
        taken += 1
    return OK, taken


@kernel
def take_interval(model, work, state, inputs, interval):
    """Advance the motion over a communication step of ``interval`` (s). Return a status (0: success) and steps taken.

    An engine that turns backwards under its load has stalled.
    """
    count = max(1, math.ceil(turning_speed(state, inputs) * interval / model.scalars[at.STEP] - ROUNDED))
    h = interval / count
    if abs(h - state[st.STEP_REFERENCE]) <= ROUNDED * h:
        h = state[st.STEP_REFERENCE]
    state[st.STEP_REFERENCE] = h
    taken = 0
    for k in range(count):
        status, parts = take_sub_step(model, work, state, k * h, h, 0)
        taken += parts
        if status != OK:
            return status, taken
    return STALLED if has_stalled(model, state) else OK, taken


@inlined_kernel
def has_stalled(model, state):
    """True if the engine turns backwards under its load."""
    return model.scalars[at.DRIVEN] == 0.0 and state[st.SHAFT_SPEED] < 0.0
