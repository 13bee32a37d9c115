"""Order tracking: order amplitudes of a signal with varying speed.

The signal is resampled at equal crank angles, where an order is a line at any speed. Around each angle of interest all
lines, each with an amplitude that is quadratic in the angle,

    x(θ) = trend + Re Σ_n (a_n + a_n' τ + a_n'' τ²) exp(i n θ),   τ = θ − θ₀,

are fitted together to a few cycles by least squares with a cos⁴ window. Neighbouring orders therefore do not leak into
one another, and the orders of a steady cycle are exact. The samples are equidistant, so the fit is the same linear map
at every angle. Through a resonance of 2 % damping at 100 rev/min per second its error is 0.06 % of the peak
(``tests/properties/test_orders.py`` asserts 1 %), so no Vold–Kalman filter is needed.
"""

import math

import numpy as np
from scipy.interpolate import CubicSpline

from cranktrain.core.errors import InputError
from cranktrain.results.orders.harmonics import CYCLE, Array, ComplexArray

CYCLES = 4
"""Number of cycles in a fit of orders; a fit has three coefficients per half order, so it needs at least three."""
DEGREE = 2


def tracked_orders(angle: Array, signal: Array, at: Array, highest: float) -> tuple[Array, ComplexArray]:
    """Complex order amplitudes at given crank angles of a signal with varying speed.

    Raises ``InputError``: angles that do not increase, fits that would extend beyond the signal, samples that do not
    resolve the orders.

    Parameters
    ----------
    angle : (k,) increasing crank angle, rad; phases are relative to its zero
    signal : (k, …) values at these angles, any unit
    at : (s,) angles of interest, at least half of ``CYCLES`` cycles away from either end
    highest : highest order

    Returns
    -------
    orders (o,) 0.5, 1, …; amplitudes (s, o, …) in the unit of the signal
    """
    x, places = np.asarray(angle, dtype=float), np.atleast_1d(np.asarray(at, dtype=float))
    if x.ndim != 1 or x.size < 8 or not np.all(np.diff(x) > 0.0):
        raise InputError("order tracking: the crank angle must increase from point to point")
    reach = 0.5 * CYCLES * CYCLE
    if np.any(places - reach < x[0] - 1e-9) or np.any(places + reach > x[-1] + 1e-9):
        raise InputError(
            f"order tracking: each fit takes {CYCLES} cycles of signal; leave {CYCLES // 2} cycles at either end"
        )
    coarsest = float(np.diff(x).max())
    if highest * coarsest > 0.5 * math.pi:
        raise InputError(
            f"order tracking: samples {math.degrees(coarsest):.2g} deg apart resolve orders to "
            f"{0.5 * math.pi / coarsest:.3g}, not to {highest:g}"
        )
    count = math.ceil(8.0 * highest)
    grid = CYCLE / count * (np.arange(CYCLES * count + 1, dtype=np.float64) - 0.5 * CYCLES * count)
    orders = 0.5 * np.arange(1, math.floor(2.0 * highest + 1e-9) + 1, dtype=np.float64)
    # Linear map (o, n) from n samples on a grid of crank angles to o order amplitudes at the grid's middle.
    span = float(grid[-1])
    powers = (grid / span)[:, None] ** np.arange(DEGREE + 1)
    waves = grid[:, None] * orders
    lines = np.concatenate((np.cos(waves), -np.sin(waves)), axis=1)
    basis = np.concatenate([powers] + [powers[:, k : k + 1] * lines for k in range(DEGREE + 1)], axis=1)
    window = np.cos(0.5 * math.pi * grid / span) ** 2
    rows = np.linalg.pinv(window[:, None] * basis)[DEGREE + 1 : DEGREE + 1 + 2 * orders.size] * window
    fit = np.asarray(rows[: orders.size] + 1j * rows[orders.size :])
    samples = CubicSpline(x, signal)(places[:, None] + grid)
    amplitudes = np.tensordot(fit, samples, axes=(1, 1)).swapaxes(0, 1)
    # The fit gives phases relative to the angle at its middle; they are referred to crank angle 0.
    turned = np.exp(-1j * places[:, None] * orders)
    return orders, amplitudes * turned.reshape(*turned.shape, *([1] * (amplitudes.ndim - 2)))
