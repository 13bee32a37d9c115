"""Valve trains for tests: the six's, one cylinder of it, or a rigid one; runs and their outputs by name."""

import math
from dataclasses import replace
from functools import cache

import numpy as np

from cranktrain.modules.register import module_files
from cranktrain.modules.valve_train.file import load
from cranktrain.modules.valve_train.simulation import ValveTrainSimulation

RPM = math.pi / 30.0
CYCLE = 4.0 * math.pi
RIGID = {
    "stiffness": 1e9, "drive_stiffness": 1e9, "backlash": 0.0, "spring_mass": 1e-4, "seat_stiffness": 1e9,
    "damping_velocity": 0.01, "lash": 0.0,
}  # fmt: skip
"""Train, drive and seat that hardly give way and do not rebound, springs that hardly surge."""
FREE = {"friction": 0.0, "camshaft_drag": 0.0}


@cache
def six():
    return load(module_files()["valvetrain_i6"])


def single(**changes):
    """Settings of one cylinder of the six, with changes."""
    return replace(six(), **{"firing_angles": (0.0,), **changes})


def running(settings, speed_rpm=2000.0, angle=0.0):
    """Simulation at a speed, started."""
    simulation = ValveTrainSimulation(settings)
    simulation.inputs[:] = speed_rpm * RPM, angle
    simulation.initialize()
    return simulation


def turn(simulation, degrees, step_deg=1.0):
    """Outputs after each of the steps that turn the crank by an angle, (steps, outputs)."""
    h = math.radians(step_deg) / simulation.inputs[0]
    start, rows = simulation.time, []
    for k in range(round(degrees / step_deg)):
        simulation.step(start + (k + 1) * h)
        rows.append(simulation.outputs.copy())
    return np.array(rows)


def output(simulation, rows, name):
    return np.array(rows[..., simulation.output_names.index(name)])
