"""Balance of oil at the nodes of a film that ruptures and refills, with its derivatives.

One unknown u per node: u ≥ 0 is the pressure of a full film, P = p₀ u with p₀ = 12 η (R/c)²; u < 0 is minus the void
share of a ruptured one, so that its fill is θ = 1 + u and its pressure zero (Jakobsson–Floberg–Olsson by
complementarity). With H = h/c and ω the journal's speed, the bore at rest, each node balances

    ∂(θH)/∂t + ∂φ(½ω θH − H³ ∂φΠ) − (D/L)² ∂ζ(H³ ∂ζΠ) = 0        (1/s)

on node-centred finite volumes: H³ at the middle of faces, θ from the node upstream with a limited correction to second
order from the step's start, no pressure flow into ruptured nodes but what their full neighbours press there. The rate
has two forms, after what the node was at the step's start:

* full: ∂H/∂t from the velocities of the stage, minus the void share's growth, − |u| H/Δt. A full film thus keeps the
  order of the stage's own rule;
* void: [θH − (θH)_start]/Δt, backward Euler from the start. The oil of ruptured regions is conserved to rounding.

Under pressure Π is the reduced pressure and θ of a full node its ρ/ρ₀ (:mod:`cranktrain.film.elastic.oil`), which grows
by backward Euler from the start of the step.

The fill then lies in [0, 1] by itself: it is a mean of what was there and what flows in. H stands for the mean gap of
rough surfaces, :mod:`cranktrain.film.contact.gap`: a journal beyond its bore leaves it open a little, what carries
there is contact. The matrix ∂R/∂u is an M-matrix by columns.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from cranktrain.core.kernel import kernel
from cranktrain.core.vectors import LANES, splat, store
from cranktrain.film.contact.gap import open_gap
from cranktrain.film.elastic.grid import (
    AFTER,
    BEFORE,
    BEND,
    COMPRESSED,
    COMPRESSIBLE,
    COS,
    DENSE,
    DRIVEN,
    FACE_EXTRA,
    FACE_FLUX,
    FACE_OPEN,
    FACE_SLOPE,
    FILM,
    FULL,
    MOBILITY,
    N_PHI,
    N_Z,
    OPEN,
    OWN,
    PER_AFTER,
    PER_BEFORE,
    RADIUS,
    REDUCED,
    ROUGHNESS,
    SIN,
    SLOPE,
    SQUEEZE,
    START_COMPRESSED,
    START_MASS,
    VOID,
    WAS_VOID,
    WIDTH,
    ZETA,
    A,
    B,
    X,
    Y,
)
from cranktrain.film.elastic.height import node_films


class Rates(NamedTuple):
    """What turns time into the balance's rates, 1/s."""

    half_speed: float  # ½ω of the journal
    per_step: float  # 1/Δt, Δt from the step's start to the stage
    per_gain: float  # 1/g of the stage's rule


class Flow(NamedTuple):
    """Factors of the flow through faces."""

    around: float
    across: float
    forward: float
    backward: float


class Node(NamedTuple):
    """Numbers of a node, of the face behind it and of its neighbours around."""

    f: int
    f_up: int
    q: int
    q_up: int
    q_down: int
    line: int


@kernel
def film_start(film, place, shift, start, rates, nodes, faces):
    """What the step starts from: oil θH of void nodes, which they are, and how sharply their oil is carried on."""
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    lines = n_z + 2
    mass = nodes[START_MASS]
    was_void = nodes[WAS_VOID]
    extra = faces[FACE_EXTRA]
    void = False
    for k in range(n_phi * n_z):
        extra[k] = 0.0
        if start[k] < 0.0:
            void = True
    for k in range(n_phi * lines):
        was_void[k] = 0.0
    if not void:
        return
    node_films(film, place, shift, mass)
    for i in range(n_phi):
        for j in range(n_z):
            u = start[i * n_z + j]
            q = i * lines + j + 1
            mass[q], _, _ = open_gap(mass[q], film.constants[ROUGHNESS])
            if u < 0.0:
                was_void[q] = 1.0
    _sharpen(film, start, rates, nodes, extra)
    for i in range(n_phi):
        for j in range(n_z):
            u = start[i * n_z + j]
            if u < 0.0:
                mass[i * lines + j + 1] *= 1.0 + u if u > -1.0 else 0.0


@kernel
def _sharpen(film, start, rates, nodes, extra):
    """Flux (1/s) that upwinding loses at the start of the step: second order, limited (monotonised central).

    Explicit, hence bounded and without influence on the matrix, as long as oil passes less than a node in the step.
    """
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    lines = n_z + 2
    _, _, per_angle = grid_factors(film.constants)
    rate = rates.half_speed * per_angle
    if not abs(rate) < rates.per_step:
        return
    share = 2.0 - 2.0 * abs(rate) / rates.per_step
    rate *= 0.5 * share if share < 1.0 else 0.5
    mass = nodes[START_MASS]
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
            mean = 0.5 * (mass[i * lines + j + 1] + mass[down * lines + j + 1])
            extra[i * n_z + j] = rate * mean * change


@kernel
def film_rates(film, place, pace, known, per_gain, nodes):
    """What ∂H/∂t (1/s) of nodes full at the start is besides H/g into DRIVEN: the journal's part, and −H_Δ/g."""
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    driven = nodes[DRIVEN]
    node_films(film, place, known, driven)
    for i in range(n_phi):
        cos = film.trig[i, COS]
        sin = film.trig[i, SIN]
        middle = -pace[X] * cos - pace[Y] * sin
        tilt = pace[A] * cos + pace[B] * sin
        for j in range(1, n_z + 1):
            q = i * (n_z + 2) + j
            driven[q] = middle - tilt * film.lines[j, ZETA] - per_gain * driven[q]


@kernel
def grid_factors(constants):
    """Factors of the balance: 1/Δφ² of pressure flow around, (D/L)² across, 1/Δφ of transport."""
    per_angle = constants[N_PHI] / (2.0 * math.pi)
    ratio = 2.0 * constants[RADIUS] / constants[WIDTH]
    return per_angle * per_angle, ratio * ratio, per_angle


@kernel
def flow_factors(constants, half_speed):
    """Factors of the flow through faces, 1/s those of what the surfaces carry."""
    around, across, per_angle = grid_factors(constants)
    drive = half_speed * per_angle
    return Flow(around, across, max(drive, 0.0), max(-drive, 0.0))


@kernel
def oil_balance(film, rates, nodes, faces, first, band, residual):
    """Residual R (n_phi n_z,) of every node's balance (1/s), the band of ∂R/∂u, and the factors of ∂R/∂H.

    The band's rows start at column ``first`` and go once around: columns of the grid follow each other in the sense of
    rotation. What couples the last column and the first stands where the band would go on, and no solver reads it.
    ``rates`` is a :class:`Rates`.
    """
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    lines = n_z + 2
    flow = flow_factors(film.constants, rates.half_speed)
    for position in range(n_phi):
        i = first + position
        if i >= n_phi:
            i -= n_phi
        up = i - 1 if i > 0 else n_phi - 1
        down = i + 1 if i + 1 < n_phi else 0
        for j in range(n_z):
            at = Node(i * n_z + j, up * n_z + j, i * lines + j + 1, up * lines + j + 1, down * lines + j + 1, j)
            row = band[position * n_z + j]
            for k in range(0, band.shape[1] - LANES, LANES):
                store(row, k, splat(0.0))
            store(row, band.shape[1] - LANES, splat(0.0))
            faces[FACE_FLUX, at.f] = _face_change(film, flow, at, nodes, faces)
            if film.supply[at.f] > 0.0:
                row[n_z] = 1.0
                residual[at.f] = 0.0
                nodes[OWN, at.q] = 0.0
                nodes[AFTER, at.q] = 0.0
                nodes[BEFORE, at.q] = 0.0
                nodes[SQUEEZE, at.q] = 0.0
            else:
                residual[at.f] = _node_balance(film, rates, flow, at, nodes, faces, row)


@kernel
def _node_balance(film, rates, flow, at, nodes, faces, row):
    """Residual of one node's balance; its factors of ∂R/∂H into ``nodes``, and its ``row`` of the band."""
    q = at.q
    j = at.line
    n_z = int(film.constants[N_Z])
    is_open = nodes[OPEN]
    slope = nodes[SLOPE]
    reduced = nodes[REDUCED]
    mobility = nodes[MOBILITY]
    void = nodes[VOID]
    full = nodes[FULL]
    forward = flow.forward
    backward = flow.backward
    h = faces[FACE_OPEN, at.f]
    h_up = faces[FACE_OPEN, at.f_up]
    g = flow.around * h * h * h
    g_up = flow.around * h_up * h_up * h_up
    mean = 0.5 * (is_open[q] + is_open[q + 1])
    mean_before = 0.5 * (is_open[q] + is_open[q - 1])
    by_after = flow.across * film.lines[j + 1, PER_AFTER] * mean * mean
    by_before = flow.across * film.lines[j + 1, PER_BEFORE] * mean_before * mean_before
    side = by_after * mean
    side_before = by_before * mean_before
    p = reduced[q]
    u = void[q]
    dense = nodes[DENSE]
    held = 1.0 + nodes[COMPRESSED, q]
    ahead = compression_ahead(film, flow, nodes, h, q, at.q_down)
    ahead_up = compression_ahead(film, flow, nodes, h_up, at.q_up, q)
    after = p - reduced[q + 1]
    before = p - reduced[q - 1]
    total = (
        g * (p - reduced[at.q_down]) + h * carried(flow, nodes, ahead, q, at.q_down)
        + g_up * (p - reduced[at.q_up]) - h_up * carried(flow, nodes, ahead_up, at.q_up, q)
        + side * after + side_before * before + faces[FACE_EXTRA, at.f] - faces[FACE_EXTRA, at.f_up]
    )  # fmt: skip
    by_after *= 1.5 * after
    by_before *= 1.5 * before
    own = slope[q] * (by_after + by_before)
    storing = is_open[q] * rates.per_step
    swelling = 0.0
    if nodes[WAS_VOID, q] > 0.0:
        total += ((held + u) * is_open[q] - nodes[START_MASS, q]) * rates.per_step
        own += (held + u) * slope[q] * rates.per_step
        nodes[SQUEEZE, q] = 0.0
    else:
        growth = nodes[DRIVEN, q] + rates.per_gain * nodes[FILM, q]
        gained = u + nodes[COMPRESSED, q] - nodes[START_COMPRESSED, q]
        total += slope[q] * held * growth + gained * storing
        own += nodes[BEND, q] * held * growth + gained * slope[q] * rates.per_step
        nodes[SQUEEZE, q] = slope[q] * held
        swelling = slope[q] * growth * dense[q]
    nodes[OWN, q] = own
    nodes[AFTER, q] = by_after * slope[q + 1]
    nodes[BEFORE, q] = by_before * slope[q - 1]
    if full[q] > 0.0:
        out = h * (forward * (1.0 - ahead) - backward * ahead)
        into = h_up * (forward * ahead_up - backward * (1.0 - ahead_up))
        answer = (g + g_up + side + side_before) * mobility[q] + (out - into + storing) * dense[q]
        # Denser oil in a closing film weakens the answer; far from the solution it must not turn it.
        row[n_z] = answer + max(swelling, -0.5 * answer)
    else:
        row[n_z] = storing + forward * h + backward * h_up
    if j > 0 and full[q - 1] > 0.0:
        row[n_z - 1] = -side_before * mobility[q - 1]
    if j < n_z - 1 and full[q + 1] > 0.0:
        row[n_z + 1] = -side * mobility[q + 1]
    row[0] = -forward * h_up
    if full[at.q_up] > 0.0:
        into = forward * (1.0 - ahead_up) - backward * ahead_up
        row[0] = -g_up * mobility[at.q_up] - h_up * into * dense[at.q_up]
    row[2 * n_z] = -backward * h
    if full[at.q_down] > 0.0:
        out = forward * ahead - backward * (1.0 - ahead)
        row[2 * n_z] = -g * mobility[at.q_down] + h * out * dense[at.q_down]
    return total


@kernel
def carried(flow, nodes, ahead, q, q_down):
    """What the surfaces carry from node q to ``q_down`` over the face's film, 1/s: voids of the node upstream.

    Compression is that of both, in the share ``ahead`` of the node downstream, which is 0 where there is none.
    """
    up = q if flow.forward > 0.0 else q_down
    content = 1.0 + nodes[VOID, up]
    if ahead > 0.0:
        down = q_down if flow.forward > 0.0 else q
        content += nodes[COMPRESSED, up] + ahead * (nodes[COMPRESSED, down] - nodes[COMPRESSED, up])
    return (flow.forward - flow.backward) * content


@kernel
def compression_ahead(film, flow, nodes, h, q, q_down):
    """Share of the compression downstream in what is carried through the face of film ``h`` between two nodes.

    A half, of second order, as long as pressure drives more through the face than compression does; less beyond, so
    that the matrix keeps its signs.
    """
    if film.constants[COMPRESSIBLE] == 0.0:
        return 0.0
    k = q_down if flow.forward > 0.0 else q
    pressed = flow.around * h * h * nodes[MOBILITY, k]
    compressed = (flow.forward + flow.backward) * nodes[DENSE, k]
    return pressed / compressed if 0.5 * compressed > pressed else 0.5


@kernel
def _face_change(film, flow, at, nodes, faces):
    """Derivative of the flux through the face behind a node by the distance of the surfaces there."""
    h = faces[FACE_OPEN, at.f]
    ahead = compression_ahead(film, flow, nodes, h, at.q, at.q_down)
    driven = carried(flow, nodes, ahead, at.q, at.q_down)
    pressed = 3.0 * flow.around * h * h * (nodes[REDUCED, at.q] - nodes[REDUCED, at.q_down])
    return faces[FACE_SLOPE, at.f] * (pressed + driven)
