"""Run an SSP in FMPy's simulator: SSP STEP COUNT OUT UNIT.VARIABLE …; OUT is a JSON list of rows.

It reads no parameter sets from the archive and sets numbers only, so that these are given to it; ``gas.source`` is left
at ``auto``. Its rows carry the time of the step's begin, and one more comes where times that add up stay below the end.
"""

import json
import sys

from benchmarks.masters.archive import read_archive
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import Parameter, ParameterSet

ssp, step, count, out, *names = sys.argv[1:]
start = ParameterSet(name="start")
start.parameters = [
    Parameter(name=f"{unit}.{variable}", type="Real", value=value)
    for unit, variable, kind, value in read_archive(ssp).values
    if kind == "Real"
]
rows = simulate_ssp(ssp, stop_time=float(step) * int(count), step_size=float(step), parameter_set=start)
with open(out, "w") as file:
    json.dump([[float(rows[name][k]) for name in names] for k in range(int(count))], file)
