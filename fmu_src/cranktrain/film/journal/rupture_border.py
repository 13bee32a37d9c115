"""Tangents of a ruptured journal film whose rupture border lies between nodes.

The pressure of :mod:`cranktrain.film.journal.rupture` is of second order for any position of the border. A unit
solution on the same set, however, ends at the first ruptured node, up to half a cell from the border, so stiffness and
damping would jump by some 1 % each time a node ruptures. Near the border Π = ½κ(x* − x)², which five-point differences
satisfy exactly except for a shift. With the first ruptured node at x = 0, cells of width h and the last pressure q,

    q = ½κ h² (1 + 2x*/h),      x*/h = r − ½,      r = q/(κh²) in [0, 1],

where r is the fraction of the ruptured node's surplus that comes from its neighbours' pressure. The unit solutions fall
to zero at x*, h (½ + r) from the last node: the conductance of that face is divided by ½ + r (Shortley and Weller
1938). As r reaches 1 the node joins the film at r = 0 with the same border, so the tangents pass smoothly.
"""

from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import four, put_four
from cranktrain.film.journal.blocks import Ring, factor_ring, solve_ring_four
from cranktrain.film.journal.film import FORCE, journal_tangents
from cranktrain.film.journal.grid import RUPTURE, SWIFT_STIEBER
from cranktrain.film.journal.rupture import ring_matrix, unit_sources


@kernel
def border_tangents(grid, at, work, active, out):
    """Correct the tangents (not the force) of ``journal_film`` in ``out`` (36,). Return 0, or 1 for a failed pivot."""
    if int(grid.settings[RUPTURE]) != SWIFT_STIEBER:
        return 0
    n = grid.axial.shape[1] - 1
    start, cyclic = ring_matrix(n, work, active)
    _move_border(n, grid.blocked, work, active)
    ring = Ring(work.around, work.used, start, cyclic, n, work.inverse, work.border)
    if factor_ring(ring, work.matrix[0], work.matrix[1], work.carried) != 0:
        return 1
    unit_sources(grid.axial, work, active, work.unit)
    solve_ring_four(ring, work.unit, work.carried)
    force = four(out, FORCE)
    journal_tangents(grid, at, work, active, out)
    put_four(out, FORCE, force)
    return 0


@kernel
def _move_border(n, blocked, work, active):
    """Adapt the matrix of the unit solutions to the rupture border's position, by the conductance of faces at it."""
    columns = active.shape[0]
    p = work.pressure
    around = work.conduct[0]
    along = work.conduct[1]
    diagonal = work.matrix[0]
    for i in range(columns):
        before = i - 1 if i > 0 else columns - 1
        after = i + 1 if i + 1 < columns else 0
        for j in range(n):
            if active[i, j] > 0.5 or blocked[i, j] != 0.0 or work.source[i, j] >= 0.0:
                continue
            behind = active[before, j] > 0.5
            ahead = active[after, j] > 0.5
            if not (behind or ahead):
                continue
            push = around[before, j] * p[before, j] + around[i, j] * p[after, j]
            if j > 0:
                push += along[i, j] * p[i, j - 1]
            if j + 1 < n:
                push += along[i, j + 1] * p[i, j + 1]
            share = min(push / -work.source[i, j], 1.0)
            factor = 1.0 / (0.5 + share) - 1.0
            if behind:
                diagonal[before, j] += around[before, j] * factor
            if ahead:
                diagonal[after, j] += around[i, j] * factor
