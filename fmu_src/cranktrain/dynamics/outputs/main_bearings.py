"""Outputs of the main bearings and the thrust bearing.

Forces, moments, positions, velocities and angles are in axes at rest: x across the engine, y upwards, angles from x in
the crank's sense of rotation. A moment is the true vector about the bearing's middle, M = (−∫ z dF_y, ∫ z dF_x), on the
journal. Velocities and gaps are defined in :mod:`cranktrain.film.laws.gap_motion`. Films without tilt have no moment,
and their least gap is that of the journal's middle. In an elastic bore, film_thickness_min and gap.angle belong to the
deformed bore; gap.side and gap.rate are those of the rigid shell.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel, law_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import thrust_row, turning_modes
from cranktrain.dynamics.model.state import POSITION, offset
from cranktrain.dynamics.motion.film_memory import recalling_call
from cranktrain.dynamics.motion.film_ports import frame_numbers, place_law, tell_law
from cranktrain.dynamics.motion.linear_algebra import dot
from cranktrain.film.laws import films as on
from cranktrain.film.laws.films import film_call
from cranktrain.film.laws.gap_motion import (
    LEAST_ANGLE,
    LEAST_GAP,
    LEAST_RATE,
    LEAST_SIDE,
    SPEED_EFFECTIVE,
    SPEED_GAP,
    SPEED_RELATIVE,
    VELOCITY_EFFECTIVE,
    gap_motion,
)
from cranktrain.film.laws.parameters import CLEARANCE, RELIEF_DEPTH, RELIEF_EXPONENT, RELIEF_SHARE, WIDTH

FORCE_X, FORCE_Y, ECCENTRIC, FILM_MIN, PRESSURE_MAX, FRICTION_TORQUE, OIL_FLOW, TILT, MOMENT_X, MOMENT_Y = range(10)
POSITION_X, POSITION_Y, VELOCITY_X, VELOCITY_Y, EFFECTIVE_VELOCITY, RELATIVE_SPEED, GAP_SPEED = range(10, 17)
EFFECTIVE_SPEED, ANGLE_OF_GAP, SIDE_OF_GAP, RATE_OF_GAP, BEARING_OUTPUTS = range(17, 22)


@law_kernel
def observe_bearings(model, work, state, members, out):
    """Write load, film and motion of each main journal in its bore; all are 0 if journals are locked on their axis."""
    n = model.omega2.shape[0]
    t = turning_modes(model)
    b = model.bearings.shape[0]
    frame = work.frames[0]
    films = model.laws
    q = state[offset(POSITION, n) : offset(POSITION, n) + t]
    frame_numbers(frame, films.numbers)
    work.powers[at.MAINS_FRICTION] = 0.0
    work.powers[at.MAINS_SHEAR] = 0.0
    work.powers[at.MAINS_SQUEEZE] = 0.0
    for i in range(b):
        row = out[BEARING_OUTPUTS * i : BEARING_OUTPUTS * (i + 1)]
        connection = model.connections[i]
        place_law(model, i, work.port[at.RELATIVE], work.port[at.RELATIVE_RATE], frame[at.OMEGA])
        tell_law(model, frame, i, work.port[at.STATE_U], work.port[at.STATE_UD])
        speed = films.numbers[on.SPEED]
        recalling_call(model, state, on.OBSERVE, i, films.out)
        observe_film(films.out, model.bearings[i], connection[at.COUPLED], frame, row)
        work.powers[at.MAINS_FRICTION] += row[FRICTION_TORQUE] * speed
        bore = work.port[at.STATE_UD, int(connection[at.REACTS])] if connection[at.REACTS] >= 0.0 else 0.0
        work.powers[at.MAINS_SHEAR] += row[FRICTION_TORQUE] * (speed - bore)
        for k in range(int(connection[at.COUPLED])):
            work.powers[at.MAINS_SQUEEZE] -= films.out[k] * films.velocity[i, k]
        observe_gap(films.place[i], films.velocity[i], frame, model.bearings[i], speed, work.scratch, row)
        # The laws of elastic bores and of rollers give their own least gap.
        if films.out[on.GAP] >= 0.0:
            row[FILM_MIN] = films.out[on.GAP]
            row[ANGLE_OF_GAP] = math.atan2(math.sin(films.out[on.GAP_ANGLE]), math.cos(films.out[on.GAP_ANGLE]))
        tilt_x = dot(model.tilts[2 * i], q, t)
        tilt_y = dot(model.tilts[2 * i + 1], q, t)
        row[TILT] = math.sqrt(tilt_x * tilt_x + tilt_y * tilt_y)
    for k in range(BEARING_OUTPUTS * b, BEARING_OUTPUTS * members):
        out[k] = 0.0
    return 0


@inlined_kernel
def at_rest(vector, frame):
    """Components in axes at rest of a plane vector in axes of the frame."""
    cos, sin = frame[at.COS], frame[at.SIN]
    return cos * vector[on.X] - sin * vector[on.Y], sin * vector[on.X] + cos * vector[on.Y]


@kernel
def observe_film(film, law, coupled, frame, row):
    """Write force, film values and, if the journal's end is among the ``coupled`` ports, the moment of a film."""
    row[FORCE_X], row[FORCE_Y] = at_rest(film, frame)
    row[MOMENT_X] = 0.0
    row[MOMENT_Y] = 0.0
    if coupled > on.END_X:
        arm = 0.5 * law[WIDTH]
        end_x, end_y = at_rest(film[on.END_X :], frame)
        row[MOMENT_X] = -arm * end_y
        row[MOMENT_Y] = arm * end_x
    row[ECCENTRIC] = film[on.ECCENTRICITY]
    row[PRESSURE_MAX] = film[on.P_MAX]
    row[FRICTION_TORQUE] = -film[on.FRICTION]
    row[OIL_FLOW] = film[on.FLOW]


@kernel
def observe_gap(place, velocity, frame, law, speed, motion, row):
    """Write motion and gap of a journal in a round bore; ``place``, ``velocity`` (4,) are in axes of the frame."""
    x, y = at_rest(place, frame)
    end_x, end_y = at_rest(place[on.END_X :], frame)
    vx, vy = at_rest(velocity, frame)
    end_vx, end_vy = at_rest(velocity[on.END_X :], frame)
    gap_motion(
        x, y, end_x, end_y, vx, vy, end_vx, end_vy,
        (law[CLEARANCE], (law[RELIEF_DEPTH], law[RELIEF_SHARE], law[RELIEF_EXPONENT])), speed, 0.0, motion,
    )  # fmt: skip
    row[FILM_MIN] = max(motion[LEAST_GAP], 0.0)
    row[POSITION_X] = x
    row[POSITION_Y] = y
    row[VELOCITY_X] = vx
    row[VELOCITY_Y] = vy
    row[EFFECTIVE_VELOCITY] = motion[VELOCITY_EFFECTIVE]
    row[RELATIVE_SPEED] = motion[SPEED_RELATIVE]
    row[GAP_SPEED] = motion[SPEED_GAP]
    row[EFFECTIVE_SPEED] = motion[SPEED_EFFECTIVE]
    row[ANGLE_OF_GAP] = motion[LEAST_ANGLE]
    row[SIDE_OF_GAP] = motion[LEAST_SIDE]
    row[RATE_OF_GAP] = motion[LEAST_RATE]


@law_kernel
def observe_thrust(model, work, state, members, out):
    """Axial force on the collar, by the same call as in the equations of motion, and displacement of the collar.

    The displacement is relative to the thrust faces.
    """
    frame = work.frames[0]
    k = thrust_row(model)
    laws = model.laws
    frame_numbers(frame, laws.numbers)
    place_law(model, k, work.port[at.RELATIVE], work.port[at.RELATIVE_RATE], frame[at.WHIRL])
    tell_law(model, frame, k, work.port[at.STATE_U], work.port[at.STATE_UD])
    status = film_call(laws, on.FORCE, k, laws.out, laws.out)
    work.powers[at.THRUST_LOSS] = 0.0
    for r in range(model.connections[k, at.COUPLED]):
        work.powers[at.THRUST_LOSS] -= laws.out[r] * laws.velocity[k, r]
    out[0] = laws.out[0]
    out[1] = laws.place[k, 0]
    return status
