"""Coupling of bore shapes and film as a bordered matrix: generalised forces, Schur complement, tangents.

The film is solved for eight right-hand sides at once: first the residual and the bore's shapes, later the journal's
displacements and velocities. Each solution enters through its generalised forces ∫ S p dA only. S runs over the shapes
of x, y, a, b (−cos φ, −sin φ, −ζ cos φ, −ζ sin φ) and the shapes of the bore. Elasticity δ = C ∫ S (p + p_c) dA is then
a small dense system in δ. If the ring of columns has no gap, one column of nodes is added to this system. Pressure does
work on the mean gap h(H) of rough surfaces, so it is multiplied by dh/dH, like the squeeze.
"""

import math

from cranktrain.core.kernel import kernel
from cranktrain.core.vectors import LANES, load, splat, store
from cranktrain.film.elastic import grid as at
from cranktrain.film.elastic.band_blocks import solve_blocks
from cranktrain.film.elastic.height import pressure_unit
from cranktrain.film.elastic.sources import motion_sources


@kernel
def film_area(constants):
    """Return A₀ = R Δφ ½L (m²), the area of a node per weight in ζ."""
    return constants[at.RADIUS] * 2.0 * math.pi / constants[at.N_PHI] * 0.5 * constants[at.WIDTH]


@kernel
def load_unit(constants):
    """Return the unit p₀ A₀ (N s) of dimensionless loads."""
    return pressure_unit(constants) * film_area(constants)


@kernel
def shape_value(film, q, i, line, m):
    """Return the generalised shape m at node q: m = 0..3 are the journal motions x, y, a, b, larger m bore shapes."""
    if m >= 4:
        return film.shapes[q, m - 3]
    value = -film.trig[i, at.COS] if m % 2 == 0 else -film.trig[i, at.SIN]
    return value * film.lines[line, at.ZETA] if m >= 2 else value


@kernel
def solution_loads(film, first, chain, begin, end, work):
    """Compute the generalised forces ∫ S p dA / (p₀ A₀) of solution blocks ``begin`` … ``end`` − 1, in ``loads``."""
    for block in range(begin, end):
        _motion_loads(film, first, chain, block, work)
        for group in range(0, 1 + int(film.constants[at.N_SHAPES]), LANES):
            _shape_loads(film, first, chain, block, group, work)


@kernel
def _motion_loads(film, first, chain, block, work):
    """Compute the generalised forces of one solution block on the journal motions x, y, a, b."""
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    columns = work.columns[block]
    for half in range(0, 2 * LANES, LANES):
        by_x = splat(0.0)
        by_y = splat(0.0)
        by_a = splat(0.0)
        by_b = splat(0.0)
        for position in range(chain // n_z):
            i = first + position
            if i >= n_phi:
                i -= n_phi
            middle = splat(0.0)
            tilted = splat(0.0)
            for j in range(n_z):
                q = i * (n_z + 2) + j + 1
                if work.nodes[at.FULL, q] > 0.0:
                    weight = work.nodes[at.WEIGHT, q] * work.nodes[at.SLOPE, q]
                    pressing = weight * load(columns, (position * n_z + j, half))
                    middle = middle + pressing
                    tilted = tilted + film.lines[j + 1, at.ZETA] * pressing
            by_x = by_x - film.trig[i, at.COS] * middle
            by_y = by_y - film.trig[i, at.SIN] * middle
            by_a = by_a - film.trig[i, at.COS] * tilted
            by_b = by_b - film.trig[i, at.SIN] * tilted
        column = 2 * LANES * block + half
        store(work.loads, (0, column), by_x)
        store(work.loads, (1, column), by_y)
        store(work.loads, (2, column), by_a)
        store(work.loads, (3, column), by_b)


@kernel
def _shape_loads(film, first, chain, block, group, work):
    """Compute generalised forces of one block on four bore shapes from column ``group`` on; column 0 holds zeros."""
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    columns = work.columns[block]
    shapes = film.shapes
    low_0 = splat(0.0)
    low_1 = splat(0.0)
    low_2 = splat(0.0)
    low_3 = splat(0.0)
    high_0 = splat(0.0)
    high_1 = splat(0.0)
    high_2 = splat(0.0)
    high_3 = splat(0.0)
    for position in range(chain // n_z):
        i = first + position
        if i >= n_phi:
            i -= n_phi
        for j in range(n_z):
            q = i * (n_z + 2) + j + 1
            if work.nodes[at.FULL, q] > 0.0:
                weight = work.nodes[at.WEIGHT, q] * work.nodes[at.SLOPE, q]
                low = weight * load(columns, (position * n_z + j, 0))
                high = weight * load(columns, (position * n_z + j, LANES))
                low_0 = low_0 + shapes[q, group] * low
                high_0 = high_0 + shapes[q, group] * high
                low_1 = low_1 + shapes[q, group + 1] * low
                high_1 = high_1 + shapes[q, group + 1] * high
                low_2 = low_2 + shapes[q, group + 2] * low
                high_2 = high_2 + shapes[q, group + 2] * high
                low_3 = low_3 + shapes[q, group + 3] * low
                high_3 = high_3 + shapes[q, group + 3] * high
    if group > 0:
        _put_loads(work.loads, 3 + group, block, low_0, high_0)
    _put_loads(work.loads, 4 + group, block, low_1, high_1)
    _put_loads(work.loads, 5 + group, block, low_2, high_2)
    _put_loads(work.loads, 6 + group, block, low_3, high_3)


@kernel
def _put_loads(loads, row, block, low, high):
    """Write the loads of one block on one shape, unless ``row`` is beyond the last shape."""
    if row < loads.shape[0]:
        store(loads, (row, 2 * LANES * block), low)
        store(loads, (row, 2 * LANES * block + LANES), high)


@kernel
def present_loads(film, work):
    """Compute generalised forces of film and contact pressure over p₀ A₀, and derivatives at fixed film pressure.

    Writes ``work.touching`` (4 + k, 6 + k): derivatives, forces of contact, forces of the film.
    """
    n_phi = int(film.constants[at.N_PHI])
    lines = int(film.constants[at.N_Z]) + 2
    count = 4 + int(film.constants[at.N_SHAPES])
    pressure = work.nodes[at.PRESSURE]
    touching = work.touching
    for m in range(count):
        for k in range(count + 2):
            touching[m, k] = 0.0
    columns = film.shapes.shape[1]
    sums = work.vectors[at.SUMS]
    for r in range(columns):
        sums[r] = 0.0
    for i in range(n_phi):
        middle = 0.0
        tilted = 0.0
        for line in range(lines):
            q = i * lines + line
            p = pressure[q] * work.nodes[at.WEIGHT, q]
            contact = work.nodes[at.CONTACT, q]
            slope = p * work.nodes[at.BEND, q]
            if p > 0.0:
                p *= work.nodes[at.SLOPE, q]
                middle += p
                tilted += p * film.lines[line, at.ZETA]
                for r in range(0, columns, LANES):
                    store(sums, r, load(sums, r) + p * load(film.shapes, (q, r)))
            if contact > 0.0:
                weight = film.lines[line, at.LINE_WIDTH]
                slope += weight * work.nodes[at.CONTACT_SLOPE, q]
                for m in range(count):
                    touching[m, count] += weight * contact * shape_value(film, q, i, line, m)
            if slope != 0.0:
                for m in range(count):
                    s = slope * shape_value(film, q, i, line, m)
                    for k in range(m, count):
                        touching[m, k] += s * shape_value(film, q, i, line, k)
        for axis in range(2):
            along = film.trig[i, at.COS if axis == 0 else at.SIN]
            touching[axis, count + 1] -= along * middle
            touching[2 + axis, count + 1] -= along * tilted
    for m in range(count):
        for k in range(m):
            touching[m, k] = touching[k, m]
    for m in range(4, count):
        touching[m, count + 1] = sums[m - 3]


@kernel
def border_equations(film, first, ring, chain, right_sides, moving, work):
    """Assemble the equations of the shapes and of the border's column of nodes, all other nodes eliminated.

    Writes ``work.border``, with unknowns in the order shapes, column of nodes. Right-hand sides start at column
    k + n_z: one for the Newton step, or the eight of the last block, the first ``moving`` of which are by x, y, a, b.
    """
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    n_shapes = int(film.constants[at.N_SHAPES])
    count = 4 + n_shapes
    size = n_phi * n_z
    loads = work.loads
    touching = work.touching
    border = work.border
    columns = work.columns
    right = n_shapes + n_z
    last = columns.shape[0] - 1
    unit = load_unit(film.constants) / film.constants[at.CLEARANCE]
    b = first - 1 if first > 0 else n_phi - 1
    for k in range(n_shapes):
        row = border[k]
        for column in range(right + right_sides):
            row[column] = 0.0
        row[k] = 1.0
        if right_sides == 1:
            row[right] = -work.vectors[at.SHIFT, k + 1]
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
                    if work.nodes[at.FULL, q] > 0.0:
                        own = work.nodes[at.WEIGHT, q] * work.nodes[at.SLOPE, q]
                        own *= shape_value(film, q, b, j + 1, m)
                    row[n_shapes + j] -= yielding * (loads[m, 1 + n_shapes + j] + own)
            if right_sides == 1:
                row[right] += yielding * (loads[m, 0] + touching[m, count] + touching[m, count + 1])
            else:
                for t in range(8):
                    row[right + t] += yielding * loads[m, 8 * last + t]
                for t in range(moving):
                    row[right + t] += yielding * touching[m, t]
    if not ring:
        return
    for j in range(n_z):
        row = border[n_shapes + j]
        node = chain + j
        left = size - 2 * n_z + j
        by_left = work.band[node, 0]
        by_right = work.band[node, 2 * n_z]
        for column in range(right):
            slot = column + 1
            block = slot // 8
            r = slot - 8 * block
            row[column] = by_left * columns[block, left, r] + by_right * columns[block, j, r] - columns[block, node, r]
        row[n_shapes + j] += work.band[node, n_z]
        if j > 0:
            row[n_shapes + j - 1] += work.band[node, n_z - 1]
        if j < n_z - 1:
            row[n_shapes + j + 1] += work.band[node, n_z + 1]
        if right_sides == 1:
            row[right] = columns[0, node, 0] - by_left * columns[0, left, 0] - by_right * columns[0, j, 0]
        else:
            for t in range(8):
                row[right + t] = (
                    columns[last, node, t] - by_left * columns[last, left, t] - by_right * columns[last, j, t]
                )


@kernel
def eliminate(a, n_shapes, n_z, ring, right_sides):
    """Solve the border equations in place by Gauss elimination with partial pivoting. Return 0, or 1 if singular."""
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
def film_tangents(film, first, ring, work, out):
    """Compute derivatives of four forces by position and velocity at the converged solution, in ``out`` (OUT_SIZE,)."""
    motion_sources(film, work.nodes, work.faces, first, work.columns[work.columns.shape[0] - 1])
    _answer(film, first, ring, 4, work)
    for m in range(4):
        for t in range(4):
            out[at.STIFFNESS + 4 * m + t] = _force_change(film, first, ring, m, t, work) + _touch(film, m, t, work)
            out[at.DAMPING + 4 * m + t] = _force_change(film, first, ring, m, 4 + t, work)


@kernel
def _answer(film, first, ring, moving, work):
    """Solve nodes and shapes for the last block's eight sources; the first ``moving`` are displacements x, y, a, b."""
    n_z = int(film.constants[at.N_Z])
    size = int(film.constants[at.N_PHI]) * n_z
    chain = size - n_z if ring else size
    last = work.columns.shape[0] - 1
    solve_blocks(work.band, chain, n_z, work.columns[last])
    solution_loads(film, first, chain, last, last + 1, work)
    border_equations(film, first, ring, chain, 8, moving, work)
    eliminate(work.border, int(film.constants[at.N_SHAPES]), n_z, ring, 8)


@kernel
def _touch(film, m, t, work):
    """Return the derivative of force m by position t at fixed film pressure (contact stiffness), N/m."""
    return work.touching[m, t] * load_unit(film.constants) / film.constants[at.CLEARANCE]


@kernel
def _force_change(film, first, ring, m, t, work):
    """Return the derivative of force m by source t of the last block, through pressure and shapes, SI."""
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    n_shapes = int(film.constants[at.N_SHAPES])
    right = n_shapes + n_z
    total = work.loads[m, 8 * (work.columns.shape[0] - 1) + t]
    for k in range(n_shapes):
        total += (work.loads[m, 1 + k] + work.touching[m, 4 + k]) * work.border[k, right + t]
    if ring:
        b = first - 1 if first > 0 else n_phi - 1
        for j in range(n_z):
            q = b * (n_z + 2) + j + 1
            by = work.loads[m, 1 + n_shapes + j]
            if work.nodes[at.FULL, q] > 0.0:
                own = work.nodes[at.WEIGHT, q] * work.nodes[at.SLOPE, q]
                by += own * shape_value(film, q, b, j + 1, m)
            total += by * work.border[n_shapes + j, right + t]
    return total * load_unit(film.constants) / film.constants[at.CLEARANCE]
