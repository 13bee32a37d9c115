"""Oil content of the nodes of an elastic film over the stages of a step, integrated like the other states.

Node k holds the oil θH. The integrated content m leaves out the oil of a node that stays full:

    m = θH   (node void at the step's start),      m = θH − H = uH   (node full at the step's start).

Stage i has m_i = m_n + h Σ_{j<i} a_ij ṁ_j + hγ ṁ_i, like the journal and the bore's shapes. ṁ is minus the divergence
of the flow, and in full nodes also minus ∂H/∂t. A step therefore changes the total oil by the flows through ends and
supply at the stages, summed with the weights of the stages. The complementarity of pressure and void holds at every
stage. A rule of second order cannot keep every fill above zero for any step (Bolley and Crouzeix), so a fill below zero
is set to zero and counted in CLIPPED.

The limited correction of the transport uses a predicted fill of the stage, θH ≈ m_n + h Σ a_ij ṁ_j + hγ ṁ with ṁ of
the previous stage, and gaps predicted with the velocities at the step's start. The prediction enters the correction
only, so its error, O(h²) away from fronts, costs no oil.

Source: C. Bolley, M. Crouzeix, R.A.I.R.O. Analyse numérique 12 (1978) 237.
"""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.lanes import four
from cranktrain.core.vectors import LANES, load, unpack
from cranktrain.film.contact.gap import CLEAR, open_gap
from cranktrain.film.elastic import grid as at
from cranktrain.film.elastic.workspace import FILM, GROWTH, OPEN

GAINED, PREDICTED_VOID, PREDICTED_ROOM, HELD, DISTANCE, PACE = 0, 1, 2, 3, 4, 5
"""Rows of a film's content, over the clearance. At a stage: h Σ a_ij ṁ_j, predicted void fraction (≤ 0), predicted mean
gap. At the step's start: θH of void nodes (else 0), distance of the surfaces, its rate (1/s)."""
CONTENT = 6
PLACE, SHIFT = 0, 1
"""Rows of LaneWork.vectors."""


@kernel
def begin_content(film, work, past, content):
    """Set the rows of a film's content (CONTENT, n) that stay constant through a step.

    ``work`` is the workspace of a film in doubles; its nodes are overwritten.
    ``past``: unknowns (n,), place (4,) and velocity (4,) of the journal, shapes (k,) and their rates (k,), all at the
    step's start; m and m/s.
    """
    start, place, pace, shapes, shape_rates = past
    n_z = int(film.constants[at.N_Z])
    sigma = film.constants[at.ROUGHNESS]
    distances = work.nodes[0, FILM]
    rates = work.nodes[0, GROWTH]
    _distances(film, work.vectors, place, shapes, distances)
    _distances(film, work.vectors, pace, shape_rates, rates)
    for i in range(int(film.constants[at.N_PHI])):
        for j in range(n_z):
            f = i * n_z + j
            q = i * (n_z + 2) + j + 1
            content[DISTANCE, f] = distances[q]
            content[PACE, f] = rates[q] - 1.0 - film.lines[j + 1, at.PROFILE]
            content[HELD, f] = 0.0
            if -1.0 < start[f] < 0.0:
                room, _, _ = open_gap(distances[q], sigma)
                content[HELD, f] = room * (1.0 + start[f])


@kernel
def stage_content(film, start, rates, own, stage, content):
    """Set the rows of a film's content (CONTENT, n) that belong to a stage, before its solution.

    Parameters
    ----------
    start : unknowns (n,) at the step's start
    rates : (stages, b, n) ṁ over the clearance of the earlier stages of b films, 1/s; row 0 is the step's start.
        ``own`` is the number of this film
    stage : number of the stage, its row of the integrator's table, step h, g = hγ and time from the step's start, s
    """
    number, row, h, gain, elapsed = stage
    sigma = film.constants[at.ROUGHNESS]
    last = max(number - 1, 0)
    for f in range(start.shape[0]):
        content[GAINED, f] = 0.0
    for s in range(number):
        share = h * row[s]
        before = rates[s, own]
        for f in range(start.shape[0]):
            content[GAINED, f] += share * before[f]
    before = rates[last, own]
    for f in range(start.shape[0]):
        content[PREDICTED_ROOM, f] = content[DISTANCE, f] + elapsed * content[PACE, f]
    _open(content[PREDICTED_ROOM], sigma)
    for f in range(start.shape[0]):
        room = content[PREDICTED_ROOM, f]
        void = 0.0
        if start[f] < 0.0:
            void = (content[HELD, f] + content[GAINED, f] + gain * before[f]) / room - 1.0
            void = min(max(void, -1.0), 0.0)
        content[PREDICTED_VOID, f] = void


@kernel
def content_rates(film, work, start, solved, gain, content, rates, ends):
    """Compute ṁ of the oil content over the clearance (1/s) of a solved stage, in ``rates`` (n,) and ``ends`` (n,).

    For a node that has changed between full and void since the step's start, ``ends`` differs by ∂H/∂t.

    Parameters
    ----------
    start : unknowns (n,) at the step's start
    solved : solution of the stage: unknowns (n,), motion (2, 4), m and m/s, shapes (k,), m, and their rates (k,), m/s
    gain : g = hγ of the stage, s
    content : (CONTENT, n) of the stage
    """
    unknowns, motion, shapes, shape_rates = solved
    n_z = int(film.constants[at.N_Z])
    sigma = film.constants[at.ROUGHNESS]
    distances = work.nodes[0, FILM]
    _distances(film, work.vectors, motion[0], shapes, distances)
    _to_vectors(film, work.vectors, motion[1], shape_rates)
    rooms = work.nodes[0, OPEN]
    for q in range(distances.shape[0]):
        rooms[q] = distances[q]
    _open(rooms, sigma)
    per_gain = 1.0 / gain
    for i in range(int(film.constants[at.N_PHI])):
        for j in range(n_z):
            f = i * n_z + j
            q = i * (n_z + 2) + j + 1
            void = min(unknowns[f], 0.0)
            kept = void if start[f] >= 0.0 else 1.0 + void
            rate = (kept * rooms[q] - content[HELD, f] - content[GAINED, f]) * per_gain
            rates[f] = rate
            if (start[f] < 0.0) != (unknowns[f] < 0.0):
                _, slope, _ = open_gap(distances[q], sigma)
                growth = slope * _node_rate(film, work.vectors, i, j + 1)
                rate += growth if unknowns[f] < 0.0 else -growth
            ends[f] = rate


@kernel
def _open(distances, sigma):
    """Replace distances of rough surfaces by mean gaps of the oil, in place."""
    for k in range(distances.shape[0]):
        if distances[k] < CLEAR * sigma:
            distances[k], _, _ = open_gap(distances[k], sigma)


@kernel
def _distances(film, vectors, place, shapes, out):
    """Compute the distance of the surfaces over the clearance at all nodes and both ends, in ``out``."""
    _to_vectors(film, vectors, place, shapes)
    node_films(film, vectors[PLACE], vectors[SHIFT], out)


@kernel
def _to_vectors(film, vectors, place, shapes):
    """Write position and shapes (or their rates) over the clearance to ``vectors``, padded with zeros."""
    per_clearance = 1.0 / film.constants[at.CLEARANCE]
    for k in range(4):
        vectors[PLACE, k] = place[k] * per_clearance
    for k in range(vectors.shape[1]):
        vectors[SHIFT, k] = 0.0
    for k in range(shapes.shape[0]):
        vectors[SHIFT, k + 1] = shapes[k] * per_clearance


@inlined_kernel
def _node_rate(film, vectors, i, line):
    """Return the rate (1/s) of the distance over the clearance at a node, from the rates in ``vectors``."""
    zeta = film.lines[line, at.ZETA]
    x, y, a, b = four(vectors[PLACE], 0)
    q = i * (int(film.constants[at.N_Z]) + 2) + line
    by_shapes = combined(film.shapes, q, vectors[SHIFT], film.shapes.shape[1])
    return by_shapes - (x + zeta * a) * film.trig[i, at.COS] - (y + zeta * b) * film.trig[i, at.SIN]


@kernel
def combined(table, row, shares, columns):
    """Return the dot product of a table's ``row`` with ``shares`` over ``columns`` entries, a multiple of eight."""
    total = load(table, (row, 0)) * load(shares, 0) + load(table, (row, LANES)) * load(shares, LANES)
    for r in range(2 * LANES, columns, LANES):
        total = total + load(table, (row, r)) * load(shares, r)
    a, b, c, d = unpack(total)
    return (a + b) + (c + d)


@kernel
def node_films(film, place, shift, out):
    """Compute the distance H of the surfaces at all nodes and both ends, in ``out`` (n_phi (n_z + 2),).

    ``place`` (4,) is position and tilt over the clearance, ``shift`` the shape amplitudes over the clearance, padded
    with zeros to the columns of ``film.shapes``.
    """
    n_phi = int(film.constants[at.N_PHI])
    lines = int(film.constants[at.N_Z]) + 2
    columns = film.shapes.shape[1]
    x, y, a, b = four(place, 0)
    for i in range(n_phi):
        cos = film.trig[i, at.COS]
        sin = film.trig[i, at.SIN]
        middle = 1.0 - x * cos - y * sin
        tilt = a * cos + b * sin
        for j in range(lines):
            total = middle - tilt * film.lines[j, at.ZETA] + film.lines[j, at.PROFILE]
            out[i * lines + j] = total + combined(film.shapes, i * lines + j, shift, columns)
