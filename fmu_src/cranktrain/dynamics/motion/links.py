"""Connections whose components are sums of terms: their motion, and components as unknowns of a stage's iteration.

A component's motion is a sum over ports, with coefficients that depend on the crank angle
(:mod:`cranktrain.dynamics.topology.terms`). These components are unknowns of the iteration before those that are ports.
The compliance between two components is R H Rᵀ of the bodies that they hold. A row is the motion of the ports by a unit
force of one component, summed with the terms of the other.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import term_row, turning_ports
from cranktrain.dynamics.topology import slots as top
from cranktrain.dynamics.topology.frames import fill_coefficients, move_frames
from cranktrain.film.laws import films as on


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


@kernel
def load_ports(model, work, forces, f):
    """Add forces (C,) of all components to those at the ports, f (m,)."""
    links = model.links
    for j in range(forces.shape[0]):
        for t in range(links.starts[j], links.starts[j + 1]):
            f[links.taken[t, 0]] += work.links.coefficients[t, 0] * forces[j]


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
