"""One cylinder: geometry, and rates of its integrated quantities."""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.modules.combustion import slots as at
from cranktrain.modules.combustion.burn import ignition_rate, wiebe_rate
from cranktrain.modules.combustion.gas import gas_constant, internal_energy
from cranktrain.modules.combustion.mixture import mixture, temperature_of, two_zones
from cranktrain.modules.combustion.valve_flow import built_in_lift, flow_slope, nozzle_flow, valve_area
from cranktrain.modules.combustion.volume_deviation import deviation, deviation_rate
from cranktrain.modules.combustion.wall_heat import COMBUSTION_TERM, MOTORED_EXPONENT, piston_term, woschni_coefficient

OK, COLD = 0, 1
"""Statuses of an evaluation: success; failure, because no temperature fits the energy or mass or volume is ≤ 0."""
POOL_SHARE = 1.0e-3
"""Mass of blown-back intake gas, over a charge, below which fresh gas is mixed in."""


@inlined_kernel
def swept_volume(numbers):
    """Volume that the piston sweeps, m³."""
    area = 0.25 * math.pi * numbers[at.BORE] ** 2
    r, length, offset = 0.5 * numbers[at.STROKE], numbers[at.ROD_LENGTH], numbers[at.PIN_OFFSET]
    return area * (math.sqrt((length + r) ** 2 - offset**2) - math.sqrt((length - r) ** 2 - offset**2))


@inlined_kernel
def volume(numbers, phi):
    """Volume above the piston for rigid parts, m³, at a crank angle after firing dead centre, rad."""
    area = 0.25 * math.pi * numbers[at.BORE] ** 2
    r, length, offset = 0.5 * numbers[at.STROKE], numbers[at.ROD_LENGTH], numbers[at.PIN_OFFSET]
    x = -r * math.sin(phi) - offset
    top = math.sqrt((length + r) ** 2 - offset**2)
    clearance = swept_volume(numbers) / (numbers[at.COMPRESSION_RATIO] - 1.0)
    return clearance + area * (top - r * math.cos(phi) - math.sqrt(length**2 - x**2))


@inlined_kernel
def volume_rate(numbers, phi):
    """Rate dV/dφ for rigid parts, m³/rad."""
    area = 0.25 * math.pi * numbers[at.BORE] ** 2
    r, length, offset = 0.5 * numbers[at.STROKE], numbers[at.ROD_LENGTH], numbers[at.PIN_OFFSET]
    x = -r * math.sin(phi) - offset
    return area * (r * math.sin(phi) - x * r * math.cos(phi) / math.sqrt(length**2 - x**2))


@inlined_kernel
def lifts(model, now, phi, time):
    """Lifts of intake and exhaust valve, m, at a crank angle and a time since the start of the communication step."""
    if now[at.LIFTS_GIVEN] > 0.0:
        return now[at.NOW_LIFT_IN] + now[at.SLOPE_IN] * time, now[at.NOW_LIFT_OUT] + now[at.SLOPE_OUT] * time
    n = model.numbers
    angle = phi if phi <= n[at.EXHAUST_OPENS] else phi - 4.0 * math.pi
    inward = built_in_lift(angle, n[at.INTAKE_OPENS], n[at.INTAKE_CLOSES], n[at.INTAKE_LIFT])
    angle = phi if phi >= n[at.INTAKE_CLOSES] else phi + 4.0 * math.pi
    return inward, built_in_lift(angle, n[at.EXHAUST_OPENS], n[at.EXHAUST_CLOSES], n[at.EXHAUST_LIFT])


@inlined_kernel
def burn_rate(model, state, base, phi):
    """Burn rate of the fuel, kg/rad, at a crank angle after firing dead centre, in a step that begins at the state."""
    n = model.numbers
    premixed = _burning(state, base, at.PREMIXED_FOR, phi, n[at.PREMIXED_EXPONENT])
    diffusion = _burning(state, base, at.DIFFUSION_FOR, phi, n[at.DIFFUSION_EXPONENT])
    return state[base + at.PREMIXED_FUEL] * premixed + state[base + at.DIFFUSION_FUEL] * diffusion


@inlined_kernel
def _burning(state, base, lasts, phi, exponent):
    """Rate of one burn, 1/rad, in a step that begins at the state; 0 if the burn is already over at the state.

    The rate drops to 0 at the end of the burn, where a step ends. Rounding of the angle of that step's last stage must
    not switch the burn off, so the beginning of the step decides.
    """
    start, duration = state[base + at.IGNITION], state[base + lasts]
    if state[base + at.PHI] >= start + duration:
        return 0.0
    return wiebe_rate(min(phi - start, duration), duration, exponent)


@inlined_kernel
def wall_flow(model, now, state, base, pressure, temperature, volume):
    """Heat flow from a cylinder's gas to the walls, W."""
    n = model.numbers
    bore = n[at.BORE]
    closed = state[base + at.CLOSED] > 0.0
    speed = piston_term(not closed, n[at.SWIRL]) * abs(now[at.NOW_SPEED]) * n[at.STROKE] / math.pi
    if closed and state[base + at.PHASE] == at.BURNING:
        start = state[base + at.CLOSED_PRESSURE] * state[base + at.CLOSED_VOLUME]
        motored = state[base + at.CLOSED_PRESSURE] * (state[base + at.CLOSED_VOLUME] / volume) ** MOTORED_EXPONENT
        by_charge = swept_volume(n) * state[base + at.CLOSED_TEMPERATURE] / start
        speed += COMBUSTION_TERM * by_charge * max(pressure - motored, 0.0)
    area = 0.5 * math.pi * bore * bore + 4.0 * volume / bore
    coefficient = n[at.WALL_FACTOR] * woschni_coefficient(pressure, temperature, bore, speed)
    return coefficient * area * (temperature - n[at.WALL_TEMPERATURE])


@inlined_kernel
def flame(state, base, values):
    """Fraction of a charge behind the flame of spark ignition, in a step that begins at the state; 1 without a flame.

    The gas mixes, to one temperature, at the end of the burn or when a valve opens.
    """
    start, lasts = state[base + at.IGNITION], max(state[base + at.PREMIXED_FOR], state[base + at.DIFFUSION_FOR])
    over = state[base + at.PHASE] != at.BURNING or state[base + at.PHI] >= start + lasts
    if over or state[base + at.CLOSED] == 0.0:
        return 1.0
    return (values[at.BURNT] - state[base + at.SPARK_BURNT]) / (
        state[base + at.PREMIXED_FUEL] + state[base + at.DIFFUSION_FUEL]
    )


@kernel
def rates(model, work, state, base, phi, time, values, out):
    """Write time derivatives (N_INTEGRATED,) of ``values`` of the cylinder at ``base`` to ``out``. Return a status.

    ``phi`` is the crank angle after firing dead centre, rad, ``time`` that since the start of the communication step,
    s.
    """
    n, now, gas = model.numbers, work.now, model.gas
    mass = values[at.MASS]
    share, vapour, ratio = values[at.PRODUCTS] / mass, values[at.VAPOUR] / mass, state[base + at.RATIO]
    v = volume(n, phi) + deviation(now, time)
    if not (mass > 0.0 and v > 0.0):
        return COLD
    sparks = n[at.SPARKS] > 0.0
    x = flame(state, base, values) if sparks else 1.0
    if x < 1.0:
        p, t = two_zones(model, state, base, values, v, x, now[at.FOUND_P])
        r = p * v / (mass * t)
    else:
        r = gas_constant(gas, share)
        density = mass * r / v
        t = temperature_of(model, share, vapour, ratio, density, values[at.ENERGY] / mass, now[at.FOUND_T])
        if sparks:
            r = mixture(model, share, vapour, ratio, density, t)[2]
        p = mass * r * t / v
    if not t > 0.0:
        return COLD
    speed = now[at.NOW_SPEED]
    burnt = burn_rate(model, state, base, phi) * speed if state[base + at.PHASE] == at.BURNING else 0.0
    cooled = wall_flow(model, now, state, base, p, t, v)
    pushed = p * volume_rate(n, phi) * speed + p * deviation_rate(now, time)
    now[at.STIFFNESS] = 0.0
    for k in range(at.POOL, at.PORT + 1):
        out[k] = 0.0
    inward, h_in, share_in = intake_flow(model, now, phi, time, values, p, t, ratio, out)
    outward, h_out, share_out = exhaust_flow(model, now, phi, time, values, p, t, ratio, out)
    if sparks:  # the fuel is in the charge before it burns; its burnt gas has all of its air
        out[at.MASS] = inward - outward
        out[at.PRODUCTS] = share_in * inward - share_out * outward + burnt * (1.0 + n[at.AIR_DEMAND] / ratio)
        out[at.VAPOUR] = -burnt - vapour * (max(outward, 0.0) - min(inward, 0.0))
    else:
        out[at.MASS] = inward - outward + burnt
        out[at.PRODUCTS] = share_in * inward - share_out * outward + burnt * (1.0 + n[at.AIR_DEMAND])
        out[at.VAPOUR] = 0.0
    out[at.ENERGY] = n[at.HEATING_VALUE] * burnt - cooled - pushed + h_in * inward - h_out * outward
    out[at.DELAY] = 0.0
    if state[base + at.PHASE] == at.DELAYED:
        out[at.DELAY] = ignition_rate(
            p, t, ratio,
            n[at.IGNITION_FACTOR], n[at.IGNITION_EXPONENT], n[at.IGNITION_TEMPERATURE], n[at.IGNITION_BY_RATIO],
        )  # fmt: skip
    out[at.BURNT] = burnt
    out[at.WORK] = pushed
    out[at.WALL] = cooled
    out[at.INTAKE] = inward
    out[at.EXHAUST] = outward
    out[at.INTAKE_ENTHALPY] = h_in * inward
    out[at.EXHAUST_ENTHALPY] = h_out * outward
    now[at.FOUND_P] = p
    now[at.FOUND_T] = t
    now[at.STIFFNESS] *= 1.4 * r * t / v
    return OK


@inlined_kernel
def intake_flow(model, now, phi, time, values, p, t, ratio, out):
    """Flow into the cylinder through the intake valve, kg/s, its enthalpy, J/kg, and its fraction of products.

    Gas that flows back stays in the port as a pool and returns first; ``out`` gets the rates of this pool.
    """
    n = model.numbers
    area = valve_area(
        lifts(model, now, phi, time)[0],
        n[at.INTAKE_DIAMETER],
        n[at.INTAKE_COUNT],
        n[at.CURTAIN],
        n[at.PORT_COEFFICIENT],
    )
    if area <= 0.0:
        return 0.0, 0.0, 0.0
    share, vapour = values[at.PRODUCTS] / values[at.MASS], values[at.VAPOUR] / values[at.MASS]
    h, c, r, _ = mixture(model, share, vapour, ratio, p / t, t)
    now[at.STIFFNESS] += flow_slope(area, t, r, p, now[at.NOW_INTAKE_P])
    if p > now[at.NOW_INTAKE_P]:
        flow = nozzle_flow(area, p, t, r, c / (c - r), now[at.NOW_INTAKE_P])
        out[at.POOL] = flow
        out[at.POOL_PRODUCTS] = flow * share
        out[at.POOL_ENTHALPY] = flow * h
        return -flow, h, share
    fresh = n[at.INTAKE_SHARE]
    density = now[at.NOW_INTAKE_P] / now[at.NOW_INTAKE_T]
    h, c, r, _ = mixture(model, fresh, 0.0, ratio, density, now[at.NOW_INTAKE_T])
    flow = nozzle_flow(area, now[at.NOW_INTAKE_P], now[at.NOW_INTAKE_T], r, c / (c - r), p)
    pool = max(values[at.POOL], 0.0)
    # The factor is per mass of pool and mixed gas, which avoids a division by an empty pool.
    part = 1.0 / (pool + POOL_SHARE * n[at.MASS_SCALE])
    taken = pool * part
    h = values[at.POOL_ENTHALPY] * part + (1.0 - taken) * h
    share = values[at.POOL_PRODUCTS] * part + (1.0 - taken) * fresh
    out[at.POOL] = -flow * taken
    out[at.POOL_PRODUCTS] = -flow * values[at.POOL_PRODUCTS] * part
    out[at.POOL_ENTHALPY] = -flow * values[at.POOL_ENTHALPY] * part
    return flow, h, share


@inlined_kernel
def exhaust_flow(model, now, phi, time, values, p, t, ratio, out):
    """Flow out of the cylinder through the exhaust valve, kg/s, its enthalpy, J/kg, and its fraction of products.

    Gas that flows back has the manifold's temperature and the port's fraction of products, which follows that of the
    outflow.
    """
    n = model.numbers
    lift = lifts(model, now, phi, time)[1]
    area = valve_area(lift, n[at.EXHAUST_DIAMETER], n[at.EXHAUST_COUNT], n[at.CURTAIN], n[at.PORT_COEFFICIENT])
    if area <= 0.0:
        return 0.0, 0.0, 0.0
    share, vapour = values[at.PRODUCTS] / values[at.MASS], values[at.VAPOUR] / values[at.MASS]
    h, c, r, _ = mixture(model, share, vapour, ratio, p / t, t)
    now[at.STIFFNESS] += flow_slope(area, t, r, p, now[at.NOW_EXHAUST_P])
    if p > now[at.NOW_EXHAUST_P]:
        flow = nozzle_flow(area, p, t, r, c / (c - r), now[at.NOW_EXHAUST_P])
        out[at.PORT] = flow * (share - values[at.PORT]) / n[at.PORT_MASS]
        return flow, h, share
    share = values[at.PORT]
    density = now[at.NOW_EXHAUST_P] / now[at.NOW_EXHAUST_T]
    h, c, r, _ = mixture(model, share, 0.0, ratio, density, now[at.NOW_EXHAUST_T])
    flow = nozzle_flow(area, now[at.NOW_EXHAUST_P], now[at.NOW_EXHAUST_T], r, c / (c - r), p)
    return -flow, h, share


@kernel
def fill(model, state, base, phi, pressure, temperature, share):
    """Fill a cylinder with gas of a given pressure (Pa), temperature (K) and fraction of products."""
    gas = model.gas
    space = volume(model.numbers, phi) + state[base + at.DEVIATION]
    mass = pressure * space / (gas_constant(gas, share) * temperature)
    state[base + at.MASS] = mass
    state[base + at.PRODUCTS] = share * mass
    state[base + at.ENERGY] = mass * internal_energy(gas, share, temperature)
    state[base + at.PRESSURE] = pressure
    state[base + at.TEMPERATURE] = temperature
    state[base + at.RATIO] = model.numbers[at.SPARKS]  # λ = 1 of the first residual gas
