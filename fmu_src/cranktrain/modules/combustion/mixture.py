"""Mixture of a cylinder: air, burnt gas and, before a spark ignites it, fuel vapour.

Composition is given by the mass fractions of burnt gas, ``share``, and of fuel vapour, ``vapour``; the rest is air. The
burnt gas of compression ignition are stoichiometric products without dissociation (:mod:`.gas`). The burnt gas of spark
ignition has the equivalence ratio of its charge and is in chemical equilibrium, by the table of :mod:`.equilibrium`,
which is cubic in temperature and linear in equivalence ratio and in the logarithm of the density p/T.

While a charge burns behind a flame, it has two temperatures. Unburnt gas is compressed isentropically from the state at
the spark, burnt gas has the rest of the energy and all of the wall heat,

    m_u R_u T_u + m_b R_b T_b = p V,   m_u u_u(T_u) + m_b u_b(T_b, p) = U,   T_u = T_s (p/p_s)^(R/c_p)

with c_p at the geometric mean of T_s and T_u.
"""

import math

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.modules.combustion import equilibrium as of_table
from cranktrain.modules.combustion import slots as at
from cranktrain.modules.combustion.gas import (
    H_0,
    HIGHEST,
    LOWEST,
    MIDDLE,
    POWERS,
    R_GAS,
    RISE,
    VAPOUR_ROW,
    enthalpy_and_capacity,
    gas_constant,
)

CONVERGED = 1.0e-6
"""Relative change of a temperature after which Newton's next iterate differs by rounding only."""
CONVERGED_PRESSURE = 1.0e-9
"""Relative change of the pressure at which the search for the state of two zones ends."""
LEAST_BURNT, CLEAR_BURNT = 1.0e-12, 1.0e-6
"""Smallest burnt fraction, and that from which the composition of the burnt gas is the difference of all and unburnt.

Below some thousandths the burnt temperature has no meaning: it takes up what wall heat the unburnt gas has lost.
"""
_THIN = 1.0e3
"""Density p/T, Pa/K, for c_p of unburnt gas, whose residual gas is too cold to depend on it."""
_NEWTON, _NEWTON_OF_TWO = 30, 60
_RATIOS, _N_RATIOS = of_table.RATIOS, len(of_table.RATIOS)
_FIRST, _DENSITIES = of_table.FIRST_DENSITY, of_table.DENSITIES
_COLDEST, _STEP, _TEMPERATURES = of_table.FIRST_TEMPERATURE, of_table.TEMPERATURE_STEP, of_table.TEMPERATURES


@kernel
def equilibrium_shift(burnt, ratio, density, temperature):
    """Differences of burnt gas to stoichiometric products: h, J/kg, its slope, R, J/(kg K), and its slope.

    ``density`` is p/T, Pa/K. Outside the table the differences are those of its border.
    """
    k = 0
    while k < _N_RATIOS - 2 and ratio > _RATIOS[k + 1]:
        k += 1
    x = min(max((ratio - _RATIOS[k]) / (_RATIOS[k + 1] - _RATIOS[k]), 0.0), 1.0)
    y = min(max(math.log(density) - _FIRST, 0.0), _DENSITIES - 1.0)
    j = min(int(y), _DENSITIES - 2)
    y -= j
    place = (temperature - _COLDEST) / _STEP
    inside = 0.0 <= place <= _TEMPERATURES - 1.0
    place = min(max(place, 0.0), _TEMPERATURES - 1.0)
    i = min(int(place), _TEMPERATURES - 2)
    z = place - i
    h = c = r = s = 0.0
    for a in range(2):
        for b in range(2):
            weight = (x if a == 1 else 1.0 - x) * (y if b == 1 else 1.0 - y)
            low = ((k + a) * _DENSITIES + j + b) * _TEMPERATURES + i
            for column in (0, 2):
                v0, v1 = burnt[low, column], burnt[low + 1, column]
                d0, d1 = _STEP * burnt[low, column + 1], _STEP * burnt[low + 1, column + 1]
                bend, twist = 3.0 * (v1 - v0) - 2.0 * d0 - d1, 2.0 * (v0 - v1) + d0 + d1
                value = weight * (v0 + z * (d0 + z * (bend + z * twist)))
                slope = weight * (d0 + z * (2.0 * bend + 3.0 * z * twist)) / _STEP if inside else 0.0
                if column == 0:
                    h += value
                    c += slope
                else:
                    r += value
                    s += slope
    return h, c, r, s


@inlined_kernel
def mixture(model, share, vapour, ratio, density, temperature):
    """Enthalpy, J/kg, its slope c_p, gas constant, J/(kg K), and its slope, of a mixture at a temperature, K.

    ``ratio`` is the equivalence ratio of the burnt gas, ``density`` is p/T, Pa/K; both and the ``vapour`` count for
    spark ignition only.
    """
    h, c = enthalpy_and_capacity(model.gas, share, temperature)
    r, s = gas_constant(model.gas, share), 0.0
    if model.numbers[at.SPARKS] > 0.0:
        dh, dc, dr, ds = equilibrium_shift(model.burnt, ratio, density, temperature)
        vh, vc = vapour_shift(model.gas, temperature)
        h += share * dh + vapour * vh
        c += share * dc + vapour * vc
        r += share * dr + vapour * model.gas[VAPOUR_ROW, R_GAS]
        s = share * ds
    return h, c, r, s


@inlined_kernel
def vapour_shift(gas, temperature):
    """Enthalpy, J/kg, and c_p, J/(kg K), of fuel vapour less those of air."""
    t = min(max(temperature, LOWEST), HIGHEST)
    row = VAPOUR_ROW if t < MIDDLE else VAPOUR_ROW + 1
    rise = capacity = 0.0
    for i in range(POWERS - 1, -1, -1):
        capacity = capacity * t + gas[row, i]
        rise = rise * t + gas[row, RISE + i]
    return rise * t + gas[row, H_0] + capacity * (temperature - t), capacity


@inlined_kernel
def temperature_of(model, share, vapour, ratio, density, energy, guess):
    """Temperature, K, of a mixture with a given internal energy, J/kg, by Newton's method; −1 if there is none."""
    t = guess
    for _ in range(_NEWTON):
        h, c, r, s = mixture(model, share, vapour, ratio, density, t)
        change = (energy - (h - r * t)) / (c - r - t * s)
        if not abs(change) < 1.0e6:
            return -1.0
        t = max(t + change, 0.5 * t)
        if abs(change) <= CONVERGED * t:
            return t
    return -1.0


@kernel
def two_zones(model, state, base, values, space, x, guess):
    """Pressure, Pa, of a charge burnt to a fraction x in a volume (m³), and its mean temperature; −1 if there is none.

    ``values`` are the integrated quantities of the cylinder at ``base``, ``guess`` is a pressure near.
    """
    mass, ratio = values[at.MASS], state[base + at.RATIO]
    start_p, start_t = state[base + at.SPARK_PRESSURE], state[base + at.SPARK_TEMPERATURE]
    share_u, vapour_u = state[base + at.SPARK_PRODUCTS], state[base + at.SPARK_VAPOUR]
    burnt = mass * max(x, LEAST_BURNT)
    unburnt = mass - burnt
    share_b, vapour_b = 1.0, 0.0
    if x > CLEAR_BURNT:
        share_b = min(max((values[at.PRODUCTS] - unburnt * share_u) / burnt, 0.0), 1.0)
        vapour_b = min(max((values[at.VAPOUR] - unburnt * vapour_u) / burnt, 0.0), 1.0)
    p, t_b = guess, 2400.0
    for _ in range(_NEWTON_OF_TWO):
        logarithm = math.log(p / start_p)
        _, c_u, r_u, _ = mixture(model, share_u, vapour_u, ratio, _THIN, start_t)
        for _ in range(2):
            t_u = start_t * math.exp(r_u / c_u * logarithm)
            _, c_u, r_u, _ = mixture(model, share_u, vapour_u, ratio, _THIN, math.sqrt(start_t * t_u))
        t_u = start_t * math.exp(r_u / c_u * logarithm)
        h_u, c_u, r_u, _ = mixture(model, share_u, vapour_u, ratio, p / t_u, t_u)
        density = p / max(t_b, LOWEST)
        h_b, c_b, r_b, s_b = mixture(model, share_b, vapour_b, ratio, density, t_b)
        missing_volume = p * space - unburnt * r_u * t_u - burnt * r_b * t_b
        missing_energy = values[at.ENERGY] - unburnt * (h_u - r_u * t_u) - burnt * (h_b - r_b * t_b)
        rise = r_u / c_u * t_u / p
        # Newton's step of pressure and burnt m T, without the density's small influence on h_b and R_b.
        by_p, by_t = unburnt * r_u * rise - space, r_b + t_b * s_b
        energy_by_p, energy_by_t = unburnt * (c_u - r_u) * rise, c_b - r_b - t_b * s_b
        scale = by_p * energy_by_t - by_t * energy_by_p
        change = (missing_volume * energy_by_t - by_t * missing_energy) / scale
        warmer = (by_p * missing_energy - energy_by_p * missing_volume) / scale
        if not (abs(change) < 1.0e12 and abs(warmer) < 1.0e12):
            return -1.0, -1.0
        p = max(p + change, 0.5 * p)
        t_b += warmer / burnt
        if abs(change) <= CONVERGED_PRESSURE * p:
            return p, p * space / (unburnt * r_u + burnt * r_b)
    return -1.0, -1.0
