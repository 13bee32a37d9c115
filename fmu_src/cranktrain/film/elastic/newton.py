"""Newton's method for elastic films: order of the columns, iterations, step and its limits, tangents.

The method is described in :mod:`cranktrain.film.elastic.film`.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.side_by_side import (
    any_lane,
    choose,
    get,
    lane_count,
    least_of,
    most_of,
    plus_product,
    put,
    rounded,
    spread,
)
from cranktrain.film.elastic import grid as one
from cranktrain.film.elastic import workspace as at
from cranktrain.film.elastic.balance import oil_balance
from cranktrain.film.elastic.band import factor_lanes, solve_lanes
from cranktrain.film.elastic.border import (
    border_equations,
    eliminate,
    film_area,
    motion_sources,
    present_loads,
    shape_sources,
    solution_loads,
)
from cranktrain.film.elastic.gaps import oil_state, open_gaps
from cranktrain.film.elastic.grid import BLOCK
from cranktrain.film.elastic.workspace import shape_count

LEAST = 2.0e-3
"""Lower bound, over the clearance, of the film thickness in the relative size of a Newton step."""
CLOSING = 0.7
"""Largest fraction of the film thickness by which a Newton step may close the film."""
TINY, TINY_SINGLE = 1.0e-30, 1.0e-20
"""Void fraction that marks a node that has just ruptured, in doubles and in singles."""
SWITCH, SWITCH_SINGLE = 1.0e-11, 1.0e-6
"""Limit below which a change of sign is rounding, for the void fraction and for pressure over the largest."""
LEAST_SIDE = 1.0e-5
"""Least SIDE_LIMIT that singles can meet."""
JUDGE, TAKE = 0, 1


@kernel
def arrange(film, work, group, per_step):
    """Choose the order of columns in the matrix. Return the half width of its band.

    Eight films in singles have their columns in the order from their cuts, and the matrix neglects the flow through the
    cut. The ring of a film in doubles is cut inside a ruptured region whose transport within Δt does not reach around.
    Without such a region the ring stays closed: columns enter from both sides in turn, so that neighbours are at most
    two places apart.
    """
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    if lane_count(work.nodes) > 1:
        return n_z
    lines = n_z + 2
    best = 0
    length = 0
    run = 0
    # The loop goes twice around, because a region of ruptured columns may include column 0.
    for k in range(2 * n_phi):
        i = k if k < n_phi else k - n_phi
        ruptured = True
        for j in range(1, n_z + 1):
            if work.nodes[group, at.FULL, i * lines + j] > 0.0:
                ruptured = False
                break
        run = run + 1 if ruptured else 0
        if run > length:
            length = run
            best = i
    length = min(length, n_phi)
    drive = work.lane[at.FORWARD] - work.lane[at.BACKWARD]
    if length >= 3 and drive >= 0.0:
        # Oil that flows into the second ruptured column is reduced by this factor in every column up to the last one.
        courant = drive / per_step if per_step > 0.0 else 1.0e300
        weakened = (length - 1) * math.log(courant / (1.0 + courant)) if courant > 0.0 else -1.0e300
        if weakened <= math.log(film.constants[one.AROUND_LIMIT]):
            first = best - length + 2
            for i in range(n_phi):
                work.rows[i] = (i - first) % n_phi
            return n_z
    for i in range(n_phi):
        work.rows[i] = 2 * i if 2 * i < n_phi else 2 * (n_phi - i) - 1
    return 2 * n_z


@kernel
def solve_films(film, work, group, sigma, rates, most):
    """Iterate Newton's method to convergence; the last step of every lane is computed but not yet applied.

    Only lanes in ``work.wanted`` iterate. ``work.status`` returns the iterations of each lane, 0 if it failed. Returns
    the iterations of the group and the half width of the last band. ``sigma`` is the roughness of the mean gap over the
    clearance, ``rates`` 1/Δt and 1/g.
    """
    per_step, per_gain = rates
    n_z = int(film.constants[one.N_Z])
    size = int(film.constants[one.N_PHI]) * n_z
    blocks = work.border.shape[0] // BLOCK
    lane = work.lane
    put(lane, at.ACTIVE, rounded(work.wanted, 0, lane))
    put(lane, at.FAILED, spread(0.0, lane))
    put(lane, at.DONE, spread(0.0, lane))
    for c in range(work.status.shape[0]):
        work.status[c] = 0.0
    width = n_z
    for done in range(1, most + 1):
        if done > 1:
            _advance(film, work, group, TAKE)
            _move_gaps(film, work, group, per_gain)
        open_gaps(film, work, group, sigma)
        oil_state(film, work, group)
        width = arrange(film, work, group, per_step)
        oil_balance(film, work, group, width, per_step)
        shape_sources(film, work, group, per_gain)
        factor_lanes(work.band, size, width, lane, at.FAILED)
        for block in range(blocks):
            solve_lanes(work.band, size, width, work.columns, BLOCK * block)
            solution_loads(film, work, group, BLOCK * block, BLOCK * block)
        _step(film, work, group, float(done))
        if not any_lane(get(lane, at.ACTIVE) * (1.0 - get(lane, at.FAILED)) > 0.0):
            return done, width
    return most, width


@kernel
def _step(film, work, group, passes):
    """Compute the Newton step of active lanes, and end lanes whose step is below the limits."""
    lane = work.lane
    right = work.border.shape[0]
    lanes = lane_count(work.nodes)
    present_loads(film, work, group, True)
    border_equations(film, work, 1, 0)
    eliminate(film, work, 1)
    active = get(lane, at.ACTIVE) > 0.0
    for k in range(int(film.constants[one.N_SHAPES])):
        step = get(work.border, (k, right))
        put(work.steps, (at.STEP, k), choose(active, step, get(work.steps, (at.STEP, k))))
    _reach(film, work, group)
    _judge(film, work, group)
    for c in range(lanes):
        if lane[lanes * at.DONE + c] > 0.0 and work.status[c] == 0.0 and lane[lanes * at.FAILED + c] == 0.0:
            work.status[c] = passes


@kernel
def _reach(film, work, group):
    """Compute the fraction of the step that keeps each film open, in SHARE, and multiply the step by this fraction.

    Writes the change of the gap of every node to CHANGE, and the largest relative change to MOST.
    """
    n_shapes = shape_count(film, work)
    nodes = work.nodes[group]
    shapes = work.shapes[group]
    lane = work.lane
    one_ = spread(1.0, lane)
    none = spread(0.0, lane)
    share = one_
    largest = none
    active = get(lane, at.ACTIVE) > 0.0
    for q in range(nodes.shape[1] // lane_count(work.nodes)):
        change = none
        for k in range(n_shapes):
            change = plus_product(change, get(shapes, (q, k)), get(work.steps, (at.STEP, k)))
        put(nodes, (at.CHANGE, q), choose(active, change, get(nodes, (at.CHANGE, q))))
        h = most_of(get(nodes, (at.OPEN, q)), LEAST)
        relative = change / h
        closing = (relative < 0.0) & (get(nodes, (at.FILM, q)) > 0.0)
        most = none - CLOSING / choose(closing, relative, one_)
        share = choose(closing & (none - relative * share > CLOSING), most, share)
        largest = most_of(most_of(relative, none - relative), largest)
    share = choose(active, share, one_)
    put(lane, at.SHARE, share)
    put(lane, at.MOST, largest)
    if not any_lane(share < 1.0):
        return
    for k in range(n_shapes):
        put(work.steps, (at.STEP, k), share * get(work.steps, (at.STEP, k)))
    for q in range(nodes.shape[1] // lane_count(work.nodes)):
        put(nodes, (at.CHANGE, q), share * get(nodes, (at.CHANGE, q)))


@kernel
def _judge(film, work, group):
    """Compute the change of every unknown, and end lanes whose changes are below the limits."""
    lane = work.lane
    constants = film.constants
    none = spread(0.0, lane)
    highest = none
    nodes = work.nodes[group]
    for q in range(nodes.shape[1] // lane_count(work.nodes)):
        highest = most_of(get(nodes, (at.PRESSURE, q)), highest)
    put(lane, at.HIGHEST_PRESSURE, highest)
    put(lane, at.CHANGED, none)
    put(lane, at.MOVED, none)
    _advance(film, work, group, JUDGE)
    active = get(lane, at.ACTIVE) > 0.0
    still = active & (get(lane, at.CHANGED) < 0.5) & (get(lane, at.SHARE) >= 1.0)
    still = still & (get(lane, at.MOST) < constants[one.STEP_LIMIT])
    still = still & (get(lane, at.MOVED) < constants[one.MOVE_LIMIT])
    put(lane, at.ACTIVE, choose(still, none, get(lane, at.ACTIVE)))
    put(lane, at.DONE, choose(still, 1.0, get(lane, at.DONE)))


@kernel
def _advance(film, work, group, mode):
    """Compute the changes of unknowns of active lanes (``mode`` JUDGE), or apply them (``mode`` TAKE)."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    nodes = work.nodes[group]
    columns = work.columns
    lane = work.lane
    none = spread(0.0, lane)
    one_ = spread(1.0, lane)
    highest = get(lane, at.HIGHEST_PRESSURE)
    tiny = TINY if lane_count(lane) == 1 else TINY_SINGLE
    switch = SWITCH if lane_count(lane) == 1 else SWITCH_SINGLE
    slack = none - switch * highest
    limit = max(film.constants[one.SIDE_LIMIT], 0.0 if lane_count(lane) == 1 else LEAST_SIDE)
    beyond = none - limit * highest
    per_highest = 1.0 / choose(highest > 0.0, highest, one_)
    active = get(lane, at.ACTIVE) > 0.0
    thickens = film.constants[one.OIL_STEP] > 0.0
    changed = get(lane, at.CHANGED)
    moved = get(lane, at.MOVED)
    n_shapes = shape_count(film, work)
    for position in range(n_phi):
        row = work.rows[position] * n_z
        for j in range(n_z):
            f = position * n_z + j
            q = position * (n_z + 2) + j + 1
            full = get(nodes, (at.FULL, q)) > 0.0
            p = get(nodes, (at.PRESSURE, q))
            void = get(nodes, (at.VOID, q))
            if mode == JUDGE:
                change = get(columns, (row + j, 0))
                for k in range(n_shapes):
                    change = plus_product(change, get(columns, (row + j, k + 1)), get(work.steps, (at.STEP, k)))
                if thickens:
                    fall = none - get(nodes, (at.THICKENING, q)) * change
                    change = choose(full & (fall > 0.0), change / (1.0 + 0.5 * fall), change)
                change = choose(get(work.supply[group], f) > 0.0, none, change)
                put(nodes, (at.NEXT, q), choose(active, change, get(nodes, (at.NEXT, q))))
                size = most_of(change, none - change)
                moved = most_of(choose(full, size * per_highest, size), moved)
                after = choose(full, p, void) + change
                turned = choose(full, choose(after < beyond, one_, none), choose(after > limit, one_, none))
                changed = most_of(turned, changed)
            else:
                after = choose(full, p, void) + get(nodes, (at.NEXT, q))
                emptied = choose(after < slack, -tiny, most_of(after, none))
                filled = choose(after > switch, none, least_of(after, -tiny))
                after = choose(full, emptied, filled)
                is_full = after >= 0.0
                put(nodes, (at.FULL, q), choose(active, choose(is_full, one_, none), get(nodes, (at.FULL, q))))
                put(nodes, (at.PRESSURE, q), choose(active, most_of(after, none), p))
                put(nodes, (at.VOID, q), choose(active, choose(is_full, none, after), void))
    put(lane, at.CHANGED, changed)
    put(lane, at.MOVED, moved)


@kernel
def _move_gaps(film, work, group, per_gain):
    """Add the step of active lanes to the gaps at nodes and faces and to the shapes."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    n_shapes = shape_count(film, work)
    nodes = work.nodes[group]
    faces = work.faces[group]
    shapes = work.shapes[group]
    lane = work.lane
    active = get(lane, at.ACTIVE)
    _move_shapes(work, n_shapes, at.ACTIVE)
    for q in range(nodes.shape[1] // lane_count(work.nodes)):
        change = active * get(nodes, (at.CHANGE, q))
        put(nodes, (at.FILM, q), get(nodes, (at.FILM, q)) + change)
        put(nodes, (at.GROWTH, q), get(nodes, (at.GROWTH, q)) + per_gain * change)
    first = n_phi * (n_z + 2)
    for f in range(n_phi * n_z):
        change = spread(0.0, lane)
        for k in range(n_shapes):
            change = plus_product(change, get(shapes, (first + f, k)), get(work.steps, (at.STEP, k)))
        put(faces, (at.FACE_FILM, f), get(faces, (at.FACE_FILM, f)) + active * change)


@inlined_kernel
def _move_shapes(work, n_shapes, mask):
    """Add the step of lanes with a mark in row ``mask`` to their shapes."""
    lanes = lane_count(work.nodes)
    for k in range(n_shapes):
        for c in range(lanes):
            work.shifts[at.SHIFT, lanes * k + c] += work.lane[lanes * mask + c] * work.steps[at.STEP, lanes * k + c]


@kernel
def take_last_step(film, work, group):
    """Apply the last step of converged lanes, after the tangents, which belong to the state before this step."""
    n_shapes = shape_count(film, work)
    nodes = work.nodes[group]
    done = get(work.lane, at.DONE)
    put(work.lane, at.ACTIVE, done)
    _advance(film, work, group, TAKE)
    _move_shapes(work, n_shapes, at.DONE)
    for q in range(nodes.shape[1] // lane_count(work.nodes)):
        change = done * get(nodes, (at.CHANGE, q))
        put(nodes, (at.FILM, q), get(nodes, (at.FILM, q)) + change)
        contact = get(nodes, (at.CONTACT, q))
        pressed = contact + get(nodes, (at.CONTACT_SLOPE, q)) * change
        put(nodes, (at.CONTACT, q), choose(contact > 0.0, pressed, contact))
        slope = get(nodes, (at.SLOPE, q)) + get(nodes, (at.BEND, q)) * change
        put(nodes, (at.SLOPE, q), slope)


@kernel
def film_tangents(film, work, group, width, outs):
    """Compute derivatives of the forces by position and velocity of lanes in ``work.tangents``, in ``outs``."""
    n_z = int(film.constants[one.N_Z])
    lanes = lane_count(work.nodes)
    last = work.border.shape[0]
    motion_sources(film, work, group)
    solve_lanes(work.band, int(film.constants[one.N_PHI]) * n_z, width, work.columns, 0)
    solution_loads(film, work, group, 0, last)
    border_equations(film, work, BLOCK, 4)
    eliminate(film, work, BLOCK)
    for m in range(4):
        for t in range(BLOCK):
            # The part through the shapes of the bore.
            total = get(work.loads, (m, last + t))
            for k in range(int(film.constants[one.N_SHAPES])):
                by_shape = get(work.loads, (m, 1 + k)) + get(work.touching, (m, 4 + k))
                total = plus_product(total, by_shape, get(work.border, (k, last + t)))
            put(work.loads, (m, last + t), total)
    for c in range(lanes):
        if work.tangents[c] > 0.0:
            unit = work.wide[lanes * at.UNIT + c] * film_area(film.constants) / film.constants[one.CLEARANCE]
            out = outs[int(work.own[c])]
            for m in range(4):
                for t in range(4):
                    change = work.loads[m, lanes * (last + t) + c] + work.touching[m, lanes * t + c]
                    out[one.STIFFNESS + 4 * m + t] = unit * change
                    out[one.DAMPING + 4 * m + t] = unit * work.loads[m, lanes * (last + 4 + t) + c]
