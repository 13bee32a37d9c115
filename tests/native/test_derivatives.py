"""Derivatives of outputs: by time from the last communication points, by inputs from the step that led here."""

import math
from ctypes import byref, c_size_t, c_uint
from itertools import pairwise

import numpy as np
import pytest
from mock_unit import REFERENCE
from raw_unit import DISCARD, ERROR, OK, summed

V = REFERENCE
OUTPUTS = [V[name] for name in ("position", "velocity", "energy")]
MASS, STIFFNESS, FORCE = 2.0, 100.0, 10.0
ROUNDING = 1e-11
"""Of an energy of 8 J over a move of a thousandth of the force, with some room."""


def solution(time, force=FORCE, damping=0.5 + 0.01 * 100.0):
    """Position, velocity and acceleration of the mock's mass on its soft spring, released off its rest."""
    decay = damping / (2.0 * MASS)
    omega = math.sqrt(STIFFNESS / MASS - decay**2)
    rest, away = force / STIFFNESS, 0.1 * force / STIFFNESS
    envelope = away * np.exp(-decay * time)
    x = rest + envelope * (np.cos(omega * time) + decay / omega * np.sin(omega * time))
    v = -envelope * (omega + decay**2 / omega) * np.sin(omega * time)
    return x, v, (force - damping * v - STIFFNESS * x) / MASS


def fine(unit, **options):
    """An instance whose own steps are 2.5 µs: it differs from the solution by less than the differences do."""
    one = unit(**options)
    one.set("String", {V["solver.method"]: "fine"})
    one.set("Integer", {V["repeats"]: 10})
    return one


def slope(unit, times):
    """Derivative of the position at the last of these communication points."""
    one = fine(unit).start()
    for begin, end in pairwise(times):
        assert one.step(begin, end - begin) == OK
    return one.output_rates(V["position"])[0]


@pytest.mark.parametrize("unequal", [0.0, 0.4])
def test_output_derivatives_are_of_second_order(unit, unequal):
    """Halving the communication steps quarters the error, also of steps that differ from each other."""
    errors = []
    for step in (0.04, 0.02, 0.01):
        times = 0.12 - step * np.array([2.0 + unequal, 1.0, 0.0])
        errors.append(abs(slope(unit, [0.0, *times]) - solution(0.12)[1]))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[-1] < 1e-3 * abs(solution(0.12)[1]) * 10.0
    assert np.all(np.abs(orders - 2.0) < 0.2), (errors, orders)


def test_before_there_are_three_points_the_order_is_lower(unit):
    """Zero at the start, a plain difference after one step, then a parabola through three points."""
    one = unit().start()
    x = [one.one("Real", V["position"])]
    assert one.output_rates(*OUTPUTS) == [0.0, 0.0, 0.0]
    h = 1e-2
    for k in range(3):
        one.run(1, first=k, step=h)
        x.append(one.one("Real", V["position"]))
        parabola = (1.5 * x[-1] - 2.0 * x[-2] + 0.5 * x[-3]) / h if k > 0 else (x[1] - x[0]) / h
        assert one.output_rates(V["position"])[0] == pytest.approx(parabola, rel=1e-9)


def test_outputs_that_nobody_has_read_have_derivatives_at_once(unit):
    one, other = unit().start().run(5), unit().start()
    other.get("Real", *OUTPUTS)
    assert one.output_rates(*OUTPUTS) == other.run(5).output_rates(*OUTPUTS)


def test_derivatives_that_cannot_be_are_refused(unit):
    one = unit().start().run(3)
    call = "GetRealOutputDerivatives"
    assert "'force' is no output" in one.refused(call, *one.rates("Get", {V["force"]: 0.0}))
    assert "order 0" in one.refused(call, *one.rates("Get", {V["position"]: 0.0}, order=0))
    assert "order 2" in one.refused(call, *one.rates("Get", {V["position"]: 0.0}, order=2))
    assert "no Real" in one.refused(call, *one.rates("Get", {V["observed"]: 0.0}))


def test_a_step_that_fails_leaves_derivatives_as_they_were(unit):
    one = unit().start().run(3)
    before = one.output_rates(*OUTPUTS), one.directional(OUTPUTS, {V["force"]: 1.0})
    one.set("Real", {V["force"]: 2000.0})
    assert one.step(3e-4) == DISCARD
    assert (one.output_rates(*OUTPUTS), one.directional(OUTPUTS, {V["force"]: 1.0})) == before


def test_slivers_of_time_are_no_communication_points(unit):
    one, plain = unit().start().run(5), unit().start().run(5)
    assert one.step(5e-4 - 1e-10, 1e-11) == OK  # the master lags: nothing is left of the step
    assert one.output_rates(*OUTPUTS) == plain.output_rates(*OUTPUTS)
    assert one.directional(OUTPUTS, {V["force"]: 1.0}) == plain.directional(OUTPUTS, {V["force"]: 1.0})


def test_by_the_force_over_a_step_it_is_the_analytic_solution(unit):
    """A force that acts for a while moves a mass on a spring by a step response, which is known in closed form."""
    step = 0.02
    one = fine(unit).start().run(3, step=step)
    decay = 1.5 / (2.0 * MASS)
    omega = math.sqrt(STIFFNESS / MASS - decay**2)
    falling = math.exp(-decay * step)
    x = (1.0 - falling * (math.cos(omega * step) + decay / omega * math.sin(omega * step))) / STIFFNESS
    v = falling * math.sin(omega * step) / (MASS * omega)
    found = one.directional(OUTPUTS, {V["force"]: 1.0})
    velocity = one.one("Real", V["velocity"])
    assert found == pytest.approx([x, v, MASS * velocity * v], rel=1e-3)


def test_before_the_first_step_it_is_the_start_that_moves(unit):
    """The spring is drawn to 1.1 times the rest under the force; the speed makes friction alone."""
    one = unit().start()
    assert one.directional(OUTPUTS, {V["force"]: 2.0}) == pytest.approx([0.022, 0.0, 0.0], rel=1e-9)
    assert one.directional(OUTPUTS, {V["speed"]: 1.0}) == [0.0, 0.0, 0.0]
    reading = unit().setup()
    reading.must("EnterInitializationMode")
    assert reading.directional(OUTPUTS, {V["force"]: 2.0}) == pytest.approx([0.022, 0.0, 0.0], rel=1e-9)
    assert reading.must("ExitInitializationMode").get("Real", *OUTPUTS) == unit().start().get("Real", *OUTPUTS)


def independent(one, state, unknowns, changes, move, first):
    """A central difference by states: the step is done again from a state with other inputs."""
    sides = []
    before = dict(zip(changes, one.get("Real", *changes), strict=True))
    for sign in (-1.0, 1.0):
        one.must("SetFMUstate", state)
        one.set("Real", {k: before[k] + sign * move * changes[k] for k in changes})
        one.run(1, first=first)
        sides.append(np.array(one.get("Real", *unknowns)))
    return (sides[1] - sides[0]) / (2.0 * move)


@pytest.mark.parametrize("levels", [{}, {"spring.level": "stiff"}, {"mount.level": "free"}])
def test_it_is_what_states_and_other_inputs_show(unit, levels):
    one = unit()
    one.set("String", {V[name]: text for name, text in levels.items()})
    one.start().run(10)
    state = one.state()
    one.run(1, first=10)
    changes = {V["force"]: 3.0, V["speed"]: -2.0}
    found = one.directional(OUTPUTS, changes)
    expected = independent(one, state, OUTPUTS, changes, 1e-2, 10)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=ROUNDING)
    assert np.all(expected != 0.0)


def test_several_inputs_add_up_to_one_direction(unit):
    one = unit().start().run(10)
    single = one.directional(OUTPUTS, {V["force"]: 1.0})
    assert one.directional(OUTPUTS, {V["force"]: -2.5, V["speed"]: 100.0}) == pytest.approx(
        [-2.5 * value for value in single], rel=1e-6, abs=ROUNDING
    )
    assert one.directional(OUTPUTS, {V["force"]: 0.0, V["speed"]: 0.0}) == [0.0, 0.0, 0.0]
    assert one.directional(OUTPUTS, {}) == [0.0, 0.0, 0.0]


def test_what_was_set_after_the_step_does_not_count(unit):
    """The inputs that led here are moved, not those of the step to come."""
    one, other = unit().start().run(10), unit().start().run(10)
    other.set("Real", {V["force"]: 77.0})
    assert one.directional(OUTPUTS, {V["force"]: 1.0}) == other.directional(OUTPUTS, {V["force"]: 1.0})


def test_at_a_bound_the_difference_is_taken_on_one_side(unit):
    """At the start a force of 500 N is the most that has an equilibrium; a speed of 0 the least that may be."""
    one = unit()
    one.set("Real", {V["force"]: 500.0, V["speed"]: 0.0})
    one.start()
    assert one.directional(OUTPUTS[:1], {V["force"]: 1.0}) == pytest.approx([0.011], rel=1e-9)
    assert one.directional(OUTPUTS[:1], {V["speed"]: 1.0}) == [0.0]
    assert one.log == []


def test_where_no_side_has_a_solution_there_is_no_derivative(unit):
    one = unit()
    one.set("Real", {V["force"]: 500.0, V["speed"]: 0.0})
    one.start()
    both = one.values("Real", {V["force"]: 1.0, V["speed"]: 1.0})
    outputs, n, results = one.values("Real", {V["position"]: 7.0})
    assert one.call("GetDirectionalDerivative", outputs, n, *both, results) == DISCARD
    assert "no directional derivative at 0 s: no static equilibrium; push less" in one.log[-1][2]
    assert list(results) == [7.0]


def test_directions_that_cannot_be_are_refused(unit):
    one = unit().start().run(3)
    call = "GetDirectionalDerivative"

    def words(unknown, known, change=1.0):
        outputs, n, results = one.values("Real", {unknown: 7.0})
        text = one.refused(call, outputs, n, *one.values("Real", {known: change}), results)
        assert list(results) == [7.0]
        return text

    assert "'force' is no output; only outputs" in words(V["force"], V["force"])
    assert "'damping' is no input; outputs have derivatives by inputs only" in words(V["position"], V["damping"])
    assert "'position' is no input" in words(V["position"], V["position"])
    assert "the change of 'force' is inf" in words(V["position"], V["force"], math.inf)
    outputs = (c_uint * 1)(V["observed"])
    force = one.values("Real", {V["force"]: 1.0})
    assert "no Real" in one.refused(call, outputs, c_size_t(1), *force, force[2])


def asked(one):
    """All derivatives that there are."""
    rates = one.output_rates(*OUTPUTS)
    return rates, one.directional(OUTPUTS, {V["force"]: 1.0, V["speed"]: 1.0})


@pytest.mark.parametrize("levels", [{}, {"spring.level": "stiff"}, {"mount.level": "free"}])
def test_a_run_with_derivatives_is_a_run_without_to_the_bit(unit, levels):
    plain, curious = unit(), unit()
    for one in (plain, curious):
        one.set("String", {V[name]: text for name, text in levels.items()})
    curious.setup().must("EnterInitializationMode")
    curious.directional(OUTPUTS, {V["force"]: 1.0})
    curious.must("ExitInitializationMode")
    plain.start()
    for k in range(12):
        for one in (plain, curious):
            one.set("Real", {V["force"]: 10.0 + k})
        asked(curious)
        for one in (plain, curious):
            one.must("SetRealInputDerivatives", *one.rates("Set", {V["force"]: 1e3 * k}))
            one.run(1, first=k)
        before = curious.get("Real", *OUTPUTS)
        asked(curious)
        assert before == curious.get("Real", *OUTPUTS) == plain.get("Real", *OUTPUTS)
    assert plain.serialized(plain.state()) == curious.serialized(curious.state())


def test_a_state_brings_its_derivatives(unit):
    """In the instance and in another one; and its outputs, though inputs were set after the step."""
    for steps in range(5):
        one = unit().start().run(steps)
        one.set("Real", {V["force"]: 30.0})
        state = one.state()
        data, expected = one.serialized(state), asked(one)
        one.run(4, first=steps).must("SetFMUstate", state)
        assert asked(one) == expected
        other = unit().start().run(2)
        status, state = other.deserialize(data)
        assert status == OK
        assert asked(other.must("SetFMUstate", state)) == expected


def test_the_number_of_past_points_in_a_state_is_checked(unit):
    one = unit().start().run(4)
    words = np.frombuffer(one.serialized(one.state()), dtype="<u4").copy()
    past = np.flatnonzero((words[:-1] == 2) & (words[1:] == 1))[0]  # how many, and which was the last
    for place in (past, past + 1):
        changed = words.copy()
        changed[place] = 3
        status, state = one.deserialize(summed(changed.view("<u8")))
        assert status == ERROR and not state and "damaged" in one.log[-1][2]
    one.must("FreeFMUstate", byref(one.state()))
