"""Inputs at stages where nobody gives them: each refusal is one line, of the cranktrain's FMU or of the master."""

import json
import zipfile

import pytest
from fmpy import fmi3
from fmpy.fmi1 import FMICallException
from fmus_by_version import torsional_fmu

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.fmu.flat import FlatModel
from cranktrain.fmu.running import chosen_levels
from cranktrain_lab.coupling.fmu3_unit import open_fmu
from cranktrain_lab.coupling.master import Exchange
from cranktrain_lab.coupling.modules import CRANKTRAIN
from cranktrain_lab.coupling.unit import UnitError

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
    unit = begun(single)
    try:
        with pytest.raises(UnitError, match=r"input.reconstruction is 'stages', whose inputs are not given") as e:
            unit.step(0.0, 1e-4)
        assert "\n" not in str(e.value)
    finally:
        unit.close()


@pytest.mark.parametrize("single", ["3.0"], indirect=True)
def test_a_step_in_event_mode_is_refused_in_one_line(single, monkeypatch):
    """Such a step may end at an event, before the times for which inputs were given; the host is not asked."""
    asked = []
    instantiate = fmi3.FMU3Slave.instantiate
    monkeypatch.setattr(
        fmi3.FMU3Slave, "instantiate", lambda *unit, **chosen: instantiate(*unit, eventModeUsed=True, **chosen)
    )
    unit = begun(single, asked.append, asked.append)
    try:
        unit._fmu.enterStepMode()
        with pytest.raises(UnitError, match=r"whose inputs are not given; .* without event mode, or polytropic") as e:
            unit.step(0.0, 1e-4)
        assert "\n" not in str(e.value) and not asked
    finally:
        unit.close()


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


def test_a_python_fmu_refuses_the_choice():
    model = FlatModel(load_engine("single_petrol"), {})
    with pytest.raises(InputError, match=r"'input.reconstruction' is 'stages', which needs a native FMU of FMI 3.0"):
        chosen_levels(
            model, {"crank": "torsional", "reconstruction": "stages"}, {"reconstruction": "input.reconstruction"}
        )


def test_a_master_reconstructs_nothing_beside_it():
    with pytest.raises(InputError, match="reconstructs nothing; take reconstruction hold"):
        Exchange("stages", "linear")


# ------------------------------------------------------------------ by the command line


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


STAGES = "--scheme", "stages"
SET = "--set", "cranktrain.input.reconstruction=stages"
SILENT = "scheme 'stages': cranktrain does not call its master inside a step; take gauss-seidel, or an FMU of FMI 3.0"


@pytest.mark.parametrize(
    ("cranktrain", "options", "said"),
    [
        ("fmi2", STAGES, SILENT),
        ("silent", STAGES, SILENT),
        ("python", STAGES, SILENT),
        ("calling", (*STAGES, "--set", "cranktrain.input.reconstruction=polytropic"), "it did not ask for inputs"),
        ("calling", (*STAGES, "--reconstruction", "linear"), "'stages' reconstructs nothing; leave reconstruction"),
        ("calling", (*STAGES, "--export-ssp", "six.ssp"), "other masters give no inputs at stages; take another"),
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
