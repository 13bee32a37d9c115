"""Films of their own temperatures in the running model: the heat balance closes, and each film has its own oil."""

import math
import warnings
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from bodies import rigid_crank
from started import at_speed

from cranktrain.core.errors import InputError
from cranktrain.dynamics import cycle_run
from cranktrain.dynamics.model.arrays import supply_temperature
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Parts, simulate
from cranktrain.dynamics.warm_films import PASSES, SETTLED, cycle_means
from cranktrain.engine.file import load_engine
from cranktrain.engine.lubricant import viscosity
from cranktrain.film.laws.ehd import SHAPES
from cranktrain.film.steady.heat_balance import LARGEST_RISE, MEAN, balanced_temperature
from cranktrain.results.files import save_run
from cranktrain.results.summary import run_summary
from cranktrain.store.hdf5 import read_result
from cranktrain.structure.block.saddle import bore_compliance

ENGINE = load_engine("diesel_i6")
OIL = ENGINE.oil
BODY = rigid_crank(ENGINE)
RPM = math.pi / 30
SPEED = 2000 * RPM
ENGINES_OIL = supply_temperature(ENGINE, Settings(), SPEED)
LEVELS = ("impedance", "reynolds", "ehd")
WARM = Settings(crank="rigid", film_temperature="heat-balance")


@cache
def bore():
    return bore_compliance(ENGINE, SHAPES, with_motion=True)


def started(level, temperatures=None):
    elastic = bore() if level == "ehd" else None
    settings = Settings(crank="rigid", bearings=level)
    return at_speed(SPEED, ENGINE, BODY, settings, parts=Parts(bore=elastic), temperatures=temperatures)


def run_on(simulation, steps):
    for _ in range(steps):
        simulation.step(simulation.time + math.radians(2.5) / SPEED)


def each(simulation, name):
    return np.array([simulation.outputs[simulation.output_names.index(f"bearing[{i + 1}].{name}")] for i in range(7)])


@cache
def balanced(rpm=2000, load=1.0, share=OIL.heat_share):
    engine = replace(ENGINE, oil=replace(OIL, heat_share=share))
    return simulate(engine, BODY, Settings(crank="rigid", gas_load=load, film_temperature="heat-balance"), rpm * RPM, 1)


@pytest.mark.parametrize("level", LEVELS)
def test_equal_temperatures_are_the_plain_run_bit_by_bit(level):
    """Given at the start, or set on the way: the state is all that a run needs, and a model built anew goes on."""
    plain, equal, rebuilt = started(level), started(level, np.full(7, ENGINES_OIL)), started(level)
    for _ in range(2):
        for one in (plain, equal, rebuilt):
            run_on(one, 6)
        rebuilt.film_temperatures = rebuilt.film_temperatures
    for one in (equal, rebuilt):
        assert np.array_equal(plain.state, one.state)
        assert np.array_equal(plain.outputs, one.outputs)
        assert np.array_equal(plain.film_temperatures, one.film_temperatures)


@pytest.mark.parametrize("level", ("impedance", "reynolds"))
def test_a_warmer_film_of_the_same_journal_scales_with_its_viscosity_and_no_other_changes(level):
    simulation = started(level)
    run_on(simulation, 40)
    before = {name: each(simulation, name) for name in ("force.x", "force.y", "pressure_max", "oil_flow")}
    torque = each(simulation, "friction_torque")
    temperatures = np.full(7, ENGINES_OIL)
    temperatures[2] += 15.0
    simulation.film_temperatures = temperatures
    ratio = np.ones(7)
    ratio[2] = viscosity(OIL, ENGINES_OIL + 15.0) / viscosity(OIL, ENGINES_OIL)
    for name, values in before.items():
        # Asperities do not feel the oil; what they add at this state is below the tolerance.
        scale = 1.0 if name == "oil_flow" else ratio
        assert each(simulation, name) == pytest.approx(scale * values, rel=1e-9), name
    assert each(simulation, "friction_torque") == pytest.approx(ratio * torque, rel=1e-9)


def test_an_elastic_film_runs_on_with_its_own_oil():
    """Over a step so short that no journal moves, one warm film does as it would among warm ones."""
    torques = []
    for warm in ([], [2], range(7)):
        simulation = started("ehd")
        run_on(simulation, 4)
        temperatures = np.full(7, ENGINES_OIL)
        temperatures[list(warm)] += 15.0
        simulation.film_temperatures = temperatures
        simulation.step(simulation.time + math.radians(0.01) / SPEED)
        torques.append(each(simulation, "friction_torque"))
    cold, one, all_warm = torques
    assert one[2] == pytest.approx(all_warm[2], rel=1e-3)
    assert np.delete(one, 2) == pytest.approx(np.delete(cold, 2), rel=1e-3)
    # The bore, less pressed, springs back: friction falls like the viscosity (by 28 %) but for a few per cent.
    ratio = viscosity(OIL, ENGINES_OIL + 15.0) / viscosity(OIL, ENGINES_OIL)
    assert all_warm / cold == pytest.approx(np.full(7, ratio), rel=0.05)


@pytest.mark.parametrize(("rpm", "load"), [(2000, 1.0), (1000, 1.0)])
def test_heat_closes_for_every_bearing(rpm, load):
    """λ P = ρ c_p Q (T_out − T_in), with T_eff at the mean: to what the last change leaves open."""
    run = balanced(rpm, load)
    assert 2 <= run.passes <= PASSES
    powers, flows = cycle_means(run.outputs, 7, run.per_cycle)
    inlet = supply_temperature(ENGINE, Settings(), rpm * RPM)
    rise = MEAN * OIL.heat_share * powers / (OIL.density * OIL.heat_capacity * flows)
    # A change ΔT takes rise (1 − η(T + ΔT)/η(T)) along with it: the balance is that much further off than the change.
    thins = [1.0 - viscosity(OIL, t + SETTLED) / viscosity(OIL, t) for t in run.film_temperatures]
    assert (np.abs(inlet + rise - run.film_temperatures) <= SETTLED + rise * np.array(thins)).all()
    assert (run.film_temperatures > inlet + 2.0).all()


def test_a_simulation_starts_with_the_temperatures_of_a_run():
    """What an FMU does at its initialization: the balance of a run that settles, whatever comes from outside."""
    settings = replace(WARM, boundary="torque", gas_source="input")
    simulation = at_speed(SPEED, ENGINE, BODY, settings)
    run = simulate(ENGINE, BODY, WARM, SPEED)
    assert np.array_equal(simulation.film_temperatures, run.film_temperatures)
    assert (simulation.film_temperatures > ENGINES_OIL + 1.0).all()


def test_power_into_the_films_is_that_of_shear_and_squeeze():
    run = balanced()
    powers, flows = cycle_means(run.outputs, 7, run.per_cycle)
    for i in range(7):
        out = {name.split(".", 1)[1]: v for name, v in run.outputs.items() if name.startswith(f"bearing[{i + 1}].")}
        work = -(out["force.x"] * out["velocity.x"] + out["force.y"] * out["velocity.y"])
        shear = out["friction_torque"] * out["speed.relative"]
        assert powers[i] == pytest.approx((work + shear)[1:].mean(), rel=1e-12)
        assert flows[i] == pytest.approx(out["oil_flow"][1:].mean(), rel=1e-12)
        # What the centre does against the film's force over a whole cycle is heat, too.
        assert powers[i] > shear[1:].mean() > 0.0


def test_a_run_by_heat_balance_starts_at_zero_and_shows_its_temperatures(tmp_path):
    run = balanced()
    assert run.time[0] == 0.0 and abs(run.angle[0]) < 0.01
    assert run.angle[-1] == pytest.approx(run.angle[0] + 4 * math.pi, abs=0.01)
    save_run(tmp_path / "run.h5", run, {})
    celsius, unit = read_result(tmp_path / "run.h5")[0]["film_temperature_c"]
    rows = run_summary(run, "")["bearings"]
    assert unit == "degC"
    assert celsius == pytest.approx(run.film_temperatures - 273.15) and len(celsius) == 7
    assert [row["film_temperature_c"] for row in rows] == pytest.approx(list(celsius))


def test_one_cycle_of_a_film_without_heat_share_is_the_plain_run():
    run = balanced(share=0.0)
    plain = simulate(ENGINE, BODY, Settings(crank="rigid"), SPEED, 1)
    assert run.passes == 1
    assert all(np.array_equal(run.outputs[name], plain.outputs[name]) for name in plain.outputs)
    assert np.array_equal(run.film_temperatures, plain.film_temperatures)


def test_what_cannot_balance_is_bounded_and_said():
    hottest = ENGINES_OIL + LARGEST_RISE
    for power, flow, bounded, said in (
        (300.0, 0.0, hottest, "cannot carry 300 W"), (300.0, -1e-9, hottest, "cannot carry 300 W"),
        (0.0, 1e-5, ENGINES_OIL, "no power"), (-5.0, 1e-5, ENGINES_OIL, "no power"),
    ):  # fmt: skip
        temperature, bound = balanced_temperature(OIL, ENGINES_OIL, ENGINES_OIL + 9.0, power, flow)
        assert temperature == bounded and said in bound
    # Just inside the bound nothing jumps.
    cold, hot = viscosity(OIL, ENGINES_OIL), viscosity(OIL, hottest)
    flow = MEAN * OIL.heat_share * 300.0 * hot / cold / (OIL.density * OIL.heat_capacity * LARGEST_RISE)
    temperature, bound = balanced_temperature(OIL, ENGINES_OIL, ENGINES_OIL, 300.0, flow * 1.0001)
    assert bound == "" and temperature == pytest.approx(hottest, abs=0.01)


def test_a_bounded_bearing_is_named_in_one_line():
    dry = replace(ENGINE, oil=replace(OIL, heat_capacity=1e-3))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run = simulate(dry, BODY, WARM, SPEED, 1)
    messages = [str(w.message) for w in caught if "heat balance" in str(w.message)]
    assert len(messages) == 1 and "main[1], main[2]" in messages[0] and "bounded 100 K" in messages[0]
    assert run.film_temperatures == pytest.approx(np.full(7, ENGINES_OIL + LARGEST_RISE))


def test_a_balance_that_has_not_settled_is_said(monkeypatch):
    monkeypatch.setattr(cycle_run, "PASSES", 1)
    with pytest.warns(UserWarning, match="not settled by pass 1: temperatures would still change by"):
        run = simulate(ENGINE, BODY, WARM, SPEED, 1)
    assert run.passes == 1 and np.array_equal(run.film_temperatures, np.full(7, ENGINES_OIL))


def test_an_interrupted_balance_keeps_the_run_that_it_has():
    def stop(share):
        raise KeyboardInterrupt

    with pytest.warns(UserWarning, match="not settled by pass 1"):
        run = simulate(ENGINE, BODY, WARM, SPEED, 2, progress=stop)
    assert run.passes == 1 and run.time.size == run.per_cycle + 1


def test_wrong_input_is_refused_in_one_line():
    with pytest.raises(InputError, match="no oil"):
        simulate(ENGINE, BODY, replace(WARM, bearings="linear"), SPEED, 1)
    with pytest.raises(InputError, match="one for each of 7 mains"):
        started("impedance", np.full(6, ENGINES_OIL))
    simulation = started("impedance")
    with pytest.raises(InputError, match="below Vogel's law"):
        simulation.film_temperatures = np.zeros(7)
    assert np.array_equal(simulation.film_temperatures, np.full(7, ENGINES_OIL))
    run_on(simulation, 1)
