"""Native FMUs of both versions in a host without Python: calls at random, valgrind and sanitizers."""

import re

import pytest
import real_unit
from gates import tool
from hosted_units import HOSTS, REALS, VERSIONS, Mock, Mock3, watched_pair
from mock_unit import compiler
from plain_host import plain_host


@pytest.fixture(scope="module")
def host(tmp_path_factory):
    """The plain host for a unit, compiled with further options."""
    if compiler() is None:
        pytest.skip("needs a C compiler: gcc or clang")
    return lambda unit, *options: plain_host(tmp_path_factory.mktemp("host"), *options, name=HOSTS[unit.fmi])


MOCKS = [("mock", fmi) for fmi in VERSIONS]
MODULES = [(name, fmi) for name in ("combustion_i6", "valvetrain_i6") for fmi in VERSIONS]
of_mocks = pytest.mark.parametrize("small", MOCKS, indirect=True, ids=" ".join)
of_modules = pytest.mark.parametrize("small", MODULES, indirect=True, ids=" ".join)


@pytest.fixture(scope="module", params=MOCKS + MODULES, ids=" ".join)
def small(request, unpacked, binary, tmp_path_factory):
    """The mock or a module of either version."""
    name, fmi = request.param
    folder = tmp_path_factory.mktemp(name)
    if name != "mock":
        return REALS[fmi](real_unit.unpacked(name, folder, fmi=fmi))
    return Mock(unpacked) if fmi == "2.0" else Mock3(binary, folder)


def amounts(unit):
    """Steps, threads and calls under a watch, which is slow: less of the real kernels."""
    return (100, 4, 100_000) if isinstance(unit, Mock) else (60, 2, 5_000)


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
    runs_without_python(small, host(small), amounts(small)[0])


@of_mocks
def test_a_hundred_thousand_calls_at_random_do_no_harm(small, host):
    counts = unharmed(small, host(small), 100_000, 15)
    assert len(counts) == 3 and min(counts.values()) > small.rare


@pytest.mark.slow
@of_modules
def test_a_million_calls_at_random_do_a_module_no_harm(small, host):
    unharmed(small, host(small), 1_000_000, 17)


@pytest.mark.slow
def test_an_engine_runs_and_is_called_at_random(engine, host):
    made = host(engine)
    runs_without_python(engine, made, 60)
    unharmed(engine, made, 20_000, 17)


def memcheck():
    return tool("valgrind"), "-q", "--error-exitcode=9", "--leak-check=full", "--show-leak-kinds=all"


@pytest.mark.slow
def test_memcheck_finds_nothing(small, host):
    plain, (steps, threads, calls) = host(small), amounts(small)
    for what in (("run", steps, 0), ("threads", threads, 0), ("fuzz", calls, 3)):
        small.hosted(plain, *what, before=memcheck())


@pytest.mark.slow
def test_memcheck_finds_nothing_in_an_engine(engine, host):
    engine.hosted(host(engine), "run", 4, 0, before=memcheck())


@pytest.mark.slow
@pytest.mark.parametrize("sanitizer", ["address,undefined", "thread"])
def test_sanitizers_find_nothing(small, host, tmp_path, sanitizer):
    """Of a module shim and host are watched; its kernels are machine code, but their memory is the shim's."""
    checked, library = watched_pair(small, host, tmp_path, sanitizer)
    steps, threads, calls = amounts(small)
    for what in (("run", steps, 0), ("threads", threads, 0), ("fuzz", 10 * calls, 3)):
        small.hosted(checked, *what, binary=library)
