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
"""

import math
from typing import NamedTuple

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.vectors import LANES, load, splat, store, unpack
from cranktrain.film.contact.gap import open_gap
from cranktrain.film.elastic import grid as at
from cranktrain.film.elastic.content import GAINED, PREDICTED_ROOM, PREDICTED_VOID
from cranktrain.film.elastic.height import node_films


class Rates(NamedTuple):
    """Factors of the rates in the oil balance, 1/s."""

    half_speed: float  # ½ω of the journal
    per_step: float  # 1/Δt with the time Δt from the step's start to the stage
    per_gain: float  # 1/g of the stage's rule


class Flow(NamedTuple):
    """Factors of the flow through faces."""

    around: float
    across: float
    forward: float
    backward: float


@kernel
def film_start(film, place, shift, start, rates, nodes, faces):
    """Write the state at the step's start: oil θH and mask of void nodes, second-order correction of transport."""
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    lines = n_z + 2
    mass = nodes[at.START_MASS]
    was_void = nodes[at.WAS_VOID]
    extra = faces[at.FACE_EXTRA]
    void = False
    for k in range(n_phi * n_z):
        extra[k] = 0.0
        if start[k] < 0.0:
            void = True
    for k in range(n_phi * lines):
        was_void[k] = 0.0
        mass[k] = 0.0
    if not void:
        return
    node_films(film, place, shift, mass)
    for i in range(n_phi):
        for j in range(n_z):
            u = start[i * n_z + j]
            q = i * lines + j + 1
            mass[q], _, _ = open_gap(mass[q], film.constants[at.ROUGHNESS])
            if u < 0.0:
                was_void[q] = 1.0
    _sharpen(film, start, rates, mass, extra)
    for i in range(n_phi):
        for j in range(n_z):
            u = start[i * n_z + j]
            if u < 0.0:
                mass[i * lines + j + 1] *= 1.0 + u if u > -1.0 else 0.0
            else:
                mass[i * lines + j + 1] = 0.0


@kernel
def take_content(film, content, rates, nodes, faces):
    """Replace the oil and transport correction of :func:`film_start` by the content (CONTENT, n) of a stage."""
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    mass = nodes[at.START_MASS]
    room = nodes[at.OPEN]
    for f in range(n_phi * n_z):
        room[f + 2 * (f // n_z) + 1] = content[PREDICTED_ROOM, f]
        faces[at.FACE_EXTRA, f] = 0.0
    _sharpen(film, content[PREDICTED_VOID], rates, room, faces[at.FACE_EXTRA])
    for f in range(n_phi * n_z):
        mass[f + 2 * (f // n_z) + 1] += content[GAINED, f]


@kernel
def _sharpen(film, start, rates, room, extra):
    """Compute the second-order flux correction (1/s) to upwind transport, with the monotonised central limiter.

    ``start`` (n,) are voids, ``room`` mean gaps. The correction is explicit, so it does not change the matrix; it is
    zero if oil would pass more than one node in the step.
    """
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    lines = n_z + 2
    _, _, per_angle = grid_factors(film.constants)
    rate = rates.half_speed * per_angle
    if not abs(rate) < rates.per_step:
        return
    share = 2.0 - 2.0 * abs(rate) / rates.per_step
    rate *= 0.5 * share if share < 1.0 else 0.5
    for i in range(n_phi):
        down = i + 1 if i + 1 < n_phi else 0
        from_column = i if rate > 0.0 else down
        to_column = down if rate > 0.0 else i
        behind = i - 1 if rate > 0.0 else down + 1
        if behind < 0 or behind >= n_phi:
            behind = n_phi - 1 if behind < 0 else 0
        for j in range(n_z):
            donor = start[from_column * n_z + j]
            if donor >= 0.0:
                continue
            taker = start[to_column * n_z + j]
            upstream = start[behind * n_z + j]
            ahead = (taker if taker < 0.0 else 0.0) - donor
            past = donor - (upstream if upstream < 0.0 else 0.0)
            if ahead * past <= 0.0:
                continue
            change = 0.5 * (ahead + past)
            if abs(2.0 * ahead) < abs(change):
                change = 2.0 * ahead
            if abs(2.0 * past) < abs(change):
                change = 2.0 * past
            mean = 0.5 * (room[i * lines + j + 1] + room[down * lines + j + 1])
            extra[i * n_z + j] = rate * mean * change


@kernel
def film_rates(film, place, pace, known, per_gain, nodes):
    """Write to row DRIVEN the part of ∂H/∂t (1/s) that is independent of H: journal velocity, −H_Δ/g of bore shapes."""
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    driven = nodes[at.DRIVEN]
    node_films(film, place, known, driven)
    for i in range(n_phi):
        cos = film.trig[i, at.COS]
        sin = film.trig[i, at.SIN]
        middle = -pace[at.X] * cos - pace[at.Y] * sin
        tilt = pace[at.A] * cos + pace[at.B] * sin
        for j in range(1, n_z + 1):
            q = i * (n_z + 2) + j
            driven[q] = middle - tilt * film.lines[j, at.ZETA] - per_gain * driven[q]


@kernel
def grid_factors(constants):
    """Return grid factors of the balance: 1/Δφ² and (D/L)² of pressure flow around and across, 1/Δφ of transport."""
    per_angle = constants[at.N_PHI] / (2.0 * math.pi)
    ratio = 2.0 * constants[at.RADIUS] / constants[at.WIDTH]
    return per_angle * per_angle, ratio * ratio, per_angle


@kernel
def flow_factors(constants, half_speed):
    """Return the factors of the flow through faces. The factors of the flow carried by the surfaces have unit 1/s."""
    around, across, per_angle = grid_factors(constants)
    drive = half_speed * per_angle
    return Flow(around, across, max(drive, 0.0), max(-drive, 0.0))


@kernel
def oil_balance(film, rates, nodes, faces, first, band, residual):
    """Compute the residual R (n_phi n_z,) of every node's balance (1/s), the band of ∂R/∂u, and the factors of ∂R/∂H.

    Rows of the band start at the grid column ``first`` and follow the sense of rotation once around. The entries that
    couple the last column with the first are stored where the band would continue, and band solvers do not read them.
    ``rates`` is a :class:`Rates`.
    """
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    flow = flow_factors(film.constants, rates.half_speed)
    for i in range(n_phi):
        down = i + 1 if i + 1 < n_phi else 0
        if film.constants[at.COMPRESSIBLE] > 0.0:
            for j in range(n_z):
                h = faces[at.FACE_OPEN, i * n_z + j]
                q = i * (n_z + 2) + j + 1
                ahead = compression_ahead(film, flow, nodes, h, q, down * (n_z + 2) + j + 1)
                faces[at.FACE_AHEAD, i * n_z + j] = ahead
        _face_flows(film, flow, i, down, nodes, faces)
    for position in range(n_phi):
        i = first + position
        if i >= n_phi:
            i -= n_phi
        # The last group of four lines may overlap the group before; the overlap is computed twice.
        for line in range(0, n_z, LANES):
            where = (i, min(line, n_z - LANES), position)
            _four_balances(film, rates, flow, where, nodes, faces, band, residual)


@inlined_kernel
def _face_flows(film, flow, i, down, nodes, faces):
    """Compute the flow (1/s) from column ``i`` to the next one, and its derivative by the distance of the surfaces."""
    n_z = int(film.constants[at.N_Z])
    q = i * (n_z + 2) + 1
    q_down = down * (n_z + 2) + 1
    up = q if flow.forward > 0.0 else q_down
    beyond = q_down if flow.forward > 0.0 else q
    drive = flow.forward - flow.backward
    for line in range(0, n_z, LANES):
        j = min(line, n_z - LANES)
        f = i * n_z + j
        h = load(faces, (at.FACE_OPEN, f))
        area = flow.around * (h * h)
        drop = load(nodes, (at.REDUCED, q + j)) - load(nodes, (at.REDUCED, q_down + j))
        held = load(nodes, (at.COMPRESSED, up + j))
        ahead = load(faces, (at.FACE_AHEAD, f)) * (load(nodes, (at.COMPRESSED, beyond + j)) - held)
        content = drive * (splat(1.0) + load(nodes, (at.VOID, up + j)) + held + ahead)
        pressed = area * drop
        store(faces, (at.FACE_FLOW, f), h * (pressed + content) + load(faces, (at.FACE_EXTRA, f)))
        store(faces, (at.FACE_FLUX, f), load(faces, (at.FACE_SLOPE, f)) * (3.0 * pressed + content))


@inlined_kernel
def _four_balances(film, rates, flow, where, nodes, faces, band, residual):
    """Compute the residual, factors of ∂R/∂H and band rows of four axially neighbouring nodes.

    ``where`` is the column, the first line, and the position of the column in the band. Masks of 0 and 1 replace
    branches for nodes that were void, are full, or have supply pressure.
    """
    i, j, position = where
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    i_up = i - 1 if i > 0 else n_phi - 1
    i_down = i + 1 if i + 1 < n_phi else 0
    f = i * n_z + j
    f_up = i_up * n_z + j
    q = i * (n_z + 2) + j + 1
    q_up = i_up * (n_z + 2) + j + 1
    q_down = i_down * (n_z + 2) + j + 1
    one = splat(1.0)
    free = one - load(film.supply, f)
    # Flow across the bore, and its derivatives by the distance of the surfaces.
    is_open = load(nodes, (at.OPEN, q))
    p = load(nodes, (at.REDUCED, q))
    per_after = flow.across * load(film.sides, (at.AFTER_SIDE, j + 1))
    per_before = flow.across * load(film.sides, (at.BEFORE_SIDE, j + 1))
    after, by_own, by_after = side_conductance(is_open, load(nodes, (at.OPEN, q + 1)))
    before, by_own_too, by_before = side_conductance(is_open, load(nodes, (at.OPEN, q - 1)))
    after = per_after * after
    before = per_before * before
    to_after = p - load(nodes, (at.REDUCED, q + 1))
    to_before = p - load(nodes, (at.REDUCED, q - 1))
    total = load(faces, (at.FACE_FLOW, f)) - load(faces, (at.FACE_FLOW, f_up)) + (after * to_after + before * to_before)
    to_after = per_after * to_after
    to_before = per_before * to_before
    slope = load(nodes, (at.SLOPE, q))
    own = slope * (to_after * by_own + to_before * by_own_too)
    store(nodes, (at.AFTER, q), free * (to_after * by_after * load(nodes, (at.SLOPE, q + 1))))
    store(nodes, (at.BEFORE, q), free * (to_before * by_before * load(nodes, (at.SLOPE, q - 1))))
    # Growth of the oil stored in a node; the formula depends on whether the node was void at the step's start.
    void = load(nodes, (at.VOID, q))
    dense = load(nodes, (at.DENSE, q))
    held = one + load(nodes, (at.COMPRESSED, q))
    was_void = load(nodes, (at.WAS_VOID, q))
    was_full = one - was_void
    storing = rates.per_step * is_open
    growth = was_full * (load(nodes, (at.DRIVEN, q)) + rates.per_gain * load(nodes, (at.FILM, q)))
    gained = void + load(nodes, (at.COMPRESSED, q)) - load(nodes, (at.START_COMPRESSED, q))
    kept = was_void * (held + void) + was_full * gained
    total = total + (slope * held * growth + kept * storing - rates.per_step * load(nodes, (at.START_MASS, q)))
    own = own + (load(nodes, (at.BEND, q)) * held * growth + rates.per_step * (kept * slope))
    store(nodes, (at.OWN, q), free * own)
    store(nodes, (at.SQUEEZE, q), free * (was_full * (slope * held)))
    store(residual, f, free * total)
    # Derivatives of the balance by the unknown of the node and by the unknowns of its neighbours.
    h = load(faces, (at.FACE_OPEN, f))
    h_up = load(faces, (at.FACE_OPEN, f_up))
    ahead = load(faces, (at.FACE_AHEAD, f))
    ahead_up = load(faces, (at.FACE_AHEAD, f_up))
    g = flow.around * (h * h * h)
    g_up = flow.around * (h_up * h_up * h_up)
    full = load(nodes, (at.FULL, q))
    mobility = load(nodes, (at.MOBILITY, q))
    out = h * (flow.forward * (one - ahead) - flow.backward * ahead)
    into = h_up * (flow.forward * ahead_up - flow.backward * (one - ahead_up))
    answer = (g + g_up + (after + before)) * mobility + (out - into + storing) * dense
    swelling = free * full * (slope * growth * dense)
    answer = full * answer + (one - full) * (storing + flow.forward * h + flow.backward * h_up)
    answer = free * answer + (one - free)
    full = load(nodes, (at.FULL, q_up))
    into = flow.forward * (one - ahead_up) - flow.backward * ahead_up
    into = g_up * load(nodes, (at.MOBILITY, q_up)) + h_up * into * load(nodes, (at.DENSE, q_up))
    by_up = free * (full * into + (one - full) * (flow.forward * h_up))
    full = load(nodes, (at.FULL, q_down))
    out = flow.forward * ahead - flow.backward * (one - ahead)
    out = g * load(nodes, (at.MOBILITY, q_down)) - h * out * load(nodes, (at.DENSE, q_down))
    by_down = free * (full * out + (one - full) * (flow.backward * h))
    before = free * (before * load(nodes, (at.MOBILITY, q - 1)) * load(nodes, (at.FULL, q - 1)))
    after = free * (after * load(nodes, (at.MOBILITY, q + 1)) * load(nodes, (at.FULL, q + 1)))
    rows = (unpack(answer), unpack(swelling), unpack(by_up), unpack(before), unpack(after), unpack(by_down))
    _put_rows(band, position * n_z + j, j, n_z, rows)


@inlined_kernel
def _put_rows(band, row, j, n_z, entries):
    """Write four rows of the band: diagonal entries with their terms of compression, and entries of the neighbours."""
    answer, swelling, by_up, before, after, by_down = entries
    for k in range(LANES):
        own = band[row + k]
        for column in range(0, own.shape[0] - LANES, LANES):
            store(own, column, splat(0.0))
        store(own, own.shape[0] - LANES, splat(0.0))
        # Compression in a closing film reduces the diagonal; the limit keeps it positive far from the solution.
        own[n_z] = answer[k] + max(swelling[k], -0.5 * answer[k])
        own[0] = -by_up[k]
        own[2 * n_z] = -by_down[k]
        if j + k > 0:
            own[n_z - 1] = -before[k]
        if j + k < n_z - 1:
            own[n_z + 1] = -after[k]


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


@kernel
def carried(flow, nodes, ahead, q, q_down):
    """Return the flow carried by the surfaces from node q to ``q_down``, over the film of the face, 1/s.

    Voids are those of the upstream node. Compression is a weighted mean of both nodes; ``ahead`` is the weight of the
    downstream node, 0 without compression.
    """
    up = q if flow.forward > 0.0 else q_down
    content = 1.0 + nodes[at.VOID, up]
    if ahead > 0.0:
        down = q_down if flow.forward > 0.0 else q
        content += nodes[at.COMPRESSED, up] + ahead * (nodes[at.COMPRESSED, down] - nodes[at.COMPRESSED, up])
    return (flow.forward - flow.backward) * content


@kernel
def compression_ahead(film, flow, nodes, h, q, q_down):
    """Return the weight of the downstream node's compression in the flow carried through a face of film ``h``.

    The weight is a half (second order) as long as pressure drives more flow through the face than compression carries,
    and less beyond, so that the matrix keeps its signs.
    """
    if film.constants[at.COMPRESSIBLE] == 0.0:
        return 0.0
    k = q_down if flow.forward > 0.0 else q
    pressed = flow.around * h * h * nodes[at.MOBILITY, k]
    compressed = (flow.forward + flow.backward) * nodes[at.DENSE, k]
    return pressed / compressed if 0.5 * compressed > pressed else 0.5
