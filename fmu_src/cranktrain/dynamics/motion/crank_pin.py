"""Exact motion of a crank pin, and axes of the cylinder whose rod it carries.

With φ the rotation of the pin relative to its frame and X its undeformed position, a pin is at R(φ) X + u − φ e_z×X;
its displacement u holds φ e_z×X, the rotation in the first order.
"""

import math

from cranktrain.core.kernel import inlined_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.film.laws import films as on

SMALL = 0.1
"""Rotation (rad) below which the series of :func:`turn` are exact to rounding."""


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
def tell_twist(phi, rate, change, numbers):
    """Write the rotation (rad) of a first end in its frame and its derivatives to the ``numbers`` of a law."""
    numbers[on.TWIST] = phi
    numbers[on.TWIST_RATE] = rate
    numbers[on.TWIST_CHANGE] = change
    numbers[on.TWIST_COS], numbers[on.TWIST_SIN] = turn(phi)


@inlined_kernel
def pin_place(pin, x, y, numbers):
    """Position in the frame of a ``pin`` (2,) that is displaced by x and y (m), with its rotation in ``numbers``."""
    cos, sin, phi = numbers[on.TWIST_COS], numbers[on.TWIST_SIN], numbers[on.TWIST]
    return cos * pin[0] - sin * pin[1] + x + phi * pin[1], sin * pin[0] + cos * pin[1] + y - phi * pin[0]


@inlined_kernel
def in_space(x, y, vx, vy, whirl, place, velocity):
    """Write a displacement in axes that turn at ``whirl`` (rad/s) to ``place``, its rate in space to ``velocity``."""
    place[0] = x
    place[1] = y
    velocity[0] = vx - whirl * y
    velocity[1] = vy + whirl * x


@inlined_kernel
def accelerate(vx, vy, ax, ay, place, numbers):
    """Write the acceleration in space of a displacement ``place`` in axes that turn to ``numbers``."""
    whirl = numbers[on.WHIRL]
    change = numbers[on.WHIRL_CHANGE]
    numbers[on.ACCELERATION] = ax - 2.0 * whirl * vy - change * place[1] - whirl * whirl * place[0]
    numbers[on.ACCELERATION + 1] = ay + 2.0 * whirl * vx + change * place[0] - whirl * whirl * place[1]


@inlined_kernel
def pin_motion(pin, place, velocity, numbers):
    """Absolute position, velocity and acceleration of a ``pin`` (2,) along the axes of its frame.

    ``place`` is its displacement, ``velocity`` the displacement's rate in space; rotation and accelerations are in the
    ``numbers`` of a law with masses. The last two results are what rotation adds to the displacement of the pin beyond
    the first order.
    """
    whirl = numbers[on.WHIRL]
    change = numbers[on.WHIRL_CHANGE]
    rate = numbers[on.TWIST_RATE]
    x0 = pin[0]
    y0 = pin[1]
    # First and second derivative of what rotation adds, in the frame's axes; both are 0 for a pin without rotation.
    more_x = 0.0
    more_y = 0.0
    more_vx = 0.0
    more_vy = 0.0
    more_ax = 0.0
    more_ay = 0.0
    if numbers[on.TWIST] != 0.0 or rate != 0.0:
        turned_x = numbers[on.TWIST_COS] * x0 - numbers[on.TWIST_SIN] * y0
        turned_y = numbers[on.TWIST_SIN] * x0 + numbers[on.TWIST_COS] * y0
        more_x = turned_x - x0 + numbers[on.TWIST] * y0
        more_y = turned_y - y0 - numbers[on.TWIST] * x0
        more_vx = -rate * (turned_y - y0)
        more_vy = rate * (turned_x - x0)
        more_ax = -numbers[on.TWIST_CHANGE] * (turned_y - y0) - rate * rate * turned_x
        more_ay = numbers[on.TWIST_CHANGE] * (turned_x - x0) - rate * rate * turned_y
    x0 += more_x
    y0 += more_y
    vx = velocity[0] + more_vx - whirl * y0
    vy = velocity[1] + more_vy + whirl * x0
    ax = numbers[on.ACCELERATION] + more_ax - 2.0 * whirl * more_vy - change * y0 - whirl * whirl * x0
    ay = numbers[on.ACCELERATION + 1] + more_ay + 2.0 * whirl * more_vx + change * x0 - whirl * whirl * y0
    return x0 + place[0], y0 + place[1], vx, vy, ax, ay, more_x, more_y


@inlined_kernel
def cylinder_axes(rod, cos, sin):
    """Cosine and sine of the frame's angle relative to a rod's cylinder, from those of the frame's angle."""
    return cos * rod[at.COS_BANK] + sin * rod[at.SIN_BANK], sin * rod[at.COS_BANK] - cos * rod[at.SIN_BANK]
