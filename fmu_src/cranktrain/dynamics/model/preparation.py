"""Kernel that writes into a model all values that depend on parameters, temperatures and speed.

:func:`prepare_model` writes every number of a run into the arrays of a model and reads none that an earlier preparation
left there, so the result depends on its arguments alone.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.dynamics.model import numbers as to
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import term_row, thrust_row
from cranktrain.dynamics.model.trimming import trim_model, trim_refusal
from cranktrain.dynamics.time.status import (
    BORE_FIXED,
    DAMPER_RANGE,
    DELAY_RANGE,
    LIMIT_RANGE,
    NOT_EMBEDDED,
    OIL_RANGE,
    OK,
    PEAKS_LOST,
    STEP_RANGE,
    THIN_OIL,
    TOLERANCE_RANGE,
    TRACE_FIXED,
    UNKNOWN_METHOD,
)
from cranktrain.dynamics.time.table import FIRST_STAGE, HEAD, NODE, STAGES
from cranktrain.engine.lubricant import oil_viscosity, temperature_at
from cranktrain.film.laws.films import OIL, TOLERANCE, VISCOSITY, VISCOUS, WARM, WARMS, film_call
from cranktrain.film.laws.films import SPEED as FILM_SPEED
from cranktrain.film.laws.parameters import CLEARANCE, FACTOR, RADIUS, WIDTH
from cranktrain.film.laws.parameters import VISCOSITY as BEARING_VISCOSITY
from cranktrain.loads.built_in_trace import BUILT_IN, TRACE_BORE, TRACE_COMPRESSION, renew_trace
from cranktrain.loads.damper import HIGHEST, KIND, LOWEST, NO_DAMPER, damper_at

HELD = 0.0
"""Number of the input reconstruction that holds inputs constant."""
STAGED = 4.0
"""Number of the input reconstruction for a driver that gives inputs at the stages of the integrator."""
VOGEL = 1
"""Index of the first constant of Vogel's law among the oil's constants, see engine.lubricant."""
CLOSE = 1.0e-9
"""Largest relative difference of two dimensions that counts as rounding by conversion to text."""


@kernel
def prepare_model(model, numbers, temperatures, speed):
    """Write the numbers of a run into a model. Return a status (0: success). A refusal leaves the model unchanged.

    Parameters
    ----------
    numbers : of the run, see :mod:`cranktrain.dynamics.model.numbers`
    temperatures : (mains,) of the main bearings' films, K; 0: the oil's
    speed : at which tables over speed are read, rad/s
    """
    status = trim_refusal(model, numbers)
    if status != OK:
        return status
    if model.lumps.values[to.SET_VOGEL_A] > 0.0:
        for k in range(3):
            model.basis.oil[VOGEL + k] = numbers[to.SET_VOGEL_A + k]
    status = refusal(model, numbers, temperatures, speed)
    if status != OK:
        return status
    status = trim_model(model, numbers)
    if status != OK:
        return status
    scalars = model.scalars
    scalars[at.GRAVITY] = numbers[to.SET_GRAVITY]
    scalars[at.CRANKCASE] = numbers[to.SET_CRANKCASE]
    scalars[at.GAS_LOAD] = numbers[to.SET_GAS_LOAD]
    scalars[at.STEP] = step_of(numbers)
    choose(model, numbers)
    size_cylinders(model, numbers)
    for i in range(model.block.weight.shape[0]):
        model.block.preload[i] = numbers[to.SET_GRAVITY] * model.block.weight[i]
    for j in range(model.block.mount_laws.shape[0]):
        model.block.mount_laws[j, at.MOUNT_PRELOAD] = (
            numbers[to.SET_GRAVITY] * model.block.mount_laws[j, at.MOUNT_WEIGHT]
        )
    scalars[at.DAMPER_TEMPERATURE] = damper_warmth(model.basis, numbers, speed)
    damper_at(model.basis.damper, scalars[at.DAMPER_TEMPERATURE], model.damper)
    status = warm_films(model, oil_warmth(model.basis, numbers, speed), temperatures)
    return warm_links(model, oil_warmth(model.basis, numbers, speed), speed) if status == OK else status


@kernel
def refusal(model, numbers, temperatures, speed):
    """Status for the reason why a model cannot be prepared, or OK. Oil too thin for Roelands' law is found later."""
    basis = model.basis
    if not to.LEAST_STEP <= step_of(numbers) < math.inf:
        return STEP_RANGE
    if not 0.0 <= numbers[to.SET_GAS_DELAY] <= to.MOST_DELAY:
        return DELAY_RANGE
    if not 0.0 <= numbers[to.SET_WORK_LIMIT] < math.inf:
        return LIMIT_RANGE
    row = method_row(numbers)
    if not 0.0 <= row < basis.methods.shape[0]:
        return UNKNOWN_METHOD
    if basis.methods[int(row), at.LOSES_PEAKS] != 0.0:
        return PEAKS_LOST
    if numbers[to.SET_ADAPTIVE] != 0.0:
        if basis.methods[int(row), at.EMBEDDED] == 0.0:
            return NOT_EMBEDDED
        if not to.LEAST_TOLERANCE <= numbers[to.SET_TOLERANCE] <= to.MOST_TOLERANCE:
            return TOLERANCE_RANGE
    other_bore = written(numbers[to.SET_BORE], basis.cylinders[at.BORE]) != basis.cylinders[at.BORE]
    other_ratio = (
        written(numbers[to.SET_COMPRESSION], basis.cylinders[at.COMPRESSION]) != basis.cylinders[at.COMPRESSION]
    )
    if other_bore and basis.cylinders[at.BORE_FITTED] > 0.0:
        return BORE_FIXED
    if (other_bore or other_ratio) and basis.trace[BUILT_IN] == 0.0:
        return TRACE_FIXED
    if oil_viscosity(oil_warmth(basis, numbers, speed), basis.oil) == 0.0:
        return OIL_RANGE
    if basis.films[at.MAINS_OIL] > 0.0:
        for i in range(model.bearings.shape[0]):
            if temperatures[i] != 0.0 and oil_viscosity(temperatures[i], basis.oil) == 0.0:
                return OIL_RANGE
    if basis.damper[KIND] != NO_DAMPER:
        warmth = damper_warmth(basis, numbers, speed)
        if not basis.damper[LOWEST] <= warmth <= basis.damper[HIGHEST]:
            return DAMPER_RANGE
    return OK


@inlined_kernel
def step_of(numbers):
    """Internal step, rad: the chosen step, or the default step of the level."""
    return numbers[to.SET_STEP] if numbers[to.SET_STEP] != 0.0 else numbers[to.LEVEL_STEP]


@inlined_kernel
def method_row(numbers):
    """Row of the integrator in its register: the chosen integrator, or the default of the level."""
    if numbers[to.SET_METHOD] >= 0.0:
        return numbers[to.SET_METHOD]
    return numbers[to.LEVEL_HELD_METHOD] if numbers[to.SET_RECONSTRUCTION] == HELD else numbers[to.LEVEL_METHOD]


@inlined_kernel
def oil_warmth(basis, numbers, speed):
    """Temperature of the oil supplied to the films, K."""
    if numbers[to.SET_OIL_TEMPERATURE] != 0.0:
        return numbers[to.SET_OIL_TEMPERATURE]
    return temperature_at(speed, basis.oil_speeds, basis.oil_temperatures)


@inlined_kernel
def damper_warmth(basis, numbers, speed):
    """Temperature of the damper, K; 0 for an engine without a damper."""
    if basis.damper[KIND] == NO_DAMPER:
        return 0.0
    if numbers[to.SET_DAMPER_TEMPERATURE] != 0.0:
        return numbers[to.SET_DAMPER_TEMPERATURE]
    return temperature_at(speed, basis.damper_speeds, basis.damper_temperatures)


@kernel
def tell_stages(model, staged):
    """Write step, number and times of the stages for a driver that gives inputs at stages; write 0 for all others."""
    stages = int(model.stages[HEAD, STAGES]) if model.choices[at.RECONSTRUCTION] == STAGED else 0
    staged[0, at.STAGES_GIVEN] = 0.0
    staged[0, at.STAGES_THERE] = stages
    staged[0, at.STAGE_STEP] = model.scalars[at.STEP]
    for s in range(stages):
        staged[1 + s, 0] = model.stages[FIRST_STAGE + s, NODE]


@kernel
def choose(model, numbers):
    """Write the integrator, its tolerances and the other choices of the settings into a model."""
    choices = model.choices
    choices[at.GAS_SOURCE] = numbers[to.SET_GAS_SOURCE]
    choices[at.RECONSTRUCTION] = numbers[to.SET_RECONSTRUCTION]
    choices[at.ENCODER] = numbers[to.SET_ENCODER]
    choices[at.GAS_DELAY] = numbers[to.SET_GAS_DELAY]
    choices[at.WORK_LIMIT] = numbers[to.SET_WORK_LIMIT]
    choices[at.DENSE] = numbers[to.SET_DENSE]
    row = int(method_row(numbers))
    method = model.basis.methods[row]
    table = model.basis.tables[row]
    for i in range(table.shape[0]):
        for j in range(table.shape[1]):
            model.stages[i, j] = table[i, j]
    choices[at.EMBEDDED_ORDER] = method[at.EMBEDDED]
    choices[at.ORDER] = method[at.METHOD_ORDER]
    choices[at.METHOD_MARK] = method[at.MARK]
    choices[at.STEP_TOLERANCE] = numbers[to.SET_TOLERANCE] if numbers[to.SET_ADAPTIVE] != 0.0 else 0.0
    choices[at.NEWTON_TOLERANCE] = numbers[to.SET_NEWTON_TOLERANCE]
    if numbers[to.SET_NEWTON_TOLERANCE] == 0.0:
        choices[at.NEWTON_TOLERANCE] = numbers[to.LEVEL_TOLERANCE] / method[at.AMPLIFICATION]
    model.laws.numbers[TOLERANCE] = choices[at.NEWTON_TOLERANCE]
    choices[at.FILM_CHANGE] = numbers[to.SET_FILM_CHANGE]
    if numbers[to.SET_FILM_CHANGE] == 0.0:
        choices[at.FILM_CHANGE] = numbers[to.LEVEL_FILM_CHANGE]


@kernel
def size_cylinders(model, numbers):
    """Set piston area, clearance volume and built-in gas trace for the bore and compression ratio of a run."""
    made = model.basis.cylinders
    bore = written(numbers[to.SET_BORE], made[at.BORE])
    ratio = written(numbers[to.SET_COMPRESSION], made[at.COMPRESSION])
    area = 0.25 * math.pi * bore**2
    for k in range(model.cylinders.shape[0]):
        model.cylinders[k, at.AREA] = area
        model.cylinders[k, at.CLEARANCE_VOLUME] = area * model.cylinders[k, at.STROKE] / (ratio - 1.0)
    trace = model.basis.trace
    if trace[TRACE_BORE] != bore or trace[TRACE_COMPRESSION] != ratio:
        trace[TRACE_BORE] = bore
        trace[TRACE_COMPRESSION] = ratio
        renew_trace(trace, model.basis.trace_rows, model.gas, model.kinks)


@kernel
def written(value, own):
    """Value of a dimension, replaced by ``own`` if the two differ only by rounding in conversion to text."""
    return own if abs(value - own) <= CLOSE * max(abs(value), abs(own)) else value


@kernel
def warm_films(model, temperature, temperatures):
    """Set the oil viscosity of mains, big ends and thrust bearing. Return a status (0: success)."""
    basis = model.basis
    eta = oil_viscosity(temperature, basis.oil)
    if basis.films[at.MAINS_OIL] > 0.0:
        for i in range(model.bearings.shape[0]):
            own = eta if temperatures[i] == 0.0 else oil_viscosity(temperatures[i], basis.oil)
            fill_bearing(model.bearings[i], own)
            if tell_law(model.laws, i, own) != 0:
                return THIN_OIL
    if basis.films[at.BIG_ENDS_OIL] > 0.0:
        for k in range(model.big_ends.shape[0]):
            fill_bearing(model.big_ends[k], eta)
            if tell_law(model.laws, int(model.cylinders[k, at.PIN_ROW]), eta) != 0:
                return THIN_OIL
    thrust = thrust_row(model)
    return OK if thrust < 0 or tell_law(model.laws, thrust, eta) == 0 else THIN_OIL


@kernel
def warm_links(model, temperature, speed):
    """Set oil viscosity at a ``temperature`` (K) and speed (rad/s) in added connections. Return a status (0: OK)."""
    eta = oil_viscosity(temperature, model.basis.oil)
    links = model.links
    laws = model.laws
    first = term_row(model)
    for k in range(links.oil.shape[0]):
        if links.oil[k] >= 0.0:
            viscosity = links.oil[k] if links.oil[k] > 0.0 else eta
            if links.bearings[k, CLEARANCE] > 0.0:
                fill_bearing(links.bearings[k], viscosity)
            if tell_law(laws, first + k, viscosity) != 0:
                return THIN_OIL
        if laws.traits[first + k, WARMS] > 0.0:
            laws.numbers[FILM_SPEED] = speed
            if film_call(laws, WARM, first + k, laws.out, laws.out) != 0:
                return DAMPER_RANGE
    return OK


@kernel
def fill_bearing(bearing, viscosity):
    """Set viscosity (Pa s) and its factor in parameters of a plain bearing, see film.laws.parabolic.film_geometry."""
    bearing[BEARING_VISCOSITY] = viscosity
    ratio = bearing[RADIUS] / bearing[CLEARANCE]
    bearing[FACTOR] = 10.0 * viscosity * bearing[RADIUS] * bearing[WIDTH] * ratio**2


@kernel
def tell_law(laws, k, viscosity):
    """Pass the oil's viscosity (Pa s) to force law k if the law needs it. Return the status of the law."""
    if laws.traits[k, VISCOUS] == 0.0:
        return 0
    laws.numbers[VISCOSITY] = viscosity
    return film_call(laws, OIL, k, laws.out, laws.out)
