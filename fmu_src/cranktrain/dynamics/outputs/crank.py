"""What the running model shows of the crank as a whole, of its torques, and of its own work."""

from __future__ import annotations

import math

from cranktrain.core.kernel import law_kernel
from cranktrain.dynamics.model.slots import (
    BIG_ENDS_FRICTION,
    DRIVEN,
    GAS_POWER,
    LEAD,
    LEAD_RATE,
    LINERS_FRICTION,
    MAINS_FRICTION,
    OMEGA,
    THETA,
    TURNING_MODES,
    VALVE_TORQUE,
)
from cranktrain.dynamics.model.state import (
    ITERATIONS,
    LAST_INTERVAL,
    LIMITED,
    ONLINE_FILMS,
    POSITION,
    RESIDUAL,
    SUBSTEPS,
    VELOCITY,
    offset,
)
from cranktrain.dynamics.motion.gas import crank_rotation
from cranktrain.dynamics.motion.linear_algebra import dot
from cranktrain.loads.gas_pressure import CYCLE
from cranktrain.loads.torsional_line import AT_FLYWHEEL, DAMPING, LEADING, STIFFNESS

CRANK_ANGLE, CYCLE_ANGLE, NEXT_ANGLE, CRANK_SPEED = range(4)
PULLEY_TORSION, PULLEY_AXIAL, FLYWHEEL_TORSION, SHAFT_TORQUE = range(4, 8)
INDICATED, FRICTION, BRAKE = range(3)
SLOWEST = 1.0
"""Speed below which a power has no torque, rad/s."""
ONLINE, LAST = 3, 4
"""Places of the films that lay outside their table, and of whether the step's work was cut short."""


@law_kernel
def observe_crank(model, work, state, members, out):
    """Angle and speed, motion of pulley and flywheel against the frame, torque that the drive line takes."""
    n = model.omega2.shape[0]
    t = int(model.layout[TURNING_MODES])
    frame = work.frames[0]
    q = state[offset(POSITION, n) : offset(POSITION, n) + t]
    v = state[offset(VELOCITY, n) : offset(VELOCITY, n) + t]
    # The crank is where it is, not where the frame that follows it has come to.
    rotation, rate, _ = crank_rotation(model, state)
    angle = frame[THETA] + rotation
    out[CRANK_ANGLE] = angle
    out[CYCLE_ANGLE] = angle - CYCLE * math.floor(angle / CYCLE)
    # Where a partner that steps at the same time will find the crank.
    out[NEXT_ANGLE] = angle + (frame[OMEGA] + rate) * state[LAST_INTERVAL]
    out[CRANK_SPEED] = frame[OMEGA]
    if model.scalars[DRIVEN] == 0.0:
        out[CRANK_SPEED] += rate
    out[FLYWHEEL_TORSION] = dot(model.ends[0], q, t)
    out[PULLEY_TORSION] = dot(model.ends[1], q, t)
    out[PULLEY_AXIAL] = dot(model.ends[2], q, t)
    out[SHAFT_TORQUE] = 0.0
    for k in range(model.shafts.shape[0]):
        law = model.shaft_laws[k]
        twist = model.scalars[DRIVEN] * law[LEADING] * frame[LEAD] + dot(model.shafts[k], q, t)
        twist_rate = model.scalars[DRIVEN] * law[LEADING] * frame[LEAD_RATE] + dot(model.shafts[k], v, t)
        out[SHAFT_TORQUE] += law[AT_FLYWHEEL] * (law[STIFFNESS] * twist + law[DAMPING] * twist_rate)
    return 0


@law_kernel
def observe_torques(model, work, state, members, out):
    """Torques on the crank by power over speed: of the gas, of friction, and what both and the valve train leave.

    Powers are those that the families before have left.
    """
    speed = work.frames[0, OMEGA]
    for k in range(BRAKE + 1):
        out[k] = 0.0
    if speed > SLOWEST:
        powers = work.powers
        out[INDICATED] = powers[GAS_POWER] / speed
        out[FRICTION] = (powers[MAINS_FRICTION] + powers[BIG_ENDS_FRICTION] + powers[LINERS_FRICTION]) / speed
        out[BRAKE] = out[INDICATED] - out[FRICTION] - work.frames[0, VALVE_TORQUE]
    return 0


@law_kernel
def observe_solver(model, work, state, members, out):
    """Of the last communication step: worst residual, sub-steps, iterations, films outside their table, 1 where cut."""
    out[0] = state[RESIDUAL]
    out[1] = state[SUBSTEPS]
    out[2] = state[ITERATIONS]
    out[ONLINE] = state[ONLINE_FILMS]
    out[LAST] = state[LIMITED]
    return 0
