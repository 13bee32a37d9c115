"""Motions as settling compares and corrects them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.arrays import ModelArrays, dimensions
from cranktrain.dynamics.model.state import (
    ACCELERATION,
    AUXILIARY,
    LEAD_ANGLE,
    LEAD_SPEED,
    POSITION,
    UNDER_WAY,
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
    state[UNDER_WAY] = 0.0  # a step that was begun from another motion
    state[LEAD_ANGLE] += change.lead
    state[LEAD_SPEED] += change.lead_rate


def correct_motion(model: ModelArrays, state: Array, change: Motion) -> None:
    """Let a state move on at once with floating big ends where they were on their pins, and as fast.

    Modes turn along tangents, and pins go along circles: of a low-speed engine whose crank is a degree ahead of its
    frame the difference is that of a clearance.
    """
    floating = [c for c, row in enumerate(model.cylinders) if row[at.END_PORT] >= 0.0]
    if not floating:
        add_motion(state, change)
        return
    before = _off_tangents(model, motion_of(state, model.omega2.size))
    add_motion(state, change)
    besides = _off_tangents(model, motion_of(state, model.omega2.size)) - before
    n, crank = model.omega2.size, dimensions(model).crank_modes
    modes = np.zeros((3, n))
    for c in floating:
        for axis in range(2):
            own = crank + 2 * c + axis
            modes[:, own] = besides[:, c, axis] / model.ports[int(model.cylinders[c, at.END_PORT]) + axis, own]
    add_motion(state, Motion(modes[0], modes[1], modes[2], 0.0, 0.0))


def _off_tangents(model: ModelArrays, motion: Motion) -> Array:
    """How far each pin is off the tangent of its circle, (R(φ) − I) X − φ e_z×X, with rates; (3, c, 2) m, m/s, m/s²."""
    rows = model.ports[model.cylinders[:, at.PIN_TURN].astype(int)]
    phi, rate, swing = (rows @ part[: rows.shape[1]] for part in motion[:3])
    out = model.pins
    along = np.stack((-out[:, 1], out[:, 0]), axis=1)
    cos, sin = np.cos(phi)[:, None], np.sin(phi)[:, None]
    place = (cos - 1.0) * out + (sin - phi[:, None]) * along
    slope = (cos - 1.0) * along - sin * out  # by φ
    bend = -cos * out - sin * along
    velocity = slope * rate[:, None]
    return np.stack((place, velocity, slope * swing[:, None] + bend * rate[:, None] ** 2))
