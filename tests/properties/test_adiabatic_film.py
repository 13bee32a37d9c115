"""Oil that warms along the film: closed forms, heat that closes, grids that converge, and Raimondi and Boyd's rise."""

import math
from dataclasses import replace

import numpy as np
import pytest
from one_line import one_line

from cranktrain.core.errors import InputError, SolverError
from cranktrain.engine.lubricant import viscosity
from cranktrain.engine.parts import Oil
from cranktrain.film.steady.adiabatic_bearing import adiabatic_bearing
from cranktrain.film.steady.adiabatic_film import Row, temperatures
from cranktrain.film.steady.bearing import Journal
from cranktrain.film.steady.heat_balance import LARGEST_RISE, adiabatic_temperature, balanced_temperature
from cranktrain.film.steady.mixed_bearing import MixedBearing, Surroundings
from cranktrain.film.steady.plain_bearing import Bearing

COLD = 313.15
OIL = Oil(
    density=860.0, temperature_speeds=(0.0,), temperatures=(COLD,), supply_pressure=0.0, law="walther",
    walther_temperatures=(313.15, 373.15), walther_viscosities=(32e-6, 5.4e-6), heat_capacity=2000.0, heat_share=1.0,
)  # fmt: skip
EXPONENTIAL = replace(OIL, law="vogel", vogel_a=0.03 * math.exp(-0.03 * 1e4), vogel_b=0.03 * 1e8, vogel_c=COLD - 1e4)
"""η = 0.03 exp(−0.03 (T − T₀)) to 0.3 % over 30 K: Vogel's law with its pole far away."""
PER_VOLUME = OIL.density * OIL.heat_capacity
JOURNAL = Journal(0.1, 0.08, 150e-6, 0.02, 2000.0 * math.pi / 30.0)


def bearing(grid=(160, 16), supply="widest-gap", groove=0.0):
    return MixedBearing(Surroundings(), supply, grid, groove)


@pytest.mark.parametrize("oil", [OIL, EXPONENTIAL])
def test_a_uniform_gap_warms_as_the_closed_form_says(oil):
    """Unloaded bearing: ∫ dT/η = 2 U x/(ρ c_p c²); with an exponential law ΔT = ln(1 + 2 β η₀ U x/(ρ c_p c²))/β."""
    n, speed, gap, width, turn = 400, 10.0, 100e-6, 0.05, 0.3
    fed = np.arange(n) == 0
    flow = np.full(n, 0.5 * speed * gap * width)
    warm = np.full(n, COLD)
    for _ in range(60):
        heat = np.array([viscosity(oil, t) for t in warm]) * speed**2 / gap * width * turn / n
        warm = temperatures(Row(flow, heat), fed, COLD, PER_VOLUME, carried=0.0).temperature
    x = np.arange(n) * turn / n
    rise = warm[-1] - COLD
    assert rise > 5.0
    fluidity = np.array([1.0 / viscosity(oil, t) for t in np.linspace(COLD, warm[-1], 201)])
    integral = rise / 200 * (fluidity.sum() - 0.5 * (fluidity[0] + fluidity[-1]))
    assert integral == pytest.approx(2.0 * speed * x[-1] / (PER_VOLUME * gap**2), rel=3e-3)
    if oil is EXPONENTIAL:
        closed = np.log1p(2.0 * 0.03 * 0.03 * speed * x / (PER_VOLUME * gap**2)) / 0.03
        assert np.abs(warm - COLD - closed).max() < 0.01 * closed[-1]


def test_without_friction_the_film_is_as_warm_as_its_supply():
    fed = np.arange(50) == 0
    found = temperatures(Row(np.full(50, 1e-6), np.zeros(50)), fed, COLD, PER_VOLUME)
    assert (found.temperature == COLD).all() and found.heat == 0.0
    cool = adiabatic_bearing(replace(OIL, heat_share=0.0), COLD, bearing((80, 8)), JOURNAL, 6000.0)
    plain = bearing((80, 8)).state(replace(JOURNAL, viscosity=viscosity(OIL, COLD)), 6000.0)
    assert cool.temperature == pytest.approx(np.full(80, COLD))
    assert cool.state.eccentricity == pytest.approx(plain.eccentricity, rel=1e-6)


def test_what_comes_round_mixes_with_what_is_fed():
    """Half of the flow lost to the ends and fed anew: T = (T_r + T_s)/2 behind the supply."""
    n = 100
    flow = np.linspace(2e-6, 1e-6, n)
    heat = np.full(n, 1.0)
    fed = np.arange(n) == 0
    found = temperatures(Row(flow, heat), fed, COLD, PER_VOLUME)
    came = found.temperature[-1] + 1.0 / (PER_VOLUME * flow[-1])
    assert found.temperature[0] - COLD == pytest.approx(0.5 * (came - COLD), rel=1e-6)
    fresh = temperatures(Row(flow, heat), fed, COLD, PER_VOLUME, carried=0.0)
    assert fresh.temperature[0] == COLD
    assert PER_VOLUME * found.side_flow * (found.outlet - COLD) == pytest.approx(found.heat, rel=1e-6)


@pytest.mark.parametrize(("diameter", "rpm", "load"), [(0.1, 1500, 6000.0), (0.1, 4000, 9000.0), (0.05, 6000, 3000.0)])
def test_heat_leaves_with_the_oil(diameter, rpm, load):
    """ρ c_p Q (T_out − T_s) of the side flow is the friction's heat."""
    journal = Journal(diameter, 0.8 * diameter, 1.5e-3 * diameter, 0.02, rpm * math.pi / 30.0)
    found = adiabatic_bearing(OIL, COLD, bearing(), journal, load)
    assert PER_VOLUME * found.state.flow * (found.outlet - COLD) == pytest.approx(found.heat, rel=1e-3)
    # A filled gap is sheared more than one whose ruptured part runs in streaks.
    assert 0.6 < found.heat / (found.state.friction_torque * journal.speed) < 1.0
    assert COLD < found.mixed < found.outlet < found.temperature.max()


def test_grids_converge():
    found = [adiabatic_bearing(OIL, COLD, bearing(grid), JOURNAL, 6000.0) for grid in ((80, 8), (160, 16), (320, 32))]
    tops = [one.temperature.max() - COLD for one in found]
    assert abs(tops[1] - tops[2]) < 0.01 * tops[2]
    assert abs(tops[1] - tops[2]) < 0.7 * abs(tops[0] - tops[2])


@pytest.mark.parametrize(("sommerfeld", "variable"), [(1.33, 106.0), (0.631, 52.1)])
def test_the_rise_is_raimondi_and_boyds_at_light_loads(sommerfeld, variable):
    """ρ c ΔT/P of a bearing of L/D = 1 with constant viscosity, at eccentricities 0.1 and 0.2.

    Published: A. A. Raimondi, J. Boyd, Trans. ASLE 1 (1958) 159, as tabled in J. E. Shigley's Mechanical Engineering
    Design. Their rise is a mean that takes the side flow as half as warm; at higher loads it leaves earlier and cooler.
    """
    flat = replace(OIL, walther_viscosities=(10.001e-6, 10e-6))
    diameter, clearance, turns = 0.05, 25e-6, 30.0
    eta = viscosity(flat, COLD)
    pressure = eta * turns * (0.5 * diameter / clearance) ** 2 / sommerfeld
    journal = Journal(diameter, diameter, clearance, eta, 2.0 * math.pi * turns)
    found = adiabatic_bearing(flat, COLD, bearing(), journal, pressure * diameter**2, carried=0.0)
    assert PER_VOLUME * (found.temperature.max() - COLD) / pressure == pytest.approx(variable, rel=0.03)


def test_what_cannot_be_is_refused():
    n, constant = 20, np.full(20, 1e-6)
    fed, other = np.arange(n) == 0, MixedBearing(Surroundings(cavitation="reynolds"), "widest-gap", (80, 8))
    for call, kind, said in (
        (lambda: temperatures(Row(constant, 5e7 * constant), fed, COLD, PER_VOLUME), SolverError, "hardly any is fed"),
        (lambda: temperatures(Row(np.linspace(-1.0, 1.0, n), np.ones(n)), fed, COLD, PER_VOLUME), SolverError,
         "against the rotation"),
        (lambda: adiabatic_bearing(OIL, COLD, other, JOURNAL, 6000.0), InputError, "take mass-conserving"),
        (lambda: user(inlet_temperature_c=None, viscosity_pas=0.02).equilibrium(6000.0), InputError,
         "adiabatic needs inlet_temperature_c"),
    ):  # fmt: skip
        with one_line(said, kind=kind):
            call()


def user(**values):
    usual = {
        "diameter_mm": 100.0, "width_mm": 80.0, "clearance_um": 150.0, "speed_rpm": 2000.0, "inlet_temperature_c": 40.0,
        "oil_viscosity_40": 32.0, "oil_viscosity_100": 5.4, "film_temperature": "adiabatic",
        "cavitation": "mass-conserving", "grid": (80, 8),
    }  # fmt: skip
    return Bearing(**(usual | values))


def test_a_bearing_in_units_takes_either_way():
    warm = user().equilibrium(6000.0)
    one = user(film_temperature="heat-balance", heat_share=1.0).equilibrium(6000.0)
    assert len(warm["film_temperature_c"]) == len(warm["film_angle_deg"]) == 72
    assert max(warm["film_temperature_c"]) == pytest.approx(warm["largest_temperature_c"], abs=0.3)
    # One temperature for the whole film lies between the supply and the hottest place, and carries about as much.
    assert 40.0 < one["effective_temperature_c"] < warm["largest_temperature_c"]
    assert warm["eccentricity"] == pytest.approx(one["eccentricity"], rel=0.1)


def test_a_runs_film_that_keeps_its_heat_closes_its_balance():
    """P η_m/η = ρ c_p Q ΔT, with η_m = ΔT/∫dT/η; with an exponential law a closed form."""
    eta = viscosity(EXPONENTIAL, COLD)
    power, flow = 600.0, 2e-5
    found, bound = adiabatic_temperature(EXPONENTIAL, COLD, COLD, power, flow)
    # ∫dT/η = (e^{βΔT} − 1)/(β η₀) = P/(η₀ ρ c_p Q)
    rise = math.log1p(0.03 * power / (PER_VOLUME * flow)) / 0.03
    mean = 0.03 * rise / math.expm1(0.03 * rise)
    assert bound == "" and found - COLD == pytest.approx(-math.log(mean) / 0.03, rel=0.01)
    assert eta == pytest.approx(0.03)
    # Little heat: half of the rise, as the balance of means has it.
    small, _ = adiabatic_temperature(OIL, COLD, COLD, 1.0, flow)
    other, _ = balanced_temperature(OIL, COLD, COLD, 1.0, flow)
    assert small - COLD == pytest.approx(other - COLD, rel=0.01)
    assert adiabatic_temperature(OIL, COLD, COLD, 0.0, flow)[0] == COLD
    hottest, bound = adiabatic_temperature(OIL, COLD, COLD, 1e5, 1e-9)
    assert hottest <= COLD + LARGEST_RISE and "cannot carry" in bound
