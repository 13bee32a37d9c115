"""Outputs of the crank as a whole, of torques, of gas work and of the solver."""

import math

from cranktrain.core.kernel import kernel, law_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model import state as st
from cranktrain.dynamics.model.layout import block_port_count, turning_modes
from cranktrain.dynamics.model.state import offset
from cranktrain.dynamics.motion.gas import crank_rotation
from cranktrain.dynamics.motion.linear_algebra import dot
from cranktrain.loads.gas_pressure import CYCLE
from cranktrain.loads.torsional_line import AT_FLYWHEEL, DAMPING, LEADING, STIFFNESS

CRANK_ANGLE, CYCLE_ANGLE, NEXT_ANGLE, CRANK_SPEED, CRANK_IRREGULARITY, FRAME_SPEED = range(6)
PULLEY_TORSION, PULLEY_AXIAL, PULLEY_SPEED, FLYWHEEL_TORSION, FLYWHEEL_SPEED, SHAFT_TORQUE = range(6, 12)
INDICATED, FRICTION, BRAKE = range(3)
SLOWEST = 1.0
"""Speed (rad/s) below which torques are 0 instead of power over speed."""
ONLINE, LAST = 3, 4
"""Positions among the solver's outputs of the number of films outside their table and of the mark for a cut step."""


@law_kernel
def observe_crank(model, work, state, members, out):
    """Angle, speed and irregularity of the crank, motion of pulley and flywheel, torque of the drive line."""
    n = model.omega2.shape[0]
    t = turning_modes(model)
    frame = work.frames[0]
    q = state[offset(st.POSITION, n) : offset(st.POSITION, n) + t]
    v = state[offset(st.VELOCITY, n) : offset(st.VELOCITY, n) + t]
    # The angle is that of the crank itself, not of the frame that follows the crank.
    rotation, rate, _ = crank_rotation(model, state)
    angle = frame[at.THETA] + rotation
    out[CRANK_ANGLE] = angle
    out[CYCLE_ANGLE] = angle - CYCLE * math.floor(angle / CYCLE)
    # Crank angle at the end of the next step, for a partner that steps at the same time.
    out[CRANK_SPEED] = frame[at.OMEGA] + rate
    out[NEXT_ANGLE] = angle + out[CRANK_SPEED] * state[st.LAST_INTERVAL]
    out[CRANK_IRREGULARITY] = state[st.IRREGULARITY]
    out[FRAME_SPEED] = frame[at.OMEGA]
    out[FLYWHEEL_TORSION] = dot(model.ends[0], q, t)
    out[FLYWHEEL_SPEED] = frame[at.OMEGA] + dot(model.ends[0], v, t)
    out[PULLEY_TORSION] = dot(model.ends[1], q, t)
    out[PULLEY_AXIAL] = dot(model.ends[2], q, t)
    out[PULLEY_SPEED] = frame[at.OMEGA] + dot(model.ends[1], v, t)
    out[SHAFT_TORQUE] = 0.0
    powers = work.powers
    powers[at.SHAFTS_LOSS] = 0.0
    powers[at.DYNAMOMETER_POWER] = 0.0
    powers[at.STORED] = 0.0
    # The dynamometer turns at the given speed; the frame's speed differs from it by the rate of the frame's lead.
    given = frame[at.OMEGA] - frame[at.LEAD_RATE]
    for k in range(model.shafts.shape[0]):
        law = model.shaft_laws[k]
        twist = model.scalars[at.DRIVEN] * law[LEADING] * frame[at.LEAD] + dot(model.shafts[k], q, t)
        twist_rate = model.scalars[at.DRIVEN] * law[LEADING] * frame[at.LEAD_RATE] + dot(model.shafts[k], v, t)
        torque = law[STIFFNESS] * twist + law[DAMPING] * twist_rate
        out[SHAFT_TORQUE] += law[AT_FLYWHEEL] * torque
        powers[at.SHAFTS_LOSS] += law[DAMPING] * twist_rate * twist_rate
        powers[at.STORED] += 0.5 * law[STIFFNESS] * twist * twist
        powers[at.DYNAMOMETER_POWER] += model.scalars[at.DRIVEN] * law[LEADING] * torque * given
    observe_structure(model, work, state)
    return 0


@kernel
def observe_structure(model, work, state):
    """Write the powers of structural damping and of the valve train, and add the energy of crank, rotors and block."""
    n = model.omega2.shape[0]
    t = turning_modes(model)
    q = state[offset(st.POSITION, n) : offset(st.POSITION, n) + n]
    v = state[offset(st.VELOCITY, n) : offset(st.VELOCITY, n) + n]
    powers = work.powers
    omega = work.frames[0, at.OMEGA]
    energy = 0.0
    for i in range(t):
        carried = model.bodies.euler_load[i] * v[i] + omega * model.bodies.centrifugal_load[i] * q[i]
        # Arrays are kept transposed.
        carried += (dot(model.bodies.gyroscopic[i], v, t) - 0.5 * omega * dot(model.bodies.spin[i], q, t)) * q[i]
        energy += omega * carried
    for i in range(n):
        energy += 0.5 * (v[i] * v[i] + model.omega2[i] * q[i] * q[i])
    for i in range(model.block.stiffness.shape[0]):
        energy -= (model.block.preload[i] - model.scalars[at.GRAVITY] * model.gravity[1, t + i]) * q[t + i]
        energy += 0.5 * q[t + i] * dot(model.block.stiffness[i], q[t:], model.block.stiffness.shape[0])
    powers[at.STORED] += energy
    powers[at.CRANK_LOSS] = 0.0
    powers[at.BLOCK_LOSS] = 0.0
    for i in range(t):
        powers[at.CRANK_LOSS] += model.damping[i] * v[i] * v[i]
    standing = model.block.preload.shape[0]
    for i in range(t, t + standing):
        powers[at.BLOCK_LOSS] += model.damping[i] * v[i] * v[i]
    speed = omega + dot(model.ends[1], v, t)
    if block_port_count(model) > 0:
        speed -= dot(model.block.motion[at.ROTATION], v[t:], standing)
    powers[at.VALVE_POWER] = work.frames[0, at.VALVE_TORQUE] * speed


@law_kernel
def observe_torques(model, work, state, members, out):
    """Torques on the crank as powers over the frame's speed: of the gas, of friction, and of the gas minus all losses.

    The frame's speed is smooth, so mean torques are proportional to mean powers. Losses are those of the energy balance
    of a run (:mod:`cranktrain.results.energy`). Earlier families have left the powers in ``work``.
    """
    speed = work.frames[0, at.OMEGA]
    for k in range(BRAKE + 1):
        out[k] = 0.0
    if speed > SLOWEST:
        powers = work.powers
        out[INDICATED] = powers[at.GAS_POWER] / speed
        out[FRICTION] = (powers[at.MAINS_FRICTION] + powers[at.BIG_ENDS_FRICTION] + powers[at.LINERS_FRICTION]) / speed
        taken = 0.0
        for k in range(at.VALVE_POWER, at.POWERS):
            if k != at.STORED:
                taken += powers[k]
        out[BRAKE] = (powers[at.GAS_WORK] - taken) / speed
    return 0


@law_kernel
def observe_gas(model, work, state, members, out):
    """Work (J) since the start of the pressures that the inputs give."""
    out[0] = state[st.GAS_DONE]
    return 0


@law_kernel
def observe_solver(model, work, state, members, out):
    """For the last step: worst residual, sub-steps, iterations, films outside their table, and mark if cut short."""
    out[0] = state[st.RESIDUAL]
    out[1] = state[st.SUBSTEPS]
    out[2] = state[st.ITERATIONS]
    out[ONLINE] = state[st.ONLINE_FILMS]
    out[LAST] = state[st.LIMITED]
    return 0
