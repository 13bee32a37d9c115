"""Force law of a piston in its liner: two layers of springs on the skirt, and friction along the wall.

The layers are those of :mod:`cranktrain.loads.piston_guidance`. Components are the gaps of the upper and of the lower
layer across the cylinder, and the motion along it.
"""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, ECCENTRICITY
from cranktrain.film.laws.films import FRICTION as RUBBING_TORQUE
from cranktrain.loads.piston_guidance import FRICTION, SLIDING, layer_force, liner_friction

ALONG = 2


class LinerRecord(NamedTuple):
    """Data of one piston in its liner."""

    law: Array  # (9,) parameters of the skirt, see skirt_parameters


_read = record_reader(LinerRecord(np.zeros(1)))


@law_kernel
def liner_law(record, action, i, place, velocity, numbers, memory, out):
    """Write forces of both layers, friction and tangents, see :mod:`cranktrain.film.laws.films`. Return 0."""
    law = _read(record).law
    for k in range(ECCENTRICITY):
        out[k] = 0.0
    out[RUBBING_TORQUE] = 0.0
    # Each layer writes three values to slots where the tangents of both layers are written afterwards.
    own = out[BY_PLACE:]
    layer_force(law, 0, place[0], velocity[0], own)
    upper, upper_by_gap, upper_by_rate = own[0], own[1], own[2]
    layer_force(law, 1, place[1], velocity[1], own)
    lower, lower_by_gap, lower_by_rate = own[0], own[1], own[2]
    for k in range(3):
        own[k] = 0.0
    out[0] = upper
    out[1] = lower
    out[ALONG] = liner_friction(law, upper, lower, velocity[ALONG])
    out[BY_PLACE] = upper_by_gap
    out[BY_PLACE + 5] = lower_by_gap
    out[BY_VELOCITY] = upper_by_rate
    out[BY_VELOCITY + 5] = lower_by_rate
    if law[FRICTION] > 0.0:
        share = math.tanh(velocity[ALONG] / law[SLIDING])
        out[BY_VELOCITY + 4 * ALONG + ALONG] = (1.0 - share * share) * (
            -law[FRICTION] * (abs(upper) + abs(lower)) / law[SLIDING]
        )
    return 0
