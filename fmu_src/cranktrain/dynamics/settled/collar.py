"""The crank as a whole along its axis, whose collar floats between the films of the thrust bearing.

What a cycle makes of its place z and velocity ż hangs on how the collar bounces between the films, and no formula tells
it. At low speeds hardly anything is left; towards the speed where the motion begins to repeat every second cycle a real
multiplier goes to −1. So the 2 × 2 matrix S with y₁ = S y₀, y = (ω z, ż), is learned from one change of a start and
what the cycle makes of it after the other (Broyden, Math. Comp. 19, 1965),

    S ← S + (y₁ − S y₀) y₀ᵀ/(y₀ᵀ y₀),

and carried over to the next speed: it changes little over the speed.

Where the drive line holds the crank along its axis, the block on its mounts moves along the axis by itself, damped by
the same films. Then y holds place and velocity of crank and block, and S is 4 × 4.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.arrays import ModelArrays
from cranktrain.dynamics.model.slots import AXIAL_JOINT, BORE_ROTATIONS, TURNING_MODES
from cranktrain.dynamics.settled.free_mode import FreeMode
from cranktrain.dynamics.settled.motion import Motion

RATE = 300.0
"""ω, 1/s: of the order of a cycle's rate; it makes places and velocities comparable."""
STABLE, STABLE_WITH_BLOCK = 0.7, 0.95
"""Largest multiplier of S with which motions are corrected, of the crank alone and with its block."""
ALIKE = 0.05
"""Singular value of normalised changes, over the largest, below which they tell nothing new."""
ALONG = 2
"""The block's rigid mode along the crank's axis."""


class Learned(NamedTuple):
    """What settling beside the slow modes is known by: the mode that decays freely, and S of the collar."""

    free: FreeMode
    collar: Array | None = None


class Collar:
    """The crank's rigid motion along its axis, with the block's where that is free, y = (ω z, ż).

    Attributes
    ----------
    over_cycle : (2 m, 2 m) S of m bodies
    block : whether the block is one of them
    """

    def __init__(self, model: ModelArrays, over_cycle: Array | None = None) -> None:
        turning = int(model.layout[TURNING_MODES])
        along = model.ports[2 * model.bearings.shape[0]]
        crank = np.zeros(model.omega2.size)
        crank[:turning] = np.where(model.omega2[:turning] == 0.0, along, 0.0)
        size = float(np.linalg.norm(crank))
        rows = [crank / size if size > 0.0 else crank]
        self.block = bool(model.layout[AXIAL_JOINT] > 0.0 and model.layout[BORE_ROTATIONS] > 0.0)
        if self.block:
            rows.append(np.eye(1, crank.size, turning + ALONG)[0])
        self._along = np.array(rows)
        self.over_cycle = np.zeros(2 * (2 * len(rows),)) if over_cycle is None or self.block else over_cycle
        self._known: list[tuple[Array, Array]] = []

    def split(self, motion: Motion) -> Array:
        """Momentum along the axis tells y."""
        return np.concatenate((RATE * (self._along @ motion.place), self._along @ motion.velocity))

    def lift(self, y: Array) -> Motion:
        """The bodies move along the axis as rigid ones."""
        place, velocity = y.reshape(2, -1) @ self._along
        return Motion(place / RATE, velocity, np.zeros_like(place), 0.0, 0.0)

    def correction(self, change: Motion, cycles: int) -> Motion:
        """What to add after so many cycles over which a motion changed: M (I − M)⁻¹ y, M the power of S.

        Nothing where S is near the edge of stability, beyond which a correction would hold on to what no engine does.
        """
        stable = STABLE_WITH_BLOCK if self.block else STABLE
        if np.abs(np.linalg.eigvals(self.over_cycle)).max() > stable:
            return self.lift(np.zeros(len(self.over_cycle)))
        m = np.linalg.matrix_power(self.over_cycle, cycles)
        return self.lift(m @ np.linalg.solve(np.eye(len(m)) - m, self.split(change)))

    def forget(self) -> None:
        """Know nothing: of a motion that repeats less often, or not at all, S is another."""
        self.over_cycle, self._known = np.zeros_like(self.over_cycle), []

    def learn(self, before: Motion, after: Motion) -> None:
        """Know S better from a change of the start and what a cycle makes of it."""
        self._known = [*self._known, (self.split(before), self.split(after))][-(len(self._along) ** 2) :]
        start, end = (np.array(columns).T for columns in zip(*self._known, strict=True))
        missed = end - self.over_cycle @ start
        sizes = np.linalg.norm(start, axis=0)
        self.over_cycle = self.over_cycle + (missed / sizes) @ np.linalg.pinv(start / sizes, rcond=ALIKE)
