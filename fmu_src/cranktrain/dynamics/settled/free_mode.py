"""The freely decaying mode that settles last, apart from the slow modes.

For a running crank this is the first torsional mode: after a cycle of the six at 1600 rev/min 6 % of its amplitude is
left, of all other modes far less. The crank's motion along its axis (:mod:`collar`) is excluded, because it does not
follow the mode's exponent. If a motion is just Re(z e^{λt}), its displacement a and velocity b determine

    z = a + i (Re λ a − b)/Im λ

in all coordinates. For any other motion ψ ψᴴz is the part of the mode with shape ψ, ψᴴψ = 1. Exponent λ and shape
hardly change with speed, although the multiplier over a cycle, exp(λT), rotates by a quarter of a revolution from one
speed of a run-up to the next.
"""

from __future__ import annotations

import cmath
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.dynamics.settled.motion import Motion

LEFT = 0.5
"""Largest fraction of a motion outside the mode for which the mode is learned from this motion."""
NEW = 0.5
"""Fraction by which exponent and shape of the mode move towards newly learned values."""


class FreeMode(NamedTuple):
    """Exponent λ (1/s) and shape ψ (n,) of a mode."""

    decay: complex
    shape: NDArray[np.complex128]

    def correction(self, rest: Motion, time: float) -> Motion:
        """Correction M (I − M)⁻¹ ``rest`` after a time (s) over which a motion changed by ``rest``; M = exp(λ time)."""
        factor = cmath.exp(self.decay * time)
        z = factor / (1.0 - factor) * np.vdot(self.shape, complex_place(rest, self.decay)) * self.shape
        return Motion(z.real.copy(), (self.decay * z).real, (self.decay**2 * z).real, 0.0, 0.0)

    def speed_of(self, rest: Motion) -> float:
        """Size of the mode's part of a motion, as a velocity."""
        return float(abs(self.decay) * abs(np.vdot(self.shape, complex_place(rest, self.decay))))

    def learned(self, before: Motion, after: Motion, time: float) -> FreeMode:
        """Mode learned from a motion ``before`` and ``after`` a time (s); unchanged if they show another mode."""
        first, then = (complex_place(motion, self.decay) for motion in (before, after))
        was, now = np.vdot(self.shape, first), np.vdot(self.shape, then)
        size = float(np.linalg.norm(then))
        if not 0.0 < abs(now) < abs(was) or float(np.linalg.norm(then - now * self.shape)) > LEFT * size:
            return self
        factor = complex(now / was)
        turns = round((self.decay.imag * time - cmath.phase(factor)) / (2.0 * math.pi))
        decay = complex(math.log(abs(factor)), cmath.phase(factor) + 2.0 * math.pi * turns) / time
        # Learned values scatter by the contribution of other modes, more than they change from speed to speed.
        shape = self.shape + NEW * (then / now - self.shape)
        return FreeMode(self.decay + NEW * (decay - self.decay), shape / np.linalg.norm(shape))


def complex_place(motion: Motion, decay: complex) -> NDArray[np.complex128]:
    """Complex amplitude z of a motion, (n,), for an exponent ``decay``."""
    return np.asarray(motion.place + 1j * (decay.real * motion.place - motion.velocity) / decay.imag)
