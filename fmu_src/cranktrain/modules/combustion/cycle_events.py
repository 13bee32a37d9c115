"""Events within a cycle: sampling of the fuel, injection, ignition, ends of the burns, beginning of a new cycle.

Fuel and start of injection are sampled at ``SAMPLED``, before firing dead centre. A seeded scatter, new in each cycle
of each cylinder, acts on the fuel's mass, on the start of injection and on the durations of the burns. Its numbers
depend only on seed, cylinder and cycle, so a restored state continues with the same numbers.

Source of the hash: G. L. Steele, D. Lea, C. H. Flood, Fast splittable pseudorandom number generators, OOPSLA (2014).
"""

import math

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.modules.combustion import slots as at
from cranktrain.modules.combustion.burn import DURATION_BY_RATIO, DURATION_BY_SPEED, LEANEST, premixed_share
from cranktrain.modules.combustion.cylinder import lifts, volume
from cranktrain.modules.combustion.gas import AIR_ROW, R_GAS, VAPOUR_ROW, enthalpy
from cranktrain.modules.combustion.mixture import vapour_shift
from cranktrain.modules.combustion.spark import duration_factor
from cranktrain.modules.combustion.volume_deviation import deviation

SAMPLED = -math.radians(100.0)
"""Crank angle at which the fuel and injection timing of a cycle are sampled, rad."""
LATEST = math.radians(60.0)
"""Crank angle after which a charge does not ignite any more, rad."""
MOST_BURNT = 0.999
"""Largest fraction of the air that can burn."""
LEAN_LIMIT, RICHEST = 0.4, 1.8
"""Equivalence ratio below which a spark ignites nothing, and the largest one: fuel beyond it stays vapour."""
RICHEST_MEANT = 1.0 / 0.6
"""Equivalence ratio above which fuel or air must be mistaken; an FMU warns."""
_AHEAD = 1.0e-9
"""Crank angle, rad, by which the valves are looked up ahead, so that a valve that begins to open counts as open."""
_WEYL = np.uint64(0x9E3779B97F4A7C15)
_MIX_A, _MIX_B = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_SHIFTS = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_SHIFT_A, _SHIFT_B, _SHIFT_C, _SHIFT_D = _SHIFTS


@kernel
def mixed(value):
    """Hash of a 64-bit integer, for reproducible random numbers."""
    z = value + _WEYL
    z = (z ^ (z >> _SHIFT_A)) * _MIX_A
    z = (z ^ (z >> _SHIFT_B)) * _MIX_B
    return z ^ (z >> _SHIFT_C)


@kernel
def normal(seed, cylinder, cycle, which):
    """Standard normal number for a seed, cylinder, cycle and purpose, limited to ±3."""
    z = mixed(np.uint64(np.int64(seed)))
    z = mixed(z ^ np.uint64(np.int64(cylinder)))
    z = mixed(z ^ np.uint64(np.int64(cycle)))
    z = mixed(z ^ np.uint64(np.int64(which)))
    u = (np.float64(z >> _SHIFT_D) + 0.5) * 2.0**-53
    v = np.float64(mixed(z) >> _SHIFT_D) * 2.0**-53
    value = math.sqrt(-2.0 * math.log(u)) * math.cos(2.0 * math.pi * v)
    return min(max(value, -3.0), 3.0)


@kernel
def next_angle(model, work, state, base):
    """Next crank angle at which a step must end, rad."""
    phi, phase = state[base + at.PHI], state[base + at.PHASE]
    goal = 2.0 * math.pi
    if phase == at.WAITING and phi < SAMPLED:
        goal = SAMPLED
    elif phase == at.ARMED:
        goal = min(goal, state[base + at.SOI])
    elif phase == at.DELAYED:
        goal = min(goal, LATEST)
    elif phase == at.BURNING:
        for k in (at.PREMIXED_FOR, at.DIFFUSION_FOR):
            end = state[base + at.IGNITION] + state[base + k]
            if end > phi:
                goal = min(goal, end)
    if work.now[at.LIFTS_GIVEN] == 0.0:
        n = model.numbers
        for k in (at.INTAKE_OPENS, at.INTAKE_CLOSES, at.EXHAUST_OPENS, at.EXHAUST_CLOSES):
            edge = n[k] - 4.0 * math.pi if n[k] > 2.0 * math.pi else n[k]
            edge = edge + 4.0 * math.pi if edge <= -2.0 * math.pi else edge
            if phi < edge < goal:
                goal = edge
    return goal


@kernel
def pass_angle(model, work, state, i, base, inputs, angle):
    """Handle the events at a crank angle at which a step has ended."""
    phase = state[base + at.PHASE]
    if angle >= 2.0 * math.pi:
        new_cycle(state, base, angle - 4.0 * math.pi)
        _count(model, state, base)
    elif phase == at.WAITING and angle == SAMPLED:
        sample(model, state, i, base, inputs)
    elif phase == at.ARMED and angle == state[base + at.SOI]:
        if model.numbers[at.SPARKS] > 0.0:
            spark(model, work, state, i, base)
        else:
            inject(model, state, base)
    elif phase == at.DELAYED and angle == LATEST:
        state[base + at.PHASE] = at.WAITING


@kernel
def sample(model, state, i, base, inputs):
    """Take the fuel and start of injection of a cycle from the inputs, with scatter."""
    n, seed, cycle = model.numbers, model.numbers[at.SEED], state[base + at.CYCLE]
    place = at.FIRST_CYLINDER + i * at.OF_CYLINDER
    fuel = inputs[place + at.FUEL_MASS]
    if n[at.SPARKS] > 0.0:
        air = fresh_air(state, base)
        state[base + at.AIR] = air
        fuel = air / (fuel * n[at.AIR_DEMAND]) if fuel > 0.0 else 0.0
    fuel *= 1.0 + n[at.SCATTER_FUEL] * normal(seed, i, cycle, 0)
    start = inputs[place + at.INJECTION] + n[at.SCATTER_TIMING] * normal(seed, i, cycle, 1)
    state[base + at.FUEL] = max(fuel, 0.0)
    state[base + at.SOI] = min(max(start, SAMPLED + 0.01), 0.9 * LATEST)
    if state[base + at.FUEL] > 0.0:
        state[base + at.PHASE] = at.ARMED
        if n[at.SPARKS] > 0.0:
            vaporise(model, state, base)


@kernel
def fresh_air(state, base):
    """Mass of air in a cylinder outside its burnt gas, kg."""
    return max(state[base + at.MASS] - state[base + at.PRODUCTS] - state[base + at.VAPOUR], 0.0)


@kernel
def vaporise(model, state, base):
    """Add a cycle's fuel to the charge as vapour of the charge's temperature; ports and walls have evaporated it."""
    fuel, t, gas = state[base + at.FUEL], state[base + at.TEMPERATURE], model.gas
    heat = enthalpy(gas, 0.0, t) + vapour_shift(gas, t)[0]
    energy = fuel * (heat - (gas[AIR_ROW, R_GAS] + gas[VAPOUR_ROW, R_GAS]) * t)
    state[base + at.MASS] += fuel
    state[base + at.VAPOUR] += fuel
    state[base + at.ENERGY] += energy
    state[base + at.ADDED] += fuel
    state[base + at.ADDED_ENERGY] += energy
    # What is left of the last cycle's burnt gas counts as gas of the new ratio from here.
    air = max(state[base + at.AIR], 1.0e-12)
    ratio = state[base + at.VAPOUR] * model.numbers[at.AIR_DEMAND] / air
    state[base + at.RATIO] = min(max(ratio, LEANEST), RICHEST)
    tell_rich(state, ratio)


@kernel
def tell_rich(state, ratio):
    """Mark in the state that a charge was richer than any that is meant, ``RICHEST_MEANT``."""
    if ratio > RICHEST_MEANT:
        state[at.RICH] = 1.0


@kernel
def spark(model, work, state, i, base):
    """Ignite a cylinder's charge by a spark: keep its state, and set fuel and durations of both parts of the burn."""
    n, mass, air = model.numbers, state[base + at.MASS], fresh_air(state, base)
    pressure, temperature = state[base + at.PRESSURE], state[base + at.TEMPERATURE]
    share, ratio = state[base + at.PRODUCTS] / mass, state[base + at.RATIO]
    # All fuel of a rich charge burns, partly to carbon monoxide and hydrogen.
    fuel = n[at.BURN_EFFICIENCY] * min(state[base + at.VAPOUR], MOST_BURNT * air * ratio / n[at.AIR_DEMAND])
    if ratio < LEAN_LIMIT or fuel <= 0.0:
        state[base + at.PHASE] = at.WAITING
        return
    factor = duration_factor(n, ratio, temperature, pressure, share, work.now[at.NOW_SPEED])
    state[base + at.SPARK_PRESSURE] = pressure
    state[base + at.SPARK_TEMPERATURE] = temperature
    state[base + at.SPARK_PRODUCTS] = share
    state[base + at.SPARK_VAPOUR] = state[base + at.VAPOUR] / mass
    state[base + at.SPARK_BURNT] = state[base + at.BURNT]
    burn(model, state, i, base, n[at.BURN_FRACTION] * fuel, (1.0 - n[at.BURN_FRACTION]) * fuel, factor, factor)
    if n[at.BURN_FRACTION] == 1.0:
        state[base + at.DIFFUSION_FOR] = state[base + at.PREMIXED_FOR]
    state[base + at.CYCLE_DELAY] = max(state[base + at.PREMIXED_FOR], state[base + at.DIFFUSION_FOR])


@kernel
def inject(model, state, base):
    """Begin the ignition delay of a cylinder, at the start of injection."""
    air = state[base + at.MASS] - state[base + at.PRODUCTS]
    state[base + at.AIR] = air
    state[base + at.RATIO] = state[base + at.FUEL] * model.numbers[at.AIR_DEMAND] / max(air, 1.0e-12)
    tell_rich(state, state[base + at.RATIO])
    state[base + at.DELAY] = 0.0
    state[base + at.INJECTED] += state[base + at.FUEL]
    state[base + at.SOI_TIME] = state[base + at.CLOCK]
    state[base + at.PHASE] = at.DELAYED


@kernel
def ignite(model, state, i, base):
    """Ignite a cylinder's charge: set fuel and duration of the premixed and of the diffusion burn."""
    n = model.numbers
    delay = state[base + at.CLOCK] - state[base + at.SOI_TIME]
    ratio = state[base + at.RATIO]
    air = max(state[base + at.MASS] - state[base + at.PRODUCTS], 0.0)
    fuel = min(state[base + at.FUEL], MOST_BURNT * air / n[at.AIR_DEMAND])
    share = premixed_share(ratio, delay, n[at.PREMIXED_FACTOR], n[at.PREMIXED_BY_RATIO], n[at.PREMIXED_BY_DELAY])
    turning = (state[base + at.PHI] - state[base + at.SOI]) / max(delay, 1.0e-9)
    slower = (max(ratio, LEANEST) / n[at.REFERENCE_RATIO]) ** DURATION_BY_RATIO
    slower *= (max(turning, 1.0) / n[at.REFERENCE_SPEED]) ** DURATION_BY_SPEED
    burn(model, state, i, base, share * fuel, (1.0 - share) * fuel, 1.0, slower)
    state[base + at.CYCLE_DELAY] = delay


@kernel
def burn(model, state, i, base, first, second, first_factor, second_factor):
    """Begin to burn the fuel (kg) of both Wiebe functions, with factors on their durations, which scatter together."""
    n = model.numbers
    scattered = 1.0 + n[at.SCATTER_BURN] * normal(n[at.SEED], i, state[base + at.CYCLE], 2)
    # At any speed the charge must be burnt before the next one is sampled.
    longest = 2.0 * math.pi - 0.1 - state[base + at.PHI]
    state[base + at.IGNITION] = state[base + at.PHI]
    state[base + at.PREMIXED_FUEL] = first
    state[base + at.DIFFUSION_FUEL] = second
    state[base + at.PREMIXED_FOR] = min(max(scattered, 0.2) * first_factor * n[at.PREMIXED_DURATION], longest)
    state[base + at.DIFFUSION_FOR] = min(max(scattered, 0.2) * second_factor * n[at.DIFFUSION_DURATION], longest)
    state[base + at.PHASE] = at.BURNING


@kernel
def new_cycle(state, base, angle):
    """Begin a new cycle at a crank angle."""
    state[base + at.PHI] = angle
    state[base + at.PHASE] = at.WAITING


@kernel
def _count(model, state, base):
    """Store the results of the cycle that has ended."""
    state[base + at.CYCLE] += 1.0
    state[base + at.CYCLE_WORK] = state[base + at.WORK] - state[base + at.WORK_START]
    state[base + at.CYCLE_WALL] = state[base + at.WALL] - state[base + at.WALL_START]
    burnt = state[base + at.BURNT] - state[base + at.BURNT_START]
    state[base + at.CYCLE_HEAT] = burnt * model.numbers[at.HEATING_VALUE]
    state[base + at.CYCLE_PEAK] = state[base + at.PEAK]
    state[base + at.CYCLE_PEAK_ANGLE] = state[base + at.PEAK_ANGLE]
    state[base + at.WORK_START] = state[base + at.WORK]
    state[base + at.WALL_START] = state[base + at.WALL]
    state[base + at.BURNT_START] = state[base + at.BURNT]
    state[base + at.PEAK] = 0.0


@kernel
def closed_or_open(model, work, state, base, time):
    """Update the valve state and store a closed charge's state. Return True if all valves just closed or one opens."""
    inward, outward = lifts(model, work.now, state[base + at.PHI] + _AHEAD, time)
    closed = 1.0 if inward <= 0.0 and outward <= 0.0 else 0.0
    changed = closed != state[base + at.CLOSED]
    if changed and closed > 0.0:
        state[base + at.CLOSED_PRESSURE] = state[base + at.PRESSURE]
        state[base + at.CLOSED_TEMPERATURE] = state[base + at.TEMPERATURE]
        state[base + at.CLOSED_VOLUME] = volume(model.numbers, state[base + at.PHI]) + deviation(work.now, time)
    state[base + at.CLOSED] = closed
    return changed
