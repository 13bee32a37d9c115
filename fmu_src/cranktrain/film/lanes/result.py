"""Forces and, on request, other outputs of films in lanes, as :mod:`cranktrain.film.elastic.result`."""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.singles import add_to, all_eight, any_lane, choose, eight, least_of, looked_up, most_of, put_eight
from cranktrain.film.contact.asperity import FRICTION, HIGHEST, SHEAR, SMOOTH_SPEED
from cranktrain.film.elastic import grid as one
from cranktrain.film.elastic.balance import grid_factors, side_conductance
from cranktrain.film.elastic.border import film_area, load_unit
from cranktrain.film.elastic.result import vertex, wedge_integrals
from cranktrain.film.lanes import grid as at
from cranktrain.film.lanes.gaps import hermite, table_place, whole

# Rows of LaneWork.sums after the four forces.
SHEARED, WEDGE, RUBBING, CONTACT_LOAD, FILM_LOAD, HELD, ROOM, SIDE, FED = range(4, 13)


@kernel
def film_forces(film, work, group, outs, wanted, own):
    """Compute forces and friction torque of ``wanted`` lanes, in ``outs`` (b, OUT_SIZE); ``own`` (8,): their films."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    for m in range(16):
        for c in range(at.LANES):
            work.sums[8 * m + c] = 0.0
    sigma = film.constants[one.ROUGHNESS]
    for position in range(n_phi):
        _column_sums(work, group, position, n_phi, n_z, film.constants[one.OIL_STEP] > 0.0)
        if film.contact[0] > 0.0:
            _column_contact(film, work, group, position, n_z, sigma)
    c0 = film.constants[one.CLEARANCE]
    radius = film.constants[one.RADIUS]
    area = film_area(film.constants)
    _, _, per_angle = grid_factors(film.constants)
    for c in range(at.LANES):
        if wanted[c] == 0.0:
            continue
        film.constants[one.VISCOSITY] = work.wide[8 * at.ETA + c]
        unit = load_unit(film.constants)
        out = outs[int(own[c])]
        sums = work.sums
        for m in range(4):
            out[one.FORCE + m] = unit * sums[8 * m + c]
        sliding = work.wide[8 * at.SPEED + c] * radius
        drag = work.wide[8 * at.ETA + c] * sliding / c0 * sums[8 * SHEARED + c] * area * radius
        turn = 0.5 * sums[8 * WEDGE + c] / (2.0 * math.sin(1.0 / per_angle)) * unit * c0
        sign = sliding / math.sqrt(sliding * sliding + SMOOTH_SPEED * SMOOTH_SPEED)
        out[one.FRICTION_TORQUE] = -drag + turn - sign * sums[8 * RUBBING + c] * area * radius
        out[one.CONTACT_LOAD] = sums[8 * CONTACT_LOAD + c] * unit
        total = sums[8 * CONTACT_LOAD + c] + sums[8 * FILM_LOAD + c]
        out[one.CONTACT_SHARE] = sums[8 * CONTACT_LOAD + c] / total if total > 0.0 else 0.0


@inlined_kernel
def _column_sums(work, group, position, n_phi, n_z, thickens):
    """Add the loads, shear and wedge term of one column to the sums."""
    nodes = work.nodes[group]
    lines = n_z + 2
    none = all_eight(0.0)
    middle = none
    tilted = none
    sheared = none
    wedge = none
    pressed = none
    up = (position - 1 if position > 0 else n_phi - 1) * lines
    down = (position + 1 if position + 1 < n_phi else 0) * lines
    for line in range(lines):
        q = position * lines + line
        slope = eight(nodes, (at.SLOPE, q))
        width = work.lines[line, at.WIDTH]
        fill = 1.0 + eight(nodes, (at.VOID, position * lines + min(max(line, 1), lines - 2)))
        shear = width * fill * slope / eight(nodes, (at.OPEN, q))
        if thickens:
            shear = shear / eight(nodes, (at.MOBILITY, q))
        sheared = sheared + shear
        total = width * eight(nodes, (at.CONTACT, q))
        if 0 < line <= n_z:
            p = eight(nodes, (at.PRESSURE, q)) * (eight(nodes, (at.WEIGHT, q)) * slope)
            pressed = pressed + p
            wedge = wedge + p * (eight(nodes, (at.FILM, down + line)) - eight(nodes, (at.FILM, up + line)))
            total = total + p
        middle = middle + total
        tilted = tilted + work.lines[line, at.ZETA] * total
    cos = eight(work.trig, (group, position, at.COS))
    sin = eight(work.trig, (group, position, at.SIN))
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
    none = all_eight(0.0)
    load = none
    rubbing = none
    for line in range(n_z + 2):
        q = position * (n_z + 2) + line
        h = eight(nodes, (at.FILM, q))
        near = h < HIGHEST * sigma
        if any_lane(near):
            width = work.lines[line, at.WIDTH]
            load = load + width * eight(nodes, (at.CONTACT, q))
            place, below = table_place(h, 1.0 / sigma)
            row = least_of(whole(place), all_eight(work.gaps.shape[0] - 2.0))
            t = choose(near, place - row, none)
            p, rate = hermite(work.gaps, row, t, at.PRESS, at.PRESS_SLOPE)
            p = p + rate * at.PER_U * below
            area = looked_up(work.gaps, row, at.AREA)
            area = area + t * (looked_up(work.gaps, row + 1.0, at.AREA) - area)
            rubbing = rubbing + choose(near, width * (film.contact[FRICTION] * p + film.contact[SHEAR] * area), none)
    add_to(work.sums, CONTACT_LOAD, load)
    add_to(work.sums, RUBBING, rubbing)


@kernel
def film_figures(film, work, group, outs, wanted, own):
    """Compute extremes, flows, contents of ``wanted`` lanes, in ``outs`` (b, OUT_SIZE), after :func:`film_forces`."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    nodes = work.nodes[group]
    none = all_eight(0.0)
    least = eight(nodes, (at.FILM, 0))
    highest = none
    at_least = none
    at_highest = none
    for q in range(n_phi * lines):
        h = eight(nodes, (at.FILM, q))
        at_least = choose(h < least, all_eight(float(q)), at_least)
        least = least_of(h, least)
        p = eight(nodes, (at.PRESSURE, q))
        at_highest = choose(p > highest, all_eight(float(q)), at_highest)
        highest = most_of(p, highest)
    put_eight(work.lane, at.CHANGED, at_least)
    put_eight(work.lane, at.MOVED, at_highest)
    for position in range(n_phi):
        _column_flows(film, work, group, position, n_phi, n_z)
    area = film_area(film.constants) * film.constants[one.CLEARANCE]
    for c in range(at.LANES):
        if wanted[c] == 0.0:
            continue
        out = outs[int(own[c])]
        cut = int(work.marks[group, c, at.CUT])
        q_least = int(work.lane[8 * at.CHANGED + c])
        q_highest = int(work.lane[8 * at.MOVED + c])
        value, angle, zeta = _extreme(film, nodes, at.FILM, q_least, c)
        out[one.FILM_MIN] = value * film.constants[one.CLEARANCE]
        angle += cut * 2.0 * math.pi / n_phi
        out[one.FILM_MIN_ANGLE] = angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi))
        out[one.FILM_MIN_ZETA] = zeta
        out[one.PRESSURE_MAX] = 0.0
        top = float(nodes[at.PRESSURE, 8 * q_highest + c])
        if top > 0.0:
            peak = _extreme(film, nodes, at.PRESSURE, q_highest, c)[0]
            if film.constants[one.OIL_STEP] == 0.0:
                peak = max(peak, top + _crest(film, work, group, q_highest, c))
            out[one.PRESSURE_MAX] = peak * work.wide[8 * at.UNIT + c]
        sums = work.sums
        out[one.SIDE_FLOW] = sums[8 * SIDE + c] * area
        out[one.SUPPLY_FLOW] = sums[8 * FED + c] * area
        out[one.OIL] = sums[8 * HELD + c] * area
        out[one.FILL_MEAN] = sums[8 * HELD + c] / sums[8 * ROOM + c]


@inlined_kernel
def _column_flows(film, work, group, position, n_phi, n_z):
    """Add the oil and gap volume of one column, and its flows out of both ends and of the supply, to the sums."""
    _, across, _ = grid_factors(film.constants)
    nodes = work.nodes[group]
    lines = n_z + 2
    none = all_eight(0.0)
    held = none
    room = none
    side = none
    potential = at.REDUCED if film.constants[one.OIL_STEP] > 0.0 else at.PRESSURE
    for line in range(1, n_z + 1):
        q = position * lines + line
        width = work.lines[line, at.WIDTH]
        h = eight(nodes, (at.OPEN, q))
        room = room + width * h
        held = held + width * (1.0 + eight(nodes, (at.VOID, q))) * h
        p = eight(nodes, (potential, q))
        if line == 1:
            over, _, _ = side_conductance(h, eight(nodes, (at.OPEN, q - 1)))
            side = side + width * work.lines[line, at.BEFORE_SIDE] * across * over * p
        if line == n_z:
            over, _, _ = side_conductance(h, eight(nodes, (at.OPEN, q + 1)))
            side = side + width * work.lines[line, at.AFTER_SIDE] * across * over * p
        fed = eight(work.supply[group], position * n_z + line - 1)
        if any_lane(fed > 0.0):
            out = _outflow(film, work, group, position, line, n_phi, n_z, potential)
            add_to(work.sums, FED, fed * width * out)
    add_to(work.sums, HELD, held)
    add_to(work.sums, ROOM, room)
    add_to(work.sums, SIDE, side)


@inlined_kernel
def _outflow(film, work, group, position, line, n_phi, n_z, potential):
    """Return the oil from a supply node to its neighbours and to its own growing film, over the node's area (1/s)."""
    around, across, _ = grid_factors(film.constants)
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
    p = eight(nodes, (potential, q))
    h = eight(faces, (at.FACE_OPEN, f))
    h_up = eight(faces, (at.FACE_OPEN, f_up))
    forward = eight(work.lane, at.FORWARD)
    backward = eight(work.lane, at.BACKWARD)
    own = 1.0 + eight(nodes, (at.VOID, q))
    carried = h * (forward * own - backward * (1.0 + eight(nodes, (at.VOID, q_down))))
    carried = carried - h_up * (forward * (1.0 + eight(nodes, (at.VOID, q_up))) - backward * own)
    after, _, _ = side_conductance(eight(nodes, (at.OPEN, q)), eight(nodes, (at.OPEN, q + 1)))
    before, _, _ = side_conductance(eight(nodes, (at.OPEN, q)), eight(nodes, (at.OPEN, q - 1)))
    pressed = around * (h * h * h) * (p - eight(nodes, (potential, q_down)))
    pressed = pressed + around * (h_up * h_up * h_up) * (p - eight(nodes, (potential, q_up)))
    sides = across * work.lines[line, at.AFTER_SIDE] * after * (p - eight(nodes, (potential, q + 1)))
    sides = sides + across * work.lines[line, at.BEFORE_SIDE] * before * (p - eight(nodes, (potential, q - 1)))
    growing = eight(nodes, (at.SLOPE, q)) * eight(nodes, (at.GROWTH, q))
    extra = eight(faces, (at.FACE_EXTRA, f)) - eight(faces, (at.FACE_EXTRA, f_up))
    return pressed + carried + sides + growing + extra


@kernel
def _extreme(film, nodes, field, q, c):
    """Return value, angle from the cut and ζ of the extreme of a field near its extreme node, by two parabolas."""
    n_phi = int(film.constants[one.N_PHI])
    lines = int(film.constants[one.N_Z]) + 2
    i = q // lines
    line = q - i * lines
    up = (i - 1 if i > 0 else n_phi - 1) * lines + line
    down = (i + 1 if i + 1 < n_phi else 0) * lines + line
    here = float(nodes[field, 8 * q + c])
    beyond, shift = vertex(float(nodes[field, 8 * up + c]), here, float(nodes[field, 8 * down + c]))
    angle = (i + shift) * 2.0 * math.pi / n_phi
    zeta = film.lines[line, one.ZETA]
    value = here + beyond
    if 0 < line < lines - 1:
        beyond, shift = vertex(float(nodes[field, 8 * (q - 1) + c]), here, float(nodes[field, 8 * (q + 1) + c]))
        value += beyond
        if shift > 0.0:
            zeta += shift * (film.lines[line + 1, one.ZETA] - zeta)
        else:
            zeta += shift * (zeta - film.lines[line - 1, one.ZETA])
    return value, angle, zeta


@kernel
def _crest(film, work, group, q, c):
    """Return the rise of pressure above the highest node , between this node and its axial neighbours."""
    lines = int(film.constants[one.N_Z]) + 2
    nodes = work.nodes[group]
    i = q // lines
    own = q - i * lines
    most = 0.0
    for line in range(max(own - 1, 0), min(own + 1, lines - 1)):
        first = i * (lines - 2) + line
        before = line > 0 and work.supply[group, 8 * (first - 1) + c] == 0.0
        after = line < lines - 2 and work.supply[group, 8 * first + c] == 0.0
        low = line - 1 if before else line
        high = line + 1 if after else line
        if low == high:
            continue
        zetas = film.lines[high, one.ZETA] + film.lines[high + 1, one.ZETA]
        apart = zetas - film.lines[low, one.ZETA] - film.lines[low + 1, one.ZETA]
        length = film.lines[line + 1, one.ZETA] - film.lines[line, one.ZETA]
        through = _flow_across(film, nodes, i, high, c) - _flow_across(film, nodes, i, low, c)
        rise = 2.0 * length * through / apart
        if not rise > 0.0:
            continue
        k = i * lines + line
        h = float(nodes[at.OPEN, 8 * k + c])
        beyond = float(nodes[at.OPEN, 8 * (k + 1) + c])
        all_of_it, tilted = wedge_integrals(1.0, h, beyond)
        drop = (float(nodes[at.PRESSURE, 8 * k + c]) - float(nodes[at.PRESSURE, 8 * (k + 1) + c])) / length
        begin = (drop - rise * tilted) / all_of_it
        t = -begin / rise
        if 0.0 < t < 1.0:
            all_of_it, tilted = wedge_integrals(t, h, beyond)
            p = float(nodes[at.PRESSURE, 8 * k + c]) - length * (begin * all_of_it + rise * tilted)
            most = max(most, p - float(nodes[at.PRESSURE, 8 * q + c]))
    return most


@kernel
def _flow_across(film, nodes, i, line, c):
    """Return the axial flow G Δp/d from a line of column ``i`` to the next line."""
    q = i * (int(film.constants[one.N_Z]) + 2) + line
    h = float(nodes[at.OPEN, 8 * q + c])
    beside = float(nodes[at.OPEN, 8 * (q + 1) + c])
    over = 2.0 * h * h * beside * beside / (h + beside)
    drop = float(nodes[at.PRESSURE, 8 * q + c]) - float(nodes[at.PRESSURE, 8 * (q + 1) + c])
    return over * drop / (film.lines[line + 1, one.ZETA] - film.lines[line, one.ZETA])
