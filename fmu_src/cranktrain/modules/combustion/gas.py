"""Properties of cylinder gas: an ideal mixture of air and stoichiometric combustion products, over temperature.

Lean products of a fuel CH_y are the mixture, by mass, of stoichiometric products (fraction y) and air (1 − y):

    CH_y + (1 + y/4) (O2 + a N2 + b Ar)  →  CO2 + y/2 H2O + (1 + y/4) (a N2 + b Ar)

Heat capacities are NASA polynomials of four powers in two ranges that meet at 1000 K; enthalpies are sensible, 0 at
298.15 K, and continuous at 1000 K. The heat of reaction is the fuel's lower heating value at 298.15 K, so the energy of
formation is right for products at any temperature. There is no dissociation. Outside 200 to 3500 K the heat capacity is
constant.

Sources: G. P. Smith et al., GRI-Mech 3.0, thermodynamic data; B. J. McBride et al., NASA TM-4513 (1993).
"""

import numpy as np

from cranktrain.core.kernel import inlined_kernel
from cranktrain.core.types import Array

UNIVERSAL = 8.31446
"""Universal gas constant, J/(mol K)."""
REFERENCE, MIDDLE, LOWEST, HIGHEST = 298.15, 1000.0, 200.0, 3500.0
"""Temperatures, K: zero of the sensible enthalpy, border of the two ranges, ends of the polynomials."""
AIR = {"N2": 0.7808, "O2": 0.2095, "Ar": 0.0097}
"""Mole fractions of dry air; carbon dioxide counts as argon."""
MOLAR_MASS = {"N2": 28.0134e-3, "O2": 31.9988e-3, "Ar": 39.948e-3, "CO2": 44.0095e-3, "H2O": 18.0153e-3,
              "C8H18": 114.2285e-3}  # fmt: skip
"""Molar masses, kg/mol."""
CARBON, HYDROGEN = 12.0107e-3, 1.00794e-3
POLYNOMIALS = {
    "N2": (
        (3.298677e00, 1.4082404e-03, -3.963222e-06, 5.641515e-09, -2.444854e-12),
        (2.926640e00, 1.4879768e-03, -5.684760e-07, 1.0097038e-10, -6.753351e-15),
    ),
    "O2": (
        (3.78245636e00, -2.99673416e-03, 9.84730201e-06, -9.68129509e-09, 3.24372837e-12),
        (3.28253784e00, 1.48308754e-03, -7.57966669e-07, 2.09470555e-10, -2.16717794e-14),
    ),
    "CO2": (
        (2.35677352e00, 8.98459677e-03, -7.12356269e-06, 2.45919022e-09, -1.43699548e-13),
        (3.85746029e00, 4.41437026e-03, -2.21481404e-06, 5.23490188e-10, -4.72084164e-14),
    ),
    "H2O": (
        (4.19864056e00, -2.03643410e-03, 6.52040211e-06, -5.48797062e-09, 1.77197817e-12),
        (3.03399249e00, 2.17691804e-03, -1.64072518e-07, -9.70419870e-11, 1.68200992e-14),
    ),
    "Ar": ((2.5, 0.0, 0.0, 0.0, 0.0), (2.5, 0.0, 0.0, 0.0, 0.0)),
    "CO": (
        (3.57953347e00, -6.10353680e-04, 1.01681433e-06, 9.07005884e-10, -9.04424499e-13),
        (2.71518561e00, 2.06252743e-03, -9.98825771e-07, 2.30053008e-10, -2.03647716e-14),
    ),
    "H2": (
        (2.34433112e00, 7.98052075e-03, -1.94781510e-05, 2.01572094e-08, -7.37611761e-12),
        (3.33727920e00, -4.94024731e-05, 4.99456778e-07, -1.79566394e-10, 2.00255376e-14),
    ),
    "OH": (
        (3.99201543e00, -2.40131752e-03, 4.61793841e-06, -3.88113333e-09, 1.36411470e-12),
        (3.09288767e00, 5.48429716e-04, 1.26505228e-07, -8.79461556e-11, 1.17412376e-14),
    ),
    "H": ((2.5, 0.0, 0.0, 0.0, 0.0), (2.5, 0.0, 0.0, 0.0, 0.0)),
    "O": (
        (3.16826710e00, -3.27931884e-03, 6.64306396e-06, -6.12806624e-09, 2.11265971e-12),
        (2.56942078e00, -8.59741137e-05, 4.19484589e-08, -1.00177799e-11, 1.22833691e-15),
    ),
    "NO": (
        (4.21847630e00, -4.63897600e-03, 1.10410220e-05, -9.33613540e-09, 2.80357700e-12),
        (3.26060560e00, 1.19110430e-03, -4.29170480e-07, 6.94576690e-11, -4.03360990e-15),
    ),
    "C8H18": (
        (8.15737338e-01, 7.32643959e-02, 1.78300688e-05, -6.93589620e-08, 3.21629382e-11),
        (1.59899273e01, 5.53184790e-02, -1.95267072e-05, 3.11779172e-09, -1.85312577e-13),
    ),
}
"""Coefficients of c_p/R by powers of T, below and above 1000 K."""

POWERS = 5
RISE = 5
H_0 = 10
R_GAS = 11
COLUMNS = 12
"""Columns of a gas in :func:`gas_table`: coefficients of c_p and of ∫ c_p dT, integration constant, gas constant."""
AIR_ROW, PRODUCTS_ROW = 0, 2
"""First of the two rows of air and of products in a gas table: below 1000 K, then above 1000 K."""
VAPOUR_ROW = 4
"""First of the two rows of fuel vapour less air, which the table of a spark-ignition engine has."""


def stoichiometric_air(hydrogen_per_carbon: float) -> float:
    """Mass of air that burns one mass unit of the fuel CH_y completely."""
    air = sum(share * MOLAR_MASS[name] for name, share in AIR.items()) / AIR["O2"]
    return (1.0 + 0.25 * hydrogen_per_carbon) * air / (CARBON + hydrogen_per_carbon * HYDROGEN)


def products(hydrogen_per_carbon: float) -> dict[str, float]:
    """Mole fractions of the products of stoichiometric combustion of CH_y in air."""
    oxygen = 1.0 + 0.25 * hydrogen_per_carbon
    amounts = {"CO2": 1.0, "H2O": 0.5 * hydrogen_per_carbon}
    amounts |= {name: oxygen * AIR[name] / AIR["O2"] for name in ("N2", "Ar")}
    return {name: amount / sum(amounts.values()) for name, amount in amounts.items()}


def gas_table(hydrogen_per_carbon: float) -> Array:
    """Table (4, COLUMNS) of air and stoichiometric products for the kernels, in J, kg and K."""
    return np.vstack([_rows(AIR), _rows(products(hydrogen_per_carbon))])


def mixture_table(hydrogen_per_carbon: float) -> Array:
    """Table (6, COLUMNS) of air, stoichiometric products, and fuel vapour less air.

    The vapour has the properties of iso-octane by mass, whatever the fuel's hydrogen.
    """
    return np.vstack([gas_table(hydrogen_per_carbon), _rows({"C8H18": 1.0}) - _rows(AIR)])


def _rows(shares: dict[str, float]) -> Array:
    """Two rows of a gas table for a mixture, whose enthalpy is 0 at 298.15 K and continuous at 1000 K."""
    mass = sum(share * MOLAR_MASS[name] for name, share in shares.items())
    rows = np.zeros((2, COLUMNS))
    for k in range(2):
        rows[k, :POWERS] = sum(share * np.array(POLYNOMIALS[name][k]) for name, share in shares.items())
    rows *= UNIVERSAL / mass
    rows[:, RISE : RISE + POWERS] = rows[:, :POWERS] / np.arange(1, POWERS + 1)
    rows[:, R_GAS] = UNIVERSAL / mass

    def rise(k: int, temperature: float) -> float:
        return float(sum(rows[k, RISE + i] * temperature ** (i + 1) for i in range(POWERS)))

    rows[0, H_0] = -rise(0, REFERENCE)
    rows[1, H_0] = rise(0, MIDDLE) + rows[0, H_0] - rise(1, MIDDLE)
    return rows


@inlined_kernel
def gas_constant(gas, share):
    """Gas constant of a mixture with the mass fraction ``share`` of products, J/(kg K)."""
    return gas[AIR_ROW, R_GAS] + share * (gas[PRODUCTS_ROW, R_GAS] - gas[AIR_ROW, R_GAS])


@inlined_kernel
def enthalpy_and_capacity(gas, share, temperature):
    """Sensible enthalpy, J/kg, and c_p, J/(kg K), of a mixture at a temperature."""
    t = min(max(temperature, LOWEST), HIGHEST)
    k = 0 if t < MIDDLE else 1
    air, product = AIR_ROW + k, PRODUCTS_ROW + k
    rise = capacity = 0.0
    for i in range(POWERS - 1, -1, -1):
        capacity = capacity * t + gas[air, i] + share * (gas[product, i] - gas[air, i])
        rise = rise * t + gas[air, RISE + i] + share * (gas[product, RISE + i] - gas[air, RISE + i])
    constant = gas[air, H_0] + share * (gas[product, H_0] - gas[air, H_0])
    return rise * t + constant + capacity * (temperature - t), capacity


@inlined_kernel
def heat_capacity(gas, share, temperature):
    """Heat capacity c_p of a mixture at a temperature, J/(kg K)."""
    return enthalpy_and_capacity(gas, share, temperature)[1]


@inlined_kernel
def enthalpy(gas, share, temperature):
    """Sensible enthalpy of a mixture, J/kg."""
    return enthalpy_and_capacity(gas, share, temperature)[0]


@inlined_kernel
def internal_energy(gas, share, temperature):
    """Sensible internal energy h − R T of a mixture, J/kg."""
    return enthalpy(gas, share, temperature) - gas_constant(gas, share) * temperature
