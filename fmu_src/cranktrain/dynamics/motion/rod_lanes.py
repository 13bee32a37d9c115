"""Four rods at once, side by side in vectors: big ends on their pins, pistons on the axes of their cylinders.

The operations are those of :mod:`.rod_motion`, :func:`cranktrain.loads.slider_crank.rod_force` and
:func:`cranktrain.dynamics.motion.rods.pin_block`, in their order: the bits are those of one rod after the other.
"""

from __future__ import annotations

from typing import NamedTuple

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.vectors import LANES, pack, square_root, store
from cranktrain.dynamics.model.slots import (
    AREA,
    COS,
    COS_BANK,
    CRANKCASE,
    DELTA_J,
    FORCES,
    GRAVITY,
    M_BIG,
    M_OSC,
    OFFSET,
    OMEGA,
    OMEGA_DOT,
    PIN_ROTATIONS,
    PISTONS,
    ROD,
    RODS,
    SIN,
    SIN_BANK,
    UD,
    UDD,
    U,
)
from cranktrain.dynamics.motion.rod_motion import SMALL

# Vectors that four rods leave in scratch, four numbers each: what they do to pin and pin rotation, and its tangent.
FORCE_X, FORCE_Y, TORQUE, TANGENT = range(4)
ROW = 4
"""Values in a row of a connection's block."""


class PinLanes(NamedTuple):
    """Vectors of four pins: place, absolute velocity and acceleration in frame axes, and how far each moved."""

    x: object
    y: object
    vx: object
    vy: object
    ax: object
    ay: object
    moved_x: object
    moved_y: object


@inlined_kernel
def go_side_by_side(model, u):
    """Whether :func:`rods_side_by_side` serves: no free big ends, no guided pistons, pins that turn by little."""
    if model.layout[RODS] > 0.0 or model.layout[PISTONS] > 0.0:
        return False
    first = int(model.layout[PIN_ROTATIONS])
    most = 0.0
    for k in range(first, first + model.cylinders.shape[0]):
        most = max(most, abs(u[k]))
    return most <= SMALL


@inlined_kernel
def rods_side_by_side(model, work, frame, pressures, c_q, c_v):
    """Add the rods' forces to pins, and fill their tangents there, as ``rod_forces`` does."""
    count = model.cylinders.shape[0]
    b = model.bearings.shape[0]
    turns = model.layout[PIN_ROTATIONS] < model.scales.shape[0]
    f = work.port[FORCES]
    out = work.scratch
    for c in range(0, count, LANES):
        rods_of_four(model, work, frame, pressures, c_q, c_v, c)
        for lane in range(min(LANES, count - c)):
            rotation = int(model.layout[PIN_ROTATIONS]) + c + lane
            block = work.blocks[b + c + lane]
            f[rotation] += out[LANES * TORQUE + lane]
            block[0] = out[LANES * TANGENT + lane]
            if turns:
                continue
            port = 2 * b + 1 + 2 * (c + lane)
            f[port] += out[LANES * FORCE_X + lane]
            f[port + 1] += out[LANES * FORCE_Y + lane]
            block[1] = out[LANES * (TANGENT + 1) + lane]
            block[ROW] = out[LANES * (TANGENT + 2) + lane]
            block[ROW + 1] = out[LANES * (TANGENT + 3) + lane]


@inlined_kernel
def picked(table, rows, column):
    """One column of four rows."""
    r0, r1, r2, r3 = rows
    return pack(table[r0, column], table[r1, column], table[r2, column], table[r3, column])


@inlined_kernel
def spread(row, first, apart, rows):
    """Four numbers of a row, ``apart`` from each other."""
    r0, r1, r2, r3 = rows
    return pack(row[first + apart * r0], row[first + apart * r1], row[first + apart * r2], row[first + apart * r3])


@inlined_kernel
def pins_of_four(model, work, frame, rows):
    """Motion of four pins, :class:`PinLanes`."""
    u = work.port[U]
    ud = work.port[UD]
    udd = work.port[UDD]
    i = 2 * model.bearings.shape[0] + 1
    first = int(model.layout[PIN_ROTATIONS])
    x0 = picked(model.pins, rows, 0)
    y0 = picked(model.pins, rows, 1)
    phi = spread(u, first, 1, rows)
    rate = spread(ud, first, 1, rows)
    bend = spread(udd, first, 1, rows)
    s = phi * phi
    cos = 1.0 - s * (1.0 / 2.0 - s * (1.0 / 24.0 - s * (1.0 / 720.0 - s * (1.0 / 40320.0 - s * (1.0 / 3628800.0)))))
    sin = phi - phi * s * (1.0 / 6.0 - s * (1.0 / 120.0 - s * (1.0 / 5040.0 - s * (1.0 / 362880.0))))
    x = cos * x0 - sin * y0
    y = sin * x0 + cos * y0
    if first < model.scales.shape[0]:
        vx = (0.0 - rate) * y
        vy = rate * x
        ax = (0.0 - bend) * y - rate * rate * x
        ay = bend * x - rate * rate * y
    else:
        arm_x = x - x0
        arm_y = y - y0
        vx = spread(ud, i, 2, rows) - rate * arm_y
        vy = spread(ud, i + 1, 2, rows) + rate * arm_x
        ax = spread(udd, i, 2, rows) - bend * arm_y - rate * rate * x
        ay = spread(udd, i + 1, 2, rows) + bend * arm_x - rate * rate * y
        x = x + spread(u, i, 2, rows) + phi * y0
        y = y + spread(u, i + 1, 2, rows) - phi * x0
    omega = frame[OMEGA]
    omega_dot = frame[OMEGA_DOT]
    return PinLanes(
        x, y, vx - omega * y, vy + omega * x,
        ax - 2.0 * omega * vy - omega_dot * y - omega * omega * x,
        ay + 2.0 * omega * vx + omega_dot * x - omega * omega * y,
        x - x0, y - y0,
    )  # fmt: skip


# In one piece: the equations of rod_force and pin_block, whose results are no arrays here but vectors.
@kernel
def rods_of_four(model, work, frame, pressures, c_q, c_v, c):
    """Rods c to c + 3, beyond the last one that again: vectors from FORCE_X on in ``work.scratch``."""
    rods = model.cylinders
    last = rods.shape[0] - 1
    rows = (c, min(c + 1, last), min(c + 2, last), min(c + 3, last))
    pin = pins_of_four(model, work, frame, rows)
    bank_cos = picked(rods, rows, COS_BANK)
    bank_sin = picked(rods, rows, SIN_BANK)
    cos = frame[COS] * bank_cos + frame[SIN] * bank_sin
    sin = frame[SIN] * bank_cos - frame[COS] * bank_sin
    vx = cos * pin.vx - sin * pin.vy
    ax = cos * pin.ax - sin * pin.ay
    ay = sin * pin.ax + cos * pin.ay
    g = model.scalars[GRAVITY]
    gas = (spread(pressures, 0, 1, rows) - model.scalars[CRANKCASE]) * picked(rods, rows, AREA)
    length = picked(rods, rows, ROD)
    m_b = picked(rods, rows, M_BIG)
    m_o = picked(rods, rows, M_OSC)
    delta_j = picked(rods, rows, DELTA_J)
    # As rod_force does.
    x = cos * pin.x - sin * pin.y - picked(rods, rows, OFFSET)
    per_s = 1.0 / square_root(length * length - x * x)
    per_s2 = per_s * per_s
    per_s4 = per_s2 * per_s2
    lean = (0.0 - x) * per_s
    l2s3 = length * length * per_s2 * per_s
    vx2 = vx * vx
    a_p = lean * ax + ay - vx2 * l2s3
    axial = m_o * (a_p + g * bank_cos) + gas
    remainder = delta_j * (ax * per_s2 + x * vx2 * per_s4)
    across = (0.0 - m_b) * (ax + g * bank_sin) - lean * axial - remainder
    along = (0.0 - m_b) * (ay + g * bank_cos) - axial
    slope = (0.0 - l2s3) * ax + 3.0 * vx2 * length * length * lean * per_s4
    by_x = (
        l2s3 * axial
        - lean * m_o * slope
        - delta_j * (-2.0 * lean * ax * per_s2 * per_s + vx2 * per_s4 - 4.0 * x * vx2 * lean * per_s4 * per_s)
    )
    by_x_along = (0.0 - m_o) * slope
    swing = -2.0 * vx * l2s3
    by_vx = (0.0 - lean) * m_o * swing - delta_j * 2.0 * x * vx * per_s4
    by_vx_along = (0.0 - m_o) * swing
    by_ax = (0.0 - m_b) - m_o * lean * lean - delta_j * per_s2
    by_ay = (0.0 - m_o) * lean
    # As pin_block does.
    ratio = c_v / c_q
    omega = frame[OMEGA]
    alpha = 1.0 / c_q - omega * omega
    beta = 2.0 * omega * ratio + frame[OMEGA_DOT]
    t_xx = by_x + by_vx * ratio + by_ax * alpha + by_ay * beta
    t_xy = (0.0 - by_vx) * omega + by_ay * alpha - by_ax * beta
    t_yx = by_x_along + by_vx_along * ratio + by_ay * alpha + ((0.0 - m_b) - m_o) * beta
    t_yy = (0.0 - by_vx_along) * omega + ((0.0 - m_b) - m_o) * alpha - by_ay * beta
    xx = cos * cos * t_xx + cos * sin * (t_xy + t_yx) + sin * sin * t_yy
    xy = cos * cos * t_xy + cos * sin * (t_yy - t_xx) - sin * sin * t_yx
    yx = cos * cos * t_yx + cos * sin * (t_yy - t_xx) - sin * sin * t_xy
    yy = cos * cos * t_yy - cos * sin * (t_xy + t_yx) + sin * sin * t_xx
    fx = cos * across + sin * along
    fy = cos * along - sin * across
    out = work.scratch
    if model.layout[PIN_ROTATIONS] < model.scales.shape[0]:
        # The pin goes along its circle, and the force keeps its direction.
        lever_x = picked(model.pins, rows, 0) + pin.moved_x
        lever_y = picked(model.pins, rows, 1) + pin.moved_y
        turned = lever_y * (lever_y * xx - lever_x * xy)
        turned += lever_x * (lever_x * yy - lever_y * yx) - lever_x * fx - lever_y * fy
        store(out, LANES * TORQUE, lever_x * fy - lever_y * fx)
        store(out, LANES * TANGENT, turned)
        return
    store(out, LANES * FORCE_X, fx)
    store(out, LANES * FORCE_Y, fy)
    store(out, LANES * TORQUE, pin.moved_x * fy - pin.moved_y * fx)
    store(out, LANES * TANGENT, xx)
    store(out, LANES * (TANGENT + 1), xy)
    store(out, LANES * (TANGENT + 2), yx)
    store(out, LANES * (TANGENT + 3), yy)
