"""Deviation of a cylinder's volume from that of rigid parts at the crank's angle, over a communication step.

A crank twists and bends, its journals move in their films and a block moves: each piston follows its own pin. The
cranktrain gives the deviation D of each volume (m³) and its rate (m³/s) with the crank's angle. The zone's volume is
then V(φ) + D, so that the work of its gas is that which the pistons take. Where nobody gives a deviation, it is 0.

Over a communication step D is a cubic in time. It begins as the last one ended and ends at the value and rate that
belong to the step's end: those that are given (``inputs.at = end``), or the extrapolation of the cubic through the
last two given values and rates. After a step that is much shorter, or without one, the extrapolation is a line.
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.modules.combustion import slots as at
from cranktrain.modules.crank_angle import MOST_LONGER

FARTHEST = math.radians(10.0)
"""Turn of a communication step, rad, up to which a deviation is extrapolated; it is held over longer ones."""


@inlined_kernel
def deviation(now, time):
    """D, m³, at a time since the communication step began, s."""
    bent = now[at.DEVIATION_BEND] + time * now[at.DEVIATION_TWIST]
    return now[at.NOW_DEVIATION] + time * (now[at.DEVIATION_SLOPE] + time * bent)


@inlined_kernel
def deviation_rate(now, time):
    """dD/dt, m³/s."""
    return now[at.DEVIATION_SLOPE] + time * (2.0 * now[at.DEVIATION_BEND] + 3.0 * time * now[at.DEVIATION_TWIST])


@kernel
def follow_deviation(model, work, state, base, place, inputs, interval):
    """Fill the cubic of the cylinder at ``base`` for a communication step, from its inputs at ``place``."""
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
    """Value and rate after ``interval`` (s) of the cubic through a given value and rate and those ``past`` (s) before.

    A line where the step before was much shorter or there is none.
    """
    if not past * MOST_LONGER >= interval:
        return given + rate * interval, rate
    x = interval / past
    difference = (given - last) / past
    # By powers of the time since the given value, over the step before.
    bend = last_rate + 2.0 * rate - 3.0 * difference
    twist = last_rate + rate - 2.0 * difference
    value = given + interval * (rate + x * (bend + x * twist))
    return value, rate + x * (2.0 * bend + 3.0 * x * twist)
