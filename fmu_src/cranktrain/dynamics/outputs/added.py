"""Outputs of added bodies and connections, and their part in the energy balance."""

from __future__ import annotations

import math

from cranktrain.core.kernel import inlined_kernel, kernel, law_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.state import POSITION, VELOCITY, offset
from cranktrain.dynamics.motion.added_connections import (
    lean,
    link_law,
    load_ports,
    measure_links,
    rub,
    second_lever,
    turn_frames,
    turn_terms,
)
from cranktrain.dynamics.motion.added_memory import link_offset
from cranktrain.dynamics.motion.linear_algebra import dot
from cranktrain.dynamics.topology import slots as added
from cranktrain.film.laws.films import FRICTION, OBSERVE, RUBBING, SPEED


@law_kernel
def observe_added(model, work, state, members, out):
    """Fill the outputs of added bodies and connections, and add their energy and losses to the energy balance.

    Leaves the forces of added connections on all ports in ``work.added.answered``.
    """
    shown = model.links.shown
    turn_frames(model, work, work.frames[0, at.THETA])
    row = 0
    while row < shown.shape[0] and shown[row, added.SHOWN_KIND] >= added.BODY_SPEED:
        out[row] = body_value(model, work, state, shown[row])
        row += 1
    observe_bodies(model, work, state)
    work.powers[at.LINKS_LOSS] = 0.0
    frame = work.frames[0]
    turn_terms(model, work, frame[at.THETA], frame[at.WHIRL])
    measure_links(model, work, work.port[at.STATE_U], work.port[at.STATE_UD])
    forces = work.added.answered
    for k in range(work.port.shape[1]):
        work.port[at.UD, k] = work.port[at.STATE_UD, k]
        forces[k] = 0.0
    for k in range(model.links.rows.shape[0]):
        link_law(model, work, frame, work.pressures[0], k, OBSERVE, state[link_offset(model, k) :])
        lost = link_loss(model, work, frame, k)
        if model.links.rows[k, added.IS_GAS] > 0.0:
            work.powers[at.GAS_WORK] -= lost
        else:
            work.powers[at.LINKS_LOSS] += lost
        first = int(model.links.rows[k, added.FIRST])
        for r in range(int(model.links.rows[k, added.SIZE])):
            work.added.gaps[added.F, first + r] = model.links.out[r]
        if model.links.rows[k, added.RUBS] > 0.0:
            rub(model.links.rows[k], model.links.out, work.added.gaps[added.D], work.port[at.STATE_U], forces)
        while row < shown.shape[0] and int(shown[row, added.SHOWN_OF]) == k:
            out[row] = link_value(model, k, shown[row])
            row += 1
    load_ports(model, work, work.added.gaps[added.F], forces)
    for k in range(model.links.leans.shape[0]):
        power = lean(model, work, frame, k, work.port[at.STATE_U], forces)
        if model.links.rows[int(model.links.leans[k, added.LEANING]), added.IS_GAS] > 0.0:
            work.powers[at.GAS_WORK] += power
        else:
            work.powers[at.LINKS_LOSS] -= power
    return 0


@inlined_kernel
def link_value(model, k, shown):
    """Value of one output of connection k, after a call of its force law."""
    place = int(shown[added.SHOWN_AT])
    kind = int(shown[added.SHOWN_KIND])
    if kind == added.PLACE_KIND:
        return model.links.place[k, place]
    if kind == added.VELOCITY_KIND:
        return model.links.velocity[k, place]
    if kind == added.OUT_KIND and place == FRICTION:
        return -model.links.out[place]
    return model.links.out[place]


@inlined_kernel
def link_loss(model, work, frame, k):
    """Power (W) that connection k takes from the bodies, including power stored in its springs."""
    links = model.links
    row = links.rows[k]
    lost = 0.0
    for r in range(int(row[added.SIZE])):
        lost -= links.out[r] * (links.velocity[k, r] - wandering(model, work, frame, int(row[added.FIRST]) + r))
    if row[added.RUBS] > 0.0:
        # The numbers of the force law are sum and difference of the speeds of both ends about z.
        speed = links.numbers[RUBBING]
        across = second_lever(row, links.out, work.added.gaps[added.D])
        other = 0.5 * (links.numbers[SPEED] - speed)
        lost += across * other - links.out[FRICTION] * speed
    if row[added.IS_LOAD] > 0.0:
        for r in range(int(row[added.SIZE])):
            lost -= links.out[r] * carried_rate(model, work, frame, int(row[added.FIRST]) + r)
    return lost


@kernel
def carried_rate(model, work, frame, j):
    """Rate of component j by rotation of frames, with which a load does work in addition to motion of its body.

    For two bodies in mesh these rates cancel. The other side of a load is at rest.
    """
    links = model.links
    rate = 0.0
    for t in range(int(links.starts[j]), int(links.starts[j + 1])):
        port = int(links.terms[t, added.TERM_PORT])
        for k in range(links.interfaces.shape[0]):
            held = links.interfaces[k]
            component = port - int(held[added.PORT_X])
            if 0 <= component < 6:
                turn = frame_speed(model, work, frame, int(held[added.OWNER]))
                if component == 0:
                    rate -= work.added.coefficients[t, 0] * turn * held[added.FIXED_Y]
                elif component == 1:
                    rate += work.added.coefficients[t, 0] * turn * held[added.FIXED_X]
                elif component == 5:
                    rate += work.added.coefficients[t, 0] * turn
    return rate


@inlined_kernel
def frame_speed(model, work, frame, owner):
    """Speed (rad/s) of the frame of an interface's body, about its own z axis."""
    if owner == added.OF_CRANK:
        return frame[at.OMEGA]
    if owner == added.OF_BLOCK:
        return 0.0
    row = model.bodies.rows[owner]
    return row[added.SENSE] * work.added.frames[int(row[added.FRAME_OF]), added.TURN] * frame[at.OMEGA]


@inlined_kernel
def wandering(model, work, frame, j):
    """Rate of component j by motion of the contact point of a sliding end over the other body, which does no work."""
    terms = model.links.terms
    frames = work.added.frames
    rate = 0.0
    for t in range(int(model.links.starts[j]), int(model.links.starts[j + 1])):
        term = terms[t]
        if term[added.LEVER_FRAME] >= 0.0:
            apart = (
                frames[int(term[added.GIVEN_FRAME]), added.TURNED] - frames[int(term[added.OWN_FRAME]), added.TURNED]
            )
            lever_rate = frames[int(term[added.LEVER_FRAME]), added.PLACE_X1 + int(term[added.LEVER_WAY])]
            factor = term[added.AMPLITUDE] * math.cos(apart + term[added.ANGLE]) * lever_rate
            rate += factor * work.port[at.STATE_U, int(term[added.TERM_PORT])]
    return frame[at.OMEGA] * rate


@kernel
def observe_bodies(model, work, state):
    """Energy of added bodies, relative to uniformly rotating frames, and the power of their own damping."""
    n = model.omega2.shape[0]
    work.powers[at.ADDED_LOSS] = 0.0
    for b in range(model.bodies.rows.shape[0]):
        row = model.bodies.rows[b]
        size = int(row[added.MODES])
        o = int(row[added.OWN_MODE])
        first = int(row[added.MODE])
        q = state[offset(POSITION, n) + first :]
        v = state[offset(VELOCITY, n) + first :]
        moved = work.added.frames[int(row[added.FRAME_OF])]
        omega = row[added.SENSE] * moved[added.TURN] * work.frames[0, at.OMEGA]
        swept_x = work.frames[0, at.OMEGA] * moved[added.OWN_X1]
        swept_y = work.frames[0, at.OMEGA] * moved[added.OWN_Y1]
        if model.links.frames[int(row[added.FRAME_OF]), added.FRAME_KIND] != added.TURNING:
            # Energy of the motion of uniformly rotating frames is constant, so it is left out.
            own = row[added.MASS] * (swept_x * swept_x + swept_y * swept_y) + row[added.INERTIA] * omega * omega
            across = swept_y * row[added.UNBALANCE_X] - swept_x * row[added.UNBALANCE_Y]
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
            if row[added.ENDS_GROUP] > 0.0:
                work.powers[at.ADDED_LOSS] += model.damping[first + i] * v[i] * v[i]


@kernel
def body_value(model, work, state, shown):
    """Speed (rad/s), rotation relative to its frame (rad), or displacement of the centre (m) of an added body."""
    row = model.bodies.rows[int(shown[added.SHOWN_OF])]
    n = model.omega2.shape[0]
    size = int(row[added.MODES])
    o = int(row[added.OWN_MODE])
    q = state[offset(POSITION, n) + int(row[added.MODE]) :]
    if shown[added.SHOWN_KIND] == added.BODY_PLACE:
        return dot(model.bodies.centre[int(shown[added.SHOWN_AT]), o:], q, size)
    if shown[added.SHOWN_KIND] == added.BODY_TURN:
        return row[added.SENSE] * dot(model.bodies.turn[o:], q, size)
    v = state[offset(VELOCITY, n) + int(row[added.MODE]) :]
    turn = work.added.frames[int(row[added.FRAME_OF]), added.TURN]
    return turn * work.frames[0, at.OMEGA] + row[added.SENSE] * dot(model.bodies.turn[o:], v, size)
