"""Orders of a periodic signal, its harmonics over a cycle of 720°.

Order n counts n oscillations per revolution, so a four-stroke cycle has the orders 0.5, 1, 1.5, … Over the crank angle

    x(θ) = mean + Re Σ a_n exp(i n θ),

so |a_n| is zero to peak, and a cosine that peaks at θ = 0 has a real, positive a_n. A cycle sampled at equal angles has
no leakage, so all orders that its samples resolve are exact.
"""

import math

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array, ComplexArray

CYCLE = 4.0 * math.pi


def order_amplitudes(signal: Array, highest: float | None = None, cycles: int = 1) -> tuple[Array, ComplexArray]:
    """Complex order amplitudes of one cycle, or of the mean of several.

    Raises ``InputError``: for fewer than two samples, values that are not finite, or a largest order that the samples
    do not resolve.

    Parameters
    ----------
    signal : (n, …) uniform samples over ``cycles`` cycles of 720°, without the end point; any unit
    highest : highest order to return; None for all that the samples resolve, up to n/(4 ``cycles``)

    Returns
    -------
    orders (k,) 0.5, 1, …; amplitudes (k, …) in the unit of the signal. The mean (order 0) is left out.
    """
    values = np.asarray(signal, dtype=float)
    n = values.shape[0] if values.ndim else 0
    if n < 2 * cycles or n % cycles or not np.all(np.isfinite(values)):
        raise InputError("order spectrum: one cycle of at least two finite samples is wanted")
    amplitudes: ComplexArray = 2.0 * np.fft.rfft(values, axis=0)[cycles::cycles] / n
    if n % 2 == 0:
        amplitudes[-1] *= 0.5  # with an even number of samples the highest line has no mirror image
    resolved = 0.5 * amplitudes.shape[0]
    if highest is not None and highest > resolved + 1e-9:
        raise InputError(
            f"order spectrum: order {highest:g} needs more samples; those of this cycle resolve {resolved:g}"
        )
    orders = 0.5 * np.arange(1, amplitudes.shape[0] + 1, dtype=np.float64)
    keep = orders <= (math.inf if highest is None else highest + 1e-9)
    return orders[keep], amplitudes[keep]


def order_spectrum(signal: Array, highest: float | None = None) -> tuple[Array, Array]:
    """Order amplitudes of one cycle.

    Raises ``InputError``: for fewer than two samples or values that are not finite.

    Parameters
    ----------
    signal : (n,) uniform samples over one 720° cycle, without the end point; any unit
    highest : highest order to return; None or a higher one for all that n samples resolve, up to n/4

    Returns
    -------
    orders (k,) 0.5, 1, …; amplitudes (k,) zero-to-peak in the unit of the signal. The mean (order 0) is left out.
    """
    if np.ndim(signal) != 1:
        raise InputError("order spectrum: one cycle of at least two finite samples is wanted")
    orders, amplitudes = order_amplitudes(signal)
    keep = orders <= (math.inf if highest is None else highest + 1e-9)
    return orders[keep], np.abs(amplitudes[keep])


def last_cycle(angle: Array, signal: Array, n: int = 1440, from_zero: bool = False) -> Array:
    """Resample the last 720° of a signal at uniform crank angles, by a cubic spline over the crank angle.

    Raises ``InputError``: if the run is shorter than a cycle by more than a quarter of its first sample, or the angle
    does not increase.

    Parameters
    ----------
    angle : (k,) increasing crank angle, rad, not necessarily equidistant
    signal : (k,) values at these angles, any unit
    n : number of samples
    from_zero : take the samples at the same crank angles for every run, from firing dead centre of cylinder 1 on

    Returns
    -------
    (n,) samples at angle[-1] − 4π + 4π i/n, or at crank angle 4π i/n modulo 4π
    """
    x, y = np.asarray(angle, dtype=float), np.asarray(signal, dtype=float)
    if x.shape != y.shape or x.ndim != 1 or x.size < 8:
        raise InputError("last cycle: angle and signal must be equally long, with at least 8 points")
    if not np.all(np.diff(x) > 0.0):
        raise InputError("last cycle: the crank angle must increase from point to point")
    start = x[-1] - CYCLE
    # The crank oscillates on its shaft, so the angle covered by one cycle may be slightly less than 720°.
    if start < x[0] - 0.25 * (x[1] - x[0]):
        raise InputError(f"last cycle: the run covers {math.degrees(x[-1] - x[0]):.1f} of 720 deg; simulate longer")
    first = max(int(np.searchsorted(x, start)) - 8, 0)  # some points before the cycle reduce end effects of the spline
    from scipy.interpolate import CubicSpline  # imported here because the import is slow

    curve = CubicSpline(x[first:], y[first:])
    if from_zero:
        # Rounding of the last angle must not decide whether the cycle begins at this sample or at the next one.
        begin = math.ceil(start * n / CYCLE - 1e-6)
        return np.roll(curve((begin + np.arange(n)) * (CYCLE / n)), begin % n)
    return np.asarray(curve(start + np.arange(n) * (CYCLE / n)))
