"""Native FMUs for other machines, made on this one: Windows under Wine, ARM under QEMU; and in other people's tools."""

import csv
import os
import shutil
import subprocess
import sys

import gates
import numpy as np
import pytest
import real_unit
from fmpy import simulate_fmu
from mock_unit import compiler
from plain_host import hosted, plain_host
from real_unit import STEP

from cranktrain.core.errors import InputError
from cranktrain.core.machine_code import this_platform
from cranktrain.fmu.build import build_fmu
from cranktrain.fmu.native.link import compiler as compiler_for
from cranktrain.fmu.native.platforms import PLATFORMS
from cranktrain.modules.register import module_files

pytestmark = pytest.mark.slow
WINE = next((found for name in ("wine64", "/usr/lib/wine/wine64", "wine") if (found := shutil.which(name))), None)
CLOSE = 1e-8
"""Of the largest output of a unit: bits differ, since another system has another mathematical library."""


def command_for(platform):
    """A compiler of hosts for a platform; skips where there is none."""
    try:
        return tuple(compiler_for(PLATFORMS[platform]))
    except InputError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def hosts(tmp_path_factory):
    """The plain host for this machine and for Windows, and how the latter is run."""
    if compiler() is None or WINE is None:
        pytest.skip("needs a C compiler and Wine")
    folder = tmp_path_factory.mktemp("hosts")
    command = command_for("win64")
    foreign = plain_host(folder, "-D__USE_MINGW_ANSI_STDIO=1", command=command, suffix=".exe")
    home = {name: str(folder / "home") for name in ("HOME", "WINEPREFIX")}
    (folder / "home").mkdir()
    return plain_host(folder), foreign, {**home, "WINEDEBUG": "-all", "PATH": os.environ["PATH"], "DISPLAY": ""}


def is_close(unit, ours, theirs):
    """Outputs within CLOSE of the largest of their unit."""
    units = [v.unit for v in unit.about.modelVariables if v.causality == "output"]
    ours, theirs = (np.array([float.fromhex(value) for value in values]) for values in (ours, theirs))
    largest = np.array([max(abs(x) for x, other in zip(ours, units, strict=True) if other == u) for u in units])
    np.testing.assert_array_less(np.abs(ours - theirs), CLOSE * largest + 1e-300)


def runs_on_windows(unit, hosts):
    ours, theirs, environment = hosts
    texts = [f"{reference}={text}" for reference, text in unit.texts().items()]
    for what in (("run", 200, 0), ("threads", 3, 0)):
        expected, _ = hosted(ours, unit.folder, *what, texts=texts, step=STEP)
        binary = unit.binary("win64", ".dll")
        found, _ = hosted(
            theirs, unit.folder, *what, texts=texts, step=STEP, before=(WINE,), binary=binary, **environment
        )
        is_close(unit, expected, found)


@pytest.mark.parametrize("name", ["combustion_i6", "valvetrain_i6"])
def test_a_module_runs_on_windows(name, hosts, tmp_path):
    """From restored, reset and serialized states to the same bits there, and in threads."""
    runs_on_windows(real_unit.unpacked(name, tmp_path, ("linux64", "win64")), hosts)


def test_an_engine_runs_on_windows(hosts, tmp_path):
    unit = real_unit.opened(real_unit.engine_fmu(tmp_path, ("linux64", "win64")))
    assert max(unit.binary(*of).stat().st_size for of in (("linux64", ".so"), ("win64", ".dll"))) < 4e6
    runs_on_windows(unit, hosts)


def test_windows_needs_its_own_libraries_alone(tmp_path):
    unit = real_unit.unpacked("combustion_i6", tmp_path, ("win64",))
    command_for("win64")
    listed = gates.said("objdump", "-p", unit.binary("win64", ".dll"))
    needed = {line.split()[-1].lower() for line in listed.splitlines() if "DLL Name" in line}
    assert needed <= {"kernel32.dll", "msvcrt.dll"} | {n for n in needed if n.startswith("api-ms-win-crt-")}, needed


@pytest.mark.parametrize("processor", ["Nehalem", "Haswell"])
def test_a_processor_takes_the_code_that_it_can_run(processor, tmp_path):
    """One without 256-bit vectors, of 2008, and one with them, emulated; libm has another code for the former too."""
    emulator = shutil.which("qemu-x86_64-static") or shutil.which("qemu-x86_64")
    if emulator is None or compiler() is None or this_platform() != "linux64":
        pytest.skip("needs a C compiler and qemu-x86_64")
    unit = real_unit.unpacked("combustion_i6", tmp_path)
    texts = [f"{reference}={text}" for reference, text in unit.texts().items()]
    host = plain_host(tmp_path)
    expected, _ = hosted(host, unit.folder, "run", 60, 0, texts=texts, step=STEP)
    before = (emulator, "-cpu", processor)
    found, _ = hosted(host, unit.folder, "run", 60, 0, texts=texts, step=STEP, before=before)
    is_close(unit, expected, found)
    assert found == expected or processor == "Nehalem"


def test_a_library_for_arm_links_and_runs_where_it_can(tmp_path):
    platform = "aarch64-linux"
    command = command_for(platform)
    unit = real_unit.unpacked("combustion_i6", tmp_path, ("linux64", platform))
    binary = unit.binary(platform)
    header = gates.said("readelf", "-h", binary)
    assert "AArch64" in header and "DYN (Shared object file)" in header
    needed = {line.split()[-1] for line in gates.said("readelf", "-d", binary).splitlines() if "(NEEDED)" in line}
    assert needed <= {"[libm.so.6]", "[libc.so.6]", "[ld-linux-aarch64.so.1]"}, needed
    emulator, system = shutil.which("qemu-aarch64-static") or shutil.which("qemu-aarch64"), "/usr/aarch64-linux-gnu"
    if emulator is None or not os.path.isdir(system) or sys.platform != "linux":
        pytest.skip("linked; to run it needs qemu-aarch64 and the C library of ARM (libc6-arm64-cross)")
    texts = [f"{reference}={text}" for reference, text in unit.texts().items()]
    (tmp_path / "ours").mkdir()
    ours, theirs = plain_host(tmp_path / "ours"), plain_host(tmp_path, command=command)
    expected, _ = hosted(ours, unit.folder, "run", 60, 0, texts=texts, step=STEP)
    found, _ = hosted(
        theirs, unit.folder, "run", 60, 0, texts=texts, step=STEP, before=(emulator, "-L", system), binary=binary
    )
    is_close(unit, expected, found)


pytestmark = pytest.mark.slow
SAMPLING, END = 1e-4, 0.01
TOOLS = {
    "fmusim": ("--interface-type", "cs", "--stop-time", END, "--output-interval", SAMPLING, "--output-file"),
    "fmuCheck": ("-k", "cs", "-h", SAMPLING, "-s", END, "-l", 4, "-o"),
}
OTHER_VERSION = "Mismatch of attribute 'fmiVersion' in modelDescription.xml: '2.0' and terminalsAndIcons.xml: '3.0'"
"""What the newest FMI Library says of a file that FMI 2.0 has borrowed from 3.0; it reads on."""


def ran(name, fmu, folder):
    """Last row of a tool's table, as texts by variable; skips without the tool."""
    tool = shutil.which(name)
    if tool is None:
        pytest.skip(f"needs {name} on the path, built from its sources")
    found = folder / "found.csv"
    command = [tool, *map(str, TOOLS[name]), str(found), str(fmu)]
    done = subprocess.run(command, capture_output=True, text=True, env={"TMPDIR": str(folder)})
    assert done.returncode == 0 or "Simulation finished successfully" in done.stderr, done.stderr[-2000:]
    wrong = [line for line in (done.stdout + done.stderr).splitlines() if line.startswith(("[ERROR]", "[FATAL]"))]
    assert [line for line in wrong if OTHER_VERSION not in line and "FMI3XML] Parse error at line" not in line] == []
    *_, last = csv.DictReader(found.open())
    return {key.strip('"'): text for key, text in last.items()}


@pytest.mark.parametrize("name", TOOLS)
def test_a_tool_finds_what_fmpy_finds(name, real, tmp_path):
    fmu = real.folder.with_suffix(".fmu")
    values = {key: float(text) for key, text in ran(name, fmu, tmp_path).items()}
    expected = simulate_fmu(str(fmu), stop_time=END, output_interval=SAMPLING, set_stop_time=False)[-1]
    compared = [key for key in expected.dtype.names if key in values and not key.startswith(("balance.", "solver."))]
    assert len(compared) > 50
    for key in compared:
        np.testing.assert_allclose(values[key], expected[key], rtol=1e-9, atol=1e-15, err_msg=key)


@pytest.mark.parametrize("module", ["combustion_i6", "valvetrain_i6", "diesel_i6", "single_petrol"])
def test_fmusim_finds_the_same_in_fmi_3_to_the_last_printed_digit(module, tmp_path):
    """It prints 16 digits, of arrays one value behind the other; FMPy and it add up the same times."""
    if shutil.which("fmusim") is None:
        pytest.skip("needs fmusim on the path, built from its sources")
    if module in module_files():
        fmu = build_fmu(module, tmp_path, platforms=("linux64",), fmi="3.0")
    else:
        fmu = build_fmu(module, tmp_path, film_table=False, block=False, platforms=("linux64",), fmi="3.0")
    found = ran("fmusim", fmu, tmp_path)
    expected = simulate_fmu(str(fmu), stop_time=END, output_interval=SAMPLING, set_stop_time=False)[-1]
    assert set(expected.dtype.names) == set(found)
    for key in found:
        values = [float(f"{value:.16g}") for value in np.ravel(expected[key])]
        assert [float(text) for text in found[key].split()] == values, key
