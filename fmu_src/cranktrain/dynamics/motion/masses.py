"""Connections whose laws have masses of their own, and films in the eyes of their rods, in a stage.

A law with masses is told accelerations and the rule of the stage, and its tangent by position is that of the stage. It
may have two *inner* ports, which act on no other connection: those of a guided piston. They follow from the motion of
pin and liner, so they are not part of the stage's Newton iteration. Ports that it only *follows*, those of a liner, are
loaded without tangents.
"""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.crank_pin import accelerate, in_space, tell_twist
from cranktrain.dynamics.motion.film_ports import (
    ROW,
    call_at_ports,
    hand_pair,
    pairs_block,
)
from cranktrain.dynamics.motion.gas import find_pressure, gas_force
from cranktrain.film.laws import films as on
from cranktrain.film.laws.films import film_call

INNER_STEPS = 12
INNER_TOLERANCE = 1.0e-15
"""Most Newton steps of inner ports, and the change (m, rad) at which the iteration ends."""


@kernel
def mass_force(model, work, frame, pressures, k, c_q, c_v):
    """Evaluate the law of connection k, which has masses, and write its forces to ports and its tangent to its block.

    Returns 0, or a failure status.
    """
    row = model.connections[k]
    out = model.laws.out
    f = work.port[at.FORCES]
    tell_mass(model, work, frame, k)
    find_pressure(model, work, frame, work.port[at.U], pressures, k, False)
    tell_gas(model, work, pressures, k)
    inner = row[at.INNER] >= 0
    status = inner_force(model, work, k, c_q, c_v) if inner else film_call(model.laws, on.FORCE, k, out, out)
    if row[at.PAIRS] < 0:
        f[row[at.FIRST]] += out[0]
    else:
        torque = hand_pair(
            row[at.FIRST], frame[at.CRANK_X], frame[at.CRANK_Y], out, work.port[at.U], f, out[on.FRICTION]
        )
        if row[at.TURNED] >= 0:
            f[row[at.TURNED]] += torque
    for j in range(3 if row[at.FOLLOWED] >= 0 else 0):
        f[row[at.FOLLOWED] + j] += out[on.FOLLOWED + j]
    if model.laws.numbers[on.FROZEN] == 0.0:
        block = work.blocks[k]
        for r in range(0, 2 * ROW, ROW):
            for s in range(2):
                block[r + s] = out[on.BY_PLACE + r + s]
    if frame[at.BURN] < 0.0:
        c = row[at.OF_CYLINDER]
        head = gas_force(model.cylinders[c], model.scalars, pressures[c]) * work.rises[c, 1]
        frame[at.GIVEN_POWER] += out[on.GAS_POWER] + head
    return status


@inlined_kernel
def tell_mass(model, work, frame, k):
    """Pass the motion of all its ports to the law of connection k, whose first end turns with the crank's frame."""
    row = model.connections[k]
    numbers = model.laws.numbers
    place = model.laws.place[k]
    velocity = model.laws.velocity[k]
    u = work.port[at.U]
    ud = work.port[at.UD]
    udd = work.port[at.UDD]
    numbers[on.WHIRL] = frame[at.OMEGA]
    numbers[on.WHIRL_CHANGE] = frame[at.OMEGA_DOT]
    numbers[on.GRAVITY] = model.scalars[at.GRAVITY]
    i = row[at.FIRST]
    if row[at.PAIRS] == 0:
        in_space(u[i], u[i + 1], ud[i], ud[i + 1], numbers[on.WHIRL], place, velocity)
        accelerate(ud[i], ud[i + 1], udd[i], udd[i + 1], place, numbers)
    i = row[at.SPIN]
    if i >= 0:
        tell_twist(u[i], ud[i], udd[i], numbers)
    else:
        tell_twist(0.0, 0.0, 0.0, numbers)
    i = row[at.INNER]
    if i >= 0:
        numbers[on.ACCELERATION + 2] = udd[i]
        for j in range(2):
            place[on.INNER + j] = u[i + j]
            velocity[on.INNER + j] = ud[i + j]
    i = row[at.FOLLOWED]
    if i >= 0:
        for j in range(3):
            numbers[on.WALL + j] = u[i + j]
            numbers[on.WALL + 3 + j] = ud[i + j]
        numbers[on.WALL + 6] = frame[at.BLOCK_X]
        numbers[on.WALL + 7] = frame[at.BLOCK_Y]


@inlined_kernel
def tell_gas(model, work, pressures, k):
    """Pass the gas pressure, and the friction of a big end's film on the rod, to the law of connection k."""
    numbers = model.laws.numbers
    c = model.connections[k, at.OF_CYLINDER]
    numbers[on.PRESSURE] = pressures[c] - model.scalars[at.CRANKCASE]
    numbers[on.SLOPE] = work.gas[c, at.SLOPE]
    numbers[on.COUPLE] = work.gas[c, at.COUPLE]


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


@kernel
def eye_force(model, work, frame, k, ratio):
    """Evaluate the film of connection k between a pin and the eye of its rod, into the forces at ports and its block.

    Its friction torque on the rod is kept for the rod's own law. Returns 0, or a failure status.
    """
    row = model.connections[k]
    out = model.laws.out
    u = work.port[at.U]
    f = work.port[at.FORCES]
    spin = row[at.SPIN]
    status = call_at_ports(model, work, frame, on.FORCE, k, out, out)
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
    return status
