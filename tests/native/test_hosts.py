"""Native FMUs of both versions in a host without Python: calls at random, valgrind and sanitizers."""

import re

import pytest
import real_unit
from gates import tool
from hosted_units import HOSTS, REALS, VERSIONS, Mock, Mock3, watched_pair
from mock_unit import compiler
from plain_host import plain_host

SANITIZERS = pytest.mark.parametrize("sanitizer", ["address,undefined", "thread"])


@pytest.fixture(scope="module")
def host(tmp_path_factory):
    """The plain host for a unit, compiled with further options."""
    if compiler() is None:
        pytest.skip("needs a C compiler: gcc or clang")
    return lambda unit, *options: plain_host(tmp_path_factory.mktemp("host"), *options, name=HOSTS[unit.fmi])


@pytest.fixture(scope="module", params=VERSIONS)
def small(request, unpacked, binary, tmp_path_factory):
    return Mock(unpacked) if request.param == "2.0" else Mock3(binary, tmp_path_factory.mktemp("resources"))


@pytest.fixture(scope="module", params=VERSIONS)
def module(request, module_name, tmp_path_factory):
    folder = tmp_path_factory.mktemp(module_name)
    return REALS[request.param](real_unit.unpacked(module_name, folder, fmi=request.param))


@pytest.fixture(scope="module", params=["combustion_i6", "valvetrain_i6"])
def module_name(request):
    return request.param


@pytest.fixture(scope="module", params=VERSIONS)
def engine(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("engine")
    return REALS[request.param](real_unit.opened(real_unit.engine_fmu(folder, fmi=request.param)))


def runs_without_python(unit, host, steps):
    """To the bit, where the environment is empty: from restored, reset and serialized instances, in threads at once."""
    found, log = unit.hosted(host, "run", steps, 0)
    assert found == unit.from_python(steps) and log == ""
    found, log = unit.hosted(host, "threads", 3, 0)
    assert found == unit.from_python(50) and log == ""


def unharmed(unit, host, count, seed):
    """The host compares what runs behind the calls; here with a run that never saw one."""
    found, log = unit.hosted(host, "fuzz", count, seed)
    assert found == unit.from_python(10)
    return {kind: int(n) for n, kind in re.findall(r"(\d+) (ok|discarded|refused)", log)}


def test_a_host_without_python_finds_the_same(small, host):
    runs_without_python(small, host(small), 100)


def test_the_modules_do_so_too(module, host):
    runs_without_python(module, host(module), 60)


def test_a_hundred_thousand_calls_at_random_do_no_harm(small, host):
    counts = unharmed(small, host(small), 100_000, 15)
    assert len(counts) == 3 and min(counts.values()) > small.rare


@pytest.mark.slow
def test_a_million_calls_at_random_do_a_module_no_harm(module, host):
    unharmed(module, host(module), 1_000_000, 17)


@pytest.mark.slow
def test_an_engine_runs_and_is_called_at_random(engine, host):
    made = host(engine)
    runs_without_python(engine, made, 60)
    unharmed(engine, made, 20_000, 17)


# ------------------------------------------------------------------ what watches memory


def memcheck():
    return tool("valgrind"), "-q", "--error-exitcode=9", "--leak-check=full", "--show-leak-kinds=all"


@pytest.mark.slow
def test_memcheck_finds_nothing(small, host):
    plain = host(small)
    for what in (("run", 100, 0), ("threads", 4, 0), ("fuzz", 100_000, 3)):
        small.hosted(plain, *what, before=memcheck())


@pytest.mark.slow
def test_memcheck_finds_nothing_in_the_real_kernels(module, host):
    plain = host(module)
    for what in (("run", 60, 0), ("threads", 2, 0), ("fuzz", 5_000, 3)):
        module.hosted(plain, *what, before=memcheck())


@pytest.mark.slow
def test_memcheck_finds_nothing_in_an_engine(engine, host):
    engine.hosted(host(engine), "run", 4, 0, before=memcheck())


@pytest.mark.slow
@SANITIZERS
def test_sanitizers_find_nothing(small, host, tmp_path, sanitizer):
    checked, library = watched_pair(small, host, tmp_path, sanitizer)
    for what in (("run", 100, 0), ("threads", 4, 0), ("fuzz", 1_000_000, 3)):
        small.hosted(checked, *what, binary=library)


@pytest.mark.slow
@SANITIZERS
def test_sanitizers_find_nothing_around_the_real_kernels(module, host, tmp_path, sanitizer):
    """The shim and the host are watched; the kernels' machine code is what it is, but its memory is the shim's."""
    checked, library = watched_pair(module, host, tmp_path, sanitizer)
    for what in (("run", 60, 0), ("threads", 3, 0), ("fuzz", 50_000, 3)):
        module.hosted(checked, *what, binary=library)
