"""Correction of the crank's rigid motion along its axis, with the collar between the films of the thrust bearing.

How its displacement z and velocity ż change over a cycle depends on how the collar bounces between the films, for which
there is no formula. At low speeds a disturbance has almost decayed after a cycle. Near the speed at which the motion
begins to repeat every second cycle a real multiplier approaches −1. So the 2 × 2 matrix S with y₁ = S y₀, y = (ω z, ż),
is learned from successive pairs of a change of the start and the change after the cycle (Broyden, Math. Comp. 19,
1965),

    S ← S + (y₁ − S y₀) y₀ᵀ/(y₀ᵀ y₀),

and carried over to the next speed, because S changes little with speed.
"""

from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.records import ModelArrays, dimensions
from cranktrain.dynamics.settled.free_mode import FreeMode
from cranktrain.dynamics.settled.motion import Motion

RATE = 300.0
"""Scale ω, 1/s, that makes displacements and velocities comparable; of the order of a cycle's rate."""
STABLE = 0.9
"""Largest multiplier of S with which motions are corrected; ``diesel_i6`` has 0.74 near 2360 rev/min."""
NOTHING_LEFT = np.zeros((2, 2))
"""Initial value of the matrix S of a collar, before any data are known."""


class Learned(NamedTuple):
    """Data learned while a run settles: the freely decaying mode, and the matrix S of the collar."""

    free: FreeMode
    collar: Array = NOTHING_LEFT


class Collar:
    """The crank's rigid motion along its axis, y = (ω z, ż).

    Attributes
    ----------
    over_cycle : (2, 2) S
    """

    def __init__(self, model: ModelArrays, over_cycle: Array) -> None:
        self.over_cycle = over_cycle
        turning = model.ports.shape[1]
        along = model.ports[dimensions(model).collar]
        rigid = np.zeros(model.omega2.size)
        rigid[:turning] = np.where(model.omega2[:turning] == 0.0, along, 0.0)
        size = float(np.linalg.norm(rigid))
        self._along = rigid / size if size > 0.0 else rigid

    def split(self, motion: Motion) -> Array:
        """Coordinates y = (ω z, ż) of a motion of the collar, from its momentum along the axis."""
        return np.array([RATE * (self._along @ motion.place), self._along @ motion.velocity])

    def lift(self, y: Array) -> Motion:
        """Motion of the crank along its axis as a rigid body with the coordinates y."""
        place, velocity = y[0] / RATE * self._along, y[1] * self._along
        return Motion(place, velocity, np.zeros_like(place), 0.0, 0.0)

    @property
    def stable(self) -> bool:
        """True if no multiplier of S exceeds ``STABLE``."""
        return bool(np.abs(np.linalg.eigvals(self.over_cycle)).max() <= STABLE)

    def correction(self, change: Motion, cycles: int) -> Motion:
        """Correction M (I − M)⁻¹ y after ``cycles`` cycles that changed the motion by ``change``; M is S to that power.

        It is zero if S is near the limit of stability, beyond which it would lead to an unstable periodic motion.
        """
        if not self.stable:
            return self.lift(np.zeros(2))
        m = np.linalg.matrix_power(self.over_cycle, cycles)
        return self.lift(m @ np.linalg.solve(np.eye(2) - m, self.split(change)))

    def forget(self) -> None:
        """Reset S, because a motion of a longer period, or without a period, has another S."""
        self.over_cycle = NOTHING_LEFT

    def learn(self, before: Motion, after: Motion) -> None:
        """Update S from a change of a cycle's start and the resulting change after one cycle."""
        y = self.split(before)
        self.over_cycle = self.over_cycle + np.outer(self.split(after) - self.over_cycle @ y, y) / (y @ y)
