"""Libraries of the real kernels: the same gates as the mock's, resources of any name, data that are not whole."""

import shutil
import zipfile

import gates
import numpy as np
import pytest
import real_unit
from raw_unit import ERROR, OK, Raw, summed
from real_unit import STEP

GATES = (
    gates.nothing_but_libc_and_libm_is_needed,
    gates.there_is_no_writable_data,
    gates.the_stack_holds_no_code,
)


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


# ------------------------------------------------------------------ resources


def refusal(unit, resources, guid=None):
    """What an instance is refused with."""
    one = Raw(unit.binary(), resources, guid or unit.about.guid)
    [(status, category, text)] = one.log
    assert one.component is None and (status, category) == (ERROR, "logStatusError")
    return text


def test_a_folder_may_have_any_name(real, tmp_path):
    """With spaces, percent signs, letters that are not of ASCII; as a URI or as a plain path."""
    place = tmp_path / "Kurbel trieb 100% größe 曲轴"
    shutil.copytree(real.folder / "resources", place / "resources")
    for location in (place / "resources", str(place / "resources"), f"file://{place}/resources/"):
        one = Raw(real.binary(), location, real.about.guid)
        one.set("String", real.texts())
        assert one.start().run(3, step=STEP).log == []
        one.free()


def damaged(data, place, value):
    return data[:place] + value + data[place + len(value) :]


@pytest.mark.parametrize(
    ("harm", "words"),
    [
        (lambda data: None, "is missing"),
        (lambda data: b"", "empty"),
        (lambda data: data[:-8], ""),
        (lambda data: data[: len(data) // 2], ""),
        (lambda data: damaged(data, 0, b"PKZIPPED"), ""),
        (lambda data: damaged(data, 8, b"\1\0\0\0"), "version"),
        (lambda data: damaged(data, 12, data[12:16][::-1]), "order of bytes"),
        (lambda data: damaged(data, 24, b"0123456789abcdef"), ""),
        (lambda data: damaged(data, len(data) - 80, b"\xff\xff"), ""),
    ],
)
def test_data_that_are_not_whole_are_refused(real, harm, words, tmp_path):
    data = harm((real.folder / "resources" / "native.bin").read_bytes())
    if data is not None:
        (tmp_path / "native.bin").write_bytes(data)
    text = refusal(real, tmp_path)
    assert "native.bin" in text and words in text, text


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


def test_another_guid_is_refused(real):
    assert "GUID" in refusal(real, real.folder / "resources", "{00000000-0000-0000-0000-000000000000}")


def test_an_fmu_holds_what_it_needs_and_no_code_of_python(real):
    with zipfile.ZipFile(real.folder.with_suffix(".fmu")) as archive:
        names = archive.namelist()
    assert {"modelDescription.xml", "resources/native.bin"} <= set(names)
    assert not [name for name in names if name.endswith((".py", ".pyc", ".toml"))]
    assert real.about.coSimulation.needsExecutionTool is not True
