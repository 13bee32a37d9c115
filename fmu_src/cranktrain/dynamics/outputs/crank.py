"""Outputs of the crank as a whole, its axial motion and drive line, torques, gas work and the solver.

The pulley's axial motion has three parts, from the block outwards: motion of the thrust faces with the block on its
mounts, motion of the collar between its faces, and stretch of the crank between collar and pulley, by axial forces and,
because of its throws, by twist and bending.
"""

import math

from cranktrain.core.kernel import law_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model import state as st
from cranktrain.dynamics.model.layout import block_modes, collar_port, joint_row, turning_modes
from cranktrain.dynamics.model.state import offset
from cranktrain.dynamics.motion.gas import crank_rotation
from cranktrain.dynamics.motion.linear_algebra import dot
from cranktrain.dynamics.outputs.energy import account_powers
from cranktrain.dynamics.outputs.laws import observe_law
from cranktrain.loads.gas_pressure import CYCLE
from cranktrain.loads.torsional_line import AT_FLYWHEEL, DAMPING, LEADING, STIFFNESS

CRANK_ANGLE, CYCLE_ANGLE, NEXT_ANGLE, CRANK_SPEED, CRANK_IRREGULARITY, FRAME_SPEED = range(6)
PULLEY_TORSION, PULLEY_AXIAL, PULLEY_SPEED, FLYWHEEL_TORSION, FLYWHEEL_SPEED, SHAFT_TORQUE = range(6, 12)
INDICATED, FRICTION, BRAKE = range(3)
OF_ENGINE, OF_BEARING, OF_CRANK = range(3)
AXIAL_FORCE, SLIP = range(2)
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
    for k in range(model.shafts.shape[0]):
        law = model.shaft_laws[k]
        leading = model.scalars[at.DRIVEN] * law[LEADING]
        twist = leading * frame[at.LEAD] + dot(model.shafts[k], q, t)
        rate = leading * frame[at.LEAD_RATE] + dot(model.shafts[k], v, t)
        out[SHAFT_TORQUE] += law[AT_FLYWHEEL] * (law[STIFFNESS] * twist + law[DAMPING] * rate)
    return 0


@law_kernel
def observe_torques(model, work, state, members, out):
    """Torques on the crank as powers over the frame's speed: of the gas, of friction, and of the gas minus all losses.

    The frame's speed is smooth, so mean torques are proportional to mean powers. Losses are those of the energy balance
    of a run (:mod:`cranktrain.results.energy`).
    """
    account_powers(model, work, state)
    speed = work.frames[0, at.OMEGA]
    for k in range(BRAKE + 1):
        out[k] = 0.0
    if speed > SLOWEST:
        powers = work.powers
        out[INDICATED] = powers[at.GAS_POWER] / speed
        out[FRICTION] = powers[at.FRICTION_POWER] / speed
        taken = 0.0
        for k in range(at.VALVE_POWER, at.STORED):
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


@law_kernel
def observe_axial(model, work, state, members, out):
    """Displacements along the axis: thrust faces in space, collar relative to faces, pulley relative to collar."""
    t = turning_modes(model)
    q = state[offset(st.POSITION, model.omega2.shape[0]) :]
    collar = collar_port(model)
    out[OF_ENGINE] = 0.0
    for k in range(model.axial.shape[0]):
        out[OF_ENGINE] += dot(model.bodies.shapes[int(model.axial[k, 1])], q[t:], block_modes(model))
    out[OF_BEARING] = work.port[at.RELATIVE, collar]
    out[OF_CRANK] = dot(model.ends[at.PULLEY_AXIAL], q, t) - dot(model.bodies.shapes[collar], q, t)
    return 0


@law_kernel
def observe_axial_path(model, work, state, members, out):
    """Axial force of the drive line on the flywheel, and displacement of the flywheel relative to the shaft."""
    joint = joint_row(model)
    out[AXIAL_FORCE] = 0.0
    out[SLIP] = 0.0
    if joint >= 0:
        observe_law(model, work, state, joint)
        out[AXIAL_FORCE] = work.found[joint, 0]
        out[SLIP] = work.port[at.U, model.connections[joint, at.FIRST]]
    return 0
