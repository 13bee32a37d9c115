"""Functions that a combustion FMU calls: read its data, make a simulation."""

from cranktrain.modules.combustion.settings import CycleSettings
from cranktrain.modules.combustion.simulation import CombustionSimulation
from cranktrain.modules.module_running import ModuleRunning

SETTINGS = CycleSettings
_RUNNING = ModuleRunning(SETTINGS, CombustionSimulation)
read_model, simulation = _RUNNING.read_model, _RUNNING.simulation
announced_compilation = _RUNNING.announced_compilation
