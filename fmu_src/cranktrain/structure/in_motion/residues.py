"""Residues of modes in motion: how much each mode turns the pulley under the torques of the cylinders.

Of M q̈ + C q̇ + K q = b exp(st) with eigenvalues λ_k, right vectors x_k and left vectors y_k, (λ²M + λC + K) x = 0 and
yᴴ (λ²M + λC + K) = 0, the rotation of a place with the row c is

    c q = Σ_k r_k/(s − λ_k),   r_k = (c x_k) (y_kᴴ b)/(y_kᴴ (2λ_k M + C) x_k).

At its own frequency, s = i Im λ_k, a mode contributes |r_k|/|Re λ_k| to the amplitude: its *answer*. Two kinds of load
are taken. The gas torque is a unit torque of one cylinder, a force on its pin at right angles to the throw; the root of
the sum of squares over all cylinders depends on no order and no speed. The rods' forces of an order are the
harmonic of gas and inertia forces on the rigid crank in the turning frame, all cylinders with their phases.

Source: D. J. Ewins, *Modal Testing* (2000), chapter 2, residues of damped systems.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.engine.model import Engine

ComplexArray = NDArray[np.complex128]

HIGHEST_ORDER = 24.0
"""Highest order whose forces are kept."""


def participations(mass: NDArray[Any], vectors: ComplexArray, loads: NDArray[Any]) -> ComplexArray:
    """Factors y_kᴴ b/(y_kᴴ (2λ_k M + C) x_k) of all modes for ``loads`` b (n, l), as (2 n, l).

    ``vectors`` (2 n, 2 n) are the eigenvectors (x, λ x) of the first-order form, ``mass`` (n, n). The inverse of the
    vectors has the left ones as its rows.
    """
    driven = np.linalg.solve(mass, loads)
    return np.asarray(np.linalg.solve(vectors, np.concatenate((np.zeros_like(driven), driven))))


def order_forces(forces: Array) -> ComplexArray:
    """Complex amplitudes (m, o) of forces (N, m) over a four-stroke cycle: orders 0.5, 1, … to :data:`HIGHEST_ORDER`."""
    harmonics = 2.0 / len(forces) * np.fft.rfft(forces, axis=0)
    return np.asarray(harmonics[1 : round(2.0 * HIGHEST_ORDER) + 1].T)


def unit_torques(engine: Engine, body: ReducedBody) -> Array:
    """Forces (3 c + 1, c) of a torque of 1 N m of each cylinder, at the rows of ``rod_forces``.

    A row of :func:`cranktrain.structure.in_motion.periodic_forces.rod_forces` is x, y or rotation of a rod's place.
    """
    pins = engine.cylinders.pins
    found = np.zeros((3 * len(pins) + 1, len(pins)))
    for c, pin in enumerate(pins):
        x, y = body.positions[body.index(f"pin[{pin}]"), :2]
        found[3 * c : 3 * c + 2, c] = np.array([-y, x]) / (x**2 + y**2)
    return found
