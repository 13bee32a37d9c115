"""Rates that a driver gives with its inputs: of second order in the communication step, and kept in the state."""

import math
from functools import cache

import entry
import numpy as np
import pytest
from bodies import rigid_crank

from cranktrain.core.run_entries import RunEntries
from cranktrain.dynamics import run_record
from cranktrain.dynamics.model import state as layout
from cranktrain.dynamics.simulation import Parts, Settings, Simulation
from cranktrain.dynamics.time.reconstruction import reconstruct, take_rates, take_sample
from cranktrain.engine.file import load_engine
from cranktrain.loads.gas_pressure import GasTrace

ENGINE = load_engine("diesel_i6")
SPEED, SWING = 150.0, 40.0
END = 0.024
"""s, a third of a cycle."""
HELD = {"crank": "rigid", "bearings": "held", "gas_source": "input", "reconstruction": "hold"}


def values(t):
    """All inputs at a time, known beforehand, and their rates: speed, pressures, torque of valves, and nothing else."""
    turn = 0.5 * SPEED * t + np.arange(6)
    pressures, slopes = 1e5 * (4.0 + 3.0 * np.sin(turn)), 1e5 * 1.5 * SPEED * np.cos(turn)
    found = [SPEED + 5.0 * math.sin(SWING * t), *pressures, 0.0, 30.0 * math.sin(70.0 * t), *np.zeros(8)]
    rates = [5.0 * SWING * math.cos(SWING * t), *slopes, 0.0, 2100.0 * math.cos(70.0 * t), *np.zeros(8)]
    return np.array(found), np.array(rates)


def begun(**chosen):
    settings = {**HELD, "step": math.radians(0.25), **chosen}
    simulation = Simulation(ENGINE, rigid_crank(ENGINE), Settings(**settings))
    simulation.inputs[:] = values(0.0)[0]
    simulation.initialize()
    return simulation


def ends(count, rates, **chosen):
    """Where a run ends in so many communication steps: rotation and torque of the crank."""
    simulation = begun(**chosen)
    h = END / count
    for k in range(count):
        simulation.inputs[:], given = values(k * h)
        if rates:
            simulation.input_rates[:] = given
        simulation.step((k + 1) * h)
    return simulation.outputs[[simulation.output_names.index(name) for name in ("flywheel.torsion", "shaft.torque")]]


@cache
def exact():
    return ends(960, True)


@pytest.mark.parametrize(("rates", "order"), [(False, 1.0), (True, 2.0)])
def test_rates_of_held_inputs_give_second_order_in_the_communication_step(rates, order):
    errors = np.array([np.abs(ends(count, rates) - exact()) for count in (60, 120, 240)])
    found = np.log2(errors[:-1] / errors[1:])
    assert np.abs(found - order).max() < 0.25, found


def test_rates_count_whatever_the_rule_and_leave_other_inputs_to_it():
    for rule in ("hold", "linear", "interpolate", "polytropic"):
        simulation = begun(reconstruction=rule)
        model, work, inputs = simulation.model, simulation.work, simulation.inputs
        pair = []
        for given in (False, True):
            state = simulation.state
            for k in range(3):
                inputs[:], rates = values(1e-3 * k)
                take_sample(model, state, inputs, 1e-3)
                take_rates(state, rates if given else np.full(inputs.size, np.nan), 1e-3)
            if given:
                state[layout.RATES_GIVEN + 2] = 0.0  # all but one cylinder
            reconstruct(model, work, state)
            pair.append(entry.inputs_in_force(simulation))
        without, told = pair
        rows = [0, 1, 3, 4, 5, 6, 8]
        assert np.array_equal(told[0, rows], inputs[rows]) and np.array_equal(told[1, rows], rates[rows])
        assert np.array_equal(told[:, 2], without[:, 2])
        if rule != "hold":
            assert not np.array_equal(told[:, 3], without[:, 3])


def test_what_is_no_number_gives_no_rate():
    """Then all is as without, to the bit; and a rate counts for the one step that it is given for."""
    plain, told = begun(reconstruction="polytropic"), begun(reconstruction="polytropic")
    for k in range(4):
        for simulation in (plain, told):
            simulation.inputs[:] = values(1e-3 * k)[0]
            simulation.input_rates[:] = math.inf if simulation is told else math.nan
            simulation.step(1e-3 * (k + 1))
        assert np.array_equal(plain.outputs, told.outputs) and np.array_equal(plain.state, told.state)
    told.input_rates[3] = 1e9
    told.step(5e-3)
    told.input_rates[3] = math.nan
    told.step(6e-3)
    assert told.state[layout.RATES_GIVEN + 3] == 0.0


def test_rates_are_in_the_state():
    """A restored state shows what it showed, in an instance that was given other rates, and goes on as before."""
    first, other = begun(), begun()
    for k in range(5):
        first.inputs[:], first.input_rates[:] = values(1e-3 * k)
        first.step(1e-3 * (k + 1))
    state, shown = first.state, first.outputs.copy()
    other.input_rates[:] = 3.0
    other.step(1e-3)
    other.state = state
    assert np.array_equal(other.outputs, shown)
    for simulation in (first, other):
        simulation.inputs[:], simulation.input_rates[:] = values(5e-3)
        simulation.step(6e-3)
    assert np.array_equal(first.outputs, other.outputs) and np.array_equal(first.state, other.state)


def test_a_driver_without_python_gives_them_in_the_workspace():
    simulation = begun()
    run = run_record.make_run(
        ENGINE, rigid_crank(ENGINE), Settings(**HELD, step=math.radians(0.25)), GasTrace.from_engine(ENGINE), Parts()
    )
    run.inputs[:] = values(0.0)[0]
    entries = RunEntries("cranktrain", run, run_record)
    assert entries.prepare() == entries.start(0.0) == 0
    for k in range(3):
        simulation.inputs[:], simulation.input_rates[:] = run.inputs[:], run.work.input_rates[:] = values(1e-3 * k)
        simulation.step(1e-3 * (k + 1))
        assert entries.advance(1e-3 * (k + 1)) == 0
    assert np.array_equal(simulation.outputs, run.outputs.values)
