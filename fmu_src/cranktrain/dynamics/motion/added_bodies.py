"""Motion of added bodies in a stage. Each body has a linear part in a frame that moves with the crank angle.

Bodies joined by rigid gears (relations) move in common modes, so their matrices add up.

The equations are those of the crank (:mod:`cranktrain.core.reduced_body`) with the frame's speed α′Ω, its change
α″Ω² + α′Ω̇ and the acceleration of its origin, o″Ω² + o′Ω̇. Oscillation of the frame's speed about its mean is not part
of the factored matrix but iterated with the stage. Ports and modes are slices of those of the whole model.
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.added_connections import turn_frames
from cranktrain.dynamics.motion.linear_algebra import add_product, dot, invert, product, products
from cranktrain.dynamics.topology import slots as added

SOFT_HOLD = 1.0e4
"""Squared frequency, (rad/s)², of a spring that restrains the rotation of an added body in the search for a start."""


@kernel
def factor_added(model, work, level, c_q, c_v, omega, holding):
    """Make S⁻¹, responses and compliances of added bodies in cache slot ``level``. Return 0, or 1 if S is singular.

    With ``holding`` a soft spring restrains the rotation of each body, so that gears can still turn it into mesh.
    """
    bodies = model.bodies
    part = work.added
    ratio = c_v / c_q
    status = 0
    for b in range(bodies.rows.shape[0]):
        row = bodies.rows[b]
        n = int(row[added.MODES])
        first = int(row[added.MODE])
        o = int(row[added.OWN_MODE])
        g = int(row[added.GROUP])
        speed = row[added.RATE] * omega
        held = 0.0
        if holding > 0.0:
            held = SOFT_HOLD / row[added.INERTIA]
        for i in range(n):
            for j in range(n):
                if o == g:
                    part.scratch[i, j] = 0.0
                part.scratch[i, j] += (
                    ratio * 2.0 * speed * bodies.gyroscopic[o + i, j]
                    + speed * speed * bodies.spin[o + i, j]
                    + held * bodies.euler_load[o + i] * bodies.euler_load[o + j]
                )
            if o == g:
                part.scratch[i, i] += 1.0 / c_q + ratio * model.damping[first + i] + model.omega2[first + i]
        if row[added.ENDS_GROUP] > 0.0 and invert(part.scratch, n, part.inverse[level][g : g + n]) != 0:
            status = 1
    for b in range(bodies.rows.shape[0]):
        row = bodies.rows[b]
        n = int(row[added.MODES])
        m = int(row[added.PORTS])
        o = int(row[added.OWN_MODE])
        g = int(row[added.GROUP])
        p = int(row[added.OWN_PORT])
        response = part.response[level][p : p + m]
        compliance = part.compliance[level][p : p + m]
        products(bodies.shapes[p : p + m], part.inverse[level][g : g + n], m, n, n, response)
        products(response, bodies.transposed[o : o + n], m, n, int(row[added.GROUP_PORTS]), compliance)
    return status


@kernel
def load_added(model, work, frame, displaced, out):
    """Modal force of frame and gravity on added bodies; writes the motion of mass centres to ``work.added.axes``."""
    bodies = model.bodies
    turn_frames(model, work, frame[at.THETA])
    square = frame[at.OMEGA] * frame[at.OMEGA]
    for b in range(bodies.rows.shape[0]):
        row = bodies.rows[b]
        n = int(row[added.MODES])
        first = int(row[added.MODE])
        o = int(row[added.OWN_MODE])
        moved = work.added.frames[int(row[added.FRAME_OF])]
        # Gravity minus the acceleration of the frame's origin, in the frame's axes.
        g_x = -model.scalars[at.GRAVITY] * math.sin(moved[added.TURNED])
        g_y = -row[added.SENSE] * model.scalars[at.GRAVITY] * math.cos(moved[added.TURNED])
        g_x -= square * moved[added.OWN_X2] + frame[at.OMEGA_DOT] * moved[added.OWN_X1]
        g_y -= square * moved[added.OWN_Y2] + frame[at.OMEGA_DOT] * moved[added.OWN_Y1]
        omega = row[added.SENSE] * moved[added.TURN] * frame[at.OMEGA]
        change = row[added.SENSE] * (moved[added.TURN2] * square + moved[added.TURN] * frame[at.OMEGA_DOT])
        for i in range(n):
            if o == int(row[added.GROUP]):
                out[first + i] = 0.0
            out[first + i] += (
                omega * omega * bodies.centrifugal_load[o + i]
                - change * bodies.euler_load[o + i]
                + g_x * bodies.translation[0, o + i]
                + g_y * bodies.translation[1, o + i]
            )
        for k in range(2):
            work.added.axes[b, k] = dot(bodies.centre[k, o:], displaced[first:], n)


@kernel
def move_added_freely(model, work, frame, number, slot, c_q, c_v, stage_omega):
    """Modal motion of added bodies in a stage without forces at their ports, into ``work.modal[Q_FREE]``."""
    bodies = model.bodies
    ratio = c_v / c_q
    big_q = work.modal[at.BIG_Q]
    big_v = work.modal[at.BIG_V]
    rhs = work.modal[at.LOADS]
    lever = work.modal[at.LEVER]
    a = work.stage[number, 2]
    turn_frames(model, work, frame[at.THETA])
    for b in range(bodies.rows.shape[0]):
        row = bodies.rows[b]
        n = int(row[added.MODES])
        first = int(row[added.MODE])
        o = int(row[added.OWN_MODE])
        moved = work.added.frames[int(row[added.FRAME_OF])]
        rate = row[added.SENSE] * moved[added.TURN]
        change = row[added.SENSE] * moved[added.TURN2] * frame[at.WHIRL] * frame[at.WHIRL] + rate * frame[at.OMEGA_DOT]
        omega = row[added.RATE] * stage_omega
        d_omega = rate * frame[at.WHIRL] - omega
        d_omega2 = rate * rate * frame[at.WHIRL] * frame[at.WHIRL] - omega * omega
        for i in range(first, first + n):
            if o == int(row[added.GROUP]):
                rhs[i] = work.modal[at.BASE, i]
            lever[i] = 2.0 * omega * (ratio * big_q[i] - big_v[i])
            lever[i] -= 2.0 * d_omega * (big_v[i] + c_v * a[i])
            lever[i] -= change * (big_q[i] + c_q * a[i])
        if rate != 0.0 or change != 0.0:
            add_product(bodies.gyroscopic[o : o + n], lever[first:], n, n, rhs[first:])
            for i in range(first, first + n):
                lever[i] = -d_omega2 * (big_q[i] + c_q * a[i])
            add_product(bodies.spin[o : o + n], lever[first:], n, n, rhs[first:])
        if row[added.ENDS_GROUP] > 0.0:
            g = int(row[added.GROUP])
            product(work.added.inverse[slot][g : g + n], rhs[first:], n, n, work.modal[at.Q_FREE, first:])


@kernel
def recover_added(model, work, slot, f, q):
    """Add the response of added bodies to forces f (m,) at their ports to the modal motion q (n,)."""
    bodies = model.bodies
    for b in range(bodies.rows.shape[0]):
        row = bodies.rows[b]
        p = int(row[added.OWN_PORT])
        m = int(row[added.PORTS])
        response = work.added.response[slot][p : p + m]
        add_product(response, f[int(row[added.PORT]) :], m, int(row[added.MODES]), q[int(row[added.MODE]) :])


@inlined_kernel
def added_to_ports(model, q, u):
    """Motion u (m,) of the ports of added bodies from the modal motion q (n,)."""
    bodies = model.bodies
    for b in range(bodies.rows.shape[0]):
        row = bodies.rows[b]
        o = int(row[added.OWN_MODE])
        n = int(row[added.MODES])
        if row[added.ENDS_GROUP] > 0.0:
            ports = int(row[added.GROUP_PORTS])
            product(bodies.transposed[o : o + n], q[int(row[added.MODE]) :], n, ports, u[int(row[added.GROUP_PORT]) :])


@inlined_kernel
def added_answer(model, work, slot, f, u):
    """Add the displacements of added bodies by forces f (m,) at their ports to u (m,)."""
    bodies = model.bodies
    for b in range(bodies.rows.shape[0]):
        row = bodies.rows[b]
        p = int(row[added.OWN_PORT])
        m = int(row[added.PORTS])
        compliance = work.added.compliance[slot][p : p + m]
        add_product(
            compliance, f[int(row[added.PORT]) :], m, int(row[added.GROUP_PORTS]), u[int(row[added.GROUP_PORT]) :]
        )
