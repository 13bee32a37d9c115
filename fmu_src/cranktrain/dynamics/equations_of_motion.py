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
from cranktrain.film.laws import CLEARANCE, IMPEDANCE, LAW, RADIUS, VISCOSITY, WIDTH, bearing_force
from cranktrain.film.parabolic import friction_torque
from cranktrain.film.thrust import thrust_force
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
    for i in range(model.omega2.shape[0]):
        x += model.gravity[0, i] * displaced[i]
        y += model.gravity[1, i] * displaced[i]
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
    rotation = 2 * b + 1 + 2 * p
    journal = rotation + p
    omega = frame[OMEGA]
    whirl = frame[WHIRL]
    ratio = c_v / c_q
    out = work.scratch
    for i in range(b):
        x = u[2 * i]
        y = u[2 * i + 1]
        speed = omega + ud[journal + i]
        law = model.bearings[i]
        bearing_force(
            law, x, y, ud[2 * i] - whirl * y, ud[2 * i + 1] + whirl * x, 0.5 * speed, frame[COS], frame[SIN],
            model.impedance, out,
        )  # fmt: skip
        f[2 * i] = out[0]
        f[2 * i + 1] = out[1]
        block = work.blocks[i]
        block[0] = out[2] + ratio * out[6] + whirl * out[7]
        block[1] = out[3] + ratio * out[7] - whirl * out[6]
        block[2] = out[4] + ratio * out[8] + whirl * out[9]
        block[3] = out[5] + ratio * out[9] - whirl * out[8]
        f[journal + i] = x * out[1] - y * out[0]
        if law[LAW] == IMPEDANCE:
            f[journal + i] += friction_torque(
                out[10], out[0], out[1], x, y, law[VISCOSITY], law[RADIUS], law[WIDTH], law[CLEARANCE], speed
            )
    z_force, z_stiffness, z_damping = thrust_force(u[2 * b], ud[2 * b], omega, model.thrust)
    f[2 * b] = z_force
    work.blocks[b + p, 0] = z_stiffness + ratio * z_damping
    for k in range(p):
        f[2 * b + 1 + 2 * k] = 0.0
        f[2 * b + 2 + 2 * k] = 0.0
        f[rotation + k] = 0.0
        for j in range(4):
            work.blocks[b + k, j] = 0.0
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
        g = model.scalars[GRAVITY]
        rod_force(
            cos * out[0] - sin * out[1], sin * out[0] + cos * out[1],
            cos * out[2] - sin * out[3], sin * out[2] + cos * out[3],
            cos * out[4] - sin * out[5], sin * out[4] + cos * out[5],
            gas, rod[ROD], rod[M_BIG], rod[M_OSC], rod[DELTA_J], rod[OFFSET],
            g * math.sin(rod[BANK]), g * math.cos(rod[BANK]), out,
        )  # fmt: skip
        fx = cos * out[0] + sin * out[1]
        fy = cos * out[1] - sin * out[0]
        f[2 * b + 1 + 2 * k] += fx
        f[2 * b + 2 + 2 * k] += fy
        f[rotation + k] += arm_x * fy - arm_y * fx
        t_xx = out[2] + out[4] * ratio + out[6] * alpha + out[7] * beta
        t_xy = -out[4] * omega + out[7] * alpha - out[6] * beta
        t_yx = out[3] + out[5] * ratio + out[8] * alpha + out[9] * beta
        t_yy = -out[5] * omega + out[9] * alpha - out[8] * beta
        block = work.blocks[b + k]
        # Turn the block back: Rᵀ T R.
        block[0] += cos * cos * t_xx + cos * sin * (t_xy + t_yx) + sin * sin * t_yy
        block[1] += cos * cos * t_xy + cos * sin * (t_yy - t_xx) - sin * sin * t_yx
        block[2] += cos * cos * t_yx + cos * sin * (t_yy - t_xx) - sin * sin * t_xy
        block[3] += cos * cos * t_yy - cos * sin * (t_xy + t_yx) + sin * sin * t_xx


@kernel
def pin_motion(model, frame, k, u, ud, udd, out):
    """Position, absolute velocity and acceleration of pin k in frame axes.

    ``out[6:8]`` is how far it moved, ``out[8:10]`` the share (R(φ) − I) X of turning alone.
    """
    b = model.bearings.shape[0]
    p = model.pins.shape[0]
    i = 2 * b + 1 + 2 * k
    r = 2 * b + 1 + 2 * p + k
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
    vx = ud[i] - ud[r] * arm_y
    vy = ud[i + 1] + ud[r] * arm_x
    ax = udd[i] - udd[r] * arm_y - ud[r] * ud[r] * turned_x
    ay = udd[i + 1] + udd[r] * arm_x - ud[r] * ud[r] * turned_y
    omega = frame[OMEGA]
    omega_dot = frame[OMEGA_DOT]
    out[0] = x
    out[1] = y
    out[2] = vx - omega * y
    out[3] = vy + omega * x
    out[4] = ax - 2.0 * omega * vy - omega_dot * y - omega * omega * x
    out[5] = ay + 2.0 * omega * vx + omega_dot * x - omega * omega * y
    out[6] = x - x0
    out[7] = y - y0
    out[8] = arm_x
    out[9] = arm_y
