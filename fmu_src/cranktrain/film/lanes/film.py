"""Newton's method of :func:`cranktrain.film.elastic.film.elastic_film` for eight elastic films in lanes.

A converged lane keeps the state of its last matrix while other lanes iterate, so repeated computations give the same
result. A film's result therefore does not depend on the other lanes. Films that do not converge in lanes, and films of
compressible oil, are solved by the solver of single films.
"""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.singles import (
    all_eight,
    any_lane,
    choose,
    eight,
    least_of,
    most_of,
    plus_product,
    put_eight,
    rounded,
)
from cranktrain.film.elastic import grid as one
from cranktrain.film.elastic.border import film_area
from cranktrain.film.elastic.film import CLOSING, LEAST
from cranktrain.film.lanes import grid as at
from cranktrain.film.lanes.balance import oil_balance
from cranktrain.film.lanes.band import factor_lanes, solve_lanes
from cranktrain.film.lanes.border import (
    border_equations,
    eliminate,
    motion_sources,
    present_loads,
    shape_sources,
    solution_loads,
)
from cranktrain.film.lanes.gaps import oil_state, open_gaps

MOST_PASSES = 12
"""Limit of Newton iterations; a film in lanes that needs more usually does not converge at all."""
TINY = 1.0e-20
"""Void fraction that marks a node that has just ruptured."""
SWITCH = 1.0e-6
"""Limit below which a change of sign is rounding, for the void fraction and for pressure over the largest."""
JUDGE, TAKE = 0, 1
LEAST_SIDE = 1.0e-5
"""Least SIDE_LIMIT that single precision can meet."""


@kernel
def solve_films(film, work, group, per_step, per_gain):
    """Iterate Newton's method to convergence; the last step of every lane is computed but not yet applied.

    Only lanes in ``work.wanted`` iterate. ``work.status`` returns the iterations of each lane, 0 if it failed. Returns
    the iterations of the group.
    """
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    size = n_phi * n_z
    sigma = film.constants[one.ROUGHNESS]
    lane = work.lane
    put_eight(lane, at.ACTIVE, rounded(work.wanted, 0))
    put_eight(lane, at.FAILED, all_eight(0.0))
    put_eight(lane, at.DONE, all_eight(0.0))
    for c in range(at.LANES):
        work.status[c] = 0.0
    for done in range(1, MOST_PASSES + 1):
        if done > 1:
            _advance(film, work, group, TAKE)
            _move_gaps(film, work, group, per_gain)
        open_gaps(film, work, group, 1.0 / sigma, sigma)
        oil_state(film, work, group)
        oil_balance(film, work, group, per_step)
        shape_sources(film, work, group, per_gain)
        factor_lanes(work.band, size, n_z, lane, at.FAILED)
        solve_lanes(work.band, size, n_z, work.columns)
        solution_loads(film, work, group, 0)
        _step(film, work, group, float(done))
        if not any_lane(eight(lane, at.ACTIVE) * (1.0 - eight(lane, at.FAILED)) > 0.0):
            return done
    return MOST_PASSES


@kernel
def _step(film, work, group, passes):
    """Compute the Newton step of active lanes, and end lanes whose step is below the limits."""
    lane = work.lane
    present_loads(film, work, group, True)
    border_equations(film, work, 1, 0)
    eliminate(film, work, 1)
    active = eight(lane, at.ACTIVE) > 0.0
    for k in range(at.MOST_SHAPES):
        step = eight(work.border, (k, at.MOST_SHAPES))
        put_eight(lane, at.STEP + k, choose(active, step, eight(lane, at.STEP + k)))
    _reach(film, work, group)
    _judge(film, work, group)
    for c in range(at.LANES):
        if lane[8 * at.DONE + c] > 0.0 and work.status[c] == 0.0 and lane[8 * at.FAILED + c] == 0.0:
            work.status[c] = passes


@kernel
def _reach(film, work, group):
    """Compute the fraction of the step that keeps each film open, in SHARE, and multiply the step by this fraction.

    Writes the change of the gap of every node to CHANGE, and the largest relative change to MOST.
    """
    n_shapes = int(film.constants[one.N_SHAPES])
    nodes = work.nodes[group]
    shapes = work.shapes[group]
    lane = work.lane
    one_ = all_eight(1.0)
    none = all_eight(0.0)
    share = one_
    largest = none
    active = eight(lane, at.ACTIVE) > 0.0
    for q in range(nodes.shape[1] // 8):
        change = none
        for k in range(n_shapes):
            change = plus_product(change, eight(shapes, (q, k)), eight(lane, at.STEP + k))
        put_eight(nodes, (at.CHANGE, q), choose(active, change, eight(nodes, (at.CHANGE, q))))
        h = most_of(eight(nodes, (at.OPEN, q)), all_eight(LEAST))
        relative = change / h
        closing = (relative < 0.0) & (eight(nodes, (at.FILM, q)) > 0.0)
        most = none - CLOSING / choose(closing, relative, one_)
        share = choose(closing & (none - relative * share > CLOSING), most, share)
        largest = most_of(most_of(relative, none - relative), largest)
    share = choose(active, share, one_)
    put_eight(lane, at.SHARE, share)
    put_eight(lane, at.MOST, largest)
    if not any_lane(share < 1.0):
        return
    for k in range(n_shapes):
        put_eight(lane, at.STEP + k, share * eight(lane, at.STEP + k))
    for q in range(nodes.shape[1] // 8):
        put_eight(nodes, (at.CHANGE, q), share * eight(nodes, (at.CHANGE, q)))


@kernel
def _judge(film, work, group):
    """Compute the change of every unknown, and end lanes whose changes are below the limits."""
    lane = work.lane
    constants = film.constants
    none = all_eight(0.0)
    highest = none
    nodes = work.nodes[group]
    for q in range(nodes.shape[1] // 8):
        highest = most_of(eight(nodes, (at.PRESSURE, q)), highest)
    put_eight(lane, at.HIGHEST_PRESSURE, highest)
    put_eight(lane, at.CHANGED, none)
    put_eight(lane, at.MOVED, none)
    _advance(film, work, group, JUDGE)
    active = eight(lane, at.ACTIVE) > 0.0
    still = active & (eight(lane, at.CHANGED) < 0.5) & (eight(lane, at.SHARE) >= 1.0)
    still = still & (eight(lane, at.MOST) < constants[one.STEP_LIMIT])
    still = still & (eight(lane, at.MOVED) < constants[one.MOVE_LIMIT])
    put_eight(lane, at.ACTIVE, choose(still, none, eight(lane, at.ACTIVE)))
    put_eight(lane, at.DONE, choose(still, all_eight(1.0), eight(lane, at.DONE)))


@kernel
def _advance(film, work, group, mode):
    """Compute the changes of unknowns of active lanes (``mode`` JUDGE), or apply them (``mode`` TAKE)."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    nodes = work.nodes[group]
    columns = work.columns
    lane = work.lane
    none = all_eight(0.0)
    one_ = all_eight(1.0)
    highest = eight(lane, at.HIGHEST_PRESSURE)
    slack = none - SWITCH * highest
    limit = max(film.constants[one.SIDE_LIMIT], LEAST_SIDE)
    beyond = none - limit * highest
    per_highest = 1.0 / choose(highest > 0.0, highest, one_)
    active = eight(lane, at.ACTIVE) > 0.0
    thickens = film.constants[one.OIL_STEP] > 0.0
    changed = eight(lane, at.CHANGED)
    moved = eight(lane, at.MOVED)
    for position in range(n_phi):
        for j in range(n_z):
            f = position * n_z + j
            q = position * (n_z + 2) + j + 1
            full = eight(nodes, (at.FULL, q)) > 0.0
            p = eight(nodes, (at.PRESSURE, q))
            void = eight(nodes, (at.VOID, q))
            if mode == JUDGE:
                change = eight(columns, (f, 0))
                for k in range(at.MOST_SHAPES):
                    change = plus_product(change, eight(columns, (f, k + 1)), eight(lane, at.STEP + k))
                if thickens:
                    fall = none - eight(nodes, (at.THICKENING, q)) * change
                    change = choose(full & (fall > 0.0), change / (1.0 + 0.5 * fall), change)
                change = choose(eight(work.supply[group], f) > 0.0, none, change)
                put_eight(nodes, (at.NEXT, q), choose(active, change, eight(nodes, (at.NEXT, q))))
                size = most_of(change, none - change)
                moved = most_of(choose(full, size * per_highest, size), moved)
                after = choose(full, p, void) + change
                turned = choose(full, choose(after < beyond, one_, none), choose(after > limit, one_, none))
                changed = most_of(turned, changed)
            else:
                after = choose(full, p, void) + eight(nodes, (at.NEXT, q))
                emptied = choose(after < slack, all_eight(-TINY), most_of(after, none))
                filled = choose(after > SWITCH, none, least_of(after, all_eight(-TINY)))
                after = choose(full, emptied, filled)
                is_full = after >= 0.0
                put_eight(nodes, (at.FULL, q), choose(active, choose(is_full, one_, none), eight(nodes, (at.FULL, q))))
                put_eight(nodes, (at.PRESSURE, q), choose(active, most_of(after, none), p))
                put_eight(nodes, (at.VOID, q), choose(active, choose(is_full, none, after), void))
    put_eight(lane, at.CHANGED, changed)
    put_eight(lane, at.MOVED, moved)


@kernel
def _move_gaps(film, work, group, per_gain):
    """Add the step of active lanes to the gaps at nodes and faces and to the shapes."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    n_shapes = int(film.constants[one.N_SHAPES])
    nodes = work.nodes[group]
    faces = work.faces[group]
    shapes = work.shapes[group]
    lane = work.lane
    active = eight(lane, at.ACTIVE)
    for c in range(at.LANES):
        for k in range(n_shapes):
            work.wide[8 * (at.SHIFT + k) + c] += lane[8 * at.ACTIVE + c] * lane[8 * (at.STEP + k) + c]
    for q in range(nodes.shape[1] // 8):
        change = active * eight(nodes, (at.CHANGE, q))
        put_eight(nodes, (at.FILM, q), eight(nodes, (at.FILM, q)) + change)
        put_eight(nodes, (at.GROWTH, q), eight(nodes, (at.GROWTH, q)) + per_gain * change)
    first = n_phi * (n_z + 2)
    for f in range(n_phi * n_z):
        change = all_eight(0.0)
        for k in range(n_shapes):
            change = plus_product(change, eight(shapes, (first + f, k)), eight(lane, at.STEP + k))
        put_eight(faces, (at.FACE_FILM, f), eight(faces, (at.FACE_FILM, f)) + active * change)


@kernel
def take_last_step(film, work, group):
    """Apply the last step of converged lanes, after the tangents, which belong to the state before this step."""
    n_shapes = int(film.constants[one.N_SHAPES])
    nodes = work.nodes[group]
    done = eight(work.lane, at.DONE)
    put_eight(work.lane, at.ACTIVE, done)
    _advance(film, work, group, TAKE)
    for c in range(at.LANES):
        for k in range(n_shapes):
            work.wide[8 * (at.SHIFT + k) + c] += work.lane[8 * at.DONE + c] * work.lane[8 * (at.STEP + k) + c]
    for q in range(nodes.shape[1] // 8):
        change = done * eight(nodes, (at.CHANGE, q))
        put_eight(nodes, (at.FILM, q), eight(nodes, (at.FILM, q)) + change)
        contact = eight(nodes, (at.CONTACT, q))
        pressed = contact + eight(nodes, (at.CONTACT_SLOPE, q)) * change
        put_eight(nodes, (at.CONTACT, q), choose(contact > 0.0, pressed, contact))
        slope = eight(nodes, (at.SLOPE, q)) + eight(nodes, (at.BEND, q)) * change
        put_eight(nodes, (at.SLOPE, q), slope)


@kernel
def film_tangents(film, work, group, outs, wanted, own):
    """Compute derivatives of the forces by position and velocity of ``wanted`` lanes, in ``outs`` (b, OUT_SIZE)."""
    motion_sources(film, work, group)
    _answer(film, work, group, 4)
    for c in range(at.LANES):
        if wanted[c] > 0.0:
            unit = _tangent_unit(film, work, c)
            out = outs[int(own[c])]
            for m in range(4):
                for t in range(4):
                    change = work.loads[m, 8 * (at.SIDES + t) + c] + work.touching[m, 8 * t + c]
                    out[one.STIFFNESS + 4 * m + t] = unit * change
                    out[one.DAMPING + 4 * m + t] = unit * work.loads[m, 8 * (at.SIDES + 4 + t) + c]


@inlined_kernel
def _tangent_unit(film, work, c):
    """Return p₀ A₀ of a lane over the clearance, N s/m."""
    return work.wide[8 * at.UNIT + c] * film_area(film.constants) / film.constants[one.CLEARANCE]


@kernel
def _answer(film, work, group, moving):
    """Compute load changes by eight sources, with bore shapes; the first ``moving`` are displacements x, y, a, b."""
    n_z = int(film.constants[one.N_Z])
    solve_lanes(work.band, int(film.constants[one.N_PHI]) * n_z, n_z, work.columns)
    solution_loads(film, work, group, at.SIDES)
    border_equations(film, work, at.SIDES, moving)
    eliminate(film, work, at.SIDES)
    _force_changes(film, work)


@kernel
def _force_changes(film, work):
    """Add the contribution of the bore shapes to the force changes, which were computed with fixed shapes."""
    for m in range(4):
        for t in range(at.SIDES):
            total = eight(work.loads, (m, at.SIDES + t))
            for k in range(int(film.constants[one.N_SHAPES])):
                by_shape = eight(work.loads, (m, 1 + k)) + eight(work.touching, (m, 4 + k))
                total = plus_product(total, by_shape, eight(work.border, (k, at.MOST_SHAPES + t)))
            put_eight(work.loads, (m, at.SIDES + t), total)
