"""Turns of units whose functions can be called at their addresses: set inputs, step, read outputs.

The values of all units are in the master's vectors, see the coupling's master. An input is
``scale · known[place] + shift``, within its bounds. A call sets or reads the values of a unit's variables where they
lie one after the other, arrays whole; inputs and outputs of the master have places among them. Each call is noted in
memory that a supervising process reads.
"""

from __future__ import annotations

import math

import numpy as np

from cranktrain.core.foreign_function import call_foreign
from cranktrain.core.kernel import inlined_kernel, kernel

FMI_2, FMI_3 = 2, 3
"""Versions of the functions: those of 3.0 take the number of values too, and a step has more to tell."""
(
    VERSION, SET, DO_STEP, GET, COMPONENT, NO_STATE_BEFORE, PLACE, IN_FIRST, IN_END, IN_REFERENCES, IN_COUNT, IN_VALUES,
    IN_SIZE, OUT_FIRST, OUT_END, OUT_REFERENCES, OUT_COUNT, OUT_VALUES, OUT_SIZE, COLUMNS,
) = range(20)  # fmt: skip
"""Columns of a unit's row: version and addresses of its functions, address of its instance; whether no earlier state
will be set; its number in the notes; its part of all inputs, address and number of the references to set, address and
number of their values; likewise of its outputs."""
SCALE, SHIFT, LOW, HIGH, WIRES = range(5)
"""Columns of an input's row."""
SOURCE, TARGET, ENDS = range(3)
"""Columns of an input's places: among the known values, and among the values that calls set or read."""
(
    WHAT, FIRST, END, OLDER, FAILED, CALL, STATUS, EVENT, ENDED, EARLY, EVENT_AT, ENDED_AT, EARLY_AT, REACHED_AT,
    CONTROLS,
) = range(15)  # fmt: skip
"""What to do for which units; how many earlier points a mean takes; row, call and status of a unit that failed; what a
step of FMI 3.0 tells: whether there was an event, whether the simulation has ended and whether the step has, too early;
addresses of these and of the time that it reached."""
WRITE, STEP, READ, MEAN, ARRIVE = 1, 2, 4, 8, 16
"""Bits of ``WHAT``."""
TIME, SIZE, REACHED, NEW_WEIGHT, OLD_WEIGHT = range(5)
"""Time (s) and size (s) of the step; time (s) that a step of FMI 3.0 reached; weights of the mean over it: of the
newest value, and of earlier points."""
NOTE_UNIT, NOTE_CALL, NOTE_COUNT, NOTE_STOP, NOTE_SLOTS = range(5)
"""Integers of the notes: unit and call under way, how many calls have begun and ended, whether to stop."""
NOTHING, INITIALIZATION, INPUTS, OUTPUTS, STEPPING, STATE, CLOSING = range(7)
"""Calls."""
DONE, REFUSED, STOPPED, NOT_FINITE = range(4)
_WARNING = 1
"""Highest status of FMI that is good."""


@kernel
def take_turns(control, numbers, units, wires, places, inputs, sources, exchanged, known, samples, extremes, notes):
    """Let units write, step and read as ``control`` says, and at last remember the values of a communication point.

    ``units`` (u, COLUMNS), ``wires`` (i, WIRES) and ``places`` (i, ENDS) of all ``inputs`` (i,), ``sources`` (n,) of
    the outputs among the values ``exchanged`` by calls, ``known`` (3 n,), ``samples`` (points, n) the values at earlier
    communication points, newest first, ``extremes`` (2, n) the least and largest so far. Returns DONE, REFUSED with the
    call in ``control``, STOPPED, or NOT_FINITE, where nothing is remembered.
    """
    n = samples.shape[1]
    what = control[WHAT]
    for u in range(control[FIRST], control[END]):
        notes[NOTE_UNIT] = units[u, PLACE]
        if what & WRITE and units[u, IN_END] > units[u, IN_FIRST]:
            gather(units[u], wires, places, inputs, exchanged, known)
            begin_call(notes, INPUTS)
            status = call_with_values(units[u], SET, IN_REFERENCES)
            if not end_call(control, notes, u, INPUTS, status):
                return REFUSED
        if what & STEP:
            if notes[NOTE_STOP] != 0:
                return STOPPED
            begin_call(notes, STEPPING)
            status = call_step(units[u], control, numbers)
            if not end_call(control, notes, u, STEPPING, status):
                return REFUSED
        if what & READ and units[u, OUT_END] > units[u, OUT_FIRST]:
            begin_call(notes, OUTPUTS)
            status = call_with_values(units[u], GET, OUT_REFERENCES)
            if not end_call(control, notes, u, OUTPUTS, status):
                return REFUSED
            for k in range(units[u, OUT_FIRST], units[u, OUT_END]):
                known[n + k] = exchanged[sources[k]]
        if what & MEAN:
            for k in range(units[u, OUT_FIRST], units[u, OUT_END]):
                mean = numbers[NEW_WEIGHT] * known[n + k]
                for j in range(control[OLDER]):
                    mean += numbers[OLD_WEIGHT + j] * samples[j, k]
                known[k] = mean
    if what & ARRIVE:
        return arrive(known[n : 2 * n], samples, extremes)
    return DONE


@inlined_kernel
def call_with_values(unit, function, references):
    """Call the function that sets or reads values; ``references`` is the first of four columns that follow."""
    count, values, size = unit[references + 1], unit[references + 2], unit[references + 3]
    if unit[VERSION] == FMI_2:
        return call_foreign(unit[function], (unit[COMPONENT], unit[references], count, values))
    return call_foreign(unit[function], (unit[COMPONENT], unit[references], count, values, size))


@inlined_kernel
def call_step(unit, control, numbers):
    """Let a unit step; what it tells is in ``control`` and ``numbers``."""
    control[EVENT] = control[ENDED] = control[EARLY] = 0
    numbers[REACHED] = 0.0
    time, size, no_state_before = numbers[TIME], numbers[SIZE], unit[NO_STATE_BEFORE]
    if unit[VERSION] == FMI_2:
        return call_foreign(unit[DO_STEP], (unit[COMPONENT], time, size, no_state_before))
    event, ended, early, reached = control[EVENT_AT], control[ENDED_AT], control[EARLY_AT], control[REACHED_AT]
    return call_foreign(unit[DO_STEP], (unit[COMPONENT], time, size, no_state_before, event, ended, early, reached))


@inlined_kernel
def arrive(newest, samples, extremes):
    """Remember the values of a communication point; DONE, or NOT_FINITE."""
    for k in range(newest.shape[0]):
        if not math.isfinite(newest[k]):
            return NOT_FINITE
    for k in range(newest.shape[0]):
        extremes[0, k] = min(extremes[0, k], newest[k])
        extremes[1, k] = max(extremes[1, k], newest[k])
        for j in range(samples.shape[0] - 1, 0, -1):
            samples[j, k] = samples[j - 1, k]
        samples[0, k] = newest[k]
    return DONE


@inlined_kernel
def gather(unit, wires, places, inputs, exchanged, known):
    """Inputs of a unit from the known values of all outputs."""
    for i in range(unit[IN_FIRST], unit[IN_END]):
        value = known[places[i, SOURCE]] * wires[i, SCALE] + wires[i, SHIFT]
        if value < wires[i, LOW]:
            value = wires[i, LOW]
        if value > wires[i, HIGH]:
            value = wires[i, HIGH]
        inputs[i] = value
        exchanged[places[i, TARGET]] = value


@inlined_kernel
def begin_call(notes, call):
    """Note that a call begins."""
    notes[NOTE_CALL] = call
    notes[NOTE_COUNT] += 1


@inlined_kernel
def end_call(control, notes, unit, call, status):
    """Note the end of a call; whether its status is good and a step went to its end. One that failed stays noted."""
    whole = call != STEPPING or (control[ENDED] == 0 and control[EARLY] == 0)
    if not (whole and 0 <= status <= _WARNING):
        control[FAILED] = unit
        control[CALL] = call
        control[STATUS] = status
        return False
    notes[NOTE_CALL] = NOTHING
    notes[NOTE_COUNT] += 1
    return True


def no_turns():
    """Arguments of :func:`take_turns` for no unit: where its machine code is made."""
    whole, real = np.zeros((0, COLUMNS), dtype=np.int64), np.zeros(0)
    places, sources = np.zeros((0, ENDS), dtype=np.int64), np.zeros(1, dtype=np.int64)
    control, notes = np.zeros(CONTROLS, dtype=np.int64), np.zeros(NOTE_SLOTS, dtype=np.int64)
    vectors = np.zeros(3), np.zeros((1, 1)), np.zeros((2, 1))
    return control, np.zeros(OLD_WEIGHT + 1), whole, np.zeros((0, WIRES)), places, real, sources, real, *vectors, notes
