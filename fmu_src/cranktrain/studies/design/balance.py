"""Free forces and moments of a layout's oscillating masses in closed form, for throws at equal distances.

The piston of a cylinder whose throw has its dead centre at φ presses along its bank, unit vector u, by

    F = m_o r ω² [cos(θ − φ) + λ cos 2(θ − φ)] u,   λ = throw over rod length.

An order's resultant Σ exp(−ikφ) u and its moment Σ z exp(−ikφ) u about the middle of the crank are complex vectors in
the plane across the crank. Their largest magnitudes over a revolution are given in m_o r ω² for the first order and in
λ m_o r ω² for the second; moments besides in the distance of neighbouring throws. Order 1 may turn with the crank, and
counterweights then balance it. Source: Köhler and Flierl, *Verbrennungsmotoren*, chapter on mass balance.
"""

from __future__ import annotations

import cmath
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.types import Array
from cranktrain.studies.design.layouts import Layout

ROUNDING = 9
"""Digits to which resultants are rounded, so that those that cancel are 0."""


class FreeForces(NamedTuple):
    """Largest resultants of the oscillating masses over a revolution.

    Attributes
    ----------
    first, second : force of the order, in m_o r ω² and λ m_o r ω²
    first_moment, second_moment : likewise, times the distance of neighbouring throws
    rotating_moment : of one mass at each throw of a pin, in m r ω² times that distance, as the throws alone leave it
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


def free_forces(layout: Layout) -> FreeForces:
    """Free forces and moments of a layout."""
    banks = np.radians(layout.banks_deg)
    along = np.stack((-np.sin(banks), np.cos(banks)), axis=1)
    places = np.array(layout.pins, dtype=float)
    places -= 0.5 * (1.0 + places.max())
    found, against = [], []
    for order in (1, 2):
        turned = np.exp(-1j * order * np.radians(layout.firing_deg))
        for weight in (np.ones_like(places), places):
            resultant = (weight * turned) @ along
            found.append(_largest(resultant))
            against.append(abs(0.5 * (resultant[0] - 1j * resultant[1])))
    throws = np.radians(layout.throws_deg)
    pins = np.arange(1.0, throws.size + 1.0) - 0.5 * (1.0 + throws.size)
    couple = abs(sum(z * cmath.exp(1j * angle) for z, angle in zip(pins.tolist(), throws.tolist(), strict=True)))
    values = (found[0], found[2], found[1], found[3], couple, against[0], against[1])
    return FreeForces(*(round(value, ROUNDING) for value in values))


def _largest(resultant: NDArray[np.complex128]) -> float:
    """Largest magnitude of Re[a exp(iθ)] over θ: the major half axis of its ellipse."""
    square: Array = np.abs(resultant) ** 2
    return math.sqrt(0.5 * (float(square.sum()) + abs(complex((resultant**2).sum()))))
