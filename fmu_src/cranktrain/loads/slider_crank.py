"""Force of a rigid connecting rod and its piston on the crank pin.

In axes whose y is the cylinder's, with the pin at (x, y), s = √(L² − x²) and g = −x/s, the piston pin sits at y + s and
accelerates with a_P = g a_x + a_y − v_x² L²/s³. The rod is split into m_b at the big end, its small end with the piston
m_o, and the remainder ΔJ = J_r − m_r b (L − b) about the rod angle. The force on the pin is

    f = −m_b a − [g, 1] (m_o a_P + p A) − ΔJ (a_x/s² + x v_x²/s⁴) e_x

with p the gauge pressure. A piston-pin offset e replaces x by x − e. Gravity adds to a and a_P as an acceleration.
Nothing is linearised; the tangents are exact. Source: Lagrange's equations of the slider-crank with a free pin.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.lanes import put_four
from cranktrain.engine.parts import Rod

# Indices of the result of rod_force: force (2), derivatives by x, v_x and acceleration, motion of the piston pin.
BY_X, BY_VX, BY_ACCELERATION, PISTON, PISTON_VELOCITY, PISTON_ACCELERATION = 2, 4, 6, 10, 11, 12
ROW = 4
"""Values in a row of a connection's tangents."""


def remainder_inertia(rod: Rod) -> float:
    """Return ΔJ = J_r − m_r b (L − b), kg m²; b = L m_small/m_r is the distance from big end to centre of mass."""
    mass = rod.big_end_mass + rod.small_end_mass
    b = rod.length * rod.small_end_mass / mass
    return rod.inertia - mass * b * (rod.length - b)


@kernel
def rod_force(x, y, vx, vy, ax, ay, gas, length, m_b, m_o, delta_j, offset, gravity_x, gravity_y, out):
    """Compute the force on the pin in cylinder axes, with tangents, and the motion of the piston.

    ``gas`` is gauge pressure times piston area (N); gravity_x and gravity_y are the components of the upward
    acceleration that replaces gravity. ``out`` (13,): force; from BY_X on ∂f/∂x, from BY_VX on ∂f/∂v_x, from
    BY_ACCELERATION on ∂f/∂a row-major; from PISTON on position, velocity and acceleration of the piston pin along the
    cylinder axis.
    """
    x = x - offset
    s = math.sqrt(length * length - x * x)
    per_s = 1.0 / s  # the only division
    per_s2 = per_s * per_s
    per_s4 = per_s2 * per_s2
    g = -x * per_s
    l2s3 = length * length * per_s2 * per_s
    vx2 = vx * vx
    a_p = g * ax + ay - vx2 * l2s3
    axial = m_o * (a_p + gravity_y) + gas
    remainder = delta_j * (ax * per_s2 + x * vx2 * per_s4)
    out[0] = -m_b * (ax + gravity_x) - g * axial - remainder
    out[1] = -m_b * (ay + gravity_y) - axial
    slope = -l2s3 * ax + 3.0 * vx2 * length * length * g * per_s4
    out[BY_X] = (
        l2s3 * axial
        - g * m_o * slope
        - delta_j * (-2.0 * g * ax * per_s2 * per_s + vx2 * per_s4 - 4.0 * x * vx2 * g * per_s4 * per_s)
    )
    out[BY_X + 1] = -m_o * slope
    rate = -2.0 * vx * l2s3
    out[BY_VX] = -g * m_o * rate - delta_j * 2.0 * x * vx * per_s4
    out[BY_VX + 1] = -m_o * rate
    put_four(out, BY_ACCELERATION, (-m_b - m_o * g * g - delta_j * per_s2, -m_o * g, -m_o * g, -m_b - m_o))
    out[PISTON] = y + s
    out[PISTON_VELOCITY] = vy + g * vx
    out[PISTON_ACCELERATION] = a_p


@inlined_kernel
def pin_tangent(found, ratio, inertance, whirl, change, cos, sin, block):
    """Tangent of a rod's force by the displacement of its pin in a stage, in axes that turn, rows of four in ``block``.

    ``found`` is the result of rod_force, ``ratio`` ∂u̇/∂u (1/s) and ``inertance`` ∂ü/∂u (1/s²) of the stage's rule,
    ``whirl`` the speed of the axes (rad/s) and ``change`` its rate, ``cos`` and ``sin`` those of their angle to the
    cylinder.
    """
    alpha = inertance - whirl * whirl
    beta = 2.0 * whirl * ratio + change
    x = BY_X
    v = BY_VX
    a = BY_ACCELERATION
    t_xx = found[x] + found[v] * ratio + found[a] * alpha + found[a + 1] * beta
    t_xy = -found[v] * whirl + found[a + 1] * alpha - found[a] * beta
    t_yx = found[x + 1] + found[v + 1] * ratio + found[a + 2] * alpha + found[a + 3] * beta
    t_yy = -found[v + 1] * whirl + found[a + 3] * alpha - found[a + 2] * beta
    turn_back(t_xx, t_xy, t_yx, t_yy, cos, sin, block)


@inlined_kernel
def turn_back(t_xx, t_xy, t_yx, t_yy, cos, sin, block):
    """Rotate a tangent T from a cylinder's axes into those that turn, Rᵀ T R, rows of four in ``block``."""
    block[0] = cos * cos * t_xx + cos * sin * (t_xy + t_yx) + sin * sin * t_yy
    block[1] = cos * cos * t_xy + cos * sin * (t_yy - t_xx) - sin * sin * t_yx
    block[ROW] = cos * cos * t_yx + cos * sin * (t_yy - t_xx) - sin * sin * t_xy
    block[ROW + 1] = cos * cos * t_yy - cos * sin * (t_xy + t_yx) + sin * sin * t_xx
