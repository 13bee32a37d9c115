"""Free forces and moments of a layout's oscillating masses in closed form.

The piston of a cylinder whose throw has its dead centre at φ presses along its bank, unit vector u, by

    F = m_o r ω² [cos(θ − φ) + λ cos 2(θ − φ)] u,   λ = throw over rod length.

An order's resultant Σ exp(−ikφ) u and its moment Σ z exp(−ikφ) u about the middle of the crank are complex vectors in
the plane across the crank. Their largest magnitudes over a revolution are given in m_o r ω² for the first order and in
λ m_o r ω² for the second; moments besides in a distance a along the crank: of neighbouring throws, of neighbouring
pairs of split pins, or of the cylinders where one throw carries all. Order 1 may turn with the crank, and
counterweights then balance it. Source: Köhler and Flierl, *Verbrennungsmotoren*, chapter on mass balance.
"""

import cmath
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.results.free_forces import largest
from cranktrain.studies.design.layouts import Layout

ROUNDING = 9
"""Number of decimals to which free forces and moments are rounded, so that forces that cancel become 0."""


class FreeForces(NamedTuple):
    """Largest resultants of the oscillating masses over a revolution.

    Attributes
    ----------
    first, second : force of the order, in m_o r ω² and λ m_o r ω²
    first_moment, second_moment : likewise, times the distance a
    rotating_moment : of one mass at each throw of a pin, in m r ω² a, as the throws alone leave it
    unbalanced_first, unbalanced_first_moment : parts of the first order that counterweights cannot balance: they turn
        against the crank
    """

    first: float
    second: float
    first_moment: float
    second_moment: float
    rotating_moment: float
    unbalanced_first: float
    unbalanced_first_moment: float


class Places(NamedTuple):
    """Positions of an engine's cylinders along the crank.

    Attributes
    ----------
    along : (c,) positions from the middle of the pins, over ``distance``
    distance : distance a by which moments are divided, m; 1 if there is none
    words : description of this distance
    """

    along: Array
    distance: float
    words: str


def cylinder_places(engine: Engine) -> Places:
    """Positions of an engine's cylinders along the crank; two rods on the same pin have different positions."""
    pins, bays = np.array(engine.crankshaft.pin_positions), engine.crankshaft.bays
    along = np.array(engine.cylinder_positions) - 0.5 * (pins[0] + pins[-1])
    ends = np.cumsum((0, *bays))
    middles = np.array([pins[a:b].mean() for a, b in pairwise(ends)])
    distance, words = 1.0, ""
    if middles.size > 1:
        distance = float(middles[-1] - middles[0]) / (middles.size - 1)
        words = "neighbouring throws" if max(bays) == 1 else "neighbouring pairs of throws"
    elif along.size > 1:
        distance, words = float(np.ptp(along)) / (along.size - 1) or 1.0, "neighbouring cylinders"
    return Places(along / distance, distance, words)


def free_forces(layout: Layout, places: Array | None = None) -> FreeForces:
    """Free forces and moments of the oscillating masses of a layout of cylinders.

    ``places`` (c,) are the cylinders' places from the middle of the crank over the distance a, see
    :func:`cylinder_places`; else cylinders stand over their throws, or over the middle of a pair of split pins.
    """
    banks = np.radians(layout.banks_deg)
    along = np.stack((-np.sin(banks), np.cos(banks)), axis=1)
    pins_of_one = 2 if layout.split else 1
    throws = np.radians(layout.throws_deg)
    pins = (np.arange(throws.size) // pins_of_one).astype(float)
    pins -= 0.5 * pins.max()
    if places is None:
        places = pins[np.array(layout.pins) - 1]
    found, against = [], []
    for order in (1, 2):
        turned = np.exp(-1j * order * np.radians(layout.firing_deg))
        for weight in (np.ones_like(places), places):
            resultant = (weight * turned) @ along
            found.append(largest(resultant))
            against.append(abs(0.5 * (resultant[0] - 1j * resultant[1])))
    couple = abs(sum(z * cmath.exp(1j * angle) for z, angle in zip(pins.tolist(), throws.tolist(), strict=True)))
    values = (found[0], found[2], found[1], found[3], couple, against[0], against[1])
    return FreeForces(*(round(value, ROUNDING) for value in values))
