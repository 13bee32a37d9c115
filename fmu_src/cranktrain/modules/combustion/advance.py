"""Advance of all cylinders over one communication step, and the outputs at its end."""

import math

from cranktrain.core.kernel import kernel
from cranktrain.modules.combustion import slots as at
from cranktrain.modules.combustion.cylinder import OK, fill, swept_volume, volume, volume_rate
from cranktrain.modules.combustion.stepping import advance_cylinder
from cranktrain.modules.combustion.volume_deviation import follow_deviation
from cranktrain.modules.crank_angle import cycle_angle, keep_received, turned

N_HEAD = len(at.HEAD)
N_OUTPUTS, N_OF_CYLINDER = len(at.OUTPUTS), len(at.CYLINDER_OUTPUTS)
(
    OUT_ANGLE, OUT_TORQUE, OUT_TORQUE_MEAN, OUT_IMEP, OUT_HEAT, OUT_WALLS, OUT_WORK, OUT_FUEL, OUT_INTAKE, OUT_EXHAUST,
    OUT_MASS_BALANCE, OUT_ENERGY_BALANCE, OUT_STEPS, OUT_REJECTED,
) = range(N_OUTPUTS)  # fmt: skip
(
    OUT_PRESSURE, OUT_TEMPERATURE, OUT_MASS, OUT_PRODUCTS, OUT_CYLINDER_IMEP, OUT_PEAK, OUT_PEAK_ANGLE,
    OUT_CYLINDER_HEAT, OUT_CYLINDER_WALL, OUT_DELAY, OUT_DEVIATION, OUT_AIR, OUT_RATIO,
) = range(N_OF_CYLINDER)  # fmt: skip


@kernel
def hold_inputs(work, inputs):
    """Copy the inputs common to all cylinders, which are constant over a communication step."""
    now = work.now
    now[at.NOW_INTAKE_P] = inputs[at.INTAKE_P]
    now[at.NOW_INTAKE_T] = inputs[at.INTAKE_T]
    now[at.NOW_EXHAUST_P] = inputs[at.EXHAUST_P]
    now[at.NOW_EXHAUST_T] = inputs[at.EXHAUST_T]


@kernel
def take_lifts(model, work, state, inputs):
    """Set whether lifts are taken from the inputs: always, never, or from the first one that differs from 0."""
    source = model.choices[at.GIVEN_LIFT]
    if source == at.ONCE_SEEN and state[at.LIFTS_SEEN] == 0.0:
        for i in range(model.firing.shape[0]):
            place = at.FIRST_CYLINDER + i * at.OF_CYLINDER
            if inputs[place + at.LIFT_IN] != 0.0 or inputs[place + at.LIFT_OUT] != 0.0:
                state[at.LIFTS_SEEN] = 1.0
        if state[at.LIFTS_SEEN] > 0.0:
            # The first lifts received have no slope yet.
            for i in range(model.firing.shape[0]):
                place, base = at.FIRST_CYLINDER + i * at.OF_CYLINDER, N_HEAD + i * at.SIZE
                for k in range(2):
                    state[base + at.LAST_LIFT_IN + k] = max(inputs[place + at.LIFT_IN + k], 0.0)
    given = source == at.ALWAYS or (source == at.ONCE_SEEN and state[at.LIFTS_SEEN] > 0.0)
    work.now[at.LIFTS_GIVEN] = 1.0 if given else 0.0


@kernel
def follow_lifts(model, work, state, base, place, inputs, interval):
    """Set lifts and their slopes at the start of a communication step, extrapolated from or leading to the inputs."""
    now = work.now
    for k in range(2):
        sample, last = max(inputs[place + at.LIFT_IN + k], 0.0), state[base + at.LAST_LIFT_IN + k]
        if model.choices[at.ENDS] > 0:
            now[at.NOW_LIFT_IN + k] = last
            now[at.SLOPE_IN + k] = (sample - last) / interval
        else:
            now[at.NOW_LIFT_IN + k] = sample
            past = state[at.LAST_INTERVAL]
            now[at.SLOPE_IN + k] = (sample - last) / past if past > 0.0 and sample > 0.0 else 0.0
        state[base + at.LAST_LIFT_IN + k] = sample


@kernel
def advance(model, work, state, inputs, interval):
    """Advance all cylinders by an interval, s. Return a status; ``work.counters`` has a failed cylinder's number."""
    hold_inputs(work, inputs)
    take_lifts(model, work, state, inputs)
    turn = turned(state, inputs, interval, model.choices[at.GIVEN_ANGLE], model.choices[at.ENDS])
    work.now[at.NOW_SPEED] = turn / interval
    for i in range(model.firing.shape[0]):
        base = N_HEAD + i * at.SIZE
        place = at.FIRST_CYLINDER + i * at.OF_CYLINDER
        follow_lifts(model, work, state, base, place, inputs, interval)
        follow_deviation(model, work, state, base, place, inputs, interval)
        status = advance_cylinder(model, work, state, i, base, inputs, interval)
        if status != OK:
            work.counters[0] = i + 1
            return status
    state[at.OWN_ANGLE] = (
        cycle_angle(state[at.OWN_ANGLE] + turn) if model.choices[at.GIVEN_ANGLE] > 0 else state[at.OWN_ANGLE] + turn
    )
    keep_received(state, inputs, interval)
    return OK


@kernel
def fill_all(model, work, state, inputs):
    """Fill all cylinders at rest with intake gas, and set angles from the inputs."""
    hold_inputs(work, inputs)
    state[at.OWN_ANGLE] = inputs[at.ANGLE]
    state[at.PARTNER_ANGLE] = inputs[at.ANGLE]
    for i in range(model.firing.shape[0]):
        base = N_HEAD + i * at.SIZE
        place = at.FIRST_CYLINDER + i * at.OF_CYLINDER
        state[base + at.PHI] = cycle_angle(inputs[at.ANGLE] - model.firing[i])
        state[base + at.DEVIATION] = inputs[place + at.DEVIATION_IN]
        fill(
            model,
            state,
            base,
            state[base + at.PHI],
            inputs[at.INTAKE_P],
            inputs[at.INTAKE_T],
            model.numbers[at.INTAKE_SHARE],
        )
        state[base + at.LAST_LIFT_IN] = inputs[place + at.LIFT_IN]
        state[base + at.LAST_LIFT_OUT] = inputs[place + at.LIFT_OUT]
    return OK


@kernel
def observe(model, work, state, out):
    """Write the outputs in the order of ``OUTPUTS``, then of ``CYLINDER_OUTPUTS`` for each cylinder, into ``out``."""
    n, count = model.numbers, model.firing.shape[0]
    for k in range(N_OUTPUTS):
        out[k] = 0.0
    out[OUT_ANGLE] = state[at.PARTNER_ANGLE]
    for i in range(count):
        base, first = N_HEAD + i * at.SIZE, N_OUTPUTS + i * N_OF_CYLINDER
        mean = state[base + at.CYCLE_WORK] / swept_volume(n)
        rise = volume_rate(n, state[base + at.PHI])
        if state[at.LAST_SPEED] > 0.0:
            rise += state[base + at.DEVIATION_RATE] / state[at.LAST_SPEED]
        space = volume(n, state[base + at.PHI]) + state[base + at.DEVIATION]
        out[OUT_TORQUE] += (state[base + at.PRESSURE] - n[at.CRANKCASE_PRESSURE]) * rise
        out[OUT_WORK] += state[base + at.WORK] - n[at.CRANKCASE_PRESSURE] * (space - state[base + at.FIRST_VOLUME])
        out[OUT_TORQUE_MEAN] += state[base + at.CYCLE_WORK] / (4.0 * math.pi)
        out[OUT_IMEP] += mean / count
        out[OUT_HEAT] += state[base + at.BURNT] * n[at.HEATING_VALUE]
        out[OUT_WALLS] += state[base + at.WALL]
        out[OUT_FUEL] += state[base + at.BURNT]
        out[OUT_INTAKE] += state[base + at.INTAKE]
        out[OUT_EXHAUST] += state[base + at.EXHAUST]
        fuel = state[base + at.ADDED] if n[at.SPARKS] > 0.0 else state[base + at.BURNT]
        gained = fuel + state[base + at.INTAKE] - state[base + at.EXHAUST]
        out[OUT_MASS_BALANCE] += state[base + at.MASS] - state[base + at.FIRST_MASS] - gained
        heat = state[base + at.BURNT] * n[at.HEATING_VALUE] - state[base + at.WALL] - state[base + at.WORK]
        heat += state[base + at.ADDED_ENERGY]
        carried = state[base + at.INTAKE_ENTHALPY] - state[base + at.EXHAUST_ENTHALPY]
        out[OUT_ENERGY_BALANCE] += state[base + at.ENERGY] - state[base + at.FIRST_ENERGY] - heat - carried
        out[first + OUT_PRESSURE] = state[base + at.PRESSURE]
        out[first + OUT_TEMPERATURE] = state[base + at.TEMPERATURE]
        out[first + OUT_MASS] = state[base + at.MASS]
        out[first + OUT_PRODUCTS] = state[base + at.PRODUCTS] / state[base + at.MASS]
        out[first + OUT_CYLINDER_IMEP] = mean
        out[first + OUT_PEAK] = state[base + at.CYCLE_PEAK]
        out[first + OUT_PEAK_ANGLE] = state[base + at.CYCLE_PEAK_ANGLE]
        out[first + OUT_CYLINDER_HEAT] = state[base + at.CYCLE_HEAT]
        out[first + OUT_CYLINDER_WALL] = state[base + at.CYCLE_WALL]
        out[first + OUT_DELAY] = state[base + at.CYCLE_DELAY]
        out[first + OUT_DEVIATION] = state[base + at.DEVIATION]
        out[first + OUT_AIR] = state[base + at.AIR]
        out[first + OUT_RATIO] = state[base + at.FUEL]
        if n[at.SPARKS] == 0.0:
            asked = state[base + at.FUEL] * n[at.AIR_DEMAND]
            out[first + OUT_RATIO] = state[base + at.AIR] / asked if asked > 0.0 else 0.0
    out[OUT_STEPS] = state[at.STEPS]
    out[OUT_REJECTED] = state[at.REJECTED]
    return OK
