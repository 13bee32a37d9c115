"""Start of a run from its inputs alone, as one kernel that Python and every other driver call."""

import math

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model import lump_slots as of
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import turning_modes
from cranktrain.dynamics.model.state import (
    METHOD,
    OUTPUT_MEAN,
    OUTPUT_VARIANCE,
    POSITION,
    SHAFT_ACCELERATION,
    TIME,
    VELOCITY,
    offset,
)
from cranktrain.dynamics.start.mean_motion import forget_motion, lean, rigid_motion
from cranktrain.dynamics.start.settling import settle
from cranktrain.dynamics.time.reconstruction import GIVEN
from cranktrain.dynamics.time.status import NO_EQUILIBRIUM, OK, SINGULAR

FIRST_AMPLITUDES = 1.0e-4, 1.0e-6
"""Initial estimates of alternating torsion (rad) and axial motion (m) for error control, which fade over a cycle."""
FROM_OUTSIDE, AUTO = 2.0, 0.0
"""Numbers of gas sources for which the pressures of the next cycle are not known: given pressures, automatic choice."""


@kernel
def start(model, work, state, inputs, time):
    """Fill the ``state`` with the rotating static equilibrium under the inputs, at a time (s). Return a status (0: OK).

    If there is no equilibrium, the state stays as before.
    """
    for i in range(state.shape[0]):
        work.backup[0, i] = state[i]
        state[i] = 0.0
    # The work limit of a step does not apply to the start.
    work.counters[at.N_WORK] = -math.inf
    status = find_start(model, work, state, inputs, time)
    if status != OK:
        for i in range(state.shape[0]):
            state[i] = work.backup[0, i]
    for k in range(work.counters.shape[0]):
        work.counters[k] = 0.0
    for slot in range(work.key.shape[0]):
        for k in range(at.KEYS):
            work.key[slot, k] = -1.0
    return status


@kernel
def find_start(model, work, state, inputs, time):
    """Find the start of a run from the inputs, in a ``state`` filled with zeros. Return a status (0: success)."""
    n = model.omega2.shape[0]
    state[TIME] = time
    state[METHOD] = model.choices[at.METHOD_MARK]
    if knows_the_cycle(model, inputs):
        rigid_motion(model, work.start, inputs[0])
    else:
        forget_motion(work.start)
    q = state[offset(POSITION, n) : offset(POSITION, n) + n]
    v = state[offset(VELOCITY, n) : offset(VELOCITY, n) + n]
    if lean(model, work, inputs[0], q, v) != 0:
        return SINGULAR
    mean = work.start.mean
    status = settle(
        model, work, state, inputs, mean[at.START_WINDUP], mean[at.START_ROTATION], mean[at.START_ROTATION_RATE]
    )  # fmt: skip
    if status != OK:
        return SINGULAR if status == SINGULAR else NO_EQUILIBRIUM
    if model.scalars[at.DRIVEN] == 0.0 and mean[at.START_INERTIA] > 0.0:
        # The frame starts with the mean acceleration of the crank.
        load = model.lumps.traits[of.END_SPEED] * inputs[model.cylinders.shape[0] + at.LOAD_INPUT]
        turning = mean[at.START_INERTIA] + model.scalars[at.LINE_INERTIA]
        state[SHAFT_ACCELERATION] = (mean[at.START_TORQUE] - load) / turning
    for j in range(2):
        moved = 0.0
        for i in range(turning_modes(model)):
            moved += model.ends[1 + j, i] * q[i]
        state[OUTPUT_MEAN + j] = moved
        state[OUTPUT_VARIANCE + j] = FIRST_AMPLITUDES[j] * FIRST_AMPLITUDES[j]
    return OK


@kernel
def knows_the_cycle(model, inputs):
    """True if the gas is the built-in trace; with given pressures the next cycle is not known."""
    source = model.choices[at.GAS_SOURCE]
    if source != AUTO:
        return source != FROM_OUTSIDE
    farthest = 0.0
    for c in range(model.cylinders.shape[0]):
        farthest = max(farthest, abs(inputs[1 + c] - at.AMBIENT))
    return farthest <= GIVEN
