"""Initial state of a run: static equilibrium from any position, then velocities and accelerations of motion."""

import math

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import crank_modes, turning_modes
from cranktrain.dynamics.model.state import (
    ACCELERATION,
    AUXILIARY,
    CONTRACTION,
    LEAD_ANGLE,
    OMEGA_REFERENCE,
    POSITION,
    SHAFT_ANGLE,
    SHAFT_SPEED,
    STEP_LAST,
    STEP_REFERENCE,
    VELOCITY,
    offset,
)
from cranktrain.dynamics.motion.bodies import factor_stage, to_ports
from cranktrain.dynamics.motion.film_memory import close_stage, close_step, open_stage, open_step
from cranktrain.dynamics.motion.linear_algebra import add_product
from cranktrain.dynamics.motion.links import turn_frames
from cranktrain.dynamics.time.reconstruction import reconstruct, take_rates, take_sample
from cranktrain.dynamics.time.stage import FIRST_CONTRACTION, Stage, solve_stage
from cranktrain.dynamics.time.status import FILM_FAILED, OK, SINGULAR
from cranktrain.dynamics.time.step_control import frame_at, ports_at_state
from cranktrain.dynamics.topology import slots as top

SETTLED = 1.0e-4
"""Tolerance of the static equilibrium at the start of a run, in clearances."""
SETTLING_STEPS = 400
SETTLING_TIME = 0.5
SHORTEST = 1.0e-12
"""Bounds of the descent to the start: most steps, longest total time (s), shortest step (s)."""
STARTING_STEPS = 3
STARTING_STEP = 1.0e-5
STARTING_TOLERANCE = 1.0e-11
"""Number, size (s) and tolerance of backward-Euler steps at the first angle, in which velocities of films relax."""
CRANK_RESTRAINT, RESTRAINT_RATE = 1.0e7, 2.0e6
STATIONARY_RESTRAINT = 1.0e12
"""Restraint of the crank's rotation during the descent: N m/rad, or (rad/s)² times the inertia of crank and rods if
that is more, because gas of a large engine would turn the crank by many clearances of its big ends. The last, (rad/s)²,
restrains the block of a rotating engine, because momentary forces would move it far on soft mounts if they lasted."""


@kernel
def settle(model, work, state, inputs, windup, rotation, rate):
    """Find the static equilibrium of shaft, films and loads at the first angle, then set the engine in motion.

    In the equilibrium journals are at rest in their bores and the crank's rotation is restrained, because the shaft's
    mean wind-up, the crank's rotation relative to it (rad) and its rate (rad/s) are given. Velocities are those of a
    body whose bending is at rest in space; accelerations are consistent with them. Returns a status.
    """
    pose(model, work, state, inputs)
    status = balance(model, work, state)
    if status != OK:
        return status
    set_in_motion(model, work, state, windup, rotation, rate)
    status = accelerate(model, work, state)
    work.key[0, at.KEY_STEP] = -1.0
    state[CONTRACTION] = FIRST_CONTRACTION
    state[OMEGA_REFERENCE] = work.frames[0, at.OMEGA]
    state[STEP_REFERENCE] = -1.0
    state[STEP_LAST] = -1.0
    return status


@kernel
def pose(model, work, state, inputs):
    """Set frame and pressures at the first angle; the frame's motion is known, but the axes do not rotate yet."""
    take_sample(model, state, inputs, 0.0)
    take_rates(state, work.input_rates, 0.0)
    reconstruct(model, work, state)
    state[CONTRACTION] = FIRST_CONTRACTION
    state[SHAFT_SPEED] = inputs[0]
    frame = work.frames[0]
    frame_at(model, work, state, 0.0, 0.0, frame, work.pressures[0])
    frame[at.WHIRL] = 0.0
    frame[at.BLOCK_RESTRAINT] = STATIONARY_RESTRAINT if inputs[0] > 0.0 else 0.0


@kernel
def balance(model, work, state):
    """Descend to the static equilibrium from any position. Return a status (0: success).

    Backward-Euler steps of adapted length are taken in a frame that does not rotate, with films and rods at the
    engine's speed. The velocity of the descent is dropped at every step. The steps end after SETTLING_TIME at the
    latest, also if a film cannot carry at all (standstill).
    """
    n = model.omega2.shape[0]
    o_q = offset(POSITION, n)
    frame = work.frames[0]
    restraint = max(CRANK_RESTRAINT, RESTRAINT_RATE * work.start.mean[at.START_INERTIA])
    h = 1.0e-6
    elapsed = 0.0
    for _ in range(SETTLING_STEPS):
        if factor_stage(model, work, 0, h * h, h, 0.0, restraint, frame[at.BLOCK_RESTRAINT]) != 0:
            return SINGULAR
        for i in range(n):
            work.modal[at.BIG_V, i] = 0.0
        iterations = work.counters[at.N_ITERATIONS]
        ports_at_state(model, work, state)
        status = euler_step(model, work, state, h, 0.0, SETTLED)
        if status != OK:
            h *= 0.25
            if h < SHORTEST:
                return status
            continue
        elapsed += h
        for i in range(n):
            state[o_q + i] = work.stage[0, 0, i]
        ports_at_state(model, work, state)
        displaced = 0.0
        for k in range(model.limited.shape[0]):
            if model.limited[k, 1] < 0.0:
                port = int(model.limited[k, 0])
                displaced = max(displaced, abs(work.port[at.RELATIVE, port]) / model.scales[port])
        close_step(model, work, state)
        # A crank whose journals have no load, or that has no journals, needs no more steps.
        if (displaced < SETTLED and h > 1.0e-3) or elapsed > SETTLING_TIME:
            break
        iterations = work.counters[at.N_ITERATIONS] - iterations
        if iterations <= 8:
            h *= 2.0
        elif iterations > 16:
            h *= 0.5
    return OK


@kernel
def euler_step(model, work, state, h, omega, tolerance):
    """Take one backward-Euler step h with velocity V in ``work.modal[BIG_V]``. Return a status (0: success).

    Fills ``work.stage[0]``. The factors of h and ``omega`` (rad/s) are in slot 0, the ports' relative motion at the
    state in ``work.port[RELATIVE]``.
    """
    n = model.omega2.shape[0]
    big_q = work.modal[at.BIG_Q]
    a_guess = work.modal[at.DIFFERENCE]
    for i in range(n):
        big_q[i] = state[offset(POSITION, n) + i] + h * work.modal[at.BIG_V, i]
        a_guess[i] = 0.0
    to_ports(model, big_q, work.port[at.GUESS])
    to_ports(model, big_q, work.port[at.U_Q])
    to_ports(model, work.modal[at.BIG_V], work.port[at.U_V])
    open_step(model, work, state)
    open_stage(model, work, 0, h, h, h)
    status = solve_stage(model, work, state, Stage(0, 0, h * h, h, omega, tolerance, a_guess))
    if status != OK:
        return status
    return FILM_FAILED if close_stage(model, work, work.frames[0], work.pressures[0]) != OK else OK


@kernel
def set_in_motion(model, work, state, windup, rotation, rate):
    """Set velocities of a crank whose bending is at rest in space and whose wind-up rotates with the shaft."""
    n = model.omega2.shape[0]
    t = turning_modes(model)
    crank = crank_modes(model)
    q = state[offset(POSITION, n) : offset(POSITION, n) + t]
    v = state[offset(VELOCITY, n) : offset(VELOCITY, n) + t]
    frame = work.frames[0]
    turned = work.modal[at.DIFFERENCE]
    for i in range(t):
        turned[i] = 0.0
    q[at.ROTATION] = 0.0
    add_product(model.bodies.gyroscopic, q, t, t, turned)
    for i in range(t):
        v[i] -= frame[at.OMEGA] * turned[i]
    q[at.ROTATION] = rotation / model.scalars[at.RIGID_ROTATION]
    v[at.ROTATION] += rate / model.scalars[at.RIGID_ROTATION]
    big_ends = crank
    if model.cylinders.shape[0] > 0 and model.cylinders[0, at.END_PORT] >= 0.0:
        big_ends += 2 * model.cylinders.shape[0]
    for i in range(crank, big_ends):
        # Free big ends move on the circles of their pins; their Euler load is √m e_z×X, their centrifugal load √m X.
        across, along = model.bodies.euler_load[i], model.bodies.centrifugal_load[i]
        q[i] += math.sin(rotation) * across + (math.cos(rotation) - 1.0) * along
        v[i] += rate * (math.cos(rotation) * across - math.sin(rotation) * along)
    for i in range(big_ends, t):
        # Ring and rotors turn with the crank.
        follows = model.bodies.euler_load[i] - model.lag[i]
        if model.lag[i] != 0.0:
            # The drive line's rotors lag by their part of the mean wind-up, regardless of the wind-up at rest.
            q[i] = -windup * model.lag[i]
            v[i] = 0.0
        q[i] += rotation * follows
        v[i] += rate * follows
    others_in_motion(model, work, state, rotation, rate)
    if model.scalars[at.DRIVEN] > 0.0:
        state[SHAFT_ANGLE] = -windup
        state[LEAD_ANGLE] = windup
        frame[at.LEAD] = windup
    frame[at.WHIRL] = frame[at.OMEGA]
    frame[at.BLOCK_RESTRAINT] = 0.0


@kernel
def others_in_motion(model, work, state, rotation, rate):
    """Set displacements and velocities of added bodies, which move with the crank as their frames do."""
    n = model.omega2.shape[0]
    t = turning_modes(model)
    turned = work.modal[at.DIFFERENCE]
    omega = work.frames[0, at.OMEGA]
    bodies = model.bodies
    turn_frames(model, work, work.frames[0, at.THETA])
    for b in range(top.OTHERS, bodies.rows.shape[0]):
        row = bodies.rows[b]
        modes = row[top.MODES]
        o = row[top.OWN_MODE]
        q = state[offset(POSITION, n) + row[top.MODE] :]
        v = state[offset(VELOCITY, n) + row[top.MODE] :]
        for i in range(modes):
            turned[i] = 0.0
        turn = q[at.ROTATION]
        if row[top.MODE] < t or (row[top.ENDS_GROUP] > 0 and o == row[top.GROUP]):
            q[at.ROTATION] = 0.0
        add_product(bodies.gyroscopic[o : o + modes], q, modes, modes, turned)
        q[at.ROTATION] = turn
        moved = work.links.frames[row[top.FRAME_OF]]
        turns = row[top.SENSE] * moved[top.TURN]
        # Velocity of the body's frame per crank angle, and derivative of this velocity, in axes of this frame.
        x = moved[top.OWN_X1]
        y = moved[top.OWN_Y1]
        x_change = moved[top.OWN_X2] + moved[top.TURN] * y
        y_change = moved[top.OWN_Y2] - moved[top.TURN] * x
        for i in range(modes):
            across = bodies.translation[0, o + i]
            along = bodies.translation[1, o + i]
            euler = bodies.euler_load[o + i]
            follows = row[top.TIED] * (turns * euler + x * across + y * along)
            changes = row[top.TIED] * (moved[top.TURN2] * euler + x_change * across + y_change * along)
            v[i] += rate * follows + rotation * omega * changes - turns * omega * turned[i]
            q[i] += rotation * follows


@kernel
def accelerate(model, work, state):
    """Take short backward-Euler steps at the first angle, so that accelerations fit velocities. Return a status."""
    n = model.omega2.shape[0]
    omega = work.frames[0, at.OMEGA]
    out = work.stage[0]
    h = STARTING_STEP
    if factor_stage(model, work, 0, h * h, h, omega, 0.0, 0.0) != 0:
        return SINGULAR
    done = 0
    while done < STARTING_STEPS:
        for i in range(n):
            work.modal[at.BIG_V, i] = state[offset(VELOCITY, n) + i]
        ports_at_state(model, work, state)
        status = euler_step(model, work, state, h, omega, STARTING_TOLERANCE)
        if status != OK:
            # Films that close fast while their velocities relax need shorter steps.
            h *= 0.1
            if h < SHORTEST:
                return status
            if factor_stage(model, work, 0, h * h, h, omega, 0.0, 0.0) != 0:
                return SINGULAR
            continue
        done += 1
        close_step(model, work, state)
        for i in range(n):
            state[offset(POSITION, n) + i] = out[0, i]
            state[offset(VELOCITY, n) + i] = out[1, i]
            state[offset(ACCELERATION, n) + i] = out[2, i]
            state[offset(AUXILIARY, n) + i] = out[2, i]
    return OK
