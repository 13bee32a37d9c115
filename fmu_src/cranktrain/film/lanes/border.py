"""Sources and loads by bore shapes and journal motion of films in lanes, as :mod:`cranktrain.film.elastic.border`.

Generalised forces have the same numbers: 0..3 for x, y, a, b (−cos φ, −sin φ, −ζ cos φ, −ζ sin φ), then the shapes of
the bore.
"""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.singles import (
    add_to,
    all_eight,
    any_lane,
    choose,
    eight,
    minus_product,
    plus_product,
    put_eight,
    rounded,
)
from cranktrain.film.elastic import grid as one
from cranktrain.film.elastic.border import film_area
from cranktrain.film.lanes import grid as at


@kernel
def shape_sources(film, work, group, per_gain):
    """Compute −∂R/∂δ of every shape as right-hand sides 1 to 7."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    nodes = work.nodes[group]
    faces = work.faces[group]
    shapes = work.shapes[group]
    start = n_phi * lines
    for position in range(n_phi):
        up = position - 1 if position > 0 else n_phi - 1
        for j in range(n_z):
            q = position * lines + j + 1
            f = position * n_z + j
            f_up = up * n_z + j
            free = 1.0 - eight(work.supply[group], f)
            own = eight(nodes, (at.OWN, q)) + per_gain * eight(nodes, (at.SQUEEZE, q))
            after = eight(nodes, (at.AFTER, q))
            before = eight(nodes, (at.BEFORE, q))
            out = free * eight(faces, (at.FACE_FLUX, f))
            into = free * eight(faces, (at.FACE_FLUX, f_up))
            for k in range(at.MOST_SHAPES):
                change = minus_product(into * eight(shapes, (start + f_up, k)), out, eight(shapes, (start + f, k)))
                change = minus_product(change, own, eight(shapes, (q, k)))
                change = minus_product(change, after, eight(shapes, (q + 1, k)))
                put_eight(work.columns, (f, k + 1), minus_product(change, before, eight(shapes, (q - 1, k))))


@kernel
def motion_sources(film, work, group):
    """Compute −∂R/∂(x, y, a, b) and −∂R/∂(vx, vy, va, vb), all over the clearance, as right-hand sides 0 to 7."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    nodes = work.nodes[group]
    faces = work.faces[group]
    columns = work.columns
    for position in range(n_phi):
        up = position - 1 if position > 0 else n_phi - 1
        cos = eight(work.trig, (group, position, at.COS))
        sin = eight(work.trig, (group, position, at.SIN))
        for j in range(n_z):
            q = position * lines + j + 1
            f = position * n_z + j
            free = 1.0 - eight(work.supply[group], f)
            zeta = work.lines[j + 1, at.ZETA]
            own = eight(nodes, (at.OWN, q))
            after = eight(nodes, (at.AFTER, q))
            before = eight(nodes, (at.BEFORE, q))
            out = free * eight(faces, (at.FACE_FLUX, f))
            into = free * eight(faces, (at.FACE_FLUX, up * n_z + j))
            sides = own + after + before
            tilted = zeta * own + work.lines[j + 2, at.ZETA] * after + work.lines[j, at.ZETA] * before
            by_x = out * eight(work.trig, (group, position, at.FACE_COS))
            by_x = by_x - into * eight(work.trig, (group, up, at.FACE_COS))
            by_y = out * eight(work.trig, (group, position, at.FACE_SIN))
            by_y = by_y - into * eight(work.trig, (group, up, at.FACE_SIN))
            squeeze = eight(nodes, (at.SQUEEZE, q))
            put_eight(columns, (f, 0), by_x + sides * cos)
            put_eight(columns, (f, 1), by_y + sides * sin)
            put_eight(columns, (f, 2), zeta * by_x + tilted * cos)
            put_eight(columns, (f, 3), zeta * by_y + tilted * sin)
            put_eight(columns, (f, 4), squeeze * cos)
            put_eight(columns, (f, 5), squeeze * sin)
            put_eight(columns, (f, 6), zeta * squeeze * cos)
            put_eight(columns, (f, 7), zeta * squeeze * sin)


@kernel
def solution_loads(film, work, group, to):
    """Compute the generalised forces ∫ S p dA / (p₀ A₀) of solutions ``to`` … ``to`` + 7, in ``loads``."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    for m in range(work.loads.shape[0]):
        for r in range(at.SIDES):
            put_eight(work.loads, (m, to + r), all_eight(0.0))
    nodes = work.nodes[group]
    for position in range(n_phi):
        pressed = all_eight(0.0)
        for j in range(n_z):
            q = position * (n_z + 2) + j + 1
            weight = eight(nodes, (at.FULL, q)) * (eight(nodes, (at.WEIGHT, q)) * eight(nodes, (at.SLOPE, q)))
            put_eight(nodes, (at.PRESSING, q), weight)
            pressed = pressed + weight
        if any_lane(pressed != 0.0):
            for half in range(0, at.SIDES, 4):
                _motion_loads(work, group, position, n_z, half, to)
                for m in range(0, at.MOST_SHAPES - 1, 2):
                    _two_shapes(work, group, position, n_z, half, to, m)
                _one_shape(work, group, position, n_z, half, to, at.MOST_SHAPES - 1)


@inlined_kernel
def _motion_loads(work, group, position, n_z, half, to):
    """Add the loads on x, y, a, b of one column's nodes for four solutions."""
    nodes = work.nodes[group]
    columns = work.columns
    m0 = all_eight(0.0)
    m1 = m0
    m2 = m0
    m3 = m0
    t0 = m0
    t1 = m0
    t2 = m0
    t3 = m0
    for j in range(n_z):
        weight = eight(nodes, (at.PRESSING, position * (n_z + 2) + j + 1))
        tilted = work.lines[j + 1, at.ZETA] * weight
        f = position * n_z + j
        x = eight(columns, (f, half))
        m0 = plus_product(m0, weight, x)
        t0 = plus_product(t0, tilted, x)
        x = eight(columns, (f, half + 1))
        m1 = plus_product(m1, weight, x)
        t1 = plus_product(t1, tilted, x)
        x = eight(columns, (f, half + 2))
        m2 = plus_product(m2, weight, x)
        t2 = plus_product(t2, tilted, x)
        x = eight(columns, (f, half + 3))
        m3 = plus_product(m3, weight, x)
        t3 = plus_product(t3, tilted, x)
    cos = eight(work.trig, (group, position, at.COS))
    sin = eight(work.trig, (group, position, at.SIN))
    _subtract_four(work.loads, 0, to + half, cos, (m0, m1, m2, m3))
    _subtract_four(work.loads, 1, to + half, sin, (m0, m1, m2, m3))
    _subtract_four(work.loads, 2, to + half, cos, (t0, t1, t2, t3))
    _subtract_four(work.loads, 3, to + half, sin, (t0, t1, t2, t3))


@inlined_kernel
def _subtract_four(loads, m, r, share, values):
    """Subtract ``share`` times four values from load m of the solutions r to r + 3."""
    v0, v1, v2, v3 = values
    put_eight(loads, (m, r), minus_product(eight(loads, (m, r)), share, v0))
    put_eight(loads, (m, r + 1), minus_product(eight(loads, (m, r + 1)), share, v1))
    put_eight(loads, (m, r + 2), minus_product(eight(loads, (m, r + 2)), share, v2))
    put_eight(loads, (m, r + 3), minus_product(eight(loads, (m, r + 3)), share, v3))


@inlined_kernel
def _two_shapes(work, group, position, n_z, half, to, m):
    """Add the loads on shapes m and m + 1 of one column's nodes for four solutions."""
    nodes = work.nodes[group]
    shapes = work.shapes[group]
    columns = work.columns
    a0 = all_eight(0.0)
    a1 = a0
    a2 = a0
    a3 = a0
    b0 = a0
    b1 = a0
    b2 = a0
    b3 = a0
    for j in range(n_z):
        q = position * (n_z + 2) + j + 1
        f = position * n_z + j
        weight = eight(nodes, (at.PRESSING, q))
        first = weight * eight(shapes, (q, m))
        second = weight * eight(shapes, (q, m + 1))
        x = eight(columns, (f, half))
        a0 = plus_product(a0, first, x)
        b0 = plus_product(b0, second, x)
        x = eight(columns, (f, half + 1))
        a1 = plus_product(a1, first, x)
        b1 = plus_product(b1, second, x)
        x = eight(columns, (f, half + 2))
        a2 = plus_product(a2, first, x)
        b2 = plus_product(b2, second, x)
        x = eight(columns, (f, half + 3))
        a3 = plus_product(a3, first, x)
        b3 = plus_product(b3, second, x)
    minus = all_eight(-1.0)
    _subtract_four(work.loads, 4 + m, to + half, minus, (a0, a1, a2, a3))
    _subtract_four(work.loads, 5 + m, to + half, minus, (b0, b1, b2, b3))


@inlined_kernel
def _one_shape(work, group, position, n_z, half, to, m):
    """Add the loads on the last shape m of one column's nodes for four solutions."""
    a0 = all_eight(0.0)
    a1 = a0
    a2 = a0
    a3 = a0
    for j in range(n_z):
        q = position * (n_z + 2) + j + 1
        f = position * n_z + j
        first = eight(work.nodes[group], (at.PRESSING, q)) * eight(work.shapes[group], (q, m))
        a0 = plus_product(a0, first, eight(work.columns, (f, half)))
        a1 = plus_product(a1, first, eight(work.columns, (f, half + 1)))
        a2 = plus_product(a2, first, eight(work.columns, (f, half + 2)))
        a3 = plus_product(a3, first, eight(work.columns, (f, half + 3)))
    _subtract_four(work.loads, 4 + m, to + half, all_eight(-1.0), (a0, a1, a2, a3))


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
    none = all_eight(0.0)
    for m in range(11):
        for c in range(at.LANES):
            sums[8 * m + c] = 0.0
        for k in range(11):
            put_eight(work.touching, (m, k), none)
    for position in range(n_phi):
        cos = eight(work.trig, (group, position, at.COS))
        sin = eight(work.trig, (group, position, at.SIN))
        middle = none
        tilted = none
        pressed = False
        for line in range(lines):
            q = position * lines + line
            contact = work.lines[line, at.WIDTH] * eight(nodes, (at.CONTACT, q))
            p = none
            stiff = work.lines[line, at.WIDTH] * eight(nodes, (at.CONTACT_SLOPE, q))
            if 0 < line <= n_z:
                now = eight(nodes, (at.PRESSURE, q))
                weight = eight(nodes, (at.WEIGHT, q))
                stiff = stiff + now * weight * eight(nodes, (at.BEND, q))
                if newton:
                    now = now + eight(work.columns, (position * n_z + line - 1, 0))
                p = eight(nodes, (at.FULL, q)) * now * (weight * eight(nodes, (at.SLOPE, q)))
            total = p + contact
            put_eight(nodes, (at.PRESSING, q), total)
            pressed = pressed or any_lane(total != 0.0)
            middle = middle + total
            tilted = tilted + work.lines[line, at.ZETA] * total
            if any_lane(stiff != 0.0):
                _touching(work, group, q, stiff, cos, sin, work.lines[line, at.ZETA])
        if pressed:
            add_to(sums, 0, none - cos * middle)
            add_to(sums, 1, none - sin * middle)
            add_to(sums, 2, none - cos * tilted)
            add_to(sums, 3, none - sin * tilted)
            for k in range(at.MOST_SHAPES):
                total = none
                for line in range(lines):
                    q = position * lines + line
                    total = plus_product(total, eight(nodes, (at.PRESSING, q)), eight(shapes, (q, k)))
                add_to(sums, 4 + k, total)
    for m in range(11):
        for k in range(m):
            put_eight(work.touching, (m, k), eight(work.touching, (k, m)))


@inlined_kernel
def _touching(work, group, q, stiff, cos, sin, zeta):
    """Add the stiffness of a node at fixed film pressure to the upper triangle of the derivatives of the loads."""
    shapes = work.shapes[group]
    for m in range(11):
        s = stiff * _value(shapes, q, cos, sin, zeta, m)
        for k in range(m, 11):
            value = plus_product(eight(work.touching, (m, k)), s, _value(shapes, q, cos, sin, zeta, k))
            put_eight(work.touching, (m, k), value)


@inlined_kernel
def _value(shapes, q, cos, sin, zeta, m):
    """Return the generalised shape m at a node."""
    if m >= 4:
        return eight(shapes, (q, m - 4))
    value = all_eight(0.0) - (cos if m % 2 == 0 else sin)
    return zeta * value if m >= 2 else value


@kernel
def border_equations(film, work, right_sides, moving):
    """Assemble the equations of the shapes, with all nodes eliminated; right-hand sides start at column 7.

    With one right-hand side it belongs to the Newton step with the loads ``sums``. With eight they belong to the last
    sources, of which the first ``moving`` are changes of x, y, a, b.
    """
    n_shapes = int(film.constants[one.N_SHAPES])
    none = all_eight(0.0)
    one_ = all_eight(1.0)
    area = film_area(film.constants) / film.constants[one.CLEARANCE]
    for k in range(at.MOST_SHAPES):
        for column in range(at.MOST_SHAPES + at.SIDES):
            put_eight(work.border, (k, column), none)
        put_eight(work.border, (k, k), one_)
    unit = area * rounded(work.wide, at.UNIT)
    for k in range(n_shapes):
        if right_sides == 1:
            put_eight(work.border, (k, at.MOST_SHAPES), none - rounded(work.wide, at.SHIFT + k))
        for m in range(4 + n_shapes):
            if film.compliance[k, m] == 0.0:
                continue
            yielding = film.compliance[k, m] * unit
            for column in range(n_shapes):
                change = eight(work.loads, (m, 1 + column)) + eight(work.touching, (m, 4 + column))
                put_eight(work.border, (k, column), eight(work.border, (k, column)) - yielding * change)
            if right_sides == 1:
                to = at.MOST_SHAPES
                value = eight(work.border, (k, to)) + yielding * rounded(work.sums, m)
                put_eight(work.border, (k, to), value)
            else:
                for t in range(at.SIDES):
                    change = eight(work.loads, (m, at.SIDES + t))
                    if t < moving:
                        change = change + eight(work.touching, (m, t))
                    to = at.MOST_SHAPES + t
                    put_eight(work.border, (k, to), eight(work.border, (k, to)) + yielding * change)


@kernel
def eliminate(film, work, right_sides):
    """Solve the border equations 1 + C K (stiffness K of film and contact) without pivoting, and mark failed lanes."""
    n = int(film.constants[one.N_SHAPES])
    right = at.MOST_SHAPES
    a = work.border
    one_ = all_eight(1.0)
    bad = eight(work.lane, at.FAILED)
    for k in range(n):
        pivot = eight(a, (k, k))
        fits = (pivot > 1.0e-6) | (pivot < -1.0e-6)
        bad = choose(fits, bad, one_)
        inverse = 1.0 / choose(fits, pivot, one_)
        put_eight(a, (k, k), inverse)
        for i in range(k + 1, n):
            share = eight(a, (i, k)) * inverse
            for c in range(k + 1, n):
                put_eight(a, (i, c), minus_product(eight(a, (i, c)), share, eight(a, (k, c))))
            for c in range(right, right + right_sides):
                put_eight(a, (i, c), minus_product(eight(a, (i, c)), share, eight(a, (k, c))))
    for k in range(n - 1, -1, -1):
        for c in range(right, right + right_sides):
            total = eight(a, (k, c))
            for i in range(k + 1, n):
                total = minus_product(total, eight(a, (k, i)), eight(a, (i, c)))
            put_eight(a, (k, c), total * eight(a, (k, k)))
    put_eight(work.lane, at.FAILED, bad)
