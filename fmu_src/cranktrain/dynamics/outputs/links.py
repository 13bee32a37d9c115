"""Outputs of added bodies and connections."""

from cranktrain.core.kernel import inlined_kernel, kernel, law_kernel
from cranktrain.dynamics.model.slots import OMEGA
from cranktrain.dynamics.model.state import POSITION, VELOCITY, offset
from cranktrain.dynamics.motion.linear_algebra import dot
from cranktrain.dynamics.outputs.laws import observe_law
from cranktrain.dynamics.topology import slots as top
from cranktrain.film.laws.films import FRICTION


@law_kernel
def observe_links(model, work, state, members, out):
    """Fill the outputs of added bodies and connections."""
    for row in range(model.links.shown.shape[0]):
        shown = model.links.shown[row]
        if shown[top.SHOWN_KIND] >= top.BODY_SPEED:
            out[row] = body_value(model, work, state, shown)
        else:
            observe_law(model, work, state, int(shown[top.SHOWN_OF]))
            out[row] = link_value(model, work, shown)
    return 0


@inlined_kernel
def link_value(model, work, shown):
    """Value of one output of a connection, after a call of its force law."""
    k = int(shown[top.SHOWN_OF])
    place = int(shown[top.SHOWN_AT])
    kind = int(shown[top.SHOWN_KIND])
    if kind == top.PLACE_KIND:
        return model.laws.place[k, place]
    if kind == top.VELOCITY_KIND:
        return model.laws.velocity[k, place]
    if kind == top.OUT_KIND and place == FRICTION:
        return -work.found[k, place]
    return work.found[k, place]


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
    return turn * work.frames[0, OMEGA] + row[top.SENSE] * dot(model.bodies.turn[o:], v, size)
