"""Mean gaps and contact of rough surfaces, read from a table over the distance of the surfaces, and the oil's state."""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.side_by_side import any_lane, choose, get, lane_count, least_of, looked_up, most_of, put, spread
from cranktrain.engine.lubricant import density_factor
from cranktrain.film.contact.asperity import HIGHEST, SIGMA
from cranktrain.film.elastic import grid as one
from cranktrain.film.elastic import workspace as at
from cranktrain.film.elastic.oil import reduced_pressure
from cranktrain.film.elastic.workspace import rows_per_u

BIGGEST, BIGGEST_SINGLE = 2.0**52, 2.0**23
"""Doubles and singles above which all numbers are whole."""


@inlined_kernel
def table_place(table, h, per_sigma):
    """Return the row position of a gap in the table, and the distance of the gap below the first row, in u = H/σ."""
    per_u = rows_per_u(table)
    u = (h * per_sigma - at.LOWEST_U) * per_u
    below = least_of(u, 0.0)
    return most_of(u, 0.0), below * (1.0 / per_u)


@inlined_kernel
def hermite(table, row, t, value, slope):
    """Interpolate a column with its slopes by u between two rows, at t in [0, 1). Return value and slope per row."""
    per_row = 1.0 / rows_per_u(table)
    a = looked_up(table, row, value)
    b = looked_up(table, row + 1.0, value)
    da = looked_up(table, row, slope) * per_row
    db = looked_up(table, row + 1.0, slope) * per_row
    rise = b - a
    first = da - rise
    bend = first + t * (rise - db - first)
    inner = t * (1.0 - t)
    return a + t * rise + inner * bend, rise + (1.0 - 2.0 * t) * bend + inner * (rise - db - first)


@kernel
def open_gaps(film, work, group, sigma):
    """Compute mean gaps with two derivatives at nodes and one at faces, and contact pressure over p₀ with its slope.

    ``sigma`` is the roughness of the mean gap over the clearance.
    """
    nodes = work.nodes[group]
    faces = work.faces[group]
    table = work.gaps
    per_sigma = 1.0 / sigma
    per_u = rows_per_u(table)
    own_sigma = film.contact[SIGMA] / film.constants[one.CLEARANCE]
    rough = own_sigma > 0.0
    reach = HIGHEST * sigma
    one_ = spread(1.0, nodes)
    none = spread(0.0, nodes)
    unit = get(work.lane, at.PER_UNIT)
    for q in range(nodes.shape[1] // lane_count(work.nodes)):
        h = get(nodes, (at.FILM, q))
        near = h < reach
        is_open = h
        slope = one_
        bend = none
        p = none
        by_gap = none
        if any_lane(near):
            row, t, below = _row(table, h, per_sigma, near)
            value, rate = hermite(table, row, t, at.MEAN, at.MEAN_SLOPE)
            curve = looked_up(table, row, at.MEAN_BEND)
            curve = curve + t * (looked_up(table, row + 1.0, at.MEAN_BEND) - curve)
            is_open = choose(near, value * sigma, h)
            slope = choose(near, rate * per_u, one_)
            bend = choose(near, curve * per_sigma, none)
            if rough:
                touching = near
                per_own = per_sigma
                if sigma != own_sigma:
                    # A roughness raised for a continuation changes the mean gap, not the contact.
                    touching = h < HIGHEST * own_sigma
                    per_own = 1.0 / own_sigma
                    row, t, below = _row(table, h, per_own, touching)
                value, rate = hermite(table, row, t, at.PRESS, at.PRESS_SLOPE)
                rate = rate * per_u
                p = choose(touching, (value + rate * below) * unit, none)
                by_gap = choose(touching, rate * per_own * unit, none)
        put(nodes, (at.OPEN, q), is_open)
        put(nodes, (at.SLOPE, q), slope)
        put(nodes, (at.BEND, q), bend)
        put(nodes, (at.CONTACT, q), p)
        put(nodes, (at.CONTACT_SLOPE, q), by_gap)
    for f in range(faces.shape[1] // lane_count(work.nodes)):
        h = get(faces, (at.FACE_FILM, f))
        is_open, slope = mean_gap(table, h, per_sigma, sigma)
        put(faces, (at.FACE_OPEN, f), is_open)
        put(faces, (at.FACE_SLOPE, f), slope)


@inlined_kernel
def _row(table, h, per_sigma, near):
    """Return row, place within the row and distance below the first row of ``near`` gaps; other gaps are at a row."""
    place, below = table_place(table, h, per_sigma)
    row = least_of(whole(place), spread(table.shape[0] - 2.0, table))
    return row, choose(near, place - row, 0.0), below


@inlined_kernel
def whole(place):
    """Return the integer part of numbers from 0 to ``BIGGEST``, above which they have no fractional part."""
    big = BIGGEST if lane_count(place) == 1 else BIGGEST_SINGLE
    rounded = (place + big) - big
    return choose(rounded > place, rounded - 1.0, rounded)


@inlined_kernel
def mean_gap(table, h, per_sigma, sigma):
    """Return the mean gap at a distance ``h`` of the surfaces, and its derivative."""
    near = h < HIGHEST * sigma
    is_open = h
    slope = spread(1.0, table)
    if any_lane(near):
        row, t, _ = _row(table, h, per_sigma, near)
        value, rate = hermite(table, row, t, at.MEAN, at.MEAN_SLOPE)
        is_open = choose(near, value * sigma, h)
        slope = choose(near, rate * rows_per_u(table), slope)
    return is_open, slope


@kernel
def oil_state(film, work, group):
    """Compute reduced pressure over p₀, mobility, viscosity increase and compression of nodes."""
    step = film.constants[one.OIL_STEP]
    if step == 0.0:
        return
    nodes = work.nodes[group]
    lanes = lane_count(work.nodes)
    compressible = film.constants[one.COMPRESSIBLE] > 0.0
    for lane in range(lanes):
        unit = work.wide[lanes * at.UNIT + lane]
        table = film.oil[int(work.wide[lanes * at.OIL_ROW + lane])]
        for k in range(nodes.shape[1] // lanes):
            q = lanes * k + lane
            p = nodes[at.PRESSURE, q] * unit
            reduced, slope, curve = reduced_pressure(table, step, p)
            nodes[at.REDUCED, q] = reduced / unit
            nodes[at.MOBILITY, q] = slope
            nodes[at.THICKENING, q] = -curve / slope * unit
            if compressible and nodes[at.FULL, q] > 0.0:
                density, by_pressure = density_factor(p)
                nodes[at.COMPRESSED, q] = density - 1.0
                # The density law has a kink at p = 0; a full node has the slope of the side p > 0.
                nodes[at.DENSE, q] = by_pressure * unit
            elif compressible:
                nodes[at.COMPRESSED, q] = 0.0
                nodes[at.DENSE, q] = 0.0
