"""Tools that have to be built from their sources: fmusim (Reference-FMUs) and fmuCheck (FMU Compliance Checker).

They run where they are on the path, with an environment that is empty but for a folder for temporary files.
"""

import csv
import shutil
import subprocess

import numpy as np
import pytest
from fmpy import simulate_fmu

from cranktrain.fmu.build import build_fmu
from cranktrain.modules.register import module_files

pytestmark = pytest.mark.slow
STEP, END = 1e-4, 0.01
TOOLS = {
    "fmusim": ("--interface-type", "cs", "--stop-time", END, "--output-interval", STEP, "--output-file"),
    "fmuCheck": ("-k", "cs", "-h", STEP, "-s", END, "-l", 4, "-o"),
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
    expected = simulate_fmu(str(fmu), stop_time=END, output_interval=STEP, set_stop_time=False)[-1]
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
    expected = simulate_fmu(str(fmu), stop_time=END, output_interval=STEP, set_stop_time=False)[-1]
    assert set(expected.dtype.names) == set(found)
    for key in found:
        values = [float(f"{value:.16g}") for value in np.ravel(expected[key])]
        assert [float(text) for text in found[key].split()] == values, key
