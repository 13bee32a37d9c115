"""Vold–Kalman filter of the second generation, for envelopes of all orders over time at once.

    min Σ_t |x − Re Σ_n a_n(t) exp(i n φ(t))|² + Σ_n r² Σ_t |∇^p a_n|²

The structural equation states that an envelope's p-th difference is small. With real and imaginary parts of the
envelopes the normal equations are real, symmetric and banded. They are solved for all orders together, which separates
orders that cross or beat. The envelope's transfer function is ½ / (½ + r² (2 − 2 cos ω)^p), which gives r for a
bandwidth (−3 dB).

Source: H. Vold, J. Leuridan, High resolution order tracking at extreme slew rates, using Kalman tracking filters, SAE
931288 (1993); J. Tuma, Setting the passband width in the Vold–Kalman order tracking filter, ICSV12 (2005).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array

POLES = 2
MOST_UNKNOWNS = 40_000_000
"""Largest number of elements of the band matrix (320 MB)."""


def envelopes(
    phase: Array, values: Array, step: float, orders: Array, bandwidth: float, poles: int = POLES
) -> NDArray[np.complex128]:
    """Return complex envelopes (t, o), zero to peak, of o orders of a signal at t uniform times.

    Raises ``InputError`` for a bandwidth not below a quarter of the sampling rate, orders above the Nyquist frequency,
    or a record too long for the memory.

    Parameters
    ----------
    phase, values : (t,) mean rotation, rad, and the signal without its trend
    step : time step, s
    orders : (o,) any positive numbers
    bandwidth : one-sided bandwidth of an envelope (−3 dB), Hz
    poles : number of poles p, 1 to 4
    """
    n, count = values.size, orders.size
    if not 0.0 < bandwidth < 0.25 / step:
        raise InputError(f"Vold-Kalman: a bandwidth of {bandwidth:g} Hz is not between 0 and {0.25 / step:g} Hz")
    fastest = float(np.diff(phase).max()) / step / math.tau
    if float(orders.max()) * fastest > 0.5 / step:
        raise InputError(
            f"Vold-Kalman: order {orders.max():g} reaches {orders.max() * fastest:.4g} Hz, samples resolve "
            f"{0.5 / step:.4g} Hz (aliasing)"
        )
    width, unknowns = 2 * count, 2 * count * n
    band = width * poles
    if (band + 1) * unknowns > MOST_UNKNOWNS:
        raise InputError(
            f"Vold-Kalman: {n} samples and {count} orders take {8e-9 * (band + 1) * unknowns:.2g} GB; "
            "take fewer orders, a lower rate or a shorter part"
        )
    from scipy.linalg import solveh_banded

    r2 = 0.5 * (math.sqrt(2.0) - 1.0) / (2.0 - 2.0 * math.cos(math.tau * bandwidth * step)) ** poles
    waves = np.exp(1j * phase[:, None] * orders)
    rows = np.empty((n, width))
    rows[:, 0::2], rows[:, 1::2] = waves.real, -waves.imag
    matrix = np.zeros((band + 1, unknowns))  # lower form: matrix[k, j] = A[j + k, j]
    for k in range(width):
        product = rows[:, k:] * rows[:, : width - k]
        for j in range(width - k):
            matrix[k, j::width] += product[:, j]
    for lag, diagonal in enumerate(_differences(n, poles)):
        matrix[lag * width, : (n - lag) * width] += r2 * np.repeat(diagonal, width)
    found = solveh_banded(matrix, (rows * values[:, None]).ravel(), lower=True, overwrite_ab=True, check_finite=False)
    found = found.reshape(n, width)
    return np.asarray(found[:, 0::2] + 1j * found[:, 1::2])


def _differences(n: int, poles: int) -> list[Array]:
    """Return diagonals of ∇ᵖᵀ ∇ᵖ for n samples, from the main diagonal on."""
    taps = np.array([(-1.0) ** k * math.comb(poles, k) for k in range(poles + 1)])
    diagonals = []
    for lag in range(poles + 1):
        diagonal = np.zeros(n - lag)
        for k in range(poles + 1 - lag):
            # Row i of ∇ᵖ has taps at i … i + p, so it adds taps[k] taps[k + lag] to the entry (i + k, i + k + lag).
            diagonal[k : k + n - poles] += taps[k] * taps[k + lag]
        diagonals.append(diagonal)
    return diagonals
