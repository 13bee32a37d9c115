"""FMI clients that we did not write, and how each runs one FMU at its start values; see ``clients.py``.

A script gets a file of JSON: ``fmu``, ``steps``, ``step`` (s), ``outputs`` and ``references`` (value references), and
``starts`` (start values of inputs). It prints one line of JSON, the values of the outputs after the last step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

_HEAD = """
import json, sys
job = json.load(open(sys.argv[1]))
path, steps, step, names = job["fmu"], job["steps"], job["step"], job["outputs"]
"""
_FOOT = """
flat = [float(one) for value in values for one in (value if hasattr(value, "__len__") else [value])]
print('VALUES', json.dumps(flat))
"""


@dataclass(frozen=True)
class Client:
    """One client.

    Attributes
    ----------
    packages : what pip installs besides numpy and numba, which Python's FMUs need
    body : of its script, which leaves the ``values`` of the outputs
    libraries : whether packages bring libraries that it must be shown
    arrays : whether it reads arrays of FMI 3.0
    """

    packages: tuple[str, ...]
    body: str
    libraries: bool = False
    arrays: bool = False

    @property
    def script(self) -> str:
        """The whole script."""
        return f"{_HEAD}{self.body}{_FOOT}"


REFERENCE = """
from fmpy import simulate_fmu
found = simulate_fmu(path, stop_time=steps * step, output_interval=step, output=names, set_stop_time=False)
values = [found[name][-1] for name in names]
"""
"""Body of the run by FMPy that the others are compared with."""

CLIENTS = {
    "libcosimpy": Client(
        ("libcosimpy==0.0.6",),
        """
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave
execution = CosimExecution.from_step_size(round(1e9 * step))
unit = execution.add_local_slave(CosimLocalSlave(path, "unit"))
observer = CosimObserver.create_last_value()
execution.add_observer(observer)
assert execution.step(steps)
values = observer.last_real_values(unit, job["references"])
""",
    ),
    "ecospy": Client(
        ("ecospy==0.7.2", "tbb"),
        """
from ecospy import EcosSimulation, EcosSimulationStructure
with EcosSimulationStructure() as structure:
    structure.add_model("unit", path)
    with EcosSimulation(step, structure=structure) as simulation:
        simulation.init()
        simulation.step(steps)
        values = [simulation.get_real(f"unit::{name}") for name in names]
        simulation.terminate()
""",
        libraries=True,
    ),
    "sofirpy": Client(
        ("sofirpy==1.0.2",),
        """
from sofirpy import simulate
found = simulate(stop_time=steps * step, step_size=step, fmu_paths={"unit": path}, parameters_to_log={"unit": names})
values = [found[f"unit.{name}"].iloc[-1] for name in names]
""",
    ),
    "gemseo-fmu": Client(
        ("gemseo-fmu==3.1.1",),
        """
from gemseo_fmu.disciplines.fmu_discipline import FMUDiscipline
run = FMUDiscipline(path, None, names, initial_time=0.0, final_time=steps * step, time_step=step)
found = run.execute()
values = [found[name][-1] for name in names]
""",
    ),
    "cofmupy": Client(
        ("cofmupy==1.0.0",),
        """
import os, tempfile
from cofmupy import Coordinator
unit = {"id": "unit", "name": "unit", "path": path, "initialization": job["starts"]}
with tempfile.TemporaryDirectory() as folder:
    file = os.path.join(folder, "system.json")
    system = {"fmus": [unit], "connections": [], "edge_sep": " -> ", "root": folder,
              "cosim_method": "jacobi", "iterative": False}
    json.dump(system, open(file, "w"))
    master = Coordinator()
    master.start(file)
    for _ in range(steps):
        master.do_step(step)
    values = [master.get_variable(("unit", name))[0] for name in names]
""",
    ),
}
"""The clients by the name that pip knows. cofmupy sets inputs that nobody names to 0, so it is given the starts."""

CLIENTS_3 = {
    "fmuloader": Client(
        ("fmuloader==0.1.2rc0", "fmureader==0.1.2"),
        """
from fmuloader.fmi3 import Fmi3Slave
from fmureader.fmi3 import read_model_description
about = read_model_description(path)
with Fmi3Slave(path, model_identifier=about.co_simulation.model_identifier) as unit:
    unit.instantiate_co_simulation("unit", instantiation_token=about.instantiation_token)
    unit.enter_initialization_mode(start_time=0.0)
    unit.exit_initialization_mode()
    for k in range(steps):
        unit.do_step(k * step, step)
    values = unit.get_float64(job["references"])
    unit.terminate()
""",
    ),
    "ecospy": CLIENTS["ecospy"],
    "gemseo-fmu": replace(CLIENTS["gemseo-fmu"], arrays=True),
}
"""Those that read FMI 3.0; without ``arrays`` a client is asked for scalars alone."""

ONE_VALUE_EACH = {
    "pathsim-fmi": Client(
        ("pathsim-fmi==0.1.1",),
        """
import numpy
from pathsim import Simulation
from pathsim_fmi import CoSimulationFMU
unit = CoSimulationFMU(path, dt=step)
unit.inputs.update_from_array(numpy.hstack(list(job["starts"].values())))
Simulation([unit], dt=step, log=False).run((steps - 0.5) * step)
values = [float(unit.fmu_wrapper.get_real([reference])[0]) for reference in job["references"]]
""",
    ),
    "cofmupy": CLIENTS["cofmupy"],
}
"""Those that read FMI 3.0 and ask for one value of each variable, arrays too, which is refused."""
