"""Calls of force laws with a memory in a step; see :mod:`cranktrain.film.laws.films`.

The order of calls in a step is ``open_step``, then for each stage ``open_stage``, the stage's iteration and
``close_stage``, and ``close_step`` at the end. If no law has a memory, they do nothing.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import port_count, term_row
from cranktrain.dynamics.model.state import LEAD_ANGLE, LEAD_SPEED, SHAFT_ANGLE, SHAFT_SPEED, film_offset
from cranktrain.dynamics.motion.law_motion import call_law, line_up_laws, ports_of_state, tell_law
from cranktrain.dynamics.motion.links import measure_links, turn_terms
from cranktrain.dynamics.motion.relative import relative_motion
from cranktrain.film.laws import films as on
from cranktrain.film.laws.films import film_call
from cranktrain.film.laws.parameters import CLEARANCE, CONTACT_HEIGHT


@inlined_kernel
def memory_offset(model, k):
    """First index in the state of the memory of law k, which ends where the memory of the next law begins."""
    return film_offset(model.omega2.shape[0], port_count(model)) + model.laws.remembered[k]


@inlined_kernel
def motion_size(model):
    """Length of the state without the stored begin and end of a step under way."""
    return memory_offset(model, model.laws.remembered.shape[0] - 1)


@inlined_kernel
def remembers(laws):
    """True if any of the force laws has a memory."""
    return laws.remembered[laws.remembered.shape[0] - 1] > 0


@inlined_kernel
def recall_law(model, work, state, action, k):
    """Call force law k at the state (:func:`take_state`) with its memory. Return 0, or a failure status."""
    frame = work.frames[work.frames.shape[0] - 1]
    memory = state[memory_offset(model, k) : memory_offset(model, k + 1)]
    return call_law(model, work, frame, work.pressures[0], action, k, memory, work.scratch)


@kernel
def take_state(model, work, state):
    """Let laws be called at the state, whose ports are in the workspace, with the last of ``work.frames``."""
    frame = work.frames[work.frames.shape[0] - 1]
    frame[at.THETA] = state[SHAFT_ANGLE] + state[LEAD_ANGLE]
    frame[at.COS] = math.cos(frame[at.THETA])
    frame[at.SIN] = math.sin(frame[at.THETA])
    frame[at.OMEGA] = frame[at.WHIRL] = state[SHAFT_SPEED] + state[LEAD_SPEED]
    ports_of_state(work)
    turn_terms(model, work, frame[at.THETA], frame[at.WHIRL])
    measure_links(model, work, work.port[at.U], work.port[at.UD])


@kernel
def open_step(model, work, state):
    """Pass memory and motion at the start of a step to force laws with a memory."""
    if not remembers(model.laws):
        return
    take_state(model, work, state)
    for k in range(model.connections.shape[0]):
        if model.laws.traits[k, on.MEMORY] > 0.0:
            recall_law(model, work, state, on.OPEN_STEP, k)


@inlined_kernel
def open_stage(model, work, stage, elapsed, h, gain):
    """Pass times (s) of a stage to force laws: ``elapsed`` since the step's start, step h, g of the stage's rule."""
    if not remembers(model.laws):
        return
    numbers = model.laws.numbers
    numbers[on.ELAPSED] = elapsed
    numbers[on.STEP] = h
    numbers[on.GAIN] = gain
    numbers[on.STAGE] = float(stage)
    for k in range(model.connections.shape[0]):
        if model.laws.traits[k, on.MEMORY] > 0.0:
            film_call(model.laws, on.OPEN_STAGE, k, model.stages[1 + stage], work.scratch)


@inlined_kernel
def close_stage(model, work, frame, pressures):
    """Solve laws with a memory at the final ports of a stage, after its Newton step. Return 0, or a failure status."""
    if not remembers(model.laws):
        return 0
    u = work.port[at.U]
    ud = work.port[at.UD]
    d = work.port[at.RELATIVE]
    dd = work.port[at.RELATIVE_RATE]
    relative_motion(model, frame[at.COS], frame[at.SIN], frame[at.WHIRL], u, ud, d, dd)
    turn_terms(model, work, frame[at.THETA], frame[at.WHIRL])
    measure_links(model, work, u, ud)
    line_up_laws(model, work, frame, pressures)
    for k in range(model.connections.shape[0]):
        if model.laws.traits[k, on.MEMORY] > 0.0:
            status = call_law(model, work, frame, pressures, on.CLOSE_STAGE, k, work.scratch, work.scratch)
            if status != 0:
                return status
    return 0


@kernel
def close_step(model, work, state):
    """Write the memory of force laws after the last stage of a step to the state."""
    for k in range(model.connections.shape[0]):
        if model.laws.traits[k, on.MEMORY] > 0.0:
            memory = state[memory_offset(model, k) : memory_offset(model, k + 1)]
            film_call(model.laws, on.CLOSE_STEP, k, memory, work.scratch)


@kernel
def fastest_closing(model, work, state):
    """Largest relative rate (1/s) at which a film closes, from the ports at the state.

    Laws with the trait TELLS_RATE compute it themselves. For other journals it is the rate of the middle over the gap
    at the end that is nearest to the bore.
    """
    laws = model.laws
    take_state(model, work, state)
    worst = 0.0
    for k in range(model.connections.shape[0]):
        if laws.traits[k, on.CLOSES] == 0.0 or model.connections[k, at.SHAPE] == at.OF_EYE:
            continue
        if laws.traits[k, on.TELLS_RATE] > 0.0:
            recall_law(model, work, state, on.RATE, k)
            worst = max(worst, work.scratch[0])
            continue
        tell_law(model, work, work.frames[work.frames.shape[0] - 1], work.pressures[0], on.RATE, k)
        if model.connections[k, at.SHAPE] == at.OF_TERMS:
            bearing = model.links.bearings[k - term_row(model)]
            worst = max(worst, closing_rate(bearing, laws.place[k], laws.velocity[k]))
        else:
            worst = max(worst, closing_rate(model.bearings[k], laws.place[k], laws.velocity[k]))
    return worst


@kernel
def closing_rate(law, place, velocity):
    """Radial speed of the middle of a journal over the least gap in a round bore, 1/s."""
    x = place[0]
    y = place[1]
    e = math.sqrt(x * x + y * y)
    if e == 0.0:
        return 0.0
    a = place[on.END_X]
    b = place[on.END_Y]
    reach = math.sqrt(e * e + a * a + b * b + 2.0 * abs(x * a + y * b))
    return abs(x * velocity[0] + y * velocity[1]) / e / max(law[CLEARANCE] - reach, law[CONTACT_HEIGHT])
