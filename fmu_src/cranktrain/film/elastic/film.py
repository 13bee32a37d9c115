"""Elastohydrodynamic film solved online: mass-conserving Reynolds' equation coupled with the elastic bore.

The film is h = c + g(ζ) − (x + ζa) cos φ − (y + ζb) sin φ + Σ_k δ_k S_k(φ, ζ) with the relief g of the shell. It
depends on the motion of the journal and on a few shapes of the bore (the compliance of an elastic journal is added to
the bore's). The shapes deflect under film and contact pressure together,

    δ_k = Σ_l C_kl ∫ S_l (p + p_c) dA   (+ Σ_r g_kr ∫ (cos φ, sin φ, ζ cos φ, ζ sin φ)_r (p + p_c) dA),

and move by the rule of the integrator's stage, δ̇ = (δ − Δ)/g with Δ from the past and g = γh. Oil balances, rupture and
refilling are those of :mod:`cranktrain.film.elastic.balance`; p_c(h) is Greenwood and Tripp's.

Solution: a semi-smooth Newton method solves node unknowns and shapes together. The balance is a band matrix; the shapes
are its border. A node changes between full and ruptured when its unknown changes sign. For a fixed film this active-set
method converges from any start, because the matrix is an M-matrix. The ring of columns is cut inside a ruptured region
whose transport within Δt does not reach around. Without such a region one column of nodes joins the border. A Newton
step may close the film by at most a fraction of its thickness. The converged set is solved once more, so the result
depends on the initial guess only within the tolerances of the film (STEP_LIMIT and those after it). Tangents of the
converged set follow from the implicit function theorem and include the response of the shapes.

The dependence of viscosity and density on pressure is that of :mod:`cranktrain.film.elastic.oil`. The axes are those of
the bore, which is at rest. Gauge pressure is zero at both ends, and supply nodes have the supply pressure.
"""

import math

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.film.elastic import grid as at
from cranktrain.film.elastic.balance import (
    Rates,
    film_rates,
    film_start,
    grid_factors,
    oil_balance,
    take_content,
)
from cranktrain.film.elastic.band_blocks import factor_blocks, solve_blocks
from cranktrain.film.elastic.border import (
    border_equations,
    eliminate,
    film_tangents,
    present_loads,
    solution_loads,
)
from cranktrain.film.elastic.height import combined, face_films, node_films, open_films, pressure_unit
from cranktrain.film.elastic.oil import oil_state, pressure_change, start_compression
from cranktrain.film.elastic.result import film_result
from cranktrain.film.elastic.sources import shape_sources
from cranktrain.film.elastic.weights import film_weights

CONVERGED, NOT_CONVERGED, SINGULAR = 0, 1, 2

MOST_ITERATIONS = np.int64(30)
ROUGHEST, LOWERING, EASING, LAST = 0.3, 0.4, np.int64(20), np.int64(60)
"""Continuation if plain Newton fails: first roughness over the clearance, its factor from solution to solution, Newton
iterations of an intermediate and of the last solution. The np.int64 type avoids that numba compiles :func:`_newton` for
each literal."""
LEAST = 2.0e-3
"""Lower bound, over the clearance, of the film thickness in the relative size of a Newton step."""
CLOSING = 0.7
"""Largest fraction of the film thickness by which a Newton step may close the film."""
TINY = 1.0e-30
"""Void fraction that marks a node that has just ruptured."""
SWITCH = 1.0e-11
"""Limit below which a change of sign is rounding, for the void fraction and for pressure over the largest."""


@kernel
def elastic_film(film, motion, clock, history, work, out, tangents):
    """Solve one film for a stage of the step.

    Parameters
    ----------
    film, work
        :class:`~cranktrain.film.elastic.grid.ElasticFilm`, :class:`~cranktrain.film.elastic.grid.ElasticWork`
    motion : (2, 4) x, y, a, b (m; a, b the axis' displacement by tilt at ζ = +1) and their rates (m/s)
    clock : journal speed, rad/s; time over which voids change, s (g of the stage, or the time from the step's start if
        ``history`` has no content; infinite for a steady film); g in δ̇ = (δ − Δ)/g, s, infinite for a steady bore
    history : FilmHistory; ``unknowns`` and ``shapes`` are written
    out : (OUT_SIZE,) out: forces (F_x, F_y, Q_x, Q_y) with Q = ∫ζ dF conjugate to (a, b), their derivatives by position
        (N/m) and velocity (N s/m), row-major 4 × 4, and the entries named in :mod:`cranktrain.film.elastic.grid`
    tangents : bool
        if False, ``out`` keeps the tangents of the previous call

    Returns
    -------
    int : CONVERGED, NOT_CONVERGED or SINGULAR; ``unknowns`` and ``shapes`` of a failure are those of the last attempt
    """
    constants = film.constants
    speed, dt, gain = clock
    rates = Rates(0.5 * speed, 1.0 / dt, 1.0 / gain)
    _scaled_vectors(constants, motion, history, work.vectors)
    vectors = work.vectors
    start_compression(film, history.start, work.nodes)
    film_start(film, vectors[at.START_PLACE], vectors[at.START_SHIFT], history.start, rates, work.nodes, work.faces)
    if history.content.shape[1] > 0:
        take_content(film, history.content, rates, work.nodes, work.faces)
    film_weights(film, vectors[at.START_PLACE], vectors[at.START_SHIFT], work.nodes)
    film_rates(film, vectors[at.PLACE], vectors[at.PACE], vectors[at.KNOWN], rates.per_gain, work.nodes)
    status, passes, first, ring = _newton(film, constants[at.ROUGHNESS], rates, MOST_ITERATIONS, history.unknowns, work)
    if status != CONVERGED:
        status, again, first, ring = _lowered(film, rates, history, work)
        passes += again
    for k in range(history.shapes.shape[0]):
        history.shapes[k] = vectors[at.SHIFT, k + 1] * constants[at.CLEARANCE]
    out[at.ITERATIONS] = passes
    if status != CONVERGED:
        return status
    if tangents:
        film_tangents(film, first, ring, work, out)
    oil_state(film, work.nodes)
    out[at.CLIPPED] = _keep_filled(film, history.unknowns, work.nodes[at.VOID])
    film_result(film, speed, rates.per_gain, work, out)
    return status


@kernel
def _scaled_vectors(constants, motion, history, vectors):
    """Write positions, velocities and shapes over the clearance to ``vectors``, padded with zeros."""
    per_clearance = 1.0 / constants[at.CLEARANCE]
    for row in range(at.VECTORS):
        vectors[row, :] = 0.0
    for k in range(4):
        vectors[at.PLACE, k] = motion[0, k] * per_clearance
        vectors[at.PACE, k] = motion[1, k] * per_clearance
        vectors[at.START_PLACE, k] = history.start_place[k] * per_clearance
    for k in range(history.shapes.shape[0]):
        vectors[at.SHIFT, k + 1] = history.shapes[k] * per_clearance
        vectors[at.START_SHIFT, k + 1] = history.start_shapes[k] * per_clearance
        vectors[at.KNOWN, k + 1] = history.known[k] * per_clearance


@kernel
def _lowered(film, rates, history, work):
    """Solve by continuation from rougher surfaces, in at most two attempts. Return status, iterations, cut and ring.

    If surfaces overlap far, the mean gap is so small that no pressure drives out the oil, and Newton's method does not
    converge. A larger roughness gives a larger mean gap, so the bore can open first.
    """
    sigma = film.constants[at.ROUGHNESS]
    unknowns = history.unknowns
    passes = 0
    status = NOT_CONVERGED
    first = 0
    ring = True
    for attempt in range(2):
        for k in range(unknowns.shape[0]):
            unknowns[k] = history.start[k]
        for k in range(history.shapes.shape[0]):
            work.vectors[at.SHIFT, k + 1] = work.vectors[at.KNOWN, k + 1]
        raised = ROUGHEST
        while raised > sigma:
            _, again, first, ring = _newton(film, raised, rates, EASING, unknowns, work)
            passes += again
            raised *= LOWERING if attempt == 0 else math.sqrt(LOWERING)
        status, again, first, ring = _newton(film, sigma, rates, LAST, unknowns, work)
        passes += again
        if status == CONVERGED:
            break
    return status, passes, first, ring


@kernel
def _cut(film, rates, nodes):
    """Return the column at which the band begins, and whether its last column must join the border."""
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    lines = n_z + 2
    best = 0
    length = 0
    run = 0
    # The loop goes twice around, because a region of ruptured columns may include column 0.
    for k in range(2 * n_phi):
        i = k if k < n_phi else k - n_phi
        ruptured = True
        for j in range(1, n_z + 1):
            if nodes[at.FULL, i * lines + j] > 0.0:
                ruptured = False
                break
        if not ruptured:
            run = 0
            continue
        run += 1
        if run > length:
            length = run
            best = i
    if length < 3 or rates.half_speed < 0.0:
        return 0, True
    if length >= n_phi:
        length = n_phi
    # Oil that flows into the second ruptured column is reduced by this factor in every column up to the last one.
    _, _, per_angle = grid_factors(film.constants)
    courant = rates.half_speed * per_angle / rates.per_step if rates.per_step > 0.0 else 1.0e300
    weakened = (length - 1) * math.log(courant / (1.0 + courant)) if courant > 0.0 else -1.0e300
    begin = best - length + 2
    if begin < 0:
        begin += n_phi
    return begin, weakened > math.log(film.constants[at.AROUND_LIMIT])


@kernel
def _take_sides(film, unknowns, nodes):
    """Compute pressure, void fraction and full mask of every node from its unknown."""
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    supply = film.constants[at.SUPPLY_PRESSURE] / pressure_unit(film.constants)
    for i in range(n_phi):
        for j in range(n_z):
            f = i * n_z + j
            q = i * (n_z + 2) + j + 1
            if film.supply[f] > 0.0:
                unknowns[f] = supply
            u = unknowns[f]
            is_full = u >= 0.0
            nodes[at.FULL, q] = 1.0 if is_full else 0.0
            nodes[at.PRESSURE, q] = u if is_full else 0.0
            nodes[at.VOID, q] = 0.0 if is_full else u


@kernel
def _newton(film, sigma, rates, most, unknowns, work):
    """Iterate to convergence and keep the factors of the last matrix in ``work``. Return status and iterations."""
    constants = film.constants
    n_phi = int(constants[at.N_PHI])
    n_z = int(constants[at.N_Z])
    n_shapes = int(constants[at.N_SHAPES])
    lines = n_z + 2
    size = n_phi * n_z
    nodes = work.nodes
    faces = work.faces
    vectors = work.vectors
    shift = vectors[at.SHIFT]
    step = vectors[at.STEP]
    for i in range(n_phi):
        for end in range(2):
            q = i * lines + end * (n_z + 1)
            nodes[at.FULL, q] = 1.0
            nodes[at.PRESSURE, q] = 0.0
            nodes[at.VOID, q] = 0.0
    _take_sides(film, unknowns, nodes)
    node_films(film, vectors[at.PLACE], shift, nodes[at.FILM])
    for passes in range(1, most + 1):
        face_films(film, vectors[at.PLACE], shift, faces[at.FACE_OPEN])
        open_films(film, sigma, nodes, faces)
        oil_state(film, nodes)
        first, ring = _cut(film, rates, nodes)
        oil_balance(film, rates, nodes, faces, first, work.band, work.residual)
        chain = size - n_z if ring else size
        blocks = (1 + n_shapes + (n_z if ring else 0) + 7) // 8
        _sources(film, rates.per_gain, first, ring, blocks, work)
        if factor_blocks(work.band, chain, n_z) != 0:
            return SINGULAR, passes, first, ring
        for block in range(blocks):
            solve_blocks(work.band, chain, n_z, work.columns[block])
        solution_loads(film, first, chain, 0, blocks, work)
        present_loads(film, work)
        border_equations(film, first, ring, chain, 1, 0, work)
        if eliminate(work.border, n_shapes, n_z, ring, 1) != 0:
            return SINGULAR, passes, first, ring
        # The step is limited so that the film does not close at any node.
        share = 1.0
        largest = 0.0
        if n_shapes > 0:
            for k in range(n_shapes):
                step[k + 1] = work.border[k, n_shapes + n_z]
            share, largest = _reach(film, step, nodes)
            for k in range(n_shapes):
                step[k + 1] *= share
                shift[k + 1] += step[k + 1]
            for q in range(nodes.shape[1]):
                nodes[at.FILM, q] += share * nodes[at.CHANGE, q]
            if share < 1.0 and ring:
                # The border's column of nodes is solved again for the reduced step of the shapes.
                border_equations(film, first, ring, chain, 1, 0, work)
                for k in range(n_shapes):
                    for column in range(n_shapes + n_z):
                        work.border[k, column] = 1.0 if k == column else 0.0
                    work.border[k, n_shapes + n_z] = step[k + 1]
                if eliminate(work.border, n_shapes, n_z, ring, 1) != 0:
                    return SINGULAR, passes, first, ring
        changed, moved = _advance(film, first, ring, step, unknowns, work)
        if changed == 0 and share == 1.0 and largest < constants[at.STEP_LIMIT] and moved < constants[at.MOVE_LIMIT]:
            return CONVERGED, passes, first, ring
    return NOT_CONVERGED, most, first, ring


@kernel
def _sources(film, per_gain, first, ring, blocks, work):
    """Write the right-hand sides of a Newton step: the residual, the shapes, and the border's column of nodes."""
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    n_shapes = int(film.constants[at.N_SHAPES])
    size = n_phi * n_z
    columns = work.columns
    of_shapes = film.shapes.shape[1] // 8
    for block in range(blocks):
        if block < of_shapes:
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
            columns[0, position * n_z + j, 0] = -work.residual[i * n_z + j]
    if ring:
        for j in range(n_z):
            slot = 1 + n_shapes + j
            block = slot // 8
            r = slot - 8 * block
            columns[block, j, r] -= work.band[j, 0]
            columns[block, size - 2 * n_z + j, r] -= work.band[size - 2 * n_z + j, 2 * n_z]


@kernel
def _reach(film, step, nodes):
    """Return the fraction of a shape step that keeps the film open, and the largest relative change of the film.

    Writes the change of the film by the full step to CHANGE of every node.
    """
    columns = film.shapes.shape[1]
    share = 1.0
    largest = 0.0
    for q in range(nodes.shape[1]):
        change = combined(film.shapes, q, step, columns)
        nodes[at.CHANGE, q] = change
        h = nodes[at.OPEN, q]
        if h < LEAST:
            h = LEAST
        relative = change / h
        if -relative * share > CLOSING and nodes[at.FILM, q] > 0.0:
            share = min(share, -CLOSING / relative)
        if abs(relative) > largest:
            largest = abs(relative)
    return share, largest


@kernel
def _advance(film, first, ring, step, unknowns, work):
    """Add the Newton step to the unknowns; a change of sign switches a node between full and ruptured.

    Returns the number of switched nodes and the largest change of pressure (over the highest) or of a void fraction.
    """
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    n_shapes = int(film.constants[at.N_SHAPES])
    columns = work.columns
    answer = work.border
    right = n_shapes + n_z
    # The solution for the residual has factor one; the solutions for shapes and border have factors from ``border``.
    step[0] = 1.0
    for k in range(1 + n_shapes, step.shape[0]):
        step[k] = answer[k - 1, right] if ring and k <= right else 0.0
    blocks = (1 + n_shapes + (n_z if ring else 0) + 7) // 8
    highest = 0.0
    for f in range(unknowns.shape[0]):
        if unknowns[f] > highest:
            highest = unknowns[f]
    slack = SWITCH * highest
    beyond = film.constants[at.SIDE_LIMIT]
    changed = 0
    moved = 0.0
    emptied = 0.0
    for position in range(n_phi):
        i = first + position
        if i >= n_phi:
            i -= n_phi
        for j in range(n_z):
            node = position * n_z + j
            f = i * n_z + j
            q = i * (n_z + 2) + j + 1
            if film.supply[f] > 0.0:
                continue
            if ring and position == n_phi - 1:
                change = answer[n_shapes + j, right]
            else:
                change = combined(columns[0], node, step, 8)
                for block in range(1, blocks):
                    change += combined(columns[block], node, step[8 * block :], 8)
            if work.nodes[at.FULL, q] > 0.0:
                change = pressure_change(change, work.nodes[at.THICKENING, q])
                u = work.nodes[at.PRESSURE, q] + change
                moved = max(moved, abs(change))
                if u < -slack:
                    if u < -beyond * highest:
                        changed += 1
                    u = -TINY
                elif u < 0.0:
                    u = 0.0
            else:
                u = work.nodes[at.VOID, q] + change
                emptied = max(emptied, abs(change))
                if u > SWITCH:
                    if u > beyond:
                        changed += 1
                    u = 0.0
                elif u > -TINY:
                    u = -TINY
            unknowns[f] = u
            is_full = u >= 0.0
            work.nodes[at.FULL, q] = 1.0 if is_full else 0.0
            work.nodes[at.PRESSURE, q] = u if is_full else 0.0
            work.nodes[at.VOID, q] = 0.0 if is_full else u
    for k in range(1 + n_shapes, step.shape[0]):
        step[k] = 0.0
    if highest > 0.0:
        moved /= highest
    return changed, max(moved, emptied)


@kernel
def _keep_filled(film, unknowns, void):
    """Limit void fractions to 1, in the unknowns and in ``void``. Return the number of clipped nodes."""
    n_z = int(film.constants[at.N_Z])
    clipped = 0
    for f in range(unknowns.shape[0]):
        if unknowns[f] < -1.0:
            unknowns[f] = -1.0
            i = f // n_z
            void[i * (n_z + 2) + f - i * n_z + 1] = -1.0
            clipped += 1
    return clipped
