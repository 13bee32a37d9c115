"""Connections whose components are sums of terms: forces in a stage, and components as unknowns of its iteration.

A component's motion is a sum over ports, with coefficients that depend on the crank angle
(:mod:`cranktrain.dynamics.topology.terms`). These components are unknowns of the iteration before those that are ports.
The compliance between two components is R H Rᵀ of the bodies that they hold. A row is the motion of the ports by a unit
force of one component, summed with the terms of the other.

Forces act at the displaced points: a force f on an interface that is displaced by u relative to its body's centre of
mass also has the moment (u × f)_z on the body. Gravity and inertia act at that centre.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import term_row, turning_ports
from cranktrain.dynamics.motion.crank_pin import accelerate, in_space, tell_twist
from cranktrain.dynamics.motion.film_ports import frame_numbers, law_block
from cranktrain.dynamics.topology import slots as top
from cranktrain.dynamics.topology.frames import fill_coefficients, move_frames
from cranktrain.film.laws import films as on
from cranktrain.film.laws.films import film_call


@inlined_kernel
def turn_frames(model, work, angle):
    """Update ``work.links.frames`` to an angle (rad) of the crank's frame."""
    if work.links.sizes[top.FRAMES_ANGLE] != angle:
        work.links.sizes[top.FRAMES_ANGLE] = angle
        move_frames(model.links.frames, angle, work.links.frames)


@kernel
def turn_terms(model, work, angle, speed):
    """Coefficients of all terms and their rates at an angle (rad) and speed (rad/s) of the crank's frame."""
    if model.links.terms.shape[0] == 0:
        return
    turn_frames(model, work, angle)
    kept = work.links.sizes
    if kept[top.TERMS_ANGLE] == angle and kept[top.TERMS_SPEED] == speed:
        return
    kept[top.TERMS_ANGLE] = angle
    kept[top.TERMS_SPEED] = speed
    fill_coefficients(model.links.terms, work.links.frames, speed, work.links.coefficients)


@inlined_kernel
def component(model, work, j, u):
    """Motion of component j: sum of its terms over the motion u (m,) of the ports."""
    links = model.links
    total = 0.0
    for t in range(links.starts[j], links.starts[j + 1]):
        total += work.links.coefficients[t, 0] * u[links.taken[t, 0]]
    return total


@kernel
def measure_links(model, work, u, ud):
    """Motion of all components and its rate from displacement u and velocity u̇ (m,) of the ports."""
    links = model.links
    gaps = work.links.gaps
    for j in range(links.scales.shape[0]):
        gaps[top.D, j] = component(model, work, j, u)
        rate = component(model, work, j, ud)
        for t in range(links.starts[j], links.starts[j + 1]):
            rate += work.links.coefficients[t, 1] * u[links.taken[t, 0]]
        gaps[top.DD, j] = rate


@kernel
def link_forces(model, work, frame, pressures, ratio):
    """Forces and tangents of connections by terms at the ports' motion. Return 0, or the status of a failed law."""
    links = model.links
    u = work.port[at.U]
    ud = work.port[at.UD]
    f = work.port[at.FORCES]
    gaps = work.links.gaps
    turn_terms(model, work, frame[at.THETA], frame[at.WHIRL])
    measure_links(model, work, u, ud)
    for k in range(links.ports.shape[0]):
        f[int(links.ports[k])] = 0.0
    status = 0
    out = model.laws.out
    for k in range(term_row(model), model.connections.shape[0]):
        status |= link_law(model, work, frame, pressures, k, on.FORCE, work.scratch, out)
        row = model.connections[k]
        first = row[at.GAP]
        if frame[at.BURN] < 0.0:
            if model.laws.traits[k, on.MASS] > 0.0:
                frame[at.GIVEN_POWER] += out[on.GAS_POWER]
            elif row[at.ACCOUNT] == at.GAS_WORK and row[at.OF_CYLINDER] >= 0:
                frame[at.GIVEN_POWER] += out[0] * (model.laws.velocity[k, 0] - wandering(model, work, frame, u, first))
        for r in range(row[at.COUPLED]):
            gaps[top.F, first + r] = out[r]
        turning = frame_turn(work, row) * frame[at.WHIRL]
        law_block(out, row[at.COUPLED], row[at.PAIRS], ratio, turning, work.blocks[k])
        if row[at.RUBS] > 0:
            rub(row, links.levers[k - term_row(model)], out, gaps[top.D], u, f)
    frame_numbers(frame, model.laws.numbers)
    load_ports(model, work, gaps[top.F], f)
    for k in range(links.leans.shape[0]):
        power = lean(model, work, frame, k, u, f)
        row = model.connections[int(links.leans[k, top.LEANING])]
        if frame[at.BURN] < 0.0 and row[at.ACCOUNT] == at.GAS_WORK and row[at.OF_CYLINDER] >= 0:
            frame[at.GIVEN_POWER] += power
    displaced_moments(model, work, frame, u, f)
    return status


@inlined_kernel
def rub(row, lever, out, gaps, u, f):
    """Add the torque about z of a connection to the rotations of its ends, f (m,), from displacements u (m,) of ports.

    The torque is friction plus the moment of transverse couples on a tilted end with a ``lever``. The opposite torque
    acts on the second end about its own centre, from which the first end is displaced.
    """
    torque = out[on.FRICTION]
    if row[at.SPIN] >= 0:
        turn = row[at.SPIN]
        if lever > 0.0:
            # Moments on a journal by forces Q at its end, (−l Q_y, l Q_x), or moments on a collar.
            pair = row[at.COUPLED] - 2
            x, y = u[turn - 2], u[turn - 1]
            if row[at.PAIRS] == 0:
                torque += lever * (x * out[pair] + y * out[pair + 1])
            else:
                torque += x * out[pair + 1] - y * out[pair]
        f[turn] += row[at.SENSE_A] * torque
    if row[at.REACTS] >= 0:
        across = second_lever(row, gaps[row[at.GAP] :], out)
        f[row[at.REACTS]] -= row[at.SENSE_B] * (torque + across)


@inlined_kernel
def second_lever(row, place, out):
    """Moment (N m) about the second end's centre of a bearing's force at the first end, displaced by ``place``, m."""
    if row[at.PAIRS] != 0.0:
        return 0.0
    return place[0] * out[1] - place[1] * out[0]


@kernel
def lean(model, work, frame, k, u, f):
    """Rotate the force on a sliding end with the lean of its wall. Return the power of this change, W.

    Gas acts along the liner, and the wall presses normal to it, also if the liner leans. With forces along axes at
    rest, an end that slides far would gain energy from a leaning wall.
    """
    links = model.links
    row = links.leans[k]
    connection = model.connections[int(row[top.LEANING])]
    frames = work.links.frames
    x = 0.0
    y = 0.0
    for j in range(int(connection[at.GAP]), int(connection[at.GAP] + connection[at.COUPLED])):
        slide = links.slides[j]
        turned = frames[int(slide[top.SLIDES_IN]), top.TURNED]
        force = row[top.LEAN_SIGN] * work.links.gaps[top.F, j]
        x += force * (math.cos(turned) * slide[top.SLIDES_X] - math.sin(turned) * slide[top.SLIDES_Y])
        y += force * (math.sin(turned) * slide[top.SLIDES_X] + math.cos(turned) * slide[top.SLIDES_Y])
    own = int(row[top.SLIDER_PORT])
    wall = int(row[top.WALL_PORT])
    ud = work.port[at.UD]
    angle = u[wall + 5]
    x, y = -angle * y, angle * x
    moved = frames[int(row[top.LEANS_IN])]
    cos = math.cos(moved[top.TURNED])
    sin = math.sin(moved[top.TURNED])
    own_x = cos * x + sin * y
    own_y = cos * y - sin * x
    f[own] += own_x
    f[own + 1] += own_y
    f[own + 5] += row[top.SLIDER_X] * own_y - row[top.SLIDER_Y] * own_x
    lever_x = row[top.WALL_X] + moved[top.PLACE_X]
    lever_y = row[top.WALL_Y] + moved[top.PLACE_Y]
    f[wall] -= x
    f[wall + 1] -= y
    f[wall + 5] -= lever_x * y - lever_y * x
    own_vx = ud[own] - ud[own + 5] * row[top.SLIDER_Y] - frame[at.OMEGA] * moved[top.TURN] * u[own + 1]
    own_vy = ud[own + 1] + ud[own + 5] * row[top.SLIDER_X] + frame[at.OMEGA] * moved[top.TURN] * u[own]
    vx = frame[at.OMEGA] * moved[top.PLACE_X1] - ud[wall] + ud[wall + 5] * lever_y
    vy = frame[at.OMEGA] * moved[top.PLACE_Y1] - ud[wall + 1] - ud[wall + 5] * lever_x
    return own_x * own_vx + own_y * own_vy + x * vx + y * vy


@inlined_kernel
def sliding_rate(work, slide):
    """Relative velocity of the frames of sliding ends along a component, per crank angle, m/rad."""
    frames = work.links.frames
    moved = frames[int(slide[top.SLIDING])]
    other = frames[int(slide[top.AGAINST])]
    turned = frames[int(slide[top.SLIDES_IN]), top.TURNED]
    x = math.cos(turned) * slide[top.SLIDES_X] - math.sin(turned) * slide[top.SLIDES_Y]
    y = math.sin(turned) * slide[top.SLIDES_X] + math.cos(turned) * slide[top.SLIDES_Y]
    return x * (moved[top.PLACE_X1] - other[top.PLACE_X1]) + y * (moved[top.PLACE_Y1] - other[top.PLACE_Y1])


@inlined_kernel
def wandering(model, work, frame, u, j):
    """Rate of component j by motion of the contact point of a sliding end over the other body, which does no work.

    u (m,) are the displacements of the ports.
    """
    terms = model.links.terms
    frames = work.links.frames
    rate = 0.0
    for t in range(model.links.starts[j], model.links.starts[j + 1]):
        term = terms[t]
        if term[top.LEVER_FRAME] >= 0.0:
            apart = frames[int(term[top.GIVEN_FRAME]), top.TURNED] - frames[int(term[top.OWN_FRAME]), top.TURNED]
            lever_rate = frames[int(term[top.LEVER_FRAME]), top.PLACE_X1 + int(term[top.LEVER_WAY])]
            factor = term[top.AMPLITUDE] * math.cos(apart + term[top.ANGLE]) * lever_rate
            rate += factor * u[model.links.taken[t, 0]]
    return frame[at.OMEGA] * rate


@inlined_kernel
def frame_turn(work, row):
    """Rotation, per rotation of the crank, of the axes of a connection's law about their own z."""
    return row[at.AXES_SENSE] * work.links.frames[row[at.AXES], top.TURN]


@inlined_kernel
def place_link(model, work, whirl, omega, ud, k):
    """Set displacement and velocity of connection k from its components' motion, and the ``numbers`` of its force law.

    ``whirl`` and ``omega`` (rad/s) are the speeds of the frame and of the shaft, ud (m,) the ports' velocity.
    """
    row = model.connections[k]
    gaps = work.links.gaps
    first = row[at.GAP]
    place = model.laws.place[k]
    velocity = model.laws.velocity[k]
    for r in range(row[at.COUPLED]):
        place[r] = gaps[top.D, first + r]
        velocity[r] = gaps[top.DD, first + r]
        if model.links.slides[first + r, top.SLIDING] >= 0.0:
            velocity[r] += whirl * sliding_rate(work, model.links.slides[first + r])
    if row[at.PAIRS] >= 0:
        turning = frame_turn(work, row) * whirl
        for r in range(row[at.PAIRS], row[at.COUPLED] - 1, 2):
            velocity[r] -= turning * place[r + 1]
            velocity[r + 1] += turning * place[r]
    numbers = model.laws.numbers
    frames = work.links.frames
    sense = row[at.AXES_SENSE]
    angle = sense * frames[row[at.AXES], top.TURNED]
    numbers[on.ANGLE] = angle
    numbers[on.COS] = math.cos(angle)
    numbers[on.SIN] = math.sin(angle)
    own = sense * frames[row[at.FRAME_A], top.TURN] * omega
    other = sense * frames[row[at.FRAME_B], top.TURN] * omega
    if row[at.SPIN] >= 0:
        own += row[at.SENSE_A] * ud[row[at.SPIN]]
    if row[at.REACTS] >= 0:
        other += row[at.SENSE_B] * ud[row[at.REACTS]]
    numbers[on.SPEED] = own + other
    numbers[on.RUBBING] = own - other


@inlined_kernel
def link_law(model, work, frame, pressures, k, action, memory, out):
    """Evaluate the law of connection k at its motion, into ``out`` (SIZE,). Return 0, or a failure status."""
    laws = model.laws
    place_link(model, work, frame[at.WHIRL], frame[at.OMEGA], work.port[at.UD], k)
    if model.connections[k, at.OF_CYLINDER] >= 0.0:
        laws.numbers[on.PRESSURE] = pressures[model.connections[k, at.OF_CYLINDER]] - model.scalars[at.CRANKCASE]
    if model.connections[k, at.TAKES] >= 0:
        laws.numbers[on.INPUT] = frame[model.connections[k, at.TAKES]]
    if laws.traits[k, on.MASS] > 0.0:
        tell_motion(model, work, frame, k)
    out[on.FRICTION] = 0.0
    return film_call(laws, action, k, memory, out)


@kernel
def tell_motion(model, work, frame, k):
    """Pass the motion of the first end, and gravity, to a law with masses, whose axes are those of that end's frame."""
    row = model.connections[k]
    numbers = model.laws.numbers
    turn = frame_turn(work, row)
    numbers[on.WHIRL] = turn * frame[at.OMEGA]
    numbers[on.WHIRL_CHANGE] = turn * frame[at.OMEGA_DOT]
    numbers[on.GRAVITY] = model.scalars[at.GRAVITY]
    numbers[on.SLOPE] = 0.0
    numbers[on.COUPLE] = 0.0
    first = row[at.GAP]
    udd = work.port[at.UDD]
    place = model.laws.place[k]
    vx, vy = work.links.gaps[top.DD, first], work.links.gaps[top.DD, first + 1]
    in_space(place[0], place[1], vx, vy, numbers[on.WHIRL], place, model.laws.velocity[k])
    accelerate(vx, vy, component(model, work, first, udd), component(model, work, first + 1, udd), place, numbers)
    spin = row[at.SPIN]
    sense = row[at.SENSE_A]
    tell_twist(sense * work.port[at.U, spin], sense * work.port[at.UD, spin], sense * udd[spin], numbers)


@kernel
def load_ports(model, work, forces, f):
    """Add forces (C,) of all components to those at the ports, f (m,)."""
    links = model.links
    for j in range(forces.shape[0]):
        for t in range(links.starts[j], links.starts[j + 1]):
            f[links.taken[t, 0]] += work.links.coefficients[t, 0] * forces[j]


@inlined_kernel
def displaced_moments(model, work, frame, u, f):
    """Add moments of forces at displaced interfaces, about the body's centre of mass, to the interfaces' rotations."""
    links = model.links
    axes = work.links.axes
    axes[top.OF_CRANK, 0], axes[top.OF_CRANK, 1] = frame[at.CRANK_X], frame[at.CRANK_Y]
    axes[top.OF_BLOCK, 0], axes[top.OF_BLOCK, 1] = frame[at.BLOCK_X], frame[at.BLOCK_Y]
    for k in range(links.interfaces.shape[0]):
        row = links.interfaces[k]
        owner = int(row[top.OWNER])
        x = u[int(row[top.PORT_X])]
        y = u[int(row[top.PORT_Y])]
        x -= axes[owner, 0]
        y -= axes[owner, 1]
        f[int(row[top.PORT_TURN])] += x * f[int(row[top.PORT_Y])] - y * f[int(row[top.PORT_X])]


@kernel
def link_steps(model, work, step):
    """Compute the change of all components of terms from a ``step`` (m,) of all ports."""
    for j in range(model.links.scales.shape[0]):
        work.links.gaps[top.STEP, j] = component(model, work, j, step)


@kernel
def follow_links(model, work, f):
    """Add the change of the components' forces by their step to the ports' forces f (m,)."""
    step = work.links.gaps[top.STEP]
    change = work.links.gaps[top.F_CHANGE]
    for j in range(change.shape[0]):
        change[j] = 0.0
    for k in range(term_row(model), model.connections.shape[0]):
        first = model.connections[k, at.GAP]
        size = model.connections[k, at.COUPLED]
        for r in range(size):
            for s in range(size):
                change[first + r] += work.factored[k, 4 * r + s] * step[first + s]
    load_ports(model, work, change, f)


@kernel
def link_compliance(model, work, frame, slot, out):
    """Compliance of components of terms (transposed), in rows and columns of ``out`` before those that are ports.

    Components that no body couples keep the zeros of the workspace.
    """
    turn_terms(model, work, frame[at.THETA], frame[at.WHIRL])
    links = model.links
    cos, sin = frame[at.COS], frame[at.SIN]
    count = links.scales.shape[0]
    answered = work.links.answered
    for i in range(count):
        unit_answer(model, work, i, slot, answered)
        for m in range(links.meet_starts[i], links.meet_starts[i + 1]):
            j = links.meets[m]
            out[i, j] = component(model, work, j, answered)
        if links.on_engine[i] == 0:
            continue
        # A component that is a port is the motion of a rotating body, less that of the bore or face beside it.
        for j in range(model.scales.shape[0]):
            out[i, count + j] = answered[j]
        for p in range(model.pairs.shape[0]):
            t = count + int(model.pairs[p, 0])
            s = int(model.pairs[p, 1])
            out[i, t] -= cos * answered[s] + sin * answered[s + 1]
            out[i, t + 1] -= cos * answered[s + 1] - sin * answered[s]
        for p in range(model.axial.shape[0]):
            out[i, count + int(model.axial[p, 0])] -= answered[int(model.axial[p, 1])]
        engine_column(model, work, cos, sin, slot, i, out)


@inlined_kernel
def unit_answer(model, work, i, slot, answered):
    """Motion of all ports (m,) by a unit force of component i of terms."""
    links = model.links
    for k in range(answered.shape[0]):
        answered[k] = 0.0
    for t in range(links.starts[i], links.starts[i + 1]):
        row = model.bodies.rows[links.taken[t, 1]]
        first, count = row[top.GROUP_PORT], row[top.GROUP_PORTS]
        moved = work.linear.compliance[slot, links.taken[t, 0]]
        for k in range(count):
            answered[first + k] += work.links.coefficients[t, 0] * moved[k]


@inlined_kernel
def engine_column(model, work, cos, sin, slot, i, out):
    """Column of compliance: motion of component i of terms by unit forces of components that are ports."""
    links = model.links
    n = model.scales.shape[0]
    first = links.scales.shape[0]
    turning = turning_ports(model)
    compliance = work.linear.compliance[slot]
    for k in range(n):
        out[first + k, i] = 0.0
    for t in range(links.starts[i], links.starts[i + 1]):
        port = links.taken[t, 0]
        c = work.links.coefficients[t, 0]
        if port < turning:
            for k in range(n):
                out[first + k, i] += c * compliance[k, port]
        elif links.taken[t, 1] == top.OF_BLOCK:
            own = port - turning
            for p in range(model.pairs.shape[0]):
                r = first + int(model.pairs[p, 0])
                s = int(model.pairs[p, 1])
                out[r, i] -= c * (cos * compliance[s, own] + sin * compliance[s + 1, own])
                out[r + 1, i] += c * (sin * compliance[s, own] - cos * compliance[s + 1, own])
            for p in range(model.axial.shape[0]):
                out[first + int(model.axial[p, 0]), i] -= c * compliance[int(model.axial[p, 1]), own]


@kernel
def link_size(model, work):
    """Scaled Newton step of all components of terms, and of those whose gap may close."""
    step = work.links.gaps[top.STEP]
    size = 0.0
    limited = 0.0
    for k in range(term_row(model), model.connections.shape[0]):
        first = model.connections[k, at.GAP]
        for j in range(first, first + model.connections[k, at.COUPLED]):
            change = abs(step[j]) / model.links.scales[j]
            size = max(size, change)
            if model.laws.traits[k, on.CLOSES] > 0.0:
                limited = max(limited, change)
    return size, limited
