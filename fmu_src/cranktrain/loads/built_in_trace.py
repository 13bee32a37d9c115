"""Kernels of the built-in pressure trace: single-zone cycle, periodic spline, and its least smooth angles (kinks).

Equations and sources: :mod:`cranktrain.loads.gas_pressure`. The closed cycle is integrated by the classical Runge–Kutta
method. A periodic cubic spline through uniform values f has second derivatives s with (s₋ + 4 s + s₊)/6 = f₋ − 2 f + f₊
in units of the pitch; the inverse of the left side is √3 Σ λ^|k|, λ = √3 − 2, a recursion from either side.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel

CYCLE = 4.0 * math.pi
SAMPLES = 720
# Indices of an engine's constants: dimensions of a cylinder and values of engine.parts.Combustion, in SI units.
# BUILT_IN: 1 if a model uses the built-in trace. TRACE_CYCLE: angle of a cycle (rad).
TRACE_BORE, TRACE_COMPRESSION, TRACE_THROW, TRACE_ROD, TRACE_OFFSET, HEAT, INTAKE_PRESSURE = range(7)
INTAKE_TEMPERATURE, EXHAUST_PRESSURE, INTAKE_CLOSES, EXHAUST_OPENS, BURN_START, BURN_DURATION = range(7, 13)
WIEBE_A, WIEBE_M, WALL_TEMPERATURE, TRACE_SPEED, BUILT_IN, TRACE_CYCLE, TRACE_CONSTANTS = range(13, 20)
# Columns of a spline's table: powers 0 to 3 of the position in a cell; then rows of the scratch of :func:`renew_trace`.
VALUE, LINEAR, SQUARE, CUBE = range(4)
MOTORED, FIRED, SECOND, TRACE_ROWS = range(4)

KINKS, APART = 4, math.radians(5.0)
"""Largest number of kinks of a trace, and least angle between them (rad)."""
NO_KINK = -1.0
"""Placeholder for a missing kink."""
LEAST_KINK = 0.1
"""Least jump of the third derivative that counts as a kink, over the largest jump."""
STEPS = 4
"""Runge–Kutta steps in each interval of the trace; the error is then invisible in a plot."""
BLEND = math.radians(40.0)
"""Width (rad) of a transition between phases, short compared with the cycle and long compared with a degree."""
ROOT = math.sqrt(3.0) - 2.0
"""Factor λ of the recursion for a periodic spline's second derivatives."""


@kernel
def renew_trace(constants, rows, gas, kinks):
    """Compute a model's splines ``gas`` (2, SAMPLES, 4), motored and rise by combustion, and ``kinks`` (KINKS,).

    ``rows`` (TRACE_ROWS, SAMPLES) is scratch.
    """
    intake = constants[INTAKE_PRESSURE]
    fill_trace(constants, 0.0, intake, rows[MOTORED])
    fill_trace(constants, constants[HEAT], intake, rows[FIRED])
    for i in range(SAMPLES):
        rows[FIRED, i] -= rows[MOTORED, i]
    fill_spline(rows[MOTORED], rows[SECOND], gas[0])
    fill_spline(rows[FIRED], rows[SECOND], gas[1])
    fill_kinks(gas, kinks)


@kernel
def fill_trace(constants, heat, intake, samples):
    """Compute the pressure over 720°, ``samples`` (SAMPLES,) Pa, for a ``heat`` (J) and an ``intake`` pressure (Pa).

    The cycle of 360° of a two-stroke occurs twice.
    """
    closes = constants[INTAKE_CLOSES]
    opens = constants[EXHAUST_OPENS]
    exhaust = constants[EXHAUST_PRESSURE]
    pitch = CYCLE / SAMPLES
    cycle = constants[TRACE_CYCLE]
    count = SAMPLES
    blow_down = 1.5 * BLEND
    # Exhaust pressure passes into intake pressure about the dead centre of gas exchange. The transition ends long
    # before the blow-down, where the pressure must be exhaust pressure again.
    exchange_at = 2.0 * math.pi
    early = 0.5 * BLEND
    exchange_width = BLEND
    if cycle < CYCLE:
        # A two-stroke exchanges its gas about the other dead centre, by blow-down and scavenging.
        count = SAMPLES // 2
        blow_down = min(blow_down, 0.5 * (closes + cycle - opens))
        exchange_at = cycle - opens - blow_down
        early = 0.0
        exchange_width = closes + exchange_at
    # Angles run continuously over one cycle that ends with the blow-down.
    end = opens + blow_down
    first = 0
    while first * pitch < end:
        first += 1
    start, _ = trace_volume(constants, closes)
    mass_r = intake * start / constants[INTAKE_TEMPERATURE]
    pressure = intake
    before = closes
    for k in range(count):
        i = first + k if first + k < count else first + k - count
        after = i * pitch if i * pitch < end else i * pitch - cycle
        closed = intake
        if after >= closes:
            pressure = compressed_to(constants, heat, mass_r, before, after, pressure)
            before = after
            closed = pressure
        compressed = quintic((after - closes) / (0.5 * BLEND))
        expelled = quintic((after - opens) / blow_down)
        exchange = quintic((after + exchange_at + early) / exchange_width)
        own = exhaust + (intake - exhaust) * exchange
        own += (closed - intake) * compressed * (1.0 - expelled)
        samples[i] = own + (exhaust - intake) * expelled
    for i in range(count, SAMPLES):
        samples[i] = samples[i - count]


@inlined_kernel
def quintic(x):
    """Return a smooth step from 0 to 1 over x ∈ [0, 1] with two vanishing derivatives at both ends."""
    if x <= 0.0:
        return 0.0
    if x >= 1.0:
        return 1.0
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


@kernel
def trace_volume(constants, angle):
    """Return the volume above the piston (m³) at a crank angle after dead centre, rad, and its derivative (m³/rad)."""
    r = constants[TRACE_THROW]
    length = constants[TRACE_ROD]
    offset = constants[TRACE_OFFSET]
    area = 0.25 * math.pi * constants[TRACE_BORE] ** 2
    top = math.sqrt((length + r) ** 2 - offset * offset)
    stroke = top - math.sqrt((length - r) ** 2 - offset * offset)
    x = -r * math.sin(angle) - offset
    s = math.sqrt(length * length - x * x)
    volume = area * stroke / (constants[TRACE_COMPRESSION] - 1.0) + area * (top - r * math.cos(angle) - s)
    return volume, area * (r * math.sin(angle) - x * r * math.cos(angle) / s)


@kernel
def compressed_to(constants, heat, mass_r, before, after, pressure):
    """Integrate the pressure from angle ``before`` to ``after``; ``mass_r`` is gas mass times gas constant, J/K."""
    h = (after - before) / STEPS
    for k in range(STEPS):
        begin = before + k * h
        start = trace_volume(constants, begin)
        middle = trace_volume(constants, begin + 0.5 * h)
        end = trace_volume(constants, begin + h)
        k1 = pressure_slope(constants, heat, mass_r, begin, pressure, start)
        k2 = pressure_slope(constants, heat, mass_r, begin + 0.5 * h, pressure + 0.5 * h * k1, middle)
        k3 = pressure_slope(constants, heat, mass_r, begin + 0.5 * h, pressure + 0.5 * h * k2, middle)
        k4 = pressure_slope(constants, heat, mass_r, begin + h, pressure + h * k3, end)
        pressure += h * (k1 + 2.0 * (k2 + k3) + k4) / 6.0
    return pressure


@kernel
def pressure_slope(constants, heat, mass_r, angle, pressure, place):
    """Return dp/dθ (Pa/rad) of the single zone; ``place`` holds the volume and its derivative."""
    volume, derivative = place
    speed = constants[TRACE_SPEED]
    temperature = pressure * volume / mass_r
    gamma = 1.38 - 0.2 * math.exp(-900.0 / temperature)
    x = (angle - constants[BURN_START]) / constants[BURN_DURATION]
    burnt = 0.0
    if 0.0 < x <= 1.0:
        a = constants[WIEBE_A]
        m = constants[WIEBE_M]
        burnt = heat * a * (m + 1.0) * x**m * math.exp(-a * x ** (m + 1.0)) / constants[BURN_DURATION]
    piston_speed = 2.0 * constants[TRACE_THROW] * speed / math.pi
    film = 130.0 * volume**-0.06 * (1e-5 * pressure) ** 0.8 * temperature**-0.4 * (piston_speed + 1.4) ** 0.8
    wall = 0.5 * math.pi * constants[TRACE_BORE] ** 2 + 4.0 * volume / constants[TRACE_BORE]
    lost = film * wall * (temperature - constants[WALL_TEMPERATURE]) / speed
    return ((gamma - 1.0) * (burnt - lost) - gamma * pressure * derivative) / volume


@kernel
def fill_spline(samples, second, table):
    """Fit a periodic cubic spline through uniform ``samples`` (n,): ``table`` (n, 4); ``second`` (n,) is scratch."""
    n = samples.shape[0]
    # All periodic images are summed at once, because each further period multiplies a contribution by λⁿ.
    turn = 1.0 / (1.0 - ROOT**n)
    ahead = 0.0
    behind = 0.0
    power = 1.0
    for k in range(n):
        ahead += power * bend(samples, k)
        behind += power * bend(samples, n - 1 - k)
        power *= ROOT
    ahead *= turn
    behind *= turn
    # ``behind`` sums over points before the last value, ``ahead`` over points after the first one.
    for i in range(n):
        behind = bend(samples, i) + ROOT * behind
        second[i] = behind
    for i in range(n - 1, -1, -1):
        ahead = bend(samples, i) + ROOT * ahead
        second[i] = math.sqrt(3.0) * (second[i] + ahead - bend(samples, i))
    for i in range(n):
        following = i + 1 if i + 1 < n else 0
        table[i, VALUE] = samples[i]
        table[i, LINEAR] = samples[following] - samples[i] - (2.0 * second[i] + second[following]) / 6.0
        table[i, SQUARE] = 0.5 * second[i]
        table[i, CUBE] = (second[following] - second[i]) / 6.0


@inlined_kernel
def bend(samples, i):
    """Return the periodic second difference of the samples at i."""
    n = samples.shape[0]
    before = samples[i - 1] if i > 0 else samples[n - 1]
    after = samples[i + 1] if i + 1 < n else samples[0]
    return before - 2.0 * samples[i] + after


@kernel
def fill_kinks(tables, kinks):
    """Find increasing crank angles (rad) at which the sum of two splines is least smooth, ``kinks`` (k,) or NO_KINK."""
    n = tables.shape[1]
    pitch = CYCLE / n
    largest = 0.0
    for k in range(kinks.shape[0]):
        kinks[k] = NO_KINK
    for count in range(kinks.shape[0]):
        best = 0.0
        place = 0
        for i in range(n):
            jump = abs((tables[0, i, CUBE] + tables[1, i, CUBE]) - (tables[0, i - 1, CUBE] + tables[1, i - 1, CUBE]))
            if jump > best and apart(kinks, count, i * pitch):
                best = jump
                place = i
        largest = max(largest, best)
        if best <= LEAST_KINK * largest:
            break
        # Sort the kinks by angle.
        at = count
        while at > 0 and kinks[at - 1] > place * pitch:
            kinks[at] = kinks[at - 1]
            at -= 1
        kinks[at] = place * pitch


@inlined_kernel
def apart(kinks, count, angle):
    """True if an angle is far enough from the first ``count`` kinks."""
    for k in range(count):
        away = angle - kinks[k]
        away -= CYCLE * math.floor(away / CYCLE + 0.5)
        if abs(away) <= APART:
            return False
    return True
