"""The crank's angle and speed as a module receives them, turned on over a communication step.

An angle wraps at a cycle, 4π, or grows. Without one (``speed``, or ``auto`` while it is 0) the speed is integrated.
Inputs belong to the begin of a communication step, then the angle is turned on to its end, or to its end already.
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import kernel

ANGLES = ("speed", "input", "auto")
"""Where the angle comes from: the speed's integral, the input, or the input as soon as it moves."""
TIMES = ("begin", "end")
"""Which end of a communication step inputs belong to."""
BY_SPEED, _GIVEN, AUTO = range(len(ANGLES))

SPEED, ANGLE = 0, 1
"""Places of speed and angle in every module's inputs."""
HEAD = ("time", "angle", "partner_angle", "angle_seen", "last_interval", "last_angle", "last_speed")
"""First entries of every module's state."""
TIME, OWN_ANGLE, PARTNER_ANGLE, ANGLE_SEEN, LAST_INTERVAL, LAST_ANGLE, LAST_SPEED = range(len(HEAD))

OK = 0
NOT_AHEAD, JUMPS, BACKWARDS = 10, 11, 12
INPUT_NOT_FINITE, INPUT_NOT_POSITIVE, NUMBER_NOT_FINITE, UNKNOWN_CHOICE = 1000, 2000, 3000, 4000
"""Statuses of every module, see :mod:`.statuses`; to the last four the place in the array is added."""

LONGEST_STEP = 1.0
"""Longest communication step, s."""
LARGEST_JUMP = math.radians(90.0)
"""Largest difference, rad, of a received angle from where its speed has led."""
MOST_LONGER, MOST_GAINED = 2.0, 0.1
"""Step over the last one, and gain of a step over its turn, up to which an angle's gain on its speed goes on."""


@kernel
def cycle_angle(angle):
    """A crank angle within (−2π, 2π], rad."""
    return angle - 4.0 * math.pi * math.ceil((angle - 2.0 * math.pi) / (4.0 * math.pi))


@kernel
def gained(state, inputs, interval):
    """Angle, rad, that the crank gains on its speed if it goes on as in the last step: a swing about steady rotation.

    None where the last step says nothing about this one: before there is one, after one much shorter, or a jump.
    """
    last = state[LAST_INTERVAL]
    if not last * MOST_LONGER >= interval:
        return 0.0
    gain = cycle_angle(inputs[ANGLE] - state[LAST_ANGLE] - state[LAST_SPEED] * last) * interval / last
    return gain if abs(gain) <= MOST_GAINED * inputs[SPEED] * interval else 0.0


@kernel
def turned(state, inputs, interval, source, ends):
    """Angle that the crank turns in a communication step, rad, up to the extrapolated received angle.

    ``source`` and ``ends`` are indices into ``ANGLES`` and ``TIMES``. The state gets the angle in the partner's count
    at the step's end.
    """
    if inputs[ANGLE] != 0.0:
        state[ANGLE_SEEN] = 1.0
    expected = inputs[SPEED] * interval
    if source == BY_SPEED or (source == AUTO and state[ANGLE_SEEN] == 0.0):
        state[PARTNER_ANGLE] = state[OWN_ANGLE] + expected
        return expected
    end = inputs[ANGLE]
    if ends == 0:
        end += expected + gained(state, inputs, interval)
    state[PARTNER_ANGLE] = end
    return expected + cycle_angle(end - state[OWN_ANGLE] - expected)


@kernel
def keep_received(state, inputs, interval):
    """Keep the received values for the next step, and advance the time."""
    state[LAST_ANGLE] = inputs[ANGLE]
    state[LAST_SPEED] = inputs[SPEED]
    state[TIME] += interval
    state[LAST_INTERVAL] = interval


@kernel
def inputs_status(inputs):
    """Whether inputs are numbers and the crank does not turn back: a status."""
    for k in range(inputs.shape[0]):
        if not math.isfinite(inputs[k]):
            return INPUT_NOT_FINITE + k
    return BACKWARDS if inputs[SPEED] < 0.0 else OK


@kernel
def jump(state, inputs, interval, ends):
    """Angle, rad, by which a received angle is off from where its speed has led: within (−2π, 2π]."""
    ahead = 0.0 if ends == 0 else interval
    return cycle_angle(inputs[ANGLE] - state[OWN_ANGLE] - inputs[SPEED] * ahead)


@kernel
def step_status(state, inputs, t_end, source, ends):
    """Whether a communication step to ``t_end``, s, leads on, and the angle with it: a status.

    ``source`` and ``ends`` are places in ``ANGLES`` and ``TIMES``.
    """
    interval = t_end - state[TIME]
    if not 0.0 < interval <= LONGEST_STEP:
        return NOT_AHEAD
    if source == BY_SPEED or (source == AUTO and inputs[ANGLE] == 0.0 and state[ANGLE_SEEN] == 0.0):
        return OK
    return JUMPS if abs(jump(state, inputs, interval, ends)) > LARGEST_JUMP else OK


@kernel
def numbers_status(numbers):
    """Whether all of a run's numbers are finite: a status."""
    for k in range(numbers.shape[0]):
        if not math.isfinite(numbers[k]):
            return NUMBER_NOT_FINITE + k
    return OK


@kernel
def choice_status(numbers, slot, options):
    """Whether a number is the index of one of so many options, 0, 1, …: a status."""
    value = numbers[slot]
    return OK if 0.0 <= value < options and value == math.floor(value) else UNKNOWN_CHOICE + slot


@kernel
def copy_state(source, target):
    """Copy one state vector into another."""
    for k in range(source.shape[0]):
        target[k] = source[k]
