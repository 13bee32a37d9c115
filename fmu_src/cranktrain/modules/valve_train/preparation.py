"""Preparation of a model from a run's numbers: its numbers, cams, noses and choices, after a check.

A spring is a uniform bar between the head and the retainer, u(s) = s x + Σ q_n sin nπs. With the valve at rest its
modes have frequencies n/2 √(k/m) and masses m/2; the coupling mass m (−1)ⁿ⁺¹/(nπ) couples them to the valve.

Source: J. P. Den Hartog, Mechanical Vibrations, 4th ed. (1956), section 4.4 (bars); of springs in valve trains: H. A.
Rothbart (ed.), Cam Design Handbook (2004), chapter 12.
"""

import math

from cranktrain.core.kernel import kernel
from cranktrain.modules.crank_angle import ANGLES, OK, TIMES, choice_status, numbers_status
from cranktrain.modules.valve_train import slots as at
from cranktrain.modules.valve_train.cam import set_cam, smallest_radius, steepest

VALVE_ANGLES, NO_SEAT_TIME, SMALL_BASE = 20, 30, 40
"""Statuses of numbers that cannot belong to one valve train together; plus 1 for the exhaust."""
_N_KINDS, _N_ANGLES, _N_TIMES = len(at.KINDS), len(ANGLES), len(TIMES)


@kernel
def check_numbers(numbers, cams):
    """Status of a run's numbers: OK if a valve train may have them; the resulting cams are written to ``cams``."""
    status = numbers_status(numbers)
    if status == OK:
        status = choice_status(numbers, at.ANGLE_SOURCE, _N_ANGLES)
    if status == OK:
        status = choice_status(numbers, at.INPUTS_AT, _N_TIMES)
    if status != OK:
        return status
    for kind in range(_N_KINDS):
        first = at.FIRST_KIND + kind * at.N_OF_KIND
        opens, closes = numbers[first + at.OPENS], numbers[first + at.CLOSES]
        low = 0.0 if kind == at.EXHAUST else -4.0 * math.pi
        if not low <= opens < closes <= low + 4.0 * math.pi:
            return VALVE_ANGLES + kind
        if closes - opens + 4.0 * numbers[at.CAM_RAMP] >= 4.0 * math.pi:
            return NO_SEAT_TIME + kind
        make_cam(numbers, kind, cams[kind])
        if not smallest_radius(cams[kind], numbers[at.BASE_RADIUS], numbers[at.ROLLER_RADIUS]) > 0.0:
            return SMALL_BASE + kind
    return OK


@kernel
def make_cam(numbers, kind, cam):
    """Fill the numbers of the cam of a valve kind; its ramps take up lash and the deformation by the preload.

    At low speed the valve therefore begins to lift at the end of the ramp, and reaches its lift at the nose.
    """
    first, ratio = at.FIRST_KIND + kind * at.N_OF_KIND, numbers[at.RATIO]
    held = numbers[at.LASH] + numbers[at.PRELOAD] / numbers[at.STIFFNESS]
    top = held + numbers[first + at.HIGHEST] * (1.0 + numbers[at.RATE] / numbers[at.STIFFNESS])
    half = 0.25 * (numbers[first + at.CLOSES] - numbers[first + at.OPENS])
    cam[at.MASS] = numbers[first + at.OWN_MASS] + numbers[at.TRAIN_MASS] + numbers[at.SPRING_MASS] / 3.0
    set_cam(cam, half, numbers[at.CAM_RAMP], held / ratio, top / ratio, numbers[at.POWER])


@kernel
def prepare_model(numbers, model, cams):
    """Fill a model from a run's numbers, unless they are refused. Return a status. ``cams`` is trial workspace."""
    status = check_numbers(numbers, cams)
    if status != OK:
        return status
    n = model.numbers
    for k in range(at.N_GIVEN):
        n[k] = numbers[k]
    slope = 0.0
    for kind in range(_N_KINDS):
        for k in range(cams.shape[1]):
            model.cams[kind, k] = cams[kind, k]
        slope = max(slope, steepest(cams[kind]))
    n[at.DAMPING] = 1.0 / numbers[at.DAMPING_VELOCITY]
    n[at.SEAT_DAMPING] = 1.0 / numbers[at.SEAT_VELOCITY]
    n[at.DRIVE_DAMPING] = 1.0 / numbers[at.DRIVE_SPEED]
    n[at.HALF_GAP] = 0.5 * numbers[at.BACKLASH] / numbers[at.DRIVE_RADIUS]
    n[at.VELOCITY] = 0.5 * numbers[at.RATED_SPEED] * numbers[at.RATIO] * slope
    set_modes(numbers, n)
    for i in range(model.noses.shape[0]):
        first = at.FIRST_KIND + i % _N_KINDS * at.N_OF_KIND
        middle = 0.5 * (numbers[first + at.OPENS] + numbers[first + at.CLOSES])
        model.noses[i] = 0.5 * (numbers[at.FIRING + i // _N_KINDS] + middle)
    take_choices(numbers, model)
    return OK


@kernel
def set_modes(numbers, n):
    """Set the numbers of a spring's surge modes among the model's numbers ``n``."""
    mass = numbers[at.SPRING_MASS]
    n[at.MODAL_MASS] = 0.5 * mass
    sign = 1.0
    for k in range(at.MODES):
        wave = (k + 1) * math.pi
        stiffness = 0.5 * numbers[at.RATE] * wave**2
        n[at.COUPLING + k] = mass * sign / wave
        n[at.MODAL_STIFFNESS + k] = stiffness
        n[at.MODAL_DAMPING + k] = 2.0 * numbers[at.SPRING_DAMPING] * math.sqrt(stiffness * 0.5 * mass)
        sign = -sign


@kernel
def take_choices(numbers, model):
    """Set the model's choices from the run's numbers."""
    model.choices[at.GIVEN_ANGLE] = int(numbers[at.ANGLE_SOURCE])
    model.choices[at.ENDS] = int(numbers[at.INPUTS_AT])
