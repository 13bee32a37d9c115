"""The crank as a whole along its axis, whose collar floats between the films of the thrust bearing.

What a cycle makes of its place z and velocity ż hangs on how the collar bounces between the films, and no formula tells
it. At low speeds hardly anything is left; towards the speed where the motion begins to repeat every second cycle a real
multiplier goes to −1. So the 2 × 2 matrix S with y₁ = S y₀, y = (ω z, ż), is learned from one change of a start and
what the cycle makes of it after the other (Broyden, Math. Comp. 19, 1965),

    S ← S + (y₁ − S y₀) y₀ᵀ/(y₀ᵀ y₀),

and carried over to the next speed: it changes little over the speed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.arrays import ModelArrays, dimensions
from cranktrain.dynamics.settled.free_mode import FreeMode
from cranktrain.dynamics.settled.motion import Motion

RATE = 300.0
"""ω, 1/s: of the order of a cycle's rate; it makes places and velocities comparable."""
STABLE = 0.9
"""Largest multiplier of S with which motions are corrected; the six at usual steps has 0.74 near 2360 rev/min."""
NOTHING_LEFT = np.zeros((2, 2))
"""S of a collar of which nothing is known."""


class Learned(NamedTuple):
    """What settling beside the slow modes is known by: the mode that decays freely, and S of the collar."""

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
        """Momentum along the axis tells y."""
        return np.array([RATE * (self._along @ motion.place), self._along @ motion.velocity])

    def lift(self, y: Array) -> Motion:
        """The crank moves along its axis as a rigid body."""
        place, velocity = y[0] / RATE * self._along, y[1] * self._along
        return Motion(place, velocity, np.zeros_like(place), 0.0, 0.0)

    @property
    def stable(self) -> bool:
        """True if no multiplier of S exceeds ``STABLE``."""
        return bool(np.abs(np.linalg.eigvals(self.over_cycle)).max() <= STABLE)

    def correction(self, change: Motion, cycles: int) -> Motion:
        """What to add after so many cycles over which a motion changed: M (I − M)⁻¹ y, M the power of S.

        Nothing where S is near the edge of stability, beyond which a correction would hold on to what no engine does.
        """
        if not self.stable:
            return self.lift(np.zeros(2))
        m = np.linalg.matrix_power(self.over_cycle, cycles)
        return self.lift(m @ np.linalg.solve(np.eye(2) - m, self.split(change)))

    def forget(self) -> None:
        """Know nothing: of a motion that repeats less often, or not at all, S is another."""
        self.over_cycle = NOTHING_LEFT

    def learn(self, before: Motion, after: Motion) -> None:
        """Know S better from a change of the start and what a cycle makes of it."""
        y = self.split(before)
        self.over_cycle = self.over_cycle + np.outer(self.split(after) - self.over_cycle @ y, y) / (y @ y)
