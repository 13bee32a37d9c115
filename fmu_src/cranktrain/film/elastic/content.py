"""Oil in the nodes of an elastic film over the stages of a step: the rule of the integrator for voids.

Node k holds θH. What it holds apart from what a full node holds by itself is

    m = θH   (node void at the step's start),      m = θH − H = uH   (node full at the step's start).

Stage i has m_i = m_n + h Σ_{j<i} a_ij ṁ_j + hγ ṁ_i, as the journal and the bore's shapes. ṁ is minus the divergence of
the flow, in full nodes minus ∂H/∂t as well, so a step changes the oil of all nodes by what has flowed through the ends
and out of the supply at the stages, summed with their weights. The complementarity of pressure and void holds at every
stage. A rule of second order cannot keep every fill above zero at any step (Bolley and Crouzeix): a fill below zero is
set to zero and counted in CLIPPED.

The limited correction of the transport is found from a fill predicted for the stage, θH ≈ m_n + h Σ a_ij ṁ_j + hγ ṁ of
the stage before, in the film at the velocities of the step's start. The prediction enters the correction only, so its
error, O(h²) away from fronts, costs no oil.

Source: C. Bolley, M. Crouzeix, R.A.I.R.O. Analyse numérique 12 (1978) 237.
"""

from __future__ import annotations

from cranktrain.core.kernel import kernel
from cranktrain.film.contact.gap import open_gap
from cranktrain.film.elastic import grid as at
from cranktrain.film.elastic.height import node_films

GAINED, PREDICTED_VOID, PREDICTED_ROOM = 0, 1, 2
"""Rows of a stage's content: h Σ a_ij ṁ_j over the clearance, predicted void fraction (≤ 0), predicted mean gap."""
CONTENT = 3


@kernel
def stage_content(film, work, past, rates, stage, content):
    """Fill the content (CONTENT, n) of a stage before it is solved.

    Parameters
    ----------
    past : unknowns (n,), place (4,) and velocity (4,) of the journal, shapes (k,) and their rates (k,), all at the
        step's start; m and m/s
    rates : (stages, n) ṁ over the clearance of the stages before, 1/s; that of the step's start in row 0
    stage : its number, row of the integrator's table, step h, g = hγ and time from the step's start, s
    """
    start, place, pace, shapes, shape_rates = past
    number, row, h, gain, elapsed = stage
    lines = int(film.constants[at.N_Z]) + 2
    vectors = work.vectors
    per_clearance = 1.0 / film.constants[at.CLEARANCE]
    room = work.nodes[at.OPEN]
    _to_vectors(vectors, per_clearance, place, pace, shapes, shape_rates)
    node_films(film, vectors[at.START_PLACE], vectors[at.START_SHIFT], work.nodes[at.START_MASS])
    for k in range(4):
        vectors[at.START_PLACE, k] += elapsed * vectors[at.PACE, k]
    for k in range(shapes.shape[0]):
        vectors[at.START_SHIFT, k + 1] += elapsed * vectors[at.STEP, k + 1]
    node_films(film, vectors[at.START_PLACE], vectors[at.START_SHIFT], room)
    last = max(number - 1, 0)
    for f in range(start.shape[0]):
        q = f + 2 * (f // (lines - 2)) + 1
        gained = 0.0
        for s in range(number):
            gained += h * row[s] * rates[s, f]
        content[GAINED, f] = gained
        gap, _, _ = open_gap(room[q], film.constants[at.ROUGHNESS])
        content[PREDICTED_ROOM, f] = gap
        void = 0.0
        if start[f] < 0.0:
            held, _, _ = open_gap(work.nodes[at.START_MASS, q], film.constants[at.ROUGHNESS])
            held *= 1.0 + start[f] if start[f] > -1.0 else 0.0
            void = (held + gained + gain * rates[last, f]) / gap - 1.0
            void = min(max(void, -1.0), 0.0)
        content[PREDICTED_VOID, f] = void


@kernel
def _to_vectors(vectors, per_clearance, place, pace, shapes, shape_rates):
    """Place and shapes with their rates over the clearance; the rest of ``vectors`` zero."""
    for row in range(at.VECTORS):
        vectors[row, :] = 0.0
    for k in range(4):
        vectors[at.START_PLACE, k] = place[k] * per_clearance
        vectors[at.PACE, k] = pace[k] * per_clearance
    for k in range(shapes.shape[0]):
        vectors[at.START_SHIFT, k + 1] = shapes[k] * per_clearance
        vectors[at.STEP, k + 1] = shape_rates[k] * per_clearance


@kernel
def content_rates(film, work, past, solved, gain, gained, rates, ends):
    """Write ṁ of a solved stage over the clearance, 1/s: ``rates`` (n,), and ``ends`` (n,) as the next step counts it.

    A node that has changed sides since the step's start gains or loses ∂H/∂t in ``ends``.

    Parameters
    ----------
    past : unknowns (n,), place (4,), m, and shapes (k,), m, at the step's start
    solved : unknowns (n,), motion (2, 4), m and m/s, shapes (k,), m, and their rates (k,), m/s, at the stage
    gain : g = hγ of the stage, s
    gained : (n,) h Σ a_ij ṁ_j of the stages before, over the clearance
    """
    start, start_place, start_shapes = past
    unknowns, motion, shapes, shape_rates = solved
    lines = int(film.constants[at.N_Z]) + 2
    sigma = film.constants[at.ROUGHNESS]
    vectors = work.vectors
    per_clearance = 1.0 / film.constants[at.CLEARANCE]
    nodes = work.nodes
    _to_vectors(vectors, per_clearance, start_place, motion[1], start_shapes, shape_rates)
    node_films(film, vectors[at.START_PLACE], vectors[at.START_SHIFT], nodes[at.START_MASS])
    node_films(film, vectors[at.PACE], vectors[at.STEP], nodes[at.DRIVEN])
    for k in range(4):
        vectors[at.START_PLACE, k] = motion[0, k] * per_clearance
    for k in range(shapes.shape[0]):
        vectors[at.START_SHIFT, k + 1] = shapes[k] * per_clearance
    node_films(film, vectors[at.START_PLACE], vectors[at.START_SHIFT], nodes[at.FILM])
    for f in range(start.shape[0]):
        line = f % (lines - 2) + 1
        q = f + 2 * (f // (lines - 2)) + 1
        gap, slope, _ = open_gap(nodes[at.FILM, q], sigma)
        # The distance of the surfaces less its constant part is linear in place and shapes.
        nodes[at.DRIVEN, q] = slope * (nodes[at.DRIVEN, q] - 1.0 - film.lines[line, at.PROFILE])
        void = unknowns[f] if unknowns[f] < 0.0 else 0.0
        kept = void
        held = gained[f]
        if start[f] < 0.0:
            kept = 1.0 + void
            was, _, _ = open_gap(nodes[at.START_MASS, q], sigma)
            held += was * (1.0 + start[f]) if start[f] > -1.0 else 0.0
        rates[f] = (kept * gap - held) / gain
        ends[f] = rates[f]
        if start[f] < 0.0 and unknowns[f] >= 0.0:
            ends[f] -= nodes[at.DRIVEN, q]
        elif start[f] >= 0.0 and unknowns[f] < 0.0:
            ends[f] += nodes[at.DRIVEN, q]
