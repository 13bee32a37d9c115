"""One step of an integrator, stage by stage; the methods are tables of coefficients."""

from __future__ import annotations

import math

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model.slots import OMEGA, PORTS
from cranktrain.dynamics.model.state import (
    ACCELERATION,
    AUXILIARY,
    HISTORY,
    OMEGA_REFERENCE,
    POSITION,
    VELOCITY,
    defect_offset,
)
from cranktrain.dynamics.model.state import offset as state_offset
from cranktrain.dynamics.motion.film_memory import close_stage, open_stage
from cranktrain.dynamics.time.integrator_tables import BDF2, DIRK, GENERALISED_ALPHA
from cranktrain.dynamics.time.stage import DIVERGED, OK, solve_stage, to_ports

REFERENCE_TURN = math.radians(3.0)
"""Step of crank angle at which the Newton tolerance is meant."""
SLOW = 60.0


@kernel
def coefficients(table, h):
    """c_q and c_v of the method's implicit stages for step h."""
    if table[0, 0] == GENERALISED_ALPHA:
        kappa = (1.0 - table[0, 5]) / (1.0 - table[0, 4])
        return table[0, 6] * kappa * h * h, table[0, 7] * kappa * h
    gamma = table[0, 2]
    return gamma * gamma * h * h, gamma * h


@kernel
def guess_ports(model, work, state, stage, h, guess):
    """Guess the ports at a stage: Taylor's series from the nearest time that is known, the step's start or a stage.

    What the series missed at the same stage of the last step is added.
    """
    table = model.stages
    last = table.shape[1] - 1
    time = table[1 + stage, last]
    nearest = -1
    distance = time
    for s in range(stage):
        if abs(time - table[1 + s, last]) < abs(distance) and (s > 0 or table[0, 3] == 0.0):
            distance = time - table[1 + s, last]
            nearest = s
    tau = distance * h
    m = int(model.layout[PORTS])
    o = defect_offset(model.omega2.shape[0]) + stage * m
    for k in range(m):
        if nearest < 0:
            series = work.port[10, k] + tau * (work.port[11, k] + 0.5 * tau * work.port[12, k])
        else:
            series = work.known[nearest, 0, k] + tau * (
                work.known[nearest, 1, k] + 0.5 * tau * work.known[nearest, 2, k]
            )
        work.port[13, k] = series
        guess[k] = series + state[o + k]


@kernel
def keep_ports(model, work, state, stage):
    """Keep the ports of a solved stage, and what the series missed, for the guesses to come."""
    m = int(model.layout[PORTS])
    o = defect_offset(model.omega2.shape[0]) + stage * m
    for k in range(m):
        work.known[stage, 0, k] = work.port[0, k]
        work.known[stage, 1, k] = work.port[1, k]
        work.known[stage, 2, k] = work.port[2, k]
        state[o + k] = work.port[0, k] - work.port[13, k]


@kernel
def integrate_step(model, work, state, level, h, frames, pressures):
    """Advance modal position, velocity and accelerations in ``state`` by one step h; returns a stage status.

    ``frames[i]`` and ``pressures[i]`` belong to stage i. The state is touched only when the step succeeds.
    """
    table = model.stages
    n = model.omega2.shape[0]
    stages = int(table[0, 1])
    last = table.shape[1] - 1
    c_q, c_v = coefficients(table, h)
    omega_0 = state[OMEGA_REFERENCE]
    # Ports are found as much more exactly at shorter steps as the method's own error falls.
    turn = min(1.0, h * max(frames[0, OMEGA], SLOW) / REFERENCE_TURN)
    tolerance = model.choices[2]
    for _ in range(int(model.choices[6])):
        tolerance *= turn
    o_q = state_offset(POSITION, n)
    o_v = state_offset(VELOCITY, n)
    o_a = state_offset(ACCELERATION, n)
    o_x = state_offset(AUXILIARY, n)
    big_q = work.modal[6]
    big_v = work.modal[7]
    guess = work.port[14]
    u_q = work.port[4]
    u_v = work.port[5]
    m = int(model.layout[PORTS])
    o_b = state_offset(HISTORY, n)
    if table[0, 0] != DIRK:
        alpha_m = table[0, 4]
        alpha_f = table[0, 5]
        beta = table[0, 6]
        gamma = table[0, 7]
        known = work.modal[8]
        if table[0, 0] == BDF2:
            for i in range(n):
                big_v[i] = (4.0 * state[o_v + i] - state[o_b + i]) / 3.0
                big_q[i] = (4.0 * state[o_q + i] - state[o_x + i]) / 3.0 + c_v * big_v[i]
        for i in range(n if table[0, 0] == GENERALISED_ALPHA else 0):
            known[i] = (alpha_f * state[o_a + i] - alpha_m * state[o_x + i]) / (1.0 - alpha_m)
            big_q[i] = state[o_q + i] + h * state[o_v + i] + h * h * ((0.5 - beta) * state[o_x + i] + beta * known[i])
            big_v[i] = state[o_v + i] + h * ((1.0 - gamma) * state[o_x + i] + gamma * known[i])
        to_ports(model, big_q, u_q)
        to_ports(model, big_v, u_v)
        guess_ports(model, work, state, 0, h, guess)
        out = work.stage[0]
        open_stage(model, work, 0, h, h, h)
        status = solve_stage(
            model, work, level, big_q, big_v, c_q, c_v, omega_0, frames[0], pressures[0], guess,
            state[o_a : o_a + n], tolerance, state, out[0], out[1], out[2],
        )  # fmt: skip
        if status == OK and close_stage(model, work, frames[0]) != OK:
            status = DIVERGED
        if status != OK:
            return status
        keep_ports(model, work, state, 0)
        if table[0, 0] == BDF2:
            for i in range(n):
                state[o_x + i] = state[o_q + i]
                state[o_b + i] = state[o_v + i]
        else:
            kappa = (1.0 - alpha_f) / (1.0 - alpha_m)
            for i in range(n):
                before = state[o_x + i]
                state[o_x + i] = kappa * out[2, i] + known[i]
                work.modal[9, i] = (beta - 1.0 / 6.0) * h * h * (state[o_x + i] - before)
    else:
        gamma = table[0, 2]
        first = 0
        if table[0, 3] > 0.0:
            for i in range(n):
                work.stage[0, 0, i] = state[o_q + i]
                work.stage[0, 1, i] = state[o_v + i]
                work.stage[0, 2, i] = state[o_a + i]
            for k in range(m):
                work.known[0, 0, k] = work.port[10, k]
                work.known[0, 1, k] = work.port[11, k]
                work.known[0, 2, k] = work.port[12, k]
            first = 1
        for s in range(first, stages):
            for i in range(n):
                big_v[i] = state[o_v + i]
                big_q[i] = state[o_q + i]
            for j in range(s):
                weight = h * table[1 + s, j]
                for i in range(n):
                    big_v[i] += weight * work.stage[j, 2, i]
                    big_q[i] += weight * work.stage[j, 1, i]
            for i in range(n):
                big_q[i] += h * gamma * big_v[i]
            # The ports' share follows from the ports alone, a product with the shapes less for each.
            for k in range(m):
                u_v[k] = work.port[11, k]
                u_q[k] = work.port[10, k]
            for j in range(s):
                weight = h * table[1 + s, j]
                for k in range(m):
                    u_v[k] += weight * work.known[j, 2, k]
                    u_q[k] += weight * work.known[j, 1, k]
            for k in range(m):
                u_q[k] += h * gamma * u_v[k]
            guess_ports(model, work, state, s, h, guess)
            guess_a = state[o_a : o_a + n] if s == 0 else work.stage[s - 1, 2]
            out = work.stage[s]
            open_stage(model, work, s, table[1 + s, last] * h, h, h * gamma)
            status = solve_stage(
                model, work, level, big_q, big_v, c_q, c_v, omega_0, frames[s], pressures[s], guess,
                guess_a, tolerance, state, out[0], out[1], out[2],
            )  # fmt: skip
            if status == OK and close_stage(model, work, frames[s]) != OK:
                status = DIVERGED
            if status != OK:
                return status
            keep_ports(model, work, state, s)
    out = work.stage[stages - 1]
    for i in range(n):
        state[o_q + i] = out[0, i]
        state[o_v + i] = out[1, i]
        state[o_a + i] = out[2, i]
    return OK
