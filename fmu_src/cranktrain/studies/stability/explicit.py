"""Explicit methods, which the product does without: the classical Runge–Kutta method and central differences.

A journal of mass m in its film, axes at rest, y up: m ü = F(u, u̇) − W e_y. Both need the film's force, never its
tangent, and hold only while h|λ| stays within their stability region:

* ``rk4``: |R(hλ)| ≤ 1 with R(z) = 1 + z + z²/2 + z³/6 + z⁴/24; 2.785 on the negative real axis, 2.828 on the imaginary;
* ``central-differences``: v' = v + h a(u, v), u' = u + h v', the velocity at half steps; hω ≤ 2 without damping,
  hω ≤ 2 (√(1 + ζ²) − ζ) with it. An implicit velocity would lift the last bound and ask for the film's tangent.

Sources: Hairer & Wanner, Solving Ordinary Differential Equations II, IV.2; Belytschko, Liu & Moran, Nonlinear Finite
Elements for Continua and Structures, 6.2.
"""

from __future__ import annotations

import math

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.core.reduced_body import Array
from cranktrain.film.laws.impedance import journal_force

RK4, CENTRAL = 0, 1
METHODS = {"rk4": RK4, "central-differences": CENTRAL}


def amplification(method: str, h: float, system: Array) -> Array:
    """Matrix that a step h applies to [u, v] of u' = v, v' = −K u − C v, given as ``system`` (2n, 2n)."""
    n = system.shape[0] // 2
    if method == "rk4":
        z = h * system
        eye = np.eye(2 * n)
        return np.asarray(eye + z @ (eye + z @ (eye + z @ (eye + z / 4.0) / 3.0) / 2.0))
    speeds = np.hstack((np.zeros((n, n)), np.eye(n))) + h * system[n:]
    return np.vstack((np.hstack((np.eye(n), np.zeros((n, n)))) + h * speeds, speeds))


def spectral_radius(matrix: Array) -> float:
    """Largest magnitude of a matrix' eigenvalues."""
    return float(np.abs(np.linalg.eigvals(matrix)).max())


# Kernels -------------------------------------------------------------------------------------------------------------


@kernel
def acceleration(y, mass, load, half_speed, c, factor, contact_height, contact_load, table, out, a):
    """Acceleration (2,) of a journal in its film at y = [x, y, vx, vy]."""
    journal_force(y[0], y[1], y[2], y[3], half_speed, c, factor, contact_height, contact_load, table, out)
    a[0] = out[0] / mass
    a[1] = (out[1] - load) / mass


@kernel
def march(
    method, h, steps, limit, mass, load, half_speed, c, factor, contact_height, contact_load, table, left, start, y,
    work,
):  # fmt: skip
    """Take up to ``steps`` explicit steps of the journal from ``y`` (4,), which it overwrites; returns steps taken.

    Stops where |left · (y − start)| leaves 1/limit to limit times its first value. ``work`` is (6, 16).
    """
    first = 0.0
    for i in range(4):
        first += left[i] * (y[i] - start[i])
    first = abs(first)
    out = work[0]
    a = work[1]
    for k in range(steps):
        if method == CENTRAL:
            acceleration(y, mass, load, half_speed, c, factor, contact_height, contact_load, table, out, a)
            for i in range(2):
                y[2 + i] += h * a[i]
                y[i] += h * y[2 + i]
        else:
            point = work[2]
            total = work[3]
            slope = work[4]
            for i in range(4):
                total[i] = 0.0
                point[i] = y[i]
            for stage in range(4):
                acceleration(point, mass, load, half_speed, c, factor, contact_height, contact_load, table, out, a)
                slope[0] = point[2]
                slope[1] = point[3]
                slope[2] = a[0]
                slope[3] = a[1]
                weight = 2.0 if stage == 1 or stage == 2 else 1.0
                reach = 1.0 if stage == 2 else 0.5
                for i in range(4):
                    total[i] += weight * slope[i]
                    point[i] = y[i] + reach * h * slope[i]
            for i in range(4):
                y[i] += h / 6.0 * total[i]
        away = 0.0
        for i in range(4):
            away += left[i] * (y[i] - start[i])
        away = abs(away)
        if not (away < limit * first and away > first / limit):
            return k + 1
        if math.isnan(away):
            return k + 1
    return steps
