"""Law ``roller``: cylindrical roller bearings between the journals and their seats.

Each bearing follows its rollers (:mod:`cranktrain.film.laws.roller_contacts`) or a linear stand-in, F = −k (x, y) and M
= −k_t times the slopes. In addition, isotropic viscous damping acts on the motion in space, with or without load. The
end of a journal, where its displacement by tilt is measured and Q acts, is half a roller's length from its middle, so Q
= M/(l/2).

Rollers are at rest with the first one directly below the journal, or rotate with the cage: ψ_0 = −π/2 + γθ with the
angle θ of the frame, including whole turns, and the ratio of pure rolling γ = ½(1 − D/d_m). Moving rollers excite
vibration at their passing frequency.

The output ``eccentricity`` is relative to the clearance column of :func:`roller_parameters`, the pressure is the Hertz
pressure at the inner ring, and the least gap is the gap between the journal and its nearest roller. Friction and flow
are zero.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cranktrain.core.kernel import kernel, law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.engine.parts import RollerBearings
from cranktrain.engine.roller_bearing import main_roller
from cranktrain.film.laws.films import (
    ANGLE,
    BY_PLACE,
    BY_VELOCITY,
    COS,
    ECCENTRICITY,
    FLOW,
    FRICTION,
    GAP,
    GAP_ANGLE,
    OBSERVE,
    P_MAX,
    PASSES,
    SIN,
)
from cranktrain.film.laws.parameters import (
    C_X,
    C_Y,
    CLEARANCE,
    COLUMNS,
    CONTACT_HEIGHT,
    K_X,
    K_Y,
    RADIUS,
    WIDTH,
)
from cranktrain.film.laws.roller_contacts import (
    APPROACH,
    COUNT,
    LOADED,
    N_CONSTANTS,
    N_OUT,
    PRESSURE,
    WHERE,
    WORK,
    roller_constants,
    roller_force,
    roller_slices,
)

if TYPE_CHECKING:
    from cranktrain.film.laws.bearings import Bearings

IN_LOOP = 12
"""Number of slices along a roller in a running model."""
FIRST_ANGLE = -0.5 * math.pi
"""Angle (rad) of the first roller at rest: straight down, the direction of gas load on the journals."""

# Columns of RollerSeats.laws after the constants of the rollers. A linear stand-in has no rollers:
# STIFFNESS, TILT_STIFFNESS: radial stiffness and tilt stiffness (N/m), zero for a bearing with rollers.
# DAMPING, TILT_DAMPING: radial damping and tilt damping (N s/m). Tilt is the displacement of the journal's end.
# CAGE: cage speed over shaft speed, γ, or 0 if rollers are at rest.
# SCALE, FIRST: scale of the eccentricity (m), angle of the first roller (rad).
STIFFNESS, TILT_STIFFNESS, DAMPING, TILT_DAMPING, CAGE, SCALE, FIRST, N_LAW = range(N_CONSTANTS, N_CONSTANTS + 8)


class RollerSeats(NamedTuple):
    """Data of the roller bearings of b journals."""

    laws: Array  # (b, N_LAW) constants of each bearing, see STIFFNESS
    slices: Array  # (b, 3, IN_LOOP) slices of a roller, see roller_contacts.roller_slices
    result: Array  # (N_OUT,) scratch


def roller_seats(bearings: Bearings) -> RollerSeats:
    """Make the bearings of all main journals as given in the engine file."""
    return seats(bearings.rollers)


def linear_seats(bearings: Bearings) -> RollerSeats:
    """Make the linear stand-ins of all main bearings."""
    return seats(replace(bearings.rollers, law="linear"))


def seats(rollers: RollerBearings, first: float = FIRST_ANGLE) -> RollerSeats:
    """Make the bearings of all mains, first roller at angle ``first`` (rad); ``InputError`` for invalid data."""
    rows, slices = [], []
    linear = rollers.law == "linear"
    for i, length in enumerate(rollers.roller_length):
        bearing = main_roller(rollers, i)
        lever = (0.5 * length) ** 2
        rows.append(
            [
                0 if linear else bearing.rollers,
                *roller_constants(bearing)[1:],
                rollers.stiffness[i] if linear else 0.0,
                rollers.tilt_stiffness[i] / lever if linear else 0.0,
                rollers.damping[i],
                rollers.tilt_damping[i] / lever,
                bearing.cage_ratio if rollers.variable else 0.0,
                0.5 * bearing.clearance + bearing.travel,
                first,
            ]
        )
        slices.append(roller_slices(bearing, IN_LOOP))
    return RollerSeats(np.array(rows, dtype=np.float64), np.array(slices), np.zeros(N_OUT))


def roller_parameters(rollers: RollerBearings) -> Array:
    """Return the general bearing parameters of the mains, (b, COLUMNS), see :mod:`cranktrain.film.laws.parameters`.

    The clearance is the displacement at which the rollers reach their static rating: half the diametral clearance plus
    the elastic travel. Radius is that of the inner track, width the length of the rollers.
    """
    parameters = np.zeros((len(rollers.rollers), COLUMNS))
    for i, row in enumerate(parameters):
        bearing = main_roller(rollers, i)
        row[CLEARANCE] = 0.5 * bearing.clearance + bearing.travel
        # Rollers carry more than their rating below this gap (clearance less displacement), whose rate limits the step.
        row[CONTACT_HEIGHT] = bearing.travel
        row[K_X] = row[K_Y] = rollers.stiffness[i]
        row[C_X] = row[C_Y] = rollers.damping[i]
        row[RADIUS] = 0.5 * (bearing.pitch - bearing.diameter)
        row[WIDTH] = bearing.length
    return parameters


# Kernels --------------------------------------------------------------------------------------------------------------

_read = record_reader(RollerSeats(np.zeros((1, 1)), np.zeros((1, 1, 1)), np.zeros(1)))


@law_kernel
def roller_law(record, action, i, place, velocity, numbers, memory, out):
    """Kernel of roller bearings or their linear stand-in, with damping; see :mod:`cranktrain.film.laws.films`."""
    seats = _read(record)
    law = seats.laws[i]
    # Direction of the first roller in space, then in the frame's axes.
    angle = law[FIRST] + law[CAGE] * numbers[ANGLE]
    space_cos = math.cos(angle)
    space_sin = math.sin(angle)
    cos = numbers[COS]
    sin = numbers[SIN]
    result = seats.result
    first_cos, first_sin = space_cos * cos + space_sin * sin, space_sin * cos - space_cos * sin
    roller_force(place, first_cos, first_sin, law, seats.slices[i], result)
    for k in range(WORK):
        out[k] = result[k]
        if k < 16:
            out[BY_VELOCITY + k] = 0.0
    for k in range(4):
        damping = law[DAMPING] if k < 2 else law[TILT_DAMPING]
        out[k] -= damping * velocity[k]
        out[BY_VELOCITY + 5 * k] = -damping
        stiffness = law[STIFFNESS] if k < 2 else law[TILT_STIFFNESS]
        out[k] -= stiffness * place[k]
        out[BY_PLACE + 5 * k] -= stiffness
    out[FRICTION] = 0.0
    out[PASSES] = 0.0
    if action == OBSERVE:
        _figures(law, result, place, angle, cos, sin, out)
    return 0


@kernel
def _figures(law, result, place, first_angle, cos, sin, out):
    """Write eccentricity, pressure, least gap and its angle to ``out``."""
    out[ECCENTRICITY] = math.sqrt(place[0] * place[0] + place[1] * place[1]) / law[SCALE]
    out[P_MAX] = result[PRESSURE]
    out[FLOW] = 0.0
    if law[COUNT] == 0.0:
        out[GAP] = 0.0
        out[GAP_ANGLE] = math.atan2(sin * place[0] + cos * place[1], cos * place[0] - sin * place[1])
        return
    out[GAP] = 0.0 if result[LOADED] > 0.0 else max(-result[APPROACH], 0.0)
    out[GAP_ANGLE] = first_angle + 2.0 * math.pi * result[WHERE] / law[COUNT]
