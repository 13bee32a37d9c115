"""What films and the axial joint are told by a step, and what they remember; see :mod:`cranktrain.film.laws.films`.

The order of calls in a step is ``open_step``, then for each stage ``open_stage``, the stage's iteration and
``close_stage``, and ``close_step`` at the end. Where films have no memory they do nothing.
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import call_kernel, inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.state import LEAD_ANGLE, SHAFT_ANGLE, film_offset
from cranktrain.dynamics.motion.film_ports import place_joint, place_journal
from cranktrain.dynamics.motion.relative import relative_motion
from cranktrain.dynamics.topology import slots as added
from cranktrain.film.laws.films import ANGLE as FRAME_ANGLE
from cranktrain.film.laws.films import (
    CLOSE_STAGE,
    CLOSE_STEP,
    CLOSES,
    ELAPSED,
    END_X,
    END_Y,
    GAIN,
    MEMORY,
    OPEN_STAGE,
    OPEN_STEP,
    RATE,
    SPEED,
    STAGE,
    STEP,
    film_call,
)
from cranktrain.film.laws.films import COS as FRAME_COS
from cranktrain.film.laws.films import SIN as FRAME_SIN
from cranktrain.film.laws.parameters import CLEARANCE, CONTACT_HEIGHT


@inlined_kernel
def memory_offset(model, i):
    """First index in the state of what film i remembers; the next film's begins where it ends."""
    first = film_offset(model.omega2.shape[0], int(model.layout[at.PORTS]))
    return first + model.films.remembered[i]


@inlined_kernel
def remembers(films):
    """Whether any of the films, or of the added connections, has a memory."""
    return films.remembered[films.remembered.shape[0] - 1] > 0


@inlined_kernel
def place_film(model, d, dd, whirl, i):
    """Place and velocity of journal i in its bore along the frame's axes, from the ports' relative motion."""
    place_journal(model.connections[i], d, dd, whirl, model.films.place[i], model.films.velocity[i])


@inlined_kernel
def joint_offset(model):
    """First index in the state of what the axial joint remembers, behind the films' memory."""
    return memory_offset(model, model.bearings.shape[0])


@kernel
def open_step(model, work, state):
    """Hand the memory of films and axial joint at the step's start, with the ports' motion then, to the stages."""
    if model.layout[at.AXIAL_JOINT] > 0.0:
        film_call(model.axial_joint, OPEN_STEP, 0, state[joint_offset(model) :], work.scratch)
    if remembers(model.links):
        call_kernel(model.links.hooks[added.AT_OPEN_STEP], (model, work, state))
    if not remembers(model.films):
        return
    numbers = model.films.numbers
    numbers[FRAME_COS] = math.cos(state[SHAFT_ANGLE] + state[LEAD_ANGLE])
    numbers[FRAME_SIN] = math.sin(state[SHAFT_ANGLE] + state[LEAD_ANGLE])
    numbers[FRAME_ANGLE] = state[SHAFT_ANGLE]
    for i in range(model.bearings.shape[0]):
        if model.films.traits[i, MEMORY] == 0.0:
            continue
        place_film(model, work.port[at.RELATIVE], work.port[at.RELATIVE_RATE], 0.0, i)
        memory = state[memory_offset(model, i) : memory_offset(model, i + 1)]
        film_call(model.films, OPEN_STEP, i, memory, work.scratch)


@inlined_kernel
def tell_stage(films, count, row, work, clock):
    """Tell ``count`` films the times of a stage: elapsed since the step's start, step, g of its rule (s), number."""
    numbers = films.numbers
    numbers[ELAPSED], numbers[STEP], numbers[GAIN], numbers[STAGE] = clock
    for i in range(count):
        if films.traits[i, MEMORY] > 0.0:
            film_call(films, OPEN_STAGE, i, row, work.scratch)


@inlined_kernel
def open_stage(model, work, stage, elapsed, h, gain):
    """Tell films and axial joint the times of a stage: ``elapsed`` since the step's start, g of the stage's rule, s."""
    clock = elapsed, h, gain, float(stage)
    if model.layout[at.AXIAL_JOINT] > 0.0:
        tell_stage(model.axial_joint, 1, model.stages[1 + stage], work, clock)
    if remembers(model.films):
        tell_stage(model.films, model.bearings.shape[0], model.stages[1 + stage], work, clock)
    if remembers(model.links):
        call_kernel(model.links.hooks[added.AT_OPEN_STAGE], (model, work, stage, elapsed, h, gain))


@inlined_kernel
def close_stage(model, work, frame):
    """Solve films and axial joint at the stage's ports, which the last Newton step only foresaw; 0, or a failure."""
    if model.layout[at.AXIAL_JOINT] > 0.0:
        place_joint(model, frame, work.port[at.U], work.port[at.UD])
        film_call(model.axial_joint, CLOSE_STAGE, 0, work.scratch, work.scratch)
    if remembers(model.links):
        status = call_kernel(model.links.hooks[added.AT_CLOSE_STAGE], (model, work, frame))
        if status != 0:
            return status
    if not remembers(model.films):
        return 0
    numbers = model.films.numbers
    numbers[FRAME_COS] = frame[at.COS]
    numbers[FRAME_SIN] = frame[at.SIN]
    numbers[FRAME_ANGLE] = frame[at.THETA]
    journal = int(model.layout[at.JOURNAL_ROTATIONS])
    relative_motion(
        model,
        frame[at.COS],
        frame[at.SIN],
        frame[at.WHIRL],
        work.port[at.U],
        work.port[at.UD],
        work.port[at.RELATIVE],
        work.port[at.RELATIVE_RATE],
    )
    for i in range(model.bearings.shape[0]):
        if model.films.traits[i, MEMORY] == 0.0:
            continue
        place_film(model, work.port[at.RELATIVE], work.port[at.RELATIVE_RATE], frame[at.WHIRL], i)
        numbers[SPEED] = frame[at.OMEGA] + work.port[at.UD, journal + i]
        status = film_call(model.films, CLOSE_STAGE, i, work.scratch, work.scratch)
        if status != 0:
            return status
    return 0


@kernel
def close_step(model, work, state):
    """Keep what films and axial joint of the last stage became."""
    if model.layout[at.AXIAL_JOINT] > 0.0:
        film_call(model.axial_joint, CLOSE_STEP, 0, state[joint_offset(model) :], work.scratch)
    if remembers(model.links):
        call_kernel(model.links.hooks[added.AT_CLOSE_STEP], (model, work, state))
    for i in range(model.bearings.shape[0]):
        if model.films.traits[i, MEMORY] == 0.0:
            continue
        memory = state[memory_offset(model, i) : memory_offset(model, i + 1)]
        film_call(model.films, CLOSE_STEP, i, memory, work.scratch)


@kernel
def fastest_closing(model, work, state, whirl):
    """Largest rate (1/s) at which a film closes, over itself, from the ports at the state.

    Films with a memory tell it themselves; of others it is the rate of the journal's middle over the gap at the end
    that is nearest to the bore.
    """
    numbers = model.films.numbers
    numbers[FRAME_COS] = math.cos(state[SHAFT_ANGLE] + state[LEAD_ANGLE])
    numbers[FRAME_SIN] = math.sin(state[SHAFT_ANGLE] + state[LEAD_ANGLE])
    worst = 0.0
    for i in range(model.bearings.shape[0]):
        if model.films.traits[i, CLOSES] == 0.0:
            continue
        place_film(model, work.port[at.RELATIVE], work.port[at.RELATIVE_RATE], whirl, i)
        if model.films.traits[i, MEMORY] > 0.0:
            memory = state[memory_offset(model, i) : memory_offset(model, i + 1)]
            film_call(model.films, RATE, i, memory, work.scratch)
            worst = max(worst, work.scratch[0])
        else:
            worst = max(worst, closing_rate(model.bearings[i], model.films.place[i], model.films.velocity[i]))
    return worst


@kernel
def closing_rate(law, place, velocity):
    """Rate (1/s) at which the middle of a journal goes to or from the wall, over the least gap in a round bore."""
    x = place[0]
    y = place[1]
    e = math.sqrt(x * x + y * y)
    if e == 0.0:
        return 0.0
    a = place[END_X]
    b = place[END_Y]
    reach = math.sqrt(e * e + a * a + b * b + 2.0 * abs(x * a + y * b))
    return abs(x * velocity[0] + y * velocity[1]) / e / max(law[CLEARANCE] - reach, law[CONTACT_HEIGHT])
