"""Constants of a toothed wheel: complex numbers w that its pitch errors add to a whole order at all speeds.

Pitch errors recur each revolution, so a wheel adds the same w to order 1, 2, 3, … at every speed. w is unknown before
the measurement. With the whitened residuals r of an order and their derivatives B (m, 2) by real and imaginary part of
w, a fit that includes w has w = B⁺ r and the residual r − B B⁺ r. Residuals and derivatives are used in this form, so w
is eliminated exactly.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.types import Array
from cranktrain_lab.identification.data import Strand

WIDE = 100.0
"""Prior standard deviation of w in the likelihood, as a multiple of the largest amplitude of its order."""


class Constant(NamedTuple):
    """Unknown constant that a toothed wheel adds to one order.

    Attributes
    ----------
    by : derivatives (n, c, 2) of the order's rows by real and imaginary part
    columns, inverse : B (m, 2) and B⁺ (2, m) of the whitened rows
    """

    by: Array
    columns: Array
    inverse: Array

    def of(self, rows: Array) -> Array:
        """Return the constant's real and imaginary part (2, …) fitted to m whitened residuals (m, …)."""
        return np.asarray(np.tensordot(self.inverse, rows, axes=1))

    def left(self, rows: Array) -> Array:
        """Return m whitened residuals (m, …) minus their fitted constant."""
        return np.asarray(rows - np.tensordot(self.columns, self.of(rows), axes=1))


class FoundConstant(NamedTuple):
    """Fitted constant that a toothed wheel adds to an order.

    Attributes
    ----------
    value, slopes : (2,) real and imaginary part, and their derivatives (2, p) by u
    spread : covariance (2, 2) for known u
    by : derivatives (n, c, 2) of the order's rows by real and imaginary part
    """

    value: Array
    slopes: Array
    spread: Array
    by: Array

    @property
    def number(self) -> complex:
        """The wheel's constant as a complex number."""
        return complex(*self.value)


def by_constant(strand: Strand, turn: NDArray[np.complex128]) -> Array:
    """Return derivatives (n, c, 2) of an order's rows by its constant; ``turn`` (n,) rotates into the model's phase.

    Amplitudes without phase depend on w by |y + w| ≈ |y| + Re(w exp(−i arg y)), valid for w far below y.
    """
    if strand.phases:
        return np.tile(np.eye(2), (turn.size, 1, 1))
    return np.stack((turn.real, -turn.imag), axis=1)[:, None, :]


def beside_slopes(slopes: Sequence[Array], columns: Sequence[Array | None], known: Array) -> tuple[list[Array], Array]:
    """Return derivatives and prior information of a likelihood with the constants of a set as further parameters.

    Parameters
    ----------
    slopes : derivatives (n, c, p) of each order
    columns : derivatives (n, c, 2) of each order by its constant in standard deviations; None without a constant
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
