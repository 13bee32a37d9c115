"""Derivatives of the modules' outputs: their order, a difference by FMU states, and runs that they leave alone."""

import math

import numpy as np
import pytest
import real_unit
from real_unit import STEP

MOVE = 1e-4
"""Of an input's size, as the shim moves it: the same difference then, but by calls that any master can make."""


@pytest.mark.parametrize("steps", [0, 30])
def test_by_inputs_it_is_what_states_and_other_inputs_show(real, steps):
    """Of every input, over a step in which cranks turn, valves move and charges burn, or at the start."""
    outputs = real.outputs()
    one = real.fresh(start=False)
    one.setup().must("EnterInitializationMode")
    if steps:
        one.must("ExitInitializationMode").run(steps - 1, step=STEP)
    state = one.state()
    before = {v.valueReference: one.one("Real", v.valueReference) for v in real.inputs()}
    if steps:
        one.run(1, first=steps - 1, step=STEP)
    done = one.state()
    moved = 0
    for variable in real.inputs():
        place, move = variable.valueReference, MOVE * (float(variable.nominal or 0) or float(variable.start) or 1.0)
        least, most = (-math.inf if variable.min is None else float(variable.min)), float(variable.max or math.inf)
        if not least <= before[place] - abs(move) <= before[place] + abs(move) <= most:
            continue  # there it is a difference on one side
        found = np.array(one.directional(outputs, {place: 1.0}))
        sides = []
        for sign in (-1.0, 1.0):
            one.must("SetFMUstate", state)
            one.set("Real", {place: before[place] + sign * abs(move)})
            if steps:
                one.run(1, first=steps - 1, step=STEP)
            sides.append(np.array(one.get("Real", *outputs)))
        one.must("SetFMUstate", done)
        expected = (sides[1] - sides[0]) / (2.0 * abs(move))
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())
        moved += np.any(expected != 0.0)
    assert moved > 0


@pytest.fixture(scope="module")
def rigid(tmp_path_factory):
    """The six's native FMU with a rigid crank alone."""
    return real_unit.opened(real_unit.engine_fmu(tmp_path_factory.mktemp("rigid"), cranks=("rigid",)))


def turning(unit, steps, **texts):
    """An instance of the rigid six on its films, after some steps."""
    one = unit.fresh(start=False)
    one.set("String", {unit.references["crank.level"]: "rigid"} | {unit.references[k]: v for k, v in texts.items()})
    return one.start().run(steps, step=STEP)


@pytest.mark.parametrize("control", ["fixed", "adaptive"])
@pytest.mark.parametrize(("dense", "close"), [("off", 1e-4), ("on", 3e-4)])
def test_a_cranktrain_s_by_inputs_are_what_states_and_other_inputs_show(rigid, control, dense, close):
    # By this integrator Newton's iteration leaves little: what it leaves is in the difference, over the move.
    texts = {
        "solver.control": control, "gas.source": "input", "solver.dense_output": dense, "solver.integrator": "esdirk4",
    }  # fmt: skip
    outputs = rigid.outputs()
    one = turning(rigid, 29, **texts)
    state = one.state()
    one.run(1, first=29, step=STEP)
    done = one.state()
    for name, size in (("speed", 1e2), ("cylinder[3].pressure", 1e6), ("valvetrain.torque", 1e2)):
        place, sides = rigid.references[name], []
        move, held = MOVE * size, one.one("Real", place)
        found = np.array(one.directional(outputs, {place: 1.0}))
        for sign in (-1.0, 1.0):
            one.must("SetFMUstate", state).set("Real", {place: held + sign * move}).run(1, first=29, step=STEP)
            sides.append(np.array(one.get("Real", *outputs)))
        one.must("SetFMUstate", done)
        expected = (sides[1] - sides[0]) / (2.0 * move)
        assert np.any(expected != 0.0)
        # The shim's move is as large or not: what both leave is the solvers' tolerance over it, of two solutions where
        # the step that is under way ends at the move.
        seen = np.abs(expected) > 1e-3 * np.abs(expected).max()
        np.testing.assert_allclose(found[seen], expected[seen], rtol=close)


def test_a_derivative_at_a_bound_is_that_of_both_sides(rigid):
    """One-sided where the input can go nowhere else; interpolated outputs do not stand beside stepped ones."""
    outputs = [rigid.references[name] for name in ("crank.speed", "big_end[2].force.y", "piston[2].side_force")]
    place = rigid.references["cylinder[2].pressure"]
    found = []
    for pressure in (0.0, 50.0):  # Pa; the move is larger than the second one, too
        one = turning(rigid, 0, **{"gas.source": "input"})
        one.set("Real", {place: pressure}).run(30, step=STEP)
        assert one.one("Real", rigid.references["solver.substeps"]) == 0.0
        found.append(one.directional(outputs, {place: 1.0}))
    one = turning(rigid, 0, **{"gas.source": "input", "solver.dense_output": "off"})
    one.set("Real", {place: 0.0}).run(30, step=STEP)
    assert one.directional(outputs, {place: 1.0}) == pytest.approx(found[0], rel=0.05)
    assert found[1] == pytest.approx(found[0], rel=1e-3)


def test_a_sliver_of_time_is_no_step_that_led_here(rigid):
    """A master's rounding ends in a step that changes nothing: inputs set for it are not those of the last step."""
    pressure, outputs = rigid.references["cylinder[1].pressure"], rigid.outputs()
    one = turning(rigid, 20, **{"gas.source": "input"})
    before, rates = one.directional(outputs, {pressure: 1.0}), one.output_rates(*outputs)
    values, held = one.get("Real", *outputs), one.one("Real", pressure)
    one.set("Real", {pressure: 9e6})
    assert one.step(20 * STEP, 5e-10) == 0
    assert one.get("Real", *outputs) == values
    assert one.directional(outputs, {pressure: 1.0}) == before and one.output_rates(*outputs) == rates
    one.set("Real", {pressure: held}).run(5, first=20, step=STEP)
    assert one.get("Real", *outputs) == turning(rigid, 25, **{"gas.source": "input"}).get("Real", *outputs)
