"""Outputs of converged elastic films: forces, and on request least film, peak pressure, flows, friction, contact."""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.side_by_side import (
    add_to,
    any_lane,
    choose,
    get,
    lane_count,
    least_of,
    looked_up,
    most_of,
    put,
    spread,
)
from cranktrain.film.contact.asperity import FRICTION, HIGHEST, SHEAR, SMOOTH_SPEED
from cranktrain.film.elastic import grid as one
from cranktrain.film.elastic import workspace as at
from cranktrain.film.elastic.balance import compression_carried, grid_factors, side_conductance
from cranktrain.film.elastic.border import film_area, load_unit
from cranktrain.film.elastic.gaps import hermite, table_place, whole
from cranktrain.film.elastic.workspace import rows_per_u

# Rows of LaneWork.sums after the four forces.
SHEARED, WEDGE, RUBBING, CONTACT_LOAD, FILM_LOAD, HELD, ROOM, SIDE, FED, SUMS = range(4, 14)


@kernel
def film_forces(film, work, group, outs):
    """Compute forces and friction torque of the lanes in ``work.wanted``, in ``outs`` (b, OUT_SIZE) of their films."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lanes = lane_count(work.nodes)
    for k in range(lanes * SUMS):
        work.sums[k] = 0.0
    sigma = film.constants[one.ROUGHNESS]
    for position in range(n_phi):
        _column_sums(film, work, group, position, n_phi, n_z)
        if film.contact[0] > 0.0:
            _column_contact(film, work, group, position, n_z, sigma)
    c0 = film.constants[one.CLEARANCE]
    radius = film.constants[one.RADIUS]
    area = film_area(film.constants)
    _, _, per_angle = grid_factors(film.constants)
    for c in range(lanes):
        if work.wanted[c] == 0.0:
            continue
        film.constants[one.VISCOSITY] = work.wide[lanes * at.ETA + c]
        unit = load_unit(film.constants)
        out = outs[int(work.own[c])]
        sums = work.sums
        for m in range(4):
            out[one.FORCE + m] = unit * sums[lanes * m + c]
        sliding = work.wide[lanes * at.SPEED + c] * radius
        drag = work.wide[lanes * at.ETA + c] * sliding / c0 * sums[lanes * SHEARED + c] * area * radius
        turn = 0.5 * sums[lanes * WEDGE + c] / (2.0 * math.sin(1.0 / per_angle)) * unit * c0
        sign = sliding / math.sqrt(sliding * sliding + SMOOTH_SPEED * SMOOTH_SPEED)
        out[one.FRICTION_TORQUE] = -drag + turn - sign * sums[lanes * RUBBING + c] * area * radius
        out[one.CONTACT_LOAD] = sums[lanes * CONTACT_LOAD + c] * unit
        total = sums[lanes * CONTACT_LOAD + c] + sums[lanes * FILM_LOAD + c]
        out[one.CONTACT_SHARE] = sums[lanes * CONTACT_LOAD + c] / total if total > 0.0 else 0.0


@inlined_kernel
def _column_sums(film, work, group, position, n_phi, n_z):
    """Add the loads, shear and wedge term of one column to the sums."""
    nodes = work.nodes[group]
    lines = n_z + 2
    thickens = film.constants[one.OIL_STEP] > 0.0
    compressible = film.constants[one.COMPRESSIBLE] > 0.0
    none = spread(0.0, nodes)
    middle = none
    tilted = none
    sheared = none
    wedge = none
    pressed = none
    up = (position - 1 if position > 0 else n_phi - 1) * lines
    down = (position + 1 if position + 1 < n_phi else 0) * lines
    for line in range(lines):
        q = position * lines + line
        slope = get(nodes, (at.SLOPE, q))
        width = work.lines[line, at.WIDTH]
        # The ends have the fill of the neighbouring nodes.
        fill = 1.0 + get(nodes, (at.VOID, position * lines + min(max(line, 1), lines - 2)))
        shear = width * fill * slope / get(nodes, (at.OPEN, q))
        if thickens:
            shear = shear / get(nodes, (at.MOBILITY, q))
        if lane_count(nodes) == 1 and compressible:
            shear = shear * (1.0 + get(nodes, (at.COMPRESSED, q)))
        sheared = sheared + shear
        total = width * get(nodes, (at.CONTACT, q))
        if 0 < line <= n_z:
            p = get(nodes, (at.PRESSURE, q)) * (get(nodes, (at.WEIGHT, q)) * slope)
            pressed = pressed + p
            wedge = wedge + p * (get(nodes, (at.FILM, down + line)) - get(nodes, (at.FILM, up + line)))
            total = total + p
        middle = middle + total
        tilted = tilted + work.lines[line, at.ZETA] * total
    cos = get(work.trig, (group, position, at.COS))
    sin = get(work.trig, (group, position, at.SIN))
    add_to(work.sums, 0, none - cos * middle)
    add_to(work.sums, 1, none - sin * middle)
    add_to(work.sums, 2, none - cos * tilted)
    add_to(work.sums, 3, none - sin * tilted)
    add_to(work.sums, SHEARED, sheared)
    add_to(work.sums, WEDGE, wedge)
    add_to(work.sums, FILM_LOAD, pressed)


@inlined_kernel
def _column_contact(film, work, group, position, n_z, sigma):
    """Add the contact load and boundary friction of one column to the sums."""
    nodes = work.nodes[group]
    none = spread(0.0, nodes)
    load = none
    rubbing = none
    for line in range(n_z + 2):
        q = position * (n_z + 2) + line
        h = get(nodes, (at.FILM, q))
        near = h < HIGHEST * sigma
        if any_lane(near):
            width = work.lines[line, at.WIDTH]
            load = load + width * get(nodes, (at.CONTACT, q))
            place, below = table_place(work.gaps, h, 1.0 / sigma)
            row = least_of(whole(place), spread(work.gaps.shape[0] - 2.0, nodes))
            t = choose(near, place - row, none)
            p, rate = hermite(work.gaps, row, t, at.PRESS, at.PRESS_SLOPE)
            p = p + rate * rows_per_u(work.gaps) * below
            area = looked_up(work.gaps, row, at.AREA)
            area = area + t * (looked_up(work.gaps, row + 1.0, at.AREA) - area)
            rubbing = rubbing + choose(near, width * (film.contact[FRICTION] * p + film.contact[SHEAR] * area), none)
    add_to(work.sums, CONTACT_LOAD, load)
    add_to(work.sums, RUBBING, rubbing)


@kernel
def film_figures(film, work, group, outs):
    """Compute extremes, flows and contents of the lanes in ``work.wanted``, in ``outs``, after :func:`film_forces`."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    lanes = lane_count(work.nodes)
    nodes = work.nodes[group]
    none = spread(0.0, nodes)
    least = get(nodes, (at.FILM, 0))
    highest = none
    at_least = none
    at_highest = none
    for q in range(n_phi * lines):
        h = get(nodes, (at.FILM, q))
        at_least = choose(h < least, float(q), at_least)
        least = least_of(h, least)
        p = get(nodes, (at.PRESSURE, q))
        at_highest = choose(p > highest, float(q), at_highest)
        highest = most_of(p, highest)
    put(work.lane, at.CHANGED, at_least)
    put(work.lane, at.MOVED, at_highest)
    for position in range(n_phi):
        _column_flows(film, work, group, position, n_phi, n_z)
    area = film_area(film.constants) * film.constants[one.CLEARANCE]
    for c in range(lanes):
        if work.wanted[c] == 0.0:
            continue
        out = outs[int(work.own[c])]
        cut = int(work.marks[group, c, at.CUT])
        q_least = int(work.lane[lanes * at.CHANGED + c])
        q_highest = int(work.lane[lanes * at.MOVED + c])
        value, angle, zeta = _extreme(film, nodes[at.FILM], q_least, lanes, c)
        out[one.FILM_MIN] = value * film.constants[one.CLEARANCE]
        angle += cut * 2.0 * math.pi / n_phi
        out[one.FILM_MIN_ANGLE] = angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi))
        out[one.FILM_MIN_ZETA] = zeta
        out[one.PRESSURE_MAX] = 0.0
        top = float(nodes[at.PRESSURE, lanes * q_highest + c])
        if top > 0.0:
            peak = _extreme(film, nodes[at.PRESSURE], q_highest, lanes, c)[0]
            if film.constants[one.OIL_STEP] == 0.0:
                peak = max(peak, top + _crest(film, work, group, q_highest, c))
            out[one.PRESSURE_MAX] = peak * work.wide[lanes * at.UNIT + c]
        sums = work.sums
        out[one.SIDE_FLOW] = sums[lanes * SIDE + c] * area
        out[one.SUPPLY_FLOW] = sums[lanes * FED + c] * area
        out[one.OIL] = sums[lanes * HELD + c] * area
        out[one.FILL_MEAN] = sums[lanes * HELD + c] / sums[lanes * ROOM + c]


@inlined_kernel
def _column_flows(film, work, group, position, n_phi, n_z):
    """Add the oil and gap volume of one column, and its flows out of both ends and of the supply, to the sums."""
    _, across, _ = grid_factors(film.constants)
    nodes = work.nodes[group]
    lines = n_z + 2
    none = spread(0.0, nodes)
    held = none
    room = none
    side = none
    potential = at.REDUCED if film.constants[one.OIL_STEP] > 0.0 else at.PRESSURE
    compressible = film.constants[one.COMPRESSIBLE] > 0.0
    for line in range(1, n_z + 1):
        q = position * lines + line
        width = work.lines[line, at.WIDTH]
        h = get(nodes, (at.OPEN, q))
        room = room + width * h
        held = held + width * (1.0 + get(nodes, (at.VOID, q))) * h
        if lane_count(nodes) == 1 and compressible:
            held = held + width * get(nodes, (at.COMPRESSED, q)) * h
        p = get(nodes, (potential, q))
        if line == 1:
            over, _, _ = side_conductance(h, get(nodes, (at.OPEN, q - 1)))
            side = side + width * work.lines[line, at.BEFORE_SIDE] * across * over * p
        if line == n_z:
            over, _, _ = side_conductance(h, get(nodes, (at.OPEN, q + 1)))
            side = side + width * work.lines[line, at.AFTER_SIDE] * across * over * p
        fed = get(work.supply[group], position * n_z + line - 1)
        if any_lane(fed > 0.0):
            out = _outflow(film, work, group, position, line, n_phi, n_z)
            add_to(work.sums, FED, fed * width * out)
    add_to(work.sums, HELD, held)
    add_to(work.sums, ROOM, room)
    add_to(work.sums, SIDE, side)


@inlined_kernel
def _outflow(film, work, group, position, line, n_phi, n_z):
    """Return the oil from a supply node to its neighbours and to its own growing film, over the node's area (1/s)."""
    around, across, _ = grid_factors(film.constants)
    potential = at.REDUCED if film.constants[one.OIL_STEP] > 0.0 else at.PRESSURE
    nodes = work.nodes[group]
    faces = work.faces[group]
    lines = n_z + 2
    up = position - 1 if position > 0 else n_phi - 1
    down = position + 1 if position + 1 < n_phi else 0
    q = position * lines + line
    q_up = up * lines + line
    q_down = down * lines + line
    f = position * n_z + line - 1
    f_up = up * n_z + line - 1
    p = get(nodes, (potential, q))
    h = get(faces, (at.FACE_OPEN, f))
    h_up = get(faces, (at.FACE_OPEN, f_up))
    forward = get(work.lane, at.FORWARD)
    backward = get(work.lane, at.BACKWARD)
    own = 1.0 + get(nodes, (at.VOID, q))
    carried = h * (forward * own - backward * (1.0 + get(nodes, (at.VOID, q_down))))
    carried = carried - h_up * (forward * (1.0 + get(nodes, (at.VOID, q_up))) - backward * own)
    after, _, _ = side_conductance(get(nodes, (at.OPEN, q)), get(nodes, (at.OPEN, q + 1)))
    before, _, _ = side_conductance(get(nodes, (at.OPEN, q)), get(nodes, (at.OPEN, q - 1)))
    pressed = around * (h * h * h) * (p - get(nodes, (potential, q_down)))
    pressed = pressed + around * (h_up * h_up * h_up) * (p - get(nodes, (potential, q_up)))
    sides = across * work.lines[line, at.AFTER_SIDE] * after * (p - get(nodes, (potential, q + 1)))
    sides = sides + across * work.lines[line, at.BEFORE_SIDE] * before * (p - get(nodes, (potential, q - 1)))
    growing = get(nodes, (at.SLOPE, q)) * get(nodes, (at.GROWTH, q))
    if lane_count(nodes) == 1 and film.constants[one.COMPRESSIBLE] > 0.0:
        growing = growing * (1.0 + get(nodes, (at.COMPRESSED, q)))
        carried = carried + h * compression_carried(nodes, forward, backward, get(faces, (at.FACE_AHEAD, f)), q, q_down)
        ahead = get(faces, (at.FACE_AHEAD, f_up))
        carried = carried - h_up * compression_carried(nodes, forward, backward, ahead, q_up, q)
    extra = get(faces, (at.FACE_EXTRA, f)) - get(faces, (at.FACE_EXTRA, f_up))
    return pressed + carried + sides + growing + extra


@kernel
def _extreme(film, field, q, lanes, c):
    """Return value, angle from the cut and ζ of the extreme of a field near its extreme node, by two parabolas."""
    n_phi = int(film.constants[one.N_PHI])
    lines = int(film.constants[one.N_Z]) + 2
    i = q // lines
    line = q - i * lines
    up = (i - 1 if i > 0 else n_phi - 1) * lines + line
    down = (i + 1 if i + 1 < n_phi else 0) * lines + line
    here = float(field[lanes * q + c])
    beyond, shift = vertex(float(field[lanes * up + c]), here, float(field[lanes * down + c]))
    angle = (i + shift) * 2.0 * math.pi / n_phi
    zeta = film.lines[line, one.ZETA]
    value = here + beyond
    if 0 < line < lines - 1:
        beyond, shift = vertex(float(field[lanes * (q - 1) + c]), here, float(field[lanes * (q + 1) + c]))
        value += beyond
        if shift > 0.0:
            zeta += shift * (film.lines[line + 1, one.ZETA] - zeta)
        else:
            zeta += shift * (zeta - film.lines[line - 1, one.ZETA])
    return value, angle, zeta


@kernel
def _crest(film, work, group, q, c):
    """Return the rise of pressure above the highest node ``q``, between this node and its axial neighbours.

    The profile between lines has linear film and linear flow, as in :mod:`cranktrain.film.elastic.weights`. Its crest
    is at the change of sign of the axial flow. The highest node alone may underestimate a narrow ridge by a third.
    """
    lines = int(film.constants[one.N_Z]) + 2
    lanes = lane_count(work.nodes)
    nodes = work.nodes[group]
    i = q // lines
    own = q - i * lines
    most = 0.0
    for line in range(max(own - 1, 0), min(own + 1, lines - 1)):
        first = i * (lines - 2) + line
        before = line > 0 and work.supply[group, lanes * (first - 1) + c] == 0.0
        after = line < lines - 2 and work.supply[group, lanes * first + c] == 0.0
        low = line - 1 if before else line
        high = line + 1 if after else line
        if low == high:
            continue
        zetas = film.lines[high, one.ZETA] + film.lines[high + 1, one.ZETA]
        apart = zetas - film.lines[low, one.ZETA] - film.lines[low + 1, one.ZETA]
        length = film.lines[line + 1, one.ZETA] - film.lines[line, one.ZETA]
        through = _flow_across(film, nodes, i, high, lanes, c) - _flow_across(film, nodes, i, low, lanes, c)
        rise = 2.0 * length * through / apart
        if not rise > 0.0:
            continue
        k = i * lines + line
        h = float(nodes[at.OPEN, lanes * k + c])
        beyond = float(nodes[at.OPEN, lanes * (k + 1) + c])
        all_of_it, tilted = wedge_integrals(1.0, h, beyond)
        drop = (float(nodes[at.PRESSURE, lanes * k + c]) - float(nodes[at.PRESSURE, lanes * (k + 1) + c])) / length
        begin = (drop - rise * tilted) / all_of_it
        t = -begin / rise
        if 0.0 < t < 1.0:
            all_of_it, tilted = wedge_integrals(t, h, beyond)
            p = float(nodes[at.PRESSURE, lanes * k + c]) - length * (begin * all_of_it + rise * tilted)
            most = max(most, p - float(nodes[at.PRESSURE, lanes * q + c]))
    return most


@kernel
def _flow_across(film, nodes, i, line, lanes, c):
    """Return the axial flow G Δp/d from a line of column ``i`` to the next line."""
    q = i * (int(film.constants[one.N_Z]) + 2) + line
    h = float(nodes[at.OPEN, lanes * q + c])
    beside = float(nodes[at.OPEN, lanes * (q + 1) + c])
    over = 2.0 * h * h * beside * beside / (h + beside)
    drop = float(nodes[at.PRESSURE, lanes * q + c]) - float(nodes[at.PRESSURE, lanes * (q + 1) + c])
    return over * drop / (film.lines[line + 1, one.ZETA] - film.lines[line, one.ZETA])


@kernel
def wedge_integrals(t, h, beyond):
    """Return ∫₀ᵗ ds/H³ and ∫₀ᵗ s ds/H³ with H linear from ``h`` at 0 to ``beyond`` at 1."""
    there = h + t * (beyond - h)
    per_square = 1.0 / (there * there)
    return 0.5 * t * (h + there) * per_square / (h * h), 0.5 * t * t * per_square / h


@kernel
def vertex(before, here, after):
    """Return height above the middle point and position, in steps, of the vertex of a parabola through three points."""
    bend = before - 2.0 * here + after
    lean = 0.5 * (after - before)
    # Equal neighbours are an edge of a supply at supply pressure, not a maximum.
    if bend == 0.0 or before == here or after == here or abs(lean) > abs(bend):
        return 0.0, 0.0
    return -0.5 * lean * lean / bend, -lean / bend
