"""What acts on crank and block: the frozen linear part and the force laws at the ports.

The linear part of a stage with q = Q + c_q a, v = V + c_v a is, for what turns and for what stands,

    S_t = I/c_q + (c_v/c_q) (D + 2Ω₀G + c_s d dᵀ) + diag(ω²) + Ω₀² (K_σ − C) + k_s d dᵀ
    S_s = I/c_q + (c_v/c_q) (D + C_m) + diag(ω²) + K_m

and I/c_q of guided pistons, with the connecting shaft's spring and damper (k_s, c_s at its twist d) and the mounts'
(K_m, C_m) folded in. S⁻¹, S⁻¹Φᵀ and Φ S⁻¹ Φᵀ are made once for (h, Ω₀). Everything else is a force at a port.

Forces act where their points are, not where they were: with φ the pin's own rotation its position is
R(φ) X + (u − φ e_z×X), exact for a rigid crank at any wind-up, and every force f on a displaced point (pins, journals,
and gravity on the displaced mass) adds the moment (u × f)_z about the frame's axis. Pins and journals nearly cancel;
together they keep the balance of angular momentum and of energy that linear shapes alone would miss. The block feels
the opposite of what journals and collar feel, moments included.
"""

from __future__ import annotations

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model.slots import (
    AREA,
    BEST_SPEED,
    BLOCK_RESTRAINT,
    BORE_ROTATIONS,
    COS,
    CRANK_MODES,
    CRANKCASE,
    DAMPER,
    DRIVEN,
    FALLOFF,
    GAS_LOAD,
    GRAVITY,
    LEAD,
    LEAD_RATE,
    LOAD,
    OMEGA,
    OMEGA_DOT,
    PHASE,
    SHAFT_C,
    SHAFT_K,
    SIN,
    THETA,
    THRUST_LAW,
    TILTS,
    TURNING_MODES,
    WHIRL,
)
from cranktrain.dynamics.motion.film_ports import place_journal, plane_block, space_block
from cranktrain.dynamics.motion.linear_algebra import invert, product
from cranktrain.dynamics.motion.relative import reactions, relative_motion
from cranktrain.dynamics.motion.rods import rod_forces
from cranktrain.film.laws.films import ANGLE as FRAME_ANGLE
from cranktrain.film.laws.films import COS as FRAME_COS
from cranktrain.film.laws.films import FORCE, FRICTION, SPEED, film_call
from cranktrain.film.laws.films import SIN as FRAME_SIN
from cranktrain.film.laws.parabolic import friction_torque
from cranktrain.film.laws.parameters import CLEARANCE, LAW, RADIUS, VISCOSITY, WIDTH
from cranktrain.film.laws.plane import IMPEDANCE, bearing_force
from cranktrain.film.laws.thrust import LINEAR as LINEAR_THRUST
from cranktrain.film.laws.thrust import thrust_force, thrust_force_tilted
from cranktrain.loads.damper import damper_torque
from cranktrain.loads.gas_pressure import gas_pressure


@kernel
def factor_stage(model, work, level, c_q, c_v, omega, holding, block_holding):
    """Make S⁻¹, the ports' responses and their compliance for (c_q, c_v, Ω₀), kept as ``level``.

    Returns 0, or 1 if S is singular. ``holding`` (N m/rad) holds the flywheel against turning, ``block_holding``
    ((rad/s)²) the block as a whole where it is.
    """
    t = int(model.layout[TURNING_MODES])
    ratio = c_v / c_q
    k_shaft = model.scalars[SHAFT_K]
    c_shaft = model.scalars[SHAFT_C]
    part = work.turning
    for i in range(t):
        for j in range(t):
            twist = model.shaft[i] * model.shaft[j]
            # Arrays are kept transposed: element (j, i) of the matrix stands at [i, j].
            b = 2.0 * omega * model.gyroscopic[i, j] + c_shaft * twist
            s = omega * omega * model.spin[i, j] + k_shaft * twist + holding * model.ends[0, i] * model.ends[0, j]
            if i == j:
                b += model.damping[i]
                s += 1.0 / c_q + model.omega2[i]
            part.scratch[i, j] = s + ratio * b
    status = factor_part(part, level, model.ports, model.ports_transposed, work.modal)
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
    status += factor_part(part, level, model.block_ports, model.block_ports_transposed, work.modal)
    work.counters[4] += 1.0
    return status


@kernel
def factor_part(part, level, shapes, transposed, scratch):
    """Invert the matrix in ``part.scratch`` and find what its ports answer; 0, or 1 if it is singular."""
    n = part.scratch.shape[0]
    m = shapes.shape[0]
    # Inverting the transpose gives the transpose of the inverse.
    if invert(part.scratch, n, scratch[0], scratch[1], part.inverse[level]) != 0:
        return 1
    for k in range(m):
        product(part.inverse[level], shapes[k], n, n, part.response[level, k])
        product(transposed, part.response[level, k], n, m, part.compliance[level, k])
    return 0


@kernel
def external_force(model, frame, pressures, displaced, out):
    """Modal force (n,) of frame and shaft, gravity on the displaced mass, gas on the heads and the mounts' preload."""
    t = int(model.layout[TURNING_MODES])
    omega = frame[OMEGA]
    lead = model.scalars[DRIVEN] * (model.scalars[SHAFT_K] * frame[LEAD] + model.scalars[SHAFT_C] * frame[LEAD_RATE])
    g_x = -model.scalars[GRAVITY] * frame[SIN]
    g_y = -model.scalars[GRAVITY] * frame[COS]
    x = 0.0
    y = 0.0
    for i in range(int(model.layout[CRANK_MODES])):
        x += model.gravity[0, i] * displaced[i]
        y += model.gravity[1, i] * displaced[i]
    for i in range(t):
        out[i] = (
            omega * omega * model.centrifugal_load[i]
            - frame[OMEGA_DOT] * model.euler_load[i]
            + g_x * model.gravity[0, i]
            + g_y * model.gravity[1, i]
            - lead * model.ends[0, i]
        )
    if model.scalars[DRIVEN] == 0.0:
        for i in range(t):
            out[i] -= frame[LOAD] * model.rotor[i]
    # By each rigid mode's own rotation: those of an unbalanced crank that move it across turn it a little as well.
    for i in range(6):
        out[i] += model.ends[1, i] * (x * g_y - y * g_x)
    n = model.omega2.shape[0]
    for i in range(t, n):
        out[i] = model.block.preload[i - t] - model.scalars[GRAVITY] * model.gravity[1, i]
    if model.layout[BORE_ROTATIONS] > 0.0:
        for i in range(t, t + 6):
            out[i] += frame[BLOCK_RESTRAINT] * displaced[i]
        for c in range(model.cylinders.shape[0]):
            gas = (pressures[c] - model.scalars[CRANKCASE]) * model.cylinders[c, AREA]
            for i in range(t, n):
                out[i] += gas * model.block.heads[c, i - t]


@kernel
def trace_angle(model, cylinder, theta):
    """Angle of the frame after the firing dead centre of a cylinder, rad."""
    return theta - model.cylinders[cylinder, PHASE]


@kernel
def trace_pressure(model, cylinder, theta, speed):
    """Cylinder pressure (Pa, absolute) of the built-in trace: motored, plus the burn's rise scaled with speed."""
    angle = trace_angle(model, cylinder, theta)
    motored = gas_pressure(angle, model.gas[0])
    x = speed / model.scalars[BEST_SPEED] - 1.0
    share = model.scalars[GAS_LOAD] * (1.0 - model.scalars[FALLOFF] * x * x)
    if share < 0.0:
        share = 0.0
    return motored + share * gas_pressure(angle, model.gas[1])


@kernel
def port_forces(model, frame, pressures, u, ud, udd, c_q, c_v, f, work):
    """Forces at all ports (m,) and the tangent blocks ∂f/∂u of a stage at displacement u, velocity u̇, acceleration ü.

    Moments of displaced forces and film friction act at the rotations of journals and pins; they go without tangent.
    ``work.port[4:7]`` hold Q, V and the free displacement of the ports where pistons are guided.
    """
    b = model.bearings.shape[0]
    journal = model.ports.shape[0] - b
    tilts = int(model.layout[TILTS])
    omega = frame[OMEGA]
    whirl = frame[WHIRL]
    ratio = c_v / c_q
    out = work.scratch
    d = work.port[15]
    dd = work.port[16]
    relative_motion(model, frame[COS], frame[SIN], whirl, u, ud, d, dd)
    model.films.numbers[FRAME_COS] = frame[COS]
    model.films.numbers[FRAME_SIN] = frame[SIN]
    model.films.numbers[FRAME_ANGLE] = frame[THETA]
    for k in range(2 * b + 1, f.shape[0]):
        f[k] = 0.0
    for i in range(b):
        x = d[2 * i]
        y = d[2 * i + 1]
        speed = omega + ud[journal + i]
        law = model.bearings[i]
        block = work.blocks[i]
        if tilts == 0:
            bearing_force(
                law, x, y, dd[2 * i] - whirl * y, dd[2 * i + 1] + whirl * x, 0.5 * speed, frame[COS], frame[SIN],
                model.impedance, out,
            )  # fmt: skip
            plane_block(out, ratio, whirl, block)
            friction = 0.0
            if law[LAW] == IMPEDANCE:
                friction = friction_torque(
                    out[10], out[0], out[1], x, y, law[VISCOSITY], law[RADIUS], law[WIDTH], law[CLEARANCE], speed
                )
            f[journal + i] = u[2 * i] * out[1] - u[2 * i + 1] * out[0] + friction
        else:
            t = tilts + 2 * i
            place_journal(d, dd, 2 * i, t, whirl, model.films.place[i], model.films.velocity[i])
            model.films.numbers[SPEED] = speed
            film_call(model.films, FORCE, i, out, out)
            space_block(out, ratio, whirl, block)
            f[t] = out[2]
            f[t + 1] = out[3]
            f[journal + i] = (
                u[2 * i] * out[1] - u[2 * i + 1] * out[0] + u[t] * out[3] - u[t + 1] * out[2] + out[FRICTION]
            )
        f[2 * i] = out[0]
        f[2 * i + 1] = out[1]
    collar_force(model, frame, d, dd, ratio, f, work)
    if model.layout[DAMPER] > 0.0:
        k = int(model.layout[DAMPER])
        damper_torque(model.damper, u[k], ud[k], out)
        f[k] = out[0]
        work.blocks[model.connections.shape[0] - 1, 0] = out[1] + ratio * out[2]
    rod_forces(model, frame, pressures, u, ud, udd, c_q, c_v, f, work)
    if model.layout[BORE_ROTATIONS] > 0.0:
        reactions(model, frame[COS], frame[SIN], f)
        for i in range(b):
            f[int(model.layout[BORE_ROTATIONS]) + i] = -f[journal + i]


@kernel
def collar_force(model, frame, u, ud, ratio, f, work):
    """Thrust bearing: axial force, and where films feel tilt the collar's two moments as well.

    A linear stand-in is a spring along the axis: a closed ring of pads would resist tilt as no real one with play does.
    """
    b = model.bearings.shape[0]
    z = 2 * b
    block = work.blocks[int(model.layout[THRUST_LAW])]
    if model.layout[TILTS] == 0.0 or model.thrust[0] == LINEAR_THRUST:
        for j in range(16):
            block[j] = 0.0
        f[z], stiffness, damping = thrust_force(u[z], ud[z], frame[OMEGA], model.thrust)
        block[0] = stiffness + ratio * damping
        return
    t = int(model.layout[TILTS]) + 2 * b
    cos = frame[COS]
    sin = frame[SIN]
    whirl = frame[WHIRL]
    out = work.scratch
    rate_x = ud[t] - whirl * u[t + 1]
    rate_y = ud[t + 1] + whirl * u[t]
    thrust_force_tilted(
        u[z], cos * u[t] - sin * u[t + 1], sin * u[t] + cos * u[t + 1],
        ud[z], cos * rate_x - sin * rate_y, sin * rate_x + cos * rate_y,
        frame[OMEGA], model.thrust, out,
    )  # fmt: skip
    f[z] = out[0]
    f[t] = cos * out[1] + sin * out[2]
    f[t + 1] = cos * out[2] - sin * out[1]
    # Pads stand still: turn the tangents by place (3 × 3 from 3 on) and by velocity (from 12 on) into the frame.
    for part in range(2):
        o = 3 + 9 * part
        for r in range(3):
            x = out[o + 3 * r + 1]
            y = out[o + 3 * r + 2]
            out[o + 3 * r + 1] = cos * x + sin * y
            out[o + 3 * r + 2] = cos * y - sin * x
        for c in range(3):
            x = out[o + 3 + c]
            y = out[o + 6 + c]
            out[o + 3 + c] = cos * x + sin * y
            out[o + 6 + c] = cos * y - sin * x
    for r in range(3):
        d_x = out[12 + 3 * r + 1]
        d_y = out[12 + 3 * r + 2]
        block[4 * r] = out[3 + 3 * r] + ratio * out[12 + 3 * r]
        block[4 * r + 1] = out[3 + 3 * r + 1] + ratio * d_x + whirl * d_y
        block[4 * r + 2] = out[3 + 3 * r + 2] + ratio * d_y - whirl * d_x
