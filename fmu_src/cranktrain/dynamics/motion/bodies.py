"""Linear part of a stage: each body in a frame that moves with the crank angle, all in one table.

S of a group of bodies in a stage with q = Q + c_q a, v = V + c_v a, for frames that turn at the speed Ω, is

    S = I/c_q + (c_v/c_q) (D + 2ΩG + C) + diag(ω²) + Ω² (K_σ − C_σ) + K

with stiffness K and damping C of what is linear in the frame: shafts of the drive line, mounts. Bodies joined by rigid
gears (relations) move in common modes, so their matrices add up. S⁻¹, S⁻¹Φᵀ and Φ S⁻¹ Φᵀ are made once for (h, Ω₀).
Motion of a frame apart from its mean turning is iterated with the stage. Ports and modes are slices of those of the
whole model.

The equations are those of the crank (:mod:`cranktrain.core.reduced_body`) with the frame's speed α′Ω, its change
α″Ω² + α′Ω̇ and the acceleration of its origin, o″Ω² + o′Ω̇.
"""

import math

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import block_modes, first_piston, port_count, turning_modes
from cranktrain.dynamics.motion.linear_algebra import add_product, dot, invert, product, products
from cranktrain.dynamics.motion.links import turn_frames
from cranktrain.dynamics.topology import slots as top
from cranktrain.loads.torsional_line import DAMPING, STIFFNESS

SOFT_HOLD = 1.0e4
"""Squared frequency, (rad/s)², of a spring that restrains the rotation of a body in the search for a start."""


@kernel
def factor_stage(model, work, level, c_q, c_v, omega, holding, block_holding):
    """Make S⁻¹, and responses and compliance of the ports for (c_q, c_v, Ω₀), in cache slot ``level``.

    Returns 0, or 1 if S is singular. ``holding`` (N m/rad) restrains the rotation of the flywheel, ``block_holding``
    ((rad/s)²) the rigid motion of the block. With ``holding`` a soft spring restrains the rotation of each other body,
    so that gears can still turn it into mesh. No pivoting is needed, because for steps much shorter than a turn 1/c_q
    outweighs centrifugal softening and gyroscopic terms.
    """
    bodies = model.bodies
    part = work.linear
    ratio = c_v / c_q
    status = 0
    # S of a group is collected where its inverse will be, because the block comes between the crank and bodies
    # that are joined to it.
    for b in range(bodies.rows.shape[0]):
        row = bodies.rows[b]
        n = row[top.MODES]
        first = row[top.MODE]
        o = row[top.OWN_MODE]
        g = row[top.GROUP]
        speed = bodies.constants[b, top.RATE] * omega
        held = SOFT_HOLD / bodies.constants[b, top.INERTIA] if holding > 0.0 and b >= top.OTHERS else 0.0
        collected = part.inverse[level][g : g + n]
        for i in range(n):
            for j in range(n):
                # Arrays are stored transposed: element (j, i) of the matrix is at [i, j].
                damping = 2.0 * speed * bodies.gyroscopic[o + i, j]
                stiffness = speed * speed * bodies.spin[o + i, j]
                if b == top.OF_CRANK:
                    for k in range(model.shafts.shape[0]):
                        twist = model.shafts[k, i] * model.shafts[k, j]
                        damping += model.shaft_laws[k, DAMPING] * twist
                        stiffness += model.shaft_laws[k, STIFFNESS] * twist
                    stiffness += holding * model.ends[0, i] * model.ends[0, j]
                elif b == top.OF_BLOCK:
                    damping += model.block.damping[i, j]
                    stiffness += model.block.stiffness[i, j]
                elif held > 0.0:
                    stiffness += held * bodies.euler_load[o + i] * bodies.euler_load[o + j]
                if i == j and o == g:
                    damping += model.damping[first + i]
                    stiffness += 1.0 / c_q + model.omega2[first + i]
                    if b == top.OF_BLOCK and i < 6:
                        stiffness += block_holding
                if o == g:
                    collected[i, j] = stiffness + ratio * damping
                else:
                    collected[i, j] += stiffness + ratio * damping
        if row[top.ENDS_GROUP] > 0:
            for i in range(n):
                for j in range(n):
                    part.scratch[i, j] = collected[i, j]
            # Inverting the transpose gives the transpose of the inverse.
            if invert(part.scratch, n, collected) != 0:
                status = 1
    for b in range(bodies.rows.shape[0]):
        row = bodies.rows[b]
        n = row[top.MODES]
        m = row[top.PORTS]
        o = row[top.OWN_MODE]
        g = row[top.GROUP]
        p = row[top.PORT]
        response = part.response[level][p : p + m]
        compliance = part.compliance[level][p : p + m]
        products(bodies.shapes[p : p + m], part.inverse[level][g : g + n], m, n, n, response)
        products(response, bodies.transposed[o : o + n], m, n, row[top.GROUP_PORTS], compliance)
    work.counters[at.N_FACTORS] += 1.0
    return status


@kernel
def load_others(model, work, frame, displaced, out):
    """Modal force of frame and gravity on bodies other than crank and block, and the motion of their mass centres.

    The latter is written to ``work.links.axes``.
    """
    bodies = model.bodies
    square = frame[at.OMEGA] * frame[at.OMEGA]
    for b in range(top.OTHERS, bodies.rows.shape[0]):
        row = bodies.rows[b]
        n = row[top.MODES]
        first = row[top.MODE]
        o = row[top.OWN_MODE]
        turn_frames(model, work, frame[at.THETA])
        moved = work.links.frames[row[top.FRAME_OF]]
        # Gravity minus the acceleration of the frame's origin, in the frame's axes.
        g_x = -model.scalars[at.GRAVITY] * math.sin(moved[top.TURNED])
        g_y = -row[top.SENSE] * model.scalars[at.GRAVITY] * math.cos(moved[top.TURNED])
        g_x -= square * moved[top.OWN_X2] + frame[at.OMEGA_DOT] * moved[top.OWN_X1]
        g_y -= square * moved[top.OWN_Y2] + frame[at.OMEGA_DOT] * moved[top.OWN_Y1]
        omega = row[top.SENSE] * moved[top.TURN] * frame[at.OMEGA]
        change = row[top.SENSE] * (moved[top.TURN2] * square + moved[top.TURN] * frame[at.OMEGA_DOT])
        for i in range(n):
            if o == row[top.GROUP]:
                out[first + i] = 0.0
            out[first + i] += (
                omega * omega * bodies.centrifugal_load[o + i]
                - change * bodies.euler_load[o + i]
                + g_x * bodies.translation[0, o + i]
                + g_y * bodies.translation[1, o + i]
            )
        for k in range(2):
            work.links.axes[b, k] = dot(bodies.centre[k, o:], displaced[first:], n)


@kernel
def move_freely(model, work, stage):
    """Modal motion without forces at the ports for the present a, into ``work.modal[Q_FREE]``, without pistons.

    The load includes the known part of the term 2Ω₀G, and the terms that S lacks because a frame turns at Ω ≠ Ω₀.
    """
    bodies = model.bodies
    frame = work.frames[stage.number]
    c_q = stage.c_q
    c_v = stage.c_v
    ratio = c_v / c_q
    for b in range(bodies.rows.shape[0]):
        row = bodies.rows[b]
        n = row[top.MODES]
        if n == 0:
            continue
        first = row[top.MODE]
        o = row[top.OWN_MODE]
        base = work.modal[at.BASE, first : first + n]
        rhs = work.modal[at.LOADS, first : first + n]
        if o == row[top.GROUP]:
            for i in range(n):
                rhs[i] = base[i]
        rate = bodies.constants[b, top.RATE]
        change = rate * frame[at.OMEGA_DOT]
        if row[top.SWINGS] > 0:
            turn_frames(model, work, frame[at.THETA])
            moved = work.links.frames[row[top.FRAME_OF]]
            rate = row[top.SENSE] * moved[top.TURN]
            change = row[top.SENSE] * moved[top.TURN2] * frame[at.WHIRL] * frame[at.WHIRL]
            change += rate * frame[at.OMEGA_DOT]
        if row[top.WHIRLS] > 0 and (rate != 0.0 or change != 0.0):
            omega = bodies.constants[b, top.RATE] * stage.omega
            d_omega = rate * frame[at.WHIRL] - omega
            d_omega2 = rate * rate * frame[at.WHIRL] * frame[at.WHIRL] - omega * omega
            # Loops count from 0, which compilers know to be inside the arrays.
            q = work.modal[at.BIG_Q, first : first + n]
            v = work.modal[at.BIG_V, first : first + n]
            a = work.stage[stage.number, 2, first : first + n]
            lever = work.modal[at.LEVER, first : first + n]
            for i in range(n):
                lever[i] = 2.0 * omega * (ratio * q[i] - v[i])
                lever[i] -= 2.0 * d_omega * (v[i] + c_v * a[i]) + change * (q[i] + c_q * a[i])
            add_product(bodies.gyroscopic[o : o + n], lever, n, n, rhs)
            if d_omega2 != 0.0:
                for i in range(n):
                    lever[i] = -d_omega2 * (q[i] + c_q * a[i])
                add_product(bodies.spin[o : o + n], lever, n, n, rhs)
        if row[top.ENDS_GROUP] > 0:
            g = row[top.GROUP]
            inverse = work.linear.inverse[stage.slot][g : g + n]
            product(inverse, rhs, n, n, work.modal[at.Q_FREE, first : first + n])


@kernel
def to_ports(model, q, u):
    """Motion u (m,) of all ports from the modal motion q (n,)."""
    bodies = model.bodies
    for b in range(bodies.rows.shape[0]):
        row = bodies.rows[b]
        o = row[top.OWN_MODE]
        if row[top.GROUP_PORTS] > 0 and o == row[top.GROUP]:
            n = row[top.MODES]
            ports = row[top.GROUP_PORTS]
            product(bodies.transposed[o : o + n], q[row[top.MODE] :], n, ports, u[row[top.GROUP_PORT] :])
    shape = model.block.piston_shape
    first = first_piston(model)
    own = turning_modes(model) + block_modes(model)
    for c in range(0, port_count(model) - first, 2):
        x = q[own + c]
        y = q[own + c + 1]
        u[first + c] = shape[0, 0] * x + shape[0, 1] * y
        u[first + c + 1] = shape[1, 0] * x + shape[1, 1] * y


@kernel
def add_response(model, table, first, f, out):
    """Add the response of all bodies but pistons to forces f (m,) at their ports to ``out``.

    With ``Linear.response`` of a step size as ``table`` and MODE as ``first`` it is modal motion (n,), with
    ``Linear.compliance`` and GROUP_PORT motion of the ports (m,); the column after ``first`` has the number of values.
    """
    bodies = model.bodies
    for b in range(bodies.rows.shape[0]):
        row = bodies.rows[b]
        m = row[top.PORTS]
        if m > 0:
            p = row[top.PORT]
            add_product(table[p : p + m], f[p:], m, row[first + 1], out[row[first] :])
