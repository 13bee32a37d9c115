"""Orders of a periodic signal: zero-to-peak amplitudes of its harmonics per 720° cycle.

Order n counts n oscillations per revolution, so a four-stroke cycle has the orders 0.5, 1, 1.5, …
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from cranktrain.core.errors import InputError

Array = NDArray[np.float64]

CYCLE = 4.0 * math.pi


def order_spectrum(signal: Array, highest: float | None = None) -> tuple[Array, Array]:
    """Order amplitudes of one cycle.

    Raises ``InputError``: for fewer than two samples or values that are not finite.

    Parameters
    ----------
    signal : (n,) uniform samples over one 720° cycle, its end point left out; any unit
    highest : largest order to return; None returns all that n samples resolve, up to n/4

    Returns
    -------
    orders (k,) 0.5, 1, …; amplitudes (k,) zero-to-peak in the unit of the signal. The mean (order 0) is left out.
    """
    values = np.asarray(signal, dtype=float)
    n = values.size
    if values.ndim != 1 or n < 2 or not np.all(np.isfinite(values)):
        raise InputError("order spectrum: one cycle of at least two finite samples is wanted")
    amplitudes: Array = 2.0 * np.abs(np.fft.rfft(values))[1:] / n
    if n % 2 == 0:
        amplitudes[-1] *= 0.5  # the last line of an even number of samples stands alone, without its mirror image
    orders = 0.5 * np.arange(1, amplitudes.size + 1, dtype=np.float64)
    keep = orders <= (math.inf if highest is None else highest + 1e-9)
    return orders[keep], amplitudes[keep]


def last_cycle(angle: Array, signal: Array, n: int = 1440) -> Array:
    """Resample the last 720° of a signal at uniform crank angles, by a cubic spline over the crank angle.

    Raises ``InputError``: if the run is shorter than a cycle by more than a quarter of its first sample, or the angle
    does not increase.

    Parameters
    ----------
    angle : (k,) increasing crank angle, rad, its spacing as the speed made it
    signal : (k,) values at those angles, any unit
    n : number of samples

    Returns
    -------
    (n,) samples at angle[-1] − 4π + 4π i/n
    """
    x, y = np.asarray(angle, dtype=float), np.asarray(signal, dtype=float)
    if x.shape != y.shape or x.ndim != 1 or x.size < 8:
        raise InputError("last cycle: angle and signal must be equally long, with at least 8 points")
    if not np.all(np.diff(x) > 0.0):
        raise InputError("last cycle: the crank angle must increase from point to point")
    start = x[-1] - CYCLE
    # The crank swings about its shaft: one turning cycle may start and end a trifle apart.
    if start < x[0] - 0.25 * (x[1] - x[0]):
        raise InputError(f"last cycle: the run covers {math.degrees(x[-1] - x[0]):.0f} of 720 deg; simulate longer")
    first = max(int(np.searchsorted(x, start)) - 8, 0)  # a few points before the cycle settle the spline's end
    return np.asarray(CubicSpline(x[first:], y[first:])(start + np.arange(n) * (CYCLE / n)))
