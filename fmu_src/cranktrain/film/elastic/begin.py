"""Preparation of a step and of a solution of elastic films: ring cuts, gaps, oil in voids, limited transport."""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.side_by_side import choose, get, lane_count, least_of, most_of, plus_product, put, spread
from cranktrain.engine.lubricant import density_factor
from cranktrain.film.elastic import grid as one
from cranktrain.film.elastic import workspace as at
from cranktrain.film.elastic.balance import pressure_unit
from cranktrain.film.elastic.content import GAINED, PREDICTED_ROOM, PREDICTED_VOID
from cranktrain.film.elastic.gaps import mean_gap
from cranktrain.film.elastic.weights import column_weights
from cranktrain.film.elastic.workspace import shape_count

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
    lanes = lane_count(work.nodes)
    shapes = work.shapes[group]
    faces = n_phi * lines
    for position in range(n_phi):
        i = (cut + position) % n_phi
        for k in range(4):
            work.trig[group, position, lanes * k + lane] = film.trig[i, k]
        for k in range(int(film.constants[one.N_SHAPES])):
            for line in range(lines):
                shapes[position * lines + line, lanes * k + lane] = film.shapes[i * lines + line, k + 1]
            for j in range(n_z):
                shapes[faces + position * n_z + j, lanes * k + lane] = film.shapes[faces + i * n_z + j, k + 1]
        for j in range(n_z):
            work.supply[group, lanes * (position * n_z + j) + lane] = film.supply[i * n_z + j]


@kernel
def set_lane(film, work, lane, i, viscosity, own):
    """Give a lane the film ``i``: its oil (viscosity in Pa s), and motion and past from the memory ``own`` of films."""
    constants = film.constants
    lanes = lane_count(work.nodes)
    lane_values = work.lane
    wide = work.wide
    work.own[lane] = float(i)
    constants[one.VISCOSITY] = viscosity
    unit = pressure_unit(constants)
    wide[lanes * at.ETA + lane] = viscosity
    wide[lanes * at.UNIT + lane] = unit
    wide[lanes * at.OIL_ROW + lane] = float(i)
    lane_values[lanes * at.PER_UNIT + lane] = 1.0 / unit
    lane_values[lanes * at.SUPPLY + lane] = constants[one.SUPPLY_PRESSURE] / unit
    per_clearance = 1.0 / constants[one.CLEARANCE]
    for k in range(4):
        place = own.motions[i, 0, k] * per_clearance
        start = own.start_place[i, k] * per_clearance
        velocity = own.motions[i, 1, k] * per_clearance
        wide[lanes * (at.PLACE + k) + lane] = place
        wide[lanes * (at.VELOCITY + k) + lane] = velocity
        wide[lanes * (at.START_PLACE + k) + lane] = start
        lane_values[lanes * (at.MOVE + k) + lane] = place - start
        lane_values[lanes * (at.PACE + k) + lane] = velocity
    for k in range(own.shapes.shape[1]):
        work.shifts[at.SHIFT, lanes * k + lane] = own.shapes[i, k] * per_clearance
        work.shifts[at.START_SHIFT, lanes * k + lane] = own.start_shapes[i, k] * per_clearance
        work.shifts[at.KNOWN, lanes * k + lane] = own.known[i, k] * per_clearance
    speed = own.speeds[i]
    wide[lanes * at.SPEED + lane] = speed
    drive = 0.5 * speed * (constants[one.N_PHI] / (2.0 * math.pi))
    lane_values[lanes * at.FORWARD + lane] = max(drive, 0.0)
    lane_values[lanes * at.BACKWARD + lane] = max(-drive, 0.0)


@kernel
def prepare_step(film, work, group, starts):
    """Compute gaps, oil in voids, weights and limited transport at the step's start from unknowns ``starts`` (b, N n).

    ``work.own`` holds the numbers of the films in the lanes.
    """
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    lanes = lane_count(work.nodes)
    nodes = work.nodes[group]
    marks = work.marks[group]
    for lane in range(lanes):
        start = starts[int(work.own[lane])]
        cut = int(marks[lane, at.CUT])
        for position in range(n_phi):
            i = (cut + position) % n_phi
            for j in range(n_z):
                u = start[i * n_z + j]
                q = lanes * (position * lines + j + 1) + lane
                nodes[at.NEXT, q] = u if u < 0.0 else 0.0
                nodes[at.WAS_VOID, q] = 1.0 if u < 0.0 else 0.0
                if film.constants[one.COMPRESSIBLE] > 0.0:
                    unit = work.wide[lanes * at.UNIT + lane]
                    nodes[at.START_COMPRESSED, q] = density_factor(u * unit)[0] - 1.0
    _start_gaps(film, work, group)
    sigma = film.constants[one.ROUGHNESS]
    for q in range(n_phi * lines):
        is_open, _ = mean_gap(work.gaps, get(nodes, (at.START, q)), 1.0 / sigma, sigma)
        put(nodes, (at.OPEN, q), is_open)
        put(nodes, (at.PRESSING, q), is_open)
    for position in range(n_phi):
        _limited_transport(work, group, position, n_phi, n_z)
        column_weights(work, group, position, n_z)
        for j in range(n_z):
            q = position * lines + j + 1
            fill = most_of(1.0 + get(nodes, (at.NEXT, q)), 0.0)
            held = get(nodes, (at.WAS_VOID, q)) * (fill * get(nodes, (at.OPEN, q)))
            put(nodes, (at.START_MASS, q), held)
            put(nodes, (at.MASS, q), held)
    for lane in range(lanes):
        marks[lane, at.PREPARED] = 1.0
        marks[lane, at.STAGED] = 0.0
        marks[lane, at.SIGN] = 1.0 if work.wide[lanes * at.SPEED + lane] >= 0.0 else -1.0


@kernel
def prepare_stage(film, work, group, content):
    """Set the oil of nodes and the limited transport of a stage from ``content`` (b, CONTENT, N n)."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    lanes = lane_count(work.nodes)
    nodes = work.nodes[group]
    for lane in range(lanes):
        mine = content[int(work.own[lane])]
        cut = int(work.marks[group, lane, at.CUT])
        for position in range(n_phi):
            i = (cut + position) % n_phi
            for j in range(n_z):
                q = lanes * (position * lines + j + 1) + lane
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
    lanes = lane_count(work.nodes)
    trig = work.trig[group, position]
    shapes = work.shapes[group, q]
    zeta = film.lines[line, one.ZETA]
    for c in range(lanes):
        x = wide[lanes * at.START_PLACE + c] + zeta * wide[lanes * (at.START_PLACE + 2) + c]
        y = wide[lanes * (at.START_PLACE + 1) + c] + zeta * wide[lanes * (at.START_PLACE + 3) + c]
        work.total[c] = (
            1.0 + film.lines[line, one.PROFILE] - x * trig[lanes * cos + c] - y * trig[lanes * (cos + 1) + c]
        )
    for k in range(shape_count(film, work)):
        for c in range(lanes):
            work.total[c] += shapes[lanes * k + c] * work.shifts[at.START_SHIFT, lanes * k + c]
    for c in range(lanes):
        out[lanes * to + c] = work.total[c]


@inlined_kernel
def _limited_transport(work, group, position, n_phi, n_z):
    """Compute the second-order correction of face contents, with monotonised central limiter, upwind in each lane.

    Row NEXT holds the voids, row PRESSING the gaps. The correction is explicit, so it does not change the matrix.
    """
    lines = n_z + 2
    nodes = work.nodes[group]
    down = (position + 1 if position + 1 < n_phi else 0) * lines + 1
    further = (position + 2 if position + 2 < n_phi else position + 2 - n_phi) * lines + 1
    here = position * lines + 1
    behind = (position - 1 if position > 0 else n_phi - 1) * lines + 1
    forward = get(work.lane, at.FORWARD) >= get(work.lane, at.BACKWARD)
    for j in range(n_z):
        own = get(nodes, (at.NEXT, here + j))
        next_one = get(nodes, (at.NEXT, down + j))
        donor = choose(forward, own, next_one)
        ahead = choose(forward, next_one, own) - donor
        past = donor - choose(forward, get(nodes, (at.NEXT, behind + j)), get(nodes, (at.NEXT, further + j)))
        change = 0.5 * (ahead + past)
        size = most_of(change, 0.0 - change)
        twice = 2.0 * most_of(ahead, 0.0 - ahead)
        change = choose(twice < size, 2.0 * ahead, change)
        size = least_of(size, twice)
        change = choose(2.0 * most_of(past, 0.0 - past) < size, 2.0 * past, change)
        change = choose((ahead * past > 0.0) & (donor < 0.0), change, 0.0)
        mean = 0.5 * (get(nodes, (at.PRESSING, here + j)) + get(nodes, (at.PRESSING, down + j)))
        put(work.faces[group], (at.FACE_LIMITED, position * n_z + j), mean * change)


@kernel
def begin_solution(film, work, group, per_step, per_gain):
    """Compute gaps at the present position and shapes, their growth rates, and the transport correction.

    The correction is zero if oil would pass more than one node within a step.
    """
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    count = shape_count(film, work)
    lanes = lane_count(work.nodes)
    shifts = work.shifts
    for k in range(lanes * count):
        work.steps[at.STEP, k] = shifts[at.SHIFT, k] - shifts[at.START_SHIFT, k]
        work.steps[at.RATE, k] = per_gain * (shifts[at.SHIFT, k] - shifts[at.KNOWN, k])
    for c in range(lanes):
        rate = work.lane[lanes * at.FORWARD + c] - work.lane[lanes * at.BACKWARD + c]
        share = 0.0
        if abs(rate) < per_step and rate * work.marks[group, c, at.SIGN] > 0.0:
            share = min(2.0 - 2.0 * abs(rate) / per_step, 1.0)
        work.lane[lanes * at.EXTRA_RATE + c] = 0.5 * share * rate
    _node_gaps(work, group, n_phi, n_z + 2, count)
    _face_gaps(work, group, n_phi, n_z, count)


@inlined_kernel
def _node_gaps(work, group, n_phi, lines, count):
    """Compute gaps at nodes and their growth rates from displacements and rates since the step's start."""
    nodes = work.nodes[group]
    shapes = work.shapes[group]
    lane = work.lane
    x = get(lane, at.MOVE)
    y = get(lane, at.MOVE + 1)
    a = get(lane, at.MOVE + 2)
    b = get(lane, at.MOVE + 3)
    vx = get(lane, at.PACE)
    vy = get(lane, at.PACE + 1)
    va = get(lane, at.PACE + 2)
    vb = get(lane, at.PACE + 3)
    for position in range(n_phi):
        cos = get(work.trig, (group, position, at.COS))
        sin = get(work.trig, (group, position, at.SIN))
        middle = x * cos + y * sin
        tilt = a * cos + b * sin
        closing = vx * cos + vy * sin
        tilting = va * cos + vb * sin
        for line in range(lines):
            q = position * lines + line
            zeta = spread(work.lines[line, at.ZETA], nodes)
            change = 0.0 - middle - tilt * zeta
            growth = 0.0 - closing - tilting * zeta
            for k in range(count):
                s = get(shapes, (q, k))
                change = plus_product(change, s, get(work.steps, (at.STEP, k)))
                growth = plus_product(growth, s, get(work.steps, (at.RATE, k)))
            put(nodes, (at.FILM, q), get(nodes, (at.START, q)) + change)
            put(nodes, (at.GROWTH, q), growth)


@inlined_kernel
def _face_gaps(work, group, n_phi, n_z, count):
    """Compute gaps at faces and the transport correction of faces."""
    faces = work.faces[group]
    shapes = work.shapes[group]
    lane = work.lane
    first = n_phi * (n_z + 2)
    extra = get(lane, at.EXTRA_RATE)
    for position in range(n_phi):
        cos = get(work.trig, (group, position, at.FACE_COS))
        sin = get(work.trig, (group, position, at.FACE_SIN))
        middle = get(lane, at.MOVE) * cos + get(lane, at.MOVE + 1) * sin
        tilt = get(lane, at.MOVE + 2) * cos + get(lane, at.MOVE + 3) * sin
        for j in range(n_z):
            f = position * n_z + j
            change = 0.0 - middle - tilt * work.lines[j + 1, at.ZETA]
            for k in range(count):
                change = plus_product(change, get(shapes, (first + f, k)), get(work.steps, (at.STEP, k)))
            put(faces, (at.FACE_FILM, f), get(faces, (at.FACE_START, f)) + change)
            put(faces, (at.FACE_EXTRA, f), extra * get(faces, (at.FACE_LIMITED, f)))
