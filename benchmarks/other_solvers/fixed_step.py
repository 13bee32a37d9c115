"""Integrators with a fixed step for first-order equations ẏ = f(t, y): what the stage solver is compared with.

* ``runge-kutta-4``: the classical explicit method of order 4, four stages (Kutta 1901); on an undamped oscillation
  stable to h ω = 2√2;
* ``central-differences``: explicit, order 2, one evaluation, for unknowns y = [q (n), v (n), then pairs of a position
  and its velocity]. Velocities are half a step behind and are carried to the step by the last acceleration, so that
  forces which depend on them keep the order; without such forces stable to h ω = 2 (Hughes, The Finite Element Method,
  9.1);
* ``radau-5``: Radau IIA of three stages, order 5, L-stable (Hairer & Wanner II, IV.8), simplified Newton iterations in
  the basis that makes the inverse of A block-diagonal: one real and one complex factorisation, kept while the
  iterations contract; they start from the last step's collocation polynomial.

The equations are a kernel at an address, called as ``f(*data, t, y, out)``; for Radau another one gives the transposed
Jacobian. Explicit methods that do not hold at a step say so; where Radau's iterations diverge its step is halved, up
to ``MAX_HALVINGS`` times.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.kernel import call_kernel, kernel
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.motion.linear_algebra import factor_lu, solve_lu

OK, UNBOUNDED, DIVERGED = 0, 1, 2
METHODS = ("runge-kutta-4", "central-differences", "radau-5")
ORDERS = {"runge-kutta-4": 4, "central-differences": 2, "radau-5": 5}
LIMITS = {"runge-kutta-4": 2.785, "central-differences": 1.0}
"""Step times the rate of a pure decay at which the explicit methods cease to be stable: roots of the Runge–Kutta
polynomial, and of z² + (3x/2 − 1) z − x/2 for velocities carried by the last acceleration."""
SLOWEST_CONTRACTION = 0.3
"""Contraction of Radau's iterations above which the Jacobian is made anew for the next step."""
MOST_ITERATIONS = 10
MAX_HALVINGS = 8
_NODES = np.array([(4.0 - math.sqrt(6.0)) / 10.0, (4.0 + math.sqrt(6.0)) / 10.0, 1.0])

# Rows of Radau's table: real eigenvalue of A⁻¹, real and imaginary part of the others; c; T; T⁻¹; start of the
# iterations; and columns of the first row.
EIGENVALUES, NODES, BASIS, INVERSE, START, N_ROWS = 0, 1, 2, 5, 8, 11
REAL, PAIR_REAL, PAIR_IMAGINARY = range(3)
# Rows of Memory.vectors for Radau: stages Z, these in the basis T, slopes there, where they are taken, a change.
STAGES, IN_BASIS, SLOPES, AT, CHANGE = 0, 3, 6, 9, 10
# Entries of Memory.numbers.
FACTOR_STEP, TOLERANCE, JACOBIANS, STEPS, LAST_STEP = range(5)


def _radau() -> Array:
    """Radau's table, (N_ROWS, 3).

    A⁻¹ = T Λ T⁻¹ with Λ = diag(γ, [[α, −β], [β, α]]).
    """
    powers = np.vander(_NODES, 3, increasing=True)
    # Collocation: A integrates polynomials exactly, Σ_j a_ij c_j^k = c_i^(k+1)/(k+1).
    a = (powers * _NODES[:, None] / np.array([1.0, 2.0, 3.0])) @ np.linalg.inv(powers)
    values, vectors = np.linalg.eig(np.linalg.inv(a))
    real = int(np.abs(values.imag).argmin())
    pair = int(values.imag.argmax())
    v = vectors[:, pair]
    # A⁻¹ (x + iy) = (α + iβ)(x + iy): in the basis (x, −y) its block is [[α, −β], [β, α]].
    basis = np.column_stack((vectors[:, real].real, v.real, -v.imag))
    table = np.zeros((N_ROWS, 3))
    table[EIGENVALUES] = values[real].real, values[pair].real, values[pair].imag
    table[NODES] = _NODES
    table[BASIS:INVERSE] = basis
    table[INVERSE:START] = np.linalg.inv(basis)
    nodes = np.append(0.0, _NODES)
    for j in range(3):
        others = np.delete(nodes, j + 1)
        weight = np.prod(nodes[j + 1] - others)
        at = [np.prod(s - others) / weight for s in 1.0 + _NODES]
        table[START:, j] = np.array(at) - np.prod(1.0 - others) / weight
    return table


_RADAU = _radau()


class Equations(NamedTuple):
    """ẏ = f(t, y): a kernel called as ``f(*data, t, y, out)``, and for Radau one that fills its transposed Jacobian."""

    address: int
    data: Any
    jacobian: int = 0


class Memory(NamedTuple):
    """What a method keeps from step to step, and its scratch."""

    vectors: Array  # (11, N) scratch; Z of the last step in STAGES
    table: Array  # (N_ROWS, 3)
    scale: Array  # (N,) size of each unknown, in which iterations are judged
    jacobian: Array  # (N, N) transposed
    real: Array  # (N, N)
    pivots: Array  # (2, N)
    complex: Any  # (N, N)
    column: Any  # (N,)
    numbers: Array  # (5,) step of the factors (0: none), tolerance, Jacobians made, steps done, last step


class FixedStep:
    """One method on one system of equations, stepped from outside.

    Parameters
    ----------
    method : one of ``METHODS``
    equations : Equations, with a Jacobian for Radau
    y : (N,) start values
    modes : n of y = [q (n), v (n), pairs], for central differences
    scale : (N,) size of each unknown; ``tolerance``: of Radau's iterations, in these sizes
    """

    def __init__(
        self,
        method: str,
        equations: Equations,
        y: Array,
        modes: int = 0,
        scale: Array | None = None,
        tolerance: float = 1.0e-8,
    ) -> None:
        if method not in METHODS:
            raise InputError(f"fixed-step method '{method}' does not exist; {nearest(method, METHODS)}")
        if method == "radau-5" and equations.jacobian == 0:
            raise InputError("radau-5 needs the equations' Jacobian")
        size = y.size
        implicit = size if method == "radau-5" else 1
        z = np.zeros
        self.method, self.y, self.time = method, y.copy(), 0.0
        self._equations, self._modes = equations, modes
        self._memory = Memory(
            z((11, size)), _RADAU.copy(), np.ones(size) if scale is None else scale.copy(), z((implicit, implicit)),
            z((implicit, implicit)), z((2, implicit)), z((implicit, implicit), complex), z(implicit, complex),
            np.array([0.0, tolerance, 0.0, 0.0, 0.0]),
        )  # fmt: skip

    @property
    def jacobians(self) -> int:
        """Jacobians made so far."""
        return int(self._memory.numbers[JACOBIANS])

    def advance(self, h: float, steps: int, bound: float = 1.0e12) -> int:
        """Take ``steps`` steps of length ``h``; OK, UNBOUNDED beyond ``bound`` (or not a number), or DIVERGED."""
        memory = self._memory
        if self.method == "runge-kutta-4":
            status = runge_kutta(self._equations, self.time, h, steps, bound, self.y, memory)
        elif self.method == "central-differences":
            status = leap(self._equations, self.time, h, steps, bound, self._modes, self.y, memory)
        else:
            status = self._collocated(h, steps, bound, MAX_HALVINGS)
        self.time += h * steps
        return int(status)

    def _collocated(self, h: float, steps: int, bound: float, halvings: int) -> int:
        """Steps of Radau, each halved where its iterations diverge."""
        for k in range(steps):
            kept = self.y.copy()
            now = self.time + k * h
            status = collocate(self._equations, now, h, bound, self.y, self._memory)
            if status == DIVERGED and halvings > 0:
                self.y[:] = kept
                self.time, before = now, self.time
                status = self._collocated(0.5 * h, 2, bound, halvings - 1)
                self.time = before
            if status != OK:
                return int(status)
        return OK


@kernel
def evaluate(equations, t, y, out):
    """Slopes at (t, y) into ``out`` (N,)."""
    return call_kernel(equations.address, equations.data + (t, y, out))  # noqa: RUF005


@kernel
def exceeds(y, bound):
    """Whether an unknown lies beyond the bound or is not a number."""
    within = True
    for i in range(y.shape[0]):
        within = within and abs(y[i]) < bound
    return not within


@kernel
def runge_kutta(equations, t, h, steps, bound, y, memory):
    """Steps of the classical Runge–Kutta method, in place on ``y``."""
    size = y.shape[0]
    total = memory.vectors[0]
    slope = memory.vectors[1]
    at = memory.vectors[2]
    for k in range(steps):
        now = t + k * h
        evaluate(equations, now, y, slope)
        for i in range(size):
            total[i] = slope[i]
        for stage in range(1, 4):
            share = 1.0 if stage == 3 else 0.5
            for i in range(size):
                at[i] = y[i] + share * h * slope[i]
            evaluate(equations, now + share * h, at, slope)
            weight = 1.0 if stage == 3 else 2.0
            for i in range(size):
                total[i] += weight * slope[i]
        for i in range(size):
            y[i] += h / 6.0 * total[i]
        if exceeds(y, bound):
            return UNBOUNDED
    return OK


@kernel
def leap(equations, t, h, steps, bound, modes, y, memory):
    """Steps of central differences, in place on ``y``: positions at the step, velocities carried there."""
    size = y.shape[0]
    behind = memory.vectors[0]
    slope = memory.vectors[1]
    for k in range(steps):
        evaluate(equations, t + k * h, y, slope)
        for j in range(modes + (size - 2 * modes) // 2):
            position = j if j < modes else 2 * j
            velocity = modes + j if j < modes else 2 * j + 1
            if memory.numbers[STEPS] == 0.0:
                behind[velocity] = y[velocity] - 0.5 * h * slope[velocity]
            behind[velocity] += h * slope[velocity]
            y[position] += h * behind[velocity]
            y[velocity] = behind[velocity] + 0.5 * h * slope[velocity]
        memory.numbers[STEPS] += 1.0
        if exceeds(y, bound):
            return UNBOUNDED
    return OK


@kernel
def factor_radau(equations, t, h, y, memory):
    """Make the Jacobian at (t, y), factorise γ/h − J and (α + iβ)/h − J; 0, or 1 where one is singular."""
    call_kernel(equations.jacobian, equations.data + (t, y, memory.jacobian))  # noqa: RUF005
    memory.numbers[JACOBIANS] += 1.0
    size = memory.real.shape[0]
    values = memory.table[EIGENVALUES]
    shift = complex(values[PAIR_REAL], values[PAIR_IMAGINARY]) / h
    for i in range(size):
        for j in range(size):
            memory.real[i, j] = -memory.jacobian[j, i]
            memory.complex[i, j] = complex(-memory.jacobian[j, i], 0.0)
        memory.real[i, i] += values[REAL] / h
        memory.complex[i, i] += shift
    memory.numbers[FACTOR_STEP] = h
    return factor_lu(memory.real, size, memory.pivots[0]) + factor_lu(memory.complex, size, memory.pivots[1])


@kernel
def combined(row, a, b, c):
    """Three numbers weighted by ``row`` (3,)."""
    return row[0] * a + row[1] * b + row[2] * c


@kernel
def iterate_radau(equations, now, h, y, memory):
    """Simplified Newton iterations for the stages Z in ``vectors``; contraction reached, or −1 where none is."""
    size = y.shape[0]
    table = memory.table
    z0, z1, z2 = memory.vectors[STAGES], memory.vectors[STAGES + 1], memory.vectors[STAGES + 2]
    for s in range(3):
        for i in range(size):
            memory.vectors[IN_BASIS + s, i] = combined(table[INVERSE + s], z0[i], z1[i], z2[i])
    last = 0.0
    contraction = 0.0
    for iteration in range(MOST_ITERATIONS):
        at = memory.vectors[AT]
        for s in range(3):
            for i in range(size):
                at[i] = y[i] + memory.vectors[STAGES + s, i]
            evaluate(equations, now + table[NODES, s] * h, at, memory.vectors[SLOPES + s])
        norm = change_radau(h, size, memory)
        if not norm < 1.0e12:
            return -1.0
        if iteration > 0:
            contraction = norm / last if last > 0.0 else 0.0
            if contraction >= 1.0 and norm > memory.numbers[TOLERANCE]:
                return -1.0
        last = norm
        # What is left is a geometric series of what was just done.
        rest = norm * contraction / (1.0 - contraction) if 0.0 < contraction < 1.0 else norm
        if rest <= memory.numbers[TOLERANCE]:
            return contraction
    return -1.0


@kernel
def change_radau(h, size, memory):
    """Change the stages by one Newton iteration; returns the root mean square of the change over ``scale``."""
    table = memory.table
    values = table[EIGENVALUES]
    v = memory.vectors
    w0, w1, w2 = v[IN_BASIS], v[IN_BASIS + 1], v[IN_BASIS + 2]
    f0, f1, f2 = v[SLOPES], v[SLOPES + 1], v[SLOPES + 2]
    shift = complex(values[PAIR_REAL], values[PAIR_IMAGINARY]) / h
    for i in range(size):
        real = combined(table[INVERSE], f0[i], f1[i], f2[i])
        v[CHANGE, i] = real - values[REAL] / h * w0[i]
        pair = complex(
            combined(table[INVERSE + 1], f0[i], f1[i], f2[i]), combined(table[INVERSE + 2], f0[i], f1[i], f2[i])
        )
        memory.column[i] = pair - shift * complex(w1[i], w2[i])
    solve_lu(memory.real, size, memory.pivots[0], v[CHANGE])
    solve_lu(memory.complex, size, memory.pivots[1], memory.column)
    total = 0.0
    for i in range(size):
        d0 = v[CHANGE, i]
        d1 = memory.column[i].real
        d2 = memory.column[i].imag
        w0[i] += d0
        w1[i] += d1
        w2[i] += d2
        for s in range(3):
            v[STAGES + s, i] = combined(table[BASIS + s], w0[i], w1[i], w2[i])
            total += (combined(table[BASIS + s], d0, d1, d2) / memory.scale[i]) ** 2
    return math.sqrt(total / (3.0 * size))


@kernel
def collocate(equations, now, h, bound, y, memory):
    """One step of Radau IIA of order 5, in place on ``y``."""
    size = y.shape[0]
    stages = memory.vectors[STAGES:IN_BASIS]
    fresh = memory.numbers[FACTOR_STEP] != h
    if fresh and factor_radau(equations, now, h, y, memory) != 0:
        return DIVERGED
    # The polynomial of a step of another length tells nothing.
    known = 1.0 if memory.numbers[LAST_STEP] == h else 0.0
    memory.numbers[LAST_STEP] = h
    for i in range(size):
        z0 = known * stages[0, i]
        z1 = known * stages[1, i]
        z2 = known * stages[2, i]
        for s in range(3):
            stages[s, i] = combined(memory.table[START + s], z0, z1, z2)
    contraction = iterate_radau(equations, now, h, y, memory)
    if contraction < 0.0:
        if not fresh and factor_radau(equations, now, h, y, memory) != 0:
            return DIVERGED
        stages[:, :] = 0.0
        contraction = iterate_radau(equations, now, h, y, memory)
        if contraction < 0.0:
            return DIVERGED
    if contraction > SLOWEST_CONTRACTION:
        memory.numbers[FACTOR_STEP] = 0.0
    for i in range(size):
        y[i] += stages[2, i]
    memory.numbers[STEPS] += 1.0
    return UNBOUNDED if exceeds(y, bound) else OK
