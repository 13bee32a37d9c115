"""Calls of added connections with a memory in a step; see :mod:`cranktrain.film.laws.films`.

The calls are those of :mod:`cranktrain.dynamics.motion.film_memory`, in the same order, at the motion of the
connections' components. The memory lies in the state after that of the engine's own films and axial joint.
"""

from __future__ import annotations

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import port_count
from cranktrain.dynamics.model.state import LEAD_ANGLE, LEAD_SPEED, SHAFT_ANGLE, SHAFT_SPEED, film_offset
from cranktrain.dynamics.motion.added_connections import call_link, measure_links, place_link, turn_terms
from cranktrain.dynamics.motion.film_memory import closing_rate
from cranktrain.dynamics.topology import slots as added
from cranktrain.film.laws.films import (
    CLOSE_STAGE,
    CLOSE_STEP,
    ELAPSED,
    GAIN,
    OPEN_STAGE,
    OPEN_STEP,
    RATE,
    STAGE,
    STEP,
)


@inlined_kernel
def link_offset(model, k):
    """First index in the state of the memory of added connection k, which ends where that of the next one begins."""
    first = film_offset(model.omega2.shape[0], port_count(model))
    first += model.laws.remembered[model.laws.remembered.shape[0] - 1]
    return first + model.links.remembered[k]


@inlined_kernel
def measure_at_state(model, work, state):
    """Compute the motion of all components from the ports in ``work.port``. Return the frame's speed, rad/s."""
    whirl = state[SHAFT_SPEED] + state[LEAD_SPEED]
    turn_terms(model, work, state[SHAFT_ANGLE] + state[LEAD_ANGLE], whirl)
    measure_links(model, work, work.port[at.STATE_U], work.port[at.STATE_UD])
    return whirl


@kernel
def open_links(model, work, state):
    """Pass memory and motion of added connections at the start of a step to their force laws."""
    whirl = measure_at_state(model, work, state)
    for k in range(model.links.rows.shape[0]):
        if model.links.traits[k, added.KEEPS] > 0.0:
            place_link(model, work, whirl, state[SHAFT_SPEED], work.port[at.STATE_UD], k)
            memory = state[link_offset(model, k) : link_offset(model, k + 1)]
            call_link(model.links, k, OPEN_STEP, memory, work.scratch)


@kernel
def open_link_stage(model, work, stage, elapsed, h, gain):
    """Pass times (s) of a stage to connections: ``elapsed`` since the step's start, step h, g of the stage's rule."""
    numbers = model.links.numbers
    numbers[ELAPSED] = elapsed
    numbers[STEP] = h
    numbers[GAIN] = gain
    numbers[STAGE] = float(stage)
    for k in range(model.links.rows.shape[0]):
        if model.links.traits[k, added.KEEPS] > 0.0:
            call_link(model.links, k, OPEN_STAGE, model.stages[1 + stage], work.scratch)


@kernel
def close_link_stage(model, work, frame):
    """Solve connections with a memory at the ports of a stage. Return 0, or a failure status."""
    turn_terms(model, work, frame[at.THETA], frame[at.WHIRL])
    measure_links(model, work, work.port[at.U], work.port[at.UD])
    for k in range(model.links.rows.shape[0]):
        if model.links.traits[k, added.KEEPS] > 0.0:
            place_link(model, work, frame[at.WHIRL], frame[at.OMEGA], work.port[at.UD], k)
            status = call_link(model.links, k, CLOSE_STAGE, work.scratch, work.scratch)
            if status != 0:
                return status
    return 0


@kernel
def close_links(model, work, state):
    """Write the memory of added connections after the last stage of a step to the state."""
    for k in range(model.links.rows.shape[0]):
        if model.links.traits[k, added.KEEPS] > 0.0:
            memory = state[link_offset(model, k) : link_offset(model, k + 1)]
            call_link(model.links, k, CLOSE_STEP, memory, work.scratch)


@kernel
def fastest_link(model, work, state):
    """Largest relative rate (1/s) at which the gap of an added bearing closes, from the ports at the state."""
    whirl = measure_at_state(model, work, state)
    links = model.links
    worst = 0.0
    for k in range(links.rows.shape[0]):
        if links.rows[k, added.CLOSES] == 0.0:
            continue
        place_link(model, work, whirl, state[SHAFT_SPEED], work.port[at.STATE_UD], k)
        if links.traits[k, added.TELLS_RATE] > 0.0:
            memory = state[link_offset(model, k) : link_offset(model, k + 1)]
            call_link(links, k, RATE, memory, work.scratch)
            worst = max(worst, work.scratch[0])
        else:
            worst = max(worst, closing_rate(links.bearings[k], links.place[k], links.velocity[k]))
    return worst
