"""The library of a native FMU: what it needs, what it may write, and that a host without Python runs it."""

import re
import sys

import gates
import mock_unit
import pytest
from gates import tool
from mock_unit import REFERENCE, compiler
from plain_host import hosted, plain_host

FIRST, LAST = REFERENCE["position"], REFERENCE["energy"]


@pytest.mark.parametrize(
    "gate",
    [
        gates.nothing_but_libc_and_libm_is_needed,
        gates.nothing_but_the_interface_is_shown,
        gates.there_is_no_writable_data,
    ],
)
def test_it_is_what_every_library_is(gate, binary):
    gate(binary)


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


@pytest.fixture(scope="module")
def host(tmp_path_factory):
    """The plain host, compiled with further options."""
    if compiler() is None:
        pytest.skip("needs a C compiler: gcc or clang")
    return lambda *options: plain_host(tmp_path_factory.mktemp("host"), *options)


def from_python(unit, steps, levels):
    one = unit()
    one.set("String", {REFERENCE[name]: text for name, text in levels.items()})
    values = one.start().run(steps).get("Real", *range(FIRST, LAST + 1))
    return [value.hex() for value in values]


@pytest.mark.parametrize("levels", [{}, {"spring.level": "stiff"}, {"mount.level": "free"}])
def test_a_host_without_python_finds_the_same(host, binary, unpacked, unit, levels):
    """To the bit, in one thread, from restored and reset instances, and in four threads at once."""
    texts = [f"{REFERENCE[name]}={text}" for name, text in levels.items()]
    plain = host()
    found, log = hosted(plain, unpacked, "run", 100, 0, texts=texts)
    assert found == from_python(unit, 100, levels) and log == ""
    found, log = hosted(plain, unpacked, "threads", 4, 0, texts=texts)
    assert found == from_python(unit, 50, levels) and log == ""


# ------------------------------------------------------------------ what Windows sees


@pytest.mark.slow
def test_windows_sees_every_function_of_both_versions(tmp_path):
    """In the table of exports of the library for Windows; 34 functions of FMI 2.0 for co-simulation and 75 of 3.0."""
    pytest.importorskip("ziglang", reason="needs PyPI's ziglang")
    command = sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-windows-gnu"
    library = mock_unit.library(tmp_path, "-s", command=command)
    exported = set(re.findall(r"\bfmi[23]\w+", gates.said("objdump", "-p", library)))
    assert exported == gates.declared() and len(exported) == 34 + 75
