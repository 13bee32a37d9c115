"""Forces and tangents of a force law at the ports of its connection, by the shape of the connection.

In a stage u̇ changes by (c_v/c_q) times the change of u, and velocities in space along the frame's axes are
u̇ + Ω e_z×u. So a law's tangents by displacement and by velocity make one block.

A law with masses may have two *inner* ports, which act on no other connection: those of a guided piston. They follow
from the motion of pin and liner, so they are not part of the stage's Newton iteration. Ports that it only *follows*,
those of a liner, are loaded without tangents.
"""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.gas import gas_force
from cranktrain.film.laws import films as on
from cranktrain.film.laws.films import film_call

ROW = 4
"""Values in a row of a law's tangents, and of a connection's block."""
INNER_STEPS = 12
INNER_TOLERANCE = 1.0e-15
"""Most Newton steps of inner ports, and the change (m, rad) at which the iteration ends."""


@inlined_kernel
def hand_law(model, work, frame, pressures, k, ratio):
    """Add the forces of the law called last, that of connection k, to those at its ports; its tangents to its block."""
    row = model.connections[k]
    out = model.laws.out
    if model.laws.traits[k, on.MASS] > 0.0:
        hand_mass(model, work, frame, pressures, k)
    elif row[at.SHAPE] == at.OF_EYE:
        hand_eye(model, work, frame, k, ratio)
    else:
        hand_forces(row, frame, out, work.port[at.U], work.port[at.FORCES])
        if model.laws.numbers[on.FROZEN] == 0.0:
            if row[at.PAIRS] == 0:
                pairs_block(out, ratio, frame[at.WHIRL], work.blocks[k])
            else:
                law_block(out, row[at.COUPLED], row[at.PAIRS], ratio, frame[at.WHIRL], work.blocks[k])


@inlined_kernel
def hand_forces(row, frame, out, u, f):
    """Add forces ``out`` of a law to those at the ports f (m,) of its connection, and the moments of these forces.

    u (m,) are the displacements of the ports. Moments are about the crank's axis.
    """
    size = row[at.COUPLED]
    pairs = row[at.PAIRS]
    torque = 0.0
    if pairs == 0:
        torque = hand_pair(row[at.FIRST], frame[at.CRANK_X], frame[at.CRANK_Y], out, u, f, 0.0)
        if size > 2:
            torque = hand_pair(row[at.FIRST + 2], 0.0, 0.0, out[2:], u, f, torque)
    else:
        for r in range(size if pairs < 0 else pairs):
            f[row[at.FIRST + r]] += out[r]
        if pairs < 0:
            return
        for r in range(pairs, size, 2):
            torque = hand_pair(row[at.FIRST + r], 0.0, 0.0, out[r:], u, f, torque)
    if row[at.SPIN] >= 0:
        torque += out[on.FRICTION]
    f[row[at.TURNED]] += torque


@inlined_kernel
def hand_pair(port, x, y, out, u, f, torque):
    """Add a pair of forces to those at ``port`` and the next one. Return ``torque`` plus its moment about (x, y)."""
    f[port] += out[0]
    f[port + 1] += out[1]
    return torque + (u[port] - x) * out[1] - (u[port + 1] - y) * out[0]


@kernel
def hand_mass(model, work, frame, pressures, k):
    """Do what :func:`hand_law` does for a law with masses, and count the power of given pressures."""
    row = model.connections[k]
    out = model.laws.out
    f = work.port[at.FORCES]
    if row[at.PAIRS] < 0:
        f[row[at.FIRST]] += out[0]
    else:
        torque = hand_pair(
            row[at.FIRST], frame[at.CRANK_X], frame[at.CRANK_Y], out, work.port[at.U], f, out[on.FRICTION]
        )
        if row[at.TURNED] >= 0:
            f[row[at.TURNED]] += torque
    power = out[on.GAS_POWER]
    i = row[at.FOLLOWED]
    if i >= 0:
        for j in range(3):
            f[i + j] += out[on.FOLLOWED + j]
        c = row[at.OF_CYLINDER]
        gas = gas_force(model.cylinders[c], model.scalars, pressures[c])
        f[i + at.HEAD] += gas
        power += gas * work.port[at.UD, i + at.HEAD]
    if model.laws.numbers[on.FROZEN] == 0.0:
        block = work.blocks[k]
        for r in range(0, 2 * ROW, ROW):
            for s in range(2):
                block[r + s] = out[on.BY_PLACE + r + s]
    if frame[at.BURN] < 0.0:
        frame[at.GIVEN_POWER] += power


@kernel
def hand_eye(model, work, frame, k, ratio):
    """Do what :func:`hand_law` does for a film between a pin and the eye of its rod.

    Its friction torque on the rod is kept for the rod's own law.
    """
    row = model.connections[k]
    out = model.laws.out
    u = work.port[at.U]
    f = work.port[at.FORCES]
    spin = row[at.SPIN]
    place = model.laws.place[k]
    end = row[at.FIRST + 2]
    couple = out[on.FRICTION] + place[0] * out[1] - place[1] * out[0]
    work.gas[row[at.OF_CYLINDER], at.COUPLE] = -couple
    f[row[at.FIRST]] += out[0]
    f[row[at.FIRST] + 1] += out[1]
    # The moment of the force at the displaced pin.
    f[spin] += couple + (u[end] - frame[at.CRANK_X]) * out[1] - (u[end + 1] - frame[at.CRANK_Y]) * out[0]
    f[end] -= out[0]
    f[end + 1] -= out[1]
    block = work.blocks[k]
    pairs_block(out, ratio, frame[at.OMEGA], block)
    for r in range(2):
        for s in range(2):
            value = block[ROW * r + s]
            block[ROW * r + s + 2] = -value
            block[ROW * (r + 2) + s] = -value
            block[ROW * (r + 2) + s + 2] = value


@kernel
def inner_force(model, work, k, c_q, c_v):
    """Solve for the inner ports of connection k, M ü = f in a stage, by Newton's method. Return 0, or a failure status.

    Writes their motion and forces to ``work.port``, and leaves the law's result of the last evaluation.
    """
    laws = model.laws
    i = model.connections[k, at.INNER]
    place = laws.place[k]
    velocity = laws.velocity[k]
    out = laws.out
    u = work.port[at.U]
    u_q = work.port[at.U_Q]
    u_v = work.port[at.U_V]
    u_free = work.port[at.U_FREE]
    inverse = model.block.piston_inverse
    status = 0
    for _ in range(INNER_STEPS):
        laws.numbers[on.ACCELERATION + 2] = (u[i] - u_q[i]) / c_q
        for j in range(2):
            place[on.INNER + j] = u[i + j]
            velocity[on.INNER + j] = u_v[i + j] + c_v * ((u[i + j] - u_q[i + j]) / c_q)
        status = film_call(laws, on.FORCE, k, out, out)
        # r = u_free + c_q M⁻¹ f − u, and I − c_q M⁻¹ ∂f/∂u.
        across, moment = out[on.INNER], out[on.INNER + 1]
        xx, xt, tx, tt = (
            out[on.BY_INNER],
            out[on.BY_INNER + 1],
            out[on.BY_INNER + ROW],
            out[on.BY_INNER + ROW + 1],
        )
        r_x = u_free[i] + c_q * (inverse[0, 0] * across + inverse[0, 1] * moment) - u[i]
        r_t = u_free[i + 1] + c_q * (inverse[1, 0] * across + inverse[1, 1] * moment) - u[i + 1]
        a = 1.0 - c_q * (inverse[0, 0] * xx + inverse[0, 1] * tx)
        b = -c_q * (inverse[0, 0] * xt + inverse[0, 1] * tt)
        d = -c_q * (inverse[1, 0] * xx + inverse[1, 1] * tx)
        e = 1.0 - c_q * (inverse[1, 0] * xt + inverse[1, 1] * tt)
        determinant = a * e - b * d
        move_x = (e * r_x - b * r_t) / determinant
        move_t = (a * r_t - d * r_x) / determinant
        u[i] += move_x
        u[i + 1] += move_t
        if abs(move_x) + abs(move_t) < INNER_TOLERANCE:
            break
    work.port[at.FORCES, i] = out[on.INNER]
    work.port[at.FORCES, i + 1] = out[on.INNER + 1]
    return status


@inlined_kernel
def law_block(out, size, pairs, ratio, whirl, block):
    """Tangent of a law's ``size`` forces by the displacement of its ports into the 4 × 4 ``block``.

    ``pairs`` is the first component of those that rotate with the law's axes, at ``whirl`` (rad/s), or −1.
    """
    for r in range(size):
        for s in range(size):
            i = ROW * r + s
            block[i] = out[on.BY_PLACE + i] + ratio * out[on.BY_VELOCITY + i]
        if pairs >= 0:
            for s in range(pairs, size, 2):
                i = ROW * r + s
                block[i] += whirl * out[on.BY_VELOCITY + i + 1]
                block[i + 1] -= whirl * out[on.BY_VELOCITY + i]


@inlined_kernel
def pairs_block(out, ratio, whirl, block):
    """Tangent block of a law with pairs of components only; values of a missing second pair are zero."""
    for r in range(ROW):
        for s in range(0, ROW, 2):
            i = ROW * r + s
            x = out[on.BY_VELOCITY + i]
            y = out[on.BY_VELOCITY + i + 1]
            block[i] = out[on.BY_PLACE + i] + ratio * x + whirl * y
            block[i + 1] = out[on.BY_PLACE + i + 1] + ratio * y - whirl * x
