"""Preparation of a model from a run's numbers: its numbers, firing angles and choices, after a check."""

import math

from cranktrain.core.kernel import kernel
from cranktrain.modules.combustion import slots as at
from cranktrain.modules.combustion.cylinder import OK, swept_volume
from cranktrain.modules.combustion.gas import gas_constant, internal_energy
from cranktrain.modules.crank_angle import ANGLES, TIMES, choice_status, numbers_status

SHORT_ROD, NO_COMPRESSION, INTAKE_ANGLES, EXHAUST_ANGLES = 20, 21, 22, 23
"""Statuses of numbers that cannot belong to one engine together."""
PORT_SHARE = 0.5
"""Volume of the exhaust port in which a cylinder's outflow mixes, over the swept volume; chosen."""
_N_LIFTS, _N_ANGLES, _N_TIMES = len(at.LIFTS), len(ANGLES), len(TIMES)


@kernel
def check_numbers(numbers):
    """Return the status of a run's numbers: OK if an engine may have these values together."""
    status = numbers_status(numbers)
    if status == OK:
        status = choice_status(numbers, at.LIFT_SOURCE, _N_LIFTS)
    if status == OK:
        status = choice_status(numbers, at.ANGLE_SOURCE, _N_ANGLES)
    if status == OK:
        status = choice_status(numbers, at.INPUTS_AT, _N_TIMES)
    if status != OK:
        return status
    reach = 0.5 * numbers[at.STROKE] + abs(numbers[at.PIN_OFFSET])
    if not numbers[at.ROD_LENGTH] > reach > 0.0:
        return SHORT_ROD
    if not numbers[at.COMPRESSION_RATIO] > 1.0:
        return NO_COMPRESSION
    if not -4.0 * math.pi <= numbers[at.INTAKE_OPENS] < numbers[at.INTAKE_CLOSES] < 0.0:
        return INTAKE_ANGLES
    if not 0.0 < numbers[at.EXHAUST_OPENS] < numbers[at.EXHAUST_CLOSES] <= 4.0 * math.pi:
        return EXHAUST_ANGLES
    return OK


@kernel
def prepare_model(numbers, model):
    """Fill a model, except its gas table, from a run's numbers. Return a status; refused numbers change nothing."""
    status = check_numbers(numbers)
    if status != OK:
        return status
    n, gas, share = model.numbers, model.gas, numbers[at.INTAKE_SHARE]
    for k in range(at.N_GIVEN):
        n[k] = numbers[k]
    swept = swept_volume(n)
    density = numbers[at.CHARGE_PRESSURE] / (gas_constant(gas, share) * numbers[at.CHARGE_TEMPERATURE])
    n[at.MASS_SCALE] = density * swept
    n[at.ENERGY_SCALE] = density * swept * abs(internal_energy(gas, share, 1000.0))
    back = gas_constant(gas, share) * numbers[at.BACK_TEMPERATURE]
    n[at.PORT_MASS] = PORT_SHARE * swept * numbers[at.BACK_PRESSURE] / back
    for i in range(model.firing.shape[0]):
        model.firing[i] = numbers[at.FIRING + i]
    take_choices(numbers, model)
    return OK


@kernel
def take_choices(numbers, model):
    """Set the model's choices from the run's numbers."""
    model.choices[at.GIVEN_LIFT] = int(numbers[at.LIFT_SOURCE])
    model.choices[at.GIVEN_ANGLE] = int(numbers[at.ANGLE_SOURCE])
    model.choices[at.ENDS] = int(numbers[at.INPUTS_AT])
