"""Force law of a belt on two pulleys, whose two strands pull and never push.

A strand leaves each pulley at a tangent. Let d be the motion of its end on the first pulley relative to the end on the
second one, along the strand towards the second pulley. The strand's tension is

    T = ½ (p + √(p² + ε²)),    p = T₀ − k d − c ḋ,

with the tension T₀ at rest. ε is a hundredth of T₀ and rounds the corner where the strand goes slack. Slip on the
pulleys and the mass of the belt are neglected.
"""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, ECCENTRICITY, FRICTION

ROUNDED = 0.01
"""Fraction ε/T₀ of the tension at rest over which the corner to a slack strand is rounded."""
TENSION, STIFFNESS, DAMPING, CONSTANTS = range(4)


class BeltRecord(NamedTuple):
    """Data of one belt."""

    constants: Array  # (CONSTANTS,)


def strands(distance: float, radii: tuple[float, float], crossed: bool) -> list[tuple[Array, Array, Array]]:
    """Direction of each strand from the first pulley to the second, and its points of contact relative to the centres.

    Vectors (3,) are in axes x from the first centre to the second and y to its left; the left strand comes first. Radii
    must be possible for the distance of the centres.
    """
    second = -radii[1] if crossed else radii[1]
    sine = (radii[0] - second) / distance
    cosine = math.sqrt(1.0 - sine * sine)
    found = []
    for side in (1.0, -1.0):
        normal = np.array([sine, side * cosine, 0.0])
        along = np.array([distance, 0.0, 0.0]) + (second - radii[0]) * normal
        found.append((along / np.linalg.norm(along), radii[0] * normal, second * normal))
    return found


_read = record_reader(BeltRecord(np.zeros(1)))


@law_kernel
def belt_law(record, action, i, place, velocity, numbers, memory, out):
    """Write the tensions of both strands on the first end, see :mod:`cranktrain.film.laws.films`. Return 0."""
    own = _read(record).constants
    for k in range(ECCENTRICITY):
        out[k] = 0.0
    out[FRICTION] = 0.0
    rounded = ROUNDED * own[TENSION]
    for r in range(2):
        pulled = own[TENSION] - own[STIFFNESS] * place[r] - own[DAMPING] * velocity[r]
        root = math.sqrt(pulled * pulled + rounded * rounded)
        share = 0.5 * (1.0 + pulled / root)
        out[r] = 0.5 * (pulled + root)
        out[BY_PLACE + 5 * r] = -share * own[STIFFNESS]
        out[BY_VELOCITY + 5 * r] = -share * own[DAMPING]
    return 0
