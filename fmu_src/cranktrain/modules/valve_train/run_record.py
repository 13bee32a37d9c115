"""Record of a valve-train run, and the four kernels that operate it, from Python or from a library without Python.

Each kernel returns a status: 0, or a number whose text is in :mod:`.simulation`. If it is not 0, model and state are
unchanged.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.kernel import kernel, record
from cranktrain.core.types import Array
from cranktrain.modules import crank_angle as crank
from cranktrain.modules.crank_angle import OK, copy_state, inputs_status, step_status
from cranktrain.modules.valve_train import slots as at
from cranktrain.modules.valve_train.advance import FAILED, advance, energy, observe, stand
from cranktrain.modules.valve_train.preparation import prepare_model, take_choices


@record
class Model(NamedTuple):
    """Constants of a run: numbers by slot, a cam of each kind, camshaft angles of the lines' noses, choices."""

    numbers: Array
    cams: Array
    noses: Array
    choices: NDArray[np.int64]
    mark: NDArray[np.void]


@record
class Work(NamedTuple):
    """Workspace of the kernels: a row for each line, the camshaft, trial cams and a trial state."""

    rows: Array
    shaft: Array
    cams: Array
    trial: Array
    mark: NDArray[np.void]


@record
class Run(NamedTuple):
    """A run: model and workspace, state, inputs and outputs, and the numbers that its parameters set.

    ``numbers`` are in the order of ``slots.RUN_NUMBERS``, followed by the firing angles, rad. A choice is stored as its
    index in ``ANGLES`` or ``TIMES``.
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
    return prepare_model(run.numbers, run.model, run.work.cams)


@kernel
def start(run, time):
    """Start at a time, s, with the present inputs. Return a status.

    At rest the valve train starts in static balance, otherwise after ``start_cycles`` cycles from there.
    """
    status = inputs_status(run.inputs)
    if status != OK:
        return status
    model, work, state, inputs = run.model, run.work, run.work.trial, run.inputs
    for k in range(state.shape[0]):
        state[k] = 0.0
    stand(model, work, state, inputs)
    speed, cycles = inputs[crank.SPEED], float(round(run.numbers[at.START_CYCLES]))
    if speed >= run.numbers[at.START_SPEED] and cycles > 0.0:
        for k in range(model.choices.shape[0]):
            model.choices[k] = 0
        status = advance(model, work, state, inputs, 4.0 * math.pi * cycles / speed)
        take_choices(run.numbers, model)
        if status != OK:
            return FAILED
    for k in (at.STEPS, at.REJECTED, at.WORK, at.FRICTION_WORK, at.DAMPED, crank.LAST_INTERVAL, crank.ANGLE_SEEN):
        state[k] = 0.0
    state[at.FIRST_ENERGY] = energy(model, work, state)
    state[crank.TIME] = time
    state[crank.PARTNER_ANGLE] = inputs[crank.ANGLE]
    copy_state(state, run.state)
    return OK


@kernel
def advance_run(run, t_end):
    """Advance to ``t_end``, s, and write the outputs. Return a status."""
    model, state, trial, inputs = run.model, run.state, run.work.trial, run.inputs
    status = inputs_status(inputs)
    if status == OK:
        status = step_status(state, inputs, t_end, model.choices[at.GIVEN_ANGLE], model.choices[at.ENDS])
    if status != OK:
        return status
    copy_state(state, trial)
    if advance(model, run.work, trial, inputs, t_end - state[crank.TIME]) != OK:
        return FAILED
    observe(model, run.work, trial, run.outputs)
    # The time is not summed over steps, because rounding would make it drift from the co-simulation master's time.
    trial[crank.TIME] = t_end
    copy_state(trial, state)
    return OK


@kernel
def observe_run(run):
    """Write the outputs of the present state. Return a status."""
    return observe(run.model, run.work, run.state, run.outputs)
