"""What the cranktrain offers partners: the valve train's torque, the angle of pressures, torques by power, angles."""

import math
from dataclasses import replace

import bodies
import numpy as np
import pytest
from bodies import free_six
from some import some

import cranktrain as ct
from cranktrain.dynamics.model import state as layout
from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.dynamics.time.reconstruction import nearest_turn, take_sample
from cranktrain.engine.file import load_engine
from cranktrain.modules.register import module_files
from cranktrain.modules.valve_train.file import load as load_valve_train
from cranktrain.modules.valve_train.simulation import ValveTrainSimulation
from cranktrain.results.orders.harmonics import order_amplitudes

SPEED = 200.0
CYCLE = 4.0 * math.pi


def started(engine):
    return bodies.started(SPEED, engine, bearings="linear")


def recorded(simulation, cycles, per_cycle=240):
    """Outputs by name over the last of so many cycles, and the step, s."""
    found = bodies.series(simulation, cycles * per_cycle, per_cycle)
    return {name: values[-per_cycle:] for name, values in found.items()}, CYCLE / SPEED / per_cycle


def test_the_front_end_gives_what_the_valve_train_takes():
    """What a constant torque takes is missing at the shaft on average."""
    engine = free_six()
    taken = 40.0
    found = []
    for torque in (0.0, taken):
        simulation = started(engine)
        simulation.inputs[simulation.input_names.index("valvetrain.torque")] = torque
        found.append(recorded(simulation, 40)[0])
    without, loaded = found
    assert np.mean(without["shaft.torque"] - loaded["shaft.torque"]) == pytest.approx(taken, rel=1e-3)
    assert np.mean(without["torque.brake"] - loaded["torque.brake"]) == pytest.approx(taken, rel=1e-3)


def test_brake_torque_is_on_average_what_the_shaft_takes():
    """Power of the gas less that of friction; nothing else takes power of a rigid crank on springs without dampers."""
    for name in ("diesel_i6", "diesel_v8"):
        found, _ = recorded(started(load_engine(name)), 40)
        assert np.mean(found["torque.brake"]) == pytest.approx(np.mean(found["shaft.torque"]), rel=2e-3)
        assert np.all(found["torque.friction"] == 0.0)


def test_rates_of_volumes_and_the_power_of_the_gas():
    engine = free_six()
    found, h = recorded(started(engine), 2, per_cycle=2880)
    for c in some(range(engine.n_cylinders)):
        volume, rate = found[f"cylinder[{c + 1}].volume"], found[f"cylinder[{c + 1}].volume_rate"]
        slope = (volume[2:] - volume[:-2]) / (2.0 * h)
        assert np.abs(rate[1:-1] - slope).max() < 1e-4 * np.abs(rate).max()


def test_angles_for_partners():
    simulation = started(free_six())
    found, _ = recorded(simulation, 3)
    angle = found["crank.angle"]
    assert np.all((found["crank.angle_cycle"] >= 0.0) & (found["crank.angle_cycle"] < CYCLE))
    turns = (angle - found["crank.angle_cycle"]) / CYCLE
    assert turns == pytest.approx(np.round(turns), abs=1e-12)
    # What is left is half the acceleration's share of a step of 3 degrees.
    assert found["crank.angle_next"][:-1] == pytest.approx(angle[1:], abs=1e-4)


def test_pressures_belong_to_the_angle_that_a_partner_tells():
    """Whole cycles aside; 0 tells nothing until another angle was told."""
    simulation = started(free_six())
    model, state = simulation.model, simulation.state
    inputs, place = simulation.inputs.copy(), simulation.input_names.index("pressure.angle")
    take_sample(model, state, inputs, 1e-4)
    own = state[layout.POINT_ANGLE]
    assert state[layout.SAMPLE_ANGLES] == own
    for told in (own + 0.02, own + 0.02 + 3 * CYCLE, own - 0.3 - CYCLE):
        inputs[place] = told
        take_sample(model, state, inputs, 1e-4)
        assert state[layout.SAMPLE_ANGLES] == pytest.approx(own + nearest_turn(told - own), abs=1e-12)
    inputs[place] = 0.0
    take_sample(model, state, inputs, 1e-4)
    assert state[layout.SAMPLE_ANGLES] == pytest.approx(own + nearest_turn(-own), abs=1e-12)


def test_the_valve_trains_torque_reaches_the_crank_with_its_orders():
    """A torsional crank beside a valve train: its mean is missing at the shaft, orders 3, 6, 9 and 12 are what is new.

    Other orders come with a drive that rattles in the crank's uneven rotation.
    """
    engine, speed = free_six(), 2500.0 * math.pi / 30.0  # no order but 6 resonates near it
    settings = replace(load_valve_train(module_files()["valvetrain_i6"]), inputs_at="end", angle_source="input")
    rows, taken = [], []
    for fitted in (False, True):
        made = ct.assemble(engine, Settings(crank="torsional", bearings="held"))
        crank = Simulation(made.engine, made.body, made.settings, parts=made.parts)
        valves = ValveTrainSimulation(settings)
        crank.inputs[0] = valves.inputs[0] = speed
        for one in (crank, valves):
            one.initialize()
        names = "crank.speed", "crank.angle", "shaft.torque", "pulley.torsion"
        shown = [crank.output_names.index(name) for name in names]
        found = np.empty((16 * 720, 4))
        for k in range(len(found)):
            if fitted:
                crank.inputs[crank.input_names.index("valvetrain.torque")] = valves.outputs[0]
            crank.step((k + 1) * CYCLE / speed / 720)
            found[k] = crank.outputs[shown]
            if fitted:
                valves.inputs[:] = found[k, 0], found[k, 1]
                valves.step((k + 1) * CYCLE / speed / 720)
                taken.append(valves.outputs[0])
        rows.append(found)
    off, torque = (rows[1] - rows[0])[-720:], np.array(taken[-720:])
    assert off[:, 2].mean() == pytest.approx(-torque.mean(), rel=0.05)
    for signal, power, share in ((torque, 0.0, 0.9), (off[:, 3], 2.0, 0.8)):
        orders, amplitudes = order_amplitudes(signal, 12.0)
        squares = np.abs(amplitudes * orders**power) ** 2  # of an angle, those of its acceleration
        of_events = np.abs(orders / 3.0 - np.round(orders / 3.0)) < 1e-9
        assert squares[of_events].sum() > share * squares.sum()
