"""The driver above time stepping and outputs: advance the state, then observe it."""

from __future__ import annotations

from cranktrain.core.kernel import call_kernel, kernel
from cranktrain.dynamics.model.state import LAST_INTERVAL
from cranktrain.dynamics.outputs.slots import ADDRESS, END, FIRST, MEMBERS, WANTED
from cranktrain.dynamics.time.reconstruction import reconstruct
from cranktrain.dynamics.time.status import OK
from cranktrain.dynamics.time.step_control import advance, frame_at, ports_at_state


@kernel
def observe(model, work, state, outputs):
    """Fill the wanted ``outputs`` from the state alone, so that a restored state shows what the original did."""
    reconstruct(model, work, state)
    frame_at(model, work, state, state[LAST_INTERVAL], 0.0, work.frames[0], work.pressures[0])
    ports_at_state(model, work, state)
    families = outputs.families
    for k in range(families.shape[0]):
        if families[k, WANTED] == 0:
            continue
        values = outputs.values[families[k, FIRST] : families[k, END]]
        arguments = (model, work, state, families[k, MEMBERS], values)
        call_kernel(families[k, ADDRESS], arguments)


@kernel
def advance_and_observe(model, work, state, inputs, t_end, outputs):
    """One communication step and its outputs in one call: each call from Python costs as much as a film."""
    status = advance(model, work, state, inputs, t_end)
    if status == OK:
        observe(model, work, state, outputs)
    return status


@kernel
def advance_series(model, work, state, inputs, step, first, series, outputs):
    """Communication steps to (first + k) step for each row k of ``series``, which keeps their outputs.

    Returns how many succeeded; what ends it early is tried again by the caller, who then knows why.
    """
    for k in range(series.shape[0]):
        if advance_and_observe(model, work, state, inputs, (first + k) * step, outputs) != OK:
            return k
        for j in range(series.shape[1]):
            series[k, j] = outputs.values[j]
    return series.shape[0]
