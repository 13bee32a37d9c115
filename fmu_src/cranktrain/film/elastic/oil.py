"""Pressure dependence of the oil in elastic films: viscosity by Barus or Roelands, density by Dowson and Higginson.

With f = η/η₀, r = ρ/ρ₀ and the reduced pressure q = ∫₀ᵖ r/f dp, the pressure-driven flow equals that of an oil of
constant properties at the pressure q, and the content of a full gap is r instead of 1. q is tabulated over p, one table
per bearing, because Roelands' law depends on the viscosity at ambient pressure. Between the points q is a cubic with
the exact slopes r/f. Beyond ``HIGHEST`` the viscosity is constant, because the laws are not supported by measurements.
"""

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.core.reduced_body import Array
from cranktrain.engine.lubricant import CONSTANT, density_factor, pressure_constants, pressure_factor
from cranktrain.engine.parts import Oil
from cranktrain.film.elastic.grid import OilTables

HIGHEST = 1.0e9
"""Pressure (Pa) above which the viscosity is constant."""
INTERVALS = 256
GAUSS = tuple((float(point), float(weight)) for point, weight in zip(*np.polynomial.legendre.leggauss(6), strict=True))
"""Points and weights of Gauss' rule that integrates the reduced pressure q over a table interval."""

# Columns of an oil table: reduced pressure q (Pa) and its slope r/f.
Q, SLOPE = 0, 1


def oil_tables(oil: Oil, viscosities: Array) -> OilTables | None:
    """Make tables for films with ``viscosities`` (b,), Pa s, at ambient pressure; None for a constant oil.

    Raises the ``InputError`` of :func:`cranktrain.engine.lubricant.pressure_constants`.
    """
    compressible = oil.compressibility != "none"
    laws = [pressure_constants(oil, float(eta)) for eta in viscosities]
    if laws[0][0] == CONSTANT and not compressible:
        return None
    values = np.zeros((len(laws), INTERVALS + 1, 2))
    for table, law in zip(values, laws, strict=True):
        fill_oil_table(*law, compressible, table)
    return OilTables(HIGHEST / INTERVALS, values, compressible)


@kernel
def fill_oil_table(law, first, second, compressible, table):
    """Fill the ``table`` (n, 2) of an oil from constants of :func:`cranktrain.engine.lubricant.pressure_constants`."""
    step = HIGHEST / INTERVALS
    half = 0.5 * step
    reduced = 0.0
    for i in range(table.shape[0]):
        table[i, Q] = reduced
        table[i, SLOPE] = mobility(law, first, second, compressible, i * step)
        part = 0.0
        for k in range(len(GAUSS)):
            point, weight = GAUSS[k]
            part += weight * mobility(law, first, second, compressible, i * step + half * (1.0 + point))
        reduced += half * part


@kernel
def mobility(law, first, second, compressible, pressure):
    """Return the mobility r/f of an oil at a pressure (Pa): relative density over relative viscosity."""
    density = density_factor(pressure)[0] if compressible else 1.0
    return density / pressure_factor(law, pressure, first, second)[0]


@kernel
def reduced_pressure(table, step, pressure):
    """Return reduced pressure q (Pa), its slope r/f and the slope of r/f (1/Pa) at ``pressure`` (Pa) from ``table``."""
    last = table.shape[0] - 1
    place = pressure / step
    if place >= last:
        return table[last, Q] + table[last, SLOPE] * (pressure - last * step), table[last, SLOPE], 0.0
    i = int(place)
    t = place - i
    rise = table[i + 1, Q] - table[i, Q]
    a = step * table[i, SLOPE] - rise
    b = rise - step * table[i + 1, SLOPE]
    bend = a + t * (b - a)
    q = table[i, Q] + t * rise + t * (1.0 - t) * bend
    slope = rise + (1.0 - 2.0 * t) * bend + t * (1.0 - t) * (b - a)
    curve = 2.0 * (1.0 - 2.0 * t) * (b - a) - 2.0 * bend
    return q, slope / step, curve / (step * step)
