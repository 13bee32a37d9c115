"""What acts on crank and block: the frozen linear part and the force laws at the ports.

The linear part of a stage with q = Q + c_q a, v = V + c_v a is, for what turns and for what stands,

    S_t = I/c_q + (c_v/c_q) (D + 2Ω₀G + Σ c_s d dᵀ) + diag(ω²) + Ω₀² (K_σ − C) + Σ k_s d dᵀ
    S_s = I/c_q + (c_v/c_q) (D + C_m) + diag(ω²) + K_m

and I/c_q of guided pistons, with springs and dampers of the drive line's shafts (k_s, c_s at their twists d) and the
mounts' (K_m, C_m) folded in. S⁻¹, S⁻¹Φᵀ and Φ S⁻¹ Φᵀ are made once for (h, Ω₀). Everything else is a force at a port.

Forces act where their points are, not where they were: with φ the pin's own rotation its position is
R(φ) X + (u − φ e_z×X), exact for a rigid crank at any wind-up, and every force f on a displaced point (pins, journals,
and gravity on the displaced mass) adds the moment (u × f)_z about the frame's axis. Pins and journals nearly cancel;
together they keep the balance of angular momentum and of energy that linear shapes alone would miss. The block feels
the opposite of what journals and collar feel, moments included.

A flexible block carries the crank along on its mounts, by half a millimetre where bending moves journals by
hundredths of one. Moments are then taken about axes that move with the bodies: each body's about the displacement of
its own axis, the crank's weighted as to be that of its centre of mass
(:func:`~cranktrain.dynamics.motion.relative.move_axis`). What a force turns by that displacement is the body's own
mass times acceleration turned by it, which equations of translation hold already. About an axis at rest 100 kN half a
millimetre beside it would twist pins against journals by 50 N m, and do work.
"""

from __future__ import annotations

from cranktrain.core.kernel import call_kernel, inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.film_ports import film_block, journal_forces, place_joint, place_journal
from cranktrain.dynamics.motion.gas import gas_force
from cranktrain.dynamics.motion.linear_algebra import dot, invert, products
from cranktrain.dynamics.motion.relative import move_axis, reactions, relative_motion
from cranktrain.dynamics.motion.rods import rod_forces
from cranktrain.dynamics.topology import slots as added
from cranktrain.film.laws.films import ANGLE as FRAME_ANGLE
from cranktrain.film.laws.films import BY_PLACE, BY_VELOCITY, FORCE, RUBBING, SPEED, film_call
from cranktrain.film.laws.films import COS as FRAME_COS
from cranktrain.film.laws.films import SIN as FRAME_SIN
from cranktrain.loads.damper import damper_torque
from cranktrain.loads.torsional_line import DAMPING, LEADING, STIFFNESS


@kernel
def factor_stage(model, work, level, c_q, c_v, omega, holding, block_holding):
    """Make S⁻¹, the ports' responses and their compliance for (c_q, c_v, Ω₀), kept as ``level``.

    Returns 0, or 1 if S is singular. ``holding`` (N m/rad) holds the flywheel against turning, ``block_holding``
    ((rad/s)²) the block as a whole where it is.
    """
    t = int(model.layout[at.TURNING_MODES])
    ratio = c_v / c_q
    part = work.turning
    for i in range(t):
        for j in range(t):
            # Arrays are kept transposed: element (j, i) of the matrix stands at [i, j].
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
    if model.layout[at.ADDED] > 0.0:
        status += call_kernel(model.links.hooks[added.AT_FACTOR], (model, work, level, c_q, c_v, omega, holding))
    work.counters[at.N_FACTORS] += 1.0
    return status


@kernel
def factor_part(part, level, shapes, transposed):
    """Invert the matrix in ``part.scratch`` and find what its ports answer; 0, or 1 if it is singular.

    1/c_q outweighs what turning softens and gyroscopes couple at steps that are short beside a turn: no pivots needed.
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
def external_force(model, frame, pressures, displaced, out):
    """Modal force (n,) of frame, shaft, valve train, gravity on the displaced mass, gas on heads, mounts' preload."""
    t = int(model.layout[at.TURNING_MODES])
    omega = frame[at.OMEGA]
    g_x = -model.scalars[at.GRAVITY] * frame[at.SIN]
    g_y = -model.scalars[at.GRAVITY] * frame[at.COS]
    crank = int(model.layout[at.CRANK_MODES])
    x = dot(model.gravity[0], displaced, crank)
    y = dot(model.gravity[1], displaced, crank)
    if model.layout[at.BORE_ROTATIONS] > 0.0:
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
    # By each rigid mode's own rotation: those of an unbalanced crank that move it across turn it a little as well.
    for i in range(6):
        out[i] += model.ends[1, i] * (x * g_y - y * g_x)
    n = t + model.block.preload.shape[0]
    for i in range(t, n):
        out[i] = model.block.preload[i - t] - model.scalars[at.GRAVITY] * model.gravity[1, i]
    if model.layout[at.BORE_ROTATIONS] > 0.0:
        for i in range(t, t + 6):
            out[i] += (
                frame[at.BLOCK_RESTRAINT] * displaced[i]
                + frame[at.VALVE_TORQUE] * model.block.motion[at.ROTATION, i - t]
            )
        for c in range(model.cylinders.shape[0]):
            gas = gas_force(model.cylinders[c], model.scalars, pressures[c])
            for i in range(t, n):
                out[i] += gas * model.block.heads[c, i - t]


@kernel
def port_forces(model, work, frame, pressures, c_q, c_v):
    """Forces at all ports and the tangent blocks ∂f/∂u of a stage at displacement u, velocity u̇, acceleration ü.

    These are the rows U, UD, UDD, FORCES of ``work.port``; U_Q, U_V and U_FREE hold Q, V and the displacement without
    forces of the ports where pistons are guided. Moments of displaced forces and film friction act at the rotations of
    journals and pins; the Newton matrix omits their tangents. Returns 0, or a status if a law failed.
    """
    b = model.bearings.shape[0]
    journal = int(model.layout[at.JOURNAL_ROTATIONS])
    omega = frame[at.OMEGA]
    ratio = c_v / c_q
    u = work.port[at.U]
    ud = work.port[at.UD]
    f = work.port[at.FORCES]
    d = work.port[at.RELATIVE]
    dd = work.port[at.RELATIVE_RATE]
    relative_motion(model, frame[at.COS], frame[at.SIN], frame[at.WHIRL], u, ud, d, dd)
    move_axis(model, frame, u)
    films = model.films
    frame_numbers(frame, films.numbers)
    for k in range(2 * b + 1, f.shape[0]):
        f[k] = 0.0
    status = 0
    for i in range(b):
        connection = model.connections[i]
        place_journal(connection, d, dd, frame[at.WHIRL], films.place[i], films.velocity[i])
        films.numbers[SPEED] = omega + ud[journal + i]
        films.numbers[RUBBING] = films.numbers[SPEED]
        status |= film_call(films, FORCE, i, films.out, films.out)
        film_block(films.out, ratio, frame[at.WHIRL], work.blocks[i])
        f[journal + i] = journal_forces(connection, frame, films.out, u, f)
    k = int(model.layout[at.THRUST_LAW])
    status |= collar_force(model.thrust, model.connections[k], frame, d, dd, ratio, f, work.blocks[k])
    collar_torque(model.connections[k], u, f)
    if model.layout[at.AXIAL_JOINT] > 0.0:
        status |= axial_joint_force(model, work, frame, u, ud, ratio)
    if model.layout[at.DAMPER] > 0.0:
        k = int(model.layout[at.DAMPER])
        damper_torque(model.damper, u[k], ud[k], work.scratch)
        f[k] = work.scratch[0]
        work.blocks[model.connections.shape[0] - 1, 0] = work.scratch[1] + ratio * work.scratch[2]
    status |= rod_forces(model, work, frame, pressures, c_q, c_v)
    if model.layout[at.BORE_ROTATIONS] > 0.0:
        reactions(model, frame[at.COS], frame[at.SIN], f)
        # The block feels the opposite about its own axis.
        x = frame[at.CRANK_X] - frame[at.COS] * frame[at.BLOCK_X] - frame[at.SIN] * frame[at.BLOCK_Y]
        y = frame[at.CRANK_Y] - frame[at.COS] * frame[at.BLOCK_Y] + frame[at.SIN] * frame[at.BLOCK_X]
        for i in range(b):
            f[int(model.layout[at.BORE_ROTATIONS]) + i] = -f[journal + i] - x * f[2 * i + 1] + y * f[2 * i]
    if model.layout[at.ADDED] > 0.0:
        status |= call_kernel(model.links.hooks[added.AT_FORCES], (model, work, frame, pressures, ratio))
    return status


@inlined_kernel
def axial_joint_force(model, work, frame, u, ud, ratio):
    """Force of the joint between flywheel and connecting shaft at its port, with its tangent; 0."""
    k = int(model.layout[at.AXIAL_JOINT])
    joint = model.axial_joint
    place_joint(model, frame, u, ud)
    status = film_call(joint, FORCE, 0, joint.out, joint.out)
    work.port[at.FORCES, int(model.connections[k, at.FIRST])] = joint.out[0]
    work.blocks[k, 0] = ratio * joint.out[BY_VELOCITY]
    return status


@inlined_kernel
def frame_numbers(frame, numbers):
    """Tell films the frame's angle."""
    numbers[FRAME_COS] = frame[at.COS]
    numbers[FRAME_SIN] = frame[at.SIN]
    numbers[FRAME_ANGLE] = frame[at.THETA]


@inlined_kernel
def place_collar(thrust, connection, frame, u, ud):
    """Place and velocity of the thrust collar in space, along the frame's axes."""
    z = int(connection[at.FIRST])
    place = thrust.place[0]
    velocity = thrust.velocity[0]
    place[0] = u[z]
    velocity[0] = ud[z]
    if connection[at.COUPLED] > 1.0:
        t = int(connection[at.FIRST + 1])
        place[1] = u[t]
        place[2] = u[t + 1]
        velocity[1] = ud[t] - frame[at.WHIRL] * u[t + 1]
        velocity[2] = ud[t + 1] + frame[at.WHIRL] * u[t]
    thrust.numbers[SPEED] = frame[at.OMEGA]
    frame_numbers(frame, thrust.numbers)


@inlined_kernel
def collar_force(thrust, connection, frame, u, ud, ratio, f, block):
    """Thrust bearing: axial force, and where the collar's tilt has ports its two moments as well; 0, or a failure."""
    place_collar(thrust, connection, frame, u, ud)
    out = thrust.out
    whirl = frame[at.WHIRL]
    status = film_call(thrust, FORCE, 0, out, out)
    f[int(connection[at.FIRST])] = out[0]
    if connection[at.COUPLED] == 1.0:
        block[0] = out[BY_PLACE] + ratio * out[BY_VELOCITY]
        return status
    t = int(connection[at.FIRST + 1])
    f[t] = out[1]
    f[t + 1] = out[2]
    for r in range(3):
        place = BY_PLACE + 4 * r
        rate = BY_VELOCITY + 4 * r
        block[4 * r] = out[place] + ratio * out[rate]
        block[4 * r + 1] = out[place + 1] + ratio * out[rate + 1] + whirl * out[rate + 2]
        block[4 * r + 2] = out[place + 2] + ratio * out[rate + 2] - whirl * out[rate + 1]
    return status


@inlined_kernel
def collar_torque(connection, u, f):
    """Moments of a tilted collar act on it where it is: their part about the frame's axis, at the journal beside it."""
    if connection[at.COUPLED] > 1.0:
        t = int(connection[at.FIRST + 1])
        f[int(connection[at.TURNED])] += u[t] * f[t + 1] - u[t + 1] * f[t]
