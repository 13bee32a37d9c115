"""Third-octave bands and the sound power that vibrating panels radiate into air.

The power of a panel of area A with the mean square normal velocity <v_n²> is P = ρ c σ A <v_n²>. With radiation
efficiency σ = 1 it is the equivalent radiated power (ERP). By plate theory a panel is a simply supported, baffled plate
of uniform thickness h whose resonant modes share the energy equally: below its critical frequency f_c = √3 c² / (π h
c_L), with c_L = √(E / (ρ_p (1 − ν²))), edges and corners radiate; above it σ = 1 / √(1 − f_c / f).

Sources: IEC 61260-1:2014 (bands, base 10); IEC 61672-1:2013, annex E (A-weighting); G. Maidanik, J. Acoust. Soc. Am. 34
(1962) 809; F. G. Leppington, E. G. Broadbent, K. H. Heron, Proc. R. Soc. Lond. A 382 (1982) 245; both as in EN
12354-1:2000, annex B.
"""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.types import Array
from cranktrain.engine.parts import Material

DENSITY, SPEED = 1.204, 343.2
"""Density (kg/m³) and speed of sound (m/s) of air at 20 °C and 101325 Pa."""
POWER_REFERENCE, VELOCITY_REFERENCE = 1e-12, 1e-9
"""References of levels: W (ISO 1683) and m/s (ISO 1683; ISO 7849 uses 5e-8 m/s, which gives 34 dB less)."""
EFFICIENCIES = ("one", "plate")
"""Assumptions on the radiation efficiency."""
_NOMINAL = (1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0)
_LARGEST = 2.0
"""Largest radiation efficiency of a plate near its critical frequency (EN 12354-1)."""


class Bands(NamedTuple):
    """Third-octave bands: nominal frequencies, and edges ``low`` ≤ f < ``high``, (b,) Hz."""

    nominal: Array
    low: Array
    high: Array

    def sums(self, frequency: Array, values: Array) -> Array:
        """Sum (…, b) of the lines (…, l) in each band, for frequencies (l,), Hz."""
        inside = (frequency[:, None] >= self.low) & (frequency[:, None] < self.high)
        return np.asarray(values @ inside.astype(float))


def third_octaves(lowest: float, highest: float) -> Bands:
    """Bands from the one that contains ``lowest``, Hz, to the last that ends at or below ``highest``."""
    first, last = round(10.0 * math.log10(lowest)), math.floor(10.0 * math.log10(highest) - 0.5 + 1e-9)
    numbers = np.arange(first, last + 1)
    middle = 10.0 ** (numbers / 10.0)
    nominal = np.array([_NOMINAL[k % 10] * 10.0 ** (k // 10) for k in numbers.tolist()])
    return Bands(nominal, middle * 10.0**-0.05, middle * 10.0**0.05)


def level(values: Array | float, reference: float) -> Array:
    """Level, dB, of squares or powers over the square or power ``reference``; −inf for 0."""
    with np.errstate(divide="ignore"):
        return 10.0 * np.log10(np.asarray(values) / reference)


def a_weighting(frequency: Array) -> Array:
    """A-weighting, as a factor of powers, at frequencies (l,), Hz; 1 at 1000 Hz."""

    def response(f: Array) -> Array:
        square = np.asarray(f, dtype=float) ** 2
        edges = np.sqrt((square + 107.65265**2) * (square + 737.86223**2))
        return 12194.217**2 * square**2 / ((square + 20.598997**2) * edges * (square + 12194.217**2))

    return np.asarray((response(frequency) / response(np.array(1000.0))) ** 2)


def critical_frequency(thickness: float, material: Material) -> float:
    """Critical frequency, Hz, of a plate in air; ``thickness`` m."""
    wave = math.sqrt(material.youngs_modulus / (material.density * (1.0 - material.poisson_ratio**2)))
    return math.sqrt(3.0) * SPEED**2 / (math.pi * thickness * wave)


def plate_efficiency(frequency: Array, critical: float, sides: tuple[float, float]) -> Array:
    """Radiation efficiency (l,) of a plate at frequencies (l,), Hz.

    Parameters
    ----------
    critical : critical frequency, Hz
    sides : lengths of its edges, m
    """
    a, b = sides
    f = np.asarray(frequency, dtype=float)
    first = SPEED**2 / (4.0 * critical) * (1.0 / a**2 + 1.0 / b**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        above = 1.0 / np.sqrt(1.0 - critical / f)
        whole = 4.0 * a * b * (f / SPEED) ** 2
        border = np.sqrt(2.0 * math.pi * f * (a + b) / (16.0 * SPEED))
        ratio = np.minimum(np.sqrt(f / critical), 1.0 - 1e-9)
        rest = 1.0 - ratio**2
        edges = (rest * np.log((1.0 + ratio) / (1.0 - ratio)) + 2.0 * ratio) / (4.0 * math.pi**2 * rest**1.5)
        corners = 8.0 * SPEED**2 * (1.0 - 2.0 * ratio**2) / (
            critical**2 * math.pi**4 * a * b * ratio * np.sqrt(rest)
        )  # fmt: skip
        corners = np.where(f < 0.5 * critical, corners, 0.0)
        below = 2.0 * (a + b) / (a * b) * SPEED / critical * edges + corners
    if first <= 0.5 * critical:
        found = np.where(f >= critical, above, np.where(f < first, np.minimum(below, whole), below))
    else:
        found = np.where(f < critical, np.minimum(whole, border), np.minimum(above, border))
    return np.asarray(np.clip(found, 0.0, _LARGEST))
