"""Sub-steps of an interval and their halving.

Sub-steps of an interval H: n = ceil(Ω H/Δθ − 1e-9), h = H/n; an h within 1e-9 of the last one reuses its factors and
its value, so masters that compute H by subtraction change nothing.

Steps are halves, quarters, … of a sub-step, each at a multiple of its own length: factors are made once for each. A
step is halved where films close fast, after a failure, and with adaptive control where its estimated error exceeds the
tolerance or an event lies within it; it grows again when the error allows.
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import call_kernel, inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import has_additions, port_count
from cranktrain.dynamics.model.state import (
    ACCELERATION,
    CONTRACTION,
    GAS_DONE,
    GAS_RATE,
    HALVINGS,
    LAST_INTERVAL,
    LEAD_ANGLE,
    LEAD_SPEED,
    MAX_STAGES,
    OMEGA_REFERENCE,
    POSITION,
    SHAFT_ACCELERATION,
    SHAFT_ANGLE,
    SHAFT_SPEED,
    STEP_ERROR,
    STEP_LAST,
    STEP_REFERENCE,
    VELOCITY,
    defect_offset,
    offset,
)
from cranktrain.dynamics.motion.equations import factor_stage
from cranktrain.dynamics.motion.film_memory import close_step, fastest_closing, motion_size, open_step
from cranktrain.dynamics.motion.gas import (
    built_in,
    burn_share,
    crank_rotation,
    cylinder_pressure,
    encoder_end,
    given_pressure,
    own_angle,
    volume_over,
)
from cranktrain.dynamics.motion.linear_algebra import dot
from cranktrain.dynamics.motion.relative import move_axis, relative_motion
from cranktrain.dynamics.motion.rod_motion import CROSS, X, Y, rod_end_across
from cranktrain.dynamics.motion.rods import piston_rise
from cranktrain.dynamics.time.error_estimate import event_within, remember_outputs, step_error
from cranktrain.dynamics.time.reconstruction import take_stage
from cranktrain.dynamics.time.stage import FIRST_CONTRACTION, to_ports
from cranktrain.dynamics.time.status import OK, SINGULAR, STALLED, WORK_SPENT
from cranktrain.dynamics.time.table import C_V, EXPLICIT_FIRST, FAMILY, FIRST_STAGE, HEAD, NODE, STAGES, coefficients
from cranktrain.dynamics.time.work_limit import cut_short, spent
from cranktrain.dynamics.topology import slots as added
from cranktrain.loads.drive_line import following_motion, frame_lead, shaft_motion
from cranktrain.loads.gas_pressure import CYCLE

MAX_HALVINGS = 6
PARTS = 1 << MAX_HALVINGS
"""Least parts of a sub-step in it."""
MOST_STEPS = 1.0e6
"""Internal steps of a communication step at most: a state that is not one of a run cannot keep a caller for ever."""
FILM_HALVINGS = 3
"""Halvings at most because a film changes fast."""
EVENT_HALVINGS = 1
"""Halvings more where an event lies within a step."""
REJECTED = 2.0
"""Error in tolerances at which a step is taken again; below, the next one is halved."""
MARGIN = 0.5
"""Error in tolerances that a step of twice the length may promise."""
REFACTOR = 0.01
"""S is made anew when the shaft's speed has left Ω₀ by this share; what is left over is iterated in the stage."""
ROUNDED = 1.0e-9
"""rad by which an angle may miss a cycle's end; share of a step by which two steps of one length differ."""
STEPPING_SPEED = 60.0
"""rad/s below which sub-steps no longer grow with falling speed: the structure vibrates at standstill as well."""


@inlined_kernel
def base_motion(model, work, state, begin, tau):
    """Angle, speed and acceleration of the shaft whose speed is given, ``tau`` into a sub-step.

    Where a torque loads the shaft instead, they are those of a frame that follows the crank. Last comes what the state
    keeps as the shaft's acceleration.
    """
    if model.scalars[at.DRIVEN] == 0.0:
        rotation, rate, change = crank_rotation(model, state)
        return following_motion(
            state[SHAFT_ANGLE], state[SHAFT_SPEED], state[SHAFT_ACCELERATION], rotation, rate, change, tau
        )
    target = work.inputs[at.VALUE, 0] + work.inputs[at.RATE, 0] * begin
    angle, speed, acceleration = shaft_motion(
        state[SHAFT_ANGLE], state[SHAFT_SPEED], state[SHAFT_ACCELERATION], target, work.inputs[at.RATE, 0],
        model.scalars[at.FILTER], tau,
    )  # fmt: skip
    return angle, speed, acceleration, acceleration


@inlined_kernel
def frame_at(model, work, state, begin, tau, frame, pressures):
    """Frame motion at ``tau`` into a sub-step that starts ``begin`` into the interval, and pressures that go by time.

    Pressures that go by angle follow the pins in the stage. Where an encoder sits elsewhere, the rotation of its place
    is a first guess by Taylor's series.
    """
    angle, speed, acceleration, _ = base_motion(model, work, state, begin, tau)
    n = model.omega2.shape[0]
    rotation, rate, change = crank_rotation(model, state)
    frame[at.LEAD], frame[at.LEAD_RATE], lead_acceleration = frame_lead(
        state[LEAD_ANGLE], state[LEAD_SPEED], rotation, rate, change, state[SHAFT_SPEED], tau
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
    frame[at.VALVE_TORQUE] = work.inputs[at.VALUE, valves] + work.inputs[at.RATE, valves] * (begin + tau)
    axial = model.cylinders.shape[0] + at.AXIAL_INPUT
    frame[at.AXIAL_FORCE] = work.inputs[at.VALUE, axial] + work.inputs[at.RATE, axial] * (begin + tau)
    frame[at.FIRING] = frame[at.THETA]
    if model.block_ports.shape[0] > 0:
        # Dead centre is where the cylinders point: an encoder turns with the block that leans on its mounts.
        t = model.ports.shape[1]
        for i in range(6):
            frame[at.FIRING] -= model.block.motion[at.ROTATION, i] * (
                state[offset(POSITION, n) + t + i]
                + tau * (state[offset(VELOCITY, n) + t + i] + 0.5 * tau * state[offset(ACCELERATION, n) + t + i])
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
    """Rotation (rad) of the encoder's place against the frame, ``tau`` (s) after the state; 0 at the pins."""
    if model.choices[at.ENCODER] == at.PIN:
        return 0.0
    n = model.omega2.shape[0]
    t = model.ports.shape[1]
    row = model.ends[encoder_end(model)]
    rotation = dot(row, state[offset(POSITION, n) :], t)
    rotation += tau * dot(row, state[offset(VELOCITY, n) :], t)
    return rotation + 0.5 * tau * tau * dot(row, state[offset(ACCELERATION, n) :], t)


@inlined_kernel
def ports_at_state(model, work, state):
    """Displacement, velocity, acceleration of the ports, from the state, and their relative motion."""
    n = model.omega2.shape[0]
    for block in range(3):
        o = offset(block, n)
        to_ports(model, state[o : o + n], work.port[at.STATE_U + block])
    angle = state[SHAFT_ANGLE] + state[LEAD_ANGLE]
    relative_motion(
        model, math.cos(angle), math.sin(angle), state[SHAFT_SPEED] + state[LEAD_SPEED],
        work.port[at.STATE_U], work.port[at.STATE_UD], work.port[at.RELATIVE], work.port[at.RELATIVE_RATE],
    )  # fmt: skip


@inlined_kernel
def pressures_at_state(model, work, state):
    """Cylinder pressures at the state into ``work.pressures[0]``; its frame in ``work.frames[0]``, its ports known.

    Fills ``work.rises`` of a flexible block.
    """
    frame = work.frames[0]
    u, ud, udd = work.port[at.STATE_U], work.port[at.STATE_UD], work.port[at.STATE_UDD]
    move_axis(model, frame, u)
    if model.block_ports.shape[0] > 0:
        n = model.omega2.shape[0]
        first = offset(POSITION, n) + model.ports.shape[1]
        for c in range(model.cylinders.shape[0]):
            for k in range(2):
                work.rises[c, k] = dot(model.block.heads[c], state[first + k * n :], model.block.preload.shape[0])
    cylinders = model.cylinders.shape[0]
    for c in range(cylinders):
        rod_end_across(model, frame, c, u, ud, udd, work.scratch)
        _, _, height, _ = piston_rise(model, c, u, ud, work.scratch[CROSS:])
        angle = own_angle(model, frame, u, work.scratch[X], work.scratch[Y], c)
        volume = volume_over(model.cylinders[c], height - work.rises[c, 0])
        work.pressures[0, c], _ = cylinder_pressure(
            model, work, frame, c, angle, volume, work.pressures[0, cylinders + c]
        )


@inlined_kernel
def film_rate(model, work, state):
    """Largest rate (1/s) at which a film's least gap changes, over itself, from the ports at the state."""
    rate = fastest_closing(model, work, state, state[SHAFT_SPEED] + state[LEAD_SPEED])
    if has_additions(model):
        call_kernel(model.links.hooks[added.AT_RATE], (model, work, state))
        rate = max(rate, work.added.sizes[added.CLOSING])
    return rate


@inlined_kernel
def sub_step(model, work, state, begin, h, level):
    """Advance the whole state by one step h that starts ``begin`` into the interval; a stage status.

    ``level`` chooses the factor cache slot: halvings of the sub-step, of which h is a part.
    The ports at the state must be in ``work.port[STATE_U]`` and the two rows after it, their relative motion in
    ``work.port[RELATIVE]`` and the row after it.
    """
    n = model.omega2.shape[0]
    m = port_count(model)
    table = model.stages
    stages = int(table[HEAD, STAGES])
    for s in range(stages):
        if work.staged[0, at.STAGES_GIVEN] > 0.0:
            take_stage(work, (begin + table[FIRST_STAGE + s, NODE] * h) / state[LAST_INTERVAL])
        frame_at(model, work, state, begin, table[FIRST_STAGE + s, NODE] * h, work.frames[s], work.pressures[s])
    end = work.frames[stages - 1]
    omega = end[at.OMEGA] - end[at.LEAD_RATE]
    if abs(omega - state[OMEGA_REFERENCE]) > REFACTOR * abs(state[OMEGA_REFERENCE]):
        state[OMEGA_REFERENCE] = omega
    if h != state[STEP_LAST]:
        # What a series misses grows with the third power of the step; of a far shorter one only rounding is known.
        share = h / state[STEP_LAST] if h <= (1 << MAX_HALVINGS) * state[STEP_LAST] else 0.0
        o = defect_offset(n)
        for k in range(MAX_STAGES * m):
            state[o + k] *= share * share * share
    slot = min(level, at.FACTOR_SLOTS - 1)
    if work.key[slot, at.KEY_STEP] != h or work.key[slot, at.KEY_SPEED] != state[OMEGA_REFERENCE]:
        c_q, c_v = coefficients(table, h)
        if factor_stage(model, work, slot, c_q, c_v, state[OMEGA_REFERENCE], 0.0, 0.0) != 0:
            return SINGULAR
        work.key[slot, at.KEY_STEP] = h
        work.key[slot, at.KEY_SPEED] = state[OMEGA_REFERENCE]
    open_step(model, work, state)
    angle, speed, _, acceleration = base_motion(model, work, state, begin, h)
    status: int = call_kernel(work.family[int(table[HEAD, FAMILY]), at.STEP_KERNEL], (model, work, state, slot, h))
    if status != OK:
        return status
    state[STEP_LAST] = h
    count_gas(work, table, state, h)
    close_step(model, work, state)
    if cycle_of(angle) != cycle_of(state[SHAFT_ANGLE]):
        # What fades from stage to stage keeps a period of its own, with which no cycle would repeat.
        state[CONTRACTION] = FIRST_CONTRACTION
    state[SHAFT_ANGLE] = angle
    state[SHAFT_SPEED] = speed
    state[SHAFT_ACCELERATION] = acceleration
    state[LEAD_ANGLE] = end[at.LEAD]
    state[LEAD_SPEED] = end[at.LEAD_RATE]
    work.counters[at.N_STEPS] += 1.0
    return OK


@inlined_kernel
def count_gas(work, table, state, h):
    """Add the work of given pressures in a step h to the state, by the weights with which the method adds up rates."""
    stages = int(table[HEAD, STAGES])
    last = work.frames[stages - 1]
    if last[at.BURN] >= 0.0:
        return
    if table[HEAD, EXPLICIT_FIRST] > 0.0:
        work.frames[0, at.GIVEN_POWER] = state[GAS_RATE]
    weight = table[HEAD, C_V] if stages > 1 else 1.0
    for s in range(stages - 1):
        state[GAS_DONE] += h * table[FIRST_STAGE + stages - 1, s] * work.frames[s, at.GIVEN_POWER]
    state[GAS_DONE] += h * weight * last[at.GIVEN_POWER]
    state[GAS_RATE] = last[at.GIVEN_POWER]


@inlined_kernel
def cycle_of(angle):
    """Number of the cycle in which a shaft's angle (rad) lies; rounding does not put its end into the next."""
    return math.floor((angle + ROUNDED) / CYCLE)


@inlined_kernel
def chosen_halvings(model, work, state, begin, h, least):
    """Halvings of a sub-step h for the piece to come: at least so many, more where films close fast or at events."""
    ports_at_state(model, work, state)
    adaptive = model.choices[at.STEP_TOLERANCE] > 0.0
    halvings = max(least, int(min(state[HALVINGS], MAX_HALVINGS))) if adaptive else least
    piece = h / (1 << halvings)
    rate = film_rate(model, work, state)
    while halvings < FILM_HALVINGS and rate * piece > model.choices[at.FILM_CHANGE]:
        halvings += 1
        piece *= 0.5
    if adaptive:
        rotation, rate, _ = crank_rotation(model, state)
        angle = state[SHAFT_ANGLE] + state[LEAD_ANGLE] + rotation
        speed = state[SHAFT_SPEED] + state[LEAD_SPEED] + rate
        for _ in range(EVENT_HALVINGS):
            if halvings == MAX_HALVINGS:
                break
            if event_within(model, work, state, built_in(model, state), angle, speed * piece, piece):
                halvings += 1
                piece *= 0.5
    return least if halvings > least and cut_short(model, work) else halvings


@kernel
def accept(model, work, state, h, halvings):
    """Whether the step just taken meets the tolerance; chooses the halvings of the next one."""
    error = step_error(model, work, state, h)
    growth = 1.0
    for _ in range(int(model.choices[at.EMBEDDED_ORDER]) + 1):
        growth *= 2.0
    if error > 1.0 and halvings < MAX_HALVINGS:
        state[HALVINGS] = halvings + 1
        if error > REJECTED and not cut_short(model, work):
            return False
    elif error * growth < MARGIN and halvings > 0:
        state[HALVINGS] = halvings - 1
    else:
        state[HALVINGS] = halvings
    if error > REJECTED:
        # Nothing shorter is left: the step counts as one that missed its tolerance.
        work.counters[at.N_MISSED] += 1.0
    state[STEP_ERROR] = error
    remember_outputs(model, state, h)
    return True


@inlined_kernel
def turning_speed(state, inputs):
    """Speed (rad/s) by which the length of sub-steps goes."""
    return max(abs(state[SHAFT_SPEED]), max(abs(inputs[0]), STEPPING_SPEED))


@kernel
def take_part(model, work, state, begin, h, done, halved, shift):
    """Take the next part of a sub-step h that starts ``begin`` into the interval; ``done`` / PARTS of it is done.

    A part is halved, up to MAX_HALVINGS times, while a film would change by more than its share over it, after a
    failure, and as adaptive control asks; at least ``halved`` times. ``shift``, a whole number, is added to its number
    of halvings in the choice of its factor cache slot. Returns a stage status, how much is done then, and the least
    halvings of the next part. On a failure the state is that of the part's begin.
    """
    size = motion_size(model)
    while True:
        start = begin + h * (done / PARTS)
        halvings = chosen_halvings(model, work, state, start, h, halved)
        # Parts stay aligned: a half begins at a multiple of a half.
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
    """Take all parts of one sub-step h that starts ``begin`` into the interval; a stage status, and how many they were.

    On a failure the state is that of the failed part's begin.
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
    """Advance the motion over a whole communication step of ``interval`` (s); a stage status, and steps taken.

    An engine that would turn backwards under its load has stalled.
    """
    count = max(1, math.ceil(turning_speed(state, inputs) * interval / model.scalars[at.STEP] - ROUNDED))
    h = interval / count
    if abs(h - state[STEP_REFERENCE]) <= ROUNDED * h:
        h = state[STEP_REFERENCE]
    state[STEP_REFERENCE] = h
    taken = 0
    for k in range(count):
        status, parts = take_sub_step(model, work, state, k * h, h, 0)
        taken += parts
        if status != OK:
            return status, taken
    return STALLED if has_stalled(model, state) else OK, taken


@inlined_kernel
def has_stalled(model, state):
    """Whether the engine turns backwards under its load."""
    return model.scalars[at.DRIVEN] == 0.0 and state[SHAFT_SPEED] < 0.0
