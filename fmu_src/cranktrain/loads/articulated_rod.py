"""Force of a rigid articulated rod and its piston on the crank pin, transferred through the master rod.

Motion of the knuckle pin and symbols are those of :mod:`cranktrain.engine.articulated_rod`. The force F of the rod on
the knuckle pin is that of :mod:`cranktrain.loads.slider_crank` with the motion of the knuckle pin. With
∂K/∂P = I + (h/s) ⊗ e_x the force on the crank pin is

    f = F + e_x (h·F)/s

F acts through the big end. The couple h·F is balanced at the master's piston by an additional liner force (h·F)/s
across the cylinder. Tangents are exact directional derivatives, with dφ = dx/s, dK = dP + dφ h, dh = −dφ r and

    df = dF + e_x [(h·dF)/s + dx (h·F X/s³ − r·F/s²)]
"""

import math

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.core.types import Array
from cranktrain.engine.articulated_rod import Articulation, knuckle_motion
from cranktrain.loads.slider_crank import BY_ACCELERATION, BY_VX, BY_X

# Indices of the constants of an articulated rod's joint:
# MASTER_LENGTH, MASTER_OFFSET: length of the master rod and offset of its cylinder (m).
# KNUCKLE_X, KNUCKLE_Y: position of the knuckle pin in the axes of the master rod (m).
# COS_TURN, SIN_TURN: cosine and sine of the angle from the master's bank to the articulated rod's bank.
MASTER_LENGTH, MASTER_OFFSET, KNUCKLE_X, KNUCKLE_Y, COS_TURN, SIN_TURN, JOINT = range(7)

# Indices of a master rod's motion: position, velocity and acceleration of the crank pin, then h, s, φ̇ and φ̈.
X, Y, VX, VY, AX, AY, H_X, H_Y, S, RATE, CHANGE, MASTERS_PIN = range(12)


def joint_values(joint: Articulation) -> Array:
    """Return the constants of a joint as kernels read them, (JOINT,)."""
    cos, sin = math.cos(joint.turn), math.sin(joint.turn)
    return np.array([joint.length, joint.offset, joint.x, joint.y, cos, sin])


@kernel
def hang(joint, own, pin):
    """Replace the crank pin's motion ``own`` (6,), in axes of the master's cylinder, by the knuckle pin's motion.

    The motion of the knuckle pin is in axes of its rod's cylinder. ``pin`` (MASTERS_PIN,) stores the motion of the
    crank pin, h, s, φ̇ and φ̈.
    """
    for j in range(H_X):
        pin[j] = own[j]
    moved = knuckle_motion(
        pin[X], pin[Y], pin[VX], pin[VY], pin[AX], pin[AY], joint[MASTER_LENGTH], joint[MASTER_OFFSET],
        joint[KNUCKLE_X], joint[KNUCKLE_Y],
    )  # fmt: skip
    for j in range(H_X, MASTERS_PIN):
        pin[j] = moved[j]
    cos = joint[COS_TURN]
    sin = joint[SIN_TURN]
    own[X] = cos * moved[X] + sin * moved[Y]
    own[Y] = cos * moved[Y] - sin * moved[X]
    own[VX] = cos * moved[VX] + sin * moved[VY]
    own[VY] = cos * moved[VY] - sin * moved[VX]
    own[AX] = cos * moved[AX] + sin * moved[AY]
    own[AY] = cos * moved[AY] - sin * moved[AX]


@kernel
def hung_pin(joint, x, y, vx, vy):
    """Return place and velocity of a knuckle pin, across and along its rod's cylinder, from those of the crank pin.

    The motion of the crank pin is in axes of the master's cylinder, as in :func:`hang`.
    """
    x, y, vx, vy, _, _, _, _, _, _, _ = knuckle_motion(
        x, y, vx, vy, 0.0, 0.0, joint[MASTER_LENGTH], joint[MASTER_OFFSET], joint[KNUCKLE_X], joint[KNUCKLE_Y]
    )
    cos = joint[COS_TURN]
    sin = joint[SIN_TURN]
    return cos * x + sin * y, cos * y - sin * x, cos * vx + sin * vy, cos * vy - sin * vx


@kernel
def force_on_pin(joint, pin, out):
    """Return the force on the crank pin in axes of the master's cylinder, N, from the rod force ``out`` and ``pin``.

    ``out`` is the result of rod_force. Returns both components, and (h·F)/s, the part of the first component that acts
    on the master's piston.
    """
    f_x = joint[COS_TURN] * out[0] - joint[SIN_TURN] * out[1]
    f_y = joint[SIN_TURN] * out[0] + joint[COS_TURN] * out[1]
    held = (pin[H_X] * f_x + pin[H_Y] * f_y) / pin[S]
    return f_x + held, f_y, held


@kernel
def force_change(joint, pin, out, dx, dy, dvx, dvy, dax, day):
    """Return the change of :func:`force_on_pin` by small changes of the pin's position, velocity and acceleration."""
    h_x = pin[H_X]
    h_y = pin[H_Y]
    s = pin[S]
    rate = pin[RATE]
    change = pin[CHANGE]
    cos = joint[COS_TURN]
    sin = joint[SIN_TURN]
    slope = (pin[X] - joint[MASTER_OFFSET]) / s
    r_x = h_y
    r_y = -h_x
    turned = dx / s
    d_rate = dvx / s + rate * slope * turned
    # φ̈ = ẍ/s + φ̇² X/s, with d(X/s) = (1 + X²/s²) dx/s and d(ẍ/s) = dẍ/s + (ẍ/s) (X/s) dx/s.
    straight = change - rate * rate * slope
    d_change = dax / s + straight * slope * turned
    d_change += 2.0 * rate * d_rate * slope + rate * rate * (1.0 + slope * slope) * turned
    k_x = dx + turned * h_x
    k_y = dy + turned * h_y
    v_x = dvx + d_rate * h_x - rate * turned * r_x
    v_y = dvy + d_rate * h_y - rate * turned * r_y
    along_h = d_change - rate * rate * turned
    along_r = change * turned + 2.0 * rate * d_rate
    a_x = dax + along_h * h_x - along_r * r_x
    a_y = day + along_h * h_y - along_r * r_y
    x = cos * k_x + sin * k_y
    v = cos * v_x + sin * v_y
    across = cos * a_x + sin * a_y
    along = cos * a_y - sin * a_x
    own_x = out[BY_X] * x + out[BY_VX] * v + out[BY_ACCELERATION] * across + out[BY_ACCELERATION + 1] * along
    own_y = out[BY_X + 1] * x + out[BY_VX + 1] * v
    own_y += out[BY_ACCELERATION + 2] * across + out[BY_ACCELERATION + 3] * along
    d_x = cos * own_x - sin * own_y
    d_y = sin * own_x + cos * own_y
    f_x = cos * out[0] - sin * out[1]
    f_y = sin * out[0] + cos * out[1]
    d_x += (h_x * d_x + h_y * d_y) / s
    d_x += turned / s * ((h_x * f_x + h_y * f_y) * slope - (r_x * f_x + r_y * f_y))
    return d_x, d_y
