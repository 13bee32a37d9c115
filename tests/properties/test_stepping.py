"""Stepping under bad input and after it: one clear line, the state at the last good time, bit-for-bit continuation."""

import math

import bodies
import entry
import numpy as np
import pytest
from bodies import free_six, rigid_crank, six
from one_line import one_line
from plain_model import PlainModel
from started import at_speed

from cranktrain.core.errors import SolverError
from cranktrain.dynamics.model import state as layout
from cranktrain.dynamics.simulation import Settings, Simulation, simulate
from cranktrain.film.laws.parameters import FACTOR

SPEED = 2000 * math.pi / 30
H = math.radians(2.0) / SPEED


def started(**settings):
    return bodies.started(SPEED, **{"integrator": "sdirk3", "step": math.radians(2.0), **settings})


def run(simulation, steps):
    begin = simulation.time
    for k in range(1, steps + 1):
        simulation.step(begin + k * H)
    return simulation


@pytest.mark.parametrize(
    ("index", "value", "word"),
    [(0, math.nan, "speed"), (0, -1.0, "speed"), (0, math.inf, "speed")]
    + [(k, value, f"cylinder[{k}].pressure") for k in (1, 6) for value in (math.nan, -5.0, math.inf)]
    + [(k, math.nan, "must be finite") for k in (7, 8, 9, 10)],
)
def test_inputs_that_are_no_numbers_or_negative_are_refused(index, value, word):
    simulation = run(started(), 5)
    before, good = simulation.state, simulation.inputs[index]
    simulation.inputs[index] = value
    with one_line(word):
        simulation.step(simulation.time + H)
    assert np.array_equal(simulation.state, before)
    simulation.inputs[index] = good
    run(simulation, 1)


@pytest.mark.parametrize("interval", [0.0, -1e-4, math.nan, 50.0, math.inf])
def test_steps_without_meaning_are_refused(interval):
    simulation = run(started(), 5)
    before = simulation.state
    with one_line("step"):
        simulation.step(simulation.time + interval)
    assert np.array_equal(simulation.state, before)


def test_before_the_start_there_is_no_state():
    engine = free_six()
    with one_line("initialize"):
        Simulation(engine, rigid_crank(engine)).step(1e-3)


@pytest.mark.parametrize(
    ("key", "value", "meant"),
    [("step", -0.1, "positive"), ("step", math.nan, "positive"),
     ("integrator", "generalized-alpha", "generalised-alpha"),
     ("integrator", "generalised-alpha:x", "rho must be a number, e.g. generalised-alpha:0.6")],
)  # fmt: skip
def test_choices_that_do_not_exist_name_the_nearest(key, value, meant):
    with one_line(meant):
        started(**{key: value})


@pytest.mark.parametrize("speed", [0.0, 19 * math.pi / 30, math.nan])
def test_a_run_over_cycles_wants_a_speed(speed):
    engine = free_six()
    with one_line("20 rev/min"):
        simulate(engine, rigid_crank(engine), Settings(crank="rigid"), speed, 1)


@pytest.mark.parametrize("bearings", ["linear", "impedance"])
@pytest.mark.parametrize("integrator", ["sdirk4", "generalised-alpha", "tr-bdf2"])
def test_a_restored_state_goes_on_bit_for_bit(integrator, bearings):
    first = run(started(integrator=integrator, bearings=bearings), 20)
    kept, time = first.state, first.time
    shown = first.outputs.copy()
    run(first, 30)
    second = run(started(integrator=integrator, bearings=bearings), 3)
    second.state = kept
    assert second.time == time
    assert np.array_equal(second.outputs, shown)
    run(second, 30)
    assert np.array_equal(first.state, second.state)
    assert np.array_equal(first.outputs, second.outputs)
    # And in the same simulation.
    first.state = kept
    run(first, 30)
    assert np.array_equal(first.state, second.state)


def test_a_state_of_another_model_is_refused():
    simulation = started()
    with one_line(str(simulation.state.size)):
        simulation.state = np.zeros(simulation.state.size + 1)


def test_a_lost_film_is_named_and_leaves_the_last_good_state():
    simulation = run(started(), 3)
    before = simulation.state
    entry.film_parameters(simulation, 2)[FACTOR] = math.nan
    with one_line("crank angle", "deg", "after 6 halvings", kind=SolverError):
        simulation.step(simulation.time + H)
    assert np.array_equal(simulation.state, before)


@pytest.mark.parametrize("bearings", ["linear", "impedance"])
def test_a_run_starts_with_accelerations_that_obey_the_equations(bearings):
    engine, body = six()
    simulation = at_speed(SPEED, engine, body, Settings(bearings=bearings))
    plain, state = PlainModel(engine, body, simulation.settings, SPEED), simulation.state
    q, v, a = entry.motion(simulation, state)
    y = np.concatenate([q, v, state[[layout.LEAD_ANGLE, layout.LEAD_SPEED]]])
    expected = plain.acceleration(0.0, y, state[layout.SHAFT_ANGLE])
    # The start lets films relax for 30 us with the frame's turning frozen; that is what is left.
    assert np.linalg.norm(a - expected) < 2e-3 * np.linalg.norm(expected)


def test_standstill_and_a_start_from_it():
    simulation = started()
    simulation.inputs[0] = 0.0
    simulation.initialize()
    for k in range(1, 50):
        simulation.step(k * 1e-4)
    assert np.isfinite(simulation.state).all()
    for k in range(50, 200):
        simulation.inputs[0] = (k - 50) * 0.2
        simulation.step(k * 1e-4)
    assert np.isfinite(simulation.outputs).all()
    assert simulation.outputs[simulation.output_names.index("crank.speed")] > 1.0


def test_inputs_given_as_a_whole_are_copied_into_place():
    """Kernels are handed one array for good: another in its place, of whole numbers even, would not be seen."""
    simulation = started()
    place = simulation.inputs
    simulation.inputs = np.arange(place.size)
    assert simulation.inputs is place and place.dtype == float and place[3] == 3.0
