"""Outputs of the big ends: load of each crank pin and, for floating big ends, the film.

Rods lie behind one another on a pin, each with a film of its own. Pin and bore both rotate, the bore with the swing of
the rod. Vectors are in axes at rest: x across the engine, y upwards. A rigid big end has a load as well; its other
outputs are 0. The load of a master rod's big end includes that of the articulated rods on it. The load of an
articulated rod is that of its knuckle pin.
"""

from cranktrain.core.kernel import kernel, law_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.film_memory import recalling_call
from cranktrain.dynamics.motion.film_ports import frame_again, frame_numbers, place_eye
from cranktrain.dynamics.motion.masses import observe_rod
from cranktrain.dynamics.topology.slider_crank import KNUCKLE, ON_PIN
from cranktrain.film.laws import films as on
from cranktrain.film.laws.parameters import CLEARANCE

FORCE_X, FORCE_Y, POSITION_X, POSITION_Y, ECCENTRIC, FILM_MIN, PRESSURE_MAX, FRICTION_TORQUE, OIL_FLOW = range(9)
BIG_END_OUTPUTS = 9


@law_kernel
def observe_big_ends(model, work, state, members, out):
    """Force on each pin, position of the pin in the bore, and film values, for all big ends."""
    work.powers[at.BIG_ENDS_FRICTION] = 0.0
    work.powers[at.BIG_ENDS_SHEAR] = 0.0
    work.powers[at.BIG_ENDS_SQUEEZE] = 0.0
    for c in range(members):
        row = out[BIG_END_OUTPUTS * c : BIG_END_OUTPUTS * (c + 1)]
        for i in range(BIG_END_OUTPUTS):
            row[i] = 0.0
        if model.cylinders[c, at.END_PORT] >= 0.0:
            observe_floating(model, work, state, c, row)
        else:
            rod = model.cylinders[c]
            observe_rod(model, work, c)
            to_space(work.rods[c, KNUCKLE:], rod[at.COS_BANK], rod[at.SIN_BANK], row[FORCE_X:])
            master = int(rod[at.MASTER])
            if master >= 0:  # a master rod has a lower number than its articulated rods
                share = model.laws.out
                to_space(work.rods[c, ON_PIN:], work.frames[0, at.COS], work.frames[0, at.SIN], share)
                out[BIG_END_OUTPUTS * master + FORCE_X] += share[on.X]
                out[BIG_END_OUTPUTS * master + FORCE_Y] += share[on.Y]
    return 0


@kernel
def observe_floating(model, work, state, c, row):
    """Outputs of the floating big end of cylinder c."""
    frame = work.frames[0]
    u = work.port[at.STATE_U]
    ud = work.port[at.STATE_UD]
    film = int(model.cylinders[c, at.PIN_ROW])
    pin_speed = frame[at.OMEGA] + ud[int(model.cylinders[c, at.PIN_TURN])]
    frame_numbers(frame, model.laws.numbers)
    rod_speed = place_eye(model, film, u, ud, frame[at.OMEGA], pin_speed)
    recalling_call(model, state, on.OBSERVE, film, model.laws.out)
    frame_again(model.laws.numbers, frame[at.COS], frame[at.SIN])
    found, place, velocity = model.laws.out, model.laws.place[film], model.laws.velocity[film]
    to_space(found, frame[at.COS], frame[at.SIN], row[FORCE_X:])
    to_space(place, frame[at.COS], frame[at.SIN], row[POSITION_X:])
    row[ECCENTRIC] = found[on.ECCENTRICITY]
    row[FILM_MIN] = max(model.big_ends[c, CLEARANCE] * (1.0 - found[on.ECCENTRICITY]), 0.0)
    # The law of an elastic bore gives its own least gap.
    if found[on.GAP] >= 0.0:
        row[FILM_MIN] = found[on.GAP]
    row[PRESSURE_MAX] = found[on.P_MAX]
    row[FRICTION_TORQUE] = -found[on.FRICTION]
    work.powers[at.BIG_ENDS_FRICTION] += row[FRICTION_TORQUE] * (pin_speed - rod_speed)
    work.powers[at.BIG_ENDS_SHEAR] += row[FRICTION_TORQUE] * (pin_speed - rod_speed)
    # The film's force on the rod acts at the displaced pin.
    work.powers[at.BIG_ENDS_SQUEEZE] -= found[on.X] * (velocity[on.X] + rod_speed * place[on.Y])
    work.powers[at.BIG_ENDS_SQUEEZE] -= found[on.Y] * (velocity[on.Y] - rod_speed * place[on.X])
    row[OIL_FLOW] = found[on.FLOW]


@kernel
def to_space(vector, cos, sin, out):
    """Rotate a plane vector by the angle whose cosine and sine are given, into ``out[0:2]``."""
    x = vector[on.X]
    out[on.X] = cos * x - sin * vector[on.Y]
    out[on.Y] = sin * x + cos * vector[on.Y]
