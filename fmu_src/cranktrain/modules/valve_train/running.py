"""Functions that a valve-train FMU calls: read its data, make a simulation."""

from cranktrain.modules.module_running import ModuleRunning
from cranktrain.modules.valve_train.settings import TrainSettings
from cranktrain.modules.valve_train.simulation import ValveTrainSimulation

SETTINGS = TrainSettings
_RUNNING = ModuleRunning(SETTINGS, ValveTrainSimulation)
read_model, simulation = _RUNNING.read_model, _RUNNING.simulation
announced_compilation = _RUNNING.announced_compilation
