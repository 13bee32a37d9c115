"""Explicit methods for comparison (not used in runs): the classical Runge–Kutta method and central differences.

A journal of mass m in its film, axes at rest, y up: m ü = F(u, u̇) − W e_y. Both need the film's force, never its
tangent, and hold only while h|λ| stays within their stability region:

* ``rk4``: |R(hλ)| ≤ 1 with R(z) = 1 + z + z²/2 + z³/6 + z⁴/24; 2.785 on the negative real axis, 2.828 on the imaginary;
* ``central-differences``: v' = v + h a(u, v), u' = u + h v', the velocity at half steps; hω ≤ 2 without damping,
  hω ≤ 2 (√(1 + ζ²) − ζ) with it. An implicit velocity would lift the last bound and ask for the film's tangent.

Sources: Hairer & Wanner, Solving Ordinary Differential Equations II, IV.2; Belytschko, Liu & Moran, Nonlinear Finite
Elements for Continua and Structures, 6.2.
"""

from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.core.reduced_body import Array
from cranktrain.film.laws.impedance import MapFilm, journal_force

RK4, CENTRAL = 0, 1
METHODS = {"rk4": RK4, "central-differences": CENTRAL}


class FilmedJournal(NamedTuple):
    """Journal of ``mass`` (kg) under a downward ``load`` (N), with half of the speed (rad/s) and a film's force law."""

    mass: float
    load: float
    half_speed: float
    film: MapFilm


def amplification(method: str, h: float, system: Array) -> Array:
    """Return the matrix of a step h for [u, v] of u' = v, v' = −K u − C v, given as ``system`` (2n, 2n)."""
    n = system.shape[0] // 2
    if method == "rk4":
        z = h * system
        eye = np.eye(2 * n)
        return np.asarray(eye + z @ (eye + z @ (eye + z @ (eye + z / 4.0) / 3.0) / 2.0))
    speeds = np.hstack((np.zeros((n, n)), np.eye(n))) + h * system[n:]
    return np.vstack((np.hstack((np.eye(n), np.zeros((n, n)))) + h * speeds, speeds))


def spectral_radius(matrix: Array) -> float:
    """Return the largest magnitude of a matrix' eigenvalues."""
    return float(np.abs(np.linalg.eigvals(matrix)).max())


# Kernels -------------------------------------------------------------------------------------------------------------


V_X, V_Y = 2, 3
"""Indices of the velocities in the state y = [x, y, vx, vy]."""
OUT, POINT, TOTAL, SLOPE, ROWS = range(5)
"""Rows of the scratch array (ROWS, 16): results of the film law, state of a stage, sum of the stages, its rates."""


@kernel
def rates(journal, y, out, slope):
    """Compute ẏ of a journal in its film into ``slope`` (4,), and the film law's results into ``out`` (16,)."""
    journal_force(y[0], y[1], y[V_X], y[V_Y], journal.half_speed, journal.film, out)
    slope[0] = y[V_X]
    slope[1] = y[V_Y]
    slope[V_X] = out[0] / journal.mass
    slope[V_Y] = (out[1] - journal.load) / journal.mass


@kernel
def march(method, h, steps, limit, journal, watched, y, work):
    """Take up to ``steps`` explicit steps of the journal from ``y`` (4,), which is overwritten. Return steps taken.

    Stops where |left · (y − start)|, with ``watched`` (2, 4) = [left, start], leaves 1/limit to limit times its first
    value. ``work`` is (ROWS, 16).
    """
    first = away_from(watched, y)
    slope = work[SLOPE]
    for k in range(steps):
        if method == CENTRAL:
            rates(journal, y, work[OUT], slope)
            for i in range(2):
                y[V_X + i] += h * slope[V_X + i]
                y[i] += h * y[V_X + i]
        else:
            point = work[POINT]
            total = work[TOTAL]
            for i in range(4):
                total[i] = 0.0
                point[i] = y[i]
            for stage in range(4):
                rates(journal, point, work[OUT], slope)
                weight = 2.0 if stage == 1 or stage == 2 else 1.0
                reach = 1.0 if stage == 2 else 0.5
                for i in range(4):
                    total[i] += weight * slope[i]
                    point[i] = y[i] + reach * h * slope[i]
            for i in range(4):
                y[i] += h / 6.0 * total[i]
        away = away_from(watched, y)
        if not (away < limit * first and away > first / limit):  # also true for NaN
            return k + 1
    return steps


@kernel
def away_from(watched, y):
    """Return the amplitude |left · (y − start)| of the watched eigenmotion at state ``y``."""
    away = 0.0
    for i in range(4):
        away += watched[0, i] * (y[i] - watched[1, i])
    return abs(away)
