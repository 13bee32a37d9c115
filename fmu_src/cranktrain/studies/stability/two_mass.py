"""Two masses, each a simulation of its own, and the minimal master that couples them.

    m₁ ẍ₁ = −c₁ x₁ − d₁ ẋ₁ + F,   m₂ ẍ₂ = −c₂ x₂ − d₂ ẋ₂ − F,   F = c_c (x₂ − x₁) + d_c (ẋ₂ − ẋ₁)

Split between them where the coupling spring ends: *force/displacement* gives the spring to the second mass, which hands
the first one F and takes x₁, ẋ₁; *displacement/displacement* gives it to both, and each takes the other's motion.

The master sees its slaves at the communication points only. It hands on inputs as polynomials in time, of degree 0
(hold), 1 (linear) or 2 (quadratic): through the last values where the new one is not known (Jacobi, and the first slave
of Gauss–Seidel), through the new value and the last ones where it is (the second slave of Gauss–Seidel; hold then holds
the new value). Outputs are read after inputs are set, so F belongs to the newest x₁ that is known.

This linear system is solved twice. :func:`amplification` carries each slave over a step by matrix exponentials: exact,
no step inside. :func:`growth` has slaves that integrate in small steps by one of the running model's own integrators,
as real ones do, and looks at how their motion grows. Stability of such schemes: Busch (2016), *Continuous approximation
techniques for co-simulation methods*, ZAMM 96, 1061–1081; Schweizer, Li, Lu (2015), *Explicit and implicit
cosimulation methods: stability and convergence analysis*, J. Comput. Nonlinear Dyn. 10, 051007.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import expm

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.kernel import kernel
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.time.integrator_tables import integrator_table
from cranktrain.dynamics.time.integrators import coefficients
from cranktrain.studies.stability.stability_map import bisected

DECOMPOSITIONS = {"force/displacement": 0, "displacement/displacement": 1}
SEQUENCES = {"jacobi": 0, "gauss-seidel 1-2": 1, "gauss-seidel 2-1": 2}
RECONSTRUCTIONS = {"hold": 0, "linear": 1, "quadratic": 2}
# Coupled state: x₁, v₁, x₂, v₂, then of each slave's two inputs the values now and at the last two points.
SIZE = 16
_FIRST_INPUT, _SECOND_INPUT = 4, 10
INTEGRATOR = integrator_table("sdirk4")
"""The slaves' own: one whose stages are all implicit, and so needs no acceleration to start with."""
INNER_STEP = 0.15
"""Its step over 1/ω of the slave's fastest motion."""
SHORTEST_SHARE, SCANNED = 2.0e-2, 90
"""Communication steps at which instability is looked for: the first over the longest, and how many."""
LARGE, SMALL = 1.0e12, 1.0e-12
"""Motion, over its start, at which growth or decay is no longer in doubt."""


@dataclass(frozen=True)
class TwoMass:
    """Masses, springs and dampers to ground, and what couples them; any consistent units."""

    m1: float = 1.0
    m2: float = 1.0
    c1: float = 1.0
    c2: float = 1.0
    cc: float = 1.0
    d1: float = 0.1
    d2: float = 0.1
    dc: float = 0.1


@dataclass(frozen=True)
class Coupling:
    """How the two are coupled; ``InputError`` for what does not exist."""

    decomposition: str = "force/displacement"
    sequence: str = "jacobi"
    reconstruction: str = "hold"

    def __post_init__(self) -> None:
        for value, valid, what in (
            (self.decomposition, DECOMPOSITIONS, "decomposition"),
            (self.sequence, SEQUENCES, "sequence"),
            (self.reconstruction, RECONSTRUCTIONS, "reconstruction"),
        ):
            if value not in valid:
                raise InputError(f"{what} '{value}' does not exist; {nearest(value, valid)}")


def amplification(masses: TwoMass, coupling: Coupling, step: float) -> Array:
    """Matrix (16, 16) that one communication step applies to the coupled state, slaves solved exactly."""
    degree = RECONSTRUCTIONS[coupling.reconstruction]
    known, renewed = _polynomial(degree, 0), _polynomial(degree, 1)
    first, second = _slaves(masses, coupling)
    z = np.eye(SIZE)
    motion = z[:2], z[2:4]
    inputs = [z[o : o + 6].reshape(3, 2, SIZE) for o in (_FIRST_INPUT, _SECOND_INPUT)]

    def carried(slave: tuple[Array, Array], start: Array, values: Array, through: Array) -> Array:
        flow, answers = _propagation(*slave, step, degree)
        powers = np.tensordot(through, values[: degree + 1], axes=1)
        return np.asarray(flow @ start + sum(a @ p for a, p in zip(answers, powers, strict=True)))

    def force(of_second: Array, of_first: Array) -> Array:
        if DECOMPOSITIONS[coupling.decomposition]:
            return of_second
        pull = masses.cc * (of_second[0] - of_first[0]) + masses.dc * (of_second[1] - of_first[1])
        return np.stack((pull, np.zeros(SIZE)))

    if coupling.sequence == "gauss-seidel 2-1":
        new_second = carried(second, motion[1], inputs[1], known)
        expected = np.tensordot(known.sum(axis=0), inputs[1][: degree + 1], axes=1)
        to_first = force(new_second, expected)
        new_first = carried(first, motion[0], np.concatenate((to_first[None], inputs[0])), renewed)
        to_second = new_first
    else:
        to_second = new_first = carried(first, motion[0], inputs[0], known)
        if coupling.sequence == "jacobi":
            new_second = carried(second, motion[1], inputs[1], known)
        else:
            new_second = carried(second, motion[1], np.concatenate((to_second[None], inputs[1])), renewed)
        to_first = force(new_second, to_second)
    after = [new_first, new_second, to_first, *inputs[0][:2], to_second, *inputs[1][:2]]
    return np.concatenate(after)


def spectral_radius(masses: TwoMass, coupling: Coupling, step: float) -> float:
    """Factor by which the coupled motion grows in a communication step in the long run, slaves solved exactly."""
    return float(np.abs(np.linalg.eigvals(amplification(masses, coupling, step))).max())


def critical_step(masses: TwoMass, coupling: Coupling, longest: float, tolerance: float = 1.0e-12) -> float:
    """Smallest communication step at which the coupled motion begins to grow; infinite where none to ``longest``."""

    def unstable(step: float) -> bool:
        return spectral_radius(masses, coupling, step) > 1.0

    steps = np.geomspace(SHORTEST_SHARE * longest, longest, SCANNED)
    for low, high in pairwise(steps):
        if unstable(float(high)):
            return bisected(unstable, float(low), float(high), tolerance)
    return math.inf


def starting_state(masses: TwoMass, coupling: Coupling, motion: Array) -> Array:
    """Coupled state (16,) whose motion (4,) is x₁, v₁, x₂, v₂ and whose inputs have been what they are."""
    z = np.zeros(SIZE)
    z[:4] = motion
    to_first = np.array(motion[2:4])
    if not DECOMPOSITIONS[coupling.decomposition]:
        to_first[:] = masses.cc * (motion[2] - motion[0]) + masses.dc * (motion[3] - motion[1]), 0.0
    z[_FIRST_INPUT:_SECOND_INPUT] = np.tile(to_first, 3)
    z[_SECOND_INPUT:] = np.tile(motion[:2], 3)
    return z


def couple(
    masses: TwoMass,
    coupling: Coupling,
    step: float,
    motion: Array,
    count: int,
    inner_step: float = INNER_STEP,
) -> Array:
    """Motion x₁, v₁, x₂, v₂ (count + 1, 4) of coupled slaves that integrate by themselves, from ``motion`` (4,) on.

    ``inner_step`` is the step of their integrator over 1/ω of the faster one.
    """
    z = starting_state(masses, coupling, motion)
    history = np.zeros((count + 1, 4))
    history[0] = motion
    _run(masses, coupling, step, z, history, inner_step)
    return history


def growth(masses: TwoMass, coupling: Coupling, step: float, count: int = 3000) -> float:
    """Logarithm by which the motion of coupled slaves grows per communication step, seen over ``count`` steps.

    Both masses set out from a displacement. The last third of the steps is compared with the third before it: what dies
    out has died by then, and beats average out.
    """
    z = starting_state(masses, coupling, np.array([1.0, 0.0, -0.3, 0.0]))
    span = np.zeros((count // 3 + 1, 4))
    sizes: list[float] = []
    for _ in range(3):
        done = _run(masses, coupling, step, z, span)
        size = float(np.sqrt(np.mean(span[1 : done + 1] ** 2)))
        if done < span.shape[0] - 1 or not SMALL < size < LARGE:
            return math.log(max(float(np.abs(z[:4]).max()), 1.0e-300)) / (len(sizes) * (span.shape[0] - 1) + done)
        sizes.append(size)
    return math.log(sizes[2] / sizes[1]) / (span.shape[0] - 1)


def simulated_onset(masses: TwoMass, coupling: Coupling, low: float, high: float, tolerance: float = 5.0e-4) -> float:
    """Communication step between ``low`` and ``high`` at which slaves that integrate begin to grow; else not a number.

    ``low`` must be stable, ``high`` unstable.
    """
    return bisected(lambda step: growth(masses, coupling, step) > 0.0, low, high, tolerance)


def _polynomial(degree: int, newest: int) -> Array:
    """Coefficients (degree + 1, degree + 1) of τ^k from values at τ = newest, newest − 1, ...; a step ends at 1."""
    return np.asarray(np.linalg.inv(np.vander(newest - np.arange(degree + 1.0), increasing=True)))


def _slaves(masses: TwoMass, coupling: Coupling) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Both slaves' matrices (2, 2) of motion and of inputs."""
    m = masses
    shared = DECOMPOSITIONS[coupling.decomposition]

    def slave(mass: float, c: float, d: float, own: int, pull: tuple[float, float]) -> tuple[Array, Array]:
        motion = np.array([[0.0, 1.0], [-(c + own * m.cc) / mass, -(d + own * m.dc) / mass]])
        return motion, np.array([[0.0, 0.0], [pull[0] / mass, pull[1] / mass]])

    return (
        slave(m.m1, m.c1, m.d1, shared, (m.cc, m.dc) if shared else (1.0, 0.0)),
        slave(m.m2, m.c2, m.d2, 1, (m.cc, m.dc)),
    )


def _propagation(motion: Array, inputs: Array, step: float, degree: int) -> tuple[Array, list[Array]]:
    """Flow over a step, and the answers (2, 2) to inputs that go with (τ/H)^k, k up to ``degree``."""
    n = 2 * (degree + 2)
    system = np.zeros((n, n))
    system[:2, :2] = motion * step
    system[:2, 2:4] = inputs * step
    for k in range(degree):
        # A chain of integrators makes τ^k/k!.
        system[2 + 2 * k : 4 + 2 * k, 4 + 2 * k : 6 + 2 * k] = np.eye(2)
    flow = expm(system)
    answers = [math.factorial(k) * flow[:2, 2 + 2 * k : 4 + 2 * k] for k in range(degree + 1)]
    return flow[:2, :2], answers


def _run(
    masses: TwoMass,
    coupling: Coupling,
    step: float,
    z: Array,
    history: Array,
    inner_step: float = INNER_STEP,
) -> int:
    slaves = np.array([
        [m, -motion[1, 0] * m, -motion[1, 1] * m, *(inputs[1] * m)]
        for m, (motion, inputs) in zip((masses.m1, masses.m2), _slaves(masses, coupling), strict=True)
    ])  # fmt: skip
    fastest = math.sqrt(max(slaves[0, 1] / slaves[0, 0], slaves[1, 1] / slaves[1, 0]))
    inner = max(1, math.ceil(step * fastest / inner_step))
    choices = np.array([
        DECOMPOSITIONS[coupling.decomposition], SEQUENCES[coupling.sequence], RECONSTRUCTIONS[coupling.reconstruction]
    ])  # fmt: skip
    spring = np.array([masses.cc, masses.dc])
    work = np.zeros((4, 8))
    return int(_master(INTEGRATOR, slaves, spring, choices, step, inner, z, history, work))


@kernel
def _master(table, slaves, spring, choices, step, inner, z, history, work):
    """Run the master over as many steps as ``history`` (count + 1, 4) has; returns how many were done.

    It ends early where the motion has grown or died beyond doubt.
    """
    count = history.shape[0] - 1
    degree = int(choices[2])
    for n in range(count):
        if choices[1] == 2:
            _slave(table, slaves[1], step, inner, z[2:], z[_SECOND_INPUT:], 0, degree, work)
            for k in range(2):
                work[3, k] = _value(z[_SECOND_INPUT:], k, 1.0, 0, degree)
            _push(z, _FIRST_INPUT, z[2], z[3], work[3, 0], work[3, 1], spring, choices)
            _slave(table, slaves[0], step, inner, z, z[_FIRST_INPUT:], 1, degree, work)
            _shift(z, _SECOND_INPUT, z[0], z[1])
        else:
            _slave(table, slaves[0], step, inner, z, z[_FIRST_INPUT:], 0, degree, work)
            if choices[1] == 1:
                _shift(z, _SECOND_INPUT, z[0], z[1])
                _slave(table, slaves[1], step, inner, z[2:], z[_SECOND_INPUT:], 1, degree, work)
            else:
                _slave(table, slaves[1], step, inner, z[2:], z[_SECOND_INPUT:], 0, degree, work)
                _shift(z, _SECOND_INPUT, z[0], z[1])
            _push(z, _FIRST_INPUT, z[2], z[3], z[0], z[1], spring, choices)
        largest = 0.0
        for k in range(4):
            history[n + 1, k] = z[k]
            largest = max(largest, abs(z[k]))
        if not SMALL < largest < LARGE:
            return n + 1
    return count


@kernel
def _shift(z, o, first, second):
    """Take a new value of both inputs into their history."""
    for k in (3, 2, 1, 0):
        z[o + 2 + k] = z[o + k]
    z[o] = first
    z[o + 1] = second


@kernel
def _push(z, o, x2, v2, x1, v1, spring, choices):
    """Hand the first slave what the second one gives it: its motion, or the spring's force."""
    if choices[0] == 1:
        _shift(z, o, x2, v2)
    else:
        _shift(z, o, spring[0] * (x2 - x1) + spring[1] * (v2 - v1), 0.0)


@kernel
def _value(values, k, tau, newest, degree):
    """Input k at τ (0 to 1 in the step) of the polynomial through its last values, the newest at τ = ``newest``."""
    s = tau - newest
    now = values[k]
    if degree == 0:
        return now
    before = values[2 + k]
    if degree == 1:
        return now + s * (now - before)
    earlier = values[4 + k]
    # Newton's backward differences.
    return now + s * (now - before) + 0.5 * s * (s + 1.0) * (now - 2.0 * before + earlier)


@kernel
def _slave(table, slave, step, inner, motion, values, newest, degree, work):
    """Integrate one mass over a communication step in ``inner`` steps of a diagonally implicit Runge–Kutta method."""
    h = step / inner
    stages = int(table[0, 1])
    c_q, c_v = coefficients(table, h)
    gamma = table[0, 2]
    last = table.shape[1] - 1
    effective = slave[0] + c_v * slave[2] + c_q * slave[1]
    for i in range(inner):
        for s in range(stages):
            v = motion[1]
            x = motion[0]
            for j in range(s):
                v += h * table[1 + s, j] * work[1, j]
                x += h * table[1 + s, j] * work[0, j]
            x += h * gamma * v
            tau = (i + table[1 + s, last]) / inner
            force = 0.0
            for k in range(2):
                force += slave[3 + k] * _value(values, k, tau, newest, degree)
            a = (force - slave[1] * x - slave[2] * v) / effective
            work[0, s] = v + c_v * a
            work[1, s] = a
            work[2, s] = x + c_q * a
        motion[0] = work[2, stages - 1]
        motion[1] = work[0, stages - 1]
