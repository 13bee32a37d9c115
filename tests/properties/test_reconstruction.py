"""Inputs between communication points: exact where their rule is, bounded at jumps, blind to slivers of time."""

import importlib.util
import math
from dataclasses import replace
from functools import cache
from typing import NamedTuple
from unittest.mock import Mock

import bodies
import entry
import numpy as np
import pytest
from numba import njit
from some import some

import cranktrain as ct
from cranktrain.core import build_mark as marks
from cranktrain.core.errors import InputError
from cranktrain.dynamics.model import state as layout
from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.dynamics.time.reconstruction import POLYTROPIC, SLIVER, reconstruct, take_sample
from cranktrain.engine.file import load_engine
from cranktrain.loads.cylinder_volume import cylinder_volume
from cranktrain.loads.gas_pressure import CYCLE, gas_pressure

SPEED = 200.0
TURN = math.radians(4.0)
H = TURN / SPEED


@cache
def rigid(name="diesel_i6"):
    return bodies.started(SPEED, load_engine(name), bearings="linear", gas_source="input")


class Inputs:
    """The reconstruction by itself: samples at crank angles, and the pressures that it makes of them."""

    def __init__(self, delay=0.0):
        simulation = rigid()
        assert simulation.settings.reconstruction == "polytropic"
        self.model, self.work = entry.delayed(simulation.model, delay), simulation.work
        self.state = simulation.state
        self.inputs = simulation.inputs.copy()
        self.count = simulation.engine.n_cylinders
        take_sample(self.model, self.state, self.inputs, 0.0)
        self.lead = self.state[layout.POINT_ANGLE] - self.state[layout.SHAFT_ANGLE]

    def sample(self, angle, pressures, interval=H):
        """A communication point at a crank angle, from which a step of ``interval`` begins."""
        self.state[layout.SHAFT_ANGLE] = angle - self.lead
        self.inputs[1 : 1 + self.count] = pressures
        take_sample(self.model, self.state, self.inputs, interval)
        reconstruct(self.model, self.work, self.state)

    def pressures(self, angle, elapsed=0.0):
        return np.array([entry.given_pressure(self.model, self.work, c, angle, elapsed) for c in range(self.count)])

    def volumes(self, angle):
        return np.array([entry.gas_volume(self.model, c, angle) for c in range(self.count)])


@pytest.mark.parametrize("name", ["diesel_i6", "diesel_v8"])
def test_the_gas_has_the_volume_of_the_engine_file(name):
    simulation = rigid(name)
    engine = simulation.engine
    for angle in np.linspace(-1.0, 13.0, 9):
        for c in some(range(engine.n_cylinders)):
            expected = cylinder_volume(engine, np.array([angle - engine.firing_angles[c]]))[0][0]
            assert entry.gas_volume(simulation.model, c, angle) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("delay", [0.0, 0.5, 1.0, 2.0])
def test_a_parabola_of_p_v_to_the_n_is_met_exactly_where_the_delay_is_told(delay):
    inputs = Inputs(delay)

    def exact(angle):
        return (50.0 + 8.0 * angle + 30.0 * angle**2) / inputs.volumes(angle) ** POLYTROPIC

    # Uneven communication steps; a sample belongs to an angle so many steps before.
    points = np.cumsum([0.1, 0.07, 0.05, 0.06, 0.07, 0.05])
    for k, angle in enumerate(points):
        before = points[max(k - 1, 0)]
        inputs.sample(angle, exact(angle - delay * (angle - before)))
    for angle in some(points[-1] + np.array([0.0, 0.03, 0.07])):
        np.testing.assert_allclose(inputs.pressures(angle), exact(angle), rtol=1e-9)
    if delay > 0.0:
        untold = Inputs()
        for k, angle in enumerate(points):
            untold.sample(angle, exact(angle - delay * (angle - points[max(k - 1, 0)])))
        assert np.abs(untold.pressures(points[-1]) / exact(points[-1]) - 1.0).max() > 0.01


def test_one_sample_is_held_and_none_is_negative():
    inputs = Inputs()
    inputs.sample(0.3, 2e5)
    assert np.array_equal(inputs.pressures(0.3 + TURN, H), np.full(inputs.count, 2e5))
    for k, falling in enumerate((50.0, 45.0, 30.0)):
        angle = 0.3 + k * TURN
        inputs.sample(angle, falling / inputs.volumes(angle) ** POLYTROPIC)
    assert np.array_equal(inputs.pressures(0.3 + 5.0 * TURN, 3.0 * H), np.zeros(inputs.count))


def test_no_line_is_drawn_across_a_jump():
    """Right after it the pressure is held, then extrapolated from what came since."""
    inputs = Inputs()
    for k, pressure in enumerate((1e5, 1e5, 1e5, 50e5, 51e5)):
        inputs.sample(k * TURN, pressure)
        if k == 3:
            assert np.array_equal(inputs.pressures((k + 1) * TURN, H), np.full(inputs.count, 50e5))
    # A line through the two samples since: a parabola through the last three would leave by tens of bars.
    assert np.abs(inputs.pressures(5 * TURN, H) / 52e5 - 1.0).max() < 0.1


def test_pressures_that_nobody_drives_do_no_work():
    """∮ p dV of a pressure that stays as it is: nothing, at every communication step between samples too."""
    inputs = Inputs()
    work, between = np.zeros(inputs.count), TURN / 8
    for k in range(round(CYCLE / TURN)):
        inputs.sample(k * TURN, 7e5)
        for i in range(8):
            angle = k * TURN + i * between
            change = inputs.volumes(angle + between) - inputs.volumes(angle)
            work += inputs.pressures(angle + 0.5 * between, 0.5 * H / 8) * change
    assert np.abs(work).max() < 1e-9 * 7e5 * inputs.volumes(math.pi).max()


@pytest.mark.parametrize("gap", [1.1e-9, 1e-7, 1e-5])
def test_samples_close_together_are_one(gap):
    """An event, sampled before and after: what changed in it has no rate."""
    inputs = Inputs()
    for k in range(3):
        inputs.sample(k * TURN, 3e5, H if k < 2 else gap)
    inputs.sample(2 * TURN + SPEED * gap, 3.3e5)
    assert np.abs(inputs.pressures(3 * TURN, H) / 3.3e5 - 1.0).max() < 0.5


def test_pressures_of_the_trace_come_to_the_same_as_the_trace_itself():
    """A cycle with given pressures against one with built-in gas: known, one step late and told so, late untold."""
    engine = load_engine("diesel_i6")
    made = ct.assemble(engine, Settings(crank="torsional", step=math.radians(1.5)))
    h = math.radians(1.5) / SPEED
    steps = round(CYCLE / (SPEED * h))

    def torsion(late=None, delay=0.0):
        simulation = Simulation(engine, made.body, replace(made.settings, gas_delay=delay), parts=made.parts)
        simulation.inputs[0] = SPEED
        simulation.initialize()
        motored, rise = simulation.model.gas
        share = engine.combustion.falloff * (SPEED / engine.combustion.best_speed - 1.0) ** 2
        place = simulation.output_names.index("pulley.torsion")
        angles, rows = [simulation.outputs[0]] * 2, []
        for k in range(steps):
            if late is not None:
                after = angles[-1 - late] - np.array(engine.firing_angles)
                gas = [gas_pressure(a, motored) + (1.0 - share) * gas_pressure(a, rise) for a in after]
                simulation.pressures[:] = gas
            simulation.step((k + 1) * h)
            angles.append(simulation.outputs[0])
            rows.append(simulation.outputs[place])
        return np.array(rows)

    reference = torsion()
    swing = reference.std()

    def error(*order):
        return np.sqrt(np.mean((torsion(*order) - reference) ** 2)) / swing

    assert error(0) < 2e-3
    assert error(1, 1.0) < 1e-2
    assert error(1) > 0.1


def test_a_delay_out_of_range_is_refused():
    with pytest.raises(InputError, match="0 to 2 communication steps late, not 3"):
        started(gas_delay=3.0)


def started(**settings):
    return bodies.started(SPEED, load_engine("diesel_i6"), **settings)


@pytest.mark.parametrize("integrator", ["esdirk4", "generalised-alpha", "bdf2"])
def test_a_sliver_of_time_is_done_and_leaves_no_trace(integrator):
    simulation = started(integrator=integrator)
    place = simulation.output_names.index("bearing[3].force.y")
    plain = started(integrator=integrator)
    time = 0.0
    for k, sliver in enumerate((1e-18, 1e-15, 1e-12, 1e-10, 0.9 * SLIVER) * 4):
        plain.step((k + 1) * H)
        simulation.step((k + 1) * H)
        before, shown = simulation.state, simulation.outputs.copy()
        time = simulation.time + sliver
        if time > simulation.time:
            simulation.step(time)
        assert np.array_equal(simulation.state, before)
        assert np.array_equal(simulation.outputs, shown)
    assert simulation.outputs[place] == plain.outputs[place]


@pytest.mark.parametrize("source", ["builtin", "input"])
def test_short_steps_among_long_ones_change_nothing_that_matters(source):
    """Steps of 2e-9 s to 1e-5 s between usual ones: forces as without them."""
    runs = []
    for shorts in ((), (2e-9, 1e-8, 1e-7, 1e-6, 1e-5)):
        simulation = started(gas_source=source, step=np.radians(2.5))
        place = simulation.output_names.index("bearing[3].force.y")
        rows = []
        for k in range(120):
            phase = 8.0 * np.pi * (k * H + np.arange(6) / 6.0 * H)
            simulation.pressures[:] = entry.AMBIENT * (3.0 + np.sin(phase))
            if shorts:
                simulation.step(k * H + shorts[k % len(shorts)])
            simulation.step((k + 1) * H)
            rows.append(simulation.outputs[place])
        runs.append(np.array(rows))
    settled = np.array(runs)[:, 10:]  # behind the start, where a pressure jumps
    assert np.abs(settled[1] - settled[0]).max() < 1e-3 * np.abs(settled[0]).max()


def misses(name, marked):
    """How often a kernel of the package ``name`` is typed in Python while it is called ten times."""
    spec = importlib.util.spec_from_file_location(f"{name}.core.build_mark", marks.__file__)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)

    class Record(NamedTuple):
        values: np.ndarray
        build: np.ndarray

    first, mark = njit(lambda given: given.values[0]), module.build_mark() if marked else np.zeros(0)
    first._compile_for_args = Mock(wraps=first._compile_for_args)
    for _ in range(10):
        first(Record(np.ones(3), mark))
    return first._compile_for_args.call_count


def test_records_of_two_builds_are_told_apart():
    """Without the mark the second class of one layout is taken for the first, and typed at each call."""
    assert [misses("cranktrain_a", False), misses("cranktrain_b", False)] == [1, 10]
    assert [misses("cranktrain_a", True), misses("cranktrain_b", True)] == [1, 1]


def test_what_python_hands_to_each_step_bears_the_mark():
    simulation = rigid()
    for record in (simulation.model, simulation.work, simulation._observed):
        assert record.build.dtype == marks.build_mark().dtype
    assert marks.build_mark().dtype.names == ("cranktrain",)
