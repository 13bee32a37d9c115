"""Force law of gas on a piston and, opposite, on its head: pressure times area along the cylinder.

The pressure is that of one of the engine's cylinders, or a trace of its own over the crank angle, linear between its
points and periodic.
"""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.engine.connections import Gas
from cranktrain.film.laws.films import ANGLE, ECCENTRICITY, FRICTION, PRESSURE

AREA, PERIOD, CONSTANTS = range(3)


class GasRecord(NamedTuple):
    """Data of the gas of one cylinder."""

    constants: Array  # (CONSTANTS,)
    points: Array  # (2, n) crank angles (rad) and pressures above the crankcase's (Pa); (2, 0) for the cylinder's gas


def gas_record(gas: Gas) -> GasRecord:
    """Record of a cylinder's gas; ``InputError`` for crank angles that do not rise within a period, or two sources."""
    angles, pressures = np.array(gas.angles, dtype=float), np.array(gas.pressures, dtype=float)
    if (gas.cylinder > 0) == (angles.size > 0):
        raise InputError("give either the cylinder whose gas it is, or angles and pressures of a trace")
    rises = angles.size < 2 or (np.all(np.diff(angles) > 0.0) and angles[-1] - angles[0] < gas.period)
    if angles.size != pressures.size or angles.size == 1 or not rises:
        raise InputError(
            f"{angles.size} angles and {pressures.size} pressures; give as many of each, two at least, the angles "
            f"rising within {math.degrees(gas.period):.6g} deg"
        )
    if angles.size:
        # The first point of the trace is repeated after one period.
        angles, pressures = np.append(angles, angles[0] + gas.period), np.append(pressures, pressures[0])
    constants = np.array([0.25 * math.pi * gas.bore**2, gas.period])
    return GasRecord(constants, np.array([angles, pressures - gas.crankcase_pressure]))


_read = record_reader(GasRecord(np.zeros(1), np.zeros((1, 1))))


@law_kernel
def gas_law(record, action, i, place, velocity, numbers, memory, out):
    """Write the gas force on the piston along the cylinder, see :mod:`cranktrain.film.laws.films`. Return 0."""
    own = _read(record)
    for k in range(ECCENTRICITY):
        out[k] = 0.0
    out[FRICTION] = 0.0
    pressure = numbers[PRESSURE]
    count = own.points.shape[1]
    if count > 1:
        period = own.constants[PERIOD]
        first = own.points[0, 0]
        angle = numbers[ANGLE] - period * math.floor((numbers[ANGLE] - first) / period)
        low, high = 0, count - 1
        while high - low > 1:
            middle = (low + high) // 2
            if own.points[0, middle] <= angle:
                low = middle
            else:
                high = middle
        share = (angle - own.points[0, low]) / (own.points[0, high] - own.points[0, low])
        pressure = own.points[1, low] + share * (own.points[1, high] - own.points[1, low])
    out[0] = -pressure * own.constants[AREA]
    return 0
