"""A ring of nodes with the film's balance of oil, by which ways through time are compared.

    ∂(θH)/∂t + ∂φ(w θH − H³ ∂φu) + k H³ u = 0,   H = b − x cos φ − y sin φ,   u ≥ 0, θ ≤ 1, u (1 − θ) = 0

φ is the angle around, time the crank angle (rad), w = ½ for a bearing (0 between plates), k the flow through the ends
of a film that is parabolic across. Node 0 is a groove at pressure u₀. Transport is upwind, pressure flow central. A
free journal has m (x, y)¨ = W(t) + F with F = −∫ u (cos φ, sin φ) dφ.

Rules of a stage s of a Runge-Kutta method, g = hγ:

* START: voids by backward Euler from the start of the step, (θH − (θH)_n)/(c_s h) or, in nodes full then,
  Ḣ + (θ − 1) H/(c_s h); what elastic films did before decision 0017;
* STAGES: (θH − (θH)_n − h Σ_{j<s} a_sj F_j)/g with F_j minus the divergence of the flow of stage j.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cranktrain.dynamics.time.integrators import integrator_table
from cranktrain.dynamics.time.table import FIRST_STAGE, HEAD, NODE, STAGES

Array = NDArray[np.float64]
kernel: Any = njit(error_model="numpy")
START, STAGES_RULE = 0, 1
FREE_SIDES, FIXED_SIDES = 0, 1
"""Nodes change sides where they must; or keep those of the start, whatever their pressure or fill."""
PRESCRIBED, MOBILE, PLATES = 0, 1, 2
MOST, CLOSING = 60, 0.6
"""Newton iterations; part of the gap that one may close."""
SETTLED = 1.0e-10
IMPULSE, GAP, SWITCHED, LOWEST, ROW = 4, 6, 7, 8, 9
"""Columns of a run's rows behind the journal's place (2,) and velocity (2,)."""


class Ring(NamedTuple):
    """Constants of a ring."""

    nodes: int = 48
    drive: float = 0.5
    leak: float = 12.0
    groove: float = 0.002
    mass: float = 0.05
    load: float = 5.0


@dataclass
class State:
    """A film and its journal: unknowns u (minus the void fraction where ruptured), flows F of the last stage."""

    u: Array
    full: NDArray[np.bool_]
    rates: Array
    place: Array = field(default_factory=lambda: np.array([1.0, 0.2, -0.5]))  # b, x, y
    velocity: Array = field(default_factory=lambda: np.zeros(3))
    acceleration: Array = field(default_factory=lambda: np.zeros(3))

    def copy(self) -> State:
        """The same in other arrays."""
        return State(*(np.copy(value) for value in vars(self).values()))


def full_state(ring: Ring, motion: int) -> State:
    """A full film; a journal along the orbit, or at rest."""
    state = State(np.zeros(ring.nodes), np.ones(ring.nodes, dtype=bool), np.zeros(ring.nodes))
    if motion != MOBILE:
        pace(motion, 0.0, state.velocity)
        state.place = np.array([0.7, 0.0, 0.0]) if motion == PLATES else np.array([1.0, 0.30, -0.78])
    return state


def advance(ring: Ring, state: State, method: str, steps: int, span: float, way: tuple[int, int, int]) -> Array:
    """Advance ``state`` over ``span`` (rad) and return its rows (steps, ROW); ``way``: motion, rule, sides."""
    table = integrator_table(method)
    stages = int(table[HEAD, STAGES])
    rows = table[FIRST_STAGE : FIRST_STAGE + stages]
    found = np.zeros((steps, ROW))
    _run(tuple(ring), (np.ascontiguousarray(rows[:, :stages]), np.ascontiguousarray(rows[:, NODE])), way,
         tuple(vars(state).values()), span / steps, found)  # fmt: skip
    return found


def content(state: State) -> Array:
    """Oil θH of every node."""
    gaps = np.zeros((2, state.u.size))
    heights(state.place, gaps)
    return np.where(state.full, 1.0, 1.0 + state.u) * gaps[0]


@kernel
def heights(place, gaps):
    """Gaps at nodes and at the faces behind them, (2, n)."""
    n = gaps.shape[1]
    for i in range(2 * n):
        angle = math.pi * i / n
        gaps[i % 2, i // 2] = place[0] - place[1] * math.cos(angle) - place[2] * math.sin(angle)


@kernel
def pace(motion, t, velocity):
    """Velocity of the orbit at t: eccentricities from 0.6 to 0.95; of plates, gaps from 0.7 to 1.3."""
    velocity[:] = 0.0
    if motion == PLATES:
        velocity[0] = 0.3 * math.sin(t)
    else:
        velocity[1] = 0.20 * math.cos(0.5 * t) - 0.24 * math.sin(t)
        velocity[2] = 0.10 * math.sin(0.5 * t) + 0.16 * math.sin(t + 0.4)


@kernel
def pull(load, t, out):
    """Load of the journal at t: a peak a cycle beside slow parts."""
    out[0] = load * (0.4 * math.cos(0.5 * t) + 0.3 * math.sin(t))
    out[1] = -load * (0.5 + 2.0 * math.exp(-8.0 * (1.0 - math.cos(0.5 * t - 2.0))) + 0.2 * math.cos(t))


@kernel
def flows(ring, u, full, gaps, out):
    """Divergence of the flow at every node."""
    n, drive, leak = ring[0], ring[1], ring[2]
    per = n / (2.0 * math.pi)
    for i in range(n):
        out[i] = leak * gaps[0, i] ** 3 * u[i] if full[i] else 0.0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        drop = (u[i] if full[i] else 0.0) - (u[j] if full[j] else 0.0)
        fill = 1.0 if full[i] else 1.0 + u[i]
        through = per * (drive * gaps[1, i] * fill + per * gaps[1, i] ** 3 * drop)
        out[i] += through
        out[j] -= through


@kernel
def film_force(u, full):
    """F (2,)."""
    n = u.size
    x, y = 0.0, 0.0
    for i in range(n):
        if full[i]:
            x -= u[i] * math.cos(2.0 * math.pi * i / n)
            y -= u[i] * math.sin(2.0 * math.pi * i / n)
    return 2.0 * math.pi / n * x, 2.0 * math.pi / n * y


@kernel
def balance(ring, rule, known, film, motion, gaps, out):
    """Residual of every node; ``known``: contents, time, nodes full at the start; ``motion``: place and velocity."""
    held, time, was_full = known
    u, full = film
    place, velocity = motion
    n = ring[0]
    heights(place, gaps)
    flows(ring, u, full, gaps, out)
    for i in range(n):
        void = 0.0 if full[i] else u[i]
        if rule == START and was_full[i]:
            angle = 2.0 * math.pi * i / n
            out[i] += velocity[0] - velocity[1] * math.cos(angle) - velocity[2] * math.sin(angle)
            out[i] += void * gaps[0, i] / time
        else:
            out[i] += ((1.0 + void) * gaps[0, i] - held[i]) / time
    out[0] = u[0] - ring[3]


@kernel
def matrix(ring, time, full, gaps, a):
    """∂R/∂u into the first n rows and columns of ``a``."""
    n, drive, leak = ring[0], ring[1], ring[2]
    per = n / (2.0 * math.pi)
    a[:] = 0.0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        over = per * per * gaps[1, i] ** 3
        if full[i]:
            a[i, i] += leak * gaps[0, i] ** 3 + over
            a[j, i] -= over
        else:
            a[i, i] += gaps[0, i] / time + per * drive * gaps[1, i]
            a[j, i] -= per * drive * gaps[1, i]
        if full[j]:
            a[i, j] -= over
            a[j, j] += over
    a[0, :] = 0.0
    a[0, 0] = 1.0


@kernel
def move_rows(ring, rule, known, film, motion, big, a, right):
    """Rows and columns of a free journal behind those of the film; ``big``: Q, V, load and g of its stage."""
    u, full = film
    place, velocity = motion
    past, _, load, gain = big
    n, mass = ring[0], ring[4]
    gaps, low, high = np.zeros((2, n)), np.zeros(n), np.zeros(n)
    small = 1.0e-7
    for k in range(2):
        for sign in (-1.0, 1.0):
            place[1 + k] += sign * small
            velocity[1 + k] += sign * small / gain
            balance(ring, rule, known, film, motion, gaps, high if sign > 0.0 else low)
            place[1 + k] -= sign * small
            velocity[1 + k] -= sign * small / gain
        a[:n, n + k] = 0.5 * (high - low) / small
        a[n + k, n + k] = mass / gain**2
    force = film_force(u, full)
    for k in range(2):
        right[n + k] = load[k] + force[k] - mass * (place[1 + k] - past[1 + k]) / gain**2
    for i in range(n):
        if full[i]:
            a[n, i] = 2.0 * math.pi / n * math.cos(2.0 * math.pi * i / n)
            a[n + 1, i] = 2.0 * math.pi / n * math.sin(2.0 * math.pi * i / n)


@kernel
def solve_stage(ring, rule, way, known, film, motion, big):
    """Newton's method on nodes and journal; ``film`` and ``motion`` in: where to begin, out: the solution."""
    u, full = film
    place, velocity = motion
    n, mobile = ring[0], way[0] == MOBILE
    size = n + 2 if mobile else n
    a, right, residual, gaps = np.zeros((size, size)), np.zeros(size), np.zeros(n), np.zeros((2, n))
    for _ in range(MOST):
        if mobile:
            velocity[:] = big[1] + (place - big[0]) / big[3]
        balance(ring, rule, known, film, motion, gaps, residual)
        matrix(ring, known[1], full, gaps, a)
        right[:n] = -residual
        if mobile:
            move_rows(ring, rule, known, film, motion, big, a, right)
            a[0, n:] = 0.0
        step = np.linalg.solve(a, right)
        share = 1.0
        if mobile:
            for i in range(n):
                angle = 2.0 * math.pi * i / n
                closing = step[n] * math.cos(angle) + step[n + 1] * math.sin(angle)
                if closing * share > CLOSING * gaps[0, i]:
                    share = CLOSING * gaps[0, i] / closing
            place[1:] += share * step[n:]
        changed, largest = take_sides(step, share, u, full, way[2])
        if changed == 0 and share == 1.0 and largest < SETTLED:
            break


@kernel
def take_sides(step, share, u, full, fixed):
    """Add a step to the unknowns; nodes that changed sides, and the largest change."""
    n = u.size
    highest = 1.0e-9
    for i in range(n):
        u[i] += share * step[i]
        if full[i]:
            highest = max(highest, u[i])
    changed = 0
    largest = np.abs(step[n:]).max() if step.size > n else 0.0
    for i in range(n):
        largest = max(largest, abs(step[i]) / (highest if full[i] else 1.0))
        if fixed == FIXED_SIDES or i == 0:
            continue
        if full[i] and u[i] < -1.0e-13 * highest:
            full[i] = False
            u[i] = -1.0e-300
            changed += 1
        elif not full[i] and u[i] > 1.0e-13:
            full[i] = True
            u[i] = 0.0
            changed += 1
    return changed, largest


@kernel
def _run(ring, method, way, state, h, found):
    """Steps of a method from and into ``state``."""
    a, c = method
    motion, rule, _ = way
    u, full, rates, place, velocity, acceleration = state
    n, stages = u.size, c.size
    first = 1 if a[0, 0] == 0.0 else 0
    flown, pulled, paces = np.zeros((stages, n)), np.zeros((stages, 3)), np.zeros((stages, 3))
    forces, load, gaps, out = np.zeros((stages, 2)), np.zeros(2), np.zeros((2, n)), np.zeros(n)
    impulse = np.zeros(2)
    for k in range(found.shape[0]):
        heights(place, gaps)
        start = np.where(full, 1.0, 1.0 + u) * gaps[0]
        was_full, origin, origin_pace = full.copy(), place.copy(), velocity.copy()
        flown[0], pulled[0], paces[0] = rates, acceleration, velocity
        forces[0] = film_force(u, full)
        for s in range(first, stages):
            t, gain = h * (k + c[s]), h * a[s, s]
            past, past_pace, held = origin.copy(), origin_pace.copy(), start.copy()
            for j in range(s):
                past += h * a[s, j] * paces[j]
                past_pace += h * a[s, j] * pulled[j]
                if rule == STAGES_RULE:
                    held += h * a[s, j] * flown[j]
            if motion == MOBILE:
                past += gain * past_pace
                pull(ring[5], t, load)
            else:
                pace(motion, t, velocity)
                place[:] = past + gain * velocity
            time = gain if rule == STAGES_RULE else h * c[s]
            known, big = (held, time, was_full), (past, past_pace, load, gain)
            solve_stage(ring, rule, way, known, (u, full), (place, velocity), big)
            heights(place, gaps)
            flows(ring, u, full, gaps, out)
            flown[s], paces[s], pulled[s] = -out, velocity, (velocity - past_pace) / gain
            forces[s] = film_force(u, full)
        rates[:], acceleration[:] = flown[stages - 1], pulled[stages - 1]
        for s in range(stages):
            impulse += h * a[stages - 1, s] * forces[s]
        found[k, :2], found[k, 2:4], found[k, IMPULSE : IMPULSE + 2] = place[1:], velocity[1:], impulse
        found[k, GAP], found[k, SWITCHED], found[k, LOWEST] = gaps[0].min(), (full != was_full).sum(), u.min()
