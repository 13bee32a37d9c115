"""Integrators with a fixed step for first-order equations ẏ = f(t, y): what the stage solver is held against.

* ``runge-kutta-4``: the classical explicit method of order 4, four stages (Kutta 1901); on an undamped oscillation
  stable to h ω = 2√2;
* ``central-differences``: explicit, order 2, one evaluation, for unknowns y = [q (n), v (n), then pairs of a position
  and its velocity]. Velocities stand half a step behind and are carried to the step by the last acceleration, so that
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


def _radau() -> Array:
    """Rows: real eigenvalue of A⁻¹, real and imaginary part of the others; c; T; T⁻¹; start of the iterations, (11, 3).

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
    table = np.zeros((11, 3))
    table[0] = values[real].real, values[pair].real, values[pair].imag
    table[1] = _NODES
    table[2:5] = basis
    table[5:8] = np.linalg.inv(basis)
    nodes = np.append(0.0, _NODES)
    for j in range(3):
        others = np.delete(nodes, j + 1)
        weight = np.prod(nodes[j + 1] - others)
        at = [np.prod(s - others) / weight for s in 1.0 + _NODES]
        table[8:11, j] = np.array(at) - np.prod(1.0 - others) / weight
    return table


_RADAU = _radau()


class Memory(NamedTuple):
    """What a method keeps from step to step, and its scratch."""

    vectors: Array  # (12, N): stages, accelerations; Z of the last step in 0 to 2
    table: Array  # (11, 3)
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
    address, data : the equations, a kernel called as ``f(*data, t, y, out)``
    modes : n of y = [q (n), v (n), pairs], for central differences
    jacobian_address : kernel that fills its transposed Jacobian, for Radau
    scale : (N,) size of each unknown; ``tolerance``: of Radau's iterations, in these sizes
    """

    def __init__(
        self,
        method: str,
        address: int,
        data: tuple[Any, ...],
        y: Array,
        modes: int = 0,
        jacobian_address: int = 0,
        scale: Array | None = None,
        tolerance: float = 1.0e-8,
    ) -> None:
        if method not in METHODS:
            raise InputError(f"fixed-step method '{method}' does not exist; {nearest(method, METHODS)}")
        if method == "radau-5" and jacobian_address == 0:
            raise InputError("radau-5 needs the equations' Jacobian")
        size = y.size
        implicit = size if method == "radau-5" else 1
        z = np.zeros
        self.method, self.y, self.time = method, y.copy(), 0.0
        self._address, self._data, self._modes, self._jacobian = address, data, modes, jacobian_address
        self._memory = Memory(
            z((12, size)), _RADAU.copy(), np.ones(size) if scale is None else scale.copy(), z((implicit, implicit)),
            z((implicit, implicit)), z((2, implicit)), z((implicit, implicit), complex), z(implicit, complex),
            np.array([0.0, tolerance, 0.0, 0.0, 0.0]),
        )  # fmt: skip

    @property
    def jacobians(self) -> int:
        """Jacobians made so far."""
        return int(self._memory.numbers[2])

    def advance(self, h: float, steps: int, bound: float = 1.0e12) -> int:
        """Take ``steps`` steps of length ``h``; OK, UNBOUNDED beyond ``bound`` (or not a number), or DIVERGED."""
        memory = self._memory
        if self.method == "runge-kutta-4":
            status = runge_kutta(self._address, self._data, self.time, h, steps, bound, self.y, memory)
        elif self.method == "central-differences":
            status = leap(self._address, self._data, self.time, h, steps, bound, self._modes, self.y, memory)
        else:
            status = self._collocated(h, steps, bound, MAX_HALVINGS)
        self.time += h * steps
        return int(status)

    def _collocated(self, h: float, steps: int, bound: float, halvings: int) -> int:
        """Steps of Radau, each halved where its iterations diverge."""
        for k in range(steps):
            kept = self.y.copy()
            now = self.time + k * h
            status = collocate(self._address, self._jacobian, self._data, now, h, 1, bound, self.y, self._memory)
            if status == DIVERGED and halvings > 0:
                self.y[:] = kept
                self.time, before = now, self.time
                status = self._collocated(0.5 * h, 2, bound, halvings - 1)
                self.time = before
            if status != OK:
                return int(status)
        return OK


@kernel
def evaluate(address, arguments):
    """Call the equations, or their Jacobian, at their address."""
    return call_kernel(address, arguments)  # type: ignore[call-arg]


@kernel
def exceeds(y, bound):
    """Whether an unknown lies beyond the bound or is not a number."""
    within = True
    for i in range(y.shape[0]):
        within = within and abs(y[i]) < bound
    return not within


@kernel
def runge_kutta(address, data, t, h, steps, bound, y, memory):
    """Steps of the classical Runge–Kutta method, in place on ``y``."""
    size = y.shape[0]
    total = memory.vectors[0]
    slope = memory.vectors[1]
    at = memory.vectors[2]
    for k in range(steps):
        now = t + k * h
        evaluate(address, data + (now, y, slope))  # noqa: RUF005
        for i in range(size):
            total[i] = slope[i]
        for stage in range(1, 4):
            share = 1.0 if stage == 3 else 0.5
            for i in range(size):
                at[i] = y[i] + share * h * slope[i]
            evaluate(address, data + (now + share * h, at, slope))  # noqa: RUF005
            weight = 1.0 if stage == 3 else 2.0
            for i in range(size):
                total[i] += weight * slope[i]
        for i in range(size):
            y[i] += h / 6.0 * total[i]
        if exceeds(y, bound):
            return UNBOUNDED
    return OK


@kernel
def leap(address, data, t, h, steps, bound, modes, y, memory):
    """Steps of central differences, in place on ``y``: positions at the step, velocities carried there."""
    size = y.shape[0]
    behind = memory.vectors[0]
    slope = memory.vectors[1]
    for k in range(steps):
        evaluate(address, data + (t + k * h, y, slope))  # noqa: RUF005
        for j in range(modes + (size - 2 * modes) // 2):
            position = j if j < modes else 2 * j
            velocity = modes + j if j < modes else 2 * j + 1
            if memory.numbers[3] == 0.0:
                behind[velocity] = y[velocity] - 0.5 * h * slope[velocity]
            behind[velocity] += h * slope[velocity]
            y[position] += h * behind[velocity]
            y[velocity] = behind[velocity] + 0.5 * h * slope[velocity]
        memory.numbers[3] += 1.0
        if exceeds(y, bound):
            return UNBOUNDED
    return OK


@kernel
def factor_radau(h, memory):
    """Factorise γ/h − J and (α + iβ)/h − J; 0, or 1 where one is singular."""
    size = memory.real.shape[0]
    table = memory.table
    shift = complex(table[0, 1], table[0, 2]) / h
    for i in range(size):
        for j in range(size):
            memory.real[i, j] = -memory.jacobian[j, i]
            memory.complex[i, j] = complex(-memory.jacobian[j, i], 0.0)
        memory.real[i, i] += table[0, 0] / h
        memory.complex[i, i] += shift
    memory.numbers[0] = h
    return factor_lu(memory.real, size, memory.pivots[0]) + factor_lu(memory.complex, size, memory.pivots[1])


@kernel
def iterate_radau(address, data, now, h, y, memory):
    """Simplified Newton iterations for the stages Z in ``vectors[0:3]``; contraction reached, or −1 where none is."""
    size = y.shape[0]
    v = memory.vectors
    table = memory.table
    for s in range(3):
        for i in range(size):
            v[3 + s, i] = table[5 + s, 0] * v[0, i] + table[5 + s, 1] * v[1, i] + table[5 + s, 2] * v[2, i]
    last = 0.0
    contraction = 0.0
    for iteration in range(MOST_ITERATIONS):
        for s in range(3):
            for i in range(size):
                v[9, i] = y[i] + v[s, i]
            evaluate(address, data + (now + table[1, s] * h, v[9], v[6 + s]))  # noqa: RUF005
        shift = complex(table[0, 1], table[0, 2]) / h
        for i in range(size):
            f0 = table[5, 0] * v[6, i] + table[5, 1] * v[7, i] + table[5, 2] * v[8, i]
            f1 = table[6, 0] * v[6, i] + table[6, 1] * v[7, i] + table[6, 2] * v[8, i]
            f2 = table[7, 0] * v[6, i] + table[7, 1] * v[7, i] + table[7, 2] * v[8, i]
            v[10, i] = f0 - table[0, 0] / h * v[3, i]
            memory.column[i] = complex(f1, f2) - shift * complex(v[4, i], v[5, i])
        solve_lu(memory.real, size, memory.pivots[0], v[10])
        solve_lu(memory.complex, size, memory.pivots[1], memory.column)
        total = 0.0
        for i in range(size):
            d1 = memory.column[i].real
            d2 = memory.column[i].imag
            v[3, i] += v[10, i]
            v[4, i] += d1
            v[5, i] += d2
            for s in range(3):
                change = table[2 + s, 0] * v[10, i] + table[2 + s, 1] * d1 + table[2 + s, 2] * d2
                v[s, i] = table[2 + s, 0] * v[3, i] + table[2 + s, 1] * v[4, i] + table[2 + s, 2] * v[5, i]
                total += (change / memory.scale[i]) ** 2
        norm = math.sqrt(total / (3.0 * size))
        if not norm < 1.0e12:
            return -1.0
        if iteration > 0:
            contraction = norm / last if last > 0.0 else 0.0
            if contraction >= 1.0 and norm > memory.numbers[1]:
                return -1.0
        last = norm
        # What is left is a geometric series of what was just done.
        rest = norm * contraction / (1.0 - contraction) if 0.0 < contraction < 1.0 else norm
        if rest <= memory.numbers[1]:
            return contraction
    return -1.0


@kernel
def collocate(address, jacobian, data, t, h, steps, bound, y, memory):
    """Steps of Radau IIA of order 5, in place on ``y``."""
    size = y.shape[0]
    v = memory.vectors
    table = memory.table
    for k in range(steps):
        now = t + k * h
        fresh = False
        if memory.numbers[0] != h:
            evaluate(jacobian, data + (now, y, memory.jacobian))  # noqa: RUF005
            memory.numbers[2] += 1.0
            fresh = True
            if factor_radau(h, memory) != 0:
                return DIVERGED
        # The polynomial of a step of another length tells nothing.
        known = 1.0 if memory.numbers[4] == h else 0.0
        memory.numbers[4] = h
        for i in range(size):
            z0 = known * v[0, i]
            z1 = known * v[1, i]
            z2 = known * v[2, i]
            for s in range(3):
                v[s, i] = table[8 + s, 0] * z0 + table[8 + s, 1] * z1 + table[8 + s, 2] * z2
        contraction = iterate_radau(address, data, now, h, y, memory)
        if contraction < 0.0:
            if not fresh:
                evaluate(jacobian, data + (now, y, memory.jacobian))  # noqa: RUF005
                memory.numbers[2] += 1.0
                if factor_radau(h, memory) != 0:
                    return DIVERGED
            for s in range(3):
                for i in range(size):
                    v[s, i] = 0.0
            contraction = iterate_radau(address, data, now, h, y, memory)
            if contraction < 0.0:
                return DIVERGED
        if contraction > SLOWEST_CONTRACTION:
            memory.numbers[0] = 0.0
        for i in range(size):
            y[i] += v[2, i]
        memory.numbers[3] += 1.0
        if exceeds(y, bound):
            return UNBOUNDED
    return OK
