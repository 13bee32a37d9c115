"""Elasto-hydrodynamic film in the loop: mass-conserving Reynolds' equation coupled with the elastic bore.

The film h = c − (x + ζa) cos φ − (y + ζb) sin φ + Σ_k δ_k S_k(φ, ζ) follows the journal and a few shapes of the bore
(those of an elastic journal add to the same compliance). Shapes yield to film and contact pressure together,

    δ_k = Σ_l C_kl ∫ S_l (p + p_c) dA   (+ Σ_r g_kr ∫ (cos φ, sin φ, ζ cos φ, ζ sin φ)_r (p + p_c) dA),

and move by the rule of the integrator's stage, δ̇ = (δ − Δ)/g with Δ from the past and g = γh. Oil balances, rupture and
refilling are those of :mod:`cranktrain.film.film_balance`; p_c(h) is Greenwood and Tripp's.

Solution: semi-smooth Newton on node unknowns and shapes at once. The balance is a band; the shapes are its border. A
node changes sides when its unknown changes sign; with a fixed film that active set ends from any start, because the
matrix is an M-matrix. The ring of columns is cut inside a ruptured region whose transport within Δt does not reach
around; where there is none, one column of nodes joins the border. A Newton step may not close the film by more than a
share of itself. The converged set is solved afresh, so the result does not depend on the warm start beyond the
tolerance; tangents are those of the converged set (implicit function), the shapes' answer included.

Bore at rest, isoviscous film, p = 0 (gauge) at both ends, supply nodes at their pressure. Inertial axes.
"""

from __future__ import annotations

import math

from cranktrain.film.asperity import FRICTION, SHEAR, SMOOTH_SPEED, contact_pressure
from cranktrain.film.band_blocks import factor_blocks, solve_blocks
from cranktrain.film.elastic_grid import (
    CLEARANCE,
    CLIPPED,
    CONTACT_LOAD,
    CONTACT_SHARE,
    DAMPING,
    FILL_MEAN,
    FILM_MIN,
    FILM_MIN_ANGLE,
    FILM_MIN_ZETA,
    FLOOR,
    FORCE,
    FRICTION_TORQUE,
    ITERATIONS,
    N_PHI,
    N_SHAPES,
    N_Z,
    OIL,
    PRESSURE_MAX,
    RADIUS,
    SIDE_FLOW,
    STIFFNESS,
    SUPPLY_FLOW,
    SUPPLY_PRESSURE,
    VISCOSITY,
    WIDTH,
)  # fmt: skip
from cranktrain.film.film_balance import (
    CONTACT,
    CONTACT_SLOPE,
    FACE_OPEN,
    FILM,
    FULL,
    GROWTH,
    OPEN,
    PRESSURE,
    SLOPE,
    VOID,
    combined,
    face_films,
    film_rates,
    film_start,
    grid_factors,
    motion_sources,
    node_films,
    oil_balance,
    open_films,
    pressure_unit,
    shape_sources,
)  # fmt: skip
from cranktrain.kernel import kernel

CONVERGED, NOT_CONVERGED, SINGULAR = 0, 1, 2

MOST_ITERATIONS = 30
HIGHEST_FLOOR, LOWERING, EASING = 0.3, 0.4, 20
"""Where plain Newton fails: first floor of the film, its decrease from solution to solution, iterations for each."""
STEP_TOLERANCE = 1.0e-5
"""Largest change of the film over itself in the last Newton step; what is left is its square."""
MOVE_TOLERANCE = 3.0e-4
"""Largest change of pressure over the highest, or of a void share, in that step: what the tangents may be wrong by."""
CLOSING = 0.7
"""Share of itself by which a Newton step may close the film."""
REACH = 1.0e-9
"""A ring is cut where transport around it, within the step, carries less than this."""

PLACE, PACE, SHIFT, SHIFT_RATE, START_PLACE, START_SHIFT, KNOWN, STEP = 0, 1, 2, 3, 4, 5, 6, 7
TINY = 1.0e-30
"""Void share by which a node that has just ruptured is known."""
SWITCH = 1.0e-11
"""Change of sign that is rounding: of the void share, and of pressure over the largest."""


@kernel
def elastic_film(
    film, position, velocity, speed, dt, gain, start, start_position, start_delta, delta_known, unknowns, delta, work,
    out, tangents,
):  # fmt: skip
    """Solve one film for a stage of the step.

    Parameters
    ----------
    film, work
        :class:`~cranktrain.film.elastic_grid.ElasticFilm`, :class:`~cranktrain.film.elastic_grid.ElasticWork`
    position, velocity : (4,) x, y, a, b (m; a, b the axis' displacement by tilt at ζ = +1) and rates (m/s)
    speed : journal's speed, rad/s
    dt : time from the step's start to this stage, s; infinite for a steady film
    gain : g in δ̇ = (δ − Δ)/g, s; infinite for a steady bore
    start : (n,) node states at the step's start, see :mod:`cranktrain.film.film_balance`; zeros: full
    start_position, start_delta : (4,) and (k,) m, at the step's start
    delta_known : (k,) Δ, m
    unknowns, delta : (n,) and (k,) m, in: where to begin; out: the solution
    out : (OUT_SIZE,) out: forces (F_x, F_y, Q_x, Q_y) with Q = ∫ζ dF conjugate to (a, b), their derivatives by position
        (N/m) and velocity (N s/m), row-major 4 × 4, and the entries named in :mod:`cranktrain.film.elastic_grid`
    tangents : bool
        without, ``out`` keeps the tangents of the call before

    Returns
    -------
    int : CONVERGED, NOT_CONVERGED or SINGULAR; ``unknowns`` and ``delta`` are then what the last attempt reached
    """
    constants = film.constants
    n_shapes = int(constants[N_SHAPES])
    size = unknowns.shape[0]
    vectors = work.vectors
    per_clearance = 1.0 / constants[CLEARANCE]
    for row in range(8):
        for k in range(vectors.shape[1]):
            vectors[row, k] = 0.0
    for k in range(4):
        vectors[PLACE, k] = position[k] * per_clearance
        vectors[PACE, k] = velocity[k] * per_clearance
        vectors[START_PLACE, k] = start_position[k] * per_clearance
    for k in range(n_shapes):
        vectors[SHIFT, k + 1] = delta[k] * per_clearance
        vectors[START_SHIFT, k + 1] = start_delta[k] * per_clearance
        vectors[KNOWN, k + 1] = delta_known[k] * per_clearance
    per_step = 1.0 / dt
    per_gain = 1.0 / gain
    film_start(film, vectors[START_PLACE], vectors[START_SHIFT], start, work.nodes)
    half = 0.5 * speed
    floor = constants[FLOOR]
    status, passes, first, ring = _newton(film, floor, half, per_step, per_gain, MOST_ITERATIONS, unknowns, work)
    if status != CONVERGED:
        # Surfaces that interpenetrate by far squeeze oil through the floor of the film at any pressure, and Newton gets
        # no grip. A high floor, lowered by steps, lets the bore open first.
        for k in range(size):
            unknowns[k] = start[k]
        for k in range(n_shapes):
            vectors[SHIFT, k + 1] = vectors[KNOWN, k + 1]
        raised = HIGHEST_FLOOR
        while raised > floor:
            _, again, first, ring = _newton(film, raised, half, per_step, per_gain, EASING, unknowns, work)
            passes += again
            raised *= LOWERING
        status, again, first, ring = _newton(film, floor, half, per_step, per_gain, 2 * MOST_ITERATIONS, unknowns, work)
        passes += again
    for k in range(n_shapes):
        delta[k] = vectors[SHIFT, k + 1] * constants[CLEARANCE]
    out[ITERATIONS] = passes
    if status != CONVERGED:
        return status
    if tangents:
        _tangents(film, first, ring, work, out)
    out[CLIPPED] = _keep_filled(unknowns)
    _result(film, speed, work, out)
    return status


@kernel
def _cut(film, half_speed, per_step, nodes):
    """Column with which the band begins, and whether its last column must join the border."""
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    lines = n_z + 2
    best = 0
    length = 0
    run = 0
    # Twice around: a region of ruptured columns may lie across column 0.
    for k in range(2 * n_phi):
        i = k if k < n_phi else k - n_phi
        ruptured = True
        for j in range(1, n_z + 1):
            if nodes[FULL, i * lines + j] > 0.0:
                ruptured = False
                break
        if not ruptured:
            run = 0
            continue
        run += 1
        if run > length:
            length = run
            best = i
    if length < 3 or half_speed < 0.0:
        return 0, True
    if length >= n_phi:
        length = n_phi
    # What flows into the second ruptured column reaches the last one weakened by this factor each time.
    courant = half_speed * grid_factors(film.constants)[2] / per_step if per_step > 0.0 else 1.0e300
    weakened = (length - 1) * math.log(courant / (1.0 + courant)) if courant > 0.0 else -1.0e300
    begin = best - length + 2
    if begin < 0:
        begin += n_phi
    return begin, weakened > math.log(REACH)


@kernel
def _take_sides(film, unknowns, nodes):
    """Pressure and void share of every node from its unknown; which side it is on."""
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    supply = film.constants[SUPPLY_PRESSURE] / pressure_unit(film.constants)
    for i in range(n_phi):
        for j in range(n_z):
            f = i * n_z + j
            q = i * (n_z + 2) + j + 1
            if film.supply[f] > 0.0:
                unknowns[f] = supply
            u = unknowns[f]
            is_full = u >= 0.0
            nodes[FULL, q] = 1.0 if is_full else 0.0
            nodes[PRESSURE, q] = u if is_full else 0.0
            nodes[VOID, q] = 0.0 if is_full else u


@kernel
def _newton(film, floor, half_speed, per_step, per_gain, most, unknowns, work):
    """Iterate to convergence; the factors of the last matrix stay in ``work``. Returns status and iterations."""
    constants = film.constants
    n_phi = int(constants[N_PHI])
    n_z = int(constants[N_Z])
    n_shapes = int(constants[N_SHAPES])
    lines = n_z + 2
    size = n_phi * n_z
    nodes = work.nodes
    faces = work.faces
    vectors = work.vectors
    shift = vectors[SHIFT]
    residual = work.residual
    step = vectors[STEP]
    for i in range(n_phi):
        for end in range(2):
            q = i * lines + end * (n_z + 1)
            nodes[FULL, q] = 1.0
            nodes[PRESSURE, q] = 0.0
            nodes[VOID, q] = 0.0
    _take_sides(film, unknowns, nodes)
    for passes in range(1, most + 1):
        node_films(film, vectors[PLACE], shift, nodes[FILM])
        face_films(film, vectors[PLACE], shift, faces[FACE_OPEN])
        open_films(film, floor, nodes, faces)
        for k in range(n_shapes):
            vectors[SHIFT_RATE, k + 1] = (shift[k + 1] - vectors[KNOWN, k + 1]) * per_gain
        film_rates(film, vectors[PACE], vectors[SHIFT_RATE], nodes)
        first, ring = _cut(film, half_speed, per_step, nodes)
        oil_balance(film, half_speed, per_step, nodes, faces, first, work.band, residual)
        chain = size - n_z if ring else size
        blocks = (1 + n_shapes + (n_z if ring else 0) + 7) // 8
        _sources(film, per_gain, first, ring, blocks, residual, work)
        if factor_blocks(work.band, chain, n_z) != 0:
            return SINGULAR, passes, first, ring
        for block in range(blocks):
            solve_blocks(work.band, chain, n_z, work.columns[block])
        _loads(film, first, chain, 0, blocks, work)
        _present_loads(film, work)
        _border(film, first, ring, chain, 1, work)
        if _eliminate(work.border, n_shapes, n_z, ring, 1) != 0:
            return SINGULAR, passes, first, ring
        # How far may the step go before it closes the film somewhere?
        share = 1.0
        largest = 0.0
        if n_shapes > 0:
            for k in range(n_shapes):
                step[k + 1] = work.border[k, n_shapes + n_z]
            share, largest = _reach(film, floor, step, nodes)
            for k in range(n_shapes):
                step[k + 1] *= share
                shift[k + 1] += step[k + 1]
            if share < 1.0 and ring:
                # The column of the border answers to the step that is really taken.
                _border(film, first, ring, chain, 1, work)
                for k in range(n_shapes):
                    for column in range(n_shapes + n_z):
                        work.border[k, column] = 1.0 if k == column else 0.0
                    work.border[k, n_shapes + n_z] = step[k + 1]
                if _eliminate(work.border, n_shapes, n_z, ring, 1) != 0:
                    return SINGULAR, passes, first, ring
        changed, moved = _advance(film, first, ring, step, unknowns, work)
        if changed == 0 and share == 1.0 and largest < STEP_TOLERANCE and moved < MOVE_TOLERANCE:
            return CONVERGED, passes, first, ring
    return NOT_CONVERGED, most, first, ring


@kernel
def _sources(film, per_gain, first, ring, blocks, residual, work):
    """Right-hand sides of one Newton step: the residual, the shapes, and the border's column of nodes."""
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    n_shapes = int(film.constants[N_SHAPES])
    size = n_phi * n_z
    columns = work.columns
    held = film.shapes.shape[1] // 8
    for block in range(blocks):
        if block < held:
            shape_sources(film, per_gain, work.nodes, work.faces, first, block, columns[block])
        else:
            for row in range(size):
                for r in range(8):
                    columns[block, row, r] = 0.0
    for position in range(n_phi):
        i = first + position
        if i >= n_phi:
            i -= n_phi
        for j in range(n_z):
            columns[0, position * n_z + j, 0] = -residual[i * n_z + j]
    if ring:
        for j in range(n_z):
            slot = 1 + n_shapes + j
            block = slot // 8
            r = slot - 8 * block
            columns[block, j, r] -= work.band[j, 0]
            columns[block, size - 2 * n_z + j, r] -= work.band[size - 2 * n_z + j, 2 * n_z]


@kernel
def _loads(film, first, chain, begin, end, work):
    """Generalised forces ∫ S p dA / (p₀ A₀) of the solutions in blocks ``begin`` … ``end`` − 1, into ``loads``."""
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    n_shapes = int(film.constants[N_SHAPES])
    lines = n_z + 2
    loads = work.loads
    for block in range(begin, end):
        at = 8 * block
        for m in range(4 + n_shapes):
            for r in range(8):
                loads[m, at + r] = 0.0
        for position in range(chain // n_z):
            i = first + position
            if i >= n_phi:
                i -= n_phi
            cos = film.trig[i, 0]
            sin = film.trig[i, 1]
            for j in range(n_z):
                q = i * lines + j + 1
                if work.nodes[FULL, q] == 0.0:
                    continue
                row = work.columns[block, position * n_z + j]
                weight = film.lines[j + 1, 1]
                c0 = row[0]
                c1 = row[1]
                c2 = row[2]
                c3 = row[3]
                c4 = row[4]
                c5 = row[5]
                c6 = row[6]
                c7 = row[7]
                for m in range(4 + n_shapes):
                    if m >= 4:
                        s = weight * film.shapes[q, m - 3]
                    else:
                        s = -weight * (cos if m % 2 == 0 else sin)
                        if m >= 2:
                            s *= film.lines[j + 1, 0]
                    sums = loads[m]
                    d0 = sums[at] + s * c0
                    d1 = sums[at + 1] + s * c1
                    d2 = sums[at + 2] + s * c2
                    d3 = sums[at + 3] + s * c3
                    d4 = sums[at + 4] + s * c4
                    d5 = sums[at + 5] + s * c5
                    d6 = sums[at + 6] + s * c6
                    d7 = sums[at + 7] + s * c7
                    sums[at] = d0
                    sums[at + 1] = d1
                    sums[at + 2] = d2
                    sums[at + 3] = d3
                    sums[at + 4] = d4
                    sums[at + 5] = d5
                    sums[at + 6] = d6
                    sums[at + 7] = d7


@kernel
def _shape_value(film, q, i, line, m):
    """Generalised shape m at node q: 0..3 those of x, y, a, b, then the bore's."""
    if m >= 4:
        return film.shapes[q, m - 3]
    value = -film.trig[i, 0] if m % 2 == 0 else -film.trig[i, 1]
    return value * film.lines[line, 0] if m >= 2 else value


@kernel
def _load_unit(constants):
    """p₀ A₀ with A₀ = R Δφ ½L Δζ, the area of one node (N s)."""
    area = constants[RADIUS] * 2.0 * math.pi / constants[N_PHI] * constants[WIDTH] / (constants[N_Z] + 1.0)
    return pressure_unit(constants) * area


@kernel
def _present_loads(film, work):
    """Generalised forces of the present film and contact pressure, over p₀ A₀, and the contact's derivatives."""
    n_phi = int(film.constants[N_PHI])
    lines = int(film.constants[N_Z]) + 2
    count = 4 + int(film.constants[N_SHAPES])
    pressure = work.nodes[PRESSURE]
    touching = work.touching
    for m in range(count):
        for k in range(count + 2):
            touching[m, k] = 0.0
    for i in range(n_phi):
        for line in range(lines):
            q = i * lines + line
            p = pressure[q] * film.lines[line, 1]
            if p > 0.0:
                for m in range(count):
                    touching[m, count + 1] += p * _shape_value(film, q, i, line, m)
            contact = work.nodes[CONTACT, q]
            if contact > 0.0:
                weight = film.lines[line, 2]
                slope = weight * work.nodes[CONTACT_SLOPE, q]
                for m in range(count):
                    s = _shape_value(film, q, i, line, m)
                    touching[m, count] += weight * contact * s
                    for k in range(count):
                        touching[m, k] += slope * s * _shape_value(film, q, i, line, k)


@kernel
def _border(film, first, ring, chain, right_sides, work):
    """Equations of the shapes and of the border's column of nodes, after elimination of all other nodes.

    Unknowns in order: shapes, then the column. One right-hand side, the Newton step, or eight, by (x, y, a, b) and
    their velocities, stand from column k + n_z on.
    """
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    n_shapes = int(film.constants[N_SHAPES])
    count = 4 + n_shapes
    size = n_phi * n_z
    loads = work.loads
    touching = work.touching
    border = work.border
    columns = work.columns
    right = n_shapes + n_z
    last = columns.shape[0] - 1
    unit = _load_unit(film.constants) / film.constants[CLEARANCE]
    b = first - 1 if first > 0 else n_phi - 1
    for k in range(n_shapes):
        row = border[k]
        for column in range(right + right_sides):
            row[column] = 0.0
        row[k] = 1.0
        if right_sides == 1:
            row[right] = -work.vectors[SHIFT, k + 1]
        for m in range(count):
            yielding = film.compliance[k, m] * unit
            if yielding == 0.0:
                continue
            for column in range(n_shapes):
                row[column] -= yielding * (loads[m, 1 + column] + touching[m, 4 + column])
            if ring:
                for j in range(n_z):
                    q = b * (n_z + 2) + j + 1
                    own = 0.0
                    if work.nodes[FULL, q] > 0.0:
                        own = film.lines[j + 1, 1] * _shape_value(film, q, b, j + 1, m)
                    row[n_shapes + j] -= yielding * (loads[m, 1 + n_shapes + j] + own)
            if right_sides == 1:
                row[right] += yielding * (loads[m, 0] + touching[m, count] + touching[m, count + 1])
            else:
                for t in range(8):
                    row[right + t] += yielding * loads[m, 8 * last + t]
                for t in range(4):
                    row[right + t] += yielding * touching[m, t]
    if not ring:
        return
    for j in range(n_z):
        row = border[n_shapes + j]
        at = chain + j
        left = size - 2 * n_z + j
        by_left = work.band[at, 0]
        by_right = work.band[at, 2 * n_z]
        for column in range(right):
            slot = column + 1
            block = slot // 8
            r = slot - 8 * block
            row[column] = by_left * columns[block, left, r] + by_right * columns[block, j, r] - columns[block, at, r]
        row[n_shapes + j] += work.band[at, n_z]
        if j > 0:
            row[n_shapes + j - 1] += work.band[at, n_z - 1]
        if j < n_z - 1:
            row[n_shapes + j + 1] += work.band[at, n_z + 1]
        if right_sides == 1:
            row[right] = columns[0, at, 0] - by_left * columns[0, left, 0] - by_right * columns[0, j, 0]
        else:
            for t in range(8):
                row[right + t] = (
                    columns[last, at, t] - by_left * columns[last, left, t] - by_right * columns[last, j, t]
                )


@kernel
def _eliminate(a, n_shapes, n_z, ring, right_sides):
    """Gauss with partial pivoting on the border's equations, in place; returns 1 where they are singular."""
    n = n_shapes + n_z if ring else n_shapes
    right = n_shapes + n_z
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[best, k]):
                best = i
        if not abs(a[best, k]) > 0.0:
            return 1
        if best != k:
            for c in range(k, n):
                swap = a[k, c]
                a[k, c] = a[best, c]
                a[best, c] = swap
            for c in range(right, right + right_sides):
                swap = a[k, c]
                a[k, c] = a[best, c]
                a[best, c] = swap
        inverse = 1.0 / a[k, k]
        for i in range(k + 1, n):
            share = a[i, k] * inverse
            if share != 0.0:
                for c in range(k + 1, n):
                    a[i, c] -= share * a[k, c]
                for c in range(right, right + right_sides):
                    a[i, c] -= share * a[k, c]
    for k in range(n - 1, -1, -1):
        inverse = 1.0 / a[k, k]
        for c in range(right, right + right_sides):
            total = a[k, c]
            for i in range(k + 1, n):
                total -= a[k, i] * a[i, c]
            a[k, c] = total * inverse
    return 0


@kernel
def _reach(film, floor, step, nodes):
    """Share of a step of the shapes that keeps the film open, and its largest change over the film."""
    columns = film.shapes.shape[1]
    least = 10.0 * floor
    share = 1.0
    largest = 0.0
    for q in range(nodes.shape[1]):
        row = film.shapes[q]
        change = combined(row, step, columns)
        h = nodes[OPEN, q]
        if h < least:
            h = least
        relative = change / h
        if -relative * share > CLOSING and nodes[FILM, q] > floor:
            share = min(share, -CLOSING / relative)
        if abs(relative) > largest:
            largest = abs(relative)
    return share, largest


@kernel
def _advance(film, first, ring, step, unknowns, work):
    """Add the Newton step to the unknowns; nodes whose unknown changes its sign change sides.

    Returns how many, and the largest change of pressure, over the highest, or of a void share.
    """
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    n_shapes = int(film.constants[N_SHAPES])
    columns = work.columns
    answer = work.border
    right = n_shapes + n_z
    highest = 0.0
    for f in range(unknowns.shape[0]):
        if unknowns[f] > highest:
            highest = unknowns[f]
    slack = SWITCH * highest
    changed = 0
    moved = 0.0
    emptied = 0.0
    for position in range(n_phi):
        i = first + position
        if i >= n_phi:
            i -= n_phi
        for j in range(n_z):
            at = position * n_z + j
            f = i * n_z + j
            q = i * (n_z + 2) + j + 1
            if film.supply[f] > 0.0:
                continue
            if ring and position == n_phi - 1:
                change = answer[n_shapes + j, right]
            else:
                change = columns[0, at, 0]
                for k in range(n_shapes):
                    slot = k + 1
                    change += columns[slot // 8, at, slot % 8] * step[slot]
                if ring:
                    for k in range(n_z):
                        slot = 1 + n_shapes + k
                        change += columns[slot // 8, at, slot % 8] * answer[n_shapes + k, right]
            if work.nodes[FULL, q] > 0.0:
                u = work.nodes[PRESSURE, q] + change
                moved = max(moved, abs(change))
                if u < -slack:
                    u = -TINY
                    changed += 1
                elif u < 0.0:
                    u = 0.0
            else:
                u = work.nodes[VOID, q] + change
                emptied = max(emptied, abs(change))
                if u > SWITCH:
                    u = 0.0
                    changed += 1
                elif u > -TINY:
                    u = -TINY
            unknowns[f] = u
            is_full = u >= 0.0
            work.nodes[FULL, q] = 1.0 if is_full else 0.0
            work.nodes[PRESSURE, q] = u if is_full else 0.0
            work.nodes[VOID, q] = 0.0 if is_full else u
    if highest > 0.0:
        moved /= highest
    return changed, max(moved, emptied)


@kernel
def _keep_filled(unknowns):
    """Hold fills in [0, 1]; returns how many nodes had to be held."""
    clipped = 0
    for f in range(unknowns.shape[0]):
        if unknowns[f] < -1.0:
            unknowns[f] = -1.0
            clipped += 1
    return clipped


@kernel
def _tangents(film, first, ring, work, out):
    """Derivatives of the four generalised forces by position and velocity, on the converged set."""
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    n_shapes = int(film.constants[N_SHAPES])
    size = n_phi * n_z
    chain = size - n_z if ring else size
    last = work.columns.shape[0] - 1
    right = n_shapes + n_z
    motion_sources(film, work.nodes, work.faces, first, work.columns[last])
    solve_blocks(work.band, chain, n_z, work.columns[last])
    _loads(film, first, chain, last, last + 1, work)
    _border(film, first, ring, chain, 8, work)
    _eliminate(work.border, n_shapes, n_z, ring, 8)
    b = first - 1 if first > 0 else n_phi - 1
    unit = _load_unit(film.constants) / film.constants[CLEARANCE]
    for m in range(4):
        for t in range(8):
            total = work.loads[m, 8 * last + t]
            if t < 4:
                total += work.touching[m, t]
            for k in range(n_shapes):
                total += (work.loads[m, 1 + k] + work.touching[m, 4 + k]) * work.border[k, right + t]
            if ring:
                for j in range(n_z):
                    q = b * (n_z + 2) + j + 1
                    by = work.loads[m, 1 + n_shapes + j]
                    if work.nodes[FULL, q] > 0.0:
                        by += film.lines[j + 1, 1] * _shape_value(film, q, b, j + 1, m)
                    total += by * work.border[n_shapes + j, right + t]
            if t < 4:
                out[STIFFNESS + 4 * m + t] = total * unit
            else:
                out[DAMPING + 4 * m + t - 4] = total * unit


@kernel
def _vertex(before, here, after):
    """How far the parabola through three neighbours goes beyond the middle one, and where, in steps from it."""
    bend = before - 2.0 * here + after
    lean = 0.5 * (after - before)
    if bend == 0.0 or abs(lean) > abs(bend):
        return 0.0, 0.0
    return -0.5 * lean * lean / bend, -lean / bend


@kernel
def _result(film, speed, work, out):
    """Forces and what else users read, from the converged film."""
    constants = film.constants
    n_phi = int(constants[N_PHI])
    n_z = int(constants[N_Z])
    lines = n_z + 2
    count = 4 + int(constants[N_SHAPES])
    nodes = work.nodes
    node_films(film, work.vectors[PLACE], work.vectors[SHIFT], nodes[FILM])
    face_films(film, work.vectors[PLACE], work.vectors[SHIFT], work.faces[FACE_OPEN])
    open_films(film, film.constants[FLOOR], nodes, work.faces)
    _present_loads(film, work)
    unit = _load_unit(constants)
    for m in range(4):
        out[FORCE + m] = unit * (work.touching[m, count] + work.touching[m, count + 1])
    _, across, per_angle = grid_factors(constants)
    film_h = nodes[FILM]
    is_open = nodes[OPEN]
    pressure = nodes[PRESSURE]
    void = nodes[VOID]
    least = film_h[0]
    at_least = 0
    highest = 0.0
    at_highest = 1
    shear = 0.0
    wedge = 0.0
    oil = 0.0
    room = 0.0
    side = 0.0
    fed = 0.0
    film_load = 0.0
    contact_load = 0.0
    rubbing = 0.0
    sliding = speed * constants[RADIUS]
    for i in range(n_phi):
        up = (i - 1 if i > 0 else n_phi - 1) * lines
        down = (i + 1 if i + 1 < n_phi else 0) * lines
        for line in range(lines):
            q = i * lines + line
            if film_h[q] < least:
                least = film_h[q]
                at_least = q
            weight = film.lines[line, 2]
            # At the ends the oil is that of the nodes beside them.
            inner = q + 1 if line == 0 else (q - 1 if line == lines - 1 else q)
            fill = 1.0 + void[inner]
            shear += weight * fill / is_open[q]
            if nodes[CONTACT, q] > 0.0:
                contact_load += weight * nodes[CONTACT, q]
                p, _, area = contact_pressure(film_h[q] * constants[CLEARANCE], film.contact, film.contact_table)
                rubbing += weight * (film.contact[FRICTION] * p + film.contact[SHEAR] * area)
            if line == 0 or line == lines - 1:
                continue
            oil += fill * is_open[q]
            room += is_open[q]
            p = pressure[q]
            if p > 0.0:
                film_load += p * film.lines[line, 1]
                wedge += p * film.lines[line, 1] * (film_h[down + line] - film_h[up + line])
                if p > highest:
                    highest = p
                    at_highest = q
                if line == 1:
                    mean = 0.5 * (is_open[q] + is_open[q - 1])
                    side += across * mean * mean * mean * p
                if line == lines - 2:
                    mean = 0.5 * (is_open[q] + is_open[q + 1])
                    side += across * mean * mean * mean * p
            if film.supply[i * n_z + line - 1] > 0.0:
                fed += _node_outflow(film, 0.5 * speed, i, line, work)
    out[FILM_MIN], out[FILM_MIN_ANGLE], out[FILM_MIN_ZETA] = _extreme(film, film_h, at_least)
    out[FILM_MIN] *= constants[CLEARANCE]
    out[PRESSURE_MAX] = 0.0
    if highest > 0.0:
        out[PRESSURE_MAX] = _extreme(film, pressure, at_highest)[0] * pressure_unit(constants)
    area = constants[RADIUS] * 2.0 * math.pi / n_phi * constants[WIDTH] / (n_z + 1.0)
    out[SIDE_FLOW] = side * area * constants[CLEARANCE]
    out[SUPPLY_FLOW] = fed * area * constants[CLEARANCE]
    out[OIL] = oil * area * constants[CLEARANCE]
    out[FILL_MEAN] = oil / room
    drag = constants[VISCOSITY] * sliding / constants[CLEARANCE] * shear * area * constants[RADIUS]
    # dH/dφ from central differences of H, exact for the journal's circle with sin Δφ in place of Δφ.
    turn = 0.5 * wedge / (2.0 * math.sin(1.0 / per_angle)) * unit * constants[CLEARANCE]
    sign = sliding / math.sqrt(sliding * sliding + SMOOTH_SPEED * SMOOTH_SPEED)
    out[FRICTION_TORQUE] = -drag + turn - sign * rubbing * area * constants[RADIUS]
    out[CONTACT_LOAD] = contact_load * unit
    total = contact_load + film_load
    out[CONTACT_SHARE] = contact_load / total if total > 0.0 else 0.0


@kernel
def _node_outflow(film, half_speed, i, line, work):
    """Oil that a supply node gives to its neighbours and to its own growing film, over the node's share (1/s)."""
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    lines = n_z + 2
    around, across, per_angle = grid_factors(film.constants)
    up = i - 1 if i > 0 else n_phi - 1
    down = i + 1 if i + 1 < n_phi else 0
    q = i * lines + line
    q_up = up * lines + line
    q_down = down * lines + line
    nodes = work.nodes
    pressure = nodes[PRESSURE]
    h = work.faces[FACE_OPEN, i * n_z + line - 1]
    h_up = work.faces[FACE_OPEN, up * n_z + line - 1]
    drive = half_speed * per_angle
    void_down = 0.0 if drive > 0.0 else nodes[VOID, q_down]
    void_up = nodes[VOID, q_up] if drive > 0.0 else 0.0
    mean = 0.5 * (nodes[OPEN, q] + nodes[OPEN, q + 1])
    mean_before = 0.5 * (nodes[OPEN, q] + nodes[OPEN, q - 1])
    return (
        around * (h * h * h * (pressure[q] - pressure[q_down]) + h_up * h_up * h_up * (pressure[q] - pressure[q_up]))
        + drive * (h * (1.0 + void_down) - h_up * (1.0 + void_up))
        + across * mean * mean * mean * (pressure[q] - pressure[q + 1])
        + across * mean_before * mean_before * mean_before * (pressure[q] - pressure[q - 1])
        + nodes[SLOPE, q] * nodes[GROWTH, q]
    )


@kernel
def _extreme(film, field, q):
    """Value, angle and ζ of the extreme of a nodal field near its extreme node, by parabolas both ways."""
    n_phi = int(film.constants[N_PHI])
    lines = int(film.constants[N_Z]) + 2
    i = q // lines
    line = q - i * lines
    up = i - 1 if i > 0 else n_phi - 1
    down = i + 1 if i + 1 < n_phi else 0
    beyond, shift = _vertex(field[up * lines + line], field[q], field[down * lines + line])
    angle = (i + shift) * 2.0 * math.pi / n_phi
    zeta = film.lines[line, 0]
    value = field[q] + beyond
    if 0 < line < lines - 1:
        beyond, shift = _vertex(field[q - 1], field[q], field[q + 1])
        value += beyond
        zeta += shift * (film.lines[1, 0] - film.lines[0, 0])
    return value, angle, zeta
