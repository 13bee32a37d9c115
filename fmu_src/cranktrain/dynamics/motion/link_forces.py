"""Forces of connections whose components are sums of terms, at the ports of a stage.

Forces act at the displaced points: a force f on an interface that is displaced by u relative to its body's centre of
mass also has the moment (u × f)_z on the body. Gravity and inertia act at that centre.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import term_row
from cranktrain.dynamics.motion.law_forces import law_block
from cranktrain.dynamics.motion.law_motion import call_law
from cranktrain.dynamics.motion.links import frame_turn, load_ports, measure_links, turn_terms, wandering
from cranktrain.dynamics.topology import slots as top
from cranktrain.film.laws import films as on


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
        out[on.FRICTION] = 0.0
        status |= call_law(model, work, frame, pressures, on.FORCE, k, work.scratch, out)
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
