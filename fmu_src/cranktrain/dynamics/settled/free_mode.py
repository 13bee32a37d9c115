"""What settling leaves beside the slow modes: one mode that decays freely.

Of a running crank that is its first torsional mode: a cycle of the six at 1600 rev/min leaves 6 % of it, of all others
far less. The crank's motion along its axis (:mod:`collar`) is left out of it: it does not go on at the mode's exponent.
Where a motion is nothing but Re(z e^{λt}), its place a and velocity b tell

    z = a + i (Re λ a − b)/Im λ

in all coordinates at once. Of any motion z has the part ψ ψᴴz of the mode whose shape is ψ, ψᴴψ = 1. Exponent λ and
shape hardly change over the speed, though the multiplier over a cycle, exp(λT), turns by a quarter of a revolution from
one speed of a run-up to the next.
"""

from __future__ import annotations

import cmath
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.dynamics.settled.motion import Motion

LEFT = 0.5
"""Share of a motion, by size, that the mode may leave for it to be learned from."""
NEW = 0.5
"""Share of what is learned with which the mode goes on."""


class FreeMode(NamedTuple):
    """Exponent λ (1/s) and shape ψ (n,) of a mode."""

    decay: complex
    shape: NDArray[np.complex128]

    def correction(self, rest: Motion, time: float) -> Motion:
        """What to add after a time (s) over which a motion changed by ``rest``: M (I − M)⁻¹ of it, M = exp(λ time)."""
        factor = cmath.exp(self.decay * time)
        z = factor / (1.0 - factor) * np.vdot(self.shape, complex_place(rest, self.decay)) * self.shape
        return Motion(z.real.copy(), (self.decay * z).real, (self.decay**2 * z).real, 0.0, 0.0)

    def speed_of(self, rest: Motion) -> float:
        """Size of the mode's part of a motion, as a velocity."""
        return float(abs(self.decay) * abs(np.vdot(self.shape, complex_place(rest, self.decay))))

    def learned(self, before: Motion, after: Motion, time: float) -> FreeMode:
        """The mode as a motion shows it that has become another after a time (s); as it is where that shows another."""
        first, then = (complex_place(motion, self.decay) for motion in (before, after))
        was, now = np.vdot(self.shape, first), np.vdot(self.shape, then)
        size = float(np.linalg.norm(then))
        if not 0.0 < abs(now) < abs(was) or float(np.linalg.norm(then - now * self.shape)) > LEFT * size:
            return self
        factor = complex(now / was)
        turns = round((self.decay.imag * time - cmath.phase(factor)) / (2.0 * math.pi))
        decay = complex(math.log(abs(factor)), cmath.phase(factor) + 2.0 * math.pi * turns) / time
        # Both scatter from speed to speed, by the share of other modes, more than they change.
        shape = self.shape + NEW * (then / now - self.shape)
        return FreeMode(self.decay + NEW * (decay - self.decay), shape / np.linalg.norm(shape))


def complex_place(motion: Motion, decay: complex) -> NDArray[np.complex128]:
    """z of a motion, (n,)."""
    return np.asarray(motion.place + 1j * (decay.real * motion.place - motion.velocity) / decay.imag)
