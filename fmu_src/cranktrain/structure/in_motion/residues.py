"""Residues of modes in motion: contribution of each mode to the pulley's rotation under torques of the cylinders.

For M q̈ + C q̇ + K q = b exp(st) with eigenvalues λ_k, right vectors x_k and left vectors y_k, (λ²M + λC + K) x = 0 and
yᴴ (λ²M + λC + K) = 0, the rotation at an interface with the row c is

    c q = Σ_k r_k/(s − λ_k),   r_k = (c x_k) (y_kᴴ b)/(y_kᴴ (2λ_k M + C) x_k).

The *answer* of a mode is its contribution |r_k|/|Re λ_k| to the amplitude at its own frequency, s = i Im λ_k. Two kinds
of load are used. The gas torque is a unit torque of one cylinder, a force on its pin at right angles to the throw; the
root of the sum of squares over all cylinders depends on no order and no speed. The rods' forces of an order are the
harmonic of gas and inertia forces on the rigid crank in the rotating frame, all cylinders with their phases.

Source: D. J. Ewins, *Modal Testing* (2000), chapter 2, residues of damped systems.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.core.types import ComplexArray
from cranktrain.engine.model import Engine

HIGHEST_ORDER = 24.0
"""Highest order of which amplitudes of forces are computed."""


def participations(mass: NDArray[Any], left: ComplexArray, right: ComplexArray, loads: NDArray[Any]) -> ComplexArray:
    """Participation factors (k, l) of k modes for ``loads`` b (n, l), y_kᴴ b/(y_kᴴ (2λ_k M + C) x_k).

    ``left`` and ``right`` (2 n, k) are eigenvectors of the first-order form; the right ones are (x, λ x). ``mass`` is
    (n, n).
    """
    n = len(mass)
    scale = np.sum(left.conj() * right, axis=0)
    return np.asarray(left[n:].conj().T @ np.linalg.solve(mass, loads) / scale[:, None])


def order_forces(forces: Array) -> ComplexArray:
    """Complex amplitudes (m, o) of forces (N, m) over two revolutions: orders 0.5, 1, … to :data:`HIGHEST_ORDER`."""
    harmonics = 2.0 / len(forces) * np.fft.rfft(forces, axis=0)
    return np.asarray(harmonics[1 : round(2.0 * HIGHEST_ORDER) + 1].T, dtype=np.complex128)


def unit_torques(engine: Engine, body: ReducedBody) -> Array:
    """Modal loads (n, c) of a crank: each of c cylinders exerts 1 N m by a force on its pin, across the throw."""
    loads = []
    for pin, offset in zip(engine.cylinders.pins, engine.rod_offsets, strict=True):
        at = body.index(f"pin[{pin}]")
        # The rod acts on the pin at distance ``offset`` along z from the pin's middle.
        x_row, y_row = (
            body.shapes[at, 0] + offset * body.shapes[at, 4],
            body.shapes[at, 1] - offset * body.shapes[at, 3],
        )
        x, y = body.positions[at, :2]
        loads.append((x * y_row - y * x_row) / (x**2 + y**2))
    return np.array(loads).T
