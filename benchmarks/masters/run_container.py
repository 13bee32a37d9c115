"""Run units of an SSP as one FMU of fmucontainer: ``SSP STEP COUNT OUT TOOL FIRST UNIT.VARIABLE …``.

TOOL is the path of ``fmucontainer``. FIRST is the unit with which each step begins, the others follow in the archive's
order; empty: all step at once. The container's own reader of SSP leaves start values and outputs out, so
that its own format is written from the archive. OUT is a JSON list of rows.
"""

import json
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import fmpy
from benchmarks.masters.archive import read_archive

ssp, step, count, out, tool, first, *names = sys.argv[1:]
system = read_archive(ssp)
fmus = {unit: Path(source).name for unit, source in system.units.items()}
container = {
    "name": "Container.fmu",
    "sequential": bool(first),
    "auto_link": False, "auto_input": False, "auto_output": False, "auto_parameter": False,
    "step_size": float(step),
    "fmu": [fmus[unit] for unit in sorted(fmus, key=lambda unit: unit != first)],
    "link": [[fmus[a], output, fmus[b], taken] for a, output, b, taken in system.links],
    "start": [[fmus[unit], variable, value] for unit, variable, _, value in system.values],
    "output": [[fmus[unit], variable, f"{unit}.{variable}"] for unit, _, variable in (n.partition(".") for n in names)],
}  # fmt: skip
with tempfile.TemporaryDirectory() as folder:
    with zipfile.ZipFile(ssp) as archive:
        for source in system.units.values():
            Path(folder, Path(source).name).write_bytes(archive.read(source))
    Path(folder, "container.json").write_text(json.dumps(container))
    command = [tool, "-container", "container.json", "-fmu-directory", folder]
    made = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    whole = Path(folder, "Container.fmu")
    if made.returncode or not whole.exists():
        sys.exit(f"fmucontainer: {made.stderr or made.stdout}")
    stop = float(step) * int(count)
    rows = fmpy.simulate_fmu(str(whole), stop_time=stop, output_interval=float(step), output=names)
with open(out, "w") as file:
    json.dump([[float(row[name]) for name in names] for row in rows[1 : int(count) + 1]], file)
