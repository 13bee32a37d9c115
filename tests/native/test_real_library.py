"""Libraries of native FMUs: what they need, show and may write; states beyond any engine, contents, last bits."""

import re
import sys
import zipfile

import gates
import mock_unit
import numpy as np
import pytest
import real_unit
from gates import tool
from raw_unit import OK, summed
from real_unit import STEP

GATES = (gates.nothing_but_libc_and_libm_is_needed, gates.there_is_no_writable_data, gates.the_stack_holds_no_code)


@pytest.fixture(scope="module")
def engine(tmp_path_factory):
    return real_unit.opened(real_unit.engine_fmu(tmp_path_factory.mktemp("engine")))


def keeps_the_gates(unit):
    for gate in GATES:
        gate(unit.binary())
    gates.nothing_but_the_interface_is_shown(unit.binary(), "ct_kernels_table")


def test_a_library_keeps_the_gates(real):
    keeps_the_gates(real)
    assert real.binary().stat().st_size < 4e6


@pytest.mark.slow
def test_an_engines_library_keeps_them_too(engine):
    keeps_the_gates(engine)
    assert engine.binary().stat().st_size < 4e6


@pytest.mark.parametrize("wrong", [1.0e9, 1.0e14])
def test_a_step_from_a_state_beyond_any_engine_ends(engine, wrong):
    """Speeds of a repaired state, and whatever else equals them: the step is given up, or the state is refused."""
    one = engine.fresh().run(5, step=STEP)
    speed = one.one("Real", engine.references["speed"])
    words = np.frombuffer(one.serialized(one.state()), dtype="<u8").copy()
    inputs = np.flatnonzero(np.isclose(words.view(np.float64), speed, rtol=1.0e-9))
    words[inputs[1:]] = np.float64(wrong).view(np.uint64)  # the first is the variable itself
    status, state = one.deserialize(summed(words))
    if status == OK:
        one.must("SetFMUstate", state)
        assert one.step(5 * STEP, STEP) != OK
        assert "million internal steps" in one.log[-1][2]
    assert len(inputs) > 2


def test_an_fmu_holds_what_it_needs_and_no_code_of_python(real):
    with zipfile.ZipFile(real.folder.with_suffix(".fmu")) as archive:
        names = archive.namelist()
    assert {"modelDescription.xml", "resources/native.bin"} <= set(names)
    assert not [name for name in names if name.endswith((".py", ".pyc", ".toml"))]
    assert real.about.coSimulation.needsExecutionTool is not True


PARAMETERS = (
    "wall.factor",
    "wall.temperature",
    "intake.lift",
    "exhaust.lift",
    "burn.premixed_factor",
    "ignition.factor",
)


@pytest.fixture(scope="module")
def combustion(tmp_path_factory):
    return real_unit.unpacked("combustion_i6", tmp_path_factory.mktemp("combustion"))


def ended(unit, changed):
    """Outputs after a run with other Real parameters; not the counts of steps, nor balances, which are rounding."""
    one = unit.fresh(start=False)
    one.set("Real", changed)
    one.start().run(40, step=STEP)
    values = one.get("Real", *(unit.references[v.name] for v in outputs(unit)))
    one.free()
    return np.array(values)


def outputs(unit):
    made = (v for v in unit.about.modelVariables if v.causality == "output")
    return [v for v in made if not v.name.startswith(("solver.", "balance."))]


@pytest.mark.parametrize("name", PARAMETERS)
def test_last_bits_move_outputs_by_rounding(combustion, name):
    """A burn drops to 0 where a step ends: which side of it the step's last stage sees was up to rounding once."""
    start = next(float(v.start) for v in combustion.about.modelVariables if v.name == name)
    usual = ended(combustion, {})
    units = np.array([str(v.unit) for v in outputs(combustion)])
    largest = np.array([np.abs(usual[units == unit]).max() for unit in units])
    for bits in (4, 18):
        found = ended(combustion, {combustion.references[name]: start * (1.0 + bits * np.finfo(float).eps)})
        # Of a unit that only zeros have (deviations of volumes, which nothing gives here) they stay zeros.
        assert np.all(np.abs(found - usual) <= 1e-9 * largest), bits


@pytest.mark.parametrize("name", ["gcc", "clang"])
def test_compilers_have_nothing_to_say(name, tmp_path):
    command = tool(name), "-Wsign-conversion", "-Wshadow", "-Wvla", "-Wundef", "-Wstrict-prototypes"
    assert mock_unit.library(tmp_path, command=command).stat().st_size < 200_000


@pytest.mark.slow
@pytest.mark.parametrize("target", ["x86_64-linux-gnu.2.17", "x86_64-windows-gnu", "aarch64-linux-gnu"])
def test_it_compiles_for_other_machines(target, tmp_path):
    pytest.importorskip("ziglang", reason="needs PyPI's ziglang")
    command = sys.executable, "-m", "ziglang", "cc", "-target", target
    mock_unit.library(tmp_path, "-s", command=command)


@pytest.mark.slow
def test_windows_sees_every_function_of_both_versions(tmp_path):
    """In the table of exports of the library for Windows; 34 functions of FMI 2.0 for co-simulation and 75 of 3.0."""
    pytest.importorskip("ziglang", reason="needs PyPI's ziglang")
    command = sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-windows-gnu"
    library = mock_unit.library(tmp_path, "-s", command=command)
    exported = set(re.findall(r"\bfmi[23]\w+", gates.said("objdump", "-p", library)))
    assert exported == gates.declared() and len(exported) == 34 + 75
