"""Functions that the steps of all integrators share: guess the ports at a stage, solve the stage, store the result.

A family's step kernel writes a stage's Q and V to ``work.modal[BIG_Q]`` and ``[BIG_V]``, and their values at the ports
to ``work.port[U_Q]`` and ``[U_V]``, and calls :func:`solve_and_keep` for each stage. The ports at the step's start are
in ``work.port[STATE_U]`` and the two rows after it, frame and pressures of stage i in row i of ``work.frames`` and
``work.pressures``; q, v and a of a solved stage in ``work.stage[i]``.
"""

import math

from cranktrain.core.kernel import inlined_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import port_count
from cranktrain.dynamics.model.state import ACCELERATION, OMEGA_REFERENCE, POSITION, VELOCITY, defect_offset, offset
from cranktrain.dynamics.motion.bodies import to_ports
from cranktrain.dynamics.motion.film_memory import close_stage, open_stage
from cranktrain.dynamics.time.stage import Stage, solve_stage
from cranktrain.dynamics.time.status import FILM_FAILED, OK
from cranktrain.dynamics.time.table import EXPLICIT_FIRST, FIRST_STAGE, HEAD, NODE, coefficients

REFERENCE_TURN = math.radians(3.0)
"""Step of crank angle (rad) to which the Newton tolerance refers."""
SLOW = 60.0


@inlined_kernel
def port_tolerance(model, work, h):
    """Newton tolerance of a step h, which falls with shorter steps like the error of the integrator."""
    turn = min(1.0, h * max(work.frames[0, at.OMEGA], SLOW) / REFERENCE_TURN)
    tolerance = model.choices[at.NEWTON_TOLERANCE]
    for _ in range(int(model.choices[at.ORDER])):
        tolerance *= turn
    return tolerance


@inlined_kernel
def guess_ports(model, work, state, stage, h):
    """Guess the ports at a stage by Taylor's series from the nearest known time, the step's start or a stage.

    The error of the series at the same stage of the last step is added. Fills ``work.port[GUESS]``.
    """
    table = model.stages
    time = table[FIRST_STAGE + stage, NODE]
    nearest = -1
    distance = time
    for s in range(stage):
        away = time - table[FIRST_STAGE + s, NODE]
        if abs(away) < abs(distance) and (s > 0 or table[HEAD, EXPLICIT_FIRST] == 0.0):
            distance = away
            nearest = s
    tau = distance * h
    m = port_count(model)
    o = defect_offset(model.omega2.shape[0]) + stage * m
    for k in range(m):
        if nearest < 0:
            series = work.port[at.STATE_U, k] + tau * (
                work.port[at.STATE_UD, k] + 0.5 * tau * work.port[at.STATE_UDD, k]
            )
        else:
            series = work.known[nearest, 0, k] + tau * (
                work.known[nearest, 1, k] + 0.5 * tau * work.known[nearest, 2, k]
            )
        work.port[at.SERIES, k] = series
        work.port[at.GUESS, k] = series + state[o + k]


@inlined_kernel
def solve_and_keep(model, work, state, stage, h, gain):
    """Guess, solve and store one stage of a step h. Return a status (0: success).

    ``gain`` (s) is g of the stage's rule δ̇ = (δ − Δ)/g for the memory of films.
    """
    guess_ports(model, work, state, stage.number, h)
    open_stage(model, work, stage.number, model.stages[FIRST_STAGE + stage.number, NODE] * h, h, gain)
    status = solve_stage(model, work, state, stage)
    if status != OK:
        return status
    if close_stage(model, work, work.frames[stage.number], work.pressures[stage.number]) != OK:
        return FILM_FAILED
    # The ports, and the error of their Taylor series, are kept for later guesses.
    known = work.known[stage.number]
    m = port_count(model)
    o = defect_offset(model.omega2.shape[0]) + stage.number * m
    for k in range(m):
        known[0, k] = work.port[at.U, k]
        known[1, k] = work.port[at.UD, k]
        known[2, k] = work.port[at.UDD, k]
        state[o + k] = work.port[at.U, k] - work.port[at.SERIES, k]
    return OK


@inlined_kernel
def solve_only_stage(model, work, state, slot, h):
    """Solve the only stage, at the step's end, with Q and V in ``work.modal``. Return a status (0: success)."""
    n = model.omega2.shape[0]
    to_ports(model, work.modal[at.BIG_Q], work.port[at.U_Q])
    to_ports(model, work.modal[at.BIG_V], work.port[at.U_V])
    c_q, c_v = coefficients(model.stages, h)
    o = offset(ACCELERATION, n)
    omega = state[OMEGA_REFERENCE]
    stage = Stage(0, slot, c_q, c_v, omega, port_tolerance(model, work, h), state[o : o + n])
    return solve_and_keep(model, work, state, stage, h, h)


@inlined_kernel
def keep_motion(model, work, state, stage):
    """Copy the motion of a solved stage, the last one, to the state."""
    n = model.omega2.shape[0]
    out = work.stage[stage]
    for i in range(n):
        state[offset(POSITION, n) + i] = out[0, i]
        state[offset(VELOCITY, n) + i] = out[1, i]
        state[offset(ACCELERATION, n) + i] = out[2, i]
