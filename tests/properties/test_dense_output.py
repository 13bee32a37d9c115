"""Internal steps that pass over communication points: same steps, interpolated motion, states, inputs that change."""

import math
from dataclasses import replace
from functools import cache

import entry
import numpy as np
import pytest
from bodies import free_six, rigid_crank
from one_line import one_line
from started import at_speed

from cranktrain.core.errors import SolverError
from cranktrain.dynamics.model import state as layout
from cranktrain.dynamics.simulation import Settings
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import assemble

SPEED = 2000 * math.pi / 30
STEP = math.radians(2.5)
H = STEP / SPEED
COUNTS = "solver.substeps", "solver.iterations", "solver.residual", "crank.angle_next"
"""Outputs that tell of the communication step, not of the motion."""


def started(speed=SPEED, **settings):
    engine = free_six()
    return at_speed(speed, engine, rigid_crank(engine), Settings(**{"crank": "rigid", "step": STEP, **settings}))


@cache
def parts(name):
    """An engine with a crank of beams on its films."""
    engine = load_engine(name)
    return assemble(engine, Settings(crank="beam", bearings="impedance", block="ground"), inherit=False)


def bending(name, speed, **settings):
    made = parts(name)
    return at_speed(speed, made.engine, made.body, replace(made.settings, **settings), parts=made.parts)


def moving(simulation):
    """Places of the outputs that tell of the motion."""
    return [k for k, name in enumerate(simulation.output_names) if name not in COUNTS]


def rows(simulation, count, points=1, h=H):
    """Outputs at ``count`` communication points, ``points`` to an internal step."""
    found, first = [], round(simulation.time / h * points)
    for k in range(first + 1, first + count + 1):
        whole, rest = divmod(k, points)
        simulation.step(whole * h if rest == 0 else k * (h / points))
        found.append(simulation.outputs[moving(simulation)])
    return np.array(found)


METHODS = [{"integrator": name} for name in ("esdirk4", "esdirk47", "sdirk3", "bdf2", "generalised-alpha")]
OTHERS = [{"control": "adaptive", "tolerance": 1e-4}, {"bearings": "linear", "boundary": "torque"}]


@pytest.mark.parametrize("settings", METHODS + OTHERS, ids=str)
def test_steps_are_those_of_a_run_that_communicates_there_only(settings):
    coarse, fine = started(**settings), started(**settings)
    expected, found = rows(coarse, 200), rows(fine, 800, points=4)[3::4]
    if settings.get("boundary") != "torque":  # there the step keeps its length, and a coarse run halves it above
        assert np.array_equal(found, expected)
        assert entry.count(fine, "steps") == entry.count(coarse, "steps")
    else:
        assert np.abs(found - expected).max() < 1e-3 * np.abs(expected).max()
        assert entry.count(fine, "steps") < 1.1 * entry.count(coarse, "steps")


def test_without_dense_output_every_point_is_stepped():
    fine = started(dense_output="off")
    rows(fine, 40, points=4)
    assert entry.count(fine, "steps") >= 40
    assert fine.state[layout.UNDER_WAY] == 0.0
    with one_line("dense output 'maybe' does not exist"):
        started(dense_output="maybe")


def test_a_communication_step_little_shorter_than_the_step_is_stepped():
    """It saves nothing to pass over it; ``simulate`` divides a cycle evenly by such steps."""
    simulation = started()
    for k in range(1, 30):
        simulation.step(k * 0.95 * H)
        assert simulation.state[layout.UNDER_WAY] == 0.0 and simulation.state[layout.SUBSTEPS] >= 1.0


@pytest.mark.parametrize("integrator", ["sdirk3", "esdirk4"])
def test_interpolation_keeps_the_order(integrator):
    """Inertia forces of an engine without gas are smooth: at points of no step the error falls as the method says."""

    def outputs(halvings, dense):
        settings = {"bearings": "linear", "gas_source": "input", "integrator": integrator, "newton_tolerance": 1e-12}
        simulation = started(**settings, step=math.radians(1.0) / 2**halvings, dense_output=dense)
        names = "bearing[3].velocity.x", "bearing[3].force.y", "bearing[5].position.x"
        places = [simulation.output_names.index(name) for name in names]
        found = []
        for k in range(1, 601):
            simulation.step(k * math.radians(0.113) / SPEED)
            found.append(simulation.outputs[places])
        return np.array(found)[300:]

    exact = outputs(6, "off")
    errors = [np.abs(outputs(halvings, "on") - exact).max(axis=0) for halvings in (0, 1, 2)]
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    order = int(integrator[-1])
    assert rates[-1].min() > order - 0.35, rates


@pytest.mark.parametrize(
    ("name", "rpm"), [("diesel_i6", 2000), ("single_petrol", 3000), ("four_petrol", 1500)], ids=lambda value: str(value)
)
def test_between_steps_errors_are_those_at_steps(name, rpm):
    """Firing edges and films that close included, against a run of ten times the steps."""
    speed, points = rpm * math.pi / 30, 5
    h = STEP / speed
    fine = rows(bending(name, speed, step=STEP / 10, dense_output="off"), 288 * points, points, h)
    dense = bending(name, speed, step=STEP)
    found = rows(dense, 288 * points, points, h)
    assert entry.count(dense, "steps") < 1.05 * 288
    names = [dense.output_names[k] for k in moving(dense)]
    step = np.arange(len(found)) % points == points - 1
    span = np.ptp(fine, axis=0)
    for part in ("pulley.torsion", "flywheel.torsion", "shaft.torque", "].position.", "].force.", "film_thickness_min"):
        own = [k for k, name in enumerate(names) if part in name and span[k] > 0.0]
        off = (found - fine)[288:, own] / np.array([span[k] for k in own])
        there, between = (np.sqrt((off[chosen[288:]] ** 2).mean()) for chosen in (step, ~step))
        # Forces follow from the velocities of films, which bend most where a journal leaves the wall.
        assert between < (3.5 if part == "].force." else 1.3) * there + 1e-6, (part, there, between)


def test_a_joint_that_slides_is_interpolated_with_its_memory():
    """The teeth of the spline keep their deflection and its rate in the state."""
    points, speed = 5, SPEED
    fine = bending("diesel_i6", speed, step=STEP / 10, dense_output="off")
    dense = bending("diesel_i6", speed, step=STEP)
    place = moving(dense).index(dense.output_names.index("axial_path.force"))
    exact, found = (rows(one, 288 * points, points)[720:, place] for one in (fine, dense))
    assert np.ptp(exact) > 10.0
    assert np.abs(found - exact).max() < 0.01 * np.ptp(exact)


def test_time_and_angle_never_part():
    """Points whose distances no step divides, and longer ones among them, over some revolutions."""
    simulation, time = started(), 0.0
    begun = simulation.state[layout.SHAFT_ANGLE]
    for k in range(2000):
        time += (0.171, 0.0313, 1.7, 0.3, 5.2, 0.999)[k % 6] * H
        simulation.step(time)
        assert simulation.time == time
    assert simulation.state[layout.SHAFT_ANGLE] - begun == pytest.approx(SPEED * time, rel=1e-9)


@pytest.mark.parametrize("settings", [{}, OTHERS[0]], ids=str)
def test_a_state_between_steps_goes_on_to_the_bit(settings):
    simulation = started(**settings)
    rows(simulation, 42, points=4)
    assert simulation.state[layout.UNDER_WAY] == 1.0
    kept, shown = simulation.state, simulation.outputs.copy()
    expected = rows(simulation, 30, points=4)
    simulation.state = kept
    assert np.array_equal(simulation.outputs, shown)
    assert np.array_equal(rows(simulation, 30, points=4), expected)
    other = started(**settings)
    other.state = kept
    assert np.array_equal(other.outputs, shown)
    assert np.array_equal(rows(other, 30, points=4), expected)


@pytest.mark.parametrize("end", [-1e9, 1e9, math.inf])
@pytest.mark.parametrize("place", [layout.STEP_BEGIN, layout.STEP_END])
def test_an_altered_state_does_not_step_from_long_ago(place, end):
    """A step under way that does not hold the present time is given up, not gone on with from its end."""
    simulation = started()
    rows(simulation, 4, points=3)
    state = simulation.state
    assert state[layout.UNDER_WAY] == 1.0
    state[place] = end
    simulation.state = state
    before = entry.count(simulation, "steps")
    simulation.step(simulation.time + H / 3)
    assert entry.count(simulation, "steps") - before <= 2


def test_an_input_that_changes_ends_the_step_where_it_changes():
    """As a run that never went beyond; from there on every point is stepped until inputs stay again."""
    held = {"reconstruction": "hold"}
    fine, plain = started(**held), started(**held, dense_output="off")
    rows(fine, 4 * 30 + 1, points=4)
    rows(plain, 30)
    plain.step(fine.time)
    for one in (fine, plain):
        one.inputs[0] = 1.01 * SPEED
    begun = entry.count(fine, "steps")
    for one in (fine, plain):
        one.step(30.5 * H)
    np.testing.assert_allclose(fine.outputs[moving(fine)], plain.outputs[moving(plain)], rtol=1e-9, atol=1e-9)
    for k in range(3, 6):
        fine.step((30 + k / 4) * H)
    # The step taken again, the one of the change, and one that passes over the other points.
    assert entry.count(fine, "steps") == begun + 3


def test_inputs_that_change_at_every_point_are_stepped_as_before():
    fine, plain = started(gas_source="input"), started(gas_source="input", dense_output="off")
    for k in range(1, 200):
        for one in (fine, plain):
            one.pressures[:] = 1e5 * (4.0 + 3.0 * np.sin(0.01 * k + np.arange(6)))
            one.step(k * H / 4)
        assert np.array_equal(fine.outputs, plain.outputs)


@pytest.mark.parametrize("rates", [False, True])
def test_a_ramp_is_passed_over(rates):
    """The speed of a run-up goes on along the line of its samples, or of its rates."""
    rise = 300.0
    fine, plain = started(), started(step=STEP / 4, dense_output="off")
    for k in range(200):
        for one in (fine, plain):
            one.inputs[0] = SPEED + rise * k * H / 4
            one.input_rates[0] = rise if rates else math.nan
            one.step((k + 1) * H / 4)
    assert entry.count(fine, "steps") < 75
    there = [fine.output_names.index(name) for name in ("crank.angle", "crank.speed", "flywheel.torsion")]
    np.testing.assert_allclose(fine.outputs[there], plain.outputs[there], rtol=2e-4)


def test_pressures_that_are_given_for_the_first_time_end_the_trace_at_once():
    """Source ``auto``: the built-in trace until a partner drives the pressures, whatever step is under way."""
    fine, plain = started(integrator="esdirk4"), started(integrator="esdirk4", dense_output="off")
    for k in range(1, 9):
        for one in (fine, plain):
            if k > 5:
                one.pressures[:] = 30e5
            one.step(k * H / 4)
    torque = fine.output_names.index("torque.indicated")
    assert fine.outputs[torque] == pytest.approx(plain.outputs[torque], rel=5e-3)


def test_a_stall_is_told_where_a_run_of_every_point_tells_it():
    found = []
    for dense in ("on", "off"):
        simulation = started(speed=40.0, bearings="linear", boundary="torque", gas_source="input", dense_output=dense)
        simulation.load_torque = 4000.0
        with one_line("stalls the engine at t = ", kind=SolverError):
            for k in range(1, 100_000):
                simulation.step(k * 1e-4)
        before = simulation.state
        with one_line("stalls", kind=SolverError):
            simulation.step(simulation.time + 1e-4)
        assert np.array_equal(simulation.state, before)
        found.append(simulation.time)
    assert found[0] == pytest.approx(found[1], abs=8e-4)


def test_inputs_that_are_no_numbers_are_refused_between_steps():
    simulation = started()
    rows(simulation, 42, points=4)
    kept, simulation.inputs[0] = simulation.state, math.nan
    with one_line("speed"):
        simulation.step(simulation.time + H / 4)
    assert np.array_equal(simulation.state, kept)


def test_temperatures_may_change_between_steps():
    """The step that was under way ends where the oil changes."""
    found = []
    for points in (4, 1):
        simulation = started(bearings="impedance")
        rows(simulation, 42, points=4) if points == 4 else (rows(simulation, 10), simulation.step(10.5 * H))
        simulation.film_temperatures = simulation.film_temperatures + 20.0
        assert simulation.state[layout.UNDER_WAY] == 0.0
        simulation.step(12.5 * H)
        found.append(simulation.outputs[moving(simulation)])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-6, atol=1e-6)
