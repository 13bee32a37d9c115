"""Ring of a torsional damper against its housing: fluid or rubber, by :mod:`cranktrain.loads.damper`.

The one component is the twist of the housing, the first end, against the ring. The damper is as warm as its table says
at the engine's speed, for which a run is prepared; before that, as at the first speed of the table.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.engine.lubricant import temperature_at
from cranktrain.engine.parts import Damper
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, ECCENTRICITY, FRICTION, SPEED, WARM
from cranktrain.loads.damper import damper_at, damper_constants, damper_parameters, damper_torque

TORQUE, BY_TWIST, BY_RATE, DISSIPATED = range(4)
"""What :func:`~cranktrain.loads.damper.damper_torque` writes."""
POWER = ECCENTRICITY
"""Slot of the law's figures where the dissipated power (W) is shown."""


class DamperRecord(NamedTuple):
    """Data of one damper."""

    constants: Array  # (DAMPER_CONSTANTS,) of its law, see loads.damper
    table: Array  # (2, n) temperatures, K, in the second row over the engine's speed, rad/s
    parameters: Array  # (PARAMETERS,) of its law at the present temperature
    out: Array  # (4,) what damper_torque writes


def damper_record(damper: Damper) -> DamperRecord:
    """Data of a damper whose values were checked."""
    table = np.array([damper.temperature_speeds, damper.temperatures], dtype=float)
    parameters = damper_parameters(damper, float(table[1, 0]))
    return DamperRecord(damper_constants(damper), table, parameters, np.zeros(4))


_read = record_reader(DamperRecord(np.zeros(1), np.zeros((1, 1)), np.zeros(1), np.zeros(1)))


@law_kernel
def ring_damper_law(record, action, i, place, velocity, numbers, memory, out):
    """Torque on the housing and its tangents, see :mod:`cranktrain.film.laws.films`; not 0 beyond its temperatures."""
    own = _read(record)
    if action == WARM:
        temperature = temperature_at(numbers[SPEED], own.table[0], own.table[1])
        return damper_at(own.constants, temperature, own.parameters)
    for k in range(ECCENTRICITY):
        out[k] = 0.0
    out[FRICTION] = 0.0
    damper_torque(own.parameters, place[0], velocity[0], own.out)
    out[0] = own.out[TORQUE]
    out[BY_PLACE] = own.out[BY_TWIST]
    out[BY_VELOCITY] = own.out[BY_RATE]
    out[POWER] = own.out[DISSIPATED]
    return 0
