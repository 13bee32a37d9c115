"""What elastic films remember, from the state into a step's stages and back; see :mod:`cranktrain.film.elastic_law`.

The order of calls in a step is ``open_step``, then for each stage ``open_stage``, the stage's iteration and
``close_stage``, and ``close_step`` at the end. Without elastic films they do nothing.
"""

from __future__ import annotations

import math

from cranktrain.dynamics.equations_of_motion import COS, OMEGA, SIN, WHIRL, place_journal
from cranktrain.dynamics.ports import TILTS
from cranktrain.dynamics.state import LEAD_ANGLE, SHAFT_ANGLE, film_offset
from cranktrain.film.elastic_law import (
    KEPT,
    KEPT_FILM,
    KEPT_FRICTION,
    KEPT_PRESSURE,
    KEPT_SIDE_FLOW,
    closing_rate,
    kept_result,
    turn_pairs,
)
from cranktrain.film.elastohydrodynamic import CONVERGED
from cranktrain.film.laws import EHD
from cranktrain.film.parameters import LAW
from cranktrain.film.tilted import ECCENTRICITY, FLOW, FRICTION, GAP, P_MAX, tilted_force
from cranktrain.kernel import kernel


@kernel
def kept_films(model, state, i):
    """First index in the state of elastic film i."""
    nodes = model.films.elastic.supply.shape[0]
    shapes = model.films.elastic.compliance.shape[0]
    return film_offset(model.omega2.shape[0], model.ports.shape[0]) + i * (nodes + 2 * shapes + KEPT)


@kernel
def open_step(model, work, state):
    """Hand the films' memory at the step's start, with the ports in ``work.port[10:12]``, to the stages."""
    if model.bearings[0, LAW] != EHD:
        return
    memory = work.films.memory
    cos = math.cos(state[SHAFT_ANGLE] + state[LEAD_ANGLE])
    sin = math.sin(state[SHAFT_ANGLE] + state[LEAD_ANGLE])
    nodes = memory.start.shape[1]
    shapes = memory.shapes.shape[1]
    for i in range(model.bearings.shape[0]):
        o = kept_films(model, state, i)
        place_films(model, work, work.port[10], work.port[11], 0.0, i)
        turn_pairs(cos, sin, work.films.place[i], memory.start_place[i])
        for k in range(nodes):
            memory.start[i, k] = state[o + k]
            memory.unknowns[i, k] = state[o + k]
        for k in range(shapes):
            memory.start_shapes[i, k] = state[o + nodes + k]
            memory.shapes[i, k] = state[o + nodes + k]
            memory.rates[0, i, k] = state[o + nodes + shapes + k]


@kernel
def place_films(model, work, u, ud, whirl, i):
    """Place and velocity of journal i along the frame's axes."""
    tilt = int(model.layout[TILTS]) + 2 * i
    place_journal(u, ud, 2 * i, tilt, whirl, work.films.place[i], work.films.velocity[i])


@kernel
def open_stage(model, work, stage, elapsed, h, gain):
    """Times of a stage and the past Δ of its shapes; ``elapsed`` from the step's start, ``gain`` g of its rule, s."""
    if model.bearings[0, LAW] != EHD:
        return
    memory = work.films.memory
    memory.timing[0] = elapsed
    memory.timing[1] = gain
    for i in range(model.bearings.shape[0]):
        for k in range(memory.shapes.shape[1]):
            past = memory.start_shapes[i, k]
            for s in range(stage):
                past += h * model.stages[1 + stage, s] * memory.rates[s, i, k]
            memory.known[i, k] = past


@kernel
def close_stage(model, work, frame, stage):
    """Solve the films at the stage's ports, where the last Newton step only foresaw them; CONVERGED or what failed."""
    if model.bearings[0, LAW] != EHD:
        return CONVERGED
    memory = work.films.memory
    journal = model.ports.shape[0] - model.bearings.shape[0]
    for i in range(model.bearings.shape[0]):
        place_films(model, work, work.port[0], work.port[1], frame[WHIRL], i)
        status = tilted_force(
            model.films, work.films, model.bearings[i], i, frame[OMEGA] + work.port[1, journal + i], frame[COS],
            frame[SIN], False, work.scratch,
        )  # fmt: skip
        if status != CONVERGED:
            return status
        for k in range(memory.shapes.shape[1]):
            memory.rates[stage, i, k] = (memory.shapes[i, k] - memory.known[i, k]) / memory.timing[1]
    return CONVERGED


@kernel
def close_step(model, work, state, stage):
    """Keep what the films of the last stage became."""
    if model.bearings[0, LAW] != EHD:
        return
    memory = work.films.memory
    nodes = memory.start.shape[1]
    shapes = memory.shapes.shape[1]
    for i in range(model.bearings.shape[0]):
        o = kept_films(model, state, i)
        for k in range(nodes):
            state[o + k] = memory.unknowns[i, k]
        for k in range(shapes):
            state[o + nodes + k] = memory.shapes[i, k]
            state[o + nodes + shapes + k] = memory.rates[stage, i, k]
        o += nodes + 2 * shapes
        kept_result(memory.out[i], state[o : o + KEPT])


@kernel
def fastest_closing(model, work, state, whirl, least):
    """Largest rate (1/s) at which an elastic film closes, over itself, from the ports at the state."""
    memory = work.films.memory
    angle = state[SHAFT_ANGLE] + state[LEAD_ANGLE]
    nodes = memory.start.shape[1]
    shapes = memory.shapes.shape[1]
    worst = 0.0
    for i in range(model.bearings.shape[0]):
        o = kept_films(model, state, i) + nodes
        place_films(model, work, work.port[10], work.port[11], whirl, i)
        turn_pairs(math.cos(angle), math.sin(angle), work.films.place[i], memory.motion[0])
        turn_pairs(math.cos(angle), math.sin(angle), work.films.velocity[i], memory.motion[1])
        rate = closing_rate(
            model.films.elastic, memory.motion[0], memory.motion[1], state[o : o + shapes],
            state[o + shapes : o + 2 * shapes], least,
        )  # fmt: skip
        worst = max(worst, rate)
    return worst


@kernel
def kept_film(model, state, i, cos, sin, clearance, x, y, out):
    """Results of elastic film i at the end of the last step, laid out as :mod:`cranktrain.film.tilted` does."""
    nodes = model.films.elastic.supply.shape[0]
    shapes = model.films.elastic.compliance.shape[0]
    o = kept_films(model, state, i) + nodes + 2 * shapes
    turn_pairs(cos, -sin, state[o : o + 4], out)
    out[ECCENTRICITY] = math.sqrt(x * x + y * y) / clearance
    out[FRICTION] = state[o + KEPT_FRICTION]
    out[P_MAX] = state[o + KEPT_PRESSURE]
    out[FLOW] = state[o + KEPT_SIDE_FLOW]
    out[GAP] = max(state[o + KEPT_FILM], 0.0)
