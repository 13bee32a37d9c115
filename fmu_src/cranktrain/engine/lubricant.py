"""Lubricating oil: viscosity against temperature and pressure, and temperature against engine speed.

Vogel's law η = a exp(b / (T − c)) holds within a few per cent from 0 to 150 °C. Walther's (ASTM D341, viscosities above
2 mm²/s) takes two points of the kinematic viscosity ν = η/ρ, in mm²/s,

    lg lg(ν + 0.7) = A − B lg T

with one density for all temperatures. Under pressure (gauge) the viscosity grows by Barus's law exp(α p) or by that of
Roelands, which has the same slope α at ambient pressure but grows less than Barus at hundreds of megapascal:

    η/η₀ = exp{(ln η₀ + 9.67) [(1 + p/p_R)^Z − 1]},    p_R = 196.2 MPa,    Z = α p_R / (ln η₀ + 9.67)

and the density, by Dowson and Higginson's law for mineral oils, by

    ρ/ρ₀ = 1 + 0.6e-9 p/(1 + 1.7e-9 p)        (p in Pa).

The temperature follows a table over engine speed, linear between its points and constant outside.

Sources: H. Vogel, Phys. Z. 22 (1921) 645; ASTM D341; C. Barus, Am. J. Sci. 45 (1893) 87; C. J. A. Roelands,
Correlational Aspects of the Viscosity-Temperature-Pressure Relationship of Lubricating Oils (Delft, 1966);
D. Dowson, G. R. Higginson, Elasto-hydrodynamic Lubrication (Oxford, 1966).
"""

import math
from collections.abc import Sequence

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.kernel import kernel
from cranktrain.core.types import Array
from cranktrain.engine.parts import Oil

CONSTANT, BARUS, ROELANDS = 0, 1, 2
PRESSURE_LAWS = {"none": CONSTANT, "barus": BARUS, "roelands": ROELANDS}
VOGEL, WALTHER = 0, 1
# Slots of :func:`oil_constants`: the viscosity law, and its three constants.
OIL_LAW, OIL_FIRST, OIL_SECOND, OIL_THIRD, OIL_CONSTANTS = range(5)
ROELANDS_PRESSURE = 1.962e8
ROELANDS_LOG = 9.67
DENSITY_SLOPE, DENSITY_LIMIT = 0.6e-9, 1.7e-9
"""Constants (1/Pa) of Dowson and Higginson's density law, the same for all mineral oils."""


def walther_through(points: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Walther constants (ASTM D341) through two points.

    Raises ``InputError`` for viscosities that do not fall with temperature, or too low ones, at which the law has no
    value.

    Parameters
    ----------
    points : two pairs of temperature (K, increasing) and kinematic viscosity (m²/s, decreasing)

    Returns
    -------
    A, B of lg lg(ν + 0.7) = A − B lg T with ν in mm²/s
    """
    if len(points) != 2:
        raise InputError(f"Walther's law takes two points of temperature and viscosity, got {len(points)}")
    (t1, nu1), (t2, nu2) = points
    if not (0.0 < t1 < t2 and nu1 > nu2):
        raise InputError("Walther's law: temperatures must increase and viscosities decrease from point to point")
    if not nu2 > 0.3e-6:
        raise InputError(
            f"Walther's law holds above 2 mm^2/s and has no value at {1e6 * nu2:.4g} mm^2/s; "
            f"give kinematic viscosities in m^2/s"
        )
    w1, w2 = (math.log10(math.log10(1e6 * nu + 0.7)) for nu in (nu1, nu2))
    slope = (w1 - w2) / (math.log10(t2) - math.log10(t1))
    return w1 + slope * math.log10(t1), slope


def viscosity(oil: Oil, temperature: float) -> float:
    """Dynamic viscosity of ``oil``, Pa s, at ``temperature``, K, and ambient pressure.

    Raises ``InputError`` for an unknown law, or a temperature at which the law has no value.
    """
    if oil.law == "walther":
        if not 0.0 < temperature < math.inf:
            raise InputError(f"oil temperature {temperature:.4g} K must be positive; 293.15 K are 20 degC")
    elif oil.law == "vogel" and not temperature > oil.vogel_c:
        raise InputError(
            f"oil temperature {temperature:.4g} K lies below Vogel's law; give more than {oil.vogel_c:.4g} K"
        )
    return float(oil_viscosity(temperature, oil_constants(oil)))


def oil_constants(oil: Oil) -> Array:
    """Constants (OIL_CONSTANTS,) of :func:`oil_viscosity`; ``InputError`` for an unknown law."""
    if oil.law == "walther":
        points = list(zip(oil.walther_temperatures, oil.walther_viscosities, strict=False))
        return np.array([WALTHER, *walther_through(points), oil.density])
    if oil.law != "vogel":
        raise InputError(f"oil law '{oil.law}' does not exist; {nearest(oil.law, ('vogel', 'walther'))}")
    return np.array([VOGEL, oil.vogel_a, oil.vogel_b, oil.vogel_c])


def pressure_constants(oil: Oil, viscosity: float) -> tuple[int, float, float]:
    """Viscosity-pressure law (integer) and its two constants; ``viscosity`` (Pa s) is at ambient pressure.

    Raises ``InputError`` for an unknown law, a negative slope, or a viscosity below 6.3e-5 Pa s (9.67 = −ln of it),
    where Roelands' law has no value.
    """
    if oil.pressure_law not in PRESSURE_LAWS:
        near = nearest(oil.pressure_law, PRESSURE_LAWS)
        raise InputError(f"pressure law '{oil.pressure_law}' does not exist; {near}")
    law, alpha = PRESSURE_LAWS[oil.pressure_law], oil.pressure_viscosity
    if not 0.0 <= alpha < math.inf:
        raise InputError(f"pressure_viscosity {alpha:.4g} 1/Pa must not be negative; mineral oils have 15 to 25 1/GPa")
    if law != ROELANDS:
        return law, alpha, 0.0
    above, exponent = roelands_constants(viscosity, alpha)
    if not above > 0.0:
        least = math.exp(-ROELANDS_LOG)
        raise InputError(f"Roelands' law needs a viscosity above {least:.3g} Pa s, got {viscosity:.4g}")
    return law, above, exponent


def oil_temperature(oil: Oil, speed: float) -> float:
    """Temperature of ``oil``, K, at an engine speed, rad/s."""
    return float(
        temperature_at(speed, np.array(oil.temperature_speeds, dtype=float), np.array(oil.temperatures, dtype=float))
    )


@kernel
def oil_viscosity(temperature: float, constants: Array) -> float:
    """Viscosity (Pa s) at a temperature (K) and ambient pressure, by :func:`oil_constants`; 0 outside the law."""
    if constants[OIL_LAW] == WALTHER:
        if not 0.0 < temperature < math.inf:
            return 0.0
        return walther_viscosity(temperature, constants[OIL_FIRST], constants[OIL_SECOND], constants[OIL_THIRD])
    if not temperature > constants[OIL_THIRD]:
        return 0.0
    return vogel_viscosity(temperature, constants[OIL_FIRST], constants[OIL_SECOND], constants[OIL_THIRD])


@kernel
def vogel_viscosity(temperature: float, a: float, b: float, c: float) -> float:
    """Vogel's law, Pa s; ``temperature``, ``b`` and ``c`` in K, ``a`` in Pa s."""
    return a * math.exp(b / (temperature - c))


@kernel
def walther_viscosity(temperature: float, a: float, b: float, density: float) -> float:
    """Walther's law, Pa s; ``temperature`` in K, ``density`` in kg/m³."""
    nu = 10.0 ** (10.0 ** (a - b * math.log10(temperature))) - 0.7
    return 1.0e-6 * density * nu


@kernel
def barus_factor(pressure: float, alpha: float) -> tuple[float, float]:
    """Barus factor η/η₀ and its derivative by ``pressure`` (Pa; ``alpha`` and the derivative in 1/Pa)."""
    factor = math.exp(alpha * pressure)
    return factor, alpha * factor


@kernel
def roelands_factor(pressure: float, above: float, z: float) -> tuple[float, float]:
    """Roelands factor η/η₀ and its derivative (1/Pa) by ``pressure`` (Pa); ``above``: ln η₀ + 9.67, ``z``: exponent.

    Below minus half of Roelands' pressure the factor is constant.
    """
    lowest = -0.5 * ROELANDS_PRESSURE
    base = 1.0 + (pressure if pressure > lowest else lowest) / ROELANDS_PRESSURE
    power = base**z
    factor = math.exp(above * (power - 1.0))
    if pressure <= lowest:
        return factor, 0.0
    return factor, factor * above * z * power / (base * ROELANDS_PRESSURE)


@kernel
def roelands_constants(viscosity: float, slope: float) -> tuple[float, float]:
    """Constants of Roelands' law: ln η₀ + 9.67, which must be positive, and the exponent for a ``slope`` α, 1/Pa."""
    above = math.log(viscosity) + ROELANDS_LOG if viscosity > 0.0 else -math.inf
    return above, slope * ROELANDS_PRESSURE / above


@kernel
def pressure_factor(law: int, pressure: float, first: float, second: float) -> tuple[float, float]:
    """Factor η/η₀ at ``pressure`` (Pa, gauge) and its derivative (1/Pa), by :func:`pressure_constants`."""
    if law == BARUS:
        return barus_factor(pressure, first)
    if law == ROELANDS:
        return roelands_factor(pressure, first, second)
    return 1.0, 0.0


@kernel
def density_factor(pressure: float) -> tuple[float, float]:
    """Dowson–Higginson factor ρ/ρ₀ at ``pressure`` (Pa, gauge; 1 in tension), and its derivative (1/Pa)."""
    if pressure <= 0.0:
        return 1.0, 0.0
    below = 1.0 + DENSITY_LIMIT * pressure
    return 1.0 + DENSITY_SLOPE * pressure / below, DENSITY_SLOPE / (below * below)


@kernel
def temperature_at(speed: float, speeds: Array, temperatures: Array) -> float:
    """Temperature (K) at ``speed`` from a table over increasing ``speeds`` (rad/s), constant outside it."""
    n = speeds.shape[0]
    if speed <= speeds[0]:
        return temperatures[0]
    for i in range(1, n):
        if speed <= speeds[i]:
            share = (speed - speeds[i - 1]) / (speeds[i] - speeds[i - 1])
            return temperatures[i - 1] + share * (temperatures[i] - temperatures[i - 1])
    return temperatures[n - 1]
