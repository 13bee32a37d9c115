"""Crank angle and speed as a module receives them, and their course over a communication step.

A received angle may wrap after a cycle, 4π, or grow. Without an angle (choice ``speed``, or ``auto`` while it is 0) the
speed is integrated. Inputs either belong to the beginning of a communication step, and the angle is extrapolated to its
end, or they belong to its end.
"""

import math

from cranktrain.core.kernel import kernel

ANGLES = ("speed", "input", "auto")
"""Sources of the angle: the integral of the speed, the input, or the input from the first one that is not 0."""
TIMES = ("begin", "end")
"""End of a communication step to which the inputs belong."""
BY_SPEED, _GIVEN, AUTO = range(len(ANGLES))

SPEED, ANGLE = 0, 1
"""Indices of speed and angle in every module's inputs."""
HEAD = ("time", "angle", "partner_angle", "angle_seen", "last_interval", "last_angle", "last_speed")
"""First entries of every module's state."""
TIME, OWN_ANGLE, PARTNER_ANGLE, ANGLE_SEEN, LAST_INTERVAL, LAST_ANGLE, LAST_SPEED = range(len(HEAD))

OK = 0
NOT_AHEAD, JUMPS, BACKWARDS = 10, 11, 12
INPUT_NOT_FINITE, INPUT_NOT_POSITIVE, NUMBER_NOT_FINITE, UNKNOWN_CHOICE = 1000, 2000, 3000, 4000
"""Statuses of every module, see :mod:`.statuses`; the last four are increased by the index in the array."""

LONGEST_STEP = 1.0
"""Longest communication step, s."""
LARGEST_JUMP = math.radians(90.0)
"""Largest difference, rad, of a received angle from the angle reached by the received speed."""
MOST_LONGER, MOST_GAINED = 2.0, 0.1
"""Limits for extrapolating an angle's gain over its speed: step over the last step, and gain over rotation."""


@kernel
def cycle_angle(angle):
    """Crank angle reduced to (−2π, 2π], rad."""
    return angle - 4.0 * math.pi * math.ceil((angle - 2.0 * math.pi) / (4.0 * math.pi))


@kernel
def gained(state, inputs, interval):
    """Angle, rad, gained relative to the speed if the crank continues as in the last step, in a torsional oscillation.

    The gain is 0 if the last step says nothing about this one: there is none, it was much shorter, or the angle jumped.
    """
    last = state[LAST_INTERVAL]
    if not last * MOST_LONGER >= interval:
        return 0.0
    gain = cycle_angle(inputs[ANGLE] - state[LAST_ANGLE] - state[LAST_SPEED] * last) * interval / last
    return gain if abs(gain) <= MOST_GAINED * inputs[SPEED] * interval else 0.0


@kernel
def turned(state, inputs, interval, source, ends):
    """Rotation of the crank in a communication step, rad, up to the extrapolated received angle.

    ``source`` and ``ends`` are indices into ``ANGLES`` and ``TIMES``. The state receives the angle at the end of the
    step as the partner counts it.
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
    """Store the received speed and angle for the next step, and advance the time."""
    state[LAST_ANGLE] = inputs[ANGLE]
    state[LAST_SPEED] = inputs[SPEED]
    state[TIME] += interval
    state[LAST_INTERVAL] = interval


@kernel
def inputs_status(inputs):
    """Status of the inputs: OK if they are finite numbers and the speed is not negative."""
    for k in range(inputs.shape[0]):
        if not math.isfinite(inputs[k]):
            return INPUT_NOT_FINITE + k
    return BACKWARDS if inputs[SPEED] < 0.0 else OK


@kernel
def jump(state, inputs, interval, ends):
    """Difference, rad, of a received angle from the angle reached by the received speed, within (−2π, 2π]."""
    ahead = 0.0 if ends == 0 else interval
    return cycle_angle(inputs[ANGLE] - state[OWN_ANGLE] - inputs[SPEED] * ahead)


@kernel
def step_status(state, inputs, t_end, source, ends):
    """Status of a communication step to ``t_end``, s: OK if it goes forward and the received angle does not jump.

    ``source`` and ``ends`` are indices into ``ANGLES`` and ``TIMES``.
    """
    interval = t_end - state[TIME]
    if not 0.0 < interval <= LONGEST_STEP:
        return NOT_AHEAD
    if source == BY_SPEED or (source == AUTO and inputs[ANGLE] == 0.0 and state[ANGLE_SEEN] == 0.0):
        return OK
    return JUMPS if abs(jump(state, inputs, interval, ends)) > LARGEST_JUMP else OK


@kernel
def numbers_status(numbers):
    """Status of a run's numbers: OK if all are finite."""
    for k in range(numbers.shape[0]):
        if not math.isfinite(numbers[k]):
            return NUMBER_NOT_FINITE + k
    return OK


@kernel
def choice_status(numbers, slot, options):
    """Status of a choice: OK if the number is one of 0, 1, … ``options`` − 1."""
    value = numbers[slot]
    return OK if 0.0 <= value < options and value == math.floor(value) else UNKNOWN_CHOICE + slot


@kernel
def copy_state(source, target):
    """Copy one state vector into another."""
    for k in range(source.shape[0]):
        target[k] = source[k]
