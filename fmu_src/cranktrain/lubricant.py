"""Lubricating oil: viscosity against temperature and temperature against engine speed.

Vogel's law η = a exp(b / (T − c)) holds within a few per cent from 0 to 150 °C; pressure does not enter here. The
temperature follows a table over engine speed, linear between its points and constant outside.

Source: H. Vogel, Das Temperaturabhängigkeitsgesetz der Viskosität von Flüssigkeiten, Phys. Z. 22 (1921) 645.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cranktrain.engine import Oil
from cranktrain.errors import InputError
from cranktrain.kernel import kernel


def vogel_through(points: Sequence[tuple[float, float]]) -> tuple[float, float, float]:
    """Vogel constants through three points.

    Parameters
    ----------
    points : three pairs of temperature (K, increasing) and dynamic viscosity (Pa s, decreasing)

    Returns
    -------
    a (Pa s), b (K), c (K)

    Raises
    ------
    InputError
        if the points do not fall on a curve of Vogel's form
    """
    if len(points) != 3:
        raise InputError(f"Vogel's law takes three points of temperature and viscosity, got {len(points)}")
    (t1, eta1), (t2, eta2), (t3, eta3) = points
    if not (0.0 < t1 < t2 < t3 and eta1 > eta2 > eta3 > 0.0):
        raise InputError("Vogel's law: temperatures must increase and viscosities decrease from point to point")
    near = math.log(eta1 / eta2) * (t3 - t2)
    far = math.log(eta2 / eta3) * (t2 - t1)
    if near <= far:
        raise InputError("Vogel's law: ln(viscosity) must flatten with temperature; check the third point")
    c = (near * t1 - far * t3) / (near - far)
    b = math.log(eta1 / eta2) * (t1 - c) * (t2 - c) / (t2 - t1)
    return eta1 * math.exp(-b / (t1 - c)), b, c


def viscosity(oil: Oil, temperature: float) -> float:
    """Dynamic viscosity of ``oil``, Pa s, at ``temperature``, K; ``InputError`` at or below the law's pole."""
    if not temperature > oil.vogel_c:
        raise InputError(
            f"oil temperature {temperature:.4g} K lies below Vogel's law; give more than {oil.vogel_c:.4g} K"
        )
    return float(vogel_viscosity(temperature, oil.vogel_a, oil.vogel_b, oil.vogel_c))


def oil_temperature(oil: Oil, speed: float) -> float:
    """Temperature of ``oil``, K, at engine speed ``speed``, rad/s."""
    return float(
        temperature_at(speed, np.array(oil.temperature_speeds, dtype=float), np.array(oil.temperatures, dtype=float))
    )


@kernel
def vogel_viscosity(temperature: float, a: float, b: float, c: float) -> float:
    """Vogel's law, Pa s; ``temperature``, ``b`` and ``c`` in K, ``a`` in Pa s."""
    return a * math.exp(b / (temperature - c))


@kernel
def temperature_at(speed: float, speeds: NDArray[np.float64], temperatures: NDArray[np.float64]) -> float:
    """Temperature (K) at ``speed`` from a table over increasing ``speeds`` (rad/s), constant outside it."""
    n = speeds.shape[0]
    if speed <= speeds[0]:
        return temperatures[0]
    for i in range(1, n):
        if speed <= speeds[i]:
            share = (speed - speeds[i - 1]) / (speeds[i] - speeds[i - 1])
            return temperatures[i - 1] + share * (temperatures[i] - temperatures[i - 1])
    return temperatures[n - 1]
