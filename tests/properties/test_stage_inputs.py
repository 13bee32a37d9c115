"""Inputs given at the stages of the integrator: of its full order, exact at each stage whatever stands between."""

import math
from functools import cache

import entry
import numpy as np
import pytest
from bodies import rigid_crank
from started import at_speed

from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.dynamics.time.integrators import INTEGRATORS, integrator_table
from cranktrain.dynamics.time.reconstruction import take_stage
from cranktrain.dynamics.time.table import FIRST_STAGE, HEAD, NODE, STAGES
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import running_crank
from cranktrain_lab.coupling.stages import mean_and_moment

ENGINE = load_engine("diesel_i6")
SPEED = 150.0
END = 0.024
"""s, a third of a cycle."""
STAGED = {"crank": "rigid", "bearings": "held", "gas_source": "input", "reconstruction": "stages"}


TOLD = 1.0e-12
"""m³, a deviation of a volume that a partner tells, so that pressures stay as they are."""


def values(t, deviation=TOLD):
    """All inputs at a time: the speed stays, pressures and the torque of the valve train swing."""
    pressures = 1e5 * (4.0 + 3.0 * np.sin(0.5 * SPEED * t + np.arange(6)))
    return np.array([SPEED, *pressures, 0.0, 30.0 * math.sin(70.0 * t), 0.0, 0.0, *np.full(6, deviation)])


def begun(method, deviation=TOLD, **chosen):
    settings = {**STAGED, "integrator": method, "step": math.radians(20.0), **chosen}
    simulation = Simulation(ENGINE, rigid_crank(ENGINE), Settings(**settings))
    simulation.inputs[:] = values(0.0, deviation)
    simulation.initialize()
    return simulation


def shares(method):
    table = integrator_table(method)
    return table[FIRST_STAGE : FIRST_STAGE + int(table[HEAD, STAGES]), NODE]


def give(simulation, method, begin, end, deviation=TOLD):
    """Inputs at the stages of the step to come."""
    places = shares(method)
    entry.give_stages(simulation, places, [values(begin + share * (end - begin), deviation) for share in places])
    simulation.inputs[:] = values(end, deviation)


def ends(method, count, deviation=TOLD, **chosen):
    """Where a run ends in so many communication steps: rotation of the crank, rad."""
    simulation = begun(method, deviation, **chosen)
    h = END / count
    for k in range(count):
        give(simulation, method, k * h, (k + 1) * h, deviation)
        simulation.step((k + 1) * h)
    return float(simulation.outputs[simulation.output_names.index("flywheel.torsion")])


@cache
def exact():
    return ends("esdirk4", 960)


@pytest.mark.parametrize(("method", "order"), [("esdirk3", 3.0), ("esdirk4", 4.0), ("esdirk47", 4.0)])
@pytest.mark.parametrize("deviation", [TOLD, 0.0])
def test_a_step_with_inputs_at_its_stages_has_the_order_of_the_integrator(method, order, deviation):
    """Of untold volumes order three: pressures move by the crank's angle, which a stage foresees by Taylor's series."""
    coarse, fine = (abs(ends(method, count, deviation) - exact()) for count in (15, 30))
    assert math.log2(coarse / fine) == pytest.approx(order if deviation else 3.0, abs=0.4)


@pytest.mark.parametrize("method", list(INTEGRATORS))
def test_a_stage_has_just_the_inputs_that_were_given_for_it(method):
    """Others lie on the polynomial through all stages: a constant everywhere."""
    simulation = begun(method)
    rng, places = np.random.default_rng(3), shares(method)
    given = rng.normal(size=(places.size, simulation.inputs.size))
    entry.give_stages(simulation, places, given)
    for wanted, share in zip(given, places, strict=True):
        take_stage(simulation.work, share)
        found, rates = entry.inputs_in_force(simulation)[:2]
        np.testing.assert_array_equal(found[1:], wanted[1:])
        assert not rates[1:].any()
    entry.give_stages(simulation, places, np.full_like(given, 7.0))
    take_stage(simulation.work, 0.37)
    np.testing.assert_allclose(entry.inputs_in_force(simulation)[0, 1:], 7.0, rtol=1e-12)


def test_what_was_given_counts_for_one_step():
    """Without new inputs the next step holds the last ones, as with the rule that holds."""
    simulation, held = begun("sdirk4"), begun("sdirk4", reconstruction="hold")
    h = 1e-3
    give(simulation, "sdirk4", 0.0, h)
    simulation.step(h)
    assert entry.stages_given(simulation) == 0
    held.state = simulation.state
    held.inputs[:] = simulation.inputs
    for one in (simulation, held):
        one.step(2.0 * h)
    np.testing.assert_array_equal(simulation.outputs, held.outputs)


def test_a_restored_state_shows_the_outputs_that_it_had():
    simulation = begun("esdirk4")
    give(simulation, "esdirk4", 0.0, 1e-3)
    simulation.step(1e-3)
    state, before = simulation.state, simulation.outputs.copy()
    give(simulation, "esdirk4", 1e-3, 2e-3)
    simulation.step(2e-3)
    simulation.state = state
    np.testing.assert_array_equal(simulation.outputs, before)


@pytest.mark.parametrize(("method", "least", "most"), [("esdirk3", 1.0e-3, 2.0e-3), ("esdirk4", 0.0, 1.0e-4)])
def test_steps_of_one_and_a_half_degrees_need_order_four(method, least, most):
    """Torsion of the six under exact pressures, those of its trace: RMS error over the RMS of its alternating part."""
    exact = torsion("esdirk47", 0.125)
    found = float(np.sqrt(np.mean((torsion(method, 1.5) - exact) ** 2)) / exact.std())
    assert least <= found <= most


def torsion(method, step_deg):
    """Of the pulley every 3 degrees of the last of six cycles, rad."""
    speed, step, every = 2000.0 * math.pi / 30.0, math.radians(step_deg), round(3.0 / step_deg)
    settings = Settings(crank="torsional", integrator=method, step=step, gas_source="builtin", dense_output="off")
    simulation = at_speed(speed, ENGINE, running_crank(ENGINE, "torsional"), settings)
    place, found = simulation.output_names.index("pulley.torsion"), []
    for k in range(1440 * every):
        simulation.step((k + 1) * step / speed)
        if (k + 1) % every == 0:
            found.append(simulation.outputs[place])
    return np.array(found[-240:])


def test_a_line_has_the_mean_and_the_first_moment_of_an_impact():
    """Of a blow in one of many parts of a step, from -1 to 1: its impulse, and three times the moment of it."""
    parts, place = 64, 40
    means = np.zeros((parts, 2))
    means[place, 0] = 1.0
    means[:, 1] = np.linspace(-1.0, 1.0, parts)
    (mean, _), (slope, rise) = mean_and_moment(means)
    assert mean == pytest.approx(1.0 / parts)
    assert slope == pytest.approx(3.0 * ((2.0 * place + 1.0) / parts - 1.0) / parts)
    assert rise == pytest.approx(1.0, rel=0.02)
