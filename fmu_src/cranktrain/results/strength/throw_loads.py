"""Bending, radial force and torque in the middle of webs and pins, from the loads on the crank.

The bending of a throw can be computed in two ways: as bending of the whole crank on all its bearings in the run, or, as
in the rule of the classification societies, for each throw alone, simply supported in the middle of its journals. Webs
are those next to a main journal, because the rule has no flying webs. In both ways the torque about the crank's axis is
that of the run: gas and inertia forces of all throws in front, including vibration.

Radial means from the crank's axis to the pin. Bending is positive if it presses the throw together (the rod pushes the
pin towards the axis), which causes tension in the pin's fillets and compression in the journal's.
"""

from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.engine.parts import Crankshaft
from cranktrain.results.strength.cut_loads import AXIS, PointLoads
from cranktrain.structure.crank.shape import stations, webs_of


class WebLoads(NamedTuple):
    """Loads (n,) in the middle of a web: bending in the plane of its throw (N m), radial force (N), torques (N m).

    The torques are those about the axes of pin ``pin`` and of the main journals.
    """

    number: int
    pin: int
    bending: Array
    radial: Array
    pin_torque: Array
    journal_torque: Array


class PinLoads(NamedTuple):
    """Loads (n,) in the middle of a pin, N m: bending in the plane of its throw and perpendicular to it, torque."""

    number: int
    bending: Array
    across: Array
    torque: Array


def whole_crank(c: Crankshaft, loads: PointLoads) -> tuple[list[WebLoads], list[PinLoads]]:
    """Loads of all webs and pins, with the bending of the whole crank."""
    webs = [_web(c, number, loads, loads) for number, web in enumerate(stations(c).joins, 1) if web.main]
    return webs, [_pin(c, number, loads, loads) for number in range(1, len(c.throw_angles) + 1)]


def single_throws(c: Crankshaft, loads: PointLoads) -> tuple[list[WebLoads], list[PinLoads]]:
    """Loads of all webs and pins, with the bending of each throw as a simply supported beam."""
    webs, pins = [], []
    joins = stations(c).joins
    for pin, main in enumerate(c.main_before, 1):
        alone = supported(loads, c.main_positions[main - 1], c.main_positions[main])
        webs += [_web(c, number, alone, loads) for number in webs_of(c, pin) if joins[number - 1].main]
        pins.append(_pin(c, pin, alone, loads))
    return webs, pins


def supported(loads: PointLoads, front: float, rear: float) -> PointLoads:
    """Loads between two positions along z, m, with the transverse reactions of simple supports at these positions."""
    inside = (loads.z > front) & (loads.z < rear)
    force, moment = loads.resultant(inside, rear * AXIS)
    # The front reaction, at the distance L from the rear support, balances the moment (L R_y, −L R_x) about the latter.
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
    """Unit vectors (3,) of a throw: radial, and perpendicular to it in the sense of rotation."""
    angle = c.throw_angles[pin - 1]
    radial = np.array([-np.sin(angle), np.cos(angle), 0.0])
    return radial, np.cross(AXIS, radial)


def _web(c: Crankshaft, number: int, bending: PointLoads, torque: PointLoads) -> WebLoads:
    """Loads in the middle of a web, with bending and torque from separate loads."""
    web = stations(c).joins[number - 1]
    pin, throw = web.pins[0], c.throws[web.pins[0] - 1]
    radial, across = throw_axes(c, pin)
    z = 0.5 * sum(web.span)
    force, moment = bending.cut(z, z * AXIS + 0.5 * throw * radial)
    _, about_axis = torque.cut(z, z * AXIS)
    # Radial force of a web: the front reaction for the web in front of the pin, minus the rear reaction behind it.
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
