"""Constants of a toothed wheel: the complex number w that its pitch errors add to a whole order at all speeds.

Pitch errors recur each revolution, so a wheel reads the same w of order 1, 2, 3, … at every speed. Nothing is known of
w before the measurement. With the whitened residuals r of an order and their derivatives B (m, 2) by real and imaginary
part of w, a fit that seeks w as well leaves r − B B⁺ r, with w = B⁺ r. Residuals and derivatives are compared in this
form, so w is eliminated exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.types import Array
from cranktrain_lab.identification.data import Strand

WIDE = 100.0
"""Standard deviation of w over the largest amplitude of its order where a likelihood takes w as a parameter."""


class Constant(NamedTuple):
    """Unknown constant of one order.

    Attributes
    ----------
    by : derivatives (n, c, 2) of the order's rows by real and imaginary part
    columns, inverse : B (m, 2) and B⁺ (2, m) of the whitened rows
    """

    by: Array
    columns: Array
    inverse: Array

    def of(self, rows: Array) -> Array:
        """Constant (2, …) that whitened rows (m, …) give."""
        return np.asarray(np.tensordot(self.inverse, rows, axes=1))

    def left(self, rows: Array) -> Array:
        """Whitened rows (m, …) less the constant that they give."""
        return np.asarray(rows - np.tensordot(self.columns, self.of(rows), axes=1))


class FoundConstant(NamedTuple):
    """Constant of an order that a fit has found.

    Attributes
    ----------
    value, slopes : (2,) real and imaginary part, and their derivatives (2, p) by u
    spread : covariance (2, 2) at known u
    by : derivatives (n, c, 2) of the order's rows by real and imaginary part
    """

    value: Array
    slopes: Array
    spread: Array
    by: Array

    @property
    def number(self) -> complex:
        """The constant as a complex number."""
        return complex(*self.value)


def by_constant(strand: Strand, turn: NDArray[np.complex128]) -> Array:
    """Derivatives (n, c, 2) of an order's rows by its constant; ``turn`` (n,) turns into the model's phase.

    Amplitudes alone depend on w by |y + w| ≈ |y| + Re(w exp(−i arg y)), which holds for w far below y.
    """
    if strand.phases:
        return np.tile(np.eye(2), (turn.size, 1, 1))
    return np.stack((turn.real, -turn.imag), axis=1)[:, None, :]


def beside_slopes(slopes: Sequence[Array], columns: Sequence[Array | None], known: Array) -> tuple[list[Array], Array]:
    """Derivatives and prior information of a likelihood that takes the constants of a set as further parameters.

    Parameters
    ----------
    slopes : derivatives (n, c, p) of each order
    columns : derivatives (n, c, 2) of each order by its constant, over the constant's standard deviation; None where it
        has none
    known : prior information (p, p)
    """
    p, count = known.shape[0], 2 * sum(one is not None for one in columns)
    found, first = [], p
    for own, by in zip(slopes, columns, strict=True):
        wide = np.zeros((*own.shape[:2], p + count))
        wide[..., :p] = own
        if by is not None:
            wide[..., first : first + 2] = by
            first += 2
        found.append(wide)
    information = np.eye(p + count)
    information[:p, :p] = known
    return found, information
