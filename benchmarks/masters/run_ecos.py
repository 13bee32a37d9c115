"""Run an SSP in Ecos: SSP STEP COUNT OUT UNIT.VARIABLE …; OUT is a JSON list of rows."""

import json
import sys

from ecospy import EcosSimulation

ssp, step, count, out, *names = sys.argv[1:]
wanted = ["::".join(name.partition(".")[::2]) for name in names]
with EcosSimulation(ssp_path=ssp, step_size=float(step)) as simulation:
    simulation.init()
    rows = []
    for _ in range(int(count)):
        simulation.step()
        rows.append([simulation.get_real(name) for name in wanted])
    simulation.terminate()
with open(out, "w") as file:
    json.dump(rows, file)
