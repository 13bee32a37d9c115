"""Powers of the gas, of loads and of all losses, and the stored energy, by accounts: slots of ``Work.powers``.

A connection between bodies takes from them −f·v of its force f on the first end, which moves at v relative to the
second end, and the friction torque times the rotation of the first end relative to the second. Power stored in springs
of connections is included. The first end is displaced from the centre of the second end, so its force also has a moment
on the second end, which does work if that rotates.
"""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import block_port_count, term_row, turning_modes
from cranktrain.dynamics.model.state import POSITION, VELOCITY, offset
from cranktrain.dynamics.motion.gas import gas_force
from cranktrain.dynamics.motion.linear_algebra import dot
from cranktrain.dynamics.motion.link_forces import lean, rub, second_lever
from cranktrain.dynamics.motion.links import load_ports, wandering
from cranktrain.dynamics.outputs.laws import observe_law
from cranktrain.dynamics.topology import slots as top
from cranktrain.dynamics.topology.slider_crank import FRICTION_ALONG, LINER_LOSS, SKIRT_LOSS, SPEED
from cranktrain.film.laws import films as on
from cranktrain.loads.torsional_line import DAMPING, LEADING, STIFFNESS


@kernel
def account_powers(model, work, state):
    """Fill ``work.powers`` at the state, and ``work.links.answered`` with all ports' forces by connections by terms."""
    n = model.omega2.shape[0]
    for k in range(at.POWERS):
        work.powers[k] = 0.0
    q = state[offset(POSITION, n) : offset(POSITION, n) + n]
    v = state[offset(VELOCITY, n) : offset(VELOCITY, n) + n]
    account_loads(model, work, q, v)
    account_bodies(model, work, q, v)
    forces = work.links.answered
    for k in range(forces.shape[0]):
        forces[k] = 0.0
    for k in range(model.connections.shape[0]):
        observe_law(model, work, state, k)
        if model.laws.traits[k, on.MASS] > 0.0:
            account_mass(model, work, k)
        else:
            account_connection(model, work, k)
        row = model.connections[k]
        if row[at.SHAPE] == at.OF_TERMS:
            for r in range(row[at.COUPLED]):
                work.links.gaps[top.F, row[at.GAP] + r] = work.found[k, r]
            if row[at.RUBS] > 0:
                lever = model.links.levers[k - term_row(model)]
                rub(row, lever, work.found[k], work.links.gaps[top.D], work.port[at.U], forces)
    load_ports(model, work, work.links.gaps[top.F], forces)
    for k in range(model.links.leans.shape[0]):
        power = lean(model, work, work.frames[0], k, work.port[at.U], forces)
        take(model, work, int(model.links.leans[k, top.LEANING]), at.ACCOUNT, -power)


@inlined_kernel
def take(model, work, k, column, lost):
    """Add power that connection k takes from the bodies to its account; the gas gives power."""
    account = model.connections[k, column]
    work.powers[account] += -lost if account == at.GAS_WORK else lost


@kernel
def account_loads(model, work, q, v):
    """Powers of dynamometer, drive line, valve train, axial force and mounts, and the energy in shafts and mounts."""
    t = turning_modes(model)
    powers = work.powers
    frame = work.frames[0]
    block = model.block
    standing = block.preload.shape[0]
    # The dynamometer turns at the given speed; the frame's speed differs from it by the rate of the frame's lead.
    given = frame[at.OMEGA] - frame[at.LEAD_RATE]
    for k in range(model.shafts.shape[0]):
        law = model.shaft_laws[k]
        leading = model.scalars[at.DRIVEN] * law[LEADING]
        twist = leading * frame[at.LEAD] + dot(model.shafts[k], q, t)
        rate = leading * frame[at.LEAD_RATE] + dot(model.shafts[k], v, t)
        powers[at.SHAFTS_LOSS] += law[DAMPING] * rate * rate
        powers[at.STORED] += 0.5 * law[STIFFNESS] * twist * twist
        powers[at.DYNAMOMETER_POWER] += leading * (law[STIFFNESS] * twist + law[DAMPING] * rate) * given
    powers[at.AXIAL_FORCE_WORK] = -frame[at.AXIAL_FORCE] * dot(model.ends[at.FLYWHEEL_AXIAL], v, t)
    speed = frame[at.OMEGA] + dot(model.ends[at.PULLEY_ROTATION], v, t)
    if block_port_count(model) > 0:
        speed -= dot(block.motion[at.ROTATION], v[t:], standing)
    powers[at.VALVE_POWER] = frame[at.VALVE_TORQUE] * speed
    for j in range(block.mounts.shape[0]):
        rate = dot(block.mounts[j], v[t:], standing)
        powers[at.MOUNTS_LOSS] += block.mount_laws[j, at.MOUNT_DAMPING] * rate * rate
    for i in range(block.stiffness.shape[0]):
        weight = block.preload[i] - model.scalars[at.GRAVITY] * model.gravity[1, t + i]
        powers[at.STORED] -= weight * q[t + i]
        powers[at.STORED] += 0.5 * q[t + i] * dot(block.stiffness[i], q[t:], block.stiffness.shape[0])


@kernel
def account_bodies(model, work, q, v):
    """Energy of all bodies relative to uniformly rotating frames, and the power of their own damping."""
    bodies = model.bodies
    powers = work.powers
    omega_crank = work.frames[0, at.OMEGA]
    for i in range(q.shape[0]):
        powers[at.STORED] += 0.5 * (v[i] * v[i] + model.omega2[i] * q[i] * q[i])
    for b in range(bodies.rows.shape[0]):
        row = bodies.rows[b]
        n = row[top.MODES]
        o = row[top.OWN_MODE]
        own_q = q[row[top.MODE] :]
        own_v = v[row[top.MODE] :]
        moved = work.links.frames[row[top.FRAME_OF]]
        omega = row[top.SENSE] * moved[top.TURN] * omega_crank
        swept_x = omega_crank * moved[top.OWN_X1]
        swept_y = omega_crank * moved[top.OWN_Y1]
        if model.links.frames[row[top.FRAME_OF], top.FRAME_KIND] != top.TURNING:
            # Energy of the motion of uniformly rotating frames is constant, so it is left out.
            constants = bodies.constants[b]
            own = constants[top.MASS] * (swept_x * swept_x + swept_y * swept_y) + constants[top.INERTIA] * omega * omega
            across = swept_y * constants[top.UNBALANCE_X] - swept_x * constants[top.UNBALANCE_Y]
            powers[at.STORED] += 0.5 * own + omega * across
        x, y = dot(bodies.translation[0, o:], own_q, n), dot(bodies.translation[1, o:], own_q, n)
        x_rate, y_rate = dot(bodies.translation[0, o:], own_v, n), dot(bodies.translation[1, o:], own_v, n)
        powers[at.STORED] += swept_x * (x_rate - omega * y) + swept_y * (y_rate + omega * x)
        # Modes that bodies have in common are damped once, those of the crank's group as the crank's.
        account = at.CRANK_LOSS + min(b, top.OTHERS)
        for i in range(n):
            carried = bodies.euler_load[o + i] * own_v[i] + omega * bodies.centrifugal_load[o + i] * own_q[i]
            # Arrays are kept transposed.
            turned = dot(bodies.gyroscopic[o + i], own_v, n) - 0.5 * omega * dot(bodies.spin[o + i], own_q, n)
            powers[at.STORED] += omega * (carried + turned * own_q[i])
            if o == row[top.GROUP]:
                powers[account] += model.damping[row[top.MODE] + i] * own_v[i] * own_v[i]


@kernel
def account_mass(model, work, k):
    """Power of the gas on the parts of law k, which has masses, on a head that rises, and friction of its piston."""
    powers = work.powers
    found = work.found[k]
    row = model.connections[k]
    powers[at.GAS_WORK] += found[on.GAS_POWER]
    powers[at.STORED] += found[on.KINETIC]
    if row[at.SHAPE] == at.OF_TERMS:
        return
    c = row[at.OF_CYLINDER]
    rod = model.cylinders[c]
    pressure = work.pressures[0, c]
    powers[at.GAS_POWER] -= (pressure - model.scalars[at.CRANKCASE]) * rod[at.AREA] * found[SPEED]
    head = row[at.FOLLOWED]
    if head >= 0:
        powers[at.GAS_WORK] += gas_force(rod, model.scalars, pressure) * work.port[at.UD, head + at.HEAD]
    powers[at.FRICTION_POWER] += found[FRICTION_ALONG] * found[SPEED]
    powers[at.LINERS_LOSS] += found[LINER_LOSS]
    powers[at.SKIRTS_LOSS] += found[SKIRT_LOSS]


@kernel
def account_connection(model, work, k):
    """Power that connection k takes from the bodies, by motion of its ends and by friction."""
    laws = model.laws
    found = work.found[k]
    row = model.connections[k]
    frame = work.frames[0]
    terms = row[at.SHAPE] == at.OF_TERMS
    lost = 0.0
    for r in range(2 if row[at.SHAPE] == at.OF_EYE else row[at.COUPLED]):
        rate = laws.velocity[k, r]
        if terms:
            rate -= wandering(model, work, frame, work.port[at.U], row[at.GAP] + r)
            if row[at.IS_LOAD] > 0:
                rate += carried_rate(model, work, frame, row[at.GAP] + r)
        lost -= found[r] * rate
    if row[at.RUBS] > 0:
        rubbing = work.told[k, at.RUBBING]
        other = 0.5 * (work.told[k, at.SPEEDS] - rubbing)
        rubbed = -found[on.FRICTION] * rubbing
        lost += second_lever(row, laws.place[k], found) * other
        take(model, work, k, at.RUB_ACCOUNT, rubbed)
        if not terms:
            powers = work.powers
            powers[at.FRICTION_POWER] += rubbed if row[at.SHAPE] == at.OF_EYE else rubbed - found[on.FRICTION] * other
    take(model, work, k, at.ACCOUNT, lost)


@kernel
def carried_rate(model, work, frame, j):
    """Rate of component j by rotation of frames, with which a load does work in addition to motion of its body.

    For two bodies in mesh these rates cancel. The other side of a load is at rest.
    """
    links = model.links
    rate = 0.0
    for t in range(links.starts[j], links.starts[j + 1]):
        port = links.taken[t, 0]
        for k in range(links.interfaces.shape[0]):
            held = links.interfaces[k]
            component = port - int(held[top.PORT_X])
            if 0 <= component <= at.ROTATION:
                body = model.bodies.rows[int(held[top.OWNER])]
                turn = body[top.SENSE] * work.links.frames[body[top.FRAME_OF], top.TURN] * frame[at.OMEGA]
                if component == 0:
                    rate -= work.links.coefficients[t, 0] * turn * held[top.FIXED_Y]
                elif component == 1:
                    rate += work.links.coefficients[t, 0] * turn * held[top.FIXED_X]
                elif component == at.ROTATION:
                    rate += work.links.coefficients[t, 0] * turn
    return rate
