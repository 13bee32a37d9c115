"""Deviation of a cylinder's volume from that of rigid parts, over a communication step.

A crank twists and bends, journals move in their films and a block moves, so each piston follows its own pin. The
cranktrain outputs the deviation D of each volume (m³) and its rate (m³/s) together with the crank angle. The volume of
the zone is then V(φ) + D, so the work of the gas equals the work on the piston. D is 0 if no deviation is connected.

Within a communication step D is a cubic in time. It starts with the value and rate at the end of the last step. It ends
with the given value and rate if these belong to the end of the step (``inputs.at = end``), else with the extrapolation
of the cubic through the last two given values and rates. Without a last step, or after a much shorter one, the
extrapolation is a straight line.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.modules.combustion import slots as at
from cranktrain.modules.crank_angle import MOST_LONGER

FARTHEST = math.radians(10.0)
"""Largest crank rotation in a communication step, rad, for which a deviation is extrapolated; else it is held."""


@inlined_kernel
def deviation(now, time):
    """Volume deviation D of a cylinder, m³, at a time since the start of the communication step, s."""
    bent = now[at.DEVIATION_BEND] + time * now[at.DEVIATION_TWIST]
    return now[at.NOW_DEVIATION] + time * (now[at.DEVIATION_SLOPE] + time * bent)


@inlined_kernel
def deviation_rate(now, time):
    """Rate dD/dt of a cylinder's volume deviation, m³/s."""
    return now[at.DEVIATION_SLOPE] + time * (2.0 * now[at.DEVIATION_BEND] + 3.0 * time * now[at.DEVIATION_TWIST])


@kernel
def follow_deviation(model, work, state, base, place, inputs, interval):
    """Set the cubic of the cylinder at ``base`` for a communication step, from its inputs at ``place``."""
    now = work.now
    given, rate = inputs[place + at.DEVIATION_IN], inputs[place + at.DEVIATION_RATE_IN]
    begin, slope = state[base + at.DEVIATION], state[base + at.DEVIATION_RATE]
    end, end_rate = given, rate
    if inputs[at.SPEED] * interval > FARTHEST:
        slope, end_rate = 0.0, 0.0
    elif model.choices[at.ENDS] == 0:
        end, end_rate = extrapolated(
            state[base + at.LAST_DEVIATION], state[base + at.LAST_DEVIATION_RATE], given, rate,
            state[at.LAST_INTERVAL], interval,
        )  # fmt: skip
    mean = (end - begin) / interval
    now[at.NOW_DEVIATION] = begin
    now[at.DEVIATION_SLOPE] = slope
    now[at.DEVIATION_BEND] = (3.0 * mean - 2.0 * slope - end_rate) / interval
    now[at.DEVIATION_TWIST] = (slope + end_rate - 2.0 * mean) / (interval * interval)
    state[base + at.DEVIATION], state[base + at.DEVIATION_RATE] = end, end_rate
    state[base + at.LAST_DEVIATION], state[base + at.LAST_DEVIATION_RATE] = given, rate


@kernel
def extrapolated(last, last_rate, given, rate, past, interval):
    """Value and rate after ``interval`` (s) by the cubic through the given values and rates, now and ``past`` (s) ago.

    The extrapolation is a straight line if there was no step before, or a much shorter one.
    """
    if not past * MOST_LONGER >= interval:
        return given + rate * interval, rate
    x = interval / past
    difference = (given - last) / past
    # The polynomial is in the time since the given value, over the length of the last step.
    bend = last_rate + 2.0 * rate - 3.0 * difference
    twist = last_rate + rate - 2.0 * difference
    value = given + interval * (rate + x * (bend + x * twist))
    return value, rate + x * (2.0 * bend + 3.0 * x * twist)
