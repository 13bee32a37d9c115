"""Motions as settling compares and corrects them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model.arrays import ModelArrays, dimensions
from cranktrain.dynamics.model.state import (
    ACCELERATION,
    AUXILIARY,
    LEAD_ANGLE,
    LEAD_SPEED,
    POSITION,
    VELOCITY,
    offset,
)
from cranktrain.loads.damper import STIFFNESS


class Motion(NamedTuple):
    """Change of a state: place, velocity and acceleration of the modes (n,), the frame's lead (rad) and its rate."""

    place: Array
    velocity: Array
    acceleration: Array
    lead: float
    lead_rate: float

    def plus(self, other: Motion, share: float = 1.0) -> Motion:
        """The sum with so much of another."""
        return Motion(
            self.place + share * other.place, self.velocity + share * other.velocity,
            self.acceleration + share * other.acceleration, self.lead + share * other.lead,
            self.lead_rate + share * other.lead_rate,
        )  # fmt: skip

    def minus(self, other: Motion) -> Motion:
        """The difference from another."""
        return self.plus(other, -1.0)


def motion_of(state: Array, modes: int) -> Motion:
    """Motion that a state holds."""
    place, velocity, acceleration = (
        state[offset(block, modes) : offset(block + 1, modes)].copy() for block in (POSITION, VELOCITY, ACCELERATION)
    )
    return Motion(place, velocity, acceleration, float(state[LEAD_ANGLE]), float(state[LEAD_SPEED]))


def settling_motion(model: ModelArrays, state: Array) -> Motion:
    """Motion that a state holds, with the ring of a viscous damper turned back to where it has no twist.

    Nothing holds a ring in its fluid, and one that thins as it shears lets it slip by some angle each cycle: where it
    is tells nothing of the motion.
    """
    motion = motion_of(state, model.omega2.size)
    sizes = dimensions(model)
    if sizes.damper >= 0 and model.damper[STIFFNESS] == 0.0:
        twist, crank = model.ports[sizes.twist], sizes.crank_modes
        # Floating big ends come before the ring, and have no part in its twist.
        ring = crank + int(np.abs(twist[crank:]).argmax())
        motion.place[ring] -= float(twist @ motion.place[: twist.size]) / twist[ring]
    return motion


def put_motion(state: Array, motion: Motion) -> None:
    """Let a state have a motion from here on."""
    add_motion(state, motion.minus(motion_of(state, motion.place.size)))
    n = motion.place.size
    state[offset(AUXILIARY, n) : offset(AUXILIARY + 1, n)] = motion.acceleration


def add_motion(state: Array, change: Motion) -> None:
    """Let a state move on at once; what the integrator keeps beside the acceleration goes along."""
    n = change.place.size
    for block, values in zip((POSITION, VELOCITY, ACCELERATION, AUXILIARY), (*change[:3], change[2]), strict=True):
        state[offset(block, n) : offset(block + 1, n)] += values
    state[LEAD_ANGLE] += change.lead
    state[LEAD_SPEED] += change.lead_rate
