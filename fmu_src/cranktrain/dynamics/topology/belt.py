"""Belt on two pulleys: two strands that pull and never push.

A strand leaves each pulley at a tangent. With d the motion of its end on the first pulley against that on the second,
along the strand towards the second, it is pulled by

    T = ½ (p + √(p² + ε²)),    p = T₀ − k d − c ḋ,

T₀ being its tension at rest and ε a hundredth of it, which rounds the corner where it goes slack. Slip on the pulleys
and the mass of the belt are left out.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.engine.connections import Belt
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, ECCENTRICITY, FRICTION

ROUNDED = 0.01
"""Share of the tension at rest over which a strand goes slack."""
TENSION, STIFFNESS, DAMPING, CONSTANTS = range(4)


class BeltRecord(NamedTuple):
    """Data of one belt."""

    constants: Array  # (CONSTANTS,)


def belt_record(belt: Belt) -> BeltRecord:
    """Data of a belt."""
    return BeltRecord(np.array([belt.tension, belt.stiffness, belt.damping]))


def strands(distance: float, radii: tuple[float, float], crossed: bool) -> list[tuple[Array, Array, Array]]:
    """Of both strands the direction from the first pulley to the second, and where they touch these (from the centres).

    In axes x from the first centre to the second, y to its left, (3,) each; the strand on the left first. Radii are no
    larger than the distance of the centres allows.
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
    """Tensions of both strands, which pull the first end along them; see :mod:`cranktrain.film.laws.films`; 0."""
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
