"""Force law of a rigid rod and its piston on a pin, with their masses and the gas on the piston.

The first end is the pin, the second one holds the cylinder, which is at rest. Two components are the displacement of
the pin across the axis of its crank. The pin's place is exact at any rotation of the crank relative to its frame: with
the pin's undeformed position X, its displacement u, which holds φ e_z×X, and its rotation φ, it is at R(φ) X + u −
φ e_z×X. The force of the rod is that of :mod:`cranktrain.loads.slider_crank`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.rod_motion import turn
from cranktrain.engine.connections import SliderCrank
from cranktrain.film.laws.films import (
    ACCELERATION,
    BY_PLACE,
    BY_VELOCITY,
    COS,
    ECCENTRICITY,
    FRICTION,
    GAS_POWER,
    GRAVITY,
    INERTANCE,
    KINETIC,
    P_MAX,
    PRESSURE,
    RATIO,
    SIN,
    TWIST,
    TWIST_CHANGE,
    TWIST_RATE,
    WHIRL,
    WHIRL_CHANGE,
)
from cranktrain.loads.slider_crank import PISTON, PISTON_VELOCITY, pin_tangent, remainder_inertia, rod_force

# Figures of the law, in slots of a bearing's figures: distance of the piston pin from the crank's axis (m), its rate
# (m/s), and the force of the piston on its cylinder across it (N).
HEIGHT, SPEED, SIDE = P_MAX, P_MAX + 1, P_MAX + 2


class SliderCrankRecord(NamedTuple):
    """Data of r rods with their pistons."""

    rods: Array  # (r, CYLINDER) see dynamics.model.slots
    pins: Array  # (r, 2) position of each pin in the frame of its crank, m
    up: Array  # (r, 2) upwards across and along each cylinder


def slider_crank_record(given: SliderCrank, sense: float, pin: Array) -> SliderCrankRecord:
    """Record of a rod on a ``pin`` (2,), m, of a crank whose frame turns in a ``sense``.

    The frame of a crank that turns backwards has y and z of the engine reversed, so the cylinder's angle β becomes
    π − β there, and across the cylinder is the other way round.
    """
    bank = given.bank if sense > 0.0 else math.pi - given.bank
    row = np.full(at.CYLINDER, at.NO_PORT)
    row[[at.ROD, at.M_BIG, at.M_OSC]] = given.length, given.big_end_mass, given.small_end_mass + given.piston_mass
    row[at.DELTA_J] = remainder_inertia(given.rod)
    row[at.OFFSET] = sense * given.offset
    row[[at.COS_BANK, at.SIN_BANK]] = math.cos(bank), math.sin(bank)
    row[at.AREA] = 0.25 * math.pi * given.bore**2 if given.cylinder else 0.0
    up = sense * np.array([[math.sin(bank), math.cos(bank)]])
    return SliderCrankRecord(row[None], np.asarray(pin, dtype=float)[None], up)


_read = record_reader(SliderCrankRecord(*np.zeros((3, 1, 1))))


@law_kernel
def slider_crank_law(record, action, i, place, velocity, numbers, memory, out):
    """Write force, tangent of a stage and figures of a rod, see :mod:`cranktrain.film.laws.films`. Return 0.

    The torque of the force about the pin's displacement that a turn by φ adds is in ``out[FRICTION]``.
    """
    own = _read(record)
    rod = own.rods[i]
    pin_x = own.pins[i, 0]
    pin_y = own.pins[i, 1]
    whirl = numbers[WHIRL]
    change = numbers[WHIRL_CHANGE]
    twist = numbers[TWIST]
    rate = numbers[TWIST_RATE]
    c, s = turn(twist)
    turned_x = c * pin_x - s * pin_y
    turned_y = s * pin_x + c * pin_y
    # What the turn adds to the pin's displacement, its first and its second derivative in the frame's axes.
    more_x = turned_x - pin_x + twist * pin_y
    more_y = turned_y - pin_y - twist * pin_x
    more_vx = -rate * (turned_y - pin_y)
    more_vy = rate * (turned_x - pin_x)
    more_ax = -numbers[TWIST_CHANGE] * (turned_y - pin_y) - rate * rate * turned_x
    more_ay = numbers[TWIST_CHANGE] * (turned_x - pin_x) - rate * rate * turned_y
    x0 = pin_x + more_x
    y0 = pin_y + more_y
    x = x0 + place[0]
    y = y0 + place[1]
    vx = velocity[0] + more_vx - whirl * y0
    vy = velocity[1] + more_vy + whirl * x0
    ax = numbers[ACCELERATION] + more_ax - 2.0 * whirl * more_vy - change * y0 - whirl * whirl * x0
    ay = numbers[ACCELERATION + 1] + more_ay + 2.0 * whirl * more_vx + change * x0 - whirl * whirl * y0
    cos = numbers[COS] * rod[at.COS_BANK] + numbers[SIN] * rod[at.SIN_BANK]
    sin = numbers[SIN] * rod[at.COS_BANK] - numbers[COS] * rod[at.SIN_BANK]
    gas = numbers[PRESSURE] * rod[at.AREA]
    g_x = numbers[GRAVITY] * own.up[i, 0]
    g_y = numbers[GRAVITY] * own.up[i, 1]
    for k in range(ECCENTRICITY):
        out[k] = 0.0
    found = out[BY_VELOCITY:]
    side = cos * x - sin * y
    swept = cos * vx - sin * vy
    across = cos * ax - sin * ay
    rod_force(
        side, sin * x + cos * y, swept, sin * vx + cos * vy, across, sin * ax + cos * ay, gas, rod[at.ROD],
        rod[at.M_BIG], rod[at.M_OSC], rod[at.DELTA_J], rod[at.OFFSET], g_x, g_y, found,
    )  # fmt: skip
    out[0] = cos * found[0] + sin * found[1]
    out[1] = cos * found[1] - sin * found[0]
    pin_tangent(found, numbers[RATIO], numbers[INERTANCE], whirl, change, cos, sin, out[BY_PLACE:])
    out[FRICTION] = more_x * out[1] - more_y * out[0]
    out[HEIGHT] = found[PISTON]
    out[SPEED] = found[PISTON_VELOCITY]
    out[SIDE] = -found[0] - rod[at.M_BIG] * (across + g_x) - rod[at.M_OSC] * g_x
    out[GAS_POWER] = -gas * found[PISTON_VELOCITY]
    side -= rod[at.OFFSET]
    swing = swept * swept / (rod[at.ROD] * rod[at.ROD] - side * side)
    moving = rod[at.M_OSC] * out[SPEED] * out[SPEED] + rod[at.M_BIG] * (vx * vx + vy * vy)
    out[KINETIC] = 0.5 * (moving + rod[at.DELTA_J] * swing)
    for k in range(PISTON + 3):
        found[k] = 0.0
    return 0
