"""Force laws at the state of a run, each called once for all outputs and for the energy balance."""

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.film_memory import memory_offset
from cranktrain.dynamics.motion.film_ports import call_at_ports, frame_numbers
from cranktrain.dynamics.motion.links import link_law, measure_links, turn_terms
from cranktrain.dynamics.motion.masses import tell_gas, tell_mass
from cranktrain.film.laws import films as on
from cranktrain.film.laws.films import film_call


@kernel
def begin_observation(model, work):
    """Let all laws be called anew at the state, whose ports and frame were found in the workspace."""
    frame = work.frames[0]
    for block in range(3):
        for k in range(work.port.shape[1]):
            work.port[at.U + block, k] = work.port[at.STATE_U + block, k]
    for k in range(work.told.shape[0]):
        work.told[k, at.SEEN] = 0.0
    turn_terms(model, work, frame[at.THETA], frame[at.WHIRL])
    measure_links(model, work, work.port[at.U], work.port[at.UD])


@kernel
def observe_law(model, work, state, k):
    """Write the result of law k at the state to ``work.found[k]``, and the speeds of its ends to ``work.told[k]``.

    A rod's law is not told the friction of a film on the rod. Motion stays in place and velocity of ``model.laws``.
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
    frame_numbers(frame, numbers)
    memory = state[memory_offset(model, k) : memory_offset(model, k + 1)]
    bore = 0.0
    if row[at.SHAPE] == at.OF_TERMS:
        link_law(model, work, frame, work.pressures[0], k, on.OBSERVE, memory, out)
    elif model.laws.traits[k, on.MASS] > 0.0:
        tell_mass(model, work, frame, k)
        tell_gas(model, work, work.pressures[0], k)
        numbers[on.COUPLE] = 0.0
        film_call(model.laws, on.OBSERVE, k, memory, out)
    else:
        call_at_ports(model, work, frame, on.OBSERVE, k, memory, out)
        if row[at.SHAPE] == at.OF_PORTS and row[at.REACTS] >= 0:
            bore = work.port[at.UD, row[at.REACTS]]
    told[at.SPEEDS] = numbers[on.SPEED] + bore
    told[at.RUBBING] = numbers[on.RUBBING] - bore
