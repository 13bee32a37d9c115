"""Force laws of springs and dampers along three axes at rest, and of a load given over the crank angle."""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.film.laws.films import ANGLE, BY_PLACE, BY_VELOCITY, ECCENTRICITY, FRICTION, INPUT

AXES = 3


class SpringRecord(NamedTuple):
    """Data of up to three springs."""

    stiffness: Array  # (1 to 3,) stiffness of each spring
    damping: Array


class LoadRecord(NamedTuple):
    """Data of a load."""

    force: Array  # (3,)
    turning: Array  # (3,) order and phase (rad) of the load over the crank angle; 1 if it is multiplied by an input


_read_spring = record_reader(SpringRecord(np.zeros(1), np.zeros(1)))
_read_load = record_reader(LoadRecord(np.zeros(1), np.zeros(1)))


@law_kernel
def spring_law(record, action, i, place, velocity, numbers, memory, out):
    """Write forces and tangents of springs and dampers, see :mod:`cranktrain.film.laws.films`. Return 0."""
    own = _read_spring(record)
    for k in range(ECCENTRICITY):
        out[k] = 0.0
    out[FRICTION] = 0.0
    for k in range(own.stiffness.shape[0]):
        out[k] = -own.stiffness[k] * place[k] - own.damping[k] * velocity[k]
        out[BY_PLACE + 5 * k] = -own.stiffness[k]
        out[BY_VELOCITY + 5 * k] = -own.damping[k]
    return 0


@law_kernel
def load_law(record, action, i, place, velocity, numbers, memory, out):
    """Write the load at the crank angle, see :mod:`cranktrain.film.laws.films`. Return 0."""
    own = _read_load(record)
    for k in range(ECCENTRICITY):
        out[k] = 0.0
    out[FRICTION] = 0.0
    share = math.cos(own.turning[0] * numbers[ANGLE] + own.turning[1])
    if own.turning[2] > 0.0:
        share *= numbers[INPUT]
    for k in range(AXES):
        out[k] = share * own.force[k]
    return 0
