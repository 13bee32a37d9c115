"""Outputs of a converged elastic film: forces, least film, peak pressure, flows, friction, contact."""

import math

from cranktrain.core.kernel import kernel
from cranktrain.film.contact.asperity import FRICTION, SHEAR, SMOOTH_SPEED, contact_pressure
from cranktrain.film.elastic import grid as at
from cranktrain.film.elastic.balance import carried, compression_ahead, flow_factors, grid_factors, side_conductance
from cranktrain.film.elastic.border import film_area, load_unit, present_loads
from cranktrain.film.elastic.height import pressure_unit


@kernel
def film_result(film, speed, per_gain, work, out):
    """Write forces and other outputs of the converged film, without tangents, to ``out`` (OUT_SIZE,)."""
    constants = film.constants
    count = 4 + int(constants[at.N_SHAPES])
    nodes = work.nodes
    if constants[at.N_SHAPES] > 0.0:
        # Values are evaluated after the last Newton step, so shapes and loads agree to rounding.
        for q in range(nodes.shape[1]):
            if nodes[at.CONTACT, q] > 0.0:
                nodes[at.CONTACT, q] += nodes[at.CONTACT_SLOPE, q] * nodes[at.CHANGE, q]
            nodes[at.SLOPE, q] += nodes[at.BEND, q] * nodes[at.CHANGE, q]
    present_loads(film, work)
    unit = load_unit(constants)
    for m in range(4):
        out[at.FORCE + m] = unit * (work.touching[m, count] + work.touching[m, count + 1])
    c = constants[at.CLEARANCE]
    least, highest = _extremes(nodes[at.FILM], nodes[at.PRESSURE])
    out[at.FILM_MIN], out[at.FILM_MIN_ANGLE], out[at.FILM_MIN_ZETA] = _extreme(film, nodes[at.FILM], least)
    out[at.FILM_MIN] *= c
    out[at.PRESSURE_MAX] = 0.0
    if nodes[at.PRESSURE, highest] > 0.0:
        peak = _extreme(film, nodes[at.PRESSURE], highest)[0]
        if constants[at.OIL_STEP] == 0.0:
            peak = max(peak, nodes[at.PRESSURE, highest] + _crest(film, nodes, highest))
        out[at.PRESSURE_MAX] = peak * pressure_unit(constants)
    area = film_area(constants)
    side, fed = _flows(film, speed, per_gain, work)
    out[at.SIDE_FLOW] = side * area * c
    out[at.SUPPLY_FLOW] = fed * area * c
    oil, room, shear = _contents(film, nodes)
    out[at.OIL] = oil * area * c
    out[at.FILL_MEAN] = oil / room
    film_load, wedge = _film_load(film, nodes)
    contact_load, rubbing = _contact(film, nodes)
    sliding = speed * constants[at.RADIUS]
    drag = constants[at.VISCOSITY] * sliding / c * shear * area * constants[at.RADIUS]
    # dH/dφ is a central difference of H, with sin Δφ instead of Δφ, which is exact for the circle of the journal.
    _, _, per_angle = grid_factors(constants)
    turn = 0.5 * wedge / (2.0 * math.sin(1.0 / per_angle)) * unit * c
    sign = sliding / math.sqrt(sliding * sliding + SMOOTH_SPEED * SMOOTH_SPEED)
    out[at.FRICTION_TORQUE] = -drag + turn - sign * rubbing * area * constants[at.RADIUS]
    out[at.CONTACT_LOAD] = contact_load * unit
    total = contact_load + film_load
    out[at.CONTACT_SHARE] = contact_load / total if total > 0.0 else 0.0


@kernel
def _extremes(film_h, pressure):
    """Return the nodes of the least film and of the largest pressure; node 0 (an end) if no node is full."""
    least = 0
    highest = 0
    for q in range(film_h.shape[0]):
        if film_h[q] < film_h[least]:
            least = q
        if pressure[q] > pressure[highest]:
            highest = q
    return least, highest


@kernel
def _contents(film, nodes):
    """Return width-weighted sums of oil and gap over inner nodes, and of the shear factor fill h′/h over all nodes."""
    lines = int(film.constants[at.N_Z]) + 2
    oil = 0.0
    room = 0.0
    shear = 0.0
    for i in range(int(film.constants[at.N_PHI])):
        for line in range(lines):
            q = i * lines + line
            # The ends have the fill of the neighbouring nodes.
            fill = 1.0 + nodes[at.VOID, i * lines + min(max(line, 1), lines - 2)]
            held = 1.0 + nodes[at.COMPRESSED, q]
            h = nodes[at.OPEN, q]
            sheared = film.lines[line, at.LINE_WIDTH] * fill * nodes[at.SLOPE, q] * held
            shear += sheared / (h * nodes[at.MOBILITY, q])
            if 0 < line < lines - 1:
                oil += film.lines[line, at.LINE_WIDTH] * (held + nodes[at.VOID, q]) * h
                room += film.lines[line, at.LINE_WIDTH] * h
    return oil, room, shear


@kernel
def _film_load(film, nodes):
    """Return weighted sums of pressure, and of pressure times the circumferential central difference of H."""
    n_phi = int(film.constants[at.N_PHI])
    lines = int(film.constants[at.N_Z]) + 2
    load = 0.0
    wedge = 0.0
    for i in range(n_phi):
        up = (i - 1 if i > 0 else n_phi - 1) * lines
        down = (i + 1 if i + 1 < n_phi else 0) * lines
        for line in range(1, lines - 1):
            p = nodes[at.PRESSURE, i * lines + line]
            if p > 0.0:
                weight = nodes[at.WEIGHT, i * lines + line] * nodes[at.SLOPE, i * lines + line]
                load += p * weight
                wedge += p * weight * (nodes[at.FILM, down + line] - nodes[at.FILM, up + line])
    return load, wedge


@kernel
def _contact(film, nodes):
    """Return weighted sums of contact pressure and of boundary friction."""
    lines = int(film.constants[at.N_Z]) + 2
    load = 0.0
    rubbing = 0.0
    for q in range(nodes.shape[1]):
        if nodes[at.CONTACT, q] > 0.0:
            weight = film.lines[q % lines, at.LINE_WIDTH]
            load += weight * nodes[at.CONTACT, q]
            p, _, area = contact_pressure(
                nodes[at.FILM, q] * film.constants[at.CLEARANCE], film.contact, film.contact_table
            )
            rubbing += weight * (film.contact[FRICTION] * p + film.contact[SHEAR] * area)
    return load, rubbing


@kernel
def _flows(film, speed, per_gain, work):
    """Compute the flow out of both ends and the flow out of the supply nodes, from the balance of the nodes.

    The outer half volumes at the ends have no storage and no squeeze.
    """
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    _, across, _ = grid_factors(film.constants)
    is_open = work.nodes[at.OPEN]
    side = 0.0
    fed = 0.0
    for i in range(n_phi):
        for line in range(1, n_z + 1):
            q = i * (n_z + 2) + line
            p = work.nodes[at.REDUCED, q]
            width = film.lines[line, at.LINE_WIDTH]
            if p > 0.0 and line == 1:
                side += (
                    width
                    * film.sides[at.BEFORE_SIDE, line]
                    * across
                    * side_conductance(is_open[q], is_open[q - 1])[0]
                    * p
                )
            if p > 0.0 and line == n_z:
                side += (
                    width
                    * film.sides[at.AFTER_SIDE, line]
                    * across
                    * side_conductance(is_open[q], is_open[q + 1])[0]
                    * p
                )
            if film.supply[i * n_z + line - 1] > 0.0:
                fed += width * _node_outflow(film, 0.5 * speed, per_gain, i, line, work)
    return side, fed


@kernel
def _node_outflow(film, half_speed, per_gain, i, line, work):
    """Return the oil from a supply node to its neighbours and to its own growing film, over the node's area (1/s)."""
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    lines = n_z + 2
    up = i - 1 if i > 0 else n_phi - 1
    down = i + 1 if i + 1 < n_phi else 0
    q = i * lines + line
    q_up = up * lines + line
    q_down = down * lines + line
    nodes = work.nodes
    p = nodes[at.REDUCED]
    h = work.faces[at.FACE_OPEN, i * n_z + line - 1]
    h_up = work.faces[at.FACE_OPEN, up * n_z + line - 1]
    flow = flow_factors(film.constants, half_speed)
    ahead = compression_ahead(film, flow, nodes, h, q, q_down)
    ahead_up = compression_ahead(film, flow, nodes, h_up, q_up, q)
    held = 1.0 + nodes[at.COMPRESSED, q]
    after, _, _ = side_conductance(nodes[at.OPEN, q], nodes[at.OPEN, q + 1])
    before, _, _ = side_conductance(nodes[at.OPEN, q], nodes[at.OPEN, q - 1])
    return (
        flow.around * (h * h * h * (p[q] - p[q_down]) + h_up * h_up * h_up * (p[q] - p[q_up]))
        + h * carried(flow, nodes, ahead, q, q_down)
        - h_up * carried(flow, nodes, ahead_up, q_up, q)
        + flow.across * film.sides[at.AFTER_SIDE, line] * after * (p[q] - p[q + 1])
        + flow.across * film.sides[at.BEFORE_SIDE, line] * before * (p[q] - p[q - 1])
        + nodes[at.SLOPE, q] * held * (nodes[at.DRIVEN, q] + per_gain * nodes[at.FILM, q])
        + work.faces[at.FACE_EXTRA, i * n_z + line - 1]
        - work.faces[at.FACE_EXTRA, up * n_z + line - 1]
    )


@kernel
def _extreme(film, field, q):
    """Return value, angle and ζ of the extreme of a nodal field near its extreme node ``q``, by two parabolas."""
    n_phi = int(film.constants[at.N_PHI])
    lines = int(film.constants[at.N_Z]) + 2
    i = q // lines
    line = q - i * lines
    up = i - 1 if i > 0 else n_phi - 1
    down = i + 1 if i + 1 < n_phi else 0
    beyond, shift = vertex(field[up * lines + line], field[q], field[down * lines + line])
    angle = (i + shift) * 2.0 * math.pi / n_phi
    zeta = film.lines[line, at.ZETA]
    value = field[q] + beyond
    if 0 < line < lines - 1:
        beyond, shift = vertex(field[q - 1], field[q], field[q + 1])
        value += beyond
        zeta += shift * (film.lines[line + 1, at.ZETA] - zeta if shift > 0.0 else zeta - film.lines[line - 1, at.ZETA])
    return value, angle, zeta


@kernel
def _crest(film, nodes, q):
    """Return the rise of pressure above the highest node ``q``, between this node and its axial neighbours.

    The profile between lines has linear film and linear flow, as in :mod:`cranktrain.film.elastic.weights`. Its crest
    is at the change of sign of the axial flow. The highest node alone may underestimate a narrow ridge by a third.
    """
    lines = int(film.constants[at.N_Z]) + 2
    i = q // lines
    own = q - i * lines
    most = 0.0
    for line in range(max(own - 1, 0), min(own + 1, lines - 1)):
        before = line > 0 and film.supply[i * (lines - 2) + line - 1] == 0.0
        after = line < lines - 2 and film.supply[i * (lines - 2) + line] == 0.0
        low = line - 1 if before else line
        high = line + 1 if after else line
        if low == high:
            continue
        apart = (
            film.lines[high, at.ZETA]
            + film.lines[high + 1, at.ZETA]
            - film.lines[low, at.ZETA]
            - film.lines[low + 1, at.ZETA]
        )
        length = film.lines[line + 1, at.ZETA] - film.lines[line, at.ZETA]
        rise = 2.0 * length * (_flow_across(film, nodes, i, high) - _flow_across(film, nodes, i, low)) / apart
        if not rise > 0.0:
            continue
        k = i * lines + line
        h = nodes[at.OPEN, k]
        beyond = nodes[at.OPEN, k + 1]
        whole, tilted = wedge_integrals(1.0, h, beyond)
        drop = (nodes[at.PRESSURE, k] - nodes[at.PRESSURE, k + 1]) / length
        begin = (drop - rise * tilted) / whole
        t = -begin / rise
        if 0.0 < t < 1.0:
            whole, tilted = wedge_integrals(t, h, beyond)
            p = nodes[at.PRESSURE, k] - length * (begin * whole + rise * tilted)
            most = max(most, p - nodes[at.PRESSURE, q])
    return most


@kernel
def _flow_across(film, nodes, i, line):
    """Return the axial flow G Δp/d from a line of column ``i`` to the next line."""
    q = i * (int(film.constants[at.N_Z]) + 2) + line
    over, _, _ = side_conductance(nodes[at.OPEN, q], nodes[at.OPEN, q + 1])
    return (
        over
        * (nodes[at.PRESSURE, q] - nodes[at.PRESSURE, q + 1])
        / (film.lines[line + 1, at.ZETA] - film.lines[line, at.ZETA])
    )


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
