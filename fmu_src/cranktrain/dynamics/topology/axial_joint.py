"""Force law of a joint that carries a torque and slides along the axis: bolted, or a spline with friction.

Along the axis the law is that of a drive line's joint (:mod:`cranktrain.film.laws.axial_joint`), with the memory of its
teeth. About the axis it is a spring and damper, T = −k φ − c φ̇. The spring's torque presses the teeth together.
"""

from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.engine.connections import SlidingJoint
from cranktrain.film.laws.axial_joint import DAMPING, STIFFNESS, AxialJoint, axial_joint, joint_force, limit_slope
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, ECCENTRICITY, FORCE, FRICTION, GAIN, OBSERVE

ALONG, ABOUT = range(2)
"""Components of motion of the first end relative to the second: displacement along the axis, m, and twist, rad."""
CROSS = 5
"""Number of slots from one diagonal tangent to the next."""


class SlidingRecord(NamedTuple):
    """Data and memory of one joint."""

    joint: AxialJoint
    torsion: Array  # (2,) stiffness, N m/rad, and damping, N m s/rad, about the axis


def sliding_record(joint: SlidingJoint) -> SlidingRecord:
    """Record of a sliding joint whose values were checked."""
    return SlidingRecord(axial_joint(joint.path), np.array([joint.turning_stiffness, joint.turning_damping]))


_read = record_reader(SlidingRecord(AxialJoint(*(np.zeros(1) for _ in range(5))), np.zeros(1)))


@law_kernel
def sliding_law(record, action, i, place, velocity, numbers, memory, out):
    """Write axial force and torque on the first end to ``out``, see :mod:`cranktrain.film.laws.films`. Return 0."""
    own = _read(record)
    torque = own.torsion[STIFFNESS] * place[ABOUT]
    if numbers[GAIN] > 0.0 or action not in (FORCE, OBSERVE):
        joint_force(own.joint, action, (place[ALONG], velocity[ALONG], torque), numbers, memory, out)
        if action not in (FORCE, OBSERVE):
            return 0
    else:
        # Before the first stage the teeth stick.
        for k in range(ECCENTRICITY):
            out[k] = 0.0
        stiffness = own.joint.constants[STIFFNESS]
        damping = own.joint.constants[DAMPING]
        out[ALONG] = -stiffness * place[ALONG] - damping * velocity[ALONG]
        out[BY_PLACE] = -stiffness
        out[BY_VELOCITY] = -damping
    out[FRICTION] = 0.0
    out[ABOUT] = -torque - own.torsion[DAMPING] * velocity[ABOUT]
    if action == FORCE:
        if numbers[GAIN] > 0.0:
            slope = limit_slope(own.joint, torque, velocity[ALONG], numbers[GAIN])
            out[BY_PLACE + ABOUT] = own.torsion[STIFFNESS] * slope
        out[BY_PLACE + CROSS] = -own.torsion[STIFFNESS]
        out[BY_VELOCITY + CROSS] = -own.torsion[DAMPING]
    return 0
