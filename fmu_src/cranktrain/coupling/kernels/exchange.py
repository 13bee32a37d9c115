"""Turns of units whose functions can be called at their addresses: set inputs, step, read outputs.

The values of all units are in the master's vectors, see :mod:`cranktrain.coupling.master`. An input is
``scale · known[place] + shift``, within its bounds. Outputs are read to their places among the newest values. Each call
is noted in memory that a supervising process reads.
"""

from __future__ import annotations

import math

from cranktrain.core.foreign_function import call_foreign
from cranktrain.core.kernel import inlined_kernel, kernel

(
    SET, DO_STEP, GET, COMPONENT, IN_REFERENCES, IN_VALUES, IN_FIRST, IN_END, OUT_REFERENCES, OUT_VALUES, OUT_FIRST,
    OUT_END, NO_STATE_BEFORE, PLACE, COLUMNS,
) = range(15)  # fmt: skip
"""Columns of a unit's row: addresses of its functions and of its instance; addresses of the references and values of
its inputs, and its part of all inputs; likewise of its outputs; whether no earlier state will be set; its number in the
notes."""
SCALE, SHIFT, LOW, HIGH, WIRES = range(5)
"""Columns of an input's row."""
WHAT, FIRST, END, OLDER, FAILED, CALL, STATUS, CONTROLS = range(8)
"""What to do for which units; how many earlier points a mean takes; row, call and status of a unit that failed."""
WRITE, STEP, READ, MEAN, ARRIVE = 1, 2, 4, 8, 16
"""Bits of ``WHAT``."""
TIME, SIZE, NEW_WEIGHT, OLD_WEIGHT = range(4)
"""Time (s) and size (s) of the step; weights of the mean over it: of the newest value, and of earlier points."""
NOTE_UNIT, NOTE_CALL, NOTE_COUNT, NOTE_STOP, NOTE_SLOTS = range(5)
"""Integers of the notes: unit and call under way, how many calls have begun and ended, whether to stop."""
NOTHING, INITIALIZATION, INPUTS, OUTPUTS, STEPPING, STATE, CLOSING = range(7)
"""Calls."""
DONE, REFUSED, STOPPED, NOT_FINITE = range(4)
_WARNING = 1
"""Highest status of FMI that is good."""


# In one piece: arrays of a master, which numba takes one by one from Python.
@kernel
def take_turns(control, numbers, units, wires, places, inputs, known, samples, extremes, notes):
    """Let units write, step and read as ``control`` says, and at last remember the values of a communication point.

    ``units`` (u, COLUMNS), ``wires`` (i, WIRES) and ``places`` (i,) of all inputs, ``known`` (3 n,), ``samples``
    (points, n) the values at earlier communication points, newest first, ``extremes`` (2, n) the least and largest so
    far. Returns DONE, REFUSED with the call in ``control``, STOPPED, or NOT_FINITE, where nothing is remembered.
    """
    n = samples.shape[1]
    what = control[WHAT]
    for u in range(control[FIRST], control[END]):
        notes[NOTE_UNIT] = units[u, PLACE]
        if what & WRITE and units[u, IN_END] > units[u, IN_FIRST]:
            gather(units[u], wires, places, inputs, known)
            arguments = (
                units[u, COMPONENT], units[u, IN_REFERENCES], units[u, IN_END] - units[u, IN_FIRST], units[u, IN_VALUES]
            )  # fmt: skip
            begin_call(notes, INPUTS)
            status = call_foreign(units[u, SET], arguments)
            if not end_call(control, notes, u, INPUTS, status):
                return REFUSED
        if what & STEP:
            if notes[NOTE_STOP] != 0:
                return STOPPED
            begin_call(notes, STEPPING)
            status = call_foreign(
                units[u, DO_STEP], (units[u, COMPONENT], numbers[TIME], numbers[SIZE], units[u, NO_STATE_BEFORE])
            )
            if not end_call(control, notes, u, STEPPING, status):
                return REFUSED
        if what & READ and units[u, OUT_END] > units[u, OUT_FIRST]:
            arguments = (
                units[u, COMPONENT], units[u, OUT_REFERENCES], units[u, OUT_END] - units[u, OUT_FIRST],
                units[u, OUT_VALUES],
            )  # fmt: skip
            begin_call(notes, OUTPUTS)
            status = call_foreign(units[u, GET], arguments)
            if not end_call(control, notes, u, OUTPUTS, status):
                return REFUSED
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
def gather(unit, wires, places, inputs, known):
    """Inputs of a unit from the known values of all outputs."""
    for i in range(unit[IN_FIRST], unit[IN_END]):
        value = known[places[i]] * wires[i, SCALE] + wires[i, SHIFT]
        if value < wires[i, LOW]:
            value = wires[i, LOW]
        if value > wires[i, HIGH]:
            value = wires[i, HIGH]
        inputs[i] = value


@inlined_kernel
def begin_call(notes, call):
    """Note that a call begins."""
    notes[NOTE_CALL] = call
    notes[NOTE_COUNT] += 1


@inlined_kernel
def end_call(control, notes, unit, call, status):
    """Note the end of a call; whether its status is good. One that failed stays noted."""
    if not 0 <= status <= _WARNING:
        control[FAILED] = unit
        control[CALL] = call
        control[STATUS] = status
        return False
    notes[NOTE_CALL] = NOTHING
    notes[NOTE_COUNT] += 1
    return True
