"""Natural modes of a rigid engine on its mounts, named by the direction that holds most of their kinetic energy.

A mode n has the frequency ω_n at which the n-th eigenvalue of the storage stiffness is its square,

    K'(ω_n) φ = ω_n² M φ,    ζ = φᵀ K''(ω_n) φ / (2 φᵀ K'(ω_n) φ)

so that it is exact for constant mounts. Damping is that of the undamped shape (modal strain energy, C. D. Johnson and
D. A. Kienholz, AIAA Journal 20 (1982) 1284). The fraction of direction i in the kinetic energy is φ_i (Mφ)_i / φᵀMφ.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import brentq, linear_sum_assignment

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain_lab.mounts.body import RigidEngine
from cranktrain_lab.mounts.stiffness import DIRECTIONS, Support

NAMES = ("lateral", "bounce", "fore-and-aft", "pitch", "yaw", "roll")
"""Names of the motions along x, y, z and about x, y, z."""
COUPLED = 0.1
"""Fraction of the kinetic energy from which another direction is told as coupled with the mode's own."""
_LOW, _HIGH, _POINTS = 0.05, 2000.0, 400
"""Range in which modes are searched, Hz, and number of frequencies of the search."""


class Mode(NamedTuple):
    """Mode of a rigid engine.

    Attributes
    ----------
    name : direction of the largest fraction of kinetic energy; each name is given once
    hz, damping_ratio : natural frequency without damping, and ζ
    fractions : (6,) fractions of the kinetic energy in the directions of :data:`NAMES`
    shape : (6,) motion of the centre, m and rad, of unit modal mass
    """

    name: str
    hz: float
    damping_ratio: float
    fractions: Array
    shape: Array

    @property
    def coupled(self) -> list[str]:
        """Other directions that hold :data:`COUPLED` of the kinetic energy or more."""
        return [name for name, one in zip(NAMES, self.fractions, strict=True) if name != self.name and one >= COUPLED]


def modes(body: RigidEngine, support: Support) -> list[Mode]:
    """Six modes of an engine at rest, by rising frequency.

    Raises ``InputError`` if a mode has no frequency in the range, because the mounts do not hold the engine.
    """
    found = list(_shapes(body, support))
    fractions = np.array([shape * (body.mass @ shape) for _, _, shape in found])
    names = dict(zip(*linear_sum_assignment(fractions, maximize=True), strict=True))
    return [
        Mode(NAMES[names[n]], omega / (2.0 * np.pi), damping, own, shape)
        for n, ((omega, damping, shape), own) in enumerate(zip(found, fractions, strict=True))
    ]


def _shapes(body: RigidEngine, support: Support) -> Iterator[tuple[float, float, Array]]:
    """Angular frequency, damping ratio and shape of each mode."""

    def squares(omega: float) -> Array:
        return np.asarray(eigh(support.whole(omega).real, body.mass, eigvals_only=True))

    grid = 2.0 * np.pi * np.geomspace(_LOW, _HIGH, _POINTS)
    over = np.array([squares(omega) for omega in grid]) - grid[:, None] ** 2
    for n in range(DIRECTIONS):
        crossing = np.flatnonzero((over[:-1, n] > 0.0) & (over[1:, n] <= 0.0))
        if not crossing.size:
            raise InputError(
                f"mounts: mode {n + 1} of the engine has no frequency between {_LOW:g} and {_HIGH:g} Hz; "
                "check the unit of the mounts' stiffness"
            )
        low, high = grid[crossing[0]], grid[crossing[0] + 1]
        omega = float(brentq(lambda one, n=n: squares(one)[n] - one**2, low, high, xtol=1e-12, rtol=1e-14))
        whole = support.whole(omega)
        shape = eigh(whole.real, body.mass)[1][:, n]
        yield omega, float(shape @ whole.imag @ shape / (2.0 * (shape @ whole.real @ shape))), shape
