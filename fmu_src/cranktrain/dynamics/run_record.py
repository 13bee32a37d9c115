"""A run as one record, with the kernels that a driver calls: prepare, start, advance, observe.

Drivers in other languages use only this record and these four kernels. Simulations in Python call the same kernels.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.kernel import call_kernel, kernel, record
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.arrays import Parts, structure
from cranktrain.dynamics.model.choices import run_numbers
from cranktrain.dynamics.model.preparation import prepare_model, tell_stages
from cranktrain.dynamics.model.records import ModelArrays, dimensions
from cranktrain.dynamics.model.settings import Settings, axial_force, resolved
from cranktrain.dynamics.model.state import LAST_INTERVAL, TIME, state_size
from cranktrain.dynamics.model.workspace import Work, make_work
from cranktrain.dynamics.outputs.laws import begin_observation
from cranktrain.dynamics.outputs.register import Outputs, observers, output_counts, output_needs
from cranktrain.dynamics.start.start import start as start_state
from cranktrain.dynamics.time.communication import advance
from cranktrain.dynamics.time.reconstruction import reconstruct
from cranktrain.dynamics.time.status import INPUT_NEGATIVE, INPUT_NOT_FINITE, NOT_AHEAD, OK, UNKNOWN_METHOD
from cranktrain.dynamics.time.step_control import frame_at, ports_at_state, pressures_at_state
from cranktrain.dynamics.time.table import FAMILY, HEAD
from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import GasTrace

LONGEST_STEP = 1.0
"""Longest communication step, s; over longer steps held or extrapolated inputs would be meaningless."""


# Columns of the families in :class:`cranktrain.dynamics.outputs.register.Outputs`:
# ADDRESS: address of the kernel that fills the family's values.
# FIRST, END: index of the family's first value, and index after its last value.
# MEMBERS, WANTED: number of members of the family; 1 if its values are wanted.
ADDRESS, FIRST, END, MEMBERS, WANTED, COLUMNS = range(6)


@kernel
def observe(model, work, state, outputs):
    """Fill the wanted ``outputs`` from the state alone, so that a restored state gives the same outputs."""
    reconstruct(model, work, state)
    frame_at(model, work, state, state[LAST_INTERVAL], 0.0, work.frames[0], work.pressures[0])
    ports_at_state(model, work, state)
    pressures_at_state(model, work, state)
    begin_observation(model, work)
    families = outputs.families
    for k in range(families.shape[0]):
        if families[k, WANTED] == 0:
            continue
        values = outputs.values[families[k, FIRST] : families[k, END]]
        arguments = (model, work, state, families[k, MEMBERS], values)
        call_kernel(families[k, ADDRESS], arguments)


@record
class Run(NamedTuple):
    """Everything that a run reads and writes."""

    model: ModelArrays
    work: Work
    state: Array  # see dynamics.model.state
    inputs: Array  # speed (rad/s), pressures (Pa), then the other inputs, see dynamics.model.slots
    outputs: Outputs
    numbers: Array  # (NUMBERS,) see dynamics.model.numbers
    temperatures: Array  # (mains,) film temperatures, K; 0 stands for the oil temperature


def make_run(
    engine: Engine, body: ReducedBody, settings: Settings, gas: GasTrace, parts: Parts,
    films_made: dict[Any, Any] | None = None,
) -> Run:  # fmt: skip
    """Make a run at the levels of ``settings``, not prepared yet; compiles the kernels of all integrators.

    Its numbers are those of the settings. Open settings stay open, so that one number may be changed without the
    others. ``films_made``: see :func:`cranktrain.dynamics.model.arrays.structure`.
    ``InputError`` for levels that do not exist, or whose parts are missing.
    """
    model = structure(engine, body, resolved(settings, engine), gas, parts, films_made)
    size = dimensions(model)
    state = np.zeros(state_size(size.modes, size.ports, size.films, size.passes))
    work = make_work(model, state.size, integrators=True)
    inputs = np.zeros(at.OTHER_INPUTS + at.CYLINDER_INPUTS * engine.n_cylinders)
    inputs[1 : 1 + engine.n_cylinders] = at.AMBIENT
    inputs[engine.n_cylinders + at.AXIAL_INPUT] = axial_force(settings, engine)
    counts = output_counts(engine, parts.topology)
    outputs = observers(counts, model, work, state, np.zeros(len(output_needs(counts))))
    temperatures = np.zeros(len(engine.crankshaft.main_widths))
    return Run(model, work, state, inputs, outputs, run_numbers(settings, engine, parts.data), temperatures)


@kernel
def inputs_status(inputs):
    """Status of the inputs: OK if all inputs are finite and speed and pressures are not negative."""
    for k in range(inputs.shape[0]):
        if not math.isfinite(inputs[k]):
            return INPUT_NOT_FINITE + k
        if inputs[k] < 0.0 and k <= (inputs.shape[0] - at.OTHER_INPUTS) // at.CYLINDER_INPUTS:
            return INPUT_NEGATIVE + k
    return OK


@kernel
def prepare(run):
    """Write the run's numbers into the model, with temperatures for the input speed. Return a status (0: success)."""
    status = prepare_model(run.model, run.numbers, run.temperatures, run.inputs[0])
    tell_stages(run.model, run.work.staged)
    if status == OK and run.work.family[int(run.model.stages[HEAD, FAMILY]), at.STEP_KERNEL] == 0:
        return UNKNOWN_METHOD
    return status


@kernel
def start(run, time):
    """Fill the state from the inputs at a time (s). Return a status (0: success); on failure the state is unchanged."""
    status = inputs_status(run.inputs)
    if status != OK:
        return status
    return start_state(run.model, run.work, run.state, run.inputs, time)


@kernel
def advance_run(run, t_end):
    """Advance the state to ``t_end`` (s), fill the outputs. Return a status (0: OK); a failure changes no state."""
    status = inputs_status(run.inputs)
    if status != OK:
        return status
    if not 0.0 < t_end - run.state[TIME] <= LONGEST_STEP:
        return NOT_AHEAD
    status = advance(run.model, run.work, run.state, run.inputs, t_end)
    run.work.staged[0, at.STAGES_GIVEN] = 0.0
    if status == OK:
        observe(run.model, run.work, run.state, run.outputs)
    return status


@kernel
def observe_run(run):
    """Fill the wanted outputs from the state. Return 0."""
    observe(run.model, run.work, run.state, run.outputs)
    return OK
