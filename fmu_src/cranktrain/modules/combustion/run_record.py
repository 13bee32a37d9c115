"""Record of a combustion run, and the four kernels that operate it, from Python or from a library without Python.

Each kernel returns a status: 0, or a number whose text is in :mod:`.simulation`. If it is not 0, model and state are
unchanged.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.kernel import kernel, record
from cranktrain.core.types import Array
from cranktrain.modules.combustion import slots as at
from cranktrain.modules.combustion.advance import N_HEAD, advance, fill_all, observe
from cranktrain.modules.combustion.cylinder import OK, swept_volume, volume
from cranktrain.modules.combustion.preparation import prepare_model, take_choices
from cranktrain.modules.crank_angle import INPUT_NOT_POSITIVE, copy_state, inputs_status, step_status

CYLINDER_FAILED = 100
"""Status of a failed cylinder, minus its number (from 1)."""
DEVIATION_TOO_LARGE = 200
"""Status of a volume deviation beyond the clearance volume, minus the cylinder's number (from 1)."""


@record
class Model(NamedTuple):
    """Constants of a run: numbers by their slots, gas tables, firing angles (cylinders,), choices and the method.

    ``burnt`` is the table of :mod:`.equilibrium` for spark ignition, one row of zeros for compression ignition.
    """

    numbers: Array
    gas: Array
    burnt: Array
    firing: Array
    choices: NDArray[np.int64]
    tableau: Array
    nodes: Array
    defects: Array
    mark: NDArray[np.void]


@record
class Work(NamedTuple):
    """Workspace of a run: rates and values of the stages, constants over a step, a counter, and a trial state."""

    rows: Array
    now: Array
    counters: NDArray[np.int64]
    trial: Array
    mark: NDArray[np.void]


@record
class Run(NamedTuple):
    """A run: model and workspace, state, inputs and outputs, and the numbers that its parameters set.

    ``numbers`` are in the order of ``slots.RUN_NUMBERS``, followed by the firing angles, rad. A choice is stored as its
    index in ``LIFTS``, ``ANGLES`` or ``TIMES``.
    """

    model: Model
    work: Work
    state: Array
    inputs: Array
    outputs: Array
    numbers: Array


@kernel
def prepare(run):
    """Fill the model from the run's numbers. Return a status."""
    return prepare_model(run.numbers, run.model)


@kernel
def start(run, time):
    """Start at a time, s, with the present inputs, after ``start_cycles`` cycles from filling. Return a status.

    The cycles use fuel and manifolds of the inputs and the built-in valve lifts. If the crank is at rest, cylinders
    stay filled with intake gas.
    """
    status = check_inputs(run.model, run.inputs)
    if status != OK:
        return status
    model, work, state, inputs = run.model, run.work, run.work.trial, run.inputs
    for k in range(state.shape[0]):
        state[k] = 0.0
    fill_all(model, work, state, inputs)
    speed, cycles = inputs[at.SPEED], float(round(run.numbers[at.START_CYCLES]))
    if speed >= run.numbers[at.START_SPEED] and cycles > 0.0:
        for k in range(model.choices.shape[0]):
            model.choices[k] = 0
        status = advance(model, work, state, inputs, 4.0 * math.pi * cycles / speed)
        take_choices(run.numbers, model)
        if status != OK:
            return CYLINDER_FAILED + work.counters[0]
    for i in range(model.firing.shape[0]):
        count_from_here(model, state, i, inputs)
    for k in (at.STEPS, at.REJECTED, at.LAST_INTERVAL, at.ANGLE_SEEN, at.LIFTS_SEEN):
        state[k] = 0.0
    state[at.TIME] = time
    state[at.OWN_ANGLE] = inputs[at.ANGLE]
    state[at.PARTNER_ANGLE] = inputs[at.ANGLE]
    copy_state(state, run.state)
    return OK


@kernel
def advance_run(run, t_end):
    """Advance to ``t_end``, s, and write the outputs. Return a status."""
    model, state, trial, inputs = run.model, run.state, run.work.trial, run.inputs
    status = check_inputs(model, inputs)
    if status == OK:
        status = step_status(state, inputs, t_end, model.choices[at.GIVEN_ANGLE], model.choices[at.ENDS])
    if status != OK:
        return status
    copy_state(state, trial)
    if advance(model, run.work, trial, inputs, t_end - state[at.TIME]) != OK:
        return CYLINDER_FAILED + run.work.counters[0]
    observe(model, run.work, trial, run.outputs)
    # The time is not summed over steps, because rounding would make it drift from the co-simulation master's time.
    trial[at.TIME] = t_end
    copy_state(trial, state)
    return OK


@kernel
def observe_run(run):
    """Write the outputs of the present state. Return a status."""
    return observe(run.model, run.work, run.state, run.outputs)


@kernel
def check_inputs(model, inputs):
    """Return the status of the inputs: OK if an engine may have these values."""
    status = inputs_status(inputs)
    if status != OK:
        return status
    for k in range(at.INTAKE_P, at.EXHAUST_T + 1):
        if not inputs[k] > 0.0:
            return INPUT_NOT_POSITIVE + k
    clearance = swept_volume(model.numbers) / (model.numbers[at.COMPRESSION_RATIO] - 1.0)
    for i in range(model.firing.shape[0]):
        if abs(inputs[at.FIRST_CYLINDER + i * at.OF_CYLINDER + at.DEVIATION_IN]) > clearance:
            return DEVIATION_TOO_LARGE + i + 1
    return OK


@kernel
def count_from_here(model, state, i, inputs):
    """Reset all sums of a cylinder to 0, and its last valve lifts to the lifts of the inputs."""
    base, place = N_HEAD + i * at.SIZE, at.FIRST_CYLINDER + i * at.OF_CYLINDER
    state[base + at.WORK_START] -= state[base + at.WORK]
    state[base + at.WALL_START] -= state[base + at.WALL]
    state[base + at.BURNT_START] -= state[base + at.BURNT]
    state[base + at.INJECTED] -= state[base + at.BURNT]
    state[base + at.SPARK_BURNT] -= state[base + at.BURNT]
    state[base + at.SOI_TIME] -= state[base + at.CLOCK]
    for k in (at.BURNT, at.WORK, at.WALL, at.INTAKE, at.EXHAUST, at.INTAKE_ENTHALPY, at.EXHAUST_ENTHALPY, at.CLOCK,
              at.ADDED, at.ADDED_ENERGY):  # fmt: skip
        state[base + k] = 0.0
    state[base + at.FIRST_MASS] = state[base + at.MASS]
    state[base + at.FIRST_ENERGY] = state[base + at.ENERGY]
    state[base + at.FIRST_VOLUME] = volume(model.numbers, state[base + at.PHI]) + state[base + at.DEVIATION]
    state[base + at.LAST_LIFT_IN] = inputs[place + at.LIFT_IN]
    state[base + at.LAST_LIFT_OUT] = inputs[place + at.LIFT_OUT]
