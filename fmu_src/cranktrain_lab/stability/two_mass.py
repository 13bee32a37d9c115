"""Two masses as separate simulations, coupled by a minimal co-simulation master.

    m₁ ẍ₁ = −c₁ x₁ − d₁ ẋ₁ + F,   m₂ ẍ₂ = −c₂ x₂ − d₂ ẋ₂ − F,   F = c_c (x₂ − x₁) + d_c (ẋ₂ − ẋ₁)

Split between them where the coupling spring ends: *force/displacement* gives the spring to the second mass, which hands
the first one F and takes x₁, ẋ₁; *displacement/displacement* gives it to both, and each takes the other's motion.

The master sees its slaves at the communication points only. It hands on inputs as polynomials in time, of degree 0
(hold), 1 (linear) or 2 (quadratic): through the last values where the new one is not known (Jacobi, and the first slave
of Gauss–Seidel), through the new value and the last ones where it is (the second slave of Gauss–Seidel; hold then holds
the new value). Outputs are read after inputs are set, so F belongs to the newest x₁ that is known.

This linear system is solved twice, with slaves carried over a step by matrix exponentials, exact and without a step
inside, and with slaves that integrate in small steps by one of the running model's own integrators, as real ones do.
Stability of such schemes: Busch (2016), *Continuous approximation
techniques for co-simulation methods*, ZAMM 96, 1061–1081; Schweizer, Li, Lu (2015), *Explicit and implicit
cosimulation methods: stability and convergence analysis*, J. Comput. Nonlinear Dyn. 10, 051007.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.time.integrators import integrator_table
from cranktrain_lab.stability.amplification import step_matrix
from cranktrain_lab.stability.stability_map import Onset, onset

DECOMPOSITIONS = {"force/displacement": 0, "displacement/displacement": 1}
SEQUENCES = {"jacobi": 0, "gauss-seidel 1-2": 1, "gauss-seidel 2-1": 2}
RECONSTRUCTIONS = {"hold": 0, "linear": 1, "quadratic": 2}
# Coupled state: x₁, v₁, x₂, v₂, then two inputs of each slave, at present and at the last two points.
SIZE = 16
_FIRST_INPUT, _SECOND_INPUT = 4, 10
INTEGRATOR = integrator_table("sdirk4")
"""Integrator of the slaves. All stages are implicit, so the integrator needs no initial acceleration."""
INNER_STEP = 0.15
"""Step of the slaves' integrator in units of 1/ω of the slave's fastest motion."""
SHORTEST_SHARE, SCANNED, LEAST_SHARE = 2.0e-2, 90, 1.0e-6
"""Search for instability: shortest communication step over the longest, number of steps, and the least ratio to which
the search continues if the shortest step is unstable."""


@dataclass(frozen=True)
class TwoMass:
    """Masses, springs and dampers to ground, and coupling spring and damper, in consistent units."""

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
    """Coupling of the two masses; raises ``InputError`` for an unknown one."""

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


def amplification(masses: TwoMass, coupling: Coupling, step: float, inner_step: float | None = None) -> Array:
    """Return the matrix (16, 16) of one communication step for the coupled state.

    Slaves are solved exactly, or with ``inner_step`` integrated with this step in units of 1/ω of the faster one.
    """
    degree = RECONSTRUCTIONS[coupling.reconstruction]
    known, renewed = _polynomial(degree, 0), _polynomial(degree, 1)
    first, second = _slaves(masses, coupling)
    inner = 0
    if inner_step is not None:
        inner = max(1, math.ceil(step * math.sqrt(-min(first[0][1, 0], second[0][1, 0])) / inner_step))
    z = np.eye(SIZE)
    motion = z[:2], z[2:4]
    inputs = [z[o : o + 6].reshape(3, 2, SIZE) for o in (_FIRST_INPUT, _SECOND_INPUT)]

    def carried(slave: tuple[Array, Array], start: Array, values: Array, through: Array) -> Array:
        flow, answers = _integrated(*slave, step, degree, inner) if inner else _propagation(*slave, step, degree)
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


def spectral_radius(masses: TwoMass, coupling: Coupling, step: float, inner_step: float | None = None) -> float:
    """Return the asymptotic growth factor of the coupled motion per communication step."""
    return float(np.abs(np.linalg.eigvals(amplification(masses, coupling, step, inner_step))).max())


def critical_step(masses: TwoMass, coupling: Coupling, longest: float, tolerance: float = 1.0e-12) -> Onset:
    """Return the smallest communication step at which the coupled motion grows; infinite if none to ``longest``."""

    def unstable(step: float) -> bool:
        return spectral_radius(masses, coupling, step) > 1.0

    steps = np.geomspace(SHORTEST_SHARE * longest, longest, SCANNED)
    return onset(unstable, steps, tolerance, LEAST_SHARE * longest)


def growth(masses: TwoMass, coupling: Coupling, step: float) -> float:
    """Return the logarithmic growth per communication step of coupled slaves with their own integrators."""
    return math.log(spectral_radius(masses, coupling, step, INNER_STEP))


def simulated_onset(masses: TwoMass, coupling: Coupling, low: float, high: float) -> Onset:
    """Return the communication step at which integrating slaves begin to grow, searched from ``low`` to ``high``.

    If they already grow at ``low``, smaller steps are searched. The result is infinite if they do not grow at ``high``.
    """
    places, least = np.array([low, high]), SHORTEST_SHARE * low
    return onset(lambda step: growth(masses, coupling, step) > 0.0, places, 5.0e-4, least)


def _polynomial(degree: int, newest: int) -> Array:
    """Return coefficients (degree + 1, degree + 1) of τ^k from values at τ = newest, newest − 1, …; steps end at 1."""
    return np.asarray(np.linalg.inv(np.vander(newest - np.arange(degree + 1.0), increasing=True)))


def _slaves(masses: TwoMass, coupling: Coupling) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Return both slaves' matrices (2, 2) of motion and of inputs."""
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
    """Return the flow over a step, and responses (2, 2) to inputs proportional to (τ/H)^k, k up to ``degree``."""
    n = 2 * (degree + 2)
    system = np.zeros((n, n))
    system[:2, :2] = motion * step
    system[:2, 2:4] = inputs * step
    for k in range(degree):
        # A chain of integrators generates the inputs τ^k/k!.
        system[2 + 2 * k : 4 + 2 * k, 4 + 2 * k : 6 + 2 * k] = np.eye(2)
    flow = expm(system)
    answers = [math.factorial(k) * flow[:2, 2 + 2 * k : 4 + 2 * k] for k in range(degree + 1)]
    return flow[:2, :2], answers


def _integrated(motion: Array, inputs: Array, step: float, degree: int, inner: int) -> tuple[Array, list[Array]]:
    """Return flow and responses as :func:`_propagation`, for a slave with ``inner`` steps of its integrator."""
    h, n = step / inner, degree + 2
    # The state also contains powers of the time within a step, because these powers act as forces.
    damping = np.zeros((n, n))
    damping[0, 0] = -motion[1, 1]

    def system(time: float) -> tuple[Array, Array]:
        stiffness = np.zeros((n, n))
        stiffness[0] = -motion[1, 0], *(-((time / h) ** np.arange(degree + 1.0)))
        return stiffness, damping

    matrix = step_matrix(INTEGRATOR, h, system).real[[0, n]]
    # The powers of the time relative to the end of a step: (1 + s)^k.
    on = np.array([[math.comb(k, j) for k in range(degree + 1)] for j in range(degree + 1)])
    once = np.block([[matrix[:, [0, n]], matrix[:, 1:n]], [np.zeros((degree + 1, 2)), on]])
    whole = np.linalg.matrix_power(once, inner)[:2]
    response = whole[:, 2:] / float(inner) ** np.arange(degree + 1)
    return whole[:, :2], [np.outer(response[:, k], inputs[1]) for k in range(degree + 1)]
