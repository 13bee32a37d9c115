"""Tools that have to be built from their sources: fmusim (Reference-FMUs) and fmuCheck (FMU Compliance Checker).

They run where they are on the path, with an environment that is empty but for a folder for temporary files.
"""

import csv
import shutil
import subprocess

import numpy as np
import pytest
from fmpy import simulate_fmu

pytestmark = pytest.mark.slow
STEP, END = 1e-4, 0.01
TOOLS = {
    "fmusim": ("--interface-type", "cs", "--stop-time", END, "--output-interval", STEP, "--output-file"),
    "fmuCheck": ("-k", "cs", "-h", STEP, "-s", END, "-l", 4, "-o"),
}
OTHER_VERSION = "Mismatch of attribute 'fmiVersion' in modelDescription.xml: '2.0' and terminalsAndIcons.xml: '3.0'"
"""What the newest FMI Library says of a file that FMI 2.0 has borrowed from 3.0; it reads on."""


@pytest.mark.parametrize("name", TOOLS)
def test_a_tool_finds_what_fmpy_finds(name, real, tmp_path):
    tool = shutil.which(name)
    if tool is None:
        pytest.skip(f"needs {name} on the path, built from its sources")
    fmu, found = real.folder.with_suffix(".fmu"), tmp_path / "found.csv"
    command = [tool, *map(str, TOOLS[name]), str(found), str(fmu)]
    done = subprocess.run(command, capture_output=True, text=True, env={"TMPDIR": str(tmp_path)})
    assert done.returncode == 0 or "Simulation finished successfully" in done.stderr, done.stderr[-2000:]
    wrong = [line for line in (done.stdout + done.stderr).splitlines() if line.startswith(("[ERROR]", "[FATAL]"))]
    assert [line for line in wrong if OTHER_VERSION not in line and "FMI3XML] Parse error at line" not in line] == []
    *_, last = csv.DictReader(found.open())
    expected = simulate_fmu(str(fmu), stop_time=END, output_interval=STEP, set_stop_time=False)[-1]
    values = {key.strip('"'): float(value) for key, value in last.items()}
    compared = [key for key in expected.dtype.names if key in values and not key.startswith(("balance.", "solver."))]
    assert len(compared) > 50
    for key in compared:
        np.testing.assert_allclose(values[key], expected[key], rtol=1e-9, atol=1e-15, err_msg=key)
