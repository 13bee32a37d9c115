"""Turns of units whose functions can be called by address: set inputs, step, read outputs.

The values of all units are in the vectors of the coupling's master. An input is ``scale · known[place] + shift``,
limited to its bounds. One call sets or reads the values of a unit's variables in contiguous memory, arrays as a whole;
the inputs and outputs of the master are at known positions in it. Each call is noted in memory that a supervising
process reads.

Functions of an FMU's library are C functions that kernels call by address. Arguments are 64-bit integers and doubles,
the result is a C ``int``. Addresses, sizes and C's shorter integers and booleans each occupy one 64-bit register in the
calling conventions of x86-64 (Linux, Windows, macOS) and of ARM64, so a 64-bit integer can stand for all of them.
"""

import math
from typing import Any

import numpy as np

from cranktrain.core.kernel import Intrinsic, compiler, inlined_kernel, kernel


def _calling() -> Any:
    types = compiler().types
    from llvmlite import ir

    def call_foreign(typing_context: Any, address: Any, arguments: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            pointer, packed = values
            kinds = [ir.DoubleType() if kind == types.float64 else ir.IntType(64) for kind in arguments.types]
            callee = builder.inttoptr(pointer, ir.FunctionType(ir.IntType(32), kinds).as_pointer())
            result = builder.call(callee, [builder.extract_value(packed, k) for k in range(len(kinds))])
            return builder.sext(result, ir.IntType(64))

        return types.int64(address, arguments), generate

    return call_foreign


call_foreign: Any = Intrinsic(_calling)
"""Call the C function at an address with a tuple of arguments, each an int64 or a float64."""


FMI_2, FMI_3 = 2, 3
"""FMI versions of a unit's functions. Functions of 3.0 also take the number of values; a step returns more results."""
(
    VERSION, SET, DO_STEP, GET, COMPONENT, NO_STATE_BEFORE, PLACE, IN_FIRST, IN_END, IN_REFERENCES, IN_COUNT, IN_VALUES,
    IN_SIZE, OUT_FIRST, OUT_END, OUT_REFERENCES, OUT_COUNT, OUT_VALUES, OUT_SIZE, COLUMNS,
) = range(20)  # fmt: skip
"""Columns of a unit's row: version and addresses of its functions; address of its instance; flag that no earlier state
will be set; its number in the notes; its range of all inputs, address and number of the references to set, address and
number of their values; the same for its outputs."""
SCALE, SHIFT, LOW, HIGH, WIRES = range(5)
"""Columns of an input's row in ``wires``."""
SOURCE, TARGET, ENDS = range(3)
"""Columns of an input's row in ``places``: index in the known values, and index in the values that calls exchange."""
(
    WHAT, FIRST, END, OLDER, FAILED, CALL, STATUS, EVENT, ENDED, EARLY, EVENT_AT, ENDED_AT, EARLY_AT, REACHED_AT,
    CONTROLS,
) = range(15)  # fmt: skip
"""Slots of the control array: operations and range of units; number of earlier points in a mean; row, call and status
of a unit that failed; results of a step of FMI 3.0 (event, simulation ended, step ended early); addresses of these
results and of the time reached."""
WRITE, STEP, READ, MEAN, ARRIVE = 1, 2, 4, 8, 16
"""Bits of ``control[WHAT]``, the operations."""
TIME, SIZE, REACHED, NEW_WEIGHT, OLD_WEIGHT = range(5)
"""Slots of ``numbers``: time (s) and size (s) of the step; time (s) that a step of FMI 3.0 reached; weights of the mean
over the step, of the newest value and of earlier points."""
NOTE_UNIT, NOTE_CALL, NOTE_COUNT, NOTE_STOP, NOTE_SLOTS = range(5)
"""Slots of the notes: unit and call in progress, number of calls begun and ended, request to stop."""
NOTHING, INITIALIZATION, INPUTS, OUTPUTS, STEPPING, STATE, CLOSING = range(7)
"""Codes of the calls of a unit's functions, as stored in the notes."""
DONE, REFUSED, STOPPED, NOT_FINITE = range(4)
_WARNING = 1
"""Highest FMI status that counts as success."""


@kernel
def take_turns(control, numbers, units, wires, places, inputs, sources, exchanged, known, samples, extremes, notes):
    """Let units write, step and read as ``control`` says, and finally store the values of a communication point.

    ``units`` (u, COLUMNS); ``wires`` (i, WIRES) and ``places`` (i, ENDS) of all ``inputs`` (i,); ``sources`` (n,) are
    the indices of the outputs in ``exchanged``, the values that calls exchange; ``known`` (3 n,); ``samples`` (points,
    n) are the values at earlier communication points, newest first; ``extremes`` (2, n) the least and largest so far.
    Returns DONE, REFUSED (with the call in ``control``), STOPPED, or NOT_FINITE; the last stores nothing.
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
    """Call a unit's function that sets or reads values; ``references`` is the first of four columns with data."""
    count, values, size = unit[references + 1], unit[references + 2], unit[references + 3]
    if unit[VERSION] == FMI_2:
        return call_foreign(unit[function], (unit[COMPONENT], unit[references], count, values))
    return call_foreign(unit[function], (unit[COMPONENT], unit[references], count, values, size))


@inlined_kernel
def call_step(unit, control, numbers):
    """Let a unit step; the results of the step are in ``control`` and ``numbers``."""
    control[EVENT] = control[ENDED] = control[EARLY] = 0
    numbers[REACHED] = 0.0
    time, size, no_state_before = numbers[TIME], numbers[SIZE], unit[NO_STATE_BEFORE]
    if unit[VERSION] == FMI_2:
        return call_foreign(unit[DO_STEP], (unit[COMPONENT], time, size, no_state_before))
    event, ended, early, reached = control[EVENT_AT], control[ENDED_AT], control[EARLY_AT], control[REACHED_AT]
    return call_foreign(unit[DO_STEP], (unit[COMPONENT], time, size, no_state_before, event, ended, early, reached))


@inlined_kernel
def arrive(newest, samples, extremes):
    """Store the values of a communication point. Return DONE, or NOT_FINITE if a value is not finite."""
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
    """Compute the inputs of a unit from the known values of all outputs."""
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
    """Note the beginning of a call."""
    notes[NOTE_CALL] = call
    notes[NOTE_COUNT] += 1


@inlined_kernel
def end_call(control, notes, unit, call, status):
    """Note the end of a call. Return False if the call failed or a step ended early; a failed call stays noted."""
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
    """Arguments of :func:`take_turns` without units, from which its machine code is compiled."""
    whole, real = np.zeros((0, COLUMNS), dtype=np.int64), np.zeros(0)
    places, sources = np.zeros((0, ENDS), dtype=np.int64), np.zeros(1, dtype=np.int64)
    control, notes = np.zeros(CONTROLS, dtype=np.int64), np.zeros(NOTE_SLOTS, dtype=np.int64)
    vectors = np.zeros(3), np.zeros((1, 1)), np.zeros((2, 1))
    return control, np.zeros(OLD_WEIGHT + 1), whole, np.zeros((0, WIRES)), places, real, sources, real, *vectors, notes
