"""Coupling of bore shapes and film: sources, generalised forces and their derivatives, equations of the shapes.

The film is solved for several right-hand sides at once: first the residual and the bore's shapes, later the journal's
displacements and velocities. Each solution enters through its generalised forces ∫ S p dA only. S runs over the shapes
of x, y, a, b (−cos φ, −sin φ, −ζ cos φ, −ζ sin φ), which have the numbers 0 to 3, and the shapes of the bore.
Elasticity δ = C ∫ S (p + p_c) dA is then a small dense system in δ. Pressure does work on the mean gap h(H) of rough
surfaces, so it is multiplied by dh/dH, like the squeeze. Sources follow from the factors of ∂R/∂H computed by
:func:`cranktrain.film.elastic.balance.oil_balance`.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.side_by_side import (
    add_to,
    any_lane,
    choose,
    get,
    lane_count,
    minus_product,
    plus_product,
    put,
    rounded,
    spread,
)
from cranktrain.film.elastic import grid as one
from cranktrain.film.elastic import workspace as at
from cranktrain.film.elastic.balance import pressure_unit
from cranktrain.film.elastic.grid import BLOCK
from cranktrain.film.elastic.workspace import shape_count


@kernel
def film_area(constants):
    """Return A₀ = R Δφ ½L (m²), the area of a node per weight in ζ."""
    return constants[one.RADIUS] * 2.0 * math.pi / constants[one.N_PHI] * 0.5 * constants[one.WIDTH]


@kernel
def load_unit(constants):
    """Return the unit p₀ A₀ (N s) of dimensionless loads."""
    return pressure_unit(constants) * film_area(constants)


@kernel
def shape_sources(film, work, group, per_gain):
    """Compute −∂R/∂δ of every shape as right-hand sides 1 to S − 1; 1/g is ``per_gain``, by the stage's rule."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    nodes = work.nodes[group]
    faces = work.faces[group]
    shapes = work.shapes[group]
    start = n_phi * lines
    count = shape_count(film, work)
    for position in range(n_phi):
        up = position - 1 if position > 0 else n_phi - 1
        row = work.rows[position] * n_z
        for j in range(n_z):
            q = position * lines + j + 1
            f = position * n_z + j
            f_up = up * n_z + j
            free = 1.0 - get(work.supply[group], f)
            own = get(nodes, (at.OWN, q)) + per_gain * get(nodes, (at.SQUEEZE, q))
            after = get(nodes, (at.AFTER, q))
            before = get(nodes, (at.BEFORE, q))
            out = free * get(faces, (at.FACE_FLUX, f))
            into = free * get(faces, (at.FACE_FLUX, f_up))
            for k in range(count):
                change = minus_product(into * get(shapes, (start + f_up, k)), out, get(shapes, (start + f, k)))
                change = minus_product(change, own, get(shapes, (q, k)))
                change = minus_product(change, after, get(shapes, (q + 1, k)))
                put(work.columns, (row + j, k + 1), minus_product(change, before, get(shapes, (q - 1, k))))


@kernel
def motion_sources(film, work, group):
    """Compute −∂R/∂(x, y, a, b) and −∂R/∂(vx, vy, va, vb), all over the clearance, as right-hand sides 0 to 7.

    A displacement closes the film, so the shapes of x, y, a, b are −cos φ, −sin φ, −ζ cos φ, −ζ sin φ.
    """
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    nodes = work.nodes[group]
    faces = work.faces[group]
    columns = work.columns
    for position in range(n_phi):
        up = position - 1 if position > 0 else n_phi - 1
        cos = get(work.trig, (group, position, at.COS))
        sin = get(work.trig, (group, position, at.SIN))
        row = work.rows[position] * n_z
        for j in range(n_z):
            q = position * lines + j + 1
            f = position * n_z + j
            free = 1.0 - get(work.supply[group], f)
            zeta = work.lines[j + 1, at.ZETA]
            own = get(nodes, (at.OWN, q))
            after = get(nodes, (at.AFTER, q))
            before = get(nodes, (at.BEFORE, q))
            out = free * get(faces, (at.FACE_FLUX, f))
            into = free * get(faces, (at.FACE_FLUX, up * n_z + j))
            sides = own + after + before
            tilted = zeta * own + work.lines[j + 2, at.ZETA] * after + work.lines[j, at.ZETA] * before
            by_x = out * get(work.trig, (group, position, at.FACE_COS))
            by_x = by_x - into * get(work.trig, (group, up, at.FACE_COS))
            by_y = out * get(work.trig, (group, position, at.FACE_SIN))
            by_y = by_y - into * get(work.trig, (group, up, at.FACE_SIN))
            squeeze = get(nodes, (at.SQUEEZE, q))
            put(columns, (row + j, 0), by_x + sides * cos)
            put(columns, (row + j, 1), by_y + sides * sin)
            put(columns, (row + j, 2), zeta * by_x + tilted * cos)
            put(columns, (row + j, 3), zeta * by_y + tilted * sin)
            put(columns, (row + j, 4), squeeze * cos)
            put(columns, (row + j, 5), squeeze * sin)
            put(columns, (row + j, 6), zeta * squeeze * cos)
            put(columns, (row + j, 7), zeta * squeeze * sin)


@kernel
def solution_loads(film, work, group, first, to):
    """Compute the generalised forces ∫ S p dA / (p₀ A₀) of eight solutions from ``first`` on, in ``loads``."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    n_shapes = shape_count(film, work)
    nodes = work.nodes[group]
    for m in range(work.loads.shape[0]):
        for r in range(BLOCK):
            put(work.loads, (m, to + r), spread(0.0, nodes))
    for position in range(n_phi):
        pressed = spread(0.0, nodes)
        for j in range(n_z):
            q = position * (n_z + 2) + j + 1
            weight = get(nodes, (at.FULL, q)) * (get(nodes, (at.WEIGHT, q)) * get(nodes, (at.SLOPE, q)))
            put(nodes, (at.PRESSING, q), weight)
            pressed = pressed + weight
        if any_lane(pressed != 0.0):
            for half in range(0, BLOCK, 4):
                _motion_loads(work, group, position, n_z, first + half, to + half)
                for m in range(0, n_shapes - 1, 2):
                    _two_shapes(work, group, position, n_z, first + half, to + half, m)
                if n_shapes % 2 == 1:
                    _one_shape(work, group, position, n_z, first + half, to + half, n_shapes - 1)


@inlined_kernel
def _motion_loads(work, group, position, n_z, half, to):
    """Add the loads on x, y, a, b of one column's nodes for four solutions."""
    nodes = work.nodes[group]
    columns = work.columns
    row = work.rows[position] * n_z
    m0 = spread(0.0, nodes)
    m1 = m0
    m2 = m0
    m3 = m0
    t0 = m0
    t1 = m0
    t2 = m0
    t3 = m0
    for j in range(n_z):
        weight = get(nodes, (at.PRESSING, position * (n_z + 2) + j + 1))
        tilted = work.lines[j + 1, at.ZETA] * weight
        f = row + j
        x = get(columns, (f, half))
        m0 = plus_product(m0, weight, x)
        t0 = plus_product(t0, tilted, x)
        x = get(columns, (f, half + 1))
        m1 = plus_product(m1, weight, x)
        t1 = plus_product(t1, tilted, x)
        x = get(columns, (f, half + 2))
        m2 = plus_product(m2, weight, x)
        t2 = plus_product(t2, tilted, x)
        x = get(columns, (f, half + 3))
        m3 = plus_product(m3, weight, x)
        t3 = plus_product(t3, tilted, x)
    cos = get(work.trig, (group, position, at.COS))
    sin = get(work.trig, (group, position, at.SIN))
    _subtract_four(work.loads, 0, to, cos, (m0, m1, m2, m3))
    _subtract_four(work.loads, 1, to, sin, (m0, m1, m2, m3))
    _subtract_four(work.loads, 2, to, cos, (t0, t1, t2, t3))
    _subtract_four(work.loads, 3, to, sin, (t0, t1, t2, t3))


@inlined_kernel
def _subtract_four(loads, m, r, share, values):
    """Subtract ``share`` times four values from load m of the solutions r to r + 3."""
    v0, v1, v2, v3 = values
    put(loads, (m, r), minus_product(get(loads, (m, r)), share, v0))
    put(loads, (m, r + 1), minus_product(get(loads, (m, r + 1)), share, v1))
    put(loads, (m, r + 2), minus_product(get(loads, (m, r + 2)), share, v2))
    put(loads, (m, r + 3), minus_product(get(loads, (m, r + 3)), share, v3))


@inlined_kernel
def _two_shapes(work, group, position, n_z, half, to, m):
    """Add the loads on shapes m and m + 1 of one column's nodes for four solutions."""
    nodes = work.nodes[group]
    shapes = work.shapes[group]
    columns = work.columns
    row = work.rows[position] * n_z
    a0 = spread(0.0, work.columns)
    a1 = a0
    a2 = a0
    a3 = a0
    b0 = a0
    b1 = a0
    b2 = a0
    b3 = a0
    for j in range(n_z):
        q = position * (n_z + 2) + j + 1
        f = row + j
        weight = get(nodes, (at.PRESSING, q))
        first = weight * get(shapes, (q, m))
        second = weight * get(shapes, (q, m + 1))
        x = get(columns, (f, half))
        a0 = plus_product(a0, first, x)
        b0 = plus_product(b0, second, x)
        x = get(columns, (f, half + 1))
        a1 = plus_product(a1, first, x)
        b1 = plus_product(b1, second, x)
        x = get(columns, (f, half + 2))
        a2 = plus_product(a2, first, x)
        b2 = plus_product(b2, second, x)
        x = get(columns, (f, half + 3))
        a3 = plus_product(a3, first, x)
        b3 = plus_product(b3, second, x)
    _subtract_four(work.loads, 4 + m, to, -1.0, (a0, a1, a2, a3))
    _subtract_four(work.loads, 5 + m, to, -1.0, (b0, b1, b2, b3))


@inlined_kernel
def _one_shape(work, group, position, n_z, half, to, m):
    """Add the loads on the last shape m of one column's nodes for four solutions."""
    row = work.rows[position] * n_z
    a0 = spread(0.0, work.columns)
    a1 = a0
    a2 = a0
    a3 = a0
    for j in range(n_z):
        q = position * (n_z + 2) + j + 1
        f = row + j
        first = get(work.nodes[group], (at.PRESSING, q)) * get(work.shapes[group], (q, m))
        a0 = plus_product(a0, first, get(work.columns, (f, half)))
        a1 = plus_product(a1, first, get(work.columns, (f, half + 1)))
        a2 = plus_product(a2, first, get(work.columns, (f, half + 2)))
        a3 = plus_product(a3, first, get(work.columns, (f, half + 3)))
    _subtract_four(work.loads, 4 + m, to, -1.0, (a0, a1, a2, a3))


@kernel
def present_loads(film, work, group, newton):
    """Compute generalised forces of film and contact over p₀ A₀, in ``sums``, and their derivatives, in ``touching``.

    If ``newton``, the pressure includes right-hand side 0, the Newton change at fixed shapes.
    """
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    nodes = work.nodes[group]
    shapes = work.shapes[group]
    sums = work.sums
    lanes = lane_count(work.nodes)
    none = spread(0.0, nodes)
    count = 4 + shape_count(film, work)
    for m in range(count):
        for c in range(lanes):
            sums[lanes * m + c] = 0.0
        for k in range(count):
            put(work.touching, (m, k), none)
    for position in range(n_phi):
        cos = get(work.trig, (group, position, at.COS))
        sin = get(work.trig, (group, position, at.SIN))
        row = work.rows[position] * n_z
        middle = none
        tilted = none
        pressed = False
        for line in range(lines):
            q = position * lines + line
            contact = work.lines[line, at.WIDTH] * get(nodes, (at.CONTACT, q))
            p = none
            stiff = work.lines[line, at.WIDTH] * get(nodes, (at.CONTACT_SLOPE, q))
            if 0 < line <= n_z:
                now = get(nodes, (at.PRESSURE, q))
                weight = get(nodes, (at.WEIGHT, q))
                stiff = stiff + now * weight * get(nodes, (at.BEND, q))
                if newton:
                    now = now + get(work.columns, (row + line - 1, 0))
                p = get(nodes, (at.FULL, q)) * now * (weight * get(nodes, (at.SLOPE, q)))
            total = p + contact
            put(nodes, (at.PRESSING, q), total)
            pressed = pressed or any_lane(total != 0.0)
            middle = middle + total
            tilted = tilted + work.lines[line, at.ZETA] * total
            if any_lane(stiff != 0.0):
                _touching(work, group, q, stiff, (cos, sin, work.lines[line, at.ZETA]), count)
        if pressed:
            add_to(sums, 0, none - cos * middle)
            add_to(sums, 1, none - sin * middle)
            add_to(sums, 2, none - cos * tilted)
            add_to(sums, 3, none - sin * tilted)
            for k in range(count - 4):
                total = none
                for line in range(lines):
                    q = position * lines + line
                    total = plus_product(total, get(nodes, (at.PRESSING, q)), get(shapes, (q, k)))
                add_to(sums, 4 + k, total)
    for m in range(count):
        for k in range(m):
            put(work.touching, (m, k), get(work.touching, (k, m)))


@inlined_kernel
def _touching(work, group, q, stiff, place, count):
    """Add the stiffness of a node at fixed film pressure to the upper triangle of the derivatives of the loads."""
    cos, sin, zeta = place
    shapes = work.shapes[group]
    for m in range(count):
        s = stiff * _value(shapes, q, cos, sin, zeta, m)
        for k in range(m, count):
            value = plus_product(get(work.touching, (m, k)), s, _value(shapes, q, cos, sin, zeta, k))
            put(work.touching, (m, k), value)


@inlined_kernel
def _value(shapes, q, cos, sin, zeta, m):
    """Return the generalised shape m at a node."""
    if m >= 4:
        return get(shapes, (q, m - 4))
    value = 0.0 - (cos if m % 2 == 0 else sin)
    return zeta * value if m >= 2 else value


@kernel
def border_equations(film, work, right_sides, moving):
    """Assemble the equations of the shapes, with all nodes eliminated; right-hand sides start at column S.

    With one right-hand side it belongs to the Newton step with the loads ``sums``. With eight they belong to the last
    sources, of which the first ``moving`` are changes of x, y, a, b.
    """
    n_shapes = int(film.constants[one.N_SHAPES])
    right = work.border.shape[0]
    none = spread(0.0, work.border)
    area = film_area(film.constants) / film.constants[one.CLEARANCE]
    unit = area * rounded(work.wide, at.UNIT, work.border)
    for k in range(n_shapes):
        for column in range(n_shapes):
            put(work.border, (k, column), none)
        for column in range(right_sides):
            put(work.border, (k, right + column), none)
        put(work.border, (k, k), spread(1.0, work.border))
        if right_sides == 1:
            put(work.border, (k, right), 0.0 - rounded(work.shifts, (at.SHIFT, k), work.border))
        for m in range(4 + n_shapes):
            if film.compliance[k, m] == 0.0:
                continue
            yielding = film.compliance[k, m] * unit
            for column in range(n_shapes):
                change = get(work.loads, (m, 1 + column)) + get(work.touching, (m, 4 + column))
                put(work.border, (k, column), get(work.border, (k, column)) - yielding * change)
            if right_sides == 1:
                value = get(work.border, (k, right)) + yielding * rounded(work.sums, m, work.border)
                put(work.border, (k, right), value)
            else:
                for t in range(BLOCK):
                    change = get(work.loads, (m, right + t))
                    if t < moving:
                        change = change + get(work.touching, (m, t))
                    to = right + t
                    put(work.border, (k, to), get(work.border, (k, to)) + yielding * change)


@kernel
def eliminate(film, work, right_sides):
    """Solve the border equations 1 + C K (stiffness K of film and contact) without pivoting, and mark failed lanes."""
    n = int(film.constants[one.N_SHAPES])
    a = work.border
    right = a.shape[0]
    bad = get(work.lane, at.FAILED)
    for k in range(n):
        pivot = get(a, (k, k))
        fits = (pivot > 1.0e-6) | (pivot < -1.0e-6)
        bad = choose(fits, bad, 1.0)
        inverse = 1.0 / choose(fits, pivot, 1.0)
        put(a, (k, k), inverse)
        for i in range(k + 1, n):
            share = get(a, (i, k)) * inverse
            for c in range(k + 1, n):
                put(a, (i, c), minus_product(get(a, (i, c)), share, get(a, (k, c))))
            for c in range(right, right + right_sides):
                put(a, (i, c), minus_product(get(a, (i, c)), share, get(a, (k, c))))
    for k in range(n - 1, -1, -1):
        for c in range(right, right + right_sides):
            total = get(a, (k, c))
            for i in range(k + 1, n):
                total = minus_product(total, get(a, (k, i)), get(a, (i, c)))
            put(a, (k, c), total * get(a, (k, k)))
    put(work.lane, at.FAILED, bad)
