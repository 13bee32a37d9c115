"""Cylinder pressure at a crank angle: the frame's, with the mean rotation of the crank and of the block added.

The trace belongs to the crank, whichever frame its motion is counted from. Phased to the frame instead it would act on
the drive line like a spring of −Σ mean[(p − p_c) V″], 2.9 kN m/rad of the six at 2000 rev/min, where over a cycle the
torque's derivative by the crank's own angle has no mean. A stage guesses the rotation by Taylor's series and, on rigid
ground, evaluates pressures anew at each iteration; their tangent, some 1e-4 of the stage's inertia J/c_q, is left to
the iteration.
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.state import ACCELERATION, POSITION, PRESSURES_SET, VELOCITY, offset
from cranktrain.engine.articulated_rod import knuckle_motion
from cranktrain.loads.articulated_rod import COS_TURN, KNUCKLE_X, KNUCKLE_Y, MASTER_LENGTH, MASTER_OFFSET, SIN_TURN
from cranktrain.loads.gas_pressure import gas_pressures


@inlined_kernel
def trace_angle(model, cylinder, theta):
    """Crank angle after the firing dead centre of a cylinder, rad."""
    return theta - model.cylinders[cylinder, at.PHASE]


@inlined_kernel
def gas_force(rod, scalars, pressure):
    """Force (N) of the gas on a piston and on its head at a cylinder pressure (Pa, absolute); ``rod`` its row."""
    return (pressure - scalars[at.CRANKCASE]) * rod[at.AREA] * rod[at.OWN_ROD]


@inlined_kernel
def trace_pressure(model, cylinder, theta, speed):
    """Cylinder pressure (Pa, absolute) of the gas trace: motored, plus the burn's rise scaled with speed."""
    motored, rise = gas_pressures(trace_angle(model, cylinder, theta), model.gas, cylinder)
    return motored + burn_share(model, speed) * rise


@inlined_kernel
def burn_share(model, speed):
    """Share of the burn's rise at a speed, rad/s."""
    x = speed / model.scalars[at.BEST_SPEED] - 1.0
    share = model.scalars[at.GAS_LOAD] * (1.0 - model.scalars[at.FALLOFF] * x * x)
    return max(share, 0.0)


@inlined_kernel
def gas_volume(model, cylinder, theta):
    """Volume above a piston (m³) at a crank angle, of parts that do not deform."""
    row = model.cylinders[cylinder]
    if row[at.MASTER] >= 0.0:
        return articulated_volume(model, row, theta, cylinder)
    angle = trace_angle(model, cylinder, theta)
    pin = model.pins[cylinder]
    throw = math.sqrt(pin[0] * pin[0] + pin[1] * pin[1])
    x = throw * math.sin(angle) + row[at.OFFSET]
    reach = throw * math.cos(angle) + math.sqrt(row[at.ROD] * row[at.ROD] - x * x)
    return row[at.CLEARANCE_VOLUME] + row[at.AREA] * (row[at.STROKE_TOP] - reach)


@kernel
def articulated_volume(model, row, theta, cylinder):
    """The same over the piston of an articulated rod, whose path is not that of a crank pin on its circle."""
    master = model.cylinders[int(row[at.MASTER])]
    joint = row[at.JOINT :]
    cos = math.cos(theta - master[at.BANK])
    sin = math.sin(theta - master[at.BANK])
    pin_x = cos * model.pins[cylinder, 0] - sin * model.pins[cylinder, 1]
    pin_y = sin * model.pins[cylinder, 0] + cos * model.pins[cylinder, 1]
    moved = knuckle_motion(
        pin_x, pin_y, 0.0, 0.0, 0.0, 0.0, joint[MASTER_LENGTH], joint[MASTER_OFFSET], joint[KNUCKLE_X],
        joint[KNUCKLE_Y],
    )  # fmt: skip
    x = joint[COS_TURN] * moved[0] + joint[SIN_TURN] * moved[1] - row[at.OFFSET]
    reach = joint[COS_TURN] * moved[1] - joint[SIN_TURN] * moved[0] + math.sqrt(row[at.ROD] * row[at.ROD] - x * x)
    return row[at.CLEARANCE_VOLUME] + row[at.AREA] * (row[at.STROKE_TOP] - reach)


@inlined_kernel
def built_in(model, state):
    """Whether the gas is the built-in trace."""
    return model.choices[at.GAS_SOURCE] == 1.0 or (model.choices[at.GAS_SOURCE] == 0.0 and state[PRESSURES_SET] == 0.0)


@inlined_kernel
def crank_rotation(model, state):
    """Rotation of the crank as a rigid body against its frame at the state (rad), its rate and acceleration."""
    n = model.omega2.shape[0]
    unit = model.scalars[at.RIGID_ROTATION]
    return (
        unit * state[offset(POSITION, n) + at.ROTATION],
        unit * state[offset(VELOCITY, n) + at.ROTATION],
        unit * state[offset(ACCELERATION, n) + at.ROTATION],
    )


@inlined_kernel
def trace_pressures(model, frame, rotation, pressures):
    """Pressures (c,) of the built-in trace with the crank turned by ``rotation`` (rad) against its frame."""
    share = burn_share(model, frame[at.OMEGA] - frame[at.LEAD_RATE])
    for c in range(model.cylinders.shape[0]):
        motored, rise = gas_pressures(trace_angle(model, c, frame[at.FIRING] + rotation), model.gas, c)
        pressures[c] = motored + share * rise


@inlined_kernel
def follow_crank(model, work, stage):
    """Pressures of the built-in trace at the crank's mean rotation in a stage, from the forces found so far."""
    rotation = work.modal[at.Q_FREE, at.ROTATION]
    response = work.turning.response[stage.slot]
    for k in range(response.shape[0]):
        rotation += response[k, at.ROTATION] * work.port[at.FORCES, k]
    trace_pressures(
        model, work.frames[stage.number], model.scalars[at.RIGID_ROTATION] * rotation, work.pressures[stage.number]
    )
