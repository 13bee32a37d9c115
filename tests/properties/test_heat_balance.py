"""Heat balance of a film: Petrov's unloaded journal, whose balance is one closed equation, and what rises with what."""

import math
from dataclasses import replace

import pytest
from one_line import one_line

from cranktrain.core.errors import SolverError
from cranktrain.engine.file import load_engine
from cranktrain.engine.lubricant import viscosity
from cranktrain.film.steady.heat_balance import effective_temperature

OIL = load_engine("diesel_i6").oil
DIAMETER, WIDTH, CLEARANCE, FLOW = 85e-3, 30e-3, 40e-6, 20e-6
INLET = 363.15
TORQUE = math.pi * DIAMETER**3 * WIDTH / (4.0 * CLEARANCE)


def petrov(speed, oil=OIL, flow=FLOW, place=0.5, inlet=INLET):
    return effective_temperature(oil, inlet, lambda eta: eta * TORQUE * speed**2, lambda _: flow, place)


@pytest.mark.parametrize("speed", [1e-3, 10.0, 100.0, 250.0, 1000.0, 5000.0])
@pytest.mark.parametrize("law", ["vogel", "walther"])
def test_fixed_point_of_petrovs_journal(speed, law):
    oil = replace(OIL, law=law)
    warm = petrov(speed, oil)
    rise = oil.heat_share * viscosity(oil, warm) * TORQUE * speed**2 / (oil.density * oil.heat_capacity * FLOW)
    assert warm == pytest.approx(INLET + 0.5 * rise, rel=0, abs=1e-10)


def test_an_oil_whose_balance_solves_by_hand():
    # Viscosity η = a exp(b/(T − c)) at c = 0 and heat chosen so that T_eff = 400 K exactly.
    oil = replace(OIL, vogel_a=1e-5, vogel_b=2800.0, vogel_c=1.0)
    eta = 1e-5 * math.exp(2800.0 / 399.0)
    flow = 1e-5
    power = (400.0 - INLET) * oil.density * oil.heat_capacity * flow / (0.5 * oil.heat_share)
    found = effective_temperature(oil, INLET, lambda e: power * e / eta, lambda _: flow)
    assert found == pytest.approx(400.0, abs=1e-9)


def test_hotter_with_speed_and_supply_and_cooler_with_flow():
    speeds = [petrov(s) for s in (0.0, 20.0, 80.0, 200.0, 400.0)]
    assert speeds[0] == INLET and speeds == sorted(speeds) and speeds[-1] > INLET + 5.0
    flows = [petrov(200.0, flow=q) for q in (2e-6, 1e-5, 1e-4)]
    assert flows == sorted(flows, reverse=True)
    assert petrov(200.0, inlet=353.15) < petrov(200.0, inlet=363.15)
    assert petrov(200.0, replace(OIL, heat_share=0.4)) < petrov(200.0)
    assert petrov(200.0, place=0.0) == INLET
    # Thinner as it warms, the oil rises less than it would at the inlet's viscosity.
    cold = OIL.heat_share * viscosity(OIL, INLET) * TORQUE * 200.0**2 / (OIL.density * OIL.heat_capacity * FLOW)
    assert petrov(200.0) < INLET + 0.5 * cold
    # Flow that grows as the oil thins cools further.
    power, thin = TORQUE * 200.0**2, FLOW * viscosity(OIL, INLET)
    assert INLET < effective_temperature(OIL, INLET, lambda eta: eta * power, lambda eta: thin / eta) < petrov(200.0)


def test_what_cannot_balance_is_refused_in_one_line():
    with one_line("no oil flow", kind=SolverError):
        petrov(200.0, flow=0.0)
    with one_line("more than 1000 K hotter", kind=SolverError):
        effective_temperature(OIL, INLET, lambda _: 1e6, lambda _: FLOW)
    with one_line("must not be negative"):
        effective_temperature(OIL, INLET, lambda _: -1.0, lambda _: FLOW)
    with one_line("place 2 must lie"):
        petrov(200.0, place=2.0)
    assert petrov(0.0, flow=0.0) == INLET
