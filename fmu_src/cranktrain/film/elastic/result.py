"""What users read of a converged elastic film: forces, least film, peak pressure, flows, friction, contact."""

from __future__ import annotations

import math

from cranktrain.core.kernel import kernel
from cranktrain.film.contact.asperity import FRICTION, SHEAR, SMOOTH_SPEED, contact_pressure
from cranktrain.film.elastic.balance import grid_factors
from cranktrain.film.elastic.border import film_area, load_unit, present_loads
from cranktrain.film.elastic.grid import (
    CHANGE,
    CLEARANCE,
    CONTACT,
    CONTACT_LOAD,
    CONTACT_SHARE,
    CONTACT_SLOPE,
    DRIVEN,
    FACE_EXTRA,
    FACE_OPEN,
    FILL_MEAN,
    FILM,
    FILM_MIN,
    FILM_MIN_ANGLE,
    FILM_MIN_ZETA,
    FORCE,
    FRICTION_TORQUE,
    N_PHI,
    N_SHAPES,
    N_Z,
    OIL,
    OPEN,
    PRESSURE,
    PRESSURE_MAX,
    RADIUS,
    SIDE_FLOW,
    SLOPE,
    SUPPLY_FLOW,
    VISCOSITY,
    VOID,
)
from cranktrain.film.elastic.height import pressure_unit


@kernel
def film_result(film, speed, per_gain, work, out):
    """Forces and what else users read, from the converged film."""
    constants = film.constants
    n_phi = int(constants[N_PHI])
    n_z = int(constants[N_Z])
    lines = n_z + 2
    count = 4 + int(constants[N_SHAPES])
    nodes = work.nodes
    if constants[N_SHAPES] > 0.0:
        # The contact that the last Newton step went on to: shapes and loads then agree to rounding.
        for q in range(nodes.shape[1]):
            if nodes[CONTACT, q] > 0.0:
                nodes[CONTACT, q] += nodes[CONTACT_SLOPE, q] * nodes[CHANGE, q]
    present_loads(film, work)
    unit = load_unit(constants)
    for m in range(4):
        out[FORCE + m] = unit * (work.touching[m, count] + work.touching[m, count + 1])
    _, across, per_angle = grid_factors(constants)
    film_h = nodes[FILM]
    is_open = nodes[OPEN]
    pressure = nodes[PRESSURE]
    void = nodes[VOID]
    least = film_h[0]
    at_least = 0
    highest = 0.0
    at_highest = 1
    shear = 0.0
    wedge = 0.0
    oil = 0.0
    room = 0.0
    side = 0.0
    fed = 0.0
    film_load = 0.0
    contact_load = 0.0
    rubbing = 0.0
    sliding = speed * constants[RADIUS]
    for i in range(n_phi):
        up = (i - 1 if i > 0 else n_phi - 1) * lines
        down = (i + 1 if i + 1 < n_phi else 0) * lines
        for line in range(lines):
            q = i * lines + line
            if film_h[q] < least:
                least = film_h[q]
                at_least = q
            weight = film.lines[line, 2]
            # At the ends the oil is that of the nodes beside them.
            inner = q + 1 if line == 0 else (q - 1 if line == lines - 1 else q)
            fill = 1.0 + void[inner]
            shear += weight * fill / is_open[q]
            if nodes[CONTACT, q] > 0.0:
                contact_load += weight * nodes[CONTACT, q]
                p, _, area = contact_pressure(film_h[q] * constants[CLEARANCE], film.contact, film.contact_table)
                rubbing += weight * (film.contact[FRICTION] * p + film.contact[SHEAR] * area)
            if line == 0 or line == lines - 1:
                continue
            oil += film.lines[line, 5] * fill * is_open[q]
            room += film.lines[line, 5] * is_open[q]
            p = pressure[q]
            if p > 0.0:
                film_load += p * film.lines[line, 1]
                wedge += p * film.lines[line, 1] * (film_h[down + line] - film_h[up + line])
                if p > highest:
                    highest = p
                    at_highest = q
                # What leaves the balanced nodes; the outer half nodes at the ends hold and squeeze nothing.
                if line == 1:
                    mean = 0.5 * (is_open[q] + is_open[q - 1])
                    side += film.lines[line, 5] * film.lines[line, 4] * across * mean * mean * mean * p
                if line == lines - 2:
                    mean = 0.5 * (is_open[q] + is_open[q + 1])
                    side += film.lines[line, 5] * film.lines[line, 3] * across * mean * mean * mean * p
            if film.supply[i * n_z + line - 1] > 0.0:
                fed += film.lines[line, 5] * _node_outflow(film, 0.5 * speed, per_gain, i, line, work)
    out[FILM_MIN], out[FILM_MIN_ANGLE], out[FILM_MIN_ZETA] = _extreme(film, film_h, at_least)
    out[FILM_MIN] *= constants[CLEARANCE]
    out[PRESSURE_MAX] = 0.0
    if highest > 0.0:
        out[PRESSURE_MAX] = _extreme(film, pressure, at_highest)[0] * pressure_unit(constants)
    area = film_area(constants)
    out[SIDE_FLOW] = side * area * constants[CLEARANCE]
    out[SUPPLY_FLOW] = fed * area * constants[CLEARANCE]
    out[OIL] = oil * area * constants[CLEARANCE]
    out[FILL_MEAN] = oil / room
    drag = constants[VISCOSITY] * sliding / constants[CLEARANCE] * shear * area * constants[RADIUS]
    # dH/dφ from central differences of H, exact for the journal's circle with sin Δφ in place of Δφ.
    turn = 0.5 * wedge / (2.0 * math.sin(1.0 / per_angle)) * unit * constants[CLEARANCE]
    sign = sliding / math.sqrt(sliding * sliding + SMOOTH_SPEED * SMOOTH_SPEED)
    out[FRICTION_TORQUE] = -drag + turn - sign * rubbing * area * constants[RADIUS]
    out[CONTACT_LOAD] = contact_load * unit
    total = contact_load + film_load
    out[CONTACT_SHARE] = contact_load / total if total > 0.0 else 0.0


@kernel
def _node_outflow(film, half_speed, per_gain, i, line, work):
    """Oil that a supply node gives to its neighbours and to its own growing film, over the node's share (1/s)."""
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    lines = n_z + 2
    around, across, per_angle = grid_factors(film.constants)
    up = i - 1 if i > 0 else n_phi - 1
    down = i + 1 if i + 1 < n_phi else 0
    q = i * lines + line
    q_up = up * lines + line
    q_down = down * lines + line
    nodes = work.nodes
    pressure = nodes[PRESSURE]
    h = work.faces[FACE_OPEN, i * n_z + line - 1]
    h_up = work.faces[FACE_OPEN, up * n_z + line - 1]
    drive = half_speed * per_angle
    void_down = 0.0 if drive > 0.0 else nodes[VOID, q_down]
    void_up = nodes[VOID, q_up] if drive > 0.0 else 0.0
    mean = 0.5 * (nodes[OPEN, q] + nodes[OPEN, q + 1])
    mean_before = 0.5 * (nodes[OPEN, q] + nodes[OPEN, q - 1])
    return (
        around * (h * h * h * (pressure[q] - pressure[q_down]) + h_up * h_up * h_up * (pressure[q] - pressure[q_up]))
        + drive * (h * (1.0 + void_down) - h_up * (1.0 + void_up))
        + across * film.lines[line, 3] * mean * mean * mean * (pressure[q] - pressure[q + 1])
        + across * film.lines[line, 4] * mean_before * mean_before * mean_before * (pressure[q] - pressure[q - 1])
        + nodes[SLOPE, q] * (nodes[DRIVEN, q] + per_gain * nodes[FILM, q])
        + work.faces[FACE_EXTRA, i * n_z + line - 1]
        - work.faces[FACE_EXTRA, up * n_z + line - 1]
    )


@kernel
def _extreme(film, field, q):
    """Value, angle and ζ of the extreme of a nodal field near its extreme node, by parabolas both ways."""
    n_phi = int(film.constants[N_PHI])
    lines = int(film.constants[N_Z]) + 2
    i = q // lines
    line = q - i * lines
    up = i - 1 if i > 0 else n_phi - 1
    down = i + 1 if i + 1 < n_phi else 0
    beyond, shift = _vertex(field[up * lines + line], field[q], field[down * lines + line])
    angle = (i + shift) * 2.0 * math.pi / n_phi
    zeta = film.lines[line, 0]
    value = field[q] + beyond
    if 0 < line < lines - 1:
        beyond, shift = _vertex(field[q - 1], field[q], field[q + 1])
        value += beyond
        zeta += shift * (film.lines[line + 1, 0] - zeta if shift > 0.0 else zeta - film.lines[line - 1, 0])
    return value, angle, zeta


@kernel
def _vertex(before, here, after):
    """How far the parabola through three neighbours goes beyond the middle one, and where, in steps from it."""
    bend = before - 2.0 * here + after
    lean = 0.5 * (after - before)
    # Beside a supply at its pressure there is an edge, not a summit.
    if bend == 0.0 or before == here or after == here or abs(lean) > abs(bend):
        return 0.0, 0.0
    return -0.5 * lean * lean / bend, -lean / bend
