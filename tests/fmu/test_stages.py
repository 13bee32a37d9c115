"""Pressures at the stages of the integrator: a cranktrain of FMI 3.0 asks its master for them ahead of its step."""

import numpy as np
import pytest
from inside_a_step import COARSE_DEG, error, radians_per_second, step_of, system_of, torsion
from some import some

from cranktrain.dynamics.time.integrators import integrator_table
from cranktrain.dynamics.time.table import FIRST_STAGE, HEAD, NODE, STAGES
from cranktrain_lab.coupling.fmu3_unit import open_fmu
from cranktrain_lab.coupling.modules import CRANKTRAIN
from cranktrain_lab.coupling.run import Steps, run

CYCLES = 6
"""Until what the start leaves has faded below the errors in question."""


def coupled(engine, step_deg, rpm=2000.0, scheme="stages", **values):
    """Torsion of the pulley every 3 degrees, rad."""
    system = system_of(engine, scheme, step_deg, rpm, **values)
    return torsion(system, step_of(step_deg, rpm), CYCLES * step_of(720.0, rpm), step_of(3.0, rpm))


def within(engine, step_deg, exact, **chosen):
    """Error over the last cycle."""
    return error(coupled(engine, step_deg, **chosen), exact, 240)


@pytest.mark.parametrize("rpm", [2000.0, 800.0])
def test_torsion_at_coarse_steps_is_within_a_thousandth(calling, rpm):
    """Without reconstruction, against steps of 0.125 degrees; at low speed pressures rise as steeply as they do."""
    engine = calling.without_valves
    exact = coupled(engine, 0.125, rpm, "gauss-seidel")
    assert within(engine, COARSE_DEG, exact, rpm=rpm) < 1.0e-3


@pytest.mark.parametrize(
    ("calling", "rpm", "steps_deg"),
    [
        ("diesel_i6", 1800.0, [COARSE_DEG]),
        ("diesel_i6", 800.0, [COARSE_DEG]),
        ("diesel_v8", 1800.0, [COARSE_DEG, 3.0]),
        ("diesel_v8", 800.0, [COARSE_DEG]),
    ],
    indirect=["calling"],
)
def test_blows_of_a_valve_drive_that_rattles_have_their_impulse_and_its_moment(calling, rpm, steps_deg):
    """They are shorter than a step: torsion is within a thousandth all the same; at 3 degrees only with the moment."""
    exact = coupled(calling, 0.125, rpm, "gauss-seidel")
    for step_deg in some(steps_deg):
        assert within(calling, step_deg, exact, rpm=rpm) < 1.0e-3


def test_steps_that_an_error_controls_repeat_and_agree_with_equal_ones(calling_six):
    system, size, cycle = system_of(calling_six, "stages"), step_of(), step_of(720.0)
    master = system.master()
    try:
        master.initialize()
        found = run(master, cycle, Steps(size, 1.0e-3, 1e-2 * size, 2.0 * size), system.bonds)
    finally:
        master.close()
    assert found.refused > 0
    assert found.times[-1] == pytest.approx(cycle, rel=1e-12)


# ------------------------------------------------------------------ what the cranktrain asks for


def told(fmu, method, step_deg, count=2):
    """Calls of a cranktrain alone within ``count`` steps: its times, and whether it has got there."""
    speed = radians_per_second(2000.0)
    values = {"speed": speed, "gas.source": "input", "input.reconstruction": "stages", "solver.integrator": method}
    unit, found, size = open_fmu(fmu, CRANKTRAIN, values), [], step_of(step_deg)
    unit.link([], ["crank.angle"])
    unit.listen(lambda time: found.append((time / size, True)), lambda time: found.append((time / size, False)))
    unit.initialize(0.0)
    try:
        for k in range(count):
            unit.step(k * size, size)
    finally:
        unit.close()
    return found


@pytest.mark.parametrize("method", ["esdirk3", "esdirk4", "sdirk4", "esdirk47", "trapezoidal"])
def test_the_stages_of_each_step_are_asked_for_in_the_order_of_time(calling_six, method):
    """The begin is not: its inputs are those set before the step."""
    table = integrator_table(method)
    places = sorted(table[FIRST_STAGE : FIRST_STAGE + int(table[HEAD, STAGES]), NODE])
    wanted = [k + share for k in range(2) for share in places if share > 0.0]
    found = told(calling_six.cranktrain, method, COARSE_DEG)
    assert [reached for _, reached in found] == [False] * len(wanted)
    np.testing.assert_allclose([time for time, _ in found], wanted, rtol=0.0, atol=1e-9)


def test_a_step_of_several_internal_ones_asks_for_the_stages_of_each(calling_six):
    """Between internal steps of 5 degrees at most the host is called at a point that the cranktrain has reached."""
    found = told(calling_six.cranktrain, "sdirk3", 9.0, 1)
    assert [reached for _, reached in found] == [False] * 3 + [True] + [False] * 3
    assert found[2][0] == pytest.approx(0.5) and found[3][0] == pytest.approx(0.5) and found[6][0] == pytest.approx(1.0)
