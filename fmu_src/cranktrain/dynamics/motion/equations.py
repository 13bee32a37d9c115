"""Equations of crank and block: linear part at a fixed speed Ω₀, and force laws at the ports.

The linear part of a stage with q = Q + c_q a, v = V + c_v a is, for rotating and for stationary bodies,

    S_t = I/c_q + (c_v/c_q) (D + 2Ω₀G + Σ c_s d dᵀ) + diag(ω²) + Ω₀² (K_σ − C) + Σ k_s d dᵀ
    S_s = I/c_q + (c_v/c_q) (D + C_m) + diag(ω²) + K_m

and I/c_q of guided pistons. It includes springs and dampers of the drive line's shafts (k_s, c_s at their twists d) and
of the mounts (K_m, C_m). S⁻¹, S⁻¹Φᵀ and Φ S⁻¹ Φᵀ are made once for (h, Ω₀). Everything else is a force at a port.

Forces act at the displaced points. With φ the pin's own rotation, its position is R(φ) X + (u − φ e_z×X), exact for a
rigid crank at any wind-up. Every force f on a displaced point (pins, journals, and gravity on the displaced mass) adds
the moment (u × f)_z about the frame's axis. The moments of pins and journals nearly cancel. Together they keep the
balance of angular momentum and of energy, which linear shapes alone would violate. Forces and moments on the block are
opposite to those on journals and collar.

A flexible block carries the crank along on its mounts, by half a millimetre, where bending moves journals by
hundredths of one. Moments are then taken about axes that move with the bodies: each body's about the displacement of
its own axis, the crank's weighted so that it is that of its centre of mass
(:func:`~cranktrain.dynamics.motion.relative.move_axis`). The moment of all forces with this displacement equals that of
the body's mass times acceleration, which the equations of translation contain already. About an axis at rest, 100 kN
at half a millimetre would twist pins against journals by 50 N m, and do work.
"""

from __future__ import annotations

from cranktrain.core.kernel import call_kernel, inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import crank_modes, has_additions
from cranktrain.dynamics.motion.film_ports import (
    frame_numbers,
    hand_forces,
    hand_pair,
    law_block,
    line_up_laws,
    pairs_block,
    place_law,
    place_pair,
    tell_law,
)
from cranktrain.dynamics.motion.linear_algebra import dot, invert, products
from cranktrain.dynamics.motion.relative import move_axis, reactions, relative_motion
from cranktrain.dynamics.motion.rods import rod_forces
from cranktrain.dynamics.topology import slots as added
from cranktrain.film.laws.films import FORCE, FRICTION, RUBBING, SPEED, film_call
from cranktrain.loads.torsional_line import DAMPING, LEADING, STIFFNESS


@kernel
def factor_stage(model, work, level, c_q, c_v, omega, holding, block_holding):
    """Make S⁻¹, and responses and compliance of the ports for (c_q, c_v, Ω₀), in cache slot ``level``.

    Returns 0, or 1 if S is singular. ``holding`` (N m/rad) restrains the rotation of the flywheel, ``block_holding``
    ((rad/s)²) the rigid motion of the block.
    """
    t = model.ports.shape[1]
    ratio = c_v / c_q
    part = work.turning
    for i in range(t):
        for j in range(t):
            # Arrays are stored transposed: element (j, i) of the matrix is at [i, j].
            b = 2.0 * omega * model.gyroscopic[i, j]
            s = omega * omega * model.spin[i, j]
            for k in range(model.shafts.shape[0]):
                twist = model.shafts[k, i] * model.shafts[k, j]
                b += model.shaft_laws[k, DAMPING] * twist
                s += model.shaft_laws[k, STIFFNESS] * twist
            s += holding * model.ends[0, i] * model.ends[0, j]
            if i == j:
                b += model.damping[i]
                s += 1.0 / c_q + model.omega2[i]
            part.scratch[i, j] = s + ratio * b
    status = factor_part(part, level, model.ports, model.ports_transposed)
    part = work.block
    n = part.scratch.shape[0]
    for i in range(n):
        for j in range(n):
            b = model.block.damping[i, j]
            s = model.block.stiffness[i, j]
            if i == j:
                b += model.damping[t + i]
                s += 1.0 / c_q + model.omega2[t + i]
                if i < 6:
                    s += block_holding
            part.scratch[i, j] = s + ratio * b
    status += factor_part(part, level, model.block_ports, model.block_ports_transposed)
    if has_additions(model):
        status += call_kernel(model.links.hooks[added.AT_FACTOR], (model, work, level, c_q, c_v, omega, holding))
    work.counters[at.N_FACTORS] += 1.0
    return status


@kernel
def factor_part(part, level, shapes, transposed):
    """Invert the matrix in ``part.scratch``, make response and compliance of ports. Return 0, or 1 if it is singular.

    No pivoting is needed, because for steps much shorter than a turn 1/c_q outweighs centrifugal softening and
    gyroscopic terms.
    """
    n = part.scratch.shape[0]
    m = shapes.shape[0]
    # Inverting the transpose gives the transpose of the inverse.
    if invert(part.scratch, n, part.inverse[level]) != 0:
        return 1
    products(shapes, part.inverse[level], m, n, n, part.response[level])
    products(part.response[level], transposed, m, n, m, part.compliance[level])
    return 0


@inlined_kernel
def external_force(model, frame, displaced, out):
    """Write to ``out`` the modal force (n,) of frame motion, shaft, valve train, gravity and preload of the mounts."""
    t = model.ports.shape[1]
    omega = frame[at.OMEGA]
    g_x = -model.scalars[at.GRAVITY] * frame[at.SIN]
    g_y = -model.scalars[at.GRAVITY] * frame[at.COS]
    crank = crank_modes(model)
    x = dot(model.gravity[0], displaced, crank)
    y = dot(model.gravity[1], displaced, crank)
    if model.block_ports.shape[0] > 0:
        x -= dot(model.gravity[0], model.gravity[0], crank) * frame[at.CRANK_X]
        y -= dot(model.gravity[1], model.gravity[1], crank) * frame[at.CRANK_Y]
    for i in range(t):
        out[i] = (
            omega * omega * model.centrifugal_load[i]
            - frame[at.OMEGA_DOT] * model.euler_load[i]
            + g_x * model.gravity[0, i]
            + g_y * model.gravity[1, i]
        )
    for k in range(model.shafts.shape[0]):
        law = model.shaft_laws[k]
        lead = (
            model.scalars[at.DRIVEN]
            * law[LEADING]
            * (law[STIFFNESS] * frame[at.LEAD] + law[DAMPING] * frame[at.LEAD_RATE])
        )
        for i in range(t):
            out[i] -= lead * model.shafts[k, i]
    if model.scalars[at.DRIVEN] == 0.0:
        for i in range(t):
            out[i] -= frame[at.LOAD] * model.rotor[i]
    if frame[at.VALVE_TORQUE] != 0.0:
        for i in range(t):
            out[i] -= frame[at.VALVE_TORQUE] * model.ends[1, i]
    if frame[at.AXIAL_FORCE] != 0.0:
        for i in range(t):
            out[i] += frame[at.AXIAL_FORCE] * model.ends[at.FLYWHEEL_AXIAL, i]
    # Every rigid mode rotates the crank: lateral modes of an unbalanced crank rotate it a little as well.
    for i in range(6):
        out[i] += model.ends[1, i] * (x * g_y - y * g_x)
    n = t + model.block.preload.shape[0]
    for i in range(t, n):
        out[i] = model.block.preload[i - t] - model.scalars[at.GRAVITY] * model.gravity[1, i]
    if model.block_ports.shape[0] > 0:
        for i in range(t, t + 6):
            out[i] += (
                frame[at.BLOCK_RESTRAINT] * displaced[i]
                + frame[at.VALVE_TORQUE] * model.block.motion[at.ROTATION, i - t]
            )


@kernel
def port_forces(model, work, frame, pressures, c_q, c_v):
    """Forces at all ports and the tangent blocks ∂f/∂u of a stage at displacement u, velocity u̇, acceleration ü.

    These are the rows U, UD, UDD, FORCES of ``work.port``; U_Q, U_V and U_FREE hold Q, V and the displacement without
    forces of the ports where pistons are guided. Moments of displaced forces and film friction act at the rotations of
    journals and pins; the Newton matrix omits their tangents. ``pressures`` (c,) are set to those at the cylinders' own
    angles. Returns 0, or a status if a law failed.
    """
    ratio = c_v / c_q
    u = work.port[at.U]
    ud = work.port[at.UD]
    f = work.port[at.FORCES]
    relative_motion(
        model, frame[at.COS], frame[at.SIN], frame[at.WHIRL], u, ud, work.port[at.RELATIVE], work.port[at.RELATIVE_RATE]
    )
    move_axis(model, frame, u)
    frame_numbers(frame, model.laws.numbers)
    for k in range(f.shape[0]):
        f[k] = 0.0
    status = 0
    line_up_laws(model, work, frame)
    for k in range(model.connections.shape[0]):
        if model.connections[k, at.OF_ROD] > 0.0:
            continue
        if model.connections[k, at.PAIRS] == 0.0:
            status |= journal_force(model, work, frame, k, ratio)
        else:
            status |= law_force(model, work, frame, k, ratio)
    status |= rod_forces(model, work, frame, pressures, c_q, c_v)
    if model.block_ports.shape[0] > 0:
        reactions(model, frame[at.COS], frame[at.SIN], f)
        # The opposite moment acts on the block, about the block's own axis.
        x = frame[at.CRANK_X] - frame[at.COS] * frame[at.BLOCK_X] - frame[at.SIN] * frame[at.BLOCK_Y]
        y = frame[at.CRANK_Y] - frame[at.COS] * frame[at.BLOCK_Y] + frame[at.SIN] * frame[at.BLOCK_X]
        for k in range(model.connections.shape[0]):
            row = model.connections[k]
            if row[at.REACTS] >= 0.0:
                first = int(row[at.FIRST])
                f[int(row[at.REACTS])] = -f[int(row[at.TURNED])] - x * f[first + 1] + y * f[first]
    if has_additions(model):
        status |= call_kernel(model.links.hooks[added.AT_FORCES], (model, work, frame, pressures, ratio))
    return status


@kernel
def law_force(model, work, frame, k, ratio):
    """Forces and tangents of connection k at the relative motion of its ports. Return 0, or a failure status."""
    row = model.connections[k]
    laws = model.laws
    place_law(model, k, work.port[at.RELATIVE], work.port[at.RELATIVE_RATE], frame[at.WHIRL])
    tell_law(model, frame, k, work.port[at.U], work.port[at.UD])
    status = film_call(laws, FORCE, k, laws.out, laws.out)
    hand_forces(row, frame, laws.out, work.port[at.U], work.port[at.FORCES])
    law_block(laws.out, int(row[at.COUPLED]), int(row[at.PAIRS]), ratio, frame[at.WHIRL], work.blocks[k])
    return status


@inlined_kernel
def journal_force(model, work, frame, k, ratio):
    """Forces and tangents of connection k with only one or two pairs of components; a faster path for journals.

    By :func:`law_force` a cycle of the six-cylinder engine at ``impedance`` takes 2 % longer.
    """
    row = model.connections[k]
    laws = model.laws
    place = laws.place[k]
    velocity = laws.velocity[k]
    out = laws.out
    u = work.port[at.U]
    f = work.port[at.FORCES]
    d = work.port[at.RELATIVE]
    dd = work.port[at.RELATIVE_RATE]
    whirl = frame[at.WHIRL]
    spin = int(row[at.SPIN])
    first = int(row[at.FIRST])
    tilts = row[at.COUPLED] > 2.0
    second = int(row[at.FIRST + 2])
    place_pair(first, d, dd, whirl, place, velocity)
    if tilts:
        place_pair(second, d, dd, whirl, place[2:], velocity[2:])
    laws.numbers[SPEED] = frame[at.OMEGA] + work.port[at.UD, spin]
    laws.numbers[RUBBING] = laws.numbers[SPEED]
    status = film_call(laws, FORCE, k, out, out)
    pairs_block(out, ratio, whirl, work.blocks[k])
    torque = hand_pair(first, frame[at.CRANK_X], frame[at.CRANK_Y], out, u, f, 0.0)
    if tilts:
        torque = hand_pair(second, 0.0, 0.0, out[2:], u, f, torque)
    f[spin] = torque + out[FRICTION]
    return status
