"""Mean gaps and contact of rough surfaces in lanes, read from a table of :mod:`cranktrain.film.contact.gap`."""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.singles import all_eight, any_lane, choose, eight, least_of, looked_up, most_of, put_eight
from cranktrain.film.contact.asperity import HIGHEST
from cranktrain.film.elastic import grid as one
from cranktrain.film.lanes import grid as at


@inlined_kernel
def table_place(h, per_sigma):
    """Return the row position of a gap in the table, and the distance of the gap below the first row, in u = H/σ."""
    u = (h * per_sigma - at.LOWEST_U) * at.PER_U
    below = least_of(u, all_eight(0.0))
    return most_of(u, all_eight(0.0)), below * (1.0 / at.PER_U)


@inlined_kernel
def hermite(table, row, t, value, slope):
    """Interpolate a column with its slopes by u between two rows, at t in [0, 1). Return value and slope per row."""
    a = looked_up(table, row, value)
    b = looked_up(table, row + 1.0, value)
    da = looked_up(table, row, slope) * (1.0 / at.PER_U)
    db = looked_up(table, row + 1.0, slope) * (1.0 / at.PER_U)
    rise = b - a
    first = da - rise
    bend = first + t * (rise - db - first)
    inner = t * (1.0 - t)
    return a + t * rise + inner * bend, rise + (1.0 - 2.0 * t) * bend + inner * (rise - db - first)


@kernel
def open_gaps(film, work, group, per_sigma, sigma):
    """Compute mean gaps with two derivatives at nodes and one at faces, and contact pressure over p₀ with its slope."""
    nodes = work.nodes[group]
    faces = work.faces[group]
    table = work.gaps
    rough = film.contact[0] > 0.0
    reach = HIGHEST * sigma
    one_ = all_eight(1.0)
    none = all_eight(0.0)
    top = all_eight(table.shape[0] - 2.0)
    unit = eight(work.lane, at.PER_UNIT)
    for q in range(nodes.shape[1] // 8):
        h = eight(nodes, (at.FILM, q))
        near = h < reach
        is_open = h
        slope = one_
        bend = none
        p = none
        by_gap = none
        if any_lane(near):
            place, below = table_place(h, per_sigma)
            row = least_of(whole(place), top)
            t = choose(near, place - row, none)
            value, rate = hermite(table, row, t, at.MEAN, at.MEAN_SLOPE)
            curve = looked_up(table, row, at.MEAN_BEND)
            curve = curve + t * (looked_up(table, row + 1.0, at.MEAN_BEND) - curve)
            is_open = choose(near, value * sigma, h)
            slope = choose(near, rate * at.PER_U, one_)
            bend = choose(near, curve * per_sigma, none)
            if rough:
                value, rate = hermite(table, row, t, at.PRESS, at.PRESS_SLOPE)
                rate = rate * at.PER_U
                p = choose(near, (value + rate * below) * unit, none)
                by_gap = choose(near, rate * per_sigma * unit, none)
        put_eight(nodes, (at.OPEN, q), is_open)
        put_eight(nodes, (at.SLOPE, q), slope)
        put_eight(nodes, (at.BEND, q), bend)
        put_eight(nodes, (at.CONTACT, q), p)
        put_eight(nodes, (at.CONTACT_SLOPE, q), by_gap)
    for f in range(faces.shape[1] // 8):
        h = eight(faces, (at.FACE_FILM, f))
        is_open, slope = mean_gap(table, h, per_sigma, sigma)
        put_eight(faces, (at.FACE_OPEN, f), is_open)
        put_eight(faces, (at.FACE_SLOPE, f), slope)


@inlined_kernel
def whole(place):
    """Return the integer part of single-precision numbers from 0 to 2²³; larger numbers have no fractional part."""
    big = 8388608.0
    rounded = (place + big) - big
    return choose(rounded > place, rounded - 1.0, rounded)


@inlined_kernel
def mean_gap(table, h, per_sigma, sigma):
    """Return the mean gap at a distance ``h`` of the surfaces, and its derivative."""
    near = h < HIGHEST * sigma
    is_open = h
    slope = all_eight(1.0)
    if any_lane(near):
        place, _ = table_place(h, per_sigma)
        row = least_of(whole(place), all_eight(table.shape[0] - 2.0))
        value, rate = hermite(table, row, choose(near, place - row, all_eight(0.0)), at.MEAN, at.MEAN_SLOPE)
        is_open = choose(near, value * sigma, h)
        slope = choose(near, rate * at.PER_U, slope)
    return is_open, slope


@kernel
def oil_state(film, work, group):
    """Compute reduced pressure over p₀, mobility and viscosity increase of nodes if viscosity depends on pressure."""
    if film.constants[one.OIL_STEP] == 0.0:
        return
    nodes = work.nodes[group]
    step = film.constants[one.OIL_STEP]
    last = film.oil.shape[1] - 1
    for lane in range(at.LANES):
        unit = work.wide[8 * at.UNIT + lane]
        table = film.oil[int(work.wide[8 * at.OIL_ROW + lane])]
        for q in range(nodes.shape[1] // 8):
            p = nodes[at.PRESSURE, 8 * q + lane] * unit
            place = p / step
            i = min(int(place), last - 1)
            t = min(place - i, 1.0)
            beyond = max(place - last, 0.0)
            low = table[i, 0] / step
            rise = table[i + 1, 0] / step - low
            first = table[i, 1] - rise
            second = rise - table[i + 1, 1]
            bend = first + t * (second - first)
            slope = rise + (1.0 - 2.0 * t) * bend + t * (1.0 - t) * (second - first)
            curve = 2.0 * (1.0 - 2.0 * t) * (second - first) - 2.0 * bend
            nodes[at.REDUCED, 8 * q + lane] = (low + t * rise + t * (1.0 - t) * bend + beyond * slope) * step / unit
            nodes[at.MOBILITY, 8 * q + lane] = slope
            nodes[at.THICKENING, 8 * q + lane] = 0.0 if beyond > 0.0 else -curve / slope / step * unit
