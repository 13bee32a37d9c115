"""Force laws at the state of a run, each called once for all outputs and for the energy balance."""

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.film_memory import memory_offset
from cranktrain.dynamics.motion.law_motion import call_law, ports_of_state
from cranktrain.dynamics.motion.links import measure_links, turn_terms
from cranktrain.film.laws import films as on


@kernel
def begin_observation(model, work):
    """Let all laws be called anew at the state, whose ports and frame were found in the workspace."""
    frame = work.frames[0]
    ports_of_state(work)
    for k in range(work.told.shape[0]):
        work.told[k, at.SEEN] = 0.0
    turn_terms(model, work, frame[at.THETA], frame[at.WHIRL])
    measure_links(model, work, work.port[at.U], work.port[at.UD])


@kernel
def observe_law(model, work, state, k):
    """Write the result of law k at the state to ``work.found[k]``, and the speeds of its ends to ``work.told[k]``.

    Motion stays in place and velocity of ``model.laws``.
    """
    told = work.told[k]
    if told[at.SEEN] > 0.0:
        return
    told[at.SEEN] = 1.0
    frame = work.frames[0]
    numbers = model.laws.numbers
    out = work.found[k]
    row = model.connections[k]
    numbers[on.RATIO] = 0.0
    numbers[on.INERTANCE] = 0.0
    out[on.FRICTION] = 0.0
    memory = state[memory_offset(model, k) : memory_offset(model, k + 1)]
    call_law(model, work, frame, work.pressures[0], on.OBSERVE, k, memory, out)
    bore = 0.0
    if row[at.SHAPE] == at.OF_PORTS and model.laws.traits[k, on.MASS] == 0.0 and row[at.REACTS] >= 0:
        bore = work.port[at.UD, row[at.REACTS]]
    told[at.SPEEDS] = numbers[on.SPEED] + bore
    told[at.RUBBING] = numbers[on.RUBBING] - bore
