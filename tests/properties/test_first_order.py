"""The first-order equations agree with the stage solver, which assembles the same model in another way."""

import math

import numpy as np
import pytest
from benchmarks.other_solvers.first_order import FirstOrder
from bodies import whole_six

from cranktrain.core.errors import InputError
from cranktrain.dynamics.model.state import ACCELERATION, TIME, offset
from cranktrain.dynamics.simulation import Settings, Simulation

SPEED = 2000.0 * math.pi / 30.0


def started(settings):
    engine, body = whole_six()
    simulation = Simulation(engine, body, settings)
    simulation.inputs[0] = SPEED
    simulation.initialize()
    return simulation


@pytest.mark.parametrize("bearings", ["linear", "impedance"])
def test_accelerations_are_those_of_the_stage_solver(bearings):
    simulation = started(
        Settings(bearings=bearings, integrator="sdirk4", step=math.radians(0.5), newton_tolerance=1e-8)
    )
    equations = FirstOrder(simulation)
    n = equations.modes
    for k in range(1, 25):
        simulation.step(k * math.radians(15.0) / SPEED)
        state = simulation.state
        own = equations(state[TIME], equations.start(state))[n : 2 * n]
        a = state[offset(ACCELERATION, n) : offset(ACCELERATION, n) + n]
        assert np.abs(own - a).max() < 1e-5 * np.abs(a).max()
        shown = dict(zip(simulation.output_names, simulation.outputs, strict=True))
        quantities = equations.quantities(equations.start(state)[:, None])[:, 0]
        assert quantities[0] == pytest.approx(shown["pulley.torsion"], rel=1e-12)
        assert quantities[1] == pytest.approx(shown["pulley.axial"], rel=1e-12)
        assert quantities[2] == pytest.approx(shown["bearing[1].film_thickness_min"], rel=1e-9, abs=1e-12)


def test_the_jacobian_is_the_derivative_of_the_rate():
    simulation = started(Settings())
    simulation.step(0.003)
    equations = FirstOrder(simulation)
    y = equations.start(simulation.state)
    equations.increments[:] = 1e-9
    jacobian = equations.jacobian(0.003, y)
    direction = np.random.default_rng(1).standard_normal(y.size)
    h = 1e-9
    slope = (equations(0.003, y + h * direction) - equations(0.003, y - h * direction)) / (2 * h)
    assert np.abs(jacobian @ direction - slope).max() < 1e-3 * np.abs(slope).max()


@pytest.mark.parametrize("choice", [{"crank": "rigid", "bearings": "held"}, {"boundary": "torque"}])
def test_other_models_are_refused(choice):
    with pytest.raises(InputError, match="first-order equations know"):
        FirstOrder(started(Settings(**choice)))
