"""Preparation of a step and of a solution of films in lanes: ring cuts, gaps, oil in voids, pressure weights."""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.singles import all_eight, choose, eight, least_of, most_of, plus_product, put_eight
from cranktrain.film.elastic import grid as one
from cranktrain.film.elastic.balance import side_conductance
from cranktrain.film.elastic.content import GAINED, PREDICTED_ROOM, PREDICTED_VOID
from cranktrain.film.elastic.height import pressure_unit
from cranktrain.film.elastic.weights import FAR, NEAR
from cranktrain.film.lanes import grid as at
from cranktrain.film.lanes.gaps import mean_gap

FEWEST = 3
"""Least number of adjacent ruptured columns for a cut of the ring between them."""


@kernel
def choose_cut(film, start):
    """Return the column at which the ring of a film is cut; ``start`` (N n,) are the unknowns at the step's start.

    The cut lies before the second column of the longest run of ruptured columns, where hardly any oil flows. Without
    such a run, the ring is cut before the column of least pressure. The matrix neglects the flow through the cut; the
    balance includes it.
    """
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    best = 0
    length = 0
    run = 0
    lowest = 0
    least = math.inf
    for k in range(2 * n_phi):
        i = k if k < n_phi else k - n_phi
        pressed = 0.0
        for j in range(n_z):
            f = i * n_z + j
            if film.supply[f] == 0.0 and start[f] >= 0.0:
                pressed += 1.0e-30 + start[f]
        if pressed < least:
            least = pressed
            lowest = i
        run = run + 1 if pressed == 0.0 else 0
        if run > length:
            length = run
            best = i
    if length < FEWEST:
        return lowest
    begin = best - min(length, n_phi) + 2
    return begin + n_phi if begin < 0 else begin


@kernel
def turn_geometry(film, work, group, lane, cut):
    """Copy the geometry to a lane, with columns counted from ``cut``."""
    marks = work.marks[group]
    if marks[lane, at.CUT] == cut:
        return
    marks[lane, at.CUT] = cut
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    shapes = work.shapes[group]
    faces = n_phi * lines
    for position in range(n_phi):
        i = cut + position
        if i >= n_phi:
            i -= n_phi
        for k in range(4):
            work.trig[group, position, 8 * k + lane] = film.trig[i, k]
        for k in range(int(film.constants[one.N_SHAPES])):
            for line in range(lines):
                shapes[position * lines + line, 8 * k + lane] = film.shapes[i * lines + line, k + 1]
            for j in range(n_z):
                shapes[faces + position * n_z + j, 8 * k + lane] = film.shapes[faces + i * n_z + j, k + 1]
        for j in range(n_z):
            work.supply[group, 8 * (position * n_z + j) + lane] = film.supply[i * n_z + j]


@kernel
def lane_units(film, work, lane, viscosity, row):
    """Set the oil of a lane: viscosity (Pa s), row of the oil table, and units that depend on viscosity."""
    constants = film.constants
    constants[one.VISCOSITY] = viscosity
    unit = pressure_unit(constants)
    work.wide[8 * at.ETA + lane] = viscosity
    work.wide[8 * at.UNIT + lane] = unit
    work.wide[8 * at.OIL_ROW + lane] = row
    work.lane[8 * at.PER_UNIT + lane] = 1.0 / unit
    work.lane[8 * at.SUPPLY + lane] = constants[one.SUPPLY_PRESSURE] / unit


@kernel
def lane_motion(film, work, lane, motion, speed, film_past):
    """Set the motion (2, 4) and speed of a lane's journal; ``film_past`` is start position, start shapes, Δ, shapes."""
    constants = film.constants
    start_place, start_shapes, known, shapes = film_past
    per_clearance = 1.0 / constants[one.CLEARANCE]
    wide = work.wide
    for k in range(4):
        wide[8 * (at.PLACE + k) + lane] = motion[0, k] * per_clearance
        wide[8 * (at.VELOCITY + k) + lane] = motion[1, k] * per_clearance
        wide[8 * (at.START_PLACE + k) + lane] = start_place[k] * per_clearance
        work.lane[8 * (at.MOVE + k) + lane] = wide[8 * (at.PLACE + k) + lane] - wide[8 * (at.START_PLACE + k) + lane]
        work.lane[8 * (at.PACE + k) + lane] = wide[8 * (at.VELOCITY + k) + lane]
    for k in range(shapes.shape[0]):
        wide[8 * (at.SHIFT + k) + lane] = shapes[k] * per_clearance
        wide[8 * (at.START_SHIFT + k) + lane] = start_shapes[k] * per_clearance
        wide[8 * (at.KNOWN + k) + lane] = known[k] * per_clearance
    wide[8 * at.SPEED + lane] = speed
    per_angle = constants[one.N_PHI] / (2.0 * math.pi)
    drive = 0.5 * speed * per_angle
    work.lane[8 * at.FORWARD + lane] = max(drive, 0.0)
    work.lane[8 * at.BACKWARD + lane] = max(-drive, 0.0)


@kernel
def prepare_step(film, work, group, starts, own):
    """Compute gaps, oil in voids, weights and limited transport at the step's start from unknowns ``starts`` (b, N n).

    ``own`` (8,) holds the numbers of the films in the lanes.
    """
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    nodes = work.nodes[group]
    marks = work.marks[group]
    for lane in range(at.LANES):
        film_number = int(own[lane])
        start = starts[film_number]
        cut = int(marks[lane, at.CUT])
        for position in range(n_phi):
            i = cut + position
            if i >= n_phi:
                i -= n_phi
            for j in range(n_z):
                u = start[i * n_z + j]
                q = position * lines + j + 1
                nodes[at.NEXT, 8 * q + lane] = u if u < 0.0 else 0.0
                nodes[at.WAS_VOID, 8 * q + lane] = 1.0 if u < 0.0 else 0.0
    _start_gaps(film, work, group)
    sigma = film.constants[one.ROUGHNESS]
    for q in range(n_phi * lines):
        is_open, _ = mean_gap(work.gaps, eight(nodes, (at.START, q)), 1.0 / sigma, sigma)
        put_eight(nodes, (at.OPEN, q), is_open)
        put_eight(nodes, (at.PRESSING, q), is_open)
    for position in range(n_phi):
        _limited_transport(work, group, position, n_phi, n_z)
        _weights(work, group, position, n_z)
        for j in range(n_z):
            q = position * lines + j + 1
            fill = most_of(1.0 + eight(nodes, (at.NEXT, q)), all_eight(0.0))
            held = eight(nodes, (at.WAS_VOID, q)) * (fill * eight(nodes, (at.OPEN, q)))
            put_eight(nodes, (at.START_MASS, q), held)
            put_eight(nodes, (at.MASS, q), held)
    for lane in range(at.LANES):
        marks[lane, at.PREPARED] = 1.0
        marks[lane, at.STAGED] = 0.0
        marks[lane, at.SIGN] = 1.0 if work.wide[8 * at.SPEED + lane] >= 0.0 else -1.0


@kernel
def prepare_stage(film, work, group, content, own):
    """Set the oil of nodes and the limited transport of a stage from ``content`` (b, CONTENT, N n) of films ``own``."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    nodes = work.nodes[group]
    for lane in range(at.LANES):
        mine = content[int(own[lane])]
        cut = int(work.marks[group, lane, at.CUT])
        for position in range(n_phi):
            i = cut + position
            if i >= n_phi:
                i -= n_phi
            for j in range(n_z):
                q = 8 * (position * lines + j + 1) + lane
                nodes[at.MASS, q] = nodes[at.START_MASS, q] + mine[GAINED, i * n_z + j]
                nodes[at.NEXT, q] = mine[PREDICTED_VOID, i * n_z + j]
                nodes[at.PRESSING, q] = mine[PREDICTED_ROOM, i * n_z + j]
        work.marks[group, lane, at.STAGED] = 1.0
    for position in range(n_phi):
        _limited_transport(work, group, position, n_phi, n_z)


@kernel
def _start_gaps(film, work, group):
    """Compute the distances of the surfaces at the step's start, at nodes and faces, in double precision."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    for position in range(n_phi):
        for line in range(lines):
            q = position * lines + line
            _start_gap(film, work, group, position, at.COS, line, q, q, work.nodes[group, at.START])
        for j in range(n_z):
            f = position * n_z + j
            q = n_phi * lines + f
            _start_gap(film, work, group, position, at.FACE_COS, j + 1, q, f, work.faces[group, at.FACE_START])


@inlined_kernel
def _start_gap(film, work, group, position, cos, line, q, to, out):
    """Compute the distance of the surfaces at a point of all lanes, in ``out[to]``; ``cos`` is a column of trig."""
    wide = work.wide
    trig = work.trig[group, position]
    shapes = work.shapes[group, q]
    zeta = film.lines[line, one.ZETA]
    for c in range(at.LANES):
        x = wide[8 * at.START_PLACE + c] + zeta * wide[8 * (at.START_PLACE + 2) + c]
        y = wide[8 * (at.START_PLACE + 1) + c] + zeta * wide[8 * (at.START_PLACE + 3) + c]
        work.total[c] = 1.0 + film.lines[line, one.PROFILE] - x * trig[8 * cos + c] - y * trig[8 * (cos + 1) + c]
    for k in range(int(film.constants[one.N_SHAPES])):
        for c in range(at.LANES):
            work.total[c] += shapes[8 * k + c] * wide[8 * (at.START_SHIFT + k) + c]
    for c in range(at.LANES):
        out[8 * to + c] = work.total[c]


@inlined_kernel
def _limited_transport(work, group, position, n_phi, n_z):
    """Compute the second-order correction of face contents, with monotonised central limiter, upwind in each lane.

    Row NEXT holds the voids, row PRESSING the gaps.
    """
    lines = n_z + 2
    nodes = work.nodes[group]
    down = (position + 1 if position + 1 < n_phi else 0) * lines + 1
    further = (position + 2 if position + 2 < n_phi else position + 2 - n_phi) * lines + 1
    here = position * lines + 1
    behind = (position - 1 if position > 0 else n_phi - 1) * lines + 1
    forward = eight(work.lane, at.FORWARD) >= eight(work.lane, at.BACKWARD)
    none = all_eight(0.0)
    for j in range(n_z):
        own = eight(nodes, (at.NEXT, here + j))
        next_one = eight(nodes, (at.NEXT, down + j))
        donor = choose(forward, own, next_one)
        ahead = choose(forward, next_one, own) - donor
        past = donor - choose(forward, eight(nodes, (at.NEXT, behind + j)), eight(nodes, (at.NEXT, further + j)))
        change = 0.5 * (ahead + past)
        size = most_of(change, none - change)
        twice = 2.0 * most_of(ahead, none - ahead)
        change = choose(twice < size, 2.0 * ahead, change)
        size = least_of(size, twice)
        change = choose(2.0 * most_of(past, none - past) < size, 2.0 * past, change)
        change = choose((ahead * past > 0.0) & (donor < 0.0), change, none)
        mean = 0.5 * (eight(nodes, (at.PRESSING, here + j)) + eight(nodes, (at.PRESSING, down + j)))
        put_eight(work.faces[group], (at.FACE_LIMITED, position * n_z + j), mean * change)


@inlined_kernel
def _weights(work, group, position, n_z):
    """Compute the weights of one column's pressures along ζ by the rule of :mod:`cranktrain.film.elastic.weights`."""
    nodes = work.nodes[group]
    lines = work.lines
    first = position * (n_z + 2)
    supply = work.supply[group]
    none = all_eight(0.0)
    for line in range(n_z + 2):
        put_eight(nodes, (at.WEIGHT, first + line), none)
        put_eight(nodes, (at.CHANGE, first + line), none)
        # Weight of each line without the term of the flow's slope q′, by which a line loses at most half of its weight.
        h = eight(nodes, (at.OPEN, first + line))
        part = none
        if line > 0:
            nearer = eight(nodes, (at.OPEN, first + line - 1))
            part = (lines[line, at.ZETA] - lines[line - 1, at.ZETA]) * h / (h + nearer)
        if line <= n_z:
            beyond = eight(nodes, (at.OPEN, first + line + 1))
            part = part + (lines[line + 1, at.ZETA] - lines[line, at.ZETA]) * h / (h + beyond)
            over = side_conductance(h, beyond)[0] / all_eight(lines[line + 1, at.ZETA] - lines[line, at.ZETA])
            put_eight(nodes, (at.CHANGE, first + line), over)
        put_eight(nodes, (at.AFTER, first + line), part)
        put_eight(nodes, (at.WEIGHT, first + line), part)
    for line in range(n_z + 1):
        # The flow jumps at a supply, whose position differs between lanes.
        f = position * n_z + line
        before = none
        after = none
        if line > 0:
            before = 1.0 - eight(supply, f - 1)
        if line < n_z:
            after = 1.0 - eight(supply, f)
        _bend(work, group, first, line, before, after, n_z)


@inlined_kernel
def _bend(work, group, first, line, before, after, n_z):
    """Add the flow slope's term for the spacing after a line; ``before``, ``after`` are 1 if that neighbour counts."""
    nodes = work.nodes[group]
    lines = work.lines
    none = all_eight(0.0)
    q = first + line
    own = eight(nodes, (at.OPEN, q))
    beyond = eight(nodes, (at.OPEN, q + 1))
    zeta = lines[line, at.ZETA]
    length = lines[line + 1, at.ZETA] - zeta
    near = own + NEAR * (beyond - own)
    far = own + FAR * (beyond - own)
    near = near * near * near
    far = far * far * far
    both = near + far
    variance = near * far / (3.0 * both * both)
    over = eight(nodes, (at.CHANGE, q))
    last = line - 1 if line > 0 else line
    next_one = line + 1 if line < n_z else line
    at_low = zeta + lines[line + 1, at.ZETA]
    apart = after * (lines[next_one, at.ZETA] + lines[min(next_one + 1, n_z + 1), at.ZETA] - at_low)
    apart = apart + before * (at_low - (lines[last, at.ZETA] + lines[last + 1, at.ZETA]))
    counts = apart > 0.0
    low_over = choose(before > 0.0, eight(nodes, (at.CHANGE, first + last)), over)
    high_over = choose(after > 0.0, eight(nodes, (at.CHANGE, first + next_one)), over)
    high_part = choose(after > 0.0, eight(nodes, (at.AFTER, first + min(next_one + 1, n_z + 1))),
                       eight(nodes, (at.AFTER, q + 1)))  # fmt: skip
    low_part = choose(before > 0.0, eight(nodes, (at.AFTER, first + last)), eight(nodes, (at.AFTER, q)))
    bend = 2.0 * length * length * variance / (over * choose(counts, apart, all_eight(1.0)))
    bend = least_of(bend, 0.5 * high_part / high_over)
    bend = least_of(bend, 0.5 * low_part / low_over)
    bend = choose(counts, bend, none)
    by_high = bend * high_over
    by_low = bend * low_over
    # In a single film this is weights[high] += by_high, weights[high + 1] -= by_high; ``low`` has opposite signs.
    after_high = choose(after > 0.0, by_high, none)
    here_high = by_high - after_high
    before_low = choose(before > 0.0, by_low, none)
    here_low = by_low - before_low
    _add(nodes, first + next_one, after_high)
    if line < n_z:
        _add(nodes, first + next_one + 1, none - after_high)
    _add(nodes, q, here_high - here_low)
    _add(nodes, q + 1, here_low - here_high)
    _add(nodes, first + last, none - before_low)
    _add(nodes, first + last + 1, before_low)


@inlined_kernel
def _add(nodes, q, value):
    put_eight(nodes, (at.WEIGHT, q), eight(nodes, (at.WEIGHT, q)) + value)


@kernel
def begin_solution(film, work, group, per_step, per_gain):
    """Compute gaps at the present position and shapes, their growth rates, and the transport correction."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    count = int(film.constants[one.N_SHAPES])
    lane = work.lane
    wide = work.wide
    for k in range(count):
        for c in range(at.LANES):
            lane[8 * (at.STEP + k) + c] = wide[8 * (at.SHIFT + k) + c] - wide[8 * (at.START_SHIFT + k) + c]
            lane[8 * (at.RATE + k) + c] = per_gain * (wide[8 * (at.SHIFT + k) + c] - wide[8 * (at.KNOWN + k) + c])
    for c in range(at.LANES):
        rate = lane[8 * at.FORWARD + c] - lane[8 * at.BACKWARD + c]
        share = 0.0
        if abs(rate) < per_step and rate * work.marks[group, c, at.SIGN] > 0.0:
            share = min(2.0 - 2.0 * abs(rate) / per_step, 1.0)
        lane[8 * at.EXTRA_RATE + c] = 0.5 * share * rate
    _node_gaps(work, group, n_phi, lines, count)
    _face_gaps(work, group, n_phi, n_z, count)


@inlined_kernel
def _node_gaps(work, group, n_phi, lines, count):
    """Compute gaps at nodes and their growth rates from displacements and rates since the step's start."""
    nodes = work.nodes[group]
    shapes = work.shapes[group]
    lane = work.lane
    x = eight(lane, at.MOVE)
    y = eight(lane, at.MOVE + 1)
    a = eight(lane, at.MOVE + 2)
    b = eight(lane, at.MOVE + 3)
    vx = eight(lane, at.PACE)
    vy = eight(lane, at.PACE + 1)
    va = eight(lane, at.PACE + 2)
    vb = eight(lane, at.PACE + 3)
    for position in range(n_phi):
        cos = eight(work.trig, (group, position, at.COS))
        sin = eight(work.trig, (group, position, at.SIN))
        middle = x * cos + y * sin
        tilt = a * cos + b * sin
        closing = vx * cos + vy * sin
        tilting = va * cos + vb * sin
        for line in range(lines):
            q = position * lines + line
            zeta = all_eight(work.lines[line, at.ZETA])
            change = all_eight(0.0) - middle - tilt * zeta
            growth = all_eight(0.0) - closing - tilting * zeta
            for k in range(count):
                s = eight(shapes, (q, k))
                change = plus_product(change, s, eight(lane, at.STEP + k))
                growth = plus_product(growth, s, eight(lane, at.RATE + k))
            put_eight(nodes, (at.FILM, q), eight(nodes, (at.START, q)) + change)
            put_eight(nodes, (at.GROWTH, q), growth)


@inlined_kernel
def _face_gaps(work, group, n_phi, n_z, count):
    """Compute gaps at faces and the transport correction of faces."""
    faces = work.faces[group]
    shapes = work.shapes[group]
    lane = work.lane
    first = n_phi * (n_z + 2)
    extra = eight(lane, at.EXTRA_RATE)
    for position in range(n_phi):
        cos = eight(work.trig, (group, position, at.FACE_COS))
        sin = eight(work.trig, (group, position, at.FACE_SIN))
        middle = eight(lane, at.MOVE) * cos + eight(lane, at.MOVE + 1) * sin
        tilt = eight(lane, at.MOVE + 2) * cos + eight(lane, at.MOVE + 3) * sin
        for j in range(n_z):
            f = position * n_z + j
            change = all_eight(0.0) - middle - tilt * work.lines[j + 1, at.ZETA]
            for k in range(count):
                change = plus_product(change, eight(shapes, (first + f, k)), eight(lane, at.STEP + k))
            put_eight(faces, (at.FACE_FILM, f), eight(faces, (at.FACE_START, f)) + change)
            put_eight(faces, (at.FACE_EXTRA, f), extra * eight(faces, (at.FACE_LIMITED, f)))
