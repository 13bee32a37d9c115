"""Integrators as tables of coefficients; the stage solver does the work.

Every method here reads, for a stage, q = Q + c_q a and v = V + c_v a with the true acceleration a unknown:

* diagonally implicit Runge–Kutta methods with equal diagonal γ (c_q = (hγ)², c_v = hγ), all stiffly accurate and
  L-stable: ``backward-euler`` (order 1, 1 stage), ``tr-bdf2`` (2, first stage explicit; Bank et al. 1985), ``sdirk2``
  (2 stages; Alexander 1977), ``sdirk3`` (3 stages; Alexander 1977), ``sdirk4`` (4, 5 stages; Hairer & Wanner II, table
  IV.6.5);
* generalised-α in the form of Arnold & Brüls (2007) with an auxiliary acceleration ā beside the true one,
  (1−α_m) ā₁ + α_m ā₀ = (1−α_f) v̇₁ + α_f v̇₀, so that a mass matrix which varies with the state keeps second order;
  c_q = βκh², c_v = γκh, κ = (1−α_f)/(1−α_m). ``generalised-alpha`` takes ρ∞ in [0, 1].

A table is one float64 array: row 0 holds kind, number of stages, γ, explicit first stage, and for generalised-α
α_m, α_f, β, γ; the rows after it a_ij (strictly lower part used) with c_i in the last column.
"""

from __future__ import annotations

import math

import numpy as np

from cranktrain.dynamics.equations_of_motion import OMEGA
from cranktrain.dynamics.film_memory import close_stage, open_stage
from cranktrain.dynamics.ports import PORTS
from cranktrain.dynamics.stage import DIVERGED, OK, solve_stage, to_ports
from cranktrain.dynamics.state import ACCELERATION, AUXILIARY, OMEGA_REFERENCE, POSITION, VELOCITY, defect_offset
from cranktrain.dynamics.state import offset as state_offset
from cranktrain.errors import InputError, nearest
from cranktrain.kernel import kernel
from cranktrain.reduced_body import Array

REFERENCE_TURN = math.radians(3.0)
"""Step of crank angle at which the Newton tolerance is meant."""
SLOW = 60.0
DIRK, GENERALISED_ALPHA = 0, 1
_WIDTH = 8
RHO_INFINITY = 0.6
"""Spectral radius at infinity of ``generalised-alpha`` where none is given."""


def _dirk(matrix: list[list[float]], explicit_first: bool = False) -> Array:
    a = np.array(matrix)
    s = len(a)
    table = np.zeros((s + 1, _WIDTH))
    table[0, :4] = [DIRK, s, a[-1, -1], float(explicit_first)]
    table[1:, :s] = a
    table[1:, -1] = a.sum(axis=1)
    return table


def _sdirk3_gamma() -> float:
    # The root of γ³ − 3γ² + 3γ/2 − 1/6 between 1/6 and 1/2: L-stability of the three-stage method of order three.
    roots = np.roots([1.0, -3.0, 1.5, -1.0 / 6.0]).real
    return float(next(r for r in roots if 1.0 / 6.0 < r < 0.5))


def generalised_alpha(rho: float) -> Array:
    """Table of generalised-α with spectral radius ``rho`` at infinite frequency (Chung & Hulbert 1993)."""
    if not 0.0 <= rho <= 1.0:
        raise InputError(f"generalised-alpha needs 0 <= rho <= 1, got {rho:g}; 0.6 is a good start")
    alpha_f = rho / (rho + 1.0)
    alpha_m = (2.0 * rho - 1.0) / (rho + 1.0)
    gamma = 0.5 - alpha_m + alpha_f
    table = np.zeros((2, _WIDTH))
    table[0] = [GENERALISED_ALPHA, 1, 0.0, 0.0, alpha_m, alpha_f, 0.25 * (gamma + 0.5) ** 2, gamma]
    table[1, -1] = 1.0
    return table


def _tables() -> dict[str, Array]:
    g2 = 1.0 - 0.5 * math.sqrt(2.0)
    g3 = _sdirk3_gamma()
    w = 0.25 * math.sqrt(2.0)
    b1, b2 = -0.25 * (6 * g3 * g3 - 16 * g3 + 1), 0.25 * (6 * g3 * g3 - 20 * g3 + 5)
    return {
        "backward-euler": _dirk([[1.0]]),
        "tr-bdf2": _dirk([[0, 0, 0], [g2, g2, 0], [w, w, g2]], explicit_first=True),
        "sdirk2": _dirk([[g2, 0], [1 - g2, g2]]),
        "sdirk3": _dirk([[g3, 0, 0], [0.5 * (1 - g3), g3, 0], [b1, b2, g3]]),
        "sdirk4": _dirk(
            [
                [1 / 4, 0, 0, 0, 0],
                [1 / 2, 1 / 4, 0, 0, 0],
                [17 / 50, -1 / 25, 1 / 4, 0, 0],
                [371 / 1360, -137 / 2720, 15 / 544, 1 / 4, 0],
                [25 / 24, -49 / 48, 125 / 16, -85 / 12, 1 / 4],
            ]
        ),
        "generalised-alpha": generalised_alpha(RHO_INFINITY),
    }


INTEGRATORS = _tables()
ORDERS = {"backward-euler": 1, "tr-bdf2": 2, "sdirk2": 2, "sdirk3": 3, "sdirk4": 4, "generalised-alpha": 2}


def integrator_table(name: str) -> Array:
    """Coefficients by name; ``generalised-alpha:0.8`` gives ρ∞. ``InputError`` for a name that does not exist."""
    base, _, rho = name.partition(":")
    if base not in INTEGRATORS or (rho and base != "generalised-alpha"):
        raise InputError(f"integrator '{name}' does not exist; {nearest(base, INTEGRATORS)}")
    if not rho:
        return INTEGRATORS[base]
    try:
        return generalised_alpha(float(rho))
    except ValueError:
        raise InputError(f"integrator '{name}': rho must be a number, e.g. generalised-alpha:0.8") from None


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
    c_q, c_v = coefficients(table, h)
    omega_0 = state[OMEGA_REFERENCE]
    # What an error of the ports does to accelerations grows as 1/h².
    turn = h * max(frames[0, OMEGA], SLOW) / REFERENCE_TURN
    tolerance = model.choices[2] * min(1.0, turn * turn)
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
    if table[0, 0] == GENERALISED_ALPHA:
        alpha_m = table[0, 4]
        alpha_f = table[0, 5]
        beta = table[0, 6]
        gamma = table[0, 7]
        known = work.modal[8]
        for i in range(n):
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
        kappa = (1.0 - alpha_f) / (1.0 - alpha_m)
        for i in range(n):
            state[o_x + i] = kappa * out[2, i] + known[i]
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
            before = state[o_a : o_a + n] if s == 0 else work.stage[s - 1, 2]
            out = work.stage[s]
            open_stage(model, work, s, table[1 + s, table.shape[1] - 1] * h, h, h * gamma)
            status = solve_stage(
                model, work, level, big_q, big_v, c_q, c_v, omega_0, frames[s], pressures[s], guess,
                before, tolerance, state, out[0], out[1], out[2],
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
