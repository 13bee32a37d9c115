"""Gas properties, wall heat, burn and valves of the combustion module beside published numbers."""

import numpy as np
import pytest

from cranktrain.modules.combustion.burn import ignition_rate, premixed_share
from cranktrain.modules.combustion.gas import (
    AIR,
    MOLAR_MASS,
    _rows,
    enthalpy,
    gas_constant,
    gas_table,
    heat_capacity,
    products,
    stoichiometric_air,
)
from cranktrain.modules.combustion.wall_heat import COMBUSTION_TERM, piston_term, woschni_coefficient

# M. W. Chase, NIST-JANAF Thermochemical Tables, 4th ed. (1998): H(T) − H(298.15 K), kJ/mol, at 1000 and 2000 K
JANAF = {"N2": (21.463, 56.137), "O2": (22.703, 59.175), "CO2": (33.397, 91.439), "H2O": (26.000, 72.790)}


@pytest.mark.parametrize("name", list(JANAF))
def test_enthalpies_of_the_janaf_tables(name):
    """Within 0.2 %; GRI-Mech's water is 0.34 % above the tables at 2000 K."""
    pure = _rows({name: 1.0})
    table = np.vstack([pure, pure])
    for temperature, published in zip((1000.0, 2000.0), JANAF[name], strict=True):
        molar = 1e-3 * enthalpy(table, 0.0, temperature) * MOLAR_MASS[name]
        assert molar == pytest.approx(published, rel=4e-3 if name == "H2O" else 2e-3)


def test_air_is_air():
    """R 287.05 J/(kg K); c_p 1.005 and 1.141 kJ/(kg K) at 300 and 1000 K (Incropera, table A.4); 28.965 g/mol."""
    gas = gas_table(1.86)
    assert gas_constant(gas, 0.0) == pytest.approx(287.05, rel=3e-4)
    assert heat_capacity(gas, 0.0, 300.0) == pytest.approx(1007.0, rel=4e-3)
    assert heat_capacity(gas, 0.0, 1000.0) == pytest.approx(1141.0, rel=4e-3)
    assert sum(share * MOLAR_MASS[name] for name, share in AIR.items()) == pytest.approx(28.965e-3, rel=1e-3)


def test_stoichiometric_combustion_of_known_fuels():
    """Heywood (1988), appendix D: 14.6 kg of air for a kilogram of gasoline CH1.87, 14.5 of light diesel CH1.8."""
    assert stoichiometric_air(1.87) == pytest.approx(14.6, rel=5e-3)
    assert stoichiometric_air(1.8) == pytest.approx(14.5, rel=5e-3)
    shares = products(2.0)
    assert shares["CO2"] == pytest.approx(shares["H2O"])  # CH2 + 1.5 O2 → CO2 + H2O
    # elements are kept: nitrogen with the oxygen that came with it, all of which is bound
    assert shares["N2"] / AIR["N2"] * AIR["O2"] == pytest.approx(shares["CO2"] + 0.5 * shares["H2O"])


def test_woschnis_coefficient():
    """By hand: 130 · 0.1^−0.2 · 100^0.8 · 1500^−0.53 · 30^0.8, and within a fifth of the form that Heywood prints."""
    p, t, bore, w = 100e5, 1500.0, 0.1, 30.0
    by_hand = 130.0 * 1.584893 * 39.81072 * 0.0207362 * 15.19397
    assert woschni_coefficient(p, t, bore, w) == pytest.approx(by_hand, rel=1e-4)
    heywood = 3.26 * bore**-0.2 * (1e-3 * p) ** 0.8 * t**-0.55 * w**0.8
    assert woschni_coefficient(p, t, bore, w) == pytest.approx(heywood, rel=0.2)
    assert piston_term(True, 0.0) == 6.18 and piston_term(False, 0.0) == 2.28 and COMBUSTION_TERM == 3.24e-3
    assert piston_term(True, 1.0) == pytest.approx(6.597) and piston_term(False, 1.0) == pytest.approx(2.588)


def test_ignition_delay_of_assanis_and_premixed_share_of_watson():
    """τ = 2.4 φ^−0.2 p^−1.02 exp(2100/T) ms; β = 1 − 0.926 φ^0.37/τ^0.26, none without a delay."""
    delay = 1.0 / ignition_rate(50e5, 900.0, 0.5, 2.4e-3, 1.02, 2100.0, 0.2)
    assert delay == pytest.approx(1e-3 * 2.4 * 1.148698 * 0.0184951 * 10.3123, rel=1e-4)
    assert premixed_share(0.5, 1e-3, 0.926, 0.37, 0.26) == pytest.approx(1.0 - 0.926 * 0.773783, rel=1e-5)
    assert premixed_share(0.5, 1e-6, 0.926, 0.37, 0.26) == 0.0
