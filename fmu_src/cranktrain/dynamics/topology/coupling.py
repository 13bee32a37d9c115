"""Force law of a coupling of two bodies that rotate together: spring (linear or by a table), damper and friction.

The torque on the first end, at its twist φ relative to the second one, is

    T = −k φ − T(φ) − c φ̇ − T_f φ̇/√(φ̇² + ω_s²)

with the friction T_f of springs on their guide, such as bow springs of a dual-mass flywheel. It is constant and opposed
to the motion above the slip speed ω_s, and viscous far below it. A table T(φ) is linear between its points and
extrapolated beyond them.
"""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.engine.connections import Coupling
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, ECCENTRICITY, FRICTION

STIFFNESS, DAMPING, RUBBING, SLIP, CONSTANTS = range(5)


class CouplingRecord(NamedTuple):
    """Data of one coupling."""

    constants: Array  # (CONSTANTS,)
    points: Array  # (2, n) twists (rad) and torques (N m) of the table, or (2, 0)


def coupling_record(coupling: Coupling) -> CouplingRecord:
    """Record of a coupling; ``InputError`` for a table whose twists do not rise, or with columns of unequal length."""
    twists, torques = np.array(coupling.twists, dtype=float), np.array(coupling.torques, dtype=float)
    if twists.size != torques.size or twists.size == 1 or np.any(np.diff(twists) <= 0.0):
        raise InputError(
            f"{twists.size} twists and {torques.size} torques; give as many of each, two at least, the twists rising"
        )
    constants = np.array([coupling.stiffness, coupling.damping, coupling.friction, coupling.slip_speed])
    return CouplingRecord(constants, np.array([twists, torques]))


_read = record_reader(CouplingRecord(np.zeros(1), np.zeros((1, 1))))


@law_kernel
def coupling_law(record, action, i, place, velocity, numbers, memory, out):
    """Write the torque on the first end and its tangents, see :mod:`cranktrain.film.laws.films`. Return 0."""
    own = _read(record)
    for k in range(ECCENTRICITY):
        out[k] = 0.0
    out[FRICTION] = 0.0
    twist = place[0]
    rate = velocity[0]
    size = math.sqrt(rate * rate + own.constants[SLIP] * own.constants[SLIP])
    share = own.constants[SLIP] / size
    out[0] = -own.constants[STIFFNESS] * twist - own.constants[DAMPING] * rate - own.constants[RUBBING] * rate / size
    out[BY_PLACE] = -own.constants[STIFFNESS]
    out[BY_VELOCITY] = -own.constants[DAMPING] - own.constants[RUBBING] * share * share / size
    count = own.points.shape[1]
    if count > 1:
        k = 0
        while k < count - 2 and twist > own.points[0, k + 1]:
            k += 1
        slope = (own.points[1, k + 1] - own.points[1, k]) / (own.points[0, k + 1] - own.points[0, k])
        out[0] -= own.points[1, k] + slope * (twist - own.points[0, k])
        out[BY_PLACE] -= slope
    return 0
