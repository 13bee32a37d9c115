"""Communication step: advance the state from one communication point to the next.

The step contract: ``advance(model, work, state, inputs, t_end) -> status``. The whole state is one vector; on failure
it is restored to the communication point.

A communication step as long as the internal step, or longer, is a whole number of sub-steps
(:mod:`cranktrain.dynamics.time.step_control`). If it is shorter, an internal step of full length passes over
communication points, and the motion there is interpolated (:mod:`cranktrain.dynamics.time.between`). This needs inputs
that are known over the step: constant ones, or ones that follow the line of their samples or given rates. If an input
leaves this line at a communication point, the step is repeated from its begin to that point, so that the motion there
is the same as if the step had ended there in the first place. Further communication steps then end a step each, until
the inputs follow their line again. Pressures that a partner computes change at every point, so every point ends a step.

If a step that reaches beyond the point fails, the communication step is repeated with a step that ends at the point.
So a run fails only where a run that steps to every point fails.

The degree of irregularity of the crank's own speed, (largest − least) / mean over one cycle of the crank, has its
extremes at communication points, so that a partner that reads the speed finds the same values. Points 5 degrees apart
miss at most 1 − cos(n · 2.5°) of the amplitude of order n: 0.1 % of order 1, 0.9 % of order 3.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model import state as st
from cranktrain.dynamics.motion.film_memory import motion_size
from cranktrain.dynamics.motion.gas import built_in, crank_rotation
from cranktrain.dynamics.time.between import BEGIN, END, interpolate_motion, keep_end, recall_end
from cranktrain.dynamics.time.reconstruction import (
    ROUNDING,
    SLIVER,
    reconstruct,
    take_rates,
    take_sample,
)
from cranktrain.dynamics.time.status import OK, STALLED, TOO_LONG
from cranktrain.dynamics.time.step_control import (
    MAX_HALVINGS,
    MOST_STEPS,
    PARTS,
    ROUNDED,
    has_stalled,
    take_interval,
    take_part,
    take_sub_step,
    turning_speed,
)
from cranktrain.loads.gas_pressure import CYCLE

WORTH = 0.9
"""Longest communication step, in internal steps, that an internal step passes over; longer steps would save little."""
SHORTEST, LONGEST = 0.85, 1.02
"""Range, in internal steps, in which a step keeps its length and its factors although the speed changes."""
MOVED = 1.0e-9
"""Relative change of a pressure since its last sample above which a co-simulation partner counts as its source."""
ON_LINE = 1.0e-12
"""Largest relative difference of an input from its extrapolation that counts as rounding by its sender."""


NEARLY = 1.0e-6
"""Fraction by which a cycle may be short and still count as full, because motion does not repeat more exactly."""


@kernel
def follow_speed(model, state):
    """Update the extremes of the crank's speed in the state; at the end of a cycle store its irregularity."""
    rotation, rate, _ = crank_rotation(model, state)
    angle = state[st.SHAFT_ANGLE] + state[st.LEAD_ANGLE] + rotation
    speed = state[st.SHAFT_SPEED] + state[st.LEAD_SPEED] + rate
    begins = state[st.SPEED_LARGEST] <= 0.0
    if not begins:
        state[st.SPEED_LEAST] = min(state[st.SPEED_LEAST], speed)
        state[st.SPEED_LARGEST] = max(state[st.SPEED_LARGEST], speed)
        turned = angle - state[st.ROUND_ANGLE]
        begins = turned >= CYCLE * (1.0 - NEARLY)
        if begins:
            mean = turned / (state[st.TIME] - state[st.ROUND_TIME])
            state[st.IRREGULARITY] = (state[st.SPEED_LARGEST] - state[st.SPEED_LEAST]) / mean
    if begins:
        state[st.ROUND_ANGLE] = angle
        state[st.ROUND_TIME] = state[st.TIME]
        state[st.SPEED_LEAST] = speed
        state[st.SPEED_LARGEST] = speed


@inlined_kernel
def has_ends(model, state):
    """True if the state has room for the ends of a step that passes over communication points."""
    return state.shape[0] > motion_size(model)


@kernel
def go_on(model, work, state, reach, builtin):
    """True if the newest sample and its rates lie on the extrapolated line over the time ``reach`` (s) of a step.

    With the gas trace (``builtin``) pressures do not count. The first sample of a run counts as on the line if it has
    no rate and no partner gives pressures, because these would change.
    """
    cylinders = model.cylinders.shape[0]
    for k in range(cylinders + at.AXIAL_INPUT + 1):
        if builtin and 0 < k <= cylinders:
            continue
        value = work.inputs[at.VALUE, k]
        rate = work.inputs[at.RATE, k] * reach
        if work.inputs[at.EXPONENT, k] > 0.0:
            return False
        if state[st.SAMPLES] < 2.0:
            if rate != 0.0 or not builtin:
                return False
            continue
        foreseen = work.inputs[at.FORESEEN, k]
        off = max(abs(value - foreseen), abs(rate - work.inputs[at.FORESEEN_RATE, k] * reach))
        if off > ON_LINE * max(abs(value), max(abs(foreseen), abs(rate))):
            return False
    return True


@inlined_kernel
def pressures_move(model, work, state, inputs):
    """True if the pressures of a co-simulation partner change here; extrapolation is then useless, as no line fits.

    A pressure changes if it differs from the last sample and has no rate, neither now nor before.
    """
    if model.choices[at.RECONSTRUCTION] != 3.0 or state[st.SAMPLES] < 2.0 or built_in(model, state):
        return False
    for k in range(1, model.cylinders.shape[0] + 1):
        before = state[st.INPUTS_NOW + k]
        given = state[st.RATES_GIVEN + k] > 0.0 or math.isfinite(work.input_rates[k])
        if not given and abs(inputs[k] - before) > MOVED * max(abs(inputs[k]), abs(before)):
            return True
    return False


@kernel
def take_inputs(model, work, state, inputs, interval):
    """Take the inputs at a communication point, where a step of ``interval`` (s) begins, and fill ``work.inputs``.

    Returns True if the inputs follow their extrapolation.
    """
    before = built_in(model, state)
    anew = pressures_move(model, work, state, inputs)
    if not anew:
        # Extrapolate the inputs, with rates, from the earlier samples to this point.
        reconstruct(model, work, state)
        for k in range(model.cylinders.shape[0] + at.AXIAL_INPUT + 1):
            rate = work.inputs[at.RATE, k]
            work.inputs[at.FORESEEN, k] = work.inputs[at.VALUE, k] + rate * state[st.LAST_INTERVAL]
            work.inputs[at.FORESEEN_RATE, k] = rate
    take_sample(model, state, inputs, interval)
    take_rates(state, work.input_rates, interval)
    reconstruct(model, work, state)
    builtin = built_in(model, state)
    anew = anew or state[st.EACH_POINT] > 0.0
    state[st.EACH_POINT] = 0.0
    if anew or builtin != before:
        return False
    return go_on(model, work, state, model.scalars[at.STEP] / turning_speed(state, inputs), builtin)


@kernel
def end_step_here(model, work, state):
    """End the step under way at the communication point, by repeating it from its begin to this point.

    The repeated step uses the inputs of the samples so far. If it fails, the interpolated motion is kept.
    """
    if state[st.UNDER_WAY] == 0.0:
        return
    state[st.UNDER_WAY] = 0.0
    if at_end(state, state[st.TIME]):
        return
    h = state[st.TIME] - state[st.STEP_BEGIN]
    for i in range(motion_size(model)):
        work.backup[2, i] = state[i]
    recall_end(model, state, BEGIN)
    if h <= SLIVER:
        return
    reconstruct(model, work, state)
    begin = state[st.STEP_BEGIN] - (state[st.TIME] - state[st.LAST_INTERVAL])
    # The last slot of the factor cache is used, so that factors of full steps are kept.
    status, _ = take_sub_step(model, work, state, begin, h, at.FACTOR_SLOTS)
    if status != OK:
        for i in range(motion_size(model)):
            state[i] = work.backup[2, i]


@inlined_kernel
def at_end(state, time):
    """True if the step under way has ended by ``time``, s."""
    near = ROUNDED * (state[st.STEP_END] - state[st.STEP_BEGIN]) + 4.0 * ROUNDING * abs(time)
    return time >= state[st.STEP_END] - near


@kernel
def pass_over(model, work, state, inputs, t_end):
    """Take full steps until one reaches ``t_end``, and interpolate. Return a status (0: success) and the steps taken.

    After a failure the state is undefined.
    """
    sampled = state[st.TIME]
    now = sampled
    taken = 0
    while True:
        if state[st.UNDER_WAY] > 0.0:
            if not at_end(state, t_end):
                break
            recall_end(model, state, END)
            now = state[st.STEP_END]
            if state[st.PARTS_DONE] == PARTS:
                state[st.UNDER_WAY] = 0.0
            if abs(t_end - now) <= ROUNDED * (now - state[st.STEP_BEGIN]) + 4.0 * ROUNDING * abs(t_end):
                return OK, taken
        status = step_beyond(model, work, state, inputs, now, sampled)
        if status != OK:
            return status, taken
        taken += 1
        if taken > MOST_STEPS:
            return TOO_LONG, taken
    interpolate_motion(model, work, state, t_end, sampled)
    return OK, taken


@kernel
def step_beyond(model, work, state, inputs, now, sampled):
    """Take the next part of a sub-step from ``now`` (s), which becomes the step under way. Return a status (0: OK).

    ``work.inputs`` are those of the communication step that began at ``sampled``, s.
    """
    if state[st.UNDER_WAY] == 0.0:
        speed = turning_speed(state, inputs)
        turn = speed * state[st.STEP_REFERENCE] / model.scalars[at.STEP]
        if not SHORTEST <= turn <= LONGEST:
            h = model.scalars[at.STEP] / speed
            if abs(h - state[st.STEP_REFERENCE]) > ROUNDED * h:
                state[st.STEP_REFERENCE] = h
        state[st.SUBSTEP_BEGIN] = now
        state[st.PARTS_DONE] = 0.0
        state[st.PARTS_HALVED] = 0.0
    h = state[st.STEP_REFERENCE]
    begin = state[st.SUBSTEP_BEGIN]
    keep_end(model, state, BEGIN)
    done = int(min(max(state[st.PARTS_DONE], 0.0), PARTS - 1.0))
    halved = int(min(max(state[st.PARTS_HALVED], 0.0), 1.0 * MAX_HALVINGS))
    status, done, halved = take_part(model, work, state, begin - sampled, h, done, halved, 0.0)
    if status != OK:
        return status
    if has_stalled(model, state):
        return STALLED
    keep_end(model, state, END)
    state[st.STEP_BEGIN] = now
    state[st.STEP_END] = begin + h * (done / PARTS)
    state[st.PARTS_DONE] = done
    state[st.PARTS_HALVED] = halved
    state[st.UNDER_WAY] = 1.0
    return OK


@kernel
def advance(model, work, state, inputs, t_end):
    """Advance ``state`` to ``t_end`` with the inputs of this communication point. Return a status (0: success).

    A time step that is only rounding (SLIVER) leaves the state as it is.
    """
    interval = t_end - state[st.TIME]
    if interval <= SLIVER + ROUNDING * abs(state[st.TIME]):
        return OK
    if not turning_speed(state, inputs) * interval < MOST_STEPS * model.scalars[at.STEP]:
        return TOO_LONG
    near = ROUNDED * (state[st.STEP_END] - state[st.STEP_BEGIN]) + 4.0 * ROUNDING * abs(state[st.TIME])
    if not state[st.STEP_BEGIN] - near <= state[st.TIME] <= state[st.STEP_END] + near:
        state[st.UNDER_WAY] = 0.0  # the owner altered the state, so a step under way may lie far in the past
    for i in range(st.BODY):
        work.backup[0, i] = state[i]
    solved = model.laws.solved[0]
    work.counters[at.WORST_RESIDUAL] = 0.0
    work.counters[at.N_WORK] = 0.0
    work.counters[at.N_CUT] = 0.0
    foreseen = take_inputs(model, work, state, inputs, interval)
    passes = foreseen and has_ends(model, state) and model.choices[at.DENSE] > 0.0
    passes = passes and work.staged[0, at.STAGES_GIVEN] == 0.0
    under_way = has_ends(model, state) and state[st.UNDER_WAY] > 0.0
    if not (passes and under_way and not at_end(state, t_end)):
        for i in range(st.BODY, state.shape[0]):
            work.backup[0, i] = state[i]
    short = turning_speed(state, inputs) * interval <= WORTH * model.scalars[at.STEP]
    passed = passes and (short or under_way)
    status = OK
    taken = 0
    if passed:
        status, taken = pass_over(model, work, state, inputs, t_end)
        passed = status == OK
    if not passed:
        if under_way or status != OK:
            go_back(work, state)
            end_step_here(model, work, state)
            take_sample(model, state, inputs, interval)
            take_rates(state, work.input_rates, interval)
            reconstruct(model, work, state)
        status, taken = take_interval(model, work, state, inputs, interval)
    if status != OK:
        go_back(work, state)
        return status
    state[st.TIME] = t_end
    follow_speed(model, state)
    state[st.SUBSTEPS] = taken
    state[st.ITERATIONS] = work.counters[at.N_WORK]
    if taken > 0:
        state[st.RESIDUAL] = work.counters[at.WORST_RESIDUAL]
    state[st.ONLINE_FILMS] = model.laws.solved[0] - solved
    state[st.LIMITED] = work.counters[at.N_CUT]
    work.counters[at.N_LIMITED] += work.counters[at.N_CUT]
    return OK


@inlined_kernel
def go_back(work, state):
    """Restore the state at the start of the communication step."""
    for i in range(state.shape[0]):
        state[i] = work.backup[0, i]
