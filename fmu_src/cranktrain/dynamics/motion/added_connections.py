"""Forces of added connections in a stage, and their components of motion as unknowns of the Newton iteration.

A component's motion is a sum over ports, with coefficients that depend on the crank angle
(:mod:`cranktrain.dynamics.topology.terms`). The components are unknowns of the iteration after those of the engine's
own connections. The compliance between two components is R H Rᵀ of the bodies that they hold. A row is the motion of
the ports by a unit force of one component, summed with the terms of the other.

Forces act at the displaced points: a force f on an interface that is displaced by u relative to its body's centre of
mass also has the moment (u × f)_z on the body. Gravity and inertia act at that centre.
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import call_kernel, inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.topology import slots as added
from cranktrain.dynamics.topology.frames import fill_coefficients, move_frames
from cranktrain.film.laws.films import (
    ANGLE,
    BY_PLACE,
    BY_VELOCITY,
    COS,
    FORCE,
    FRICTION,
    PRESSURE,
    RUBBING,
    SIN,
    SPEED,
)


@inlined_kernel
def turn_frames(model, work, angle):
    """Update ``work.added.frames`` to an angle (rad) of the crank's frame."""
    if work.added.sizes[added.FRAMES_ANGLE] != angle:
        work.added.sizes[added.FRAMES_ANGLE] = angle
        move_frames(model.links.frames, angle, work.added.frames)


@kernel
def turn_terms(model, work, angle, speed):
    """Coefficients of all terms and their rates at an angle (rad) and speed (rad/s) of the crank's frame."""
    turn_frames(model, work, angle)
    kept = work.added.sizes
    if kept[added.TERMS_ANGLE] == angle and kept[added.TERMS_SPEED] == speed:
        return
    kept[added.TERMS_ANGLE] = angle
    kept[added.TERMS_SPEED] = speed
    fill_coefficients(model.links.terms, work.added.frames, speed, work.added.coefficients)


@inlined_kernel
def component(model, work, j, u):
    """Motion of component j: sum of its terms over the motion u (m,) of the ports."""
    links = model.links
    total = 0.0
    for t in range(int(links.starts[j]), int(links.starts[j + 1])):
        total += work.added.coefficients[t, 0] * u[int(links.terms[t, added.TERM_PORT])]
    return total


@kernel
def measure_links(model, work, u, ud):
    """Motion of all components and its rate from displacement u and velocity u̇ (m,) of the ports."""
    links = model.links
    gaps = work.added.gaps
    for j in range(links.scales.shape[0]):
        gaps[added.D, j] = component(model, work, j, u)
        rate = component(model, work, j, ud)
        for t in range(int(links.starts[j]), int(links.starts[j + 1])):
            rate += work.added.coefficients[t, 1] * u[int(links.terms[t, added.TERM_PORT])]
        gaps[added.DD, j] = rate


@kernel
def link_forces(model, work, frame, pressures, ratio):
    """Forces and tangents of added connections at the motion of the ports. Return 0, or the status of a failed law."""
    links = model.links
    u = work.port[at.U]
    ud = work.port[at.UD]
    f = work.port[at.FORCES]
    gaps = work.added.gaps
    turn_terms(model, work, frame[at.THETA], frame[at.WHIRL])
    measure_links(model, work, u, ud)
    for k in range(links.ports.shape[0]):
        f[int(links.ports[k])] = 0.0
    status = 0
    for k in range(links.rows.shape[0]):
        status |= link_law(model, work, frame, pressures, k, FORCE, work.scratch)
        row = links.rows[k]
        first = int(row[added.FIRST])
        size = int(row[added.SIZE])
        for r in range(size):
            gaps[added.F, first + r] = links.out[r]
        link_block(row, links.out, ratio, frame_turn(work, row) * frame[at.WHIRL], work.added.blocks[k])
        if row[added.RUBS] > 0.0:
            rub(row, links.out, gaps[added.D], u, f)
    load_ports(model, work, gaps[added.F], f)
    for k in range(links.leans.shape[0]):
        lean(model, work, frame, k, u, f)
    displaced_moments(model, work, frame, u, f)
    return status


@inlined_kernel
def rub(row, out, gaps, u, f):
    """Add the torque about z of a connection to the rotations of its ends, f (m,), from displacements u (m,) of ports.

    The torque is friction plus the moment of transverse couples on a tilted end. The opposite torque acts on the second
    end about its own centre, from which the first end is displaced.
    """
    torque = out[FRICTION]
    if row[added.TURN_A] >= 0.0:
        turn = int(row[added.TURN_A])
        if row[added.TILT_LEVER] > 0.0:
            # Moments on a journal by forces Q at its end, (−l Q_y, l Q_x), or moments on a collar.
            pair = int(row[added.SIZE]) - 2
            x, y = u[turn - 2], u[turn - 1]
            if row[added.PAIRS] == 0.0:
                torque += row[added.TILT_LEVER] * (x * out[pair] + y * out[pair + 1])
            else:
                torque += x * out[pair + 1] - y * out[pair]
        f[turn] += row[added.SENSE_A] * torque
    if row[added.TURN_B] >= 0.0:
        across = second_lever(row, out, gaps)
        f[int(row[added.TURN_B])] -= row[added.SENSE_B] * (torque + across)


@inlined_kernel
def second_lever(row, out, gaps):
    """Moment (N m) about the second end's centre of a bearing's force at the first end."""
    if row[added.PAIRS] != 0.0:
        return 0.0
    first = int(row[added.FIRST])
    return gaps[first] * out[1] - gaps[first + 1] * out[0]


@kernel
def lean(model, work, frame, k, u, f):
    """Rotate the force on a sliding end with the lean of its wall. Return the power of this change, W.

    Gas acts along the liner, and the wall presses normal to it, also if the liner leans. With forces along axes at
    rest, an end that slides far would gain energy from a leaning wall.
    """
    links = model.links
    row = links.leans[k]
    connection = links.rows[int(row[added.LEANING])]
    frames = work.added.frames
    x = 0.0
    y = 0.0
    for j in range(int(connection[added.FIRST]), int(connection[added.FIRST] + connection[added.SIZE])):
        slide = links.slides[j]
        turned = frames[int(slide[added.SLIDES_IN]), added.TURNED]
        force = row[added.LEAN_SIGN] * work.added.gaps[added.F, j]
        x += force * (math.cos(turned) * slide[added.SLIDES_X] - math.sin(turned) * slide[added.SLIDES_Y])
        y += force * (math.sin(turned) * slide[added.SLIDES_X] + math.cos(turned) * slide[added.SLIDES_Y])
    own = int(row[added.SLIDER_PORT])
    wall = int(row[added.WALL_PORT])
    ud = work.port[at.UD]
    angle = u[wall + 5]
    x, y = -angle * y, angle * x
    moved = frames[int(row[added.LEANS_IN])]
    cos = math.cos(moved[added.TURNED])
    sin = math.sin(moved[added.TURNED])
    own_x = cos * x + sin * y
    own_y = cos * y - sin * x
    f[own] += own_x
    f[own + 1] += own_y
    f[own + 5] += row[added.SLIDER_X] * own_y - row[added.SLIDER_Y] * own_x
    lever_x = row[added.WALL_X] + moved[added.PLACE_X]
    lever_y = row[added.WALL_Y] + moved[added.PLACE_Y]
    f[wall] -= x
    f[wall + 1] -= y
    f[wall + 5] -= lever_x * y - lever_y * x
    own_vx = ud[own] - ud[own + 5] * row[added.SLIDER_Y] - frame[at.OMEGA] * moved[added.TURN] * u[own + 1]
    own_vy = ud[own + 1] + ud[own + 5] * row[added.SLIDER_X] + frame[at.OMEGA] * moved[added.TURN] * u[own]
    vx = frame[at.OMEGA] * moved[added.PLACE_X1] - ud[wall] + ud[wall + 5] * lever_y
    vy = frame[at.OMEGA] * moved[added.PLACE_Y1] - ud[wall + 1] - ud[wall + 5] * lever_x
    return own_x * own_vx + own_y * own_vy + x * vx + y * vy


@inlined_kernel
def sliding_rate(work, slide):
    """Relative velocity of the frames of sliding ends along a component, per crank angle, m/rad."""
    frames = work.added.frames
    moved = frames[int(slide[added.SLIDING])]
    other = frames[int(slide[added.AGAINST])]
    turned = frames[int(slide[added.SLIDES_IN]), added.TURNED]
    x = math.cos(turned) * slide[added.SLIDES_X] - math.sin(turned) * slide[added.SLIDES_Y]
    y = math.sin(turned) * slide[added.SLIDES_X] + math.cos(turned) * slide[added.SLIDES_Y]
    return x * (moved[added.PLACE_X1] - other[added.PLACE_X1]) + y * (moved[added.PLACE_Y1] - other[added.PLACE_Y1])


@inlined_kernel
def frame_turn(work, row):
    """Rotation, per rotation of the crank, of the axes of a connection's law about their own z."""
    return row[added.AXES_SENSE] * work.added.frames[int(row[added.AXES]), added.TURN]


@inlined_kernel
def place_link(model, work, whirl, omega, ud, k):
    """Set displacement and velocity of connection k from its components' motion, and the ``numbers`` of its force law.

    ``whirl`` and ``omega`` (rad/s) are the speeds of the frame and of the shaft, ud (m,) the ports' velocity.
    """
    links = model.links
    row = links.rows[k]
    gaps = work.added.gaps
    first = int(row[added.FIRST])
    place = links.place[k]
    velocity = links.velocity[k]
    for r in range(int(row[added.SIZE])):
        place[r] = gaps[added.D, first + r]
        velocity[r] = gaps[added.DD, first + r]
        if links.slides[first + r, added.SLIDING] >= 0.0:
            velocity[r] += whirl * sliding_rate(work, links.slides[first + r])
    if row[added.PAIRS] >= 0.0:
        turning = frame_turn(work, row) * whirl
        for r in range(int(row[added.PAIRS]), int(row[added.SIZE]) - 1, 2):
            velocity[r] -= turning * place[r + 1]
            velocity[r + 1] += turning * place[r]
    numbers = links.numbers
    frames = work.added.frames
    sense = row[added.AXES_SENSE]
    angle = sense * frames[int(row[added.AXES]), added.TURNED]
    numbers[ANGLE] = angle
    numbers[COS] = math.cos(angle)
    numbers[SIN] = math.sin(angle)
    own = sense * frames[int(row[added.FRAME_A]), added.TURN] * omega
    other = sense * frames[int(row[added.FRAME_B]), added.TURN] * omega
    if row[added.TURN_A] >= 0.0:
        own += row[added.SENSE_A] * ud[int(row[added.TURN_A])]
    if row[added.TURN_B] >= 0.0:
        other += row[added.SENSE_B] * ud[int(row[added.TURN_B])]
    numbers[SPEED] = own + other
    numbers[RUBBING] = own - other


@inlined_kernel
def call_link(links, k, action, memory, out):
    """Call the force law of connection k at its displacement and velocity. Return 0, or a failure status."""
    row = links.entry[k]
    arguments = (row[1], action, row[2], links.place[k], links.velocity[k], links.numbers, memory, out)
    return call_kernel(row[0], arguments)


@inlined_kernel
def link_law(model, work, frame, pressures, k, action, memory):
    """Evaluate the law of connection k at its motion, into ``links.out``. Return 0, or a failure status."""
    links = model.links
    place_link(model, work, frame[at.WHIRL], frame[at.OMEGA], work.port[at.UD], k)
    if links.rows[k, added.CYLINDER] >= 0.0:
        links.numbers[PRESSURE] = pressures[int(links.rows[k, added.CYLINDER])] - model.scalars[at.CRANKCASE]
    links.out[FRICTION] = 0.0
    return call_link(links, k, action, memory, links.out)


@inlined_kernel
def link_block(row, out, ratio, turning, block):
    """Tangent (4 × 4) of a connection's forces by displacement in a stage, in axes rotating at ``turning``, rad/s."""
    for k in range(16):
        block[k] = out[BY_PLACE + k] + ratio * out[BY_VELOCITY + k]
    if row[added.PAIRS] >= 0.0:
        for r in range(4):
            for pair in range(int(row[added.PAIRS]), int(row[added.SIZE]) - 1, 2):
                i = 4 * r + pair
                block[i] += turning * out[BY_VELOCITY + i + 1]
                block[i + 1] -= turning * out[BY_VELOCITY + i]


@kernel
def load_ports(model, work, forces, f):
    """Add forces (C,) of all components to those at the ports, f (m,)."""
    links = model.links
    for t in range(links.terms.shape[0]):
        f[int(links.terms[t, added.TERM_PORT])] += (
            work.added.coefficients[t, 0] * forces[int(links.terms[t, added.COMPONENT])]
        )


@inlined_kernel
def displaced_moments(model, work, frame, u, f):
    """Add moments of forces at displaced interfaces, about the body's centre of mass, to the interfaces' rotations."""
    links = model.links
    for k in range(links.interfaces.shape[0]):
        row = links.interfaces[k]
        owner = int(row[added.OWNER])
        x = u[int(row[added.PORT_X])]
        y = u[int(row[added.PORT_Y])]
        if owner == added.OF_CRANK:
            x -= frame[at.CRANK_X]
            y -= frame[at.CRANK_Y]
        elif owner == added.OF_BLOCK:
            x -= frame[at.BLOCK_X]
            y -= frame[at.BLOCK_Y]
        else:
            x -= work.added.axes[owner, 0]
            y -= work.added.axes[owner, 1]
        f[int(row[added.PORT_TURN])] += x * f[int(row[added.PORT_Y])] - y * f[int(row[added.PORT_X])]


@kernel
def link_steps(model, work, step, out):
    """Write the change of all added components to ``out``, from a ``step`` (m,) of all ports."""
    for j in range(model.links.scales.shape[0]):
        out[j] = component(model, work, j, step)


@kernel
def follow_links(model, work, step, f):
    """Add the change of the components' forces by their ``step`` (C,) to the ports' forces f (m,)."""
    links = model.links
    change = work.added.gaps[added.F_CHANGE]
    for j in range(change.shape[0]):
        change[j] = 0.0
    for k in range(links.rows.shape[0]):
        first = int(links.rows[k, added.FIRST])
        size = int(links.rows[k, added.SIZE])
        for r in range(size):
            for s in range(size):
                change[first + r] += work.added.factored[k, 4 * r + s] * step[first + s]
    load_ports(model, work, change, f)


@kernel
def link_compliance(model, work, cos, sin, slot, out):
    """Compliance of added components (transposed), in rows and columns of ``out`` after the engine's own components."""
    n = model.scales.shape[0]
    count = model.links.scales.shape[0]
    answered = work.added.answered
    for i in range(count):
        unit_answer(model, work, i, slot, answered)
        for j in range(count):
            out[n + i, n + j] = 0.0
            if model.links.meets[i, j] > 0.0:
                out[n + i, n + j] = component(model, work, j, answered)
        if model.links.meets[i, count] == 0.0:
            for j in range(n):
                out[n + i, j] = 0.0
                out[j, n + i] = 0.0
            continue
        # Components of the engine are motions of rotating bodies minus stationary bodies.
        for j in range(n):
            out[n + i, j] = answered[j]
        for p in range(model.pairs.shape[0]):
            t = int(model.pairs[p, 0])
            s = int(model.pairs[p, 1])
            out[n + i, t] -= cos * answered[s] + sin * answered[s + 1]
            out[n + i, t + 1] -= cos * answered[s + 1] - sin * answered[s]
        for p in range(model.axial.shape[0]):
            out[n + i, int(model.axial[p, 0])] -= answered[int(model.axial[p, 1])]
        engine_column(model, work, cos, sin, slot, i, out)


@inlined_kernel
def unit_answer(model, work, i, slot, answered):
    """Motion of all ports (m,) by a unit force of added component i."""
    links = model.links
    for k in range(answered.shape[0]):
        answered[k] = 0.0
    turning = model.ports.shape[0]
    standing = model.block_ports.shape[0]
    for t in range(int(links.starts[i]), int(links.starts[i + 1])):
        port = int(links.terms[t, added.TERM_PORT])
        c = work.added.coefficients[t, 0]
        if port < turning:
            for k in range(turning):
                answered[k] += c * work.turning.compliance[slot, port, k]
        elif port < turning + standing:
            for k in range(standing):
                answered[turning + k] += c * work.block.compliance[slot, port - turning, k]
        else:
            b = owner_of(model.bodies, port)
            own = int(model.bodies.rows[b, added.OWN_PORT]) + port - int(model.bodies.rows[b, added.PORT])
            first = int(model.bodies.rows[b, added.GROUP_PORT])
            for k in range(int(model.bodies.rows[b, added.GROUP_PORTS])):
                answered[first + k] += c * work.added.compliance[slot, own, k]


@inlined_kernel
def owner_of(bodies, port):
    """Number of the added body to which a port belongs."""
    b = 0
    while port >= int(bodies.rows[b, added.PORT] + bodies.rows[b, added.PORTS]):
        b += 1
    return b


@inlined_kernel
def engine_column(model, work, cos, sin, slot, i, out):
    """Column of compliance: motion of added component i by unit forces of the engine's own components."""
    links = model.links
    n = model.scales.shape[0]
    turning = model.ports.shape[0]
    standing = model.block_ports.shape[0]
    for k in range(n):
        out[k, n + i] = 0.0
    for t in range(int(links.starts[i]), int(links.starts[i + 1])):
        port = int(links.terms[t, added.TERM_PORT])
        c = work.added.coefficients[t, 0]
        if port < turning:
            for k in range(n):
                out[k, n + i] += c * work.turning.compliance[slot, k, port]
        elif port < turning + standing:
            own = port - turning
            for p in range(model.pairs.shape[0]):
                r = int(model.pairs[p, 0])
                s = int(model.pairs[p, 1]) - turning
                by_x = work.block.compliance[slot, s, own]
                by_y = work.block.compliance[slot, s + 1, own]
                out[r, n + i] -= c * (cos * by_x + sin * by_y)
                out[r + 1, n + i] += c * (sin * by_x - cos * by_y)
            for p in range(model.axial.shape[0]):
                s = int(model.axial[p, 1]) - turning
                out[int(model.axial[p, 0]), n + i] -= c * work.block.compliance[slot, s, own]


@kernel
def link_size(model, work):
    """Write to ``work.added.sizes`` the scaled Newton step of all added components, and of the limited components."""
    links = model.links
    step = work.added.gaps[added.STEP]
    size = 0.0
    limited = 0.0
    for k in range(links.rows.shape[0]):
        first = int(links.rows[k, added.FIRST])
        for j in range(first, first + int(links.rows[k, added.SIZE])):
            change = abs(step[j]) / links.scales[j]
            size = max(size, change)
            if links.rows[k, added.CLOSES] > 0.0:
                limited = max(limited, change)
    work.added.sizes[added.ANY] = size
    work.added.sizes[added.LIMITED] = limited
