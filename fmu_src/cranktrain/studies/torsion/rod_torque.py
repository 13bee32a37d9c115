"""Torque of rigid rods on pins that move along their circles, in closed form, for many angles at once.

What a rod turns about is at K(a) in axes of its cylinder when its crank pin is at the angle a: the pin itself, on its
circle of radius r, or a knuckle pin. With K = (x + e, y), v = dK/da and s = √(L² − x²) the piston moves by
h = dy_P/da = v_y − v_x x/s and the rod turns by b = dβ/da = v_x/s. The pin then carries the inertia

    J(a) = m_b |v|² + m_o h² + ΔJ b²

and at the angle ψ feels the torque −J ψ̈ − ½ J' ψ̇² − h p A + gravity. This is the force of
:mod:`cranktrain.loads.slider_crank` along the circle; symbols are its own.
"""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Array
from cranktrain.engine.articulated_rod import Articulation, RodEnd, circle, hung_on
from cranktrain.engine.model import Engine
from cranktrain.loads.slider_crank import remainder_inertia


class RodTorque(NamedTuple):
    """Torques of rods on their pins at given pin angles; all (…, c) like the angles.

    Attributes
    ----------
    inertia, slope : J, kg m², and J' = dJ/da
    arm : h, m: the piston's way per angle; gas of p A pushes the pin back by h p A
    weight : torque of gravity, N m
    """

    inertia: Array
    slope: Array
    arm: Array
    weight: Array


class Rods(NamedTuple):
    """Rods of an engine (SI).

    Attributes
    ----------
    radius, start, bank : (c,) of the pins' circles, their angles at crank angle 0 in axes of their cylinders, and the
        banks' angles
    length, offset : L and e (c,)
    big_end, oscillating, remainder : m_b, m_o, kg, and ΔJ, kg m², (c,)
    gravity : m/s²
    joints : where articulated rods hang, None for rods on their pin, (c,)
    """

    radius: Array
    start: Array
    bank: Array
    length: Array
    offset: Array
    big_end: Array
    oscillating: Array
    remainder: Array
    gravity: float
    joints: tuple[Articulation | None, ...]

    @classmethod
    def of_engine(cls, engine: Engine, body: ReducedBody, gravity: float) -> "Rods":
        """Make the rods of an engine on the pins of its ``body``."""
        pins = np.array([body.positions[body.index(f"pin[{pin}]"), :2] for pin in engine.cylinders.pins])
        bank = np.array(engine.cylinders.bank_angles, dtype=float)
        return cls(
            np.hypot(*pins.T),
            np.arctan2(pins[:, 1], pins[:, 0]) - bank,
            bank,
            np.array([rod.length for rod in engine.rods]),
            np.array(engine.offsets),
            np.array([rod.big_end_mass for rod in engine.rods]),
            np.array([rod.small_end_mass + engine.cylinders.piston_mass for rod in engine.rods]),
            np.array([remainder_inertia(rod) for rod in engine.rods]),
            gravity,
            engine.articulations,
        )

    def torque(self, angle: Array) -> RodTorque:
        """Inertia and torques at pin angles ``angle`` (…, c), rad."""
        a = angle + self.start
        across, along = self.radius * np.cos(a), self.radius * np.sin(a)
        end = RodEnd(across, along, -along, across, -across, -along)
        swept, swept_slope = np.broadcast_to(self.radius**2, a.shape), np.zeros_like(a)
        if any(self.joints):
            paths = np.array(end)
            for c, joint in enumerate(self.joints):
                if joint is not None:
                    # circle() counts angles from the y axis of the master rod's cylinder.
                    pin = circle(self.radius[c], a[..., c] + joint.turn - 0.5 * math.pi)
                    paths[..., c] = hung_on(joint, pin)
            end = RodEnd(*paths)
            hung = np.array([joint is not None for joint in self.joints])
            swept = np.where(hung, end.vx**2 + end.vy**2, swept)
            swept_slope = np.where(hung, end.vx * end.ax + end.vy * end.ay, 0.0)
        x = end.x - self.offset
        s = np.sqrt(self.length**2 - x**2)
        lean, turn = x / s, end.vx / s
        arm = end.vy - end.vx * lean
        # d(x/s)/da = turn·(1 + lean²), d(1/s)/da·s = turn·lean.
        arm_slope = end.ay - end.ax * lean - end.vx * turn * (1.0 + lean**2)
        turn_slope = end.ax / s + turn**2 * lean
        lean_of_bank, rise = self.gravity * np.sin(self.bank), self.gravity * np.cos(self.bank)
        weight = -self.big_end * lean_of_bank * end.vx - rise * (self.big_end * end.vy + self.oscillating * arm)
        inertia = self.big_end * swept + self.oscillating * arm**2 + self.remainder * turn**2
        slope = self.oscillating * arm * arm_slope + self.remainder * turn * turn_slope
        return RodTorque(inertia, 2.0 * (slope + self.big_end * swept_slope), arm, weight)


def gas_push(tables: Array, area: float, angle: Array) -> list[Array]:
    """Pressures of periodic splines ``tables`` (k, n, 4) times piston ``area``, N, at angles (…, c) after firing.

    ``tables`` are those of :func:`cranktrain.loads.gas_pressure.gas_tables`. As
    :func:`cranktrain.loads.gas_pressure.gas_pressure`, many at once.
    """
    if len(tables) > 2:
        columns = [gas_push(tables[2 * c : 2 * c + 2], area, angle[..., c]) for c in range(angle.shape[-1])]
        return [np.stack(parts, axis=-1) for parts in zip(*columns, strict=True)]
    count = tables.shape[1]
    place = angle * (count / (4.0 * math.pi))
    whole = np.floor(place)
    t = place - whole
    at = whole.astype(np.int64) % count
    found = []
    for table in tables:
        a, b, c, d = (np.take(column, at) for column in np.ascontiguousarray(table.T))
        found.append(area * (a + t * (b + t * (c + t * d))))
    return found
