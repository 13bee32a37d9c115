"""The start of a run: from any position to static equilibrium, then to the velocities and accelerations of motion."""

from __future__ import annotations

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model.slots import (
    BLOCK_RESTRAINT,
    CRANK_MODES,
    DRIVEN,
    LEAD,
    OMEGA,
    PORTS,
    RIGID_ROTATION,
    TURNING_MODES,
    WHIRL,
)
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
from cranktrain.dynamics.motion.equations import factor_stage
from cranktrain.dynamics.motion.film_memory import close_stage, close_step, open_stage, open_step
from cranktrain.dynamics.motion.linear_algebra import add_product
from cranktrain.dynamics.time.stage import DIVERGED, FIRST_CONTRACTION, OK, SINGULAR, solve_stage, to_ports
from cranktrain.dynamics.time.step_control import frame_at, ports_at_state, reconstruct
from cranktrain.film.laws.parameters import CLEARANCE

SETTLED = 1.0e-4
"""Tolerance of the start, in clearances."""
SETTLING_STEPS = 400
SETTLING_TIME = 0.5
SHORTEST = 1.0e-12
"""Bounds of the descent to the start: number of steps, their sum and the least of them, s."""
STARTING_STEPS = 3
STARTING_STEP = 1.0e-5
STARTING_TOLERANCE = 1.0e-11
"""Backward-Euler steps (s) at the first angle: the films' velocities relax, accelerations come to agree with them."""
HOLDING = 1.0e7
BLOCK_HOLDING = 1.0e12
"""N m/rad that hold the crank against turning meanwhile, and (rad/s)² the block of an engine that turns: what shakes it
as it runs would move it on soft mounts without end if it lasted."""


@kernel
def settle(model, work, state, inputs, windup, rotation, rate):
    """Start: static equilibrium of shaft, films and loads at the first angle, journals at rest in their bores.

    Backward-Euler steps of adapted length in a frame that stands still, with films and rods moving at the engine's
    speed, lead there from any position; where a film cannot carry at all (standstill), they end after SETTLING_TIME.
    The crank is held against turning meanwhile: the shaft's mean wind-up, the crank's rotation against it (rad) and its
    rate (rad/s) are given. Then velocities of a body whose bending stands still in space, and the accelerations that go
    with them. Returns a stage status.
    """
    n = model.omega2.shape[0]
    m = int(model.layout[PORTS])
    b = model.bearings.shape[0]
    o_q = offset(POSITION, n)
    o_v = offset(VELOCITY, n)
    o_a = offset(ACCELERATION, n)
    o_x = offset(AUXILIARY, n)
    reconstruct(model, work, state, inputs, 0.0)
    work.inputs[1, 0] = 0.0
    state[CONTRACTION] = FIRST_CONTRACTION
    state[SHAFT_SPEED] = inputs[0]
    frame = work.frames[0]
    frame_at(model, work, state, 0.0, 0.0, frame, work.pressures[0])
    frame[WHIRL] = 0.0
    frame[BLOCK_RESTRAINT] = BLOCK_HOLDING if inputs[0] > 0.0 else 0.0
    out = work.stage[0]
    h = 1.0e-6
    elapsed = 0.0
    for _ in range(SETTLING_STEPS):
        if factor_stage(model, work, 0, h * h, h, 0.0, HOLDING, frame[BLOCK_RESTRAINT]) != 0:
            return SINGULAR
        for i in range(n):
            # Velocity is dropped at every step: this is a descent, not a motion.
            work.modal[6, i] = state[o_q + i]
            work.modal[7, i] = 0.0
            work.modal[9, i] = 0.0
        to_ports(model, state[o_q : o_q + n], work.port[14])
        for k in range(m):
            work.port[4, k] = work.port[14, k]
            work.port[5, k] = 0.0
        iterations = work.counters[2]
        ports_at_state(model, work, state)
        for k in range(2 * b):
            work.port[12, k] = work.port[15, k]
        open_step(model, work, state)
        open_stage(model, work, 0, h, h, h)
        status = solve_stage(
            model, work, 0, work.modal[6], work.modal[7], h * h, h, 0.0, frame, work.pressures[0],
            work.port[14], work.modal[9], SETTLED, state, out[0], out[1], out[2],
        )  # fmt: skip
        if status == OK and close_stage(model, work, frame) != OK:
            status = DIVERGED
        if status != OK:
            h *= 0.25
            if h < SHORTEST:
                return status
            continue
        elapsed += h
        moved = 0.0
        for i in range(n):
            state[o_q + i] = out[0, i]
        ports_at_state(model, work, state)
        for k in range(2 * b):
            # The place in the bore, film by film.
            moved = max(moved, abs(work.port[15, k] - work.port[12, k]) / model.bearings[k // 2, CLEARANCE])
        close_step(model, work, state)
        if (moved < SETTLED and h > 1.0e-3) or elapsed > SETTLING_TIME:
            break
        iterations = work.counters[2] - iterations
        if iterations <= 8:
            h *= 2.0
        elif iterations > 16:
            h *= 0.5
    # Bending stands still in space, wind-up turns with the shaft.
    t = int(model.layout[TURNING_MODES])
    for i in range(t):
        work.modal[9, i] = 0.0
    state[o_q + 5] = 0.0
    add_product(model.gyroscopic, state[o_q : o_q + t], t, t, work.modal[9])
    for i in range(t):
        state[o_v + i] -= frame[OMEGA] * work.modal[9, i]
    state[o_q + 5] = rotation / model.scalars[RIGID_ROTATION]
    state[o_v + 5] += rate / model.scalars[RIGID_ROTATION]
    for i in range(int(model.layout[CRANK_MODES]), t):
        # Free big ends, ring and rotor turn with the crank; their Euler load is √m e_z×X.
        state[o_q + i] += rotation * model.euler_load[i]
        state[o_v + i] += rate * model.euler_load[i]
    if model.scalars[DRIVEN] == 0.0:
        # A free rotor hangs back by the shaft's wind-up instead.
        for i in range(int(model.layout[CRANK_MODES]), t):
            if model.rotor[i] != 0.0:
                state[o_q + i] = -windup / model.rotor[i]
                state[o_v + i] = 0.0
    else:
        state[SHAFT_ANGLE] = -windup
        state[LEAD_ANGLE] = windup
        frame[LEAD] = windup
    frame[WHIRL] = frame[OMEGA]
    frame[BLOCK_RESTRAINT] = 0.0
    h = STARTING_STEP
    if factor_stage(model, work, 0, h * h, h, frame[OMEGA], 0.0, 0.0) != 0:
        return SINGULAR
    status = OK
    done = 0
    while done < STARTING_STEPS:
        for i in range(n):
            work.modal[7, i] = state[o_v + i]
            work.modal[6, i] = state[o_q + i] + h * state[o_v + i]
            work.modal[9, i] = 0.0
        to_ports(model, work.modal[6], work.port[14])
        to_ports(model, work.modal[6], work.port[4])
        to_ports(model, work.modal[7], work.port[5])
        ports_at_state(model, work, state)
        open_step(model, work, state)
        open_stage(model, work, 0, h, h, h)
        status = solve_stage(
            model, work, 0, work.modal[6], work.modal[7], h * h, h, frame[OMEGA], frame, work.pressures[0],
            work.port[14], work.modal[9], STARTING_TOLERANCE, state, out[0], out[1], out[2],
        )  # fmt: skip
        if status == OK and close_stage(model, work, frame) != OK:
            status = DIVERGED
        if status != OK:
            # Films that close fast as their velocities relax want shorter steps.
            h *= 0.1
            if h < SHORTEST or factor_stage(model, work, 0, h * h, h, frame[OMEGA], 0.0, 0.0) != 0:
                return status
            continue
        done += 1
        close_step(model, work, state)
        for i in range(n):
            state[o_q + i] = out[0, i]
            state[o_v + i] = out[1, i]
            state[o_a + i] = out[2, i]
            state[o_x + i] = out[2, i]
    work.key[0, 0] = -1.0
    state[CONTRACTION] = FIRST_CONTRACTION
    state[OMEGA_REFERENCE] = frame[OMEGA]
    state[STEP_REFERENCE] = -1.0
    state[STEP_LAST] = -1.0
    return status
