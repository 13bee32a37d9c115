"""Plane films behind the integer in a bearing's data."""

from __future__ import annotations

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.kernel import kernel
from cranktrain.engine.parts import JournalBearing, PlainBearing
from cranktrain.film.laws.impedance import journal_force
from cranktrain.film.laws.parabolic import film_geometry
from cranktrain.film.laws.parameters import (
    C_X,
    C_Y,
    CLEARANCE,
    CONTACT_HEIGHT,
    CONTACT_LOAD,
    FACTOR,
    K_X,
    K_Y,
    LAW,
)

LINEAR, IMPEDANCE, TABLE, REYNOLDS, EHD, ROLLER = range(6)
CODES = {"linear": LINEAR, "impedance": IMPEDANCE, "table": TABLE, "reynolds": REYNOLDS, "ehd": EHD, "roller": ROLLER}


def bearing_parameters(bearing: PlainBearing, viscosity: float, level: str) -> np.ndarray:
    """Pack one bearing for the kernels, (13,); ``InputError`` for a level that does not exist."""
    if level not in CODES:
        raise InputError(f"bearing level '{level}' does not exist; {nearest(level, CODES)}")
    c, kappa2, factor = film_geometry(bearing.diameter, bearing.width, bearing.clearance, viscosity)
    load = 0.5 * bearing.contact_pressure * bearing.width * bearing.diameter
    linear = [0.0] * 4
    if isinstance(bearing, JournalBearing):
        linear = [bearing.stiffness_x, bearing.stiffness_y, bearing.damping_x, bearing.damping_y]
    return np.array(
        [
            CODES[level],
            c,
            kappa2,
            factor,
            bearing.contact_height,
            load,
            *linear,
            0.5 * bearing.diameter,
            bearing.width,
            viscosity,
        ]
    )


@kernel
def bearing_force(parameters, x, y, vx, vy, half_speed, cos_frame, sin_frame, table, out):
    """Force on the journal in axes turned by the frame's angle.

    (vx, vy) is its velocity against the bore in these axes, ``table`` its impedance map. ``out[0:2]`` force
    (N), ``out[2:6]`` ∂F/∂(x, y), ``out[6:10]`` ∂F/∂(vx, vy), row-major, ``out[10]`` eccentricity.
    """
    if parameters[LAW] == IMPEDANCE:
        # A plain bore looks the same from every side: no turning needed.
        journal_force(
            x, y, vx, vy, half_speed, parameters[CLEARANCE], parameters[FACTOR],
            parameters[CONTACT_HEIGHT], parameters[CONTACT_LOAD], table, out,
        )  # fmt: skip
        return
    # Springs and dampers stand still: k = Rᵀ diag(k_x, k_y) R, likewise the damping.
    cc = cos_frame * cos_frame
    ss = sin_frame * sin_frame
    cs = cos_frame * sin_frame
    k_xx = cc * parameters[K_X] + ss * parameters[K_Y]
    k_xy = cs * (parameters[K_Y] - parameters[K_X])
    k_yy = ss * parameters[K_X] + cc * parameters[K_Y]
    c_xx = cc * parameters[C_X] + ss * parameters[C_Y]
    c_xy = cs * (parameters[C_Y] - parameters[C_X])
    c_yy = ss * parameters[C_X] + cc * parameters[C_Y]
    out[0] = -k_xx * x - k_xy * y - c_xx * vx - c_xy * vy
    out[1] = -k_xy * x - k_yy * y - c_xy * vx - c_yy * vy
    out[2] = -k_xx
    out[3] = -k_xy
    out[4] = -k_xy
    out[5] = -k_yy
    out[6] = -c_xx
    out[7] = -c_xy
    out[8] = -c_xy
    out[9] = -c_yy
    out[10] = (x * x + y * y) ** 0.5 / parameters[CLEARANCE]
