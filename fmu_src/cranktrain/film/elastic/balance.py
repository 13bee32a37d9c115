"""Oil balance at the nodes of a film that ruptures and refills, with its derivatives.

Each node has one unknown u. u ≥ 0 is the pressure of a full film, P = p₀ u with p₀ = 12 η (R/c)². u < 0 is minus the
void fraction of a ruptured film, which has the fill θ = 1 + u and zero pressure (Jakobsson–Floberg–Olsson by
complementarity). With H = h/c, journal speed ω and a bore at rest, the balance of each node is

    ∂(θH)/∂t + ∂φ(½ω θH − H³ ∂φΠ) − (D/L)² ∂ζ(H³ ∂ζΠ) = 0        (1/s)

on node-centred finite volumes. H³ is taken at the middle of circumferential faces, and as that of a wedge between axial
neighbours. θ is that of the upstream node, with a limited second-order correction from the step's start. Pressure flow
into a ruptured node comes from its full neighbours only. The rate has two forms, by the state at the step's start:

* full: ∂H/∂t from the velocities of the stage, minus the growth of the void, [uH − (uH)_Δ]/g;
* void: [θH − (θH)_Δ]/g.

g and the parts Δ, known from earlier stages, are those of the integrator's stage
(:mod:`cranktrain.film.elastic.content`). Without staged oil, Δ is the start of the step and g the time since then
(backward Euler).

For oil that depends on pressure, Π is the reduced pressure, and θ of a full node is ρ/ρ₀
(:mod:`cranktrain.film.elastic.oil`). Compressible oil uses backward Euler from the start of the step, without stages.

With backward Euler the fill lies in [0, 1] at any step, because it is a mean of the previous fill and the inflow. H is
the mean gap of rough surfaces, :mod:`cranktrain.film.contact.gap`. A journal displaced beyond its bore still has a
small gap; its load is carried by contact. The matrix ∂R/∂u is an M-matrix by columns.

Masks of 0 and 1 replace branches for nodes that were void, are full, or have supply pressure.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.side_by_side import choose, get, lane_count, most_of, put, spread
from cranktrain.film.elastic import grid as one
from cranktrain.film.elastic import workspace as at


@kernel
def pressure_unit(constants):
    """Return the pressure unit p₀ = 12 η (R/c)² (Pa s)."""
    return 12.0 * constants[one.VISCOSITY] * (constants[one.RADIUS] / constants[one.CLEARANCE]) ** 2


@kernel
def grid_factors(constants):
    """Return grid factors of the balance: 1/Δφ² and (D/L)² of pressure flow around and across, 1/Δφ of transport."""
    per_angle = constants[one.N_PHI] / (2.0 * math.pi)
    ratio = 2.0 * constants[one.RADIUS] / constants[one.WIDTH]
    return per_angle * per_angle, ratio * ratio, per_angle


@kernel
def oil_balance(film, work, group, width, per_step):
    """Compute minus the residual of every node as right-hand side 0, the band of ∂R/∂u, and the factors of ∂R/∂H.

    ``width`` is the half width of the band; entries outside it, which couple the ends of a cut ring, are left out.
    ``per_step`` is 1/Δt with the time Δt over which voids change, 1/s.
    """
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    around, across, _ = grid_factors(film.constants)
    thickens = film.constants[one.OIL_STEP] > 0.0
    compressible = film.constants[one.COMPRESSIBLE] > 0.0
    for position in range(n_phi):
        _face_flows(work, group, position, n_phi, n_z, around, thickens, compressible)
    for position in range(n_phi):
        _column(work, group, position, n_phi, n_z, width, (around, across, per_step), thickens, compressible)


@inlined_kernel
def _face_flows(work, group, position, n_phi, n_z, around, thickens, compressible):
    """Compute the flow (1/s) from a column to the next, and its derivative by the distance of the surfaces at faces."""
    nodes = work.nodes[group]
    faces = work.faces[group]
    forward = get(work.lane, at.FORWARD)
    backward = get(work.lane, at.BACKWARD)
    q = position * (n_z + 2) + 1
    q_down = (position + 1 if position + 1 < n_phi else 0) * (n_z + 2) + 1
    potential = at.REDUCED if thickens else at.PRESSURE
    for j in range(n_z):
        f = position * n_z + j
        h = get(faces, (at.FACE_OPEN, f))
        drop = get(nodes, (potential, q + j)) - get(nodes, (potential, q_down + j))
        content = forward * (1.0 + get(nodes, (at.VOID, q + j)))
        content = content - backward * (1.0 + get(nodes, (at.VOID, q_down + j)))
        pressed = around * (h * h) * drop
        if lane_count(nodes) == 1 and compressible:
            ahead = _compression_ahead(nodes, forward, backward, around * h * h, q + j, q_down + j)
            put(faces, (at.FACE_AHEAD, f), ahead)
            content = content + compression_carried(nodes, forward, backward, ahead, q + j, q_down + j)
        put(faces, (at.FACE_FLOW, f), h * (pressed + content) + get(faces, (at.FACE_EXTRA, f)))
        put(faces, (at.FACE_FLUX, f), get(faces, (at.FACE_SLOPE, f)) * (3.0 * pressed + content))


@inlined_kernel
def _column(work, group, position, n_phi, n_z, width, factors, thickens, compressible):
    """Compute the residual, the factors of ∂R/∂H and the band rows of one column."""
    around, across, per_step = factors
    nodes = work.nodes[group]
    faces = work.faces[group]
    band = work.band
    lines = n_z + 2
    up = position - 1 if position > 0 else n_phi - 1
    down = position + 1 if position + 1 < n_phi else 0
    at_row = work.rows[position] * n_z
    to_up = width + work.rows[up] * n_z - at_row
    to_down = width + work.rows[down] * n_z - at_row
    forward = get(work.lane, at.FORWARD)
    backward = get(work.lane, at.BACKWARD)
    first = position * lines
    q_up = up * lines
    q_down = down * lines
    potential = at.REDUCED if thickens else at.PRESSURE
    own_open = get(nodes, (at.OPEN, first + 1))
    last, by_own_last, by_last = side_conductance(own_open, get(nodes, (at.OPEN, first)))
    p_before = get(nodes, (potential, first))
    p = get(nodes, (potential, first + 1))
    for line in range(1, n_z + 1):
        q = first + line
        f = position * n_z + line - 1
        f_up = up * n_z + line - 1
        row = at_row + line - 1
        free = 1.0 - get(work.supply[group], f)
        full = get(nodes, (at.FULL, q))
        # Flow across the bore, and its derivatives by the distance of the surfaces.
        next_open = get(nodes, (at.OPEN, q + 1))
        p_after = get(nodes, (potential, q + 1))
        over, by_own, by_next = side_conductance(own_open, next_open)
        per_after = spread(across * work.lines[line, at.AFTER_SIDE], nodes)
        per_before = spread(across * work.lines[line, at.BEFORE_SIDE], nodes)
        after = per_after * over
        before = per_before * last
        to_after = p - p_after
        to_before = p - p_before
        flow = get(faces, (at.FACE_FLOW, f)) - get(faces, (at.FACE_FLOW, f_up))
        flow = flow + (after * to_after + before * to_before)
        to_after = per_after * to_after
        to_before = per_before * to_before
        slope = get(nodes, (at.SLOPE, q))
        own = slope * (to_after * by_own + to_before * by_own_last)
        put(nodes, (at.AFTER, q), free * (to_after * by_next * get(nodes, (at.SLOPE, q + 1))))
        put(nodes, (at.BEFORE, q), free * (to_before * by_last * get(nodes, (at.SLOPE, q - 1))))
        # Growth of the oil stored in a node; the formula depends on whether the node was void at the step's start.
        void = get(nodes, (at.VOID, q))
        was_void = get(nodes, (at.WAS_VOID, q))
        was_full = 1.0 - was_void
        growth = was_full * get(nodes, (at.GROWTH, q))
        kept = was_void + void
        squeeze = was_full * slope
        if lane_count(nodes) == 1 and compressible:
            dense = get(nodes, (at.COMPRESSED, q))
            kept = kept + (dense - was_full * get(nodes, (at.START_COMPRESSED, q)))
            growth = (1.0 + dense) * growth
            squeeze = (1.0 + dense) * squeeze
        flow = flow + (slope * growth + per_step * (kept * own_open - get(nodes, (at.MASS, q))))
        own = own + (get(nodes, (at.BEND, q)) * growth + per_step * (kept * slope))
        put(nodes, (at.OWN, q), free * own)
        put(nodes, (at.SQUEEZE, q), free * squeeze)
        put(work.columns, (row, 0), 0.0 - free * flow)
        # Derivatives of the balance by the unknown of the node and by the unknowns of its neighbours.
        h = get(faces, (at.FACE_OPEN, f))
        h_up = get(faces, (at.FACE_OPEN, f_up))
        g = around * (h * h * h)
        g_up = around * (h_up * h_up * h_up)
        pressing = g + g_up + (after + before)
        by_up = g_up
        by_down = g
        by_before = before
        by_after = after
        if thickens:
            pressing = pressing * get(nodes, (at.MOBILITY, q))
            by_up = by_up * get(nodes, (at.MOBILITY, q_up + line))
            by_down = by_down * get(nodes, (at.MOBILITY, q_down + line))
            by_before = by_before * get(nodes, (at.MOBILITY, q - 1))
            by_after = by_after * get(nodes, (at.MOBILITY, q + 1))
        if lane_count(nodes) == 1 and compressible:
            dense = get(nodes, (at.DENSE, q))
            ahead = get(faces, (at.FACE_AHEAD, f))
            ahead_up = get(faces, (at.FACE_AHEAD, f_up))
            out = h * (forward * (1.0 - ahead) - backward * ahead)
            into = h_up * (forward * ahead_up - backward * (1.0 - ahead_up))
            pressing = pressing + (out - into + per_step * own_open) * dense
            # Compression in a closing film reduces the diagonal; the limit keeps it positive far from the solution.
            swelling = slope * (was_full * get(nodes, (at.GROWTH, q))) * dense
            pressing = pressing + most_of(swelling, -0.5 * pressing)
            into = h_up * (forward * (1.0 - ahead_up) - backward * ahead_up)
            by_up = by_up + into * get(nodes, (at.DENSE, q_up + line))
            out = h * (forward * ahead - backward * (1.0 - ahead))
            by_down = by_down - out * get(nodes, (at.DENSE, q_down + line))
        emptying = per_step * own_open + forward * h + backward * h_up
        answer = full * pressing + (1.0 - full) * emptying
        answer = free * answer + (1.0 - free)
        beside = get(nodes, (at.FULL, q_up + line))
        by_up = free * (beside * by_up + (1.0 - beside) * (forward * h_up))
        beside = get(nodes, (at.FULL, q_down + line))
        by_down = free * (beside * by_down + (1.0 - beside) * (backward * h))
        for column in range(2 * width + 1):
            put(band, (row, column), spread(0.0, nodes))
        put(band, (row, width), answer)
        if 0 <= to_up <= 2 * width:
            put(band, (row, to_up), 0.0 - by_up)
        if 0 <= to_down <= 2 * width:
            put(band, (row, to_down), 0.0 - by_down)
        if line > 1:
            put(band, (row, width - 1), 0.0 - free * (by_before * get(nodes, (at.FULL, q - 1))))
        if line < n_z:
            put(band, (row, width + 1), 0.0 - free * (by_after * get(nodes, (at.FULL, q + 1))))
        last = over
        by_own_last = by_next
        by_last = by_own
        own_open = next_open
        p_before = p
        p = p_after


@inlined_kernel
def side_conductance(h, beside):
    """Return the conductance H³ between two axial neighbours and its derivatives, exact for H linear between them.

    At relieved edges the gap changes by several least gaps from line to line, where the cube of the mean gap would be
    half as much again.
    """
    product = h * beside
    per_sum = 1.0 / (h + beside)
    twice = 4.0 * product * per_sum
    value = 0.5 * twice * product
    common = value * per_sum
    return value, twice * beside - common, twice * h - common


@inlined_kernel
def compression_carried(nodes, forward, backward, ahead, q, q_down):
    """Return the additional content, 1/s, that compression adds to the flow carried from node q to ``q_down``.

    Compression is a weighted mean of both nodes; ``ahead`` is the weight of the downstream node.
    """
    here = get(nodes, (at.COMPRESSED, q))
    rise = get(nodes, (at.COMPRESSED, q_down)) - here
    return forward * (here + ahead * rise) - backward * (here + (1.0 - ahead) * rise)


@inlined_kernel
def _compression_ahead(nodes, forward, backward, area, q, q_down):
    """Return the weight of the downstream node's compression in the flow carried through a face of H²/Δφ² ``area``.

    The weight is a half (second order) as long as pressure drives more flow through the face than compression carries,
    and less beyond, so that the matrix keeps its signs.
    """
    ahead = forward > 0.0
    mobile = choose(ahead, get(nodes, (at.MOBILITY, q_down)), get(nodes, (at.MOBILITY, q)))
    dense = choose(ahead, get(nodes, (at.DENSE, q_down)), get(nodes, (at.DENSE, q)))
    pressed = area * mobile
    compressed = (forward + backward) * dense
    less = 0.5 * compressed > pressed
    return choose(less, pressed / choose(less, compressed, 1.0), 0.5)


@kernel
def take_sides(film, work, group, unknowns):
    """Compute pressure and void fraction of nodes from ``unknowns`` (b, N n), except of lanes marked RESIDENT."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    lanes = lane_count(work.nodes)
    nodes = work.nodes[group]
    for lane in range(lanes):
        resident = work.marks[group, lane, at.RESIDENT]
        work.lane[lanes * at.DONE + lane] = resident
        if resident > 0.0:
            continue
        cut = int(work.marks[group, lane, at.CUT])
        mine = unknowns[int(work.own[lane])]
        for position in range(n_phi):
            i = (cut + position) % n_phi
            for j in range(n_z):
                u = mine[i * n_z + j]
                nodes[at.CHANGE, lanes * (position * lines + j + 1) + lane] = u
    resident = get(work.lane, at.DONE) > 0.0
    supply = get(work.lane, at.SUPPLY)
    none = spread(0.0, nodes)
    one_ = spread(1.0, nodes)
    for position in range(n_phi):
        for line in range(lines):
            q = position * lines + line
            if line == 0 or line == lines - 1:
                put(nodes, (at.FULL, q), one_)
                put(nodes, (at.PRESSURE, q), none)
                put(nodes, (at.VOID, q), none)
                continue
            held = get(work.supply[group], position * n_z + line - 1) > 0.0
            u = choose(held, supply, get(nodes, (at.CHANGE, q)))
            full = u >= 0.0
            full_value = choose(full, one_, none)
            put(nodes, (at.FULL, q), choose(resident, get(nodes, (at.FULL, q)), full_value))
            put(nodes, (at.PRESSURE, q), choose(resident, get(nodes, (at.PRESSURE, q)), most_of(u, none)))
            put(nodes, (at.VOID, q), choose(resident, get(nodes, (at.VOID, q)), choose(full, none, u)))
