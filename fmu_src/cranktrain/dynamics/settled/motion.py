"""Motions and changes of motion, which are compared and corrected while a run settles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.records import ModelArrays, dimensions
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
    """Motion or change of motion: displacement, velocity, acceleration of n modes, lead of the frame (rad) and rate."""

    place: Array
    velocity: Array
    acceleration: Array
    lead: float
    lead_rate: float

    def plus(self, other: Motion, share: float = 1.0) -> Motion:
        """Sum of this motion and ``share`` times another motion."""
        return Motion(
            self.place + share * other.place, self.velocity + share * other.velocity,
            self.acceleration + share * other.acceleration, self.lead + share * other.lead,
            self.lead_rate + share * other.lead_rate,
        )  # fmt: skip

    def minus(self, other: Motion) -> Motion:
        """Difference of this motion and another motion."""
        return self.plus(other, -1.0)


def motion_of(state: Array, modes: int) -> Motion:
    """Motion of a state."""
    place, velocity, acceleration = (
        state[offset(block, modes) : offset(block + 1, modes)].copy() for block in (POSITION, VELOCITY, ACCELERATION)
    )
    return Motion(place, velocity, acceleration, float(state[LEAD_ANGLE]), float(state[LEAD_SPEED]))


def settling_motion(model: ModelArrays, state: Array) -> Motion:
    """Motion of a state, with the ring of a viscous damper rotated to zero twist.

    The fluid does not hold the ring at an angle, and a shear-thinning fluid lets it slip by some angle each cycle, so
    its angle does not matter for the motion.
    """
    motion = motion_of(state, model.omega2.size)
    sizes = dimensions(model)
    if sizes.damper >= 0 and model.damper[STIFFNESS] == 0.0:
        twist, crank = model.ports[sizes.twist], sizes.crank_modes
        # Modes of floating big ends come before the ring's, and have no part in the ring's twist.
        ring = crank + int(np.abs(twist[crank:]).argmax())
        motion.place[ring] -= float(twist @ motion.place[: twist.size]) / twist[ring]
    return motion


def put_motion(state: Array, motion: Motion) -> None:
    """Write a motion into a state vector."""
    add_motion(state, motion.minus(motion_of(state, motion.place.size)))
    n = motion.place.size
    state[offset(AUXILIARY, n) : offset(AUXILIARY + 1, n)] = motion.acceleration


def add_motion(state: Array, change: Motion) -> None:
    """Add a change to the motion of a state, including the integrator's auxiliary acceleration."""
    n = change.place.size
    for block, values in zip((POSITION, VELOCITY, ACCELERATION, AUXILIARY), (*change[:3], change[2]), strict=True):
        state[offset(block, n) : offset(block + 1, n)] += values
    state[UNDER_WAY] = 0.0  # a step under way began from another motion
    state[LEAD_ANGLE] += change.lead
    state[LEAD_SPEED] += change.lead_rate


def correct_motion(model: ModelArrays, state: Array, change: Motion) -> None:
    """Add a change to the motion of a state; floating big ends keep displacement and velocity relative to their pins.

    Modes rotate along tangents, but pins move along circles. For a low-speed engine whose crank is a degree ahead of
    its frame the difference is as large as a clearance.
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
    """Offset of each pin from its circle's tangent, (R(φ) − I) X − φ e_z×X, and rates; (3, c, 2) m, m/s, m/s²."""
    rows = model.ports[model.cylinders[:, at.PIN_TURN].astype(int)]
    phi, rate, swing = (rows @ part[: rows.shape[1]] for part in motion[:3])
    out = model.pins
    along = np.stack((-out[:, 1], out[:, 0]), axis=1)
    cos, sin = np.cos(phi)[:, None], np.sin(phi)[:, None]
    place = (cos - 1.0) * out + (sin - phi[:, None]) * along
    slope = (cos - 1.0) * along - sin * out  # derivative by φ
    bend = -cos * out - sin * along
    velocity = slope * rate[:, None]
    return np.stack((place, velocity, slope * swing[:, None] + bend * rate[:, None] ** 2))
