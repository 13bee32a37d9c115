"""Amplification matrix of one step of an integrator on a linear system, from the integrator's table, in NumPy.

A step of h on q̈ + C q̇ + K q = 0 applies a matrix to the state of the method: q, v and, depending on the method, the
true acceleration a, generalised-α's auxiliary ā, or position and velocity of the previous step. The eigenvalues of this
matrix are the theory for the running model's own steps: R(hλ) for the diagonally implicit methods, Chung & Hulbert's
roots for generalised-α (J. Appl. Mech. 60, 1993).
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.time import table as at
from cranktrain.dynamics.time.integrators import carried, family
from cranktrain.dynamics.time.table import coefficients

System = Callable[[float], tuple[NDArray[Any], NDArray[Any]]]
"""Linear system of unit mass: function that returns stiffness K and damping C, (n, n), at a time."""


def step_matrix(table: Array, h: float, system: System, t: float = 0.0) -> NDArray[Any]:
    """Return the amplification matrix (k n, k n) of a step from ``t`` to ``t + h``, for k state blocks of n values.

    Parameters
    ----------
    table : as of :func:`cranktrain.dynamics.time.integrators.integrator_table`
    system : called with the times of the stages
    """
    n, k = system(t)[0].shape[0], len(carried(table))
    eye = np.eye(k * n, dtype=complex)
    q, v, *more = (eye[i * n : (i + 1) * n] for i in range(k))
    c_q, c_v = coefficients(table, h)

    def stage(big_q: NDArray[Any], big_v: NDArray[Any], time: float) -> tuple[NDArray[Any], ...]:
        stiffness, damping = system(time)
        matrix = np.eye(n) + c_v * damping + c_q * stiffness
        new = -np.linalg.solve(matrix, damping @ big_v + stiffness @ big_q)
        return big_q + c_q * new, big_v + c_v * new, new

    form = family(table).name
    if form == "newmark":
        a, auxiliary = more
        alpha_m, alpha_f, beta, gamma = table[at.HEAD, [at.ALPHA_M, at.ALPHA_F, at.BETA, at.GAMMA]]
        known = (alpha_f * a - alpha_m * auxiliary) / (1.0 - alpha_m)
        big_q = q + h * v + h * h * ((0.5 - beta) * auxiliary + beta * known)
        big_v = v + h * ((1.0 - gamma) * auxiliary + gamma * known)
        q, v, a = stage(big_q, big_v, t + h)
        return np.vstack((q, v, a, (1.0 - alpha_f) / (1.0 - alpha_m) * a + known))
    if form == "bdf2":
        big_v = (4.0 * v - more[1]) / 3.0
        big_q = (4.0 * q - more[0]) / 3.0 + c_v * big_v
        return np.vstack((*stage(big_q, big_v, t + h)[:2], q, v))
    if form != "runge-kutta":
        raise InputError(f"no theory of a step is known for integrators of family '{form}'; use one of another family")
    stages: list[tuple[NDArray[Any], ...]] = [(q, v, more[0])] if table[at.HEAD, at.EXPLICIT_FIRST] else []
    for s in range(len(stages), int(table[at.HEAD, at.STAGES])):
        row = table[at.FIRST_STAGE + s]
        big_v = v + sum((h * row[j] * stages[j][2] for j in range(s)), np.zeros_like(v))
        big_q = q + sum((h * row[j] * stages[j][1] for j in range(s)), np.zeros_like(q)) + c_v * big_v
        stages.append(stage(big_q, big_v, t + row[at.NODE] * h))
    return np.vstack(stages[-1][:k])


def constant(stiffness: NDArray[Any], damping: NDArray[Any]) -> System:
    """Return a time-invariant system."""
    return lambda time: (stiffness, damping)


def radius(table: Array, h: float, stiffness: complex, damping: complex = 0.0) -> float:
    """Return the spectral radius of a step on q̈ + d q̇ + s q = 0, with complex coefficients allowed."""
    system = constant(np.array([[stiffness]]), np.array([[damping]]))
    matrix = scaled(step_matrix(table, h, system), table, max(abs(stiffness) ** 0.5, 1.0 / h))
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def scaled(matrix: NDArray[Any], table: Array, rate: float) -> NDArray[Any]:
    """Return a step's matrix for velocities divided by ``rate`` (1/s), and accelerations by ``rate`` squared."""
    blocks = carried(table)
    scale = np.repeat([rate**power for _, power in blocks], matrix.shape[0] // len(blocks))
    return matrix * scale[None, :] / scale[:, None]
