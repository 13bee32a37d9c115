"""Run an SSP in libcosim: SSP STEP COUNT OUT UNIT.VARIABLE …; OUT is a JSON list of rows."""

import json
import sys
import tempfile
import zipfile

from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimObserver import CosimObserver

ssp, step, count, out, *names = sys.argv[1:]
log_output_level(CosimLogLevel.WARNING)
with tempfile.TemporaryDirectory() as folder:
    zipfile.ZipFile(ssp).extractall(folder)
    execution = CosimExecution.from_ssp_file(f"{folder}/SystemStructure.ssd", step_size=round(float(step) * 1e9))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    places = []
    for name in names:
        unit, _, variable = name.partition(".")
        slave = execution.slave_index_from_instance_name(unit)
        references = {row.name.decode(): row.reference for row in execution.slave_variables(slave)}
        places.append((slave, references[variable]))
    rows = []
    for _ in range(int(count)):
        if not execution.step():
            sys.exit(f"libcosim: step {len(rows)} failed")
        rows.append([observer.last_real_values(slave, [reference])[0] for slave, reference in places])
with open(out, "w") as file:
    json.dump(rows, file)
