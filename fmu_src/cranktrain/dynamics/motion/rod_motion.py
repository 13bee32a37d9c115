"""Motion of the pins and free big ends that carry rods, in axes of the frame and of a rod's cylinder."""

from __future__ import annotations

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.loads.articulated_rod import hang

# Motion of a point in a plane: position X, Y, velocity VX, VY, acceleration AX, AY.
# MOVED, ARM: for a pin, its displacement, and the part (R(φ) − I) X of the displacement by rotation alone.
X, Y, VX, VY, AX, AY, MOVED, ARM = 0, 1, 2, 3, 4, 5, 6, 8
# Positions in scratch, after the results of rod_force:
# PIN, CROSS: motion of a pin, and motion of a rod's end in axes of its cylinder.
# SIDE: values of the rod's piston.
PIN, CROSS, SIDE = 16, 24, 48
MASTERS_PIN, PUSH = 32, 44
"""Positions in scratch of the motion of the crank pin under an articulated rod, in axes of the master's cylinder (the
motion of the knuckle pin is at CROSS), and of the force on a rod's end by unit force on its piston."""
SMALL = 0.1
"""Rotation (rad) below which the series of :func:`turn` are exact to rounding."""


@inlined_kernel
def rod_end(model, frame, c, u, ud, udd, out):
    """Motion of the point about which the rod of cylinder c turns: a floating big end, else the pin."""
    if model.cylinders[c, at.END_PORT] >= 0.0:
        big_end_motion(model, frame, c, u, ud, udd, out)
    else:
        pin_motion(model, frame, c, u, ud, udd, out)


@inlined_kernel
def big_end_motion(model, frame, c, u, ud, udd, out):
    """Position, absolute velocity and acceleration of the free big end of cylinder c, in axes of the frame."""
    k = int(model.cylinders[c, at.END_PORT])
    absolute_motion(
        model.pins[c, 0] + u[k], model.pins[c, 1] + u[k + 1], ud[k], ud[k + 1], udd[k], udd[k + 1], frame, out
    )


@inlined_kernel
def absolute_motion(x, y, vx, vy, ax, ay, frame, out):
    """Position, absolute velocity and acceleration in frame axes of a point that moves in the rotating frame."""
    omega = frame[at.OMEGA]
    omega_dot = frame[at.OMEGA_DOT]
    out[X] = x
    out[Y] = y
    out[VX] = vx - omega * y
    out[VY] = vy + omega * x
    out[AX] = ax - 2.0 * omega * vy - omega_dot * y - omega * omega * x
    out[AY] = ay + 2.0 * omega * vx + omega_dot * x - omega * omega * y


@inlined_kernel
def pin_motion(model, frame, c, u, ud, udd, out):
    """Position, absolute velocity and acceleration of the pin under the rod of cylinder c in frame axes.

    From MOVED on ``out`` holds its displacement, from ARM on the part (R(φ) − I) X of it by rotation alone.
    """
    i = int(model.cylinders[c, at.PIN_PORT])
    r = int(model.cylinders[c, at.PIN_TURN])
    x0 = model.pins[c, 0]
    y0 = model.pins[c, 1]
    phi = u[r]
    cos, sin = turn(phi)
    turned_x = cos * x0 - sin * y0
    turned_y = sin * x0 + cos * y0
    arm_x = turned_x - x0
    arm_y = turned_y - y0
    if i < 0:
        absolute_motion(
            turned_x, turned_y, -ud[r] * turned_y, ud[r] * turned_x,
            -udd[r] * turned_y - ud[r] * ud[r] * turned_x, udd[r] * turned_x - ud[r] * ud[r] * turned_y, frame, out,
        )  # fmt: skip
        out[MOVED] = arm_x
        out[MOVED + 1] = arm_y
        out[ARM] = arm_x
        out[ARM + 1] = arm_y
        return
    x = turned_x + u[i] + phi * y0
    y = turned_y + u[i + 1] - phi * x0
    absolute_motion(
        x, y, ud[i] - ud[r] * arm_y, ud[i + 1] + ud[r] * arm_x,
        udd[i] - udd[r] * arm_y - ud[r] * ud[r] * turned_x, udd[i + 1] + udd[r] * arm_x - ud[r] * ud[r] * turned_y,
        frame, out,
    )  # fmt: skip
    out[MOVED] = x - x0
    out[MOVED + 1] = y - y0
    out[ARM] = arm_x
    out[ARM + 1] = arm_y


@inlined_kernel
def turn(phi):
    """Cosine and sine of a pin's own rotation ``phi``, by a few terms of their series if the angle is small."""
    if abs(phi) > SMALL:
        return math.cos(phi), math.sin(phi)
    x = phi * phi
    cos = 1.0 - x * (1.0 / 2.0 - x * (1.0 / 24.0 - x * (1.0 / 720.0 - x * (1.0 / 40320.0 - x * (1.0 / 3628800.0)))))
    sin = phi - phi * x * (1.0 / 6.0 - x * (1.0 / 120.0 - x * (1.0 / 5040.0 - x * (1.0 / 362880.0))))
    return cos, sin


@inlined_kernel
def cylinder_axes(rod, frame):
    """Cosine and sine of the frame's angle relative to a rod's cylinder."""
    cos = frame[at.COS] * rod[at.COS_BANK] + frame[at.SIN] * rod[at.SIN_BANK]
    return cos, frame[at.SIN] * rod[at.COS_BANK] - frame[at.COS] * rod[at.SIN_BANK]


@inlined_kernel
def across_cylinder(motion, cos, sin, cross):
    """Rotate a motion (six values) into axes of a cylinder, by cosine and sine of the frame's angle relative to it."""
    for j in range(X, MOVED, 2):
        cross[j] = cos * motion[j] - sin * motion[j + 1]
        cross[j + 1] = sin * motion[j] + cos * motion[j + 1]


@inlined_kernel
def axes_of_pin(model, c):
    """Cylinder in whose axes the motion of the pin of cylinder c is needed: that of the master rod, or c itself."""
    master = int(model.cylinders[c, at.MASTER])
    return c if master < 0 else master


@kernel
def rod_end_across(model, frame, c, u, ud, udd, out):
    """Motion of the pin, big end or knuckle pin about which the rod of cylinder c turns, in axes of its cylinder.

    Writes six values to ``out[CROSS:]``. For an articulated rod ``out[MASTERS_PIN:]`` gets the crank pin's motion in
    axes of the master's cylinder. ``out`` is ``work.scratch``.
    """
    rod_end(model, frame, c, u, ud, udd, out)
    cos, sin = cylinder_axes(model.cylinders[axes_of_pin(model, c)], frame)
    across_cylinder(out, cos, sin, out[CROSS:])
    if model.cylinders[c, at.MASTER] >= 0.0:
        hang(model.cylinders[c, at.JOINT :], out[CROSS:], out[MASTERS_PIN:])


@kernel
def rod_swing(rod, motion, cos, sin):
    """Height (m) of a rod's small end above its big end, and angular speed (rad/s) of the rod."""
    side = cos * motion[X] - sin * motion[Y] - rod[at.OFFSET]
    height = math.sqrt(rod[at.ROD] * rod[at.ROD] - side * side)
    return height, (cos * motion[VX] - sin * motion[VY]) / height
