"""Torsional damper between hub and ring as a law of one component, their twist; see :mod:`cranktrain.loads.damper`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, ECCENTRICITY, FRICTION
from cranktrain.loads.damper import damper_torque


class DamperRecord(NamedTuple):
    """Data of one damper."""

    parameters: Array  # (PARAMETERS,) see loads.damper


_read = record_reader(DamperRecord(np.zeros(1)))


@law_kernel
def damper_law(record, action, i, place, velocity, numbers, memory, out):
    """Torque on the hub by the twist against the ring, see :mod:`cranktrain.film.laws.films`; 0."""
    damper_torque(_read(record).parameters, place[0], velocity[0], out)
    by_twist, by_rate = out[1], out[2]
    for k in range(1, ECCENTRICITY):
        out[k] = 0.0
    out[FRICTION] = 0.0
    out[BY_PLACE] = by_twist
    out[BY_VELOCITY] = by_rate
    return 0
