"""Forces on crank and block, and force laws at the ports.

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

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import block_port_count, crank_modes, term_row, turning_modes
from cranktrain.dynamics.motion.law_forces import hand_law, inner_force
from cranktrain.dynamics.motion.law_motion import line_up_laws, tell_law
from cranktrain.dynamics.motion.linear_algebra import dot
from cranktrain.dynamics.motion.link_forces import link_forces
from cranktrain.dynamics.motion.relative import move_axis, reactions, relative_motion
from cranktrain.film.laws import films as on
from cranktrain.film.laws.films import film_call
from cranktrain.loads.torsional_line import DAMPING, LEADING, STIFFNESS


@inlined_kernel
def external_force(model, frame, displaced, out):
    """Write to ``out`` the modal force (n,) of frame motion, shaft, valve train, gravity and preload of the mounts."""
    t = turning_modes(model)
    omega = frame[at.OMEGA]
    g_x = -model.scalars[at.GRAVITY] * frame[at.SIN]
    g_y = -model.scalars[at.GRAVITY] * frame[at.COS]
    crank = crank_modes(model)
    x = dot(model.gravity[0], displaced, crank)
    y = dot(model.gravity[1], displaced, crank)
    if block_port_count(model) > 0:
        x -= dot(model.gravity[0], model.gravity[0], crank) * frame[at.CRANK_X]
        y -= dot(model.gravity[1], model.gravity[1], crank) * frame[at.CRANK_Y]
    for i in range(t):
        out[i] = (
            omega * omega * model.bodies.centrifugal_load[i]
            - frame[at.OMEGA_DOT] * model.bodies.euler_load[i]
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
    for i in range(min(6, t)):
        out[i] += model.ends[1, i] * (x * g_y - y * g_x)
    n = t + model.block.preload.shape[0]
    for i in range(t, n):
        out[i] = model.block.preload[i - t] - model.scalars[at.GRAVITY] * model.gravity[1, i]
    if block_port_count(model) > 0:
        for i in range(t, t + 6):
            out[i] += (
                frame[at.BLOCK_RESTRAINT] * displaced[i]
                + frame[at.VALVE_TORQUE] * model.block.motion[at.ROTATION, i - t]
            )


@kernel
def port_forces(model, work, frame, pressures, c_q, c_v):
    """Forces at all ports and the tangent blocks ∂f/∂u of a stage at displacement u, velocity u̇, acceleration ü.

    Calls the laws of all connections: bearings, rods with the gas on their pistons, others. Displacement, velocity,
    acceleration and forces are the rows U, UD, UDD, FORCES of ``work.port``, tangents are in ``work.blocks``.
    U_Q, U_V and U_FREE hold Q, V and the displacement without forces of the ports where pistons are guided. Moments of
    displaced forces and film friction act at the rotations of journals and pins; the Newton matrix omits their
    tangents. ``pressures`` (c,) are set to those at the cylinders' own angles. Returns 0, or a status if a law failed.
    """
    ratio = c_v / c_q
    u = work.port[at.U]
    ud = work.port[at.UD]
    f = work.port[at.FORCES]
    relative_motion(
        model, frame[at.COS], frame[at.SIN], frame[at.WHIRL], u, ud, work.port[at.RELATIVE], work.port[at.RELATIVE_RATE]
    )
    move_axis(model, frame, u)
    for k in range(f.shape[0]):
        f[k] = 0.0
    status = 0
    model.laws.numbers[on.RATIO] = ratio
    model.laws.numbers[on.INERTANCE] = 1.0 / c_q
    frame[at.GIVEN_POWER] = 0.0
    line_up_laws(model, work, frame, pressures)
    for k in range(term_row(model)):
        tell_law(model, work, frame, pressures, on.FORCE, k)
        if model.connections[k, at.INNER] >= 0:
            status |= inner_force(model, work, k, c_q, c_v)
        else:
            status |= film_call(model.laws, on.FORCE, k, model.laws.out, model.laws.out)
        hand_law(model, work, frame, pressures, k, ratio)
    if block_port_count(model) > 0:
        reactions(model, frame[at.COS], frame[at.SIN], f)
        # The opposite moment acts on the block, about the block's own axis.
        x = frame[at.CRANK_X] - frame[at.COS] * frame[at.BLOCK_X] - frame[at.SIN] * frame[at.BLOCK_Y]
        y = frame[at.CRANK_Y] - frame[at.COS] * frame[at.BLOCK_Y] + frame[at.SIN] * frame[at.BLOCK_X]
        for k in range(term_row(model)):
            row = model.connections[k]
            if row[at.REACTS] >= 0:
                first = row[at.FIRST]
                f[row[at.REACTS]] = -f[row[at.TURNED]] - x * f[first + 1] + y * f[first]
    if term_row(model) < model.connections.shape[0]:
        status |= link_forces(model, work, frame, pressures, ratio)
    return status
