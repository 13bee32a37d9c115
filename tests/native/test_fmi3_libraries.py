"""FMUs of FMI 3.0 in a host without Python: calls at random, valgrind and sanitizers, as FMUs of FMI 2.0 have them."""

import math
import re
import subprocess
import sys

import gates
import mock_unit
import pytest
import real_unit
from fmpy import read_model_description
from gates import tool
from mock_unit import REFERENCE, compiler
from plain_host import hosted3, plain_host
from raw3_unit import Raw3
from real_unit import STEP, TURNING

MOCK_OUTPUTS = [(REFERENCE["position"], 3)]


@pytest.fixture(scope="module")
def host(tmp_path_factory):
    """The plain host of FMI 3.0, compiled with further options."""
    if compiler() is None:
        pytest.skip("needs a C compiler: gcc or clang")
    return lambda *options: plain_host(tmp_path_factory.mktemp("host"), *options, name="host3")


class Mock:
    """The mock with position, velocity and energy as one array; another library of it may be given."""

    step, items = 1e-4, ()

    def __init__(self, binary, folder):
        self.binary, self.folder = binary, folder

    def hosted(self, host, *what, binary=None, before=()):
        given = binary or self.binary, mock_unit.GUID, self.folder, len(REFERENCE) + 1, MOCK_OUTPUTS
        return hosted3(host, *given, what, before=before)

    def from_python(self, steps):
        one = Raw3(self.binary, self.folder, mock_unit.GUID).start().run(steps)
        found = one.get("Float64", REFERENCE["position"], n=3)
        one.free()
        return [value.hex() for value in found]


class Real:
    """An FMU of FMI 3.0, in its folder."""

    def __init__(self, unit):
        self.unit = unit
        about = read_model_description(str(unit.folder))
        self.token, self.resources = about.instantiationToken, unit.folder / "resources"
        self.binary = unit.binary("x86_64-linux")
        floats = [v for v in about.modelVariables if v.causality == "output" and v.type == "Float64"]
        self.outputs = [(v.valueReference, math.prod(v.shape)) for v in floats]
        self.references = 1 + max(v.valueReference for v in about.modelVariables)
        chosen = {v.name: v for v in about.modelVariables if v.name in TURNING}
        self.items = [(v.valueReference, item(v, TURNING[name])) for name, v in chosen.items()]

    def hosted(self, host, *what, binary=None, before=()):
        given = binary or self.binary, self.token, self.resources, self.references, self.outputs
        return hosted3(host, *given, what, items=self.items, before=before, step=STEP)

    def from_python(self, steps):
        one = Raw3(self.binary, self.resources, self.token)
        for reference, number in self.items:
            one.set("Int64", [reference], [number])
        one.start().run(steps, step=STEP)
        found = one.get("Float64", *(reference for reference, _ in self.outputs), n=sum(n for _, n in self.outputs))
        one.free()
        return [value.hex() for value in found]


def item(variable, name):
    """Number of an enumeration's item."""
    return next(int(one.value) for one in variable.declaredType.items if one.name == name)


@pytest.fixture(scope="module")
def mock3(binary, tmp_path_factory):
    folder = tmp_path_factory.mktemp("resources")
    (folder / "native.bin").write_bytes(mock_unit.native_bin(arrays=f"{REFERENCE['position']}*3"))
    return Mock(binary, folder)


@pytest.fixture(scope="module", params=["combustion_i6", "valvetrain_i6"])
def real3(request, tmp_path_factory):
    return Real(real_unit.unpacked(request.param, tmp_path_factory.mktemp(request.param), fmi="3.0"))


@pytest.fixture(scope="module")
def engine3(tmp_path_factory):
    return Real(real_unit.opened(real_unit.engine_fmu(tmp_path_factory.mktemp("engine"), fmi="3.0")))


def runs_without_python(unit, host, steps):
    """To the bit; from restored, reset and serialized instances, and in threads at once."""
    found, log = unit.hosted(host, "run", steps, 0)
    assert found == unit.from_python(steps) and log == ""
    found, log = unit.hosted(host, "threads", 3, 0)
    assert found == unit.from_python(50) and log == ""


def unharmed(unit, host, count, seed):
    """The host compares what runs behind the calls; here with a run that never saw one."""
    found, log = unit.hosted(host, "fuzz", count, seed)
    assert found == unit.from_python(10)
    return {kind: int(n) for n, kind in re.findall(r"(\d+) (ok|discarded|refused)", log)}


def test_a_host_without_python_finds_the_same(mock3, host):
    runs_without_python(mock3, host(), 100)


def test_the_modules_do_so_too(real3, host):
    runs_without_python(real3, host(), 60)


def test_a_hundred_thousand_calls_at_random_do_no_harm(mock3, host):
    counts = unharmed(mock3, host(), 100_000, 15)
    assert len(counts) == 3 and min(counts.values()) > 500


@pytest.mark.slow
def test_a_million_calls_at_random_do_a_module_no_harm(real3, host):
    unharmed(real3, host(), 1_000_000, 17)


@pytest.mark.slow
def test_an_engine_runs_and_is_called_at_random(engine3, host):
    made = host()
    runs_without_python(engine3, made, 60)
    unharmed(engine3, made, 20_000, 17)


# ------------------------------------------------------------------ what watches memory


def memcheck():
    return tool("valgrind"), "-q", "--error-exitcode=9", "--leak-check=full", "--show-leak-kinds=all"


@pytest.mark.slow
def test_memcheck_finds_nothing(mock3, host):
    plain = host()
    for what in (("run", 100, 0), ("threads", 4, 0), ("fuzz", 100_000, 3)):
        mock3.hosted(plain, *what, before=memcheck())


@pytest.mark.slow
def test_memcheck_finds_nothing_in_the_real_kernels(real3, host):
    plain = host()
    for what in (("run", 60, 0), ("threads", 2, 0), ("fuzz", 5_000, 3)):
        real3.hosted(plain, *what, before=memcheck())


@pytest.mark.slow
def test_memcheck_finds_nothing_in_an_engine(engine3, host):
    engine3.hosted(host(), "run", 4, 0, before=memcheck())


@pytest.mark.slow
@pytest.mark.parametrize("sanitizer", ["address,undefined", "thread"])
def test_sanitizers_find_nothing(mock3, host, tmp_path, sanitizer):
    options = "-g", f"-fsanitize={sanitizer}", "-fno-sanitize-recover=all"
    try:
        checked, library = host(*options), mock_unit.library(tmp_path, *options)
    except subprocess.CalledProcessError:
        pytest.skip(f"the compiler has no -fsanitize={sanitizer}")
    for what in (("run", 100, 0), ("threads", 4, 0), ("fuzz", 1_000_000, 3)):
        mock3.hosted(checked, *what, binary=library)


@pytest.mark.slow
@pytest.mark.parametrize("sanitizer", ["address,undefined", "thread"])
def test_sanitizers_find_nothing_around_the_real_kernels(real3, host, sanitizer, tmp_path):
    options = "-g", f"-fsanitize={sanitizer}", "-fno-sanitize-recover=all"
    try:
        watched = host(*options)
        library = real_unit.watched_library(real3.unit, tmp_path, options)
    except subprocess.CalledProcessError:
        pytest.skip(f"the compiler has no -fsanitize={sanitizer}, or the library came without its objects")
    for what in (("run", 60, 0), ("threads", 3, 0), ("fuzz", 50_000, 3)):
        real3.hosted(watched, *what, binary=library)


# ------------------------------------------------------------------ what Windows sees


@pytest.mark.slow
def test_windows_sees_every_function_of_both_versions(tmp_path):
    """In the table of exports of the library for Windows; 34 functions of FMI 2.0 for co-simulation and 75 of 3.0."""
    pytest.importorskip("ziglang", reason="needs PyPI's ziglang")
    command = sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-windows-gnu"
    library = mock_unit.library(tmp_path, "-s", command=command)
    exported = set(re.findall(r"\bfmi[23]\w+", gates.said("objdump", "-p", library)))
    assert exported == gates.declared() and len(exported) == 34 + 75
