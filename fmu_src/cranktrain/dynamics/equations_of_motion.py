"""What acts on the crank in its turning frame: the frozen linear part and the force laws at the ports.

The linear part of a stage with q = Q + c_q a, v = V + c_v a is

    S = I/c_q + (c_v/c_q) (D + 2Ω₀G + c_s d dᵀ) + diag(ω²) + Ω₀² (K_σ − C) + k_s d dᵀ

with the connecting shaft's spring and damper (k_s, c_s at the flywheel's rotation d) folded in. S⁻¹, S⁻¹Φᵀ and
Φ S⁻¹ Φᵀ are made once for (h, Ω₀). Everything else is a force at a port.

Forces act where their points are, not where they were: with φ the pin's own rotation its position is
R(φ) X + (u − φ e_z×X), exact for a rigid crank at any wind-up, and every force f on a displaced point (pins, journals,
and gravity on the displaced mass) adds the moment (u × f)_z about the frame's axis. Pins and journals nearly cancel;
together they keep the balance of angular momentum and of energy that linear shapes alone would miss.
"""

from __future__ import annotations

import math

from cranktrain.dynamics.linear_algebra import invert, product
from cranktrain.dynamics.model import (
    AREA,
    BANK,
    BEST_SPEED,
    CRANKCASE,
    DELTA_J,
    FALLOFF,
    GAS_LOAD,
    GRAVITY,
    M_BIG,
    M_OSC,
    OFFSET,
    PHASE,
    PIN,
    RIGID_ROTATION,
    ROD,
    SHAFT_C,
    SHAFT_K,
)
from cranktrain.dynamics.ports import CRANK_MODES, ROD_LAWS, RODS, THRUST_LAW, TILTS
from cranktrain.film.laws import IMPEDANCE, TABLE, bearing_force
from cranktrain.film.parabolic import friction_torque
from cranktrain.film.parameters import CLEARANCE, LAW, RADIUS, VISCOSITY, WIDTH
from cranktrain.film.thrust import thrust_force, thrust_force_tilted
from cranktrain.film.tilted import BY_PLACE, BY_VELOCITY, FORCE, FRICTION, RUBBING, SPEED, film_call
from cranktrain.film.tilted import COS as FRAME_COS
from cranktrain.film.tilted import SIN as FRAME_SIN
from cranktrain.kernel import kernel
from cranktrain.loads.gas_pressure import gas_pressure
from cranktrain.loads.slider_crank import rod_force

# What a stage knows of the frame's motion.
THETA, OMEGA, OMEGA_DOT, LEAD, LEAD_RATE, WHIRL, COS, SIN = range(8)
FRAME_SIZE = 8


@kernel
def factor_stage(model, work, level, c_q, c_v, omega, holding):
    """Make S⁻¹, the ports' responses and their compliance for (c_q, c_v, Ω₀), kept as ``level``.

    Returns 0, or 1 if S is singular. ``holding`` (N m/rad) is added to the connecting shaft's stiffness.
    """
    n = model.omega2.shape[0]
    m = model.ports.shape[0]
    ratio = c_v / c_q
    k_shaft = model.scalars[SHAFT_K] + holding
    c_shaft = model.scalars[SHAFT_C]
    for i in range(n):
        for j in range(n):
            drive = model.ends[0, i] * model.ends[0, j]
            # Arrays are kept transposed: element (j, i) of the matrix stands at [i, j].
            b = 2.0 * omega * model.gyroscopic[i, j] + c_shaft * drive
            s = omega * omega * model.spin[i, j] + k_shaft * drive
            if i == j:
                b += model.damping[i]
                s += 1.0 / c_q + model.omega2[i]
            work.damping[level, i, j] = b
            work.factors[i, j] = s + ratio * b
    # Inverting the transpose gives the transpose of the inverse.
    if invert(work.factors, n, work.modal[0], work.modal[1], work.inverse[level]) != 0:
        return 1
    for k in range(m):
        product(work.inverse[level], model.ports[k], n, n, work.response[level, k])
    for k in range(m):
        product(model.ports_transposed, work.response[level, k], n, m, work.compliance[level, k])
    work.counters[4] += 1.0
    return 0


@kernel
def external_force(model, frame, displaced, out):
    """Modal force of the frame: centrifugal and Euler loads, the shaft's lead, gravity on the displaced mass. (n,)."""
    omega = frame[OMEGA]
    lead = model.scalars[SHAFT_K] * frame[LEAD] + model.scalars[SHAFT_C] * frame[LEAD_RATE]
    g_x = -model.scalars[GRAVITY] * frame[SIN]
    g_y = -model.scalars[GRAVITY] * frame[COS]
    x = 0.0
    y = 0.0
    for i in range(int(model.layout[CRANK_MODES])):
        x += model.gravity[0, i] * displaced[i]
        y += model.gravity[1, i] * displaced[i]
    for i in range(model.omega2.shape[0]):
        out[i] = (
            omega * omega * model.centrifugal_load[i]
            - frame[OMEGA_DOT] * model.euler_load[i]
            + g_x * model.gravity[0, i]
            + g_y * model.gravity[1, i]
            - lead * model.ends[0, i]
        )
    out[5] += model.scalars[RIGID_ROTATION] * (x * g_y - y * g_x)


@kernel
def trace_pressure(model, cylinder, theta, speed):
    """Cylinder pressure (Pa, absolute) of the built-in trace: motored, plus the burn's rise scaled with speed."""
    angle = theta - model.cylinders[cylinder, PHASE]
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
    """
    b = model.bearings.shape[0]
    p = model.pins.shape[0]
    rotation = model.scales.shape[0]
    journal = rotation + p
    tilts = int(model.layout[TILTS])
    omega = frame[OMEGA]
    whirl = frame[WHIRL]
    ratio = c_v / c_q
    out = work.scratch
    model.films.numbers[FRAME_COS] = frame[COS]
    model.films.numbers[FRAME_SIN] = frame[SIN]
    for k in range(2 * b + 1, journal):
        f[k] = 0.0
    for i in range(b):
        x = u[2 * i]
        y = u[2 * i + 1]
        speed = omega + ud[journal + i]
        law = model.bearings[i]
        block = work.blocks[i]
        if tilts == 0:
            bearing_force(
                law, x, y, ud[2 * i] - whirl * y, ud[2 * i + 1] + whirl * x, 0.5 * speed, frame[COS], frame[SIN],
                model.impedance, out,
            )  # fmt: skip
            plane_block(out, ratio, whirl, block)
            f[journal + i] = x * out[1] - y * out[0]
            if law[LAW] == IMPEDANCE:
                f[journal + i] += friction_torque(
                    out[10], out[0], out[1], x, y, law[VISCOSITY], law[RADIUS], law[WIDTH], law[CLEARANCE], speed
                )
        else:
            t = tilts + 2 * i
            place_journal(u, ud, 2 * i, t, whirl, model.films.place[i], model.films.velocity[i])
            model.films.numbers[SPEED] = speed
            film_call(model.films, FORCE, i, out, out)
            space_block(out, ratio, whirl, block)
            f[t] = out[2]
            f[t + 1] = out[3]
            f[journal + i] = x * out[1] - y * out[0] + u[t] * out[3] - u[t + 1] * out[2] + out[FRICTION]
        f[2 * i] = out[0]
        f[2 * i + 1] = out[1]
    collar_force(model, frame, u, ud, ratio, f, work)
    first = b
    free = model.layout[ROD_LAWS] < model.connections.shape[0]
    for k in range(b, int(model.layout[THRUST_LAW])):
        for j in range(16):
            work.blocks[k, j] = 0.0
    alpha = 1.0 / c_q - omega * omega
    beta = 2.0 * omega * ratio + frame[OMEGA_DOT]
    for c in range(model.cylinders.shape[0]):
        rod = model.cylinders[c]
        k = int(rod[PIN])
        cos = math.cos(frame[THETA] - rod[BANK])
        sin = math.sin(frame[THETA] - rod[BANK])
        gas = (pressures[c] - model.scalars[CRANKCASE]) * rod[AREA]
        pin_motion(model, frame, k, u, ud, udd, out)
        arm_x = out[6]
        arm_y = out[7]
        port = 2 * b + 1 + 2 * k
        block = work.blocks[first + k]
        torque = 0.0
        if free:
            port = int(model.layout[RODS]) + 2 * c
            block = work.blocks[int(model.layout[ROD_LAWS]) + c]
            for j in range(6):
                out[16 + j] = out[j]
            big_end_motion(model, frame, k, port, u, ud, udd, out)
            torque = big_end_film(model, frame, c, port, cos, sin, ud, ratio, f, work)
        g = model.scalars[GRAVITY]
        rod_force(
            cos * out[0] - sin * out[1], sin * out[0] + cos * out[1],
            cos * out[2] - sin * out[3], sin * out[2] + cos * out[3],
            cos * out[4] - sin * out[5], sin * out[4] + cos * out[5],
            gas, rod[ROD], rod[M_BIG], rod[M_OSC], rod[DELTA_J], rod[OFFSET],
            g * math.sin(rod[BANK]), g * math.cos(rod[BANK]), out,
        )  # fmt: skip
        # Friction that turns the rod is held by the piston's guide, a couple with the big end.
        out[0] += torque
        fx = cos * out[0] + sin * out[1]
        fy = cos * out[1] - sin * out[0]
        f[port] += fx
        f[port + 1] += fy
        if not free:
            f[rotation + k] += arm_x * fy - arm_y * fx
        t_xx = out[2] + out[4] * ratio + out[6] * alpha + out[7] * beta
        t_xy = -out[4] * omega + out[7] * alpha - out[6] * beta
        t_yx = out[3] + out[5] * ratio + out[8] * alpha + out[9] * beta
        t_yy = -out[5] * omega + out[9] * alpha - out[8] * beta
        # Turn the block back: Rᵀ T R.
        xx = cos * cos * t_xx + cos * sin * (t_xy + t_yx) + sin * sin * t_yy
        xy = cos * cos * t_xy + cos * sin * (t_yy - t_xx) - sin * sin * t_yx
        yx = cos * cos * t_yx + cos * sin * (t_yy - t_xx) - sin * sin * t_xy
        yy = cos * cos * t_yy - cos * sin * (t_xy + t_yx) + sin * sin * t_xx
        if free:
            block[0] = xx
            block[1] = xy
            block[4] = yx
            block[5] = yy
        else:
            block[0] += xx
            block[1] += xy
            block[4] += yx
            block[5] += yy


@kernel
def plane_block(out, ratio, whirl, block):
    """Tangent of a film in the plane by its ports' displacement, (2, 2) into the 4 × 4 block."""
    block[0] = out[2] + ratio * out[6] + whirl * out[7]
    block[1] = out[3] + ratio * out[7] - whirl * out[6]
    block[4] = out[4] + ratio * out[8] + whirl * out[9]
    block[5] = out[5] + ratio * out[9] - whirl * out[8]


@kernel
def space_block(out, ratio, whirl, block):
    """Tangent of a film that feels tilt by its ports' displacement, (4, 4)."""
    for r in range(4):
        for pair in range(0, 4, 2):
            i = 4 * r + pair
            d_x = out[BY_VELOCITY + i]
            d_y = out[BY_VELOCITY + i + 1]
            block[i] = out[BY_PLACE + i] + ratio * d_x + whirl * d_y
            block[i + 1] = out[BY_PLACE + i + 1] + ratio * d_y - whirl * d_x


@kernel
def place_journal(u, ud, port, tilt, whirl, place, velocity):
    """Middle and end displacement of a journal (4,), and their velocity in space along the frame's axes (4,)."""
    for pair in range(2):
        k = port if pair == 0 else tilt
        x = u[k]
        y = u[k + 1]
        place[2 * pair] = x
        place[2 * pair + 1] = y
        velocity[2 * pair] = ud[k] - whirl * y
        velocity[2 * pair + 1] = ud[k + 1] + whirl * x


@kernel
def collar_force(model, frame, u, ud, ratio, f, work):
    """Thrust bearing: axial force, and where films feel tilt the collar's two moments as well."""
    b = model.bearings.shape[0]
    z = 2 * b
    block = work.blocks[int(model.layout[THRUST_LAW])]
    if model.layout[TILTS] == 0.0:
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


@kernel
def big_end_film(model, frame, c, port, cos, sin, ud, ratio, f, work):
    """Film between pin and free big end of cylinder c, from the pin's motion in scratch[16:22] and the rod's in [0:6].

    Adds its forces to pin, rod and pin rotation; returns the side force that holds its friction on the rod.
    """
    motion = work.scratch
    law = model.big_ends[c]
    rod = model.cylinders[c]
    k = int(rod[PIN])
    rotation = model.scales.shape[0]
    pin = 2 * model.bearings.shape[0] + 1 + 2 * k
    side = cos * motion[0] - sin * motion[1] - rod[OFFSET]
    height = math.sqrt(rod[ROD] * rod[ROD] - side * side)
    # The rod turns as its big end moves across the cylinder.
    rod_speed = (cos * motion[2] - sin * motion[3]) / height
    pin_speed = frame[OMEGA] + ud[rotation + k]
    x = motion[16] - motion[0]
    y = motion[17] - motion[1]
    out = model.floating.plane
    vx = motion[18] - motion[2]
    vy = motion[19] - motion[3]
    float_force(model, c, FORCE, x, y, vx, vy, pin_speed, rod_speed, frame, out)
    friction = out[FRICTION] + friction_torque(
        out[10], out[0], out[1], x, y, law[VISCOSITY], law[RADIUS], law[WIDTH], law[CLEARANCE], pin_speed - rod_speed
    )
    f[pin] += out[0]
    f[pin + 1] += out[1]
    f[port] -= out[0]
    f[port + 1] -= out[1]
    x0 = model.pins[k, 0]
    y0 = model.pins[k, 1]
    f[rotation + k] += (motion[16] - x0) * out[1] - (motion[17] - y0) * out[0] + friction
    block = work.blocks[model.bearings.shape[0] + c]
    plane_block(out, ratio, frame[OMEGA], block)
    for row in range(2):
        for column in range(2):
            value = block[4 * row + column]
            block[4 * row + column + 2] = -value
            block[4 * (row + 2) + column] = -value
            block[4 * (row + 2) + column + 2] = value
    return -(friction + x * out[1] - y * out[0]) / height


@kernel
def float_force(model, c, action, x, y, vx, vy, pin_speed, rod_speed, frame, out):
    """Force on the pin in the floating big end of cylinder c, as :func:`bearing_force`, and the asperities' torque."""
    law = model.big_ends[c]
    out[FRICTION] = 0.0
    if law[LAW] != TABLE:
        bearing_force(
            law, x, y, vx, vy, 0.5 * (pin_speed + rod_speed), frame[COS], frame[SIN], model.big_end_impedance, out
        )
        return
    films = model.floating
    films.place[c, 0] = x
    films.place[c, 1] = y
    films.velocity[c, 0] = vx
    films.velocity[c, 1] = vy
    films.numbers[SPEED] = pin_speed + rod_speed
    films.numbers[RUBBING] = pin_speed - rod_speed
    film_call(films, action, c, out, out)


@kernel
def big_end_motion(model, frame, k, port, u, ud, udd, out):
    """Position, absolute velocity and acceleration of a free big end of pin k in frame axes, ``out[0:6]``."""
    absolute_motion(
        model.pins[k, 0] + u[port], model.pins[k, 1] + u[port + 1], ud[port], ud[port + 1], udd[port], udd[port + 1],
        frame, out,
    )  # fmt: skip


@kernel
def absolute_motion(x, y, vx, vy, ax, ay, frame, out):
    """Position, absolute velocity and acceleration in frame axes of a point that moves in the turning frame."""
    omega = frame[OMEGA]
    omega_dot = frame[OMEGA_DOT]
    out[0] = x
    out[1] = y
    out[2] = vx - omega * y
    out[3] = vy + omega * x
    out[4] = ax - 2.0 * omega * vy - omega_dot * y - omega * omega * x
    out[5] = ay + 2.0 * omega * vx + omega_dot * x - omega * omega * y


@kernel
def pin_motion(model, frame, k, u, ud, udd, out):
    """Position, absolute velocity and acceleration of pin k in frame axes.

    ``out[6:8]`` is how far it moved, ``out[8:10]`` the share (R(φ) − I) X of turning alone.
    """
    i = 2 * model.bearings.shape[0] + 1 + 2 * k
    r = model.scales.shape[0] + k
    x0 = model.pins[k, 0]
    y0 = model.pins[k, 1]
    phi = u[r]
    cos = math.cos(phi)
    sin = math.sin(phi)
    turned_x = cos * x0 - sin * y0
    turned_y = sin * x0 + cos * y0
    arm_x = turned_x - x0
    arm_y = turned_y - y0
    x = turned_x + u[i] + phi * y0
    y = turned_y + u[i + 1] - phi * x0
    absolute_motion(
        x, y, ud[i] - ud[r] * arm_y, ud[i + 1] + ud[r] * arm_x,
        udd[i] - udd[r] * arm_y - ud[r] * ud[r] * turned_x, udd[i + 1] + udd[r] * arm_x - ud[r] * ud[r] * turned_y,
        frame, out,
    )  # fmt: skip
    out[6] = x - x0
    out[7] = y - y0
    out[8] = arm_x
    out[9] = arm_y
