"""Pressure and rupture of a journal film by an active-set method.

Complementarity: on each node either Π > 0 and the balance A Π = b holds, or Π = 0 and the surplus b − A Π is not
positive. A is an M-matrix. An active-set method that removes all nodes in tension and adds all ruptured nodes with a
positive surplus therefore reaches the unique solution from any initial guess. The factors of the final set also give
the four unit solutions A λ = g.
"""

from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import four, put_four
from cranktrain.film.journal.blocks import Ring, factor_ring, solve_ring, solve_ring_four
from cranktrain.film.journal.grid import COS, GUEMBEL, RUPTURE, SIN, SWIFT_STIEBER, WEIGHT, ZETA

MOST_PASSES = 60
"""Limit of active-set iterations, in addition to one for each column."""
AHEAD = 0.3
"""Opening speed, as a fraction of the fastest approach, up to which a cold start takes a node as pressurised."""


@kernel
def rupture_pressure(grid, at, work, active):
    """Solve for pressure and rupture of the film at a Motion. Return the number of iterations, negative on failure."""
    axial = grid.axial
    blocked = grid.blocked
    columns = blocked.shape[0]
    padded = blocked.shape[1]
    n = axial.shape[1] - 1
    rupture = int(grid.settings[RUPTURE])
    cold = active[0, 0] < 0.0
    largest, fastest = _sources(axial, at, work)
    at_rest = largest == 0.0
    for i in range(columns):
        for j in range(padded):
            if blocked[i, j] != 0.0:
                active[i, j] = 0.0
            elif rupture != SWIFT_STIEBER or at_rest:
                active[i, j] = 1.0
            elif cold:
                # An initial set that is too large converges fast; a set that is too small grows only column by column.
                least = -AHEAD * fastest * work.width[0, i] * axial[WEIGHT, j] if j < n else 0.0
                active[i, j] = 1.0 if work.source[i, j] > least else 0.0
            else:
                active[i, j] = 1.0 if active[i, j] > 0.5 else 0.0
    tolerance = 1.0e-11 * largest
    p = work.pressure
    most = MOST_PASSES + columns
    if not (cold or at_rest) and rupture == SWIFT_STIEBER:
        _foresee(n, blocked, at, work, active, tolerance)
    for passes in range(1, most + 1):
        start, cyclic = ring_matrix(n, work, active)
        ring = Ring(work.around, work.used, start, cyclic, n, work.inverse, work.border)
        if factor_ring(ring, work.matrix[0], work.matrix[1], work.carried) != 0:
            return -passes
        for i in range(columns):
            for j in range(padded):
                p[i, j] = work.source[i, j] * active[i, j] if j < n else 0.0
        solve_ring(ring, p, work.carried[0])
        if rupture != SWIFT_STIEBER or at_rest:
            break
        if _change_set(n, blocked, work, active, tolerance) == 0:
            break
    else:
        return -most
    unit_sources(axial, work, active, work.unit)
    solve_ring_four(ring, work.unit, work.carried)
    if rupture == GUEMBEL:
        _share_of_compression(n, p, work.source)
        unit_sources(axial, work, work.source, work.adjoint)
        solve_ring_four(ring, work.adjoint, work.carried)
    return passes


@kernel
def _sources(axial, at, work):
    """Compute the cell sources of a Motion, in ``work.source``. Return the largest source and the fastest approach."""
    largest = 0.0
    fastest = 0.0
    for i in range(work.source.shape[0]):
        c = work.angle[COS, i]
        s = work.angle[SIN, i]
        middle = (at.vx * c + at.vy * s) * work.width[0, i]
        end = (at.wx * c + at.wy * s) * work.width[0, i]
        for j in range(axial.shape[1] - 1):
            g = (middle + axial[ZETA, j] * end) * axial[WEIGHT, j] * work.growth[0, i, j]
            work.source[i, j] = g
            largest = max(largest, abs(g))
            fastest = max(fastest, abs(middle + axial[ZETA, j] * end) / work.width[0, i])
    return largest, fastest


@kernel
def unit_sources(axial, work, share, unit):
    """Compute the unit sources h′(n, ζ n) by cells, times node weights ``share`` (N, m), in ``unit`` (N, m, 4)."""
    for i in range(share.shape[0]):
        c = work.angle[COS, i] * work.width[0, i]
        s = work.angle[SIN, i] * work.width[0, i]
        for j in range(axial.shape[1] - 1):
            g = axial[WEIGHT, j] * work.growth[0, i, j] * share[i, j]
            put_four(unit[i, j], 0, (c * g, s * g, c * g * axial[ZETA, j], s * g * axial[ZETA, j]))


@kernel
def _foresee(n, blocked, at, work, active, tolerance):
    """Predict the active set at the new velocity from the last unit solutions, if they belong to the present set."""
    columns = active.shape[0]
    p = work.pressure
    for i in range(columns):
        count = 0.0
        for j in range(n):
            count += active[i, j]
        if count != work.used[i]:
            return
    for i in range(columns):
        for j in range(n):
            p[i, j] = 0.0
            if active[i, j] > 0.5:
                x, y, a, b = four(work.unit[i, j], 0)
                p[i, j] = max(x * at.vx + y * at.vy + a * at.wx + b * at.wy, 0.0)
                if p[i, j] == 0.0:
                    active[i, j] = 0.0
    _change_set(n, blocked, work, active, tolerance)


@kernel
def _change_set(n, blocked, work, active, tolerance):
    """Remove nodes in tension from the active set, add nodes with positive surplus. Return the number of changes."""
    columns = active.shape[0]
    p = work.pressure
    around = work.conduct[0]
    along = work.conduct[1]
    changed = 0
    for i in range(columns):
        before = i - 1 if i > 0 else columns - 1
        after = i + 1 if i + 1 < columns else 0
        for j in range(n):
            if active[i, j] > 0.5:
                if p[i, j] < 0.0:
                    active[i, j] = 0.0
                    changed += 1
            elif blocked[i, j] == 0.0:
                push = work.source[i, j] + around[before, j] * p[before, j] + around[i, j] * p[after, j]
                if j > 0:
                    push += along[i, j] * p[i, j - 1]
                if j + 1 < n:
                    push += along[i, j + 1] * p[i, j + 1]
                if push > tolerance:
                    active[i, j] = 1.0
                    changed += 1
    return changed


@kernel
def _share_of_compression(n, p, share):
    """Compute ∂(∫max(p, 0))/∂p of each node, in cells: one or zero, except at nodes next to a change of sign.

    At a change of sign the positive triangle counts, not half a cell. Half a cell would give steps in the force and a
    first-order error in its derivative.
    """
    columns = p.shape[0]
    for i in range(columns):
        for j in range(n):
            share[i, j] = 1.0 if p[i, j] > 0.0 else 0.0
    for i in range(columns):
        after = i + 1 if i + 1 < columns else 0
        for j in range(n):
            a = p[i, j]
            b = p[after, j]
            if a > 0.0 and b < 0.0:
                kept = a / (a - b)
                share[i, j] -= 0.5 * (1.0 - kept) * (1.0 - kept)
                share[after, j] += 0.5 * kept * kept
            elif a < 0.0 and b > 0.0:
                kept = b / (b - a)
                share[after, j] -= 0.5 * (1.0 - kept) * (1.0 - kept)
                share[i, j] += 0.5 * kept * kept


@kernel
def ring_matrix(n, work, active):
    """Compute the matrix of the active set. Return the first column of the ring, and whether the ring is closed."""
    columns = active.shape[0]
    padded = active.shape[1]
    around = work.conduct[0]
    along = work.conduct[1]
    diagonal = work.matrix[0]
    coupling = work.matrix[1]
    start = 0
    cyclic = True
    for i in range(columns):
        before = i - 1 if i > 0 else columns - 1
        after = i + 1 if i + 1 < columns else 0
        count = 0.0
        linked = 0.0
        for j in range(padded):
            here = active[i, j]
            diagonal[i, j] = 1.0
            coupling[i, j] = 0.0
            both = here * active[after, j]
            work.around[i, j] = around[i, j] * both
            count += here
            linked += both
        for j in range(n):
            if active[i, j] > 0.5:
                diagonal[i, j] = around[before, j] + around[i, j] + along[i, j] + along[i, j + 1]
                if j > 0:
                    coupling[i, j] = along[i, j] * active[i, j - 1]
        work.used[i] = count
        if linked == 0.0 and cyclic:
            start = after
            cyclic = False
    return start, cyclic
