"""Outputs of a run, filled from the state."""

from cranktrain.core.kernel import call_kernel, kernel
from cranktrain.dynamics.model.state import LAST_INTERVAL
from cranktrain.dynamics.outputs.laws import begin_observation
from cranktrain.dynamics.time.reconstruction import reconstruct
from cranktrain.dynamics.time.step_control import frame_at, ports_at_state, pressures_at_state

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
