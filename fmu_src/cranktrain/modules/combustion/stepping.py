"""Integration of a cylinder over a communication step by Dormand and Prince's method with step control.

Steps end at the events of a cycle: new cycle, sampling of the fuel, start of injection, edges of the built-in lifts,
ends of the burns. The angle of ignition is not known beforehand; a step ends at the root of the delay's integral. Error
estimates are relative to the scales of a charge.

Source: J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.modules.combustion import slots as at
from cranktrain.modules.combustion.cycle_events import closed_or_open, ignite, new_cycle, next_angle, pass_angle
from cranktrain.modules.combustion.cylinder import OK, rates

STAGES = 7
FIRST, TRIAL, LAST = 0, STAGES, STAGES - 1
"""Rows of the workspace: rates of the stages, then values of a stage or of the end of the step."""
ROWS = STAGES + 1
LONGEST = math.radians(2.0) * (1.0 + 1.0e-9)
"""Longest step, rad of crank angle: two degrees with a margin for rounding."""
STABLE = 2.0
"""Longest step over the time constant of valve flow between nearly equal pressures; the stability limit is 3.3."""
MOST_PASSES = 2_000_000
"""Largest number of steps of one cylinder in a communication step (seconds of work); more count as a failure."""
SHORTEST = 1.0e-13
"""Shortest step, s; if it is still rejected, the integration has failed."""
FAILED = 2
_SAFETY, _SHRINK, _GROW = 0.9, 0.2, 5.0
_AT_REST = 1.0e-4
"""First step, s, of a cylinder while the crank is at rest."""


@inlined_kernel
def stage(model, work, state, base, phi, time, row):
    """Compute the rates at the values ``work.rows[TRIAL]`` into a row. Return a status."""
    return rates(model, work, state, base, phi, time, work.rows[TRIAL], work.rows[row])


@kernel
def attempt(model, work, state, base, time, h):
    """Try a step of length h, s, from the state and the rates in row FIRST. Return its error over tolerance.

    Row TRIAL receives the values at the end of the step, row LAST their rates. Returns −1 on failure.
    """
    rows, a, c, e = work.rows, model.tableau, model.nodes, model.defects
    phi, speed = state[base + at.PHI], work.now[at.NOW_SPEED]
    for s in range(1, STAGES):
        for k in range(at.N_INTEGRATED):
            total = 0.0
            for j in range(s):
                total += a[s, j] * rows[j, k]
            rows[TRIAL, k] = state[base + k] + h * total
        if stage(model, work, state, base, phi + c[s] * h * speed, time + c[s] * h, s) != OK:
            return -1.0
    worst = 0.0
    numbers = model.numbers
    for k in (at.MASS, at.PRODUCTS, at.ENERGY, at.DELAY, at.PORT):
        total = 0.0
        for j in range(STAGES):
            total += e[j] * rows[j, k]
        scale = 1.0
        if k in (at.MASS, at.PRODUCTS):
            scale = numbers[at.MASS_SCALE]
        elif k == at.ENERGY:
            scale = numbers[at.ENERGY_SCALE]
        error = abs(h * total) / (numbers[at.TOLERANCE] * scale)
        if not error < 1.0e30:
            return -1.0
        worst = max(worst, error)
    return worst


@kernel
def ignition_step(work, state, base, h):
    """Length, s, from a step of length h to the root where the delay's integral is 1, by its cubic over the step."""
    start, end = state[base + at.DELAY], work.rows[TRIAL, at.DELAY]
    first, last = h * work.rows[FIRST, at.DELAY], h * work.rows[LAST, at.DELAY]
    low, high = 0.0, 1.0
    for _ in range(60):
        x = 0.5 * (low + high)
        y = 1.0 - x
        value = y * y * ((1.0 + 2.0 * x) * start + x * first) + x * x * ((3.0 - 2.0 * x) * end - y * last)
        if value < 1.0:
            low = x
        else:
            high = x
    return high * h


@kernel
def accept(model, work, state, base, time, h, phi):
    """Store the end of a step in the state; ``phi`` is the crank angle reached."""
    for k in range(at.N_INTEGRATED):
        state[base + k] = work.rows[TRIAL, k]
        work.rows[FIRST, k] = work.rows[LAST, k]
    state[base + at.PHI] = phi
    state[base + at.CLOCK] += h
    state[base + at.PRESSURE] = work.now[at.FOUND_P]
    state[base + at.TEMPERATURE] = work.now[at.FOUND_T]
    if state[base + at.PRESSURE] > state[base + at.PEAK]:
        state[base + at.PEAK] = state[base + at.PRESSURE]
        state[base + at.PEAK_ANGLE] = phi
    return closed_or_open(model, work, state, base, time + h)


@kernel
def first_rates(model, work, state, base, time):
    """Compute the rates at the state into row FIRST. Return a status."""
    for k in range(at.N_INTEGRATED):
        work.rows[TRIAL, k] = state[base + k]
    work.now[at.FOUND_T] = state[base + at.TEMPERATURE]  # initial guesses of Newton's method, kept in the state
    work.now[at.FOUND_P] = state[base + at.PRESSURE]
    return stage(model, work, state, base, state[base + at.PHI], time, FIRST)


@kernel
def advance_cylinder(model, work, state, i, base, inputs, interval):
    """Advance cylinder i with its block at ``base`` by ``interval``, s, at the workspace's speed. Return a status."""
    speed = work.now[at.NOW_SPEED]
    time, again, passes = 0.0, True, 0
    while time < interval * (1.0 - 1.0e-14):
        passes += 1
        if passes > MOST_PASSES:
            return FAILED
        if again and first_rates(model, work, state, base, time) != OK:
            return FAILED
        again = False
        left = interval - time
        wanted = state[base + at.STEP]
        if not wanted > 0.0:
            wanted = 0.1 * LONGEST / speed if speed > 0.0 else _AT_REST
        if speed > 0.0:
            wanted = min(wanted, LONGEST / speed)
        if work.now[at.STIFFNESS] > 0.0:
            wanted = min(wanted, STABLE / work.now[at.STIFFNESS])
        h = min(wanted, left)
        goal = next_angle(model, work, state, base) if speed > 0.0 else 0.0
        lands = speed > 0.0 and state[base + at.PHI] + h * speed >= goal - 1.0e-12
        if lands:
            h = max((goal - state[base + at.PHI]) / speed, 0.0)
        error = 0.0
        while h > 0.0:
            error = attempt(model, work, state, base, time, h)
            if 0.0 <= error <= 1.0:
                break
            state[at.REJECTED] += 1.0
            h *= max(_SHRINK, _SAFETY * error**-0.2) if error > 1.0 else _SHRINK
            lands = False
            wanted = h
            if h < SHORTEST:
                return FAILED
        ignites = h > 0.0 and state[base + at.PHASE] == at.DELAYED and work.rows[TRIAL, at.DELAY] >= 1.0
        if ignites:
            h = ignition_step(work, state, base, h)
            lands = False
            if attempt(model, work, state, base, time, h) < 0.0:
                return FAILED
        if h > 0.0:
            phi = goal if lands else state[base + at.PHI] + h * speed
            again = accept(model, work, state, base, time, h, phi) or again
            state[at.STEPS] += 1.0
            time += h
            if not ignites and (h >= wanted or error > 0.0):
                grown = h * min(_GROW, _SAFETY * max(error, 1.0e-8) ** -0.2)
                state[base + at.STEP] = max(grown, wanted) if h < wanted else grown
        if ignites:
            ignite(model, state, i, base)
            again = True
        elif lands:
            state[base + at.PHI] = goal
            pass_angle(model, work, state, i, base, inputs, goal)
            again = True
        elif speed < 0.0 and state[base + at.PHI] < -2.0 * math.pi:
            new_cycle(state, base, state[base + at.PHI] + 4.0 * math.pi)
    return OK
