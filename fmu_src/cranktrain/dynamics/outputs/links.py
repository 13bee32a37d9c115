"""Outputs of added bodies and connections, and their part in the energy balance."""

from cranktrain.core.kernel import inlined_kernel, kernel, law_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import term_row, turning_modes
from cranktrain.dynamics.model.state import POSITION, VELOCITY, offset
from cranktrain.dynamics.motion.film_memory import memory_offset
from cranktrain.dynamics.motion.film_ports import frame_numbers
from cranktrain.dynamics.motion.linear_algebra import dot
from cranktrain.dynamics.motion.links import (
    lean,
    link_law,
    load_ports,
    measure_links,
    rub,
    second_lever,
    turn_frames,
    turn_terms,
    wandering,
)
from cranktrain.dynamics.topology import slots as top
from cranktrain.film.laws import films as on


@law_kernel
def observe_links(model, work, state, members, out):
    """Fill the outputs of added bodies and connections, and add their energy and losses to the energy balance.

    Leaves the forces of added connections on all ports in ``work.links.answered``.
    """
    shown = model.links.shown
    turn_frames(model, work, work.frames[0, at.THETA])
    row = 0
    while row < shown.shape[0] and shown[row, top.SHOWN_KIND] >= top.BODY_SPEED:
        out[row] = body_value(model, work, state, shown[row])
        row += 1
    observe_bodies(model, work, state)
    work.powers[at.LINKS_LOSS] = 0.0
    frame = work.frames[0]
    turn_terms(model, work, frame[at.THETA], frame[at.WHIRL])
    measure_links(model, work, work.port[at.STATE_U], work.port[at.STATE_UD])
    forces = work.links.answered
    for k in range(work.port.shape[1]):
        work.port[at.U, k] = work.port[at.STATE_U, k]
        work.port[at.UD, k] = work.port[at.STATE_UD, k]
        work.port[at.UDD, k] = work.port[at.STATE_UDD, k]
        forces[k] = 0.0
    model.laws.numbers[on.RATIO] = 0.0
    model.laws.numbers[on.INERTANCE] = 0.0
    for k in range(term_row(model), model.connections.shape[0]):
        link_law(model, work, frame, work.pressures[0], k, on.OBSERVE, state[memory_offset(model, k) :])
        row_of = model.connections[k]
        if model.laws.traits[k, on.MASS] > 0.0:
            work.powers[at.GAS_WORK] += model.laws.out[on.GAS_POWER]
            work.powers[at.STORED] += model.laws.out[on.KINETIC]
        elif row_of[at.IS_GAS] > 0:
            work.powers[at.GAS_WORK] -= link_loss(model, work, frame, k)
        else:
            work.powers[at.LINKS_LOSS] += link_loss(model, work, frame, k)
        for r in range(row_of[at.COUPLED]):
            work.links.gaps[top.F, row_of[at.GAP] + r] = model.laws.out[r]
        if row_of[at.RUBS] > 0:
            rub(
                row_of,
                model.links.levers[k - term_row(model)],
                model.laws.out,
                work.links.gaps[top.D],
                work.port[at.STATE_U],
                forces,
            )
        while row < shown.shape[0] and int(shown[row, top.SHOWN_OF]) == k:
            out[row] = link_value(model, k, shown[row])
            row += 1
    frame_numbers(frame, model.laws.numbers)
    load_ports(model, work, work.links.gaps[top.F], forces)
    for k in range(model.links.leans.shape[0]):
        power = lean(model, work, frame, k, work.port[at.STATE_U], forces)
        if model.connections[int(model.links.leans[k, top.LEANING]), at.IS_GAS] > 0.0:
            work.powers[at.GAS_WORK] += power
        else:
            work.powers[at.LINKS_LOSS] -= power
    return 0


@inlined_kernel
def link_value(model, k, shown):
    """Value of one output of connection k, after a call of its force law."""
    place = int(shown[top.SHOWN_AT])
    kind = int(shown[top.SHOWN_KIND])
    if kind == top.PLACE_KIND:
        return model.laws.place[k, place]
    if kind == top.VELOCITY_KIND:
        return model.laws.velocity[k, place]
    if kind == top.OUT_KIND and place == on.FRICTION:
        return -model.laws.out[place]
    return model.laws.out[place]


@inlined_kernel
def link_loss(model, work, frame, k):
    """Power (W) that connection k takes from the bodies, including power stored in its springs."""
    laws = model.laws
    row = model.connections[k]
    lost = 0.0
    for r in range(row[at.COUPLED]):
        lost -= laws.out[r] * (
            laws.velocity[k, r] - wandering(model, work, frame, work.port[at.STATE_U], row[at.GAP] + r)
        )
    if row[at.RUBS] > 0:
        # The numbers of the force law are sum and difference of the speeds of both ends about z.
        speed = laws.numbers[on.RUBBING]
        across = second_lever(row, laws.out, work.links.gaps[top.D])
        other = 0.5 * (laws.numbers[on.SPEED] - speed)
        lost += across * other - laws.out[on.FRICTION] * speed
    if row[at.IS_LOAD] > 0:
        for r in range(row[at.COUPLED]):
            lost -= laws.out[r] * carried_rate(model, work, frame, row[at.GAP] + r)
    return lost


@kernel
def carried_rate(model, work, frame, j):
    """Rate of component j by rotation of frames, with which a load does work in addition to motion of its body.

    For two bodies in mesh these rates cancel. The other side of a load is at rest.
    """
    links = model.links
    rate = 0.0
    for t in range(links.starts[j], links.starts[j + 1]):
        port = links.taken[t, 0]
        for k in range(links.interfaces.shape[0]):
            held = links.interfaces[k]
            component = port - int(held[top.PORT_X])
            if 0 <= component < 6:
                turn = frame_speed(model, work, frame, int(held[top.OWNER]))
                if component == 0:
                    rate -= work.links.coefficients[t, 0] * turn * held[top.FIXED_Y]
                elif component == 1:
                    rate += work.links.coefficients[t, 0] * turn * held[top.FIXED_X]
                elif component == 5:
                    rate += work.links.coefficients[t, 0] * turn
    return rate


@inlined_kernel
def frame_speed(model, work, frame, owner):
    """Speed (rad/s) of the frame of an interface's body, about its own z axis."""
    if owner == top.OF_CRANK:
        return frame[at.OMEGA]
    if owner == top.OF_BLOCK:
        return 0.0
    row = model.bodies.rows[owner]
    return row[top.SENSE] * work.links.frames[row[top.FRAME_OF], top.TURN] * frame[at.OMEGA]


@kernel
def observe_bodies(model, work, state):
    """Energy of added bodies, relative to uniformly rotating frames, and the power of their own damping.

    Modes that bodies have in common with the crank are damped as the crank's.
    """
    n = model.omega2.shape[0]
    t = turning_modes(model)
    work.powers[at.BODIES_LOSS] = 0.0
    for b in range(top.OTHERS, model.bodies.rows.shape[0]):
        row = model.bodies.rows[b]
        constants = model.bodies.constants[b]
        size = row[top.MODES]
        o = row[top.OWN_MODE]
        first = row[top.MODE]
        q = state[offset(POSITION, n) + first :]
        v = state[offset(VELOCITY, n) + first :]
        moved = work.links.frames[row[top.FRAME_OF]]
        omega = row[top.SENSE] * moved[top.TURN] * work.frames[0, at.OMEGA]
        swept_x = work.frames[0, at.OMEGA] * moved[top.OWN_X1]
        swept_y = work.frames[0, at.OMEGA] * moved[top.OWN_Y1]
        if model.links.frames[row[top.FRAME_OF], top.FRAME_KIND] != top.TURNING:
            # Energy of the motion of uniformly rotating frames is constant, so it is left out.
            own = constants[top.MASS] * (swept_x * swept_x + swept_y * swept_y) + constants[top.INERTIA] * omega * omega
            across = swept_y * constants[top.UNBALANCE_X] - swept_x * constants[top.UNBALANCE_Y]
            work.powers[at.STORED] += 0.5 * own + omega * across
        x = dot(model.bodies.translation[0, o:], q, size)
        y = dot(model.bodies.translation[1, o:], q, size)
        x_rate = dot(model.bodies.translation[0, o:], v, size)
        y_rate = dot(model.bodies.translation[1, o:], v, size)
        work.powers[at.STORED] += swept_x * (x_rate - omega * y) + swept_y * (y_rate + omega * x)
        for i in range(size):
            carried = model.bodies.euler_load[o + i] * v[i] + omega * model.bodies.centrifugal_load[o + i] * q[i]
            for j in range(size):
                turned = v[j] * model.bodies.gyroscopic[o + i, j] - 0.5 * omega * q[j] * model.bodies.spin[o + i, j]
                carried += turned * q[i]
            work.powers[at.STORED] += omega * carried
            if row[top.ENDS_GROUP] > 0 and first >= t:
                work.powers[at.BODIES_LOSS] += model.damping[first + i] * v[i] * v[i]


@kernel
def body_value(model, work, state, shown):
    """Speed (rad/s), rotation relative to its frame (rad), or displacement of the centre (m) of an added body."""
    row = model.bodies.rows[int(shown[top.SHOWN_OF])]
    n = model.omega2.shape[0]
    size = row[top.MODES]
    o = row[top.OWN_MODE]
    q = state[offset(POSITION, n) + row[top.MODE] :]
    if shown[top.SHOWN_KIND] == top.BODY_PLACE:
        return dot(model.bodies.centre[int(shown[top.SHOWN_AT]), o:], q, size)
    if shown[top.SHOWN_KIND] == top.BODY_TURN:
        return row[top.SENSE] * dot(model.bodies.turn[o:], q, size)
    v = state[offset(VELOCITY, n) + row[top.MODE] :]
    turn = work.links.frames[row[top.FRAME_OF], top.TURN]
    return turn * work.frames[0, at.OMEGA] + row[top.SENSE] * dot(model.bodies.turn[o:], v, size)
