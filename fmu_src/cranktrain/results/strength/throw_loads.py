"""Bending, radial force and torque at the middles of webs and pins, from the loads in the crank.

There are two ways to compute the bending of a throw: the bending of the whole crank on all its bearings in the run; or,
as in the rule of the classification societies, each throw by itself, simply supported in the middles of its journals.
Webs are those beside a main journal; the rule has no flying webs. In both the torque about the crank's axis comes from
the run: gas and inertia forces of all throws in front, with the vibration.

Radial is from the crank's axis to the pin, bending is positive where it presses the throw together (the rod pushes the
pin towards the axis), which puts the pin's fillets in tension and the journal's in compression.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.engine.parts import Crankshaft
from cranktrain.results.strength.cut_loads import AXIS, PointLoads
from cranktrain.structure.crank.shape import stations, webs_of


class WebLoads(NamedTuple):
    """Loads (n,) of a web in its middle: bending in the plane of its throw (N m), radial force (N), torques (N m).

    The torques are those about the axes of ``pin`` and of main journals.
    """

    number: int
    pin: int
    bending: Array
    radial: Array
    pin_torque: Array
    journal_torque: Array


class PinLoads(NamedTuple):
    """Loads (n,) of a pin in its middle, N m: bending in the plane of its throw and square to it, torque."""

    number: int
    bending: Array
    across: Array
    torque: Array


def whole_crank(c: Crankshaft, loads: PointLoads) -> tuple[list[WebLoads], list[PinLoads]]:
    """Loads of all webs and pins with the bending that the crank as a whole has."""
    webs = [_web(c, number, loads, loads) for number, web in enumerate(stations(c).joins, 1) if web.main]
    return webs, [_pin(c, number, loads, loads) for number in range(1, len(c.throw_angles) + 1)]


def single_throws(c: Crankshaft, loads: PointLoads) -> tuple[list[WebLoads], list[PinLoads]]:
    """Loads of all webs and pins with the bending of each throw alone."""
    webs, pins = [], []
    joins = stations(c).joins
    for pin, main in enumerate(c.main_before, 1):
        alone = supported(loads, c.main_positions[main - 1], c.main_positions[main])
        webs += [_web(c, number, alone, loads) for number in webs_of(c, pin) if joins[number - 1].main]
        pins.append(_pin(c, pin, alone, loads))
    return webs, pins


def supported(loads: PointLoads, front: float, rear: float) -> PointLoads:
    """Loads between two positions along z, m, and reactions of simple supports there across the axis."""
    inside = (loads.z > front) & (loads.z < rear)
    force, moment = loads.resultant(inside, rear * AXIS)
    # About the rear support the front one, L before it, balances the moment (L R_y, −L R_x).
    span = rear - front
    first = np.stack([moment[:, 1], -moment[:, 0], np.zeros(len(moment))], axis=1) / span
    second = -force - first
    second[:, 2] = 0.0
    n = len(moment)
    return PointLoads(
        np.concatenate([loads.z[inside], [front, rear]]),
        np.concatenate([loads.places[:, inside], np.tile([front * AXIS, rear * AXIS], (n, 1, 1))], axis=1),
        np.concatenate([loads.forces[:, inside], first[:, None], second[:, None]], axis=1),
        np.concatenate([loads.moments[:, inside], np.zeros((n, 2, 3))], axis=1),
    )


def throw_axes(c: Crankshaft, pin: int) -> tuple[Array, Array]:
    """Unit vectors (3,) of a throw: radial, and square to it in the sense of rotation."""
    angle = c.throw_angles[pin - 1]
    radial = np.array([-np.sin(angle), np.cos(angle), 0.0])
    return radial, np.cross(AXIS, radial)


def _web(c: Crankshaft, number: int, bending: PointLoads, torque: PointLoads) -> WebLoads:
    """Loads in the middle of a web, bending and torque each from its own loads."""
    web = stations(c).joins[number - 1]
    pin, throw = web.pins[0], c.throws[web.pins[0] - 1]
    radial, across = throw_axes(c, pin)
    z = 0.5 * sum(web.span)
    force, moment = bending.cut(z, z * AXIS + 0.5 * throw * radial)
    _, about_axis = torque.cut(z, z * AXIS)
    # The part behind a cut in front of the pin carries the front reaction; behind the pin, minus the rear reaction.
    side = 1.0 if web.front else -1.0
    journal = about_axis @ AXIS
    pin_torque = journal - throw * (force @ across)
    return WebLoads(number, pin, -(moment @ across), side * (force @ radial), pin_torque, journal)


def _pin(c: Crankshaft, pin: int, bending: PointLoads, torque: PointLoads) -> PinLoads:
    """Loads in the middle of a pin."""
    radial, across = throw_axes(c, pin)
    z, throw = c.pin_positions[pin - 1], c.throws[pin - 1]
    force, moment = bending.cut(z, z * AXIS + throw * radial)
    _, about_axis = torque.cut(z, z * AXIS)
    return PinLoads(pin, -(moment @ across), moment @ radial, about_axis @ AXIS - throw * (force @ across))
