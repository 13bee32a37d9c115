"""Axial joint between flywheel and connecting shaft: bolted, or a spline that slides under friction.

With the slip velocity v of the flywheel against the shaft the force on the flywheel is

    F = −k z − c ż,     ż = v − k |v| z / F_max,     F_max = μ |T| / r

with the stiffness k and damping c of the teeth before they slide, the coefficient of friction μ, the radius r of the
spline and the torque T that the springs of the drive line carry. z is the elastic deflection of the teeth. It tends to
F_max/k as the joint slides one way (Dahl's model of dry friction), so a joint that sticks is a spring and one that
slides is a constant force. z belongs to the state and is integrated by the rule of the stage, z = Δ + g ż. This gives

    z = (Δ + g v) / (1 + g k |v| / F_max).

A bolted joint has F_max = ∞, so z is the displacement of the flywheel against the shaft and has no history.

Source: P. R. Dahl, A solid friction model, The Aerospace Corporation, TOR-0158(3107-18)-1 (1968).
"""

from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import inlined_kernel, law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.engine.parts import AxialPath
from cranktrain.film.laws.films import (
    BY_VELOCITY,
    CLOSE_STAGE,
    CLOSE_STEP,
    FORCE,
    GAIN,
    OPEN_STAGE,
    OPEN_STEP,
    RATE,
    STAGE,
    STEP,
)

LEAST_LIMIT = 1.0e-3
"""Friction limit (N) if no torque presses the teeth together."""
DEFLECTION, DEFLECTION_RATE, REMEMBERED = range(3)
"""Indices of the joint's values in the state: z (m) and ż (m/s)."""
SLIP, WINDUP_TORQUE = range(2)
"""Indices of ``place``: displacement of flywheel against shaft (m), torque in the springs of the drive line (N m)."""
STIFFNESS, DAMPING, LIMIT_BY_TORQUE = range(3)


class AxialJoint(NamedTuple):
    """Constants of the axial joint and its memory within a step."""

    constants: Array  # (3,) k (N/m), c (N s/m), μ/r (1/m; negative: bolted)
    start: Array  # (1,) z at the step's start, m
    known: Array  # (1,) Δ of the stage's rule ż = (z − Δ)/g, m
    deflection: Array  # (1,) z at the stage, m
    rates: Array  # (stages,) ż of each stage, m/s


def axial_joint(path: AxialPath) -> AxialJoint:
    """Make the axial joint of an engine file."""
    limit = path.friction / path.spline_radius if path.joint == "spline" else -1.0
    z = np.zeros
    return AxialJoint(np.array([path.joint_stiffness, path.joint_damping, limit]), z(1), z(1), z(1), z(8))


_read = record_reader(AxialJoint(*(np.zeros(1) for _ in range(5))))


@law_kernel
def axial_joint_law(record, action, i, place, velocity, numbers, memory, out):
    """Axial force on the flywheel and its tangent, as a law of :mod:`cranktrain.film.laws.films`.

    ``memory`` is (z, ż) of the state; for OPEN_STAGE, the row of the stage in the integrator's table. Returns 0.
    """
    motion = place[SLIP], velocity[SLIP], place[WINDUP_TORQUE]
    return joint_force(_read(record), action, motion, numbers, memory, out)


@inlined_kernel
def joint_force(own, action, motion, numbers, memory, out):
    """Carry out an action of the joint ``own`` at ``motion``: slip (m), slip velocity (m/s), torque (N m). Return 0."""
    slip, v, torque = motion
    if action in (FORCE, CLOSE_STAGE):
        if own.constants[LIMIT_BY_TORQUE] < 0.0:
            z, by_velocity, rate = slip, numbers[GAIN], v
        else:
            z, by_velocity = _deflection(own, abs(torque), v, numbers[GAIN])
            rate = (z - own.known[0]) / numbers[GAIN]
        if action == CLOSE_STAGE:
            own.deflection[0] = z
            own.rates[int(numbers[STAGE])] = rate
            return 0
        for k in range(BY_VELOCITY + 16):
            out[k] = 0.0
        out[0] = -own.constants[STIFFNESS] * z - own.constants[DAMPING] * rate
        out[BY_VELOCITY] = -(own.constants[STIFFNESS] + own.constants[DAMPING] / numbers[GAIN]) * by_velocity
    elif action == OPEN_STAGE:
        past = own.start[0]
        for s in range(int(numbers[STAGE])):
            past += numbers[STEP] * memory[s] * own.rates[s]
        own.known[0] = past
    elif action == OPEN_STEP:
        own.start[0] = memory[DEFLECTION]
        own.deflection[0] = memory[DEFLECTION]
        own.rates[0] = memory[DEFLECTION_RATE]
    elif action == CLOSE_STEP:
        memory[DEFLECTION] = own.deflection[0]
        memory[DEFLECTION_RATE] = own.rates[int(numbers[STAGE])]
    elif action == RATE:
        out[0] = 0.0
    else:
        out[0] = -own.constants[STIFFNESS] * memory[DEFLECTION] - own.constants[DAMPING] * memory[DEFLECTION_RATE]
    return 0


@inlined_kernel
def _deflection(own, torque, v, gain):
    """Return the deflection z (m) of the teeth at slip velocity v (m/s), and ∂z/∂v."""
    known = own.known[0]
    limit = own.constants[LIMIT_BY_TORQUE] * torque + LEAST_LIMIT
    per_speed = gain * own.constants[STIFFNESS] / limit
    yielding = 1.0 + per_speed * abs(v)
    z = (known + gain * v) / yielding
    return z, (gain - (per_speed if v > 0.0 else -per_speed) * z) / yielding


@inlined_kernel
def limit_slope(own, torque, v, gain):
    """Return the derivative of the joint's force (N) by the torque (N m) on its teeth, at slip velocity v (m/s)."""
    if own.constants[LIMIT_BY_TORQUE] < 0.0:
        return 0.0
    z, _ = _deflection(own, abs(torque), v, gain)
    limit = own.constants[LIMIT_BY_TORQUE] * abs(torque) + LEAST_LIMIT
    share = gain * own.constants[STIFFNESS] * abs(v) / limit
    by_limit = z * share / (limit * (1.0 + share))
    slope = -(own.constants[STIFFNESS] + own.constants[DAMPING] / gain) * by_limit * own.constants[LIMIT_BY_TORQUE]
    return slope if torque > 0.0 else -slope
