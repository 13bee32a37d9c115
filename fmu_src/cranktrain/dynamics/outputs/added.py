"""What a topology shows of its bodies and connections, and their part in the energy balance."""

from __future__ import annotations

from cranktrain.core.kernel import inlined_kernel, kernel, law_kernel
from cranktrain.dynamics.model.slots import (
    ADDED_LOSS,
    LINKS_LOSS,
    OMEGA,
    STATE_U,
    STATE_UD,
    STORED,
    THETA,
    UD,
    WHIRL,
)
from cranktrain.dynamics.model.state import POSITION, VELOCITY, offset
from cranktrain.dynamics.motion.added_connections import link_law, measure_links, turn_terms
from cranktrain.dynamics.motion.linear_algebra import dot
from cranktrain.dynamics.topology import slots as at
from cranktrain.film.laws.films import FRICTION, OBSERVE, RUBBING, SPEED


@law_kernel
def observe_added(model, work, state, members, out):
    """Speeds and places of added bodies, forces and motion of added connections; adds their energy and losses."""
    shown = model.links.shown
    row = 0
    while row < shown.shape[0] and shown[row, at.SHOWN_KIND] >= at.BODY_SPEED:
        out[row] = body_value(model, work, state, shown[row])
        row += 1
    observe_bodies(model, work, state)
    work.powers[LINKS_LOSS] = 0.0
    frame = work.frames[0]
    turn_terms(model, work, frame[THETA], frame[WHIRL])
    measure_links(model, work, work.port[STATE_U], work.port[STATE_UD])
    for k in range(work.port.shape[1]):
        work.port[UD, k] = work.port[STATE_UD, k]
    for k in range(model.links.rows.shape[0]):
        link_law(model, work, frame, k, OBSERVE, model.links.out)
        work.powers[LINKS_LOSS] += link_loss(model, frame, k)
        while row < shown.shape[0] and int(shown[row, at.SHOWN_OF]) == k:
            out[row] = link_value(model, k, shown[row])
            row += 1
    return 0


@inlined_kernel
def link_value(model, k, shown):
    """One value of connection k as its law has just left it."""
    place = int(shown[at.SHOWN_AT])
    kind = int(shown[at.SHOWN_KIND])
    if kind == at.PLACE_KIND:
        return model.links.place[k, place]
    if kind == at.VELOCITY_KIND:
        return model.links.velocity[k, place]
    if kind == at.OUT_KIND and place == FRICTION:
        return -model.links.out[place]
    return model.links.out[place]


@inlined_kernel
def link_loss(model, frame, k):
    """Power (W) that connection k takes from the bodies, what its springs store included."""
    links = model.links
    row = links.rows[k]
    lost = 0.0
    for r in range(int(row[at.SIZE])):
        lost -= links.out[r] * links.velocity[k, r]
    if row[at.RUBS] > 0.0:
        # Speeds of both ends about z: their sum and difference were the law's numbers.
        speed = links.numbers[RUBBING]
        across = links.place[k, 0] * links.out[1] - links.place[k, 1] * links.out[0]
        other = 0.5 * (links.numbers[SPEED] - speed)
        lost += across * other - links.out[FRICTION] * speed
    return lost


@kernel
def observe_bodies(model, work, state):
    """Energy of added bodies, against their frames that turn, and what their own damping takes."""
    n = model.omega2.shape[0]
    work.powers[ADDED_LOSS] = 0.0
    for b in range(model.bodies.rows.shape[0]):
        row = model.bodies.rows[b]
        size = int(row[at.MODES])
        o = int(row[at.OWN_MODE])
        first = int(row[at.MODE])
        q = state[offset(POSITION, n) + first :]
        v = state[offset(VELOCITY, n) + first :]
        omega = row[at.RATE] * work.frames[0, OMEGA]
        for i in range(size):
            carried = model.bodies.euler_load[o + i] * v[i] + omega * model.bodies.centrifugal_load[o + i] * q[i]
            for j in range(size):
                turned = v[j] * model.bodies.gyroscopic[o + i, j] - 0.5 * omega * q[j] * model.bodies.spin[o + i, j]
                carried += turned * q[i]
            work.powers[STORED] += omega * carried
            if row[at.ENDS_GROUP] > 0.0:
                work.powers[ADDED_LOSS] += model.damping[first + i] * v[i] * v[i]


@kernel
def body_value(model, work, state, shown):
    """Speed (rad/s), rotation against its frame (rad), or displacement of the centre of mass (m) of an added body."""
    row = model.bodies.rows[int(shown[at.SHOWN_OF])]
    n = model.omega2.shape[0]
    size = int(row[at.MODES])
    o = int(row[at.OWN_MODE])
    q = state[offset(POSITION, n) + int(row[at.MODE]) :]
    if shown[at.SHOWN_KIND] == at.BODY_PLACE:
        return dot(model.bodies.centre[int(shown[at.SHOWN_AT]), o:], q, size)
    if shown[at.SHOWN_KIND] == at.BODY_TURN:
        return row[at.SENSE] * dot(model.bodies.turn[o:], q, size)
    v = state[offset(VELOCITY, n) + int(row[at.MODE]) :]
    return row[at.SENSE] * (row[at.RATE] * work.frames[0, OMEGA] + dot(model.bodies.turn[o:], v, size))
