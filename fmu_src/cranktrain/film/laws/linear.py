"""Law ``linear``: bearings as springs and dampers fixed in space, F = −(k_x x + c_x ẋ, k_y y + c_y ẏ)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cranktrain.core.kernel import law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.film.laws.films import (
    BY_PLACE,
    BY_VELOCITY,
    COS,
    ECCENTRICITY,
    FLOW,
    FRICTION,
    GAP,
    P_MAX,
    SIN,
)
from cranktrain.film.laws.parameters import C_X, C_Y, CLEARANCE, K_X, K_Y

if TYPE_CHECKING:
    from cranktrain.film.laws.bearings import Bearings


class LinearBearings(NamedTuple):
    """Data of b linear bearings."""

    parameters: Array  # (b, COLUMNS) see film.laws.parameters


def linear_bearings(bearings: Bearings) -> LinearBearings:
    """Make linear bearings from the springs and dampers of the engine file."""
    return LinearBearings(bearings.parameters)


_read = record_reader(LinearBearings(np.zeros((1, 1))))


@law_kernel
def linear_law(record, action, i, place, velocity, numbers, memory, out):
    """Kernel of springs and dampers, without friction, pressure or flow; see :mod:`cranktrain.film.laws.films`."""
    own = _read(record).parameters[i]
    x = place[0]
    y = place[1]
    vx = velocity[0]
    vy = velocity[1]
    # In the frame's axes stiffness is Rᵀ diag(k_x, k_y) R, and damping is Rᵀ diag(c_x, c_y) R.
    cc = numbers[COS] * numbers[COS]
    ss = numbers[SIN] * numbers[SIN]
    cs = numbers[COS] * numbers[SIN]
    k_xx = cc * own[K_X] + ss * own[K_Y]
    k_xy = cs * (own[K_Y] - own[K_X])
    k_yy = ss * own[K_X] + cc * own[K_Y]
    c_xx = cc * own[C_X] + ss * own[C_Y]
    c_xy = cs * (own[C_Y] - own[C_X])
    c_yy = ss * own[C_X] + cc * own[C_Y]
    for k in range(ECCENTRICITY):
        out[k] = 0.0
    out[0] = -k_xx * x - k_xy * y - c_xx * vx - c_xy * vy
    out[1] = -k_xy * x - k_yy * y - c_xy * vx - c_yy * vy
    out[BY_PLACE] = -k_xx
    out[BY_PLACE + 1] = -k_xy
    out[BY_PLACE + 4] = -k_xy
    out[BY_PLACE + 5] = -k_yy
    out[BY_VELOCITY] = -c_xx
    out[BY_VELOCITY + 1] = -c_xy
    out[BY_VELOCITY + 4] = -c_xy
    out[BY_VELOCITY + 5] = -c_yy
    out[ECCENTRICITY] = math.sqrt(x * x + y * y) / own[CLEARANCE]
    out[FRICTION] = -0.0  # the output is the braking torque −FRICTION, which then shows as 0 and not as −0
    out[P_MAX] = 0.0
    out[FLOW] = 0.0
    out[GAP] = -1.0
    return 0
