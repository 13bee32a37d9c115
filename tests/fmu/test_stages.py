"""Pressures at the stages of the integrator, for which a cranktrain of FMI 3.0 asks its master; refusals without."""

import json
import zipfile
from contextlib import closing

import numpy as np
import pytest
from fmpy import fmi3
from fmpy.fmi1 import FMICallException
from fmus_by_version import torsional_fmu
from inside_a_step import COARSE_DEG, error, radians_per_second, step_of, system_of, torsion
from some import some

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.dynamics.time.integrators import integrator_table
from cranktrain.dynamics.time.table import FIRST_STAGE, HEAD, NODE, STAGES
from cranktrain_lab.coupling.fmu3_unit import open_fmu
from cranktrain_lab.coupling.master import Exchange
from cranktrain_lab.coupling.modules import CRANKTRAIN
from cranktrain_lab.coupling.run import Steps, run
from cranktrain_lab.coupling.unit import UnitError

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
    with closing(system.master()) as master:
        master.initialize()
        found = run(master, cycle, Steps(size, 1.0e-3, 1e-2 * size, 2.0 * size), system.bonds)
    assert found.refused > 0
    assert found.times[-1] == pytest.approx(cycle, rel=1e-12)


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


STAGED = {"gas.source": "input", "input.reconstruction": "stages"}


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def single(request, tmp_path_factory):
    """The single's FMU; that of FMI 3.0 with clocks, so that it has event mode."""
    return torsional_fmu("single_petrol", tmp_path_factory.mktemp("single"), request.param, request.param == "3.0")


def begun(fmu, *listeners):
    """A cranktrain that takes inputs at stages, with its functions to call inside a step."""
    unit = open_fmu(fmu, CRANKTRAIN, STAGED)
    unit.link([], ["crank.angle"])
    if listeners:
        unit.listen(*listeners)
    unit.initialize(0.0)
    return unit


def test_a_step_under_a_host_that_is_not_called_is_refused_in_one_line(single):
    with closing(begun(single)) as unit:
        with pytest.raises(UnitError, match=r"input.reconstruction is 'stages', whose inputs are not given") as e:
            unit.step(0.0, 1e-4)
        assert "\n" not in str(e.value)


@pytest.mark.parametrize("single", ["3.0"], indirect=True)
def test_a_step_in_event_mode_is_refused_in_one_line(single, monkeypatch):
    """Such a step may end at an event, before the times for which inputs were given; the host is not asked."""
    asked = []
    instantiate = fmi3.FMU3Slave.instantiate
    monkeypatch.setattr(
        fmi3.FMU3Slave, "instantiate", lambda *unit, **chosen: instantiate(*unit, eventModeUsed=True, **chosen)
    )
    with closing(begun(single, asked.append, asked.append)) as unit:
        unit._fmu.enterStepMode()
        with pytest.raises(UnitError, match=r"whose inputs are not given; .* without event mode, or polytropic") as e:
            unit.step(0.0, 1e-4)
        assert "\n" not in str(e.value) and not asked


@pytest.mark.parametrize("single", ["3.0"], indirect=True)
def test_derivatives_by_inputs_are_refused(single):
    """They repeat the last step, whose inputs at its stages nobody gives again."""
    unit = begun(single, lambda time: None, lambda time: None)
    references = {v.name: v.valueReference for v in unit._description.modelVariables}
    try:
        unit.step(0.0, 1e-4)
        with pytest.raises(FMICallException):
            unit._fmu.getDirectionalDerivative([references["crank.angle"]], [references["speed"]], [1.0])
        assert "no derivatives by inputs that are given at stages" in unit._log[-1]
    finally:
        unit.close()


def test_a_master_reconstructs_nothing_beside_it():
    with pytest.raises(InputError, match="reconstructs nothing; take reconstruction hold"):
        Exchange("stages", "linear")


@pytest.fixture(scope="module")
def cranktrains(fmus, calling_six, fmu, tmp_path_factory):
    """The six's cranktrains by what they can do."""
    silent = tmp_path_factory.mktemp("silent") / "Silent.fmu"
    with zipfile.ZipFile(calling_six.cranktrain) as source, zipfile.ZipFile(silent, "w") as target:
        for entry in source.infolist():
            text = source.read(entry)
            if entry.filename == "modelDescription.xml":
                assert text.count(b' providesIntermediateUpdate="true"') == 1
                text = text.replace(b' providesIntermediateUpdate="true"', b"")
            target.writestr(entry, text)
    return {
        "calling": calling_six.cranktrain, "silent": silent, "fmi2": fmus["2.0"][CRANKTRAIN], "python": fmu
    }  # fmt: skip


BY_STAGES = "--scheme", "stages"
SET = "--set", "cranktrain.input.reconstruction=stages"
SILENT = "scheme 'stages': cranktrain does not call its master inside a step; take gauss-seidel, or an FMU of FMI 3.0"


@pytest.mark.parametrize(
    ("cranktrain", "options", "said"),
    [
        ("fmi2", BY_STAGES, SILENT),
        ("silent", BY_STAGES, SILENT),
        ("python", BY_STAGES, SILENT),
        ("calling", (*BY_STAGES, "--set", "cranktrain.input.reconstruction=polytropic"), "it did not ask for inputs"),
        ("calling", (*BY_STAGES, "--reconstruction", "linear"), "'stages' reconstructs nothing; leave reconstruction"),
        ("calling", (*BY_STAGES, "--export-ssp", "six.ssp"), "other masters give no inputs at stages; take another"),
        ("calling", SET, "input.reconstruction is 'stages', whose inputs are not given; take a host of FMI 3.0"),
        ("fmi2", SET, "input.reconstruction is 'stages', whose inputs are not given; take a host of FMI 3.0"),
        ("python", SET, "'input.reconstruction' is 'stages', which needs a native FMU of FMI 3.0"),
    ],
)
def test_the_command_ends_with_one_line(cranktrains, calling_six, tmp_path, capsys, cranktrain, options, said):
    unit = cranktrains[cranktrain]
    code = main([
        "couple", "diesel_i6", "--speed", "2000", "--cycles", "1", "--json", "--output", str(tmp_path / "six.h5"),
        "--no-valvetrain", "--cranktrain", str(unit), "--combustion", str(calling_six.combustion), *options,
    ])  # fmt: skip
    out, err = capsys.readouterr()
    told = [line for line in err.splitlines() if line != "diesel_i6, 2000 rev/min"]
    assert code == 2 and len(told) == 1 and said in told[0] and json.loads(out).keys() == {"error"}
