"""Full load of the shipped combustion modules beside what turbocharged, aftercooled truck diesels have.

Ranges, not values, at 2000 rev/min:

* air over what the fuel needs 1.5 to 1.9: smoke sets the lower end, what a turbocharger of one stage delivers the upper
  one (K. Mollenhauer, H. Tschöke, Handbook of Diesel Engines, 2010; Heywood 1988: equivalence ratio at most 0.7);
* peak over compression pressure 1.3 to 1.6 (Mollenhauer and Tschöke; R. Pischinger, M. Klell, T. Sams, Thermodynamik
  der Verbrennungskraftmaschine): less burns too late, more is beyond what cylinder heads bear at such boost;
* brake specific fuel consumption 200 to 215 g/kWh (J. B. Heywood, Internal Combustion Engine Fundamentals, 1988, table
  of typical design and operating data, turbocharged truck diesels);
* friction mean effective pressure with auxiliaries 0.12 to 0.2 MPa, and within a quarter of Heywood's motored
  direct-injection diesels, 75 + 48 n/1000 + 0.4 c_m² kPa (after Millington and Hartles, SAE 680590).
"""

import math
from dataclasses import replace
from functools import cache

import pytest

from cranktrain.modules.combustion.file import load
from cranktrain.modules.combustion.performance import friction_pressure, performance
from cranktrain.modules.register import module_files

RPM = math.pi / 30.0
ENGINES = "combustion_i6", "combustion_v8"


@cache
def full_load(name, rpm=2000.0, **changes):
    return performance(replace(load(module_files()[name]), **changes), rpm * RPM)


@pytest.mark.parametrize("name", ENGINES)
def test_full_load_is_that_of_a_turbocharged_diesel(name):
    point = full_load(name)
    assert 1.5 < point.air_ratio < 1.9
    assert 1.3 < point.peak_ratio < 1.6
    assert 200.0 < 3.6e9 * point.fuel_consumption < 215.0
    assert 0.12e6 < point.friction_pressure < 0.2e6
    assert 12e6 < point.peak_pressure < 16e6 and 4.0 < math.degrees(point.peak_angle) < 15.0
    assert 1.2e6 < point.brake_pressure < 2.0e6
    assert 0.1 < point.wall_fraction < 0.25


@pytest.mark.parametrize("name", ENGINES)
def test_friction_is_near_that_of_motored_engines(name):
    settings = load(module_files()[name])
    point, piston_speed = full_load(name), settings.stroke * 2000.0 / 30.0
    motored = 1e3 * (75.0 + 48.0 * 2.0 + 0.4 * piston_speed**2)
    assert point.friction_pressure == pytest.approx(friction_pressure(point.peak_pressure, piston_speed))
    assert point.friction_pressure == pytest.approx(motored, rel=0.25)


@pytest.mark.parametrize("name", ENGINES)
def test_boost_has_the_air_that_it_should(name):
    """Trapped air is the density of the intake times the closing volume's swept part, about; λ follows the boost."""
    point = full_load(name)
    settings = load(module_files()[name])
    swept = 0.25 * math.pi * settings.bore**2 * settings.stroke
    air = settings.intake_pressure / (287.05 * settings.intake_temperature) * swept
    efficiency = point.air_ratio * settings.fuel_mass * 14.5 / air
    assert 0.85 < efficiency < 1.05  # volumetric efficiency by the state of the manifold
    more = full_load(name, intake_pressure=1.1 * settings.intake_pressure)
    assert more.air_ratio / point.air_ratio == pytest.approx(1.1, rel=0.03)
    assert more.motored_pressure / point.motored_pressure == pytest.approx(1.1, rel=0.03)


@pytest.mark.parametrize("name", ENGINES)
def test_energy_of_the_fuel_is_accounted_for(name):
    """Work and wall heat leave 30 to 50 % for the exhaust, as heat balances of truck diesels have it (Heywood 1988)."""
    point, settings = full_load(name), load(module_files()[name])
    swept = 0.25 * math.pi * settings.bore**2 * settings.stroke
    indicated = point.indicated_pressure * swept / (settings.fuel_mass * settings.heating_value)
    assert 0.40 < indicated < 0.50
    assert 0.30 < 1.0 - indicated - point.wall_fraction < 0.50
    work = point.torque * 4.0 * math.pi / len(settings.firing_angles)
    assert work * point.fuel_consumption == pytest.approx(settings.fuel_mass)


@pytest.mark.parametrize("name", ENGINES)
def test_a_file_without_pressures_has_those_of_the_engine(name, tmp_path):
    text = module_files()[name].read_text("utf-8")
    path = tmp_path / "mine.toml"
    path.write_text("\n".join(x for x in text.split("\n") if not x.startswith(("intake_pr", "exhaust_pr"))), "utf-8")
    assert load(path).intake_pressure == pytest.approx(2.6e5)
    assert load(path).exhaust_pressure == pytest.approx(2.3e5)
    assert load(module_files()[name]).intake_pressure == pytest.approx(2.0e5)
