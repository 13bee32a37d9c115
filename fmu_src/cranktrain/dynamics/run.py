"""Outputs of a run, filled from the state."""

from cranktrain.core.kernel import call_kernel, kernel
from cranktrain.dynamics.model.state import LAST_INTERVAL
from cranktrain.dynamics.outputs.slots import ADDRESS, END, FIRST, MEMBERS, WANTED
from cranktrain.dynamics.time.reconstruction import reconstruct
from cranktrain.dynamics.time.step_control import frame_at, ports_at_state, pressures_at_state


@kernel
def observe(model, work, state, outputs):
    """Fill the wanted ``outputs`` from the state alone, so that a restored state gives the same outputs."""
    reconstruct(model, work, state)
    frame_at(model, work, state, state[LAST_INTERVAL], 0.0, work.frames[0], work.pressures[0])
    ports_at_state(model, work, state)
    pressures_at_state(model, work, state)
    families = outputs.families
    for k in range(families.shape[0]):
        if families[k, WANTED] == 0:
            continue
        values = outputs.values[families[k, FIRST] : families[k, END]]
        arguments = (model, work, state, families[k, MEMBERS], values)
        call_kernel(families[k, ADDRESS], arguments)
