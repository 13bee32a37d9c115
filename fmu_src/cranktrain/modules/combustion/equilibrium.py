"""Burnt gas of a spark-ignition engine in chemical equilibrium, as a table for the kernels.

The gas burnt at an equivalence ratio φ consists of CO2, CO, H2O, H2, O2, N2, OH, H, O, NO and Ar. Their mole fractions
x_j minimise the Gibbs energy at a temperature and pressure,

    x_j = exp(Σ_i a_ij π_i − μ_j°/(R T)) p₀/p,   Σ_j a_ij x_j = ν b_i,   Σ_j x_j = 1,

with element potentials π_i, atoms a_ij of a species, amounts b_i of elements in a mass unit and ν, the inverse of its
amount of substance. Newton's method solves the logarithms of these equations, from hot to cold. Below ``FROZEN`` the
composition stays what it was there. Enthalpies count from complete products at 298.15 K, so the heat of all fuel is its
heating value, and carbon monoxide, hydrogen and radicals take up their part of it again. A rich gas therefore needs no
rule of its own.

The table holds differences to the gas of stoichiometric products without dissociation (:mod:`.gas`).

Sources: S. Gordon, B. J. McBride, NASA RP-1311 (1994), method of element potentials in another form; J. B. Heywood,
Internal Combustion Engine Fundamentals (1988), section 4.6 and 4.9.3 (frozen below about 1700 K).
"""

from functools import cache

import numpy as np

from cranktrain.core.types import Array
from cranktrain.modules.combustion.gas import (
    AIR,
    CARBON,
    H_0,
    HYDROGEN,
    MIDDLE,
    MOLAR_MASS,
    POLYNOMIALS,
    POWERS,
    PRODUCTS_ROW,
    R_GAS,
    REFERENCE,
    RISE,
    UNIVERSAL,
    gas_table,
)

ELEMENTS = {
    "CO2": (1, 0, 2, 0), "CO": (1, 0, 1, 0), "H2O": (0, 2, 1, 0), "H2": (0, 2, 0, 0), "O2": (0, 0, 2, 0),
    "N2": (0, 0, 0, 2), "OH": (0, 1, 1, 0), "H": (0, 1, 0, 0), "O": (0, 0, 1, 0), "NO": (0, 0, 1, 1),
    "Ar": (0, 0, 0, 0),
}  # fmt: skip
"""Atoms of carbon, hydrogen, oxygen and nitrogen in each species; argon takes no part."""
SPECIES = tuple(ELEMENTS)
FORMATION = {
    "CO2": ((-48371.9697, 9.90105222), (-48759.166, 2.27163806)),
    "CO": ((-14344.086, 3.50840928), (-14151.8724, 7.81868772)),
    "H2O": ((-30293.7267, -0.849032208), (-30004.2971, 4.9667701)),
    "H2": ((-917.935173, 0.683010238), (-950.158922, -3.20502331)),
    "O2": ((-1063.94356, 3.65767573), (-1088.45772, 5.45323129)),
    "N2": ((-1020.8999, 3.950372), (-922.7977, 5.980528)),
    "OH": ((3615.08056, -0.103925458), (3858.657, 4.4766961)),
    "H": ((25473.6599, -0.446682853), (25473.6599, -0.446682914)),
    "O": ((29122.2592, 2.05193346), (29217.5791, 4.78433864)),
    "NO": ((9844.623, 2.2808464), (9920.9746, 6.3693027)),
    "Ar": ((-745.375, 4.366), (-745.375, 4.366)),
}
"""Integration constants of h/R (K) and s/R, below and above 1000 K, with the enthalpies of formation."""
RATIOS = (0.3, 0.5, 0.65, 0.75, 0.83, 0.9, 0.95, 1.0, 1.05, 1.1, 1.17, 1.25, 1.4, 1.6, 1.8)
"""Equivalence ratios of the table."""
FIRST_DENSITY, DENSITIES = 3.5, 7
"""First logarithm of p/T (Pa/K), and number of densities, a factor e apart: 0.3 to 200 bar at 2000 K."""
FIRST_TEMPERATURE, TEMPERATURE_STEP, TEMPERATURES = 300.0, 100.0, 33
"""Temperatures of the table, K."""
FROZEN = 1600.0
"""Temperature below which the composition does not change any more, K."""
SHIFTS = 4
"""Columns of the table: differences of h (J/kg), its slope, R (J/(kg K)), and its slope, over the temperature."""
STANDARD = 101325.0
"""Pressure of the data of entropies, Pa."""
FIRST_GUESS = 0.08, 0.05, 0.1, 0.02, 0.01, 0.7
"""Mole fractions of the first species, from which the hottest state is sought."""
_PASSES, _LONGEST, _APART = 200, 3.0, 1.0


@cache
def burnt_table(hydrogen_per_carbon: float) -> Array:
    """Table (ratios · densities · temperatures, SHIFTS) of burnt gas of CH_y less stoichiometric products."""
    elements, mass = burnt_elements(hydrogen_per_carbon)
    densities = np.exp(FIRST_DENSITY + np.arange(DENSITIES))
    of_complete = _enthalpies(REFERENCE)
    complete = elements[:, 0] * of_complete[SPECIES.index("CO2")]
    complete += 0.5 * elements[:, 1] * of_complete[SPECIES.index("H2O")]
    gas = gas_table(hydrogen_per_carbon)
    table = np.zeros((len(RATIOS), DENSITIES, TEMPERATURES, SHIFTS))
    potentials = None
    for k in range(TEMPERATURES - 1, -1, -1):
        middle = FIRST_TEMPERATURE + TEMPERATURE_STEP * k
        ends = []
        for temperature in (middle, middle - _APART, middle + _APART):
            if temperature > FROZEN or potentials is None or middle == FROZEN:
                hot = max(temperature, FROZEN)
                fractions, moles, potentials = composition(elements, hot, densities * hot, potentials)
            total = moles * np.sum(fractions * _enthalpies(temperature), axis=-1) - complete[:, None]
            row = gas[PRODUCTS_ROW + (temperature >= MIDDLE)]
            own = row[H_0] + sum(row[RISE + i] * temperature ** (i + 1) for i in range(POWERS))
            ends.append((total / mass[:, None] - own, UNIVERSAL * moles / mass[:, None] - row[R_GAS]))
        (h, r), (h0, r0), (h1, r1) = ends
        for column, values in enumerate((h, (h1 - h0) / (2.0 * _APART), r, (r1 - r0) / (2.0 * _APART))):
            table[:, :, k, column] = values
    return table.reshape(-1, SHIFTS)


def burnt_elements(hydrogen_per_carbon: float) -> tuple[Array, Array]:
    """Moles of C, H, O, N and Ar, (ratios, 5), of 1 mol air and its fuel CH_y at each ratio, and their mass, kg."""
    ratios = np.array(RATIOS)
    carbon = ratios * AIR["O2"] / (1.0 + 0.25 * hydrogen_per_carbon)
    ones = np.ones_like(ratios)
    rows = (carbon, hydrogen_per_carbon * carbon, 2.0 * AIR["O2"] * ones, 2.0 * AIR["N2"] * ones, AIR["Ar"] * ones)
    air = sum(share * MOLAR_MASS[name] for name, share in AIR.items())
    return np.stack(rows, axis=1), air + carbon * (CARBON + hydrogen_per_carbon * HYDROGEN)


def composition(
    elements: Array, temperature: float, pressures: Array, start: Array | None = None
) -> tuple[Array, Array, Array]:
    """Mole fractions (ratios, pressures, species), moles of gas (ratios, pressures), and element potentials.

    ``elements`` are moles of C, H, O, N and Ar, (ratios, 5); ``start`` are potentials at a neighbouring temperature,
    (ratios, pressures, 5), with the logarithm of ν last.
    """
    atoms = np.array([ELEMENTS[name] for name in SPECIES[:-1]], dtype=float)  # without argon
    gibbs = _gibbs(temperature)[:-1] + np.log(pressures / STANDARD)[:, None]
    b = elements[:, None, :]
    if start is None:
        guess = np.log(FIRST_GUESS) + gibbs[:, : len(FIRST_GUESS)]
        solved = np.linalg.lstsq(atoms[: len(FIRST_GUESS)], guess.T, rcond=None)[0].T
        inverse = np.broadcast_to(-np.log(0.5 * b.sum(axis=-1, keepdims=True)), (*b.shape[:1], pressures.size, 1))
        start = np.concatenate([np.broadcast_to(solved, (*inverse.shape[:2], 4)), inverse], axis=-1)
    x = start.copy()
    for _ in range(_PASSES):
        fractions = np.exp(np.clip(x[..., :4] @ atoms.T - gibbs, -200.0, 50.0))
        amounts = fractions @ atoms
        inert = np.exp(x[..., 4]) * b[..., 4]
        total = fractions.sum(axis=-1) + inert
        wrong = np.concatenate([np.log(amounts / b[..., :4]) - x[..., 4:], np.log(total)[..., None]], axis=-1)
        jacobian = np.zeros((*x.shape, 5))
        jacobian[..., :4, :4] = (fractions[..., None, :] * atoms.T) @ atoms / amounts[..., None]
        jacobian[..., :4, 4] = -1.0
        jacobian[..., 4, :4] = amounts / total[..., None]
        jacobian[..., 4, 4] = inert / total
        step = -np.linalg.solve(jacobian, wrong[..., None])[..., 0]
        largest = np.abs(step).max(axis=-1, keepdims=True)
        x += step * np.minimum(1.0, _LONGEST / np.maximum(largest, 1e-300))
        if largest.max() < 1e-9:  # the next step would be rounding only
            break
    return np.concatenate([fractions, inert[..., None]], axis=-1), np.exp(-x[..., 4]), x


def _enthalpies(temperature: float) -> Array:
    """Molar enthalpies with those of formation, J/mol, (species,)."""
    return np.array([_by_name(name, temperature)[0] for name in SPECIES])


def _gibbs(temperature: float) -> Array:
    """μ°/(R T) of each species at 1 atm."""
    return np.array([h / (UNIVERSAL * temperature) - s for h, s in (_by_name(name, temperature) for name in SPECIES)])


def _by_name(name: str, temperature: float) -> tuple[float, float]:
    """Molar enthalpy, J/mol, and entropy over R at 1 atm, of a species."""
    k, t = 0 if temperature < MIDDLE else 1, temperature
    a, (a6, a7) = POLYNOMIALS[name][k], FORMATION[name][k]
    h = a6 + sum(a[i] * t ** (i + 1) / (i + 1) for i in range(POWERS))
    s = a7 + a[0] * np.log(t) + sum(a[i] * t**i / i for i in range(1, POWERS))
    return UNIVERSAL * h, float(s)
