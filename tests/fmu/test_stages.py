"""Pressures at the stages of the integrator: a cranktrain of FMI 3.0 asks its master for them ahead of its step."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmus_by_version import module_fmu, torsional_fmu

from cranktrain.core.errors import InputError
from cranktrain.coupling.fmu3_unit import open_fmu
from cranktrain.coupling.master import Exchange, Master
from cranktrain.coupling.modules import COMBUSTION, CRANKTRAIN, VALVETRAIN
from cranktrain.coupling.run import Steps, run
from cranktrain.coupling.supervised import run_supervised
from cranktrain.coupling.trace_unit import MeasuredPressures
from cranktrain.coupling.unit import Around, UnitError
from cranktrain.coupling.virtual_engine import Partners, virtual_engine
from cranktrain.dynamics.time.integrators import integrator_table
from cranktrain.dynamics.time.table import FIRST_STAGE, HEAD, NODE, STAGES
from cranktrain.engine.file import load_engine
from cranktrain.fmu.flat import FlatModel
from cranktrain.fmu.running import chosen_levels
from cranktrain.loads.gas_pressure import GasTrace

CYCLES = 6
"""Until what the start leaves has faded below the errors in question."""
COARSE_DEG = 1.5
COMBUSTIONS = {"diesel_i6": "combustion_i6", "diesel_v8": "combustion_v8"}


def radians_per_second(rpm):
    return rpm * math.pi / 30.0


@pytest.fixture(scope="module", params=["diesel_i6", "diesel_v8", "single_petrol"])
def pair(request, tmp_path_factory):
    """Cranktrain of FMI 3.0 and its combustion, for the single the pressures of its trace."""
    folder = tmp_path_factory.mktemp(request.param)
    if request.param in COMBUSTIONS:
        gas = module_fmu(COMBUSTIONS[request.param], folder)
    else:
        engine = load_engine(request.param)
        gas = MeasuredPressures(engine, GasTrace.from_engine(engine))
    return torsional_fmu(request.param, folder), gas


@pytest.fixture(scope="module")
def six(tmp_path_factory):
    """The six, its combustion and its valve train."""
    folder = tmp_path_factory.mktemp("six")
    return torsional_fmu("diesel_i6", folder), module_fmu("combustion_i6", folder), module_fmu("valvetrain_i6", folder)


def system_of(fmus, step_deg, rpm=2000.0, scheme="stages", **values):
    cranktrain, combustion, *valvetrain = fmus
    partners = Partners(cranktrain, combustion, {CRANKTRAIN: values}, *valvetrain)
    speed = radians_per_second(rpm)
    return virtual_engine(partners, speed, scheme, "own", math.radians(step_deg) / speed)


def coupled(fmus, step_deg, rpm=2000.0, scheme="stages", **values):
    """Torsion of the pulley every 3 degrees, rad."""
    system, speed = system_of(fmus, step_deg, rpm, scheme, **values), radians_per_second(rpm)
    master = system.master()
    try:
        master.initialize()
        found = run(master, CYCLES * 4.0 * math.pi / speed, Steps(math.radians(step_deg) / speed), system.bonds)
    finally:
        master.close()
    return found.of(f"{CRANKTRAIN}.pulley.torsion")[:: round(3.0 / step_deg)]


def error(found, exact):
    """RMS over the last cycle, over the RMS of the alternating part."""
    return float(np.sqrt(np.mean((found[-240:] - exact[-240:]) ** 2)) / exact[-240:].std())


@pytest.mark.parametrize("rpm", [2000.0, 800.0])
def test_torsion_at_coarse_steps_is_within_a_thousandth(pair, rpm):
    """Without reconstruction, against steps of 0.125 degrees; at low speed pressures rise as steeply as they do."""
    exact = coupled(pair, 0.125, rpm, "gauss-seidel")
    assert error(coupled(pair, COARSE_DEG, rpm), exact) < 1.0e-3


def test_a_valve_train_takes_whole_steps_and_gives_its_mean_torque(six):
    """Its blows are shorter than a step, so single values mean little; less than half the error of gauss-seidel."""
    exact = coupled(six, 0.125, scheme="gauss-seidel")
    plain, staged = (error(coupled(six, COARSE_DEG, scheme=scheme), exact) for scheme in ("gauss-seidel", "stages"))
    assert staged < 0.5 * plain


def test_a_run_in_its_own_process_gives_the_same_bits(six):
    make, speed = Made(six), radians_per_second(2000.0)
    size = math.radians(COARSE_DEG) / speed
    found = run_supervised(make, 40 * size, Steps(size))
    system = make()
    master = system.master()
    try:
        master.initialize()
        here = run(master, found.times[-1], Steps(size), system.bonds)
    finally:
        master.close()
    np.testing.assert_array_equal(found.values, here.values)


class Made:
    """Makes the coupled six, in a process of its own too."""

    def __init__(self, fmus):
        self.fmus = fmus

    def __call__(self):
        return system_of(self.fmus, COARSE_DEG)


def test_a_state_that_is_restored_gives_the_same_bits(six):
    master = system_of(six, COARSE_DEG).master()
    size = math.radians(COARSE_DEG) / radians_per_second(2000.0)

    def gone(count):
        for _ in range(count):
            master.step(master.time + size)
        return master.newest.copy()

    try:
        master.initialize()
        gone(30)
        state = master.keep()
        first = gone(7)
        master.restore(state)
        np.testing.assert_array_equal(gone(7), first)
    finally:
        master.close()


def test_steps_that_an_error_controls_repeat_and_agree_with_equal_ones(six):
    speed = radians_per_second(2000.0)
    system, size = system_of(six, COARSE_DEG), math.radians(COARSE_DEG) / speed
    master = system.master()
    try:
        master.initialize()
        found = run(master, 4.0 * math.pi / speed, Steps(size, 1.0e-3, 1e-2 * size, 2.0 * size), system.bonds)
    finally:
        master.close()
    assert found.refused > 0
    assert found.times[-1] == pytest.approx(4.0 * math.pi / speed, rel=1e-12)


# ------------------------------------------------------------------ what the cranktrain asks for


def told(fmu, method, step_deg, count=2):
    """Calls of a cranktrain alone within ``count`` steps: its times, and whether it has got there."""
    speed = radians_per_second(2000.0)
    values = {"speed": speed, "gas.source": "input", "input.reconstruction": "stages", "solver.integrator": method}
    unit, found, size = open_fmu(fmu, CRANKTRAIN, values), [], math.radians(step_deg) / speed
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
def test_the_stages_of_each_step_are_asked_for_in_the_order_of_time(six, method):
    """The begin is not: its inputs are those set before the step."""
    table = integrator_table(method)
    places = sorted(table[FIRST_STAGE : FIRST_STAGE + int(table[HEAD, STAGES]), NODE])
    wanted = [k + share for k in range(2) for share in places if share > 0.0]
    found = told(six[0], method, COARSE_DEG)
    assert [reached for _, reached in found] == [False] * len(wanted)
    np.testing.assert_allclose([time for time, _ in found], wanted, rtol=0.0, atol=1e-9)


def test_a_step_of_several_internal_ones_asks_for_the_stages_of_each(six):
    """Between internal steps of 5 degrees at most the host is called at a point that the cranktrain has reached."""
    found = told(six[0], "sdirk3", 9.0, 1)
    assert [reached for _, reached in found] == [False] * 3 + [True] + [False] * 3
    assert found[2][0] == pytest.approx(0.5) and found[3][0] == pytest.approx(0.5) and found[6][0] == pytest.approx(1.0)


# ------------------------------------------------------------------ what cannot be


def test_a_crank_of_fmi_2_is_refused_in_one_line(six, tmp_path):
    fmus = torsional_fmu("diesel_i6", tmp_path, "2.0"), six[1]
    with pytest.raises(InputError, match="cranktrain does not call its master inside a step; take gauss-seidel") as e:
        system_of(fmus, COARSE_DEG).master()
    assert "\n" not in str(e.value)


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_a_step_under_a_host_that_is_not_called_is_refused_in_one_line(tmp_path, fmi):
    values = {"gas.source": "input", "input.reconstruction": "stages"}
    unit = open_fmu(torsional_fmu("diesel_i6", tmp_path, fmi), CRANKTRAIN, values)
    unit.link([], ["crank.angle"])
    unit.initialize(0.0)
    try:
        with pytest.raises(UnitError, match=r"input.reconstruction is 'stages', whose inputs are not given"):
            unit.step(0.0, 1e-4)
    finally:
        unit.close()


def test_derivatives_by_inputs_are_refused(six):
    """They repeat the last step, whose inputs at its stages nobody gives again."""
    values = {"gas.source": "input", "input.reconstruction": "stages"}
    unit = open_fmu(six[0], CRANKTRAIN, values)
    unit.link([], ["crank.angle"])
    unit.listen(lambda time: None, lambda time: None)
    unit.initialize(0.0)
    references = {v.name: v.valueReference for v in unit._description.modelVariables}
    try:
        unit.step(0.0, 1e-4)
        with pytest.raises(FMICallException):
            unit._fmu.getDirectionalDerivative([references["crank.angle"]], [references["speed"]], [1.0])
        assert "no derivatives by inputs that are given at stages" in unit._log[-1]
    finally:
        unit.close()


def test_a_python_fmu_refuses_the_choice():
    model = FlatModel(load_engine("single_petrol"), {})
    with pytest.raises(InputError, match=r"'input.reconstruction' is 'stages', which needs a native FMU of FMI 3.0"):
        chosen_levels(
            model, {"crank": "torsional", "reconstruction": "stages"}, {"reconstruction": "input.reconstruction"}
        )


def test_other_reconstructions_are_refused(six):
    partners = Partners(*six[:2], {})
    with pytest.raises(InputError, match="'stages' reconstructs nothing; leave reconstruction 'linear' out"):
        virtual_engine(partners, 200.0, "stages", "linear")
    with pytest.raises(InputError, match="reconstructs nothing; take reconstruction hold"):
        Exchange("stages", "linear")


def test_a_cranktrain_that_does_not_ask_is_named(six):
    system = system_of(six, COARSE_DEG, **{"input.reconstruction": "polytropic"})
    master = system.master()
    try:
        master.initialize()
        with pytest.raises(UnitError, match="cranktrain, step from 0 s: it did not ask for inputs"):
            master.step(1e-4)
    finally:
        master.close()


@pytest.mark.parametrize("failure", [UnitError("no burn"), KeyboardInterrupt()])
def test_what_fails_inside_a_step_ends_the_run(six, failure):
    """The partner is named with the time; an interrupt is not lost in the FMU that is being called."""
    system = system_of(six, COARSE_DEG)
    size, asked = math.radians(COARSE_DEG) / radians_per_second(2000.0), SimpleNamespace(steps=0)

    class Failing(Around):
        def step(self, time, size):
            asked.steps += 1
            if asked.steps == 8:
                raise failure
            super().step(time, size)

    units = [system.units[VALVETRAIN], Failing(system.units[COMBUSTION]), system.units[CRANKTRAIN]]
    master = Master(units, system.connections, system.exchange, system.outputs)
    try:
        master.initialize()
        master.step(size)
        with pytest.raises(type(failure), match="combustion, step from .*: no burn" if str(failure) else None):
            master.step(2.0 * size)
        assert asked.steps == 8
    finally:
        master.close()
