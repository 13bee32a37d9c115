"""Reference cycles of a spark-ignition engine with Cantera's equilibrium properties: tests/data/spark_reference.json.

    python -m benchmarks.spark_reference tests/data/spark_reference.json    # in an environment with cantera and scipy

A closed cylinder without wall heat is compressed, burnt by one Wiebe function, and expanded. Unburnt gas is iso-octane,
air and residual gas of constant composition; burnt gas is in chemical equilibrium at the pressure of the cylinder. Two
models of the same cycle: one temperature for all gas, and two zones, whose unburnt gas is compressed isentropically.
Steps are 0.25 degrees with the trapezoidal rule of the work.

Thermodynamic data: GRI-Mech 3.0, and iso-octane of NASA's collection, as Cantera distributes both.
"""

import argparse
import json
import math
from pathlib import Path

from scipy.optimize import brentq

BORE, STROKE, ROD, RATIO = 0.086, 0.086, 0.145, 10.5
CLOSES, OPENS, STEP = -140.0, 140.0, 0.25
SPARK, DURATION, EXPONENT, WIEBE = -20.0, 55.0, 2.0, 6.908
LEAST = 5e-4
"""Burnt fraction below which nothing counts as burnt: a smaller zone would have no reliable temperature."""
AIR = "O2:0.2095, N2:0.7808, AR:0.0097"
BURNT = ("CO2", "CO", "H2O", "H2", "O2", "N2", "OH", "H", "O", "NO", "AR")
CASES = {
    "full load": {"air_ratio": 1.0, "pressure": 1.1e5, "temperature": 360.0, "residual": 0.04},
    "charged": {"air_ratio": 1.0, "pressure": 1.9e5, "temperature": 370.0, "residual": 0.03},
    "rich": {"air_ratio": 0.88, "pressure": 1.1e5, "temperature": 360.0, "residual": 0.04},
    "very rich": {"air_ratio": 0.75, "pressure": 1.1e5, "temperature": 360.0, "residual": 0.04},
    "lean": {"air_ratio": 1.25, "pressure": 1.1e5, "temperature": 360.0, "residual": 0.04},
    "part load": {"air_ratio": 1.0, "pressure": 0.45e5, "temperature": 390.0, "residual": 0.14},
    "motored": {"air_ratio": 1.0, "pressure": 1.1e5, "temperature": 360.0, "residual": 0.04, "burns": 0.0},
}


def gases():
    """Cantera phases of unburnt and of burnt gas."""
    import cantera as ct

    species = {one.name: one for one in ct.Species.list_from_file("gri30.yaml") if one.name in BURNT}
    fuel = next(one for one in ct.Species.list_from_file("nasa_gas.yaml") if one.name == "C8H18,isooctane")
    burnt = [species[name] for name in BURNT]
    made = [ct.Solution(thermo="ideal-gas", species=list(rows), reactions=[]) for rows in ([*burnt, fuel], burnt)]
    return made[0], made[1]


def volume(angle):
    """Volume, m³, at an angle after dead centre, deg."""
    phi, r = math.radians(angle), 0.5 * STROKE
    area = 0.25 * math.pi * BORE**2
    return area * (STROKE / (RATIO - 1.0) + r + ROD - r * math.cos(phi) - math.sqrt(ROD**2 - (r * math.sin(phi)) ** 2))


def burnt_fraction(angle):
    """Wiebe function of the unburnt charge, scaled to reach 1."""
    x = min(max((angle - SPARK) / DURATION, 0.0), 1.0)
    return -math.expm1(-WIEBE * x ** (EXPONENT + 1.0)) / -math.expm1(-WIEBE)


def set_up(case):
    """Phases of unburnt and burnt gas at the closing of the intake, and the mass of the charge, kg."""
    mixed, burnt = gases()
    mixed.set_equivalence_ratio(1.0 / case["air_ratio"], "C8H18,isooctane:1", AIR)
    elements = {name: mixed.elemental_mole_fraction(name) for name in ("C", "H", "O", "N", "Ar")}
    fresh = dict(zip(mixed.species_names, mixed.Y, strict=True))
    # The burnt gas has the elements of the fresh charge; any start of the right elements leads to the equilibrium.
    carbon, hydrogen, oxygen = elements["C"], elements["H"], elements["O"]
    start = {"CO2": 0.0, "CO": carbon, "H2": 0.5 * hydrogen, "O2": 0.5 * (oxygen - carbon), "N2": 0.5 * elements["N"],
             "AR": elements["Ar"]}  # fmt: skip
    burnt.TPX = 1600.0, 5e5, start
    burnt.equilibrate("TP")
    residual = dict(zip(burnt.species_names, burnt.Y, strict=True))
    share = case["residual"]
    charge = {name: (1.0 - share) * fresh[name] + share * residual.get(name, 0.0) for name in fresh}
    mixed.TPY = case["temperature"], case["pressure"], charge
    return mixed, burnt, mixed.density * volume(CLOSES)


def one_zone(case):
    """Pressures, Pa, at whole degrees, with one temperature of all gas."""
    return _cycle(case, _of_one)


def two_zones(case):
    """Pressures, Pa, at whole degrees, with an isentropic unburnt zone."""
    return _cycle(case, _of_two)


def _of_one(unburnt, burnt, mass, x, space, energy, entropy, guess):
    """Pressure of gas at one temperature, burnt to a fraction x, from volume, energy (J) and a guessed pressure."""

    def state(temperature):
        pressure = guess
        for _ in range(3):  # the gas constant of the burnt gas depends little on pressure
            unburnt.TP, burnt.TP = (temperature, pressure), (temperature, pressure)
            if temperature > 1600.0 and x > 0.0:
                burnt.equilibrate("TP")
            pressure = mass * temperature * 8314.46 * ((1.0 - x) / unburnt.mean_molecular_weight
                                                       + x / burnt.mean_molecular_weight) / space  # fmt: skip
        return pressure, mass * ((1.0 - x) * unburnt.int_energy_mass + x * burnt.int_energy_mass)

    # The root lies near the last temperature; the interval is widened until it is enclosed.
    low, high = 0.97 * unburnt.T, 1.03 * unburnt.T
    while state(low)[1] > energy:
        low *= 0.97
    while state(high)[1] < energy:
        high *= 1.03
    found = brentq(lambda t: state(t)[1] - energy, low, high, xtol=1e-4)
    return state(found)[0]


def _of_two(unburnt, burnt, mass, x, space, energy, entropy, guess):
    """Pressure of two zones, whose unburnt gas has an entropy, from volume, energy (J) and a guessed pressure."""

    def wrong(pressure):
        unburnt.SP = entropy, pressure
        if x <= 0.0:
            return mass * unburnt.int_energy_mass - energy
        # H = U + pV is the sum over both zones, so the volume is the equation that is left.
        burnt.HP = (energy + pressure * space - mass * (1.0 - x) * unburnt.enthalpy_mass) / (mass * x), pressure
        if burnt.T > 1600.0:
            burnt.equilibrate("HP")
        return space - mass * ((1.0 - x) * unburnt.volume_mass + x * burnt.volume_mass)

    low, high = 0.98 * guess, 1.02 * guess
    while wrong(low) > 0.0:
        low *= 0.98
    while wrong(high) < 0.0:
        high *= 1.02
    return brentq(wrong, low, high, rtol=1e-8)


def _cycle(case, pressure_of):
    unburnt, burnt, mass = set_up(case)
    energy, entropy, pressure = mass * unburnt.int_energy_mass, unburnt.entropy_mass, case["pressure"]
    found, space = [pressure], volume(CLOSES)
    for k in range(1, round((OPENS - CLOSES) / STEP) + 1):
        angle = CLOSES + k * STEP
        x = case.get("burns", 1.0) * burnt_fraction(angle)
        x = x if x > LEAST else 0.0
        new, guess = volume(angle), pressure * (space / volume(angle)) ** 1.3
        for _ in range(4):
            left = energy - 0.5 * (pressure + guess) * (new - space)
            guess = pressure_of(unburnt, burnt, mass, x, new, left, entropy, guess)
        energy -= 0.5 * (pressure + guess) * (new - space)
        pressure, space = guess, new
        if k % round(1.0 / STEP) == 0:
            found.append(pressure)
    return found


def main():
    """Write all cases."""
    parser = argparse.ArgumentParser(prog="benchmarks.spark_reference", description=__doc__)
    parser.add_argument("file", help="where to write the cycles")
    chosen = parser.parse_args()
    found = {
        "bore": BORE, "stroke": STROKE, "rod": ROD, "compression_ratio": RATIO, "closes_deg": CLOSES,
        "opens_deg": OPENS,
        "spark_deg": SPARK, "duration_deg": DURATION, "exponent": EXPONENT, "cases": {},
    }  # fmt: skip
    for name, case in CASES.items():
        one, two = one_zone(case), two_zones(case)
        apart = max(abs(a - b) for a, b in zip(one, two, strict=True)) / max(two)
        print(f"{name}: peak {1e-6 * max(two):.4g} MPa; one temperature differs by {100.0 * apart:.2g} % of it")
        pressures = [float(f"{value:.6g}") for value in two]
        found["cases"][name] = {**case, "mass": set_up(case)[2], "pressures": pressures}
    Path(chosen.file).write_text(json.dumps(found) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
