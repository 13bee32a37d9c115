"""What every FMU must do, ours of each kind: calls, states, instances, neighbours, long runs, other people's clients.

What only one of them can show is in its own file: ``test_slave.py``, ``test_module_fmus.py``, ``test_build.py``.
"""

import ctypes
import shutil
import zipfile
from pathlib import Path

import numpy as np
import pytest
from benchmarks._clients import CLIENTS
from benchmarks.clients import Job, checked, difference
from coarse_engines import built, coarse, is_native
from fmpy import read_csv, read_model_description, simulate_fmu
from fmpy.validation import validate_fmu
from fmus_by_version import MODULES
from some import some

from cranktrain.core.errors import InputError
from cranktrain.core.machine_code import OFF, SEAL, code_digest, is_whole, this_platform
from cranktrain.fmu import archive
from cranktrain.fmu.archive import write_reference
from cranktrain.fmu.build import build_fmu
from cranktrain.fmu.engine_fmu import camel, full_interface
from cranktrain.fmu.module_fmu import module_interface
from cranktrain.modules.register import module_files, module_of

CHEAP = {"crank.level": "rigid", "bearing.level": "linear"}
"""Levels of the cranktrain that cost least; other FMUs have none of them."""
CHOSEN = {"gas.load": 0.5, "scatter.fuel": 0.02, "scatter.seed": 7.0, "train.lash": 1e-4}
"""Parameters of one or another FMU, which a state brings along."""
HEAD = f"""
def fresh(name="unit", folder=None):
    unit = Unit(sys.argv[1], name, folder)
    return unit.start({{key: value for key, value in {CHEAP!r}.items() if key in unit.reference}})
"""


def test_it_keeps_the_rules(shipped, script):
    """By FMPy: names, causality, units, dependencies. What it says it can do, it can."""
    assert validate_fmu(str(shipped)) == []
    description = read_model_description(str(shipped))
    kind = description.coSimulation
    assert kind.canGetAndSetFMUstate and kind.canSerializeFMUstate and kind.canHandleVariableCommunicationStepSize
    assert not kind.canBeInstantiatedOnlyOncePerProcess
    assert all(v.unit for v in description.modelVariables if v.type == "Real")
    script(
        HEAD
        + """
whole, parts = fresh("whole"), fresh("parts")
for h, k in ((1e-4, 0), (2e-4, 1), (5e-5, 3)):
    whole.fmu.doStep(1e-4 * k, h)
    parts.fmu.doStep(1e-4 * k, h)
assert whole.bits() == parts.bits()
""",
        shipped,
    )


def test_fifty_instances_do_not_know_of_each_other(shipped, script):
    script(
        HEAD
        + """
alone = fresh().run(4)
expected, further = alone.bits(), alone.run(1, first=4).bits()
units = [fresh(f"unit{i}", alone.folder) for i in range(50)]
for k in range(4):
    for unit in units[k % 2 :] + units[: k % 2]:
        unit.run(1, first=k)
for unit in units[::2]:
    unit.run(1, first=4)
assert [unit.bits() for unit in units] == 25 * [further, expected]
assert sys.path.count(f"{alone.folder}/resources") <= 1
for unit in units:
    unit.close()
""",
        shipped,
    )


def test_a_state_goes_back_and_on_to_the_bit(shipped, script, tmp_path):
    """In the instance, behind its end too, in another one, and serialized in another process."""
    begin = f"""
unit = Unit(sys.argv[1])
unit.start({{key: value for key, value in {CHEAP | CHOSEN!r}.items() if key in unit.reference}}).run(20)
"""
    begin += """
state = unit.fmu.getFMUstate()
open(sys.argv[2], "wb").write(unit.fmu.serializeFMUstate(state))
on = unit.run(20, first=20).bits()
unit.fmu.setFMUstate(state)
assert unit.run(20, first=20).bits() == on
unit.fmu.terminate()
unit.fmu.setFMUstate(state)
assert unit.run(20, first=20).bits() == on
print(on)
"""
    go_on = """
unit = fresh().run(3)
unit.fmu.setFMUstate(unit.fmu.deSerializeFMUstate(open(sys.argv[2], "rb").read()))
print(unit.run(20, first=20).bits())
"""
    first = script(HEAD + begin, shipped, tmp_path / "state").stdout
    assert script(HEAD + go_on, shipped, tmp_path / "state").stdout == first


BEGIN, END = "unit.fmu.enterInitializationMode()", "unit.start(), unit.fmu.terminate()"
REFUSED = (
    ("unit.fmu.exitInitializationMode()", "", "it must be in initialization mode"),
    ("unit.fmu.doStep(0.0, 1e-4)", "", "doStep before the initialization is complete"),
    ("unit.fmu.terminate()", "", "terminate on an instance that is only instantiated"),
    ("unit.fmu.enterInitializationMode()", BEGIN, "is in initialization mode; it must be only instantiated"),
    ("unit.fmu.setupExperiment(startTime=0.0)", BEGIN, "setupExperiment on an instance that is in initialization mode"),
    ("unit.fmu.doStep(0.0, 1e-4)", BEGIN, "doStep before the initialization is complete"),
    ("unit.fmu.enterInitializationMode()", "unit.start()", "it must be only instantiated"),
    ("unit.fmu.setupExperiment(startTime=0.0)", "unit.start()", "it must be only instantiated"),
    ("unit.fmu.setupExperiment(startTime=1e300)", "", "start time"),
    ("unit.fmu.doStep(1.0, 1e-4)", "unit.start()", "the master steps from 1.0 s"),
    ("unit.fmu.doStep(0.0, -1e-4)", "unit.start()", "it must be positive"),
    ("unit.fmu.setReal([0], [NAN])", "unit.start()", "is nan"),
    ("unit.set_named(unit.outputs[0], 0.0)", "unit.start()", "is an output and cannot be set"),
    ("unit.fmu.doStep(0.0, 1e-4)", END, "doStep on an instance that is terminated"),
    ("unit.fmu.terminate()", END, "terminate on an instance that is terminated"),
    ("unit.fmu.exitInitializationMode()", END, "it must be in initialization mode"),
)
"""Calls that are refused, what goes before them, and what is said."""


def test_illegal_calls_are_refused_and_harm_nothing(shipped, script):
    """Each says why in one line; instance and host live on. Fatal where the wrapping library knows no other refusal."""
    kind, fatal = read_model_description(str(shipped)).coSimulation, 3 if is_native(shipped) else 4
    not_offered = ["fmi2CancelStep"]
    not_offered += [] if kind.canInterpolateInputs else ["fmi2SetRealInputDerivatives"]
    not_offered += [] if kind.maxOutputDerivativeOrder else ["fmi2GetRealOutputDerivatives"]
    script(
        f"""
unit = Unit(sys.argv[1])
for action, before, words in {REFUSED!r}:
    eval(before or "None")
    status, text = unit.refusal(lambda: eval(action))
    assert status == {fatal} and "unit: " in text and words in text, (action, status, text)
    assert "Traceback" not in text, text
    unit.fmu.reset()
unit.start().run(2)
reference, order, value = (ctypes.c_uint * 1)(0), (ctypes.c_int * 1)(1), (ctypes.c_double * 1)()
for name in {not_offered!r}:
    arguments = () if name == "fmi2CancelStep" else (reference, 1, order, value)
    assert getattr(unit.fmu.dll, name)(unit.fmu.component, *arguments) == 3, name
unit.run(2, first=2).close()
""",
        shipped,
    )


@pytest.fixture(scope="session")
def neighbour(fmu, tmp_path_factory):
    """The cranktrain's FMU with another GUID and other data: another build, which shares its code."""
    return built(coarse("diesel_v8"), tmp_path_factory.mktemp("neighbour"))


@pytest.mark.slow
def test_different_fmus_in_one_process_keep_to_themselves(shipped, neighbour, script):
    """A step each in turn, whichever comes first: results are those of a process of its own."""
    alone = """
print(fresh().run(10).bits())
"""
    together = """
both = [fresh(), None]
sys.argv[1] = sys.argv[2]
both[1] = fresh()
for k in range(10):
    for unit in both:
        unit.run(1, first=k)
print(both[0].bits())
print(both[1].bits())
"""
    expected = [script(HEAD + alone, path).stdout for path in (shipped, neighbour)]
    assert script(HEAD + together, shipped, neighbour).stdout == "".join(expected)
    assert script(HEAD + together, neighbour, shipped).stdout == "".join(reversed(expected))


LONG = """
unit = fresh().run(20000)
before = in_use()
unit.run(80000, first=20000)
print(in_use() - before)
"""


@pytest.mark.slow
def test_memory_does_not_grow_over_a_hundred_thousand_steps(shipped, script):
    """From the 20,000th step to the last less than a byte a step of all that the C library gave out.

    The least that a step could keep is an object of 16 bytes. Measured: 0.01 to 0.4, which does not go on.
    """
    if not hasattr(ctypes.CDLL(None), "mallinfo2"):
        pytest.skip("needs a C library that counts what is allocated: glibc 2.33 or newer")
    assert int(script(HEAD + LONG, shipped, PYTHONMALLOC="malloc").stdout) < 80000


@pytest.mark.slow
def test_the_reference_run_is_met(shipped, tmp_path):
    """Files of the cross-check: what ``build_fmu.py --reference`` writes beside an FMU runs, and is found again."""
    path = Path(shutil.copy(shipped, tmp_path))
    modules = {camel(name): module_of(file) for name, file in module_files().items()}
    interface = module_interface(modules[path.stem]) if path.stem in modules else full_interface()
    write_reference(path, interface, print)
    given, reference = (read_csv(str(tmp_path / f"{path.stem}_{kind}.csv")) for kind in ("in", "ref"))
    options = dict(line.split(", ") for line in (tmp_path / f"{path.stem}_ref.opt").read_text().splitlines())
    assert reference["time"][-1] == float(options["StopTime"]) and len(reference) > 900
    found = simulate_fmu(str(path), output_interval=float(options["StepSize"]), input=given)
    for name in reference.dtype.names:
        np.testing.assert_allclose(found[name], reference[name], rtol=float(options["RelTol"]), atol=1e-9, err_msg=name)


@pytest.mark.slow
def test_the_toolbox_finds_nothing_wrong(shipped):
    """``fmutool -check``."""
    assert checked(shipped) == []


@pytest.mark.slow
@pytest.mark.parametrize("client", list(CLIENTS))
def test_other_peoples_clients_find_what_fmpy_finds(shipped, client):
    """A hundred steps; times that are added up, or counted in nanoseconds, differ in their last digits."""
    assert difference(CLIENTS[client], Job(shipped)) < 1e-10


def test_the_archive_names_its_licences(shipped):
    with zipfile.ZipFile(shipped) as opened:
        names = set(opened.namelist())
    assert {"documentation/licenses/license.txt", "model.png"} <= names
    assert ("documentation/licenses/pythonfmu.txt" in names) != is_native(shipped)
    assert "terminalsAndIcons/terminalsAndIcons.xml" in names


RUN = """
unit = Unit(sys.argv[1], "mine")
unit.start({"crank.level": "rigid", "bearing.level": "linear"} if "crank.level" in unit.reference else {})
unit.run(20)
print("numba" in sys.modules, *unit.bits())
"""
PLACE = "/fmu/native/lib/"


def carried(fmu):
    """Libraries and seal of an FMU, by their places behind ``PLACE``."""
    with zipfile.ZipFile(fmu) as files:
        return {name.partition(PLACE)[2]: files.read(name) for name in files.namelist() if PLACE in name}


@pytest.fixture
def libraries(shipped):
    """Those of an FMU; skips where none could be made, and native FMUs, which are their machine code."""
    with zipfile.ZipFile(shipped) as files:
        if "resources/native.bin" in files.namelist():
            pytest.skip("a native FMU has no kernels for Python")
    found = carried(shipped)
    if not any(name.startswith(this_platform()) for name in found):
        pytest.skip("libraries were not made here; make native does")
    return found


def test_an_fmu_carries_the_library_of_its_kind_and_the_digest_of_its_sources(libraries, tmp_path):
    digests = dict(line.split() for line in libraries[SEAL].decode().splitlines())
    path, first = tmp_path / "library", next(iter(digests))
    path.write_bytes(
        next(content for name, content in libraries.items() if name.startswith(f"{this_platform()}/{first}"))
    )
    for kind, digest in some(digests.items()):
        assert digest == code_digest(kind) and is_whole(path, digest)


# Numba compiles all kernels of the cranktrain for minutes; those of the modules are the quick check.
@pytest.mark.parametrize("shipped", [pytest.param("cranktrain", marks=pytest.mark.slow), *MODULES], indirect=True)
def test_an_fmu_starts_without_numba_and_gives_numba_s_bits(shipped, libraries, script, cache):
    numba, *bits = script(RUN, shipped).stdout.split()
    assert numba == "False"
    assert script(RUN, shipped, **{OFF: "1"}).stdout.split() == ["True", *bits]
    package = next(path for path in cache.glob("fmu/cranktrain_*") if (path / PLACE[1:]).is_dir())
    assert {path.name for path in (package / PLACE[1:]).rglob("*.*")} >= {SEAL}


def test_a_library_that_was_changed_in_the_cache_is_not_loaded(shipped, libraries, script, tmp_path):
    """It is taken from the FMU again, as the code is."""
    expected = script(RUN, shipped).stdout
    assert script(RUN, shipped, cache=tmp_path).stdout == expected
    (copy,) = tmp_path.glob(f"fmu/cranktrain_*{PLACE}{this_platform()}/*")
    content = copy.read_bytes()
    copy.write_bytes(content[:5000])
    assert script(RUN, shipped, cache=tmp_path).stdout == expected
    assert copy.read_bytes() == content


def test_without_a_compiler_an_fmu_is_built_that_compiles_at_its_first_start(tmp_path, monkeypatch):
    def none(kind, platform, say, emit):
        raise InputError("no C compiler was found")

    monkeypatch.setattr(archive, "library", none)
    said = []
    plain = build_fmu("valvetrain_i6", tmp_path, platforms=(), say=said.append)
    assert carried(plain) == {}
    assert sum("kernels are compiled at the first start there: no C compiler was found" in line for line in said) == 2
    monkeypatch.undo()
    whole = build_fmu("valvetrain_i6", tmp_path / "whole", platforms=(), say=said.append)
    guids = [zipfile.ZipFile(path).read("modelDescription.xml").partition(b'guid="')[2][:38] for path in (plain, whole)]
    assert guids[0] == guids[1]
