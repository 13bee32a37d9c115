"""Oil balance of films in lanes: :func:`cranktrain.film.elastic.balance.oil_balance` with masks instead of branches.

Viscosity may depend on pressure, but the oil is incompressible.
"""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.singles import all_eight, choose, eight, most_of, put_eight
from cranktrain.film.elastic import grid as one
from cranktrain.film.elastic.balance import grid_factors, side_conductance
from cranktrain.film.lanes import grid as at


@kernel
def oil_balance(film, work, group, per_step):
    """Compute minus the residual of every node as right-hand side 0, the band of ∂R/∂u, and the factors of ∂R/∂H."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    around, across, _ = grid_factors(film.constants)
    thickens = film.constants[one.OIL_STEP] > 0.0
    for position in range(n_phi):
        _face_flows(work, group, position, n_phi, n_z, around, thickens)
    for position in range(n_phi):
        _column(work, group, position, n_phi, n_z, (around, across, per_step), thickens)


@inlined_kernel
def _face_flows(work, group, position, n_phi, n_z, around, thickens):
    """Compute the flow (1/s) from a column to the next, and its derivative by the distance of the surfaces at faces."""
    nodes = work.nodes[group]
    faces = work.faces[group]
    forward = eight(work.lane, at.FORWARD)
    backward = eight(work.lane, at.BACKWARD)
    q = position * (n_z + 2) + 1
    q_down = (position + 1 if position + 1 < n_phi else 0) * (n_z + 2) + 1
    for j in range(n_z):
        f = position * n_z + j
        h = eight(faces, (at.FACE_OPEN, f))
        if thickens:
            drop = eight(nodes, (at.REDUCED, q + j)) - eight(nodes, (at.REDUCED, q_down + j))
        else:
            drop = eight(nodes, (at.PRESSURE, q + j)) - eight(nodes, (at.PRESSURE, q_down + j))
        content = forward * (1.0 + eight(nodes, (at.VOID, q + j)))
        content = content - backward * (1.0 + eight(nodes, (at.VOID, q_down + j)))
        pressed = around * (h * h) * drop
        put_eight(faces, (at.FACE_FLOW, f), h * (pressed + content) + eight(faces, (at.FACE_EXTRA, f)))
        put_eight(faces, (at.FACE_FLUX, f), eight(faces, (at.FACE_SLOPE, f)) * (3.0 * pressed + content))


@inlined_kernel
def _column(work, group, position, n_phi, n_z, factors, thickens):
    """Compute the residual, the factors of ∂R/∂H and the band rows of one column."""
    around, across, per_step = factors
    nodes = work.nodes[group]
    faces = work.faces[group]
    band = work.band
    lines = n_z + 2
    up = position - 1 if position > 0 else n_phi - 1
    down = position + 1 if position + 1 < n_phi else 0
    one_ = all_eight(1.0)
    none = all_eight(0.0)
    forward = eight(work.lane, at.FORWARD)
    backward = eight(work.lane, at.BACKWARD)
    first = position * lines
    q_up = up * lines
    q_down = down * lines
    potential = at.REDUCED if thickens else at.PRESSURE
    own_open = eight(nodes, (at.OPEN, first + 1))
    last, by_own_last, by_last = side_conductance(own_open, eight(nodes, (at.OPEN, first)))
    p_before = eight(nodes, (potential, first))
    p = eight(nodes, (potential, first + 1))
    for line in range(1, n_z + 1):
        q = first + line
        f = position * n_z + line - 1
        row = f
        free = one_ - eight(work.supply[group], f)
        full = eight(nodes, (at.FULL, q))
        # Flow across the bore, and its derivatives by the distance of the surfaces.
        next_open = eight(nodes, (at.OPEN, q + 1))
        p_after = eight(nodes, (potential, q + 1))
        over, by_own, by_next = side_conductance(own_open, next_open)
        per_after = all_eight(across * work.lines[line, at.AFTER_SIDE])
        per_before = all_eight(across * work.lines[line, at.BEFORE_SIDE])
        after = per_after * over
        before = per_before * last
        to_after = p - p_after
        to_before = p - p_before
        flow = eight(faces, (at.FACE_FLOW, f)) - eight(faces, (at.FACE_FLOW, up * n_z + line - 1))
        flow = flow + (after * to_after + before * to_before)
        to_after = per_after * to_after
        to_before = per_before * to_before
        slope = eight(nodes, (at.SLOPE, q))
        own = slope * (to_after * by_own + to_before * by_own_last)
        put_eight(nodes, (at.AFTER, q), free * (to_after * by_next * eight(nodes, (at.SLOPE, q + 1))))
        put_eight(nodes, (at.BEFORE, q), free * (to_before * by_last * eight(nodes, (at.SLOPE, q - 1))))
        # Growth of the oil stored in a node; the formula depends on whether the node was void at the step's start.
        void = eight(nodes, (at.VOID, q))
        was_void = eight(nodes, (at.WAS_VOID, q))
        was_full = one_ - was_void
        growth = was_full * eight(nodes, (at.GROWTH, q))
        kept = was_void + void
        flow = flow + (slope * growth + per_step * (kept * own_open - eight(nodes, (at.MASS, q))))
        own = own + (eight(nodes, (at.BEND, q)) * growth + per_step * (kept * slope))
        put_eight(nodes, (at.OWN, q), free * own)
        put_eight(nodes, (at.SQUEEZE, q), free * (was_full * slope))
        put_eight(work.columns, (row, 0), none - free * flow)
        # Derivatives of the balance by the unknown of the node and by the unknowns of its neighbours.
        h = eight(faces, (at.FACE_OPEN, f))
        h_up = eight(faces, (at.FACE_OPEN, up * n_z + line - 1))
        g = around * (h * h * h)
        g_up = around * (h_up * h_up * h_up)
        pressing = g + g_up + (after + before)
        by_up = g_up
        by_down = g
        by_before = before
        by_after = after
        if thickens:
            pressing = pressing * eight(nodes, (at.MOBILITY, q))
            by_up = by_up * eight(nodes, (at.MOBILITY, q_up + line))
            by_down = by_down * eight(nodes, (at.MOBILITY, q_down + line))
            by_before = by_before * eight(nodes, (at.MOBILITY, q - 1))
            by_after = by_after * eight(nodes, (at.MOBILITY, q + 1))
        emptying = per_step * own_open + forward * h + backward * h_up
        answer = full * pressing + (one_ - full) * emptying
        answer = free * answer + (one_ - free)
        beside = eight(nodes, (at.FULL, q_up + line))
        by_up = free * (beside * by_up + (one_ - beside) * (forward * h_up))
        beside = eight(nodes, (at.FULL, q_down + line))
        by_down = free * (beside * by_down + (one_ - beside) * (backward * h))
        for column in range(2 * n_z + 1):
            put_eight(band, (row, column), none)
        put_eight(band, (row, n_z), answer)
        put_eight(band, (row, 0), none - by_up)
        put_eight(band, (row, 2 * n_z), none - by_down)
        if line > 1:
            put_eight(band, (row, n_z - 1), none - free * (by_before * eight(nodes, (at.FULL, q - 1))))
        if line < n_z:
            put_eight(band, (row, n_z + 1), none - free * (by_after * eight(nodes, (at.FULL, q + 1))))
        last = over
        by_own_last = by_next
        by_last = by_own
        own_open = next_open
        p_before = p
        p = p_after


@kernel
def take_sides(film, work, group, unknowns, own):
    """Compute pressure and void fraction of nodes from unknowns (b, N n) of films ``own`` (8,), unless RESIDENT."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    nodes = work.nodes[group]
    for lane in range(at.LANES):
        resident = work.marks[group, lane, at.RESIDENT]
        work.lane[8 * at.DONE + lane] = resident
        if resident > 0.0:
            continue
        cut = int(work.marks[group, lane, at.CUT])
        mine = unknowns[int(own[lane])]
        for position in range(n_phi):
            i = cut + position
            if i >= n_phi:
                i -= n_phi
            for j in range(n_z):
                u = mine[i * n_z + j]
                nodes[at.CHANGE, 8 * (position * lines + j + 1) + lane] = u
    resident = eight(work.lane, at.DONE) > 0.0
    supply = eight(work.lane, at.SUPPLY)
    none = all_eight(0.0)
    one_ = all_eight(1.0)
    for position in range(n_phi):
        for line in range(lines):
            q = position * lines + line
            if line == 0 or line == lines - 1:
                put_eight(nodes, (at.FULL, q), one_)
                put_eight(nodes, (at.PRESSURE, q), none)
                put_eight(nodes, (at.VOID, q), none)
                continue
            held = eight(work.supply[group], position * n_z + line - 1) > 0.0
            u = choose(held, supply, eight(nodes, (at.CHANGE, q)))
            full = u >= 0.0
            full_value = choose(full, one_, none)
            put_eight(nodes, (at.FULL, q), choose(resident, eight(nodes, (at.FULL, q)), full_value))
            put_eight(nodes, (at.PRESSURE, q), choose(resident, eight(nodes, (at.PRESSURE, q)), most_of(u, none)))
            put_eight(nodes, (at.VOID, q), choose(resident, eight(nodes, (at.VOID, q)), choose(full, none, u)))
