"""Force law of a torsional damper with one component, the twist of hub and ring; see :mod:`cranktrain.loads.damper`.

The hub is the first end, the ring the second one. An added damper has the temperature of its table at the engine's
speed for which a run is prepared (action WARM); before that, the one at the first speed of the table. The parameters
of the engine's own damper are prepared with the model.
"""

from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.engine.lubricant import temperature_at
from cranktrain.engine.parts import Damper
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, ECCENTRICITY, FRICTION, SPEED, WARM
from cranktrain.loads.damper import damper_at, damper_constants, damper_parameters, damper_torque

BY_TWIST, BY_RATE, DISSIPATED = 1, 2, 3
"""Positions of derivatives and power after the torque, in results of :func:`~cranktrain.loads.damper.damper_torque`."""
HEAT = ECCENTRICITY
"""Slot in the results of the damper's force law for the dissipated power (W)."""


class DamperRecord(NamedTuple):
    """Data of one damper."""

    parameters: Array  # (PARAMETERS,) parameters of the damper at the present temperature, see loads.damper
    constants: Array  # (DAMPER_CONSTANTS,) constants of the damper; empty if prepared with the model
    table: Array  # (2, n) engine speeds, rad/s, and damper temperatures, K


def damper_record(damper: Damper) -> DamperRecord:
    """Record of an added damper whose values were checked."""
    table = np.array([damper.temperature_speeds, damper.temperatures], dtype=float)
    return DamperRecord(damper_parameters(damper, float(table[1, 0])), damper_constants(damper), table)


_read = record_reader(DamperRecord(np.zeros(1), np.zeros(1), np.zeros((1, 1))))


@law_kernel
def damper_law(record, action, i, place, velocity, numbers, memory, out):
    """Torque on the hub by its twist relative to the ring, see film.laws.films. Return 0, or a failure status."""
    own = _read(record)
    if action == WARM:
        return damper_at(own.constants, temperature_at(numbers[SPEED], own.table[0], own.table[1]), own.parameters)
    damper_torque(own.parameters, place[0], velocity[0], out)
    by_twist, by_rate, heat = out[BY_TWIST], out[BY_RATE], out[DISSIPATED]
    for k in range(1, ECCENTRICITY):
        out[k] = 0.0
    out[FRICTION] = 0.0
    out[BY_PLACE] = by_twist
    out[BY_VELOCITY] = by_rate
    out[HEAT] = heat
    return 0
