"""Combustion models for tests: the six's cylinders, one of them, or one of constant gas."""

import math
from dataclasses import replace
from functools import cache

import numpy as np

from cranktrain.modules.combustion.file import load
from cranktrain.modules.combustion.simulation import CombustionSimulation
from cranktrain.modules.register import module_files

RPM = math.pi / 30.0


@cache
def six():
    return load(module_files()["combustion_i6"])


def single(**changes):
    """Settings of one cylinder of the six, with changes."""
    return replace(six(), firing_angles=(0.0,), **changes)


def running(settings, speed_rpm=2000.0, gas=None, angle=0.0, **inputs):
    """Simulation at a speed, started; inputs by name, ``fuel_mass`` and the like of all cylinders."""
    simulation = CombustionSimulation(settings, gas)
    simulation.inputs[0] = speed_rpm * RPM
    simulation.inputs[1] = angle
    for name, value in inputs.items():
        for k, known in enumerate(simulation.input_names):
            if known.replace(".", "_") == name or known.endswith(f"].{name}"):
                simulation.inputs[k] = value
    simulation.initialize()
    return simulation


def turn(simulation, degrees, step_deg=1.0):
    """Outputs after each of the steps that turn the crank by an angle, (steps, outputs)."""
    h = math.radians(step_deg) / simulation.inputs[0]
    rows = []
    start = simulation.time
    for k in range(round(degrees / step_deg)):
        simulation.step(start + (k + 1) * h)
        rows.append(simulation.outputs.copy())
    return np.array(rows)


def output(simulation, rows, name):
    return rows[..., simulation.output_names.index(name)]
