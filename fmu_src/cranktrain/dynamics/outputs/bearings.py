"""Outputs of main bearings, big ends and thrust bearing.

Forces, moments, positions, velocities and angles are in axes at rest: x across the engine, y upwards, angles from x in
the crank's sense of rotation. A moment is the true vector about the bearing's middle, M = (−∫ z dF_y, ∫ z dF_x), on the
journal. Velocities and gaps are defined in :mod:`cranktrain.film.laws.gap_motion`. Films without tilt have no moment,
and their least gap is that of the journal's middle. In an elastic bore, film_thickness_min and gap.angle belong to the
deformed bore; gap.side and gap.rate are those of the rigid shell.

Rods lie behind one another on a pin, each with a film of its own. Pin and bore both rotate, the bore with the swing of
the rod. A rigid big end has a load as well; its other outputs are 0. The load of a master rod's big end includes that
of the articulated rods on it. The load of an articulated rod is that of its knuckle pin.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel, law_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import thrust_row, turning_modes
from cranktrain.dynamics.model.state import POSITION, offset
from cranktrain.dynamics.motion.linear_algebra import dot
from cranktrain.dynamics.outputs.laws import observe_law
from cranktrain.dynamics.topology.slider_crank import KNUCKLE, ON_PIN
from cranktrain.film.laws import films as on
from cranktrain.film.laws import gap_motion as of_gap
from cranktrain.film.laws.gap_motion import gap_motion
from cranktrain.film.laws.parameters import CLEARANCE, RELIEF_DEPTH, RELIEF_EXPONENT, RELIEF_SHARE, WIDTH

FORCE_X, FORCE_Y, OF_MAIN, TILT, MOMENT_X, MOMENT_Y = 0, 1, 2, 7, 8, 9
POSITION_X, POSITION_Y, VELOCITY_X, VELOCITY_Y, EFFECTIVE_VELOCITY, RELATIVE_SPEED, GAP_SPEED = range(10, 17)
EFFECTIVE_SPEED, ANGLE_OF_GAP, SIDE_OF_GAP, RATE_OF_GAP, BEARING_OUTPUTS = range(17, 22)
PIN_X, PIN_Y, OF_BIG_END, BIG_END_OUTPUTS = 2, 3, 4, 9
# Figures of a film, from OF_MAIN or OF_BIG_END on.
ECCENTRIC, FILM_MIN, PRESSURE_MAX, FRICTION_TORQUE, OIL_FLOW = range(5)


@law_kernel
def observe_bearings(model, work, state, members, out):
    """Write load, film and motion of each main journal in its bore; all are 0 if journals are locked on their axis."""
    q = state[offset(POSITION, model.omega2.shape[0]) :]
    t = turning_modes(model)
    frame = work.frames[0]
    for k in range(BEARING_OUTPUTS * members):
        out[k] = 0.0
    for i in range(model.bearings.shape[0]):
        observe_law(model, work, state, i)
        row = out[BEARING_OUTPUTS * i : BEARING_OUTPUTS * (i + 1)]
        found = work.found[i]
        law = model.bearings[i]
        row[FORCE_X], row[FORCE_Y] = at_rest(found, frame[at.COS], frame[at.SIN])
        if model.connections[i, at.COUPLED] > on.END_X:
            end_x, end_y = at_rest(found[on.END_X :], frame[at.COS], frame[at.SIN])
            row[MOMENT_X] = -0.5 * law[WIDTH] * end_y
            row[MOMENT_Y] = 0.5 * law[WIDTH] * end_x
        speed = frame[at.OMEGA] + work.port[at.UD, model.connections[i, at.SPIN]]
        least = observe_gap(model.laws.place[i], model.laws.velocity[i], frame, law, speed, work.scratch, row)
        show_film(found, least, row[OF_MAIN:])
        if found[on.GAP] >= 0.0:
            row[ANGLE_OF_GAP] = math.atan2(math.sin(found[on.GAP_ANGLE]), math.cos(found[on.GAP_ANGLE]))
        tilt_x = dot(model.tilts[2 * i], q, t)
        tilt_y = dot(model.tilts[2 * i + 1], q, t)
        row[TILT] = math.sqrt(tilt_x * tilt_x + tilt_y * tilt_y)
    return 0


@kernel
def show_film(found, least, figures):
    """Write the ``figures`` of a film, whose ``least`` gap in a round bore is given (m), negative in contact."""
    figures[ECCENTRIC] = found[on.ECCENTRICITY]
    # The laws of elastic bores and of rollers give their own least gap.
    figures[FILM_MIN] = found[on.GAP] if found[on.GAP] >= 0.0 else max(least, 0.0)
    figures[PRESSURE_MAX] = found[on.P_MAX]
    figures[FRICTION_TORQUE] = -found[on.FRICTION]
    figures[OIL_FLOW] = found[on.FLOW]


@inlined_kernel
def at_rest(vector, cos, sin):
    """Rotate a plane vector by the angle whose cosine and sine are given."""
    return cos * vector[on.X] - sin * vector[on.Y], sin * vector[on.X] + cos * vector[on.Y]


@kernel
def observe_gap(place, velocity, frame, law, speed, motion, row):
    """Write motion and gap of a journal in a round bore; ``place``, ``velocity`` (4,) are in axes of the frame.

    Returns the least gap, m.
    """
    cos, sin = frame[at.COS], frame[at.SIN]
    x, y = at_rest(place, cos, sin)
    end_x, end_y = at_rest(place[on.END_X :], cos, sin)
    vx, vy = at_rest(velocity, cos, sin)
    end_vx, end_vy = at_rest(velocity[on.END_X :], cos, sin)
    gap_motion(
        x, y, end_x, end_y, vx, vy, end_vx, end_vy,
        (law[CLEARANCE], (law[RELIEF_DEPTH], law[RELIEF_SHARE], law[RELIEF_EXPONENT])), speed, 0.0, motion,
    )  # fmt: skip
    row[POSITION_X] = x
    row[POSITION_Y] = y
    row[VELOCITY_X] = vx
    row[VELOCITY_Y] = vy
    row[EFFECTIVE_VELOCITY] = motion[of_gap.VELOCITY_EFFECTIVE]
    row[RELATIVE_SPEED] = motion[of_gap.SPEED_RELATIVE]
    row[GAP_SPEED] = motion[of_gap.SPEED_GAP]
    row[EFFECTIVE_SPEED] = motion[of_gap.SPEED_EFFECTIVE]
    row[ANGLE_OF_GAP] = motion[of_gap.LEAST_ANGLE]
    row[SIDE_OF_GAP] = motion[of_gap.LEAST_SIDE]
    row[RATE_OF_GAP] = motion[of_gap.LEAST_RATE]
    return motion[of_gap.LEAST_GAP]


@law_kernel
def observe_big_ends(model, work, state, members, out):
    """Force on each pin, position of the pin in the bore, and film values, for all big ends."""
    cos, sin = work.frames[0, at.COS], work.frames[0, at.SIN]
    for c in range(members):
        row = out[BIG_END_OUTPUTS * c : BIG_END_OUTPUTS * (c + 1)]
        for i in range(BIG_END_OUTPUTS):
            row[i] = 0.0
        rod = model.cylinders[c]
        # The film of a floating big end, or the rod on its pin.
        k = int(rod[at.PIN_ROW])
        observe_law(model, work, state, k)
        found = work.found[k]
        if rod[at.END_PORT] >= 0.0:
            row[FORCE_X], row[FORCE_Y] = at_rest(found, cos, sin)
            row[PIN_X], row[PIN_Y] = at_rest(model.laws.place[k], cos, sin)
            show_film(found, model.big_ends[c, CLEARANCE] * (1.0 - found[on.ECCENTRICITY]), row[OF_BIG_END:])
            continue
        row[FORCE_X], row[FORCE_Y] = at_rest(found[KNUCKLE:], rod[at.COS_BANK], rod[at.SIN_BANK])
        master = int(rod[at.MASTER])
        if master >= 0:  # a master rod has a lower number than its articulated rods
            x, y = at_rest(found[ON_PIN:], cos, sin)
            out[BIG_END_OUTPUTS * master + FORCE_X] += x
            out[BIG_END_OUTPUTS * master + FORCE_Y] += y
    return 0


@law_kernel
def observe_thrust(model, work, state, members, out):
    """Axial force on the collar, and displacement of the collar relative to the thrust faces."""
    k = thrust_row(model)
    observe_law(model, work, state, k)
    out[0] = work.found[k, 0]
    out[1] = model.laws.place[k, 0]
    return 0
